"""Fig. 4: the nine step responses of Table 4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from omnidyn.model.frames import AXES
from omnidyn.paper.experiments import StepResponse
from omnidyn.paper.tables import SPEED_UNIT
from omnidyn.report.style import (
    LEVEL_COLOURS,
    LEVEL_LINES,
    MEASURED,
    Picture,
    axis_panels,
    axis_title,
    dress_panel,
    look,
    note,
    picture,
)

SHOWN_S = 1.2  # of each response; the rest is steady


def draw_steps(responses: Mapping[str, Sequence[StepResponse]]) -> Picture:
    """One panel per axis, three steps each; a dot where Table 1 prints a speed for the same voltages."""
    with look():
        figure, panels = axis_panels(4.0, top=0.9, bottom=0.24)
        for axis, panel in zip(AXES, panels, strict=True):
            _steps_panel(panel, axis, responses[axis])
        figure.text(0.075, 0.03, _words(), fontsize=10)
        return picture("fig4_steps", "Fig. 4: nine voltage steps (Table 4)", _steps_caption(), figure)


def _words() -> str:
    return "Lines: simulated with Table 3.   Dots: steady speed printed in Table 1 for the same voltages."


def _steps_caption() -> str:
    return (
        "The steps of Table 4 from rest, simulated with the parameters of Table 3. Dots: the steady speed that Table 1 "
        "prints for the same voltages, where it has such a row."
    )


def _steps_panel(axes: Axes, axis: str, responses: Sequence[StepResponse]) -> None:
    for k, response in enumerate(responses):
        twist = response.run.twist
        assert twist is not None
        rows = response.run.t <= SHOWN_S
        speed, colour = twist[rows, AXES.index(axis)], LEVEL_COLOURS[k]
        axes.plot(response.run.t[rows], speed, LEVEL_LINES[k], color=colour)
        note(axes, 0.62 * SHOWN_S, response.settled_speed, f"{response.level:g} V", ha="center", va="center")
        if response.measured_speed is not None:
            axes.plot(
                [SHOWN_S] * 2,
                [response.settled_speed, response.measured_speed],
                color=colour,
                linewidth=1.2,
                clip_on=False,
            )
            axes.plot(
                [SHOWN_S],
                [response.measured_speed],
                "o",
                color=colour,
                markeredgecolor=MEASURED,
                markersize=8,
                clip_on=False,
                zorder=5,
            )
    axes.set_ylim(bottom=0.0)
    dress_panel(axes, f"{axis_title(axis)}: speed, {SPEED_UNIT[axis]}", "time, s", SHOWN_S)
