"""Fig. 3: force against steady speed, and the friction lines that one can draw through four points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.steady.line import confidence_band
from omnidyn.model.frames import AXES
from omnidyn.paper.tables import FORCE_UNIT, SPEED_UNIT, TABLE_1, TABLE_2_COULOMB, TABLE_2_VISCOUS
from omnidyn.report.style import (
    BLUE,
    INK,
    VERMILLION,
    Picture,
    axis_panels,
    axis_title,
    dress_panel,
    look,
    picture,
)

TREATMENTS = {
    "line": (BLUE, "-", "fit to all four rows (the paper), 95 % band"),
    "bound": (VERMILLION, "--", "fit to the three moving rows, 95 % band"),
}


def draw_friction(estimates: Mapping[str, Estimate]) -> Picture:
    """One panel per axis; `estimates` by the treatment of the row at rest, "line" and "bound"."""
    with look():
        figure, panels = axis_panels(4.6, top=0.92, bottom=0.33)
        for k, panel in enumerate(panels):
            _friction_panel(panel, k, estimates)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=2, columnspacing=1.5)
        return picture("fig3_friction", "Fig. 3: friction from steady speeds", _friction_caption(), figure)


def _friction_caption() -> str:
    return (
        "Force against steady speed: the rows of Table 1, the line through all four rows (as the paper does), "
        "the line through the three moving rows, each with its 95 % confidence band, and the line printed in "
        "Table 2. A robot at rest only shows that friction can hold that force: its row is a lower bound of "
        "breakaway, not a point of the line."
    )


def _friction_panel(axes: Axes, axis: int, estimates: Mapping[str, Estimate]) -> None:
    rows = TABLE_1[AXES[axis]]
    speed, force = np.array([row.speed for row in rows]), np.array([row.force for row in rows])
    span = np.linspace(0.0, 1.12 * speed.max(), 60)
    for rest, (colour, line, words) in TREATMENTS.items():
        _fit(axes, axis, estimates[rest], span, colour, line, words)
    printed = TABLE_2_VISCOUS[axis] * span + TABLE_2_COULOMB[axis]
    axes.plot(span, printed, ":", color=INK, linewidth=2.2, label="printed in Table 2")
    moving = speed != 0.0
    axes.plot(speed[moving], force[moving], "o", color=INK, markersize=7, zorder=5, label="Table 1, moving")
    axes.plot(
        speed[~moving],
        force[~moving],
        "o",
        color="white",
        markeredgecolor=INK,
        markeredgewidth=1.6,
        markersize=8,
        zorder=5,
        clip_on=False,
        label="Table 1, at rest",
    )
    axes.set_ylim(0.0, 1.35 * force.max())
    title = f"{axis_title(AXES[axis])}: force, {FORCE_UNIT[AXES[axis]]}"
    dress_panel(axes, title, f"speed, {SPEED_UNIT[AXES[axis]]}", span[-1])


def _fit(axes: Axes, axis: int, estimate: Estimate, span: FloatArray, colour: str, line: str, words: str) -> None:
    middle, half = confidence_band(estimate, axis, span)
    axes.fill_between(span, middle - half, middle + half, color=colour, alpha=0.16, linewidth=0)
    axes.plot(span, middle, line, color=colour, label=words)
