"""Which fitted numbers move together: their correlations, as a picture."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.estimate import Correlation
from omnidyn.logs.steady_table import AXES
from omnidyn.model.keys import find_key
from omnidyn.report.style import INK, WIDTH, Picture, look, new_figure, picture

MOST = 16
CLEAR = 0.6  # beyond it the ground is dark, and the number on it white


def draw_correlation(correlation: Correlation) -> Picture:
    """The lower triangle of the correlations, the number in each field; brown goes together, purple against."""
    names, matrix = correlation.names[:MOST], correlation.matrix[:MOST, :MOST]
    count = len(names)
    side = min(0.52 * count, 5.6)
    width, height = WIDTH, side + 0.5 + 1.0
    with look():
        figure = new_figure(width, height)
        axes = figure.add_axes((0.32, 1.0 / height, side / width, side / height))
        shown = np.where(np.tril(np.ones((count, count), dtype=bool)), matrix, np.nan)
        image = axes.imshow(shown, cmap="PuOr_r", vmin=-1.0, vmax=1.0, aspect="auto")
        for i in range(count):
            for j in range(i + 1):
                colour = "white" if abs(matrix[i, j]) > CLEAR else INK
                axes.text(j, i, f"{matrix[i, j]:.2f}".replace("0.", "."), ha="center", va="center", color=colour,
                          fontsize=10.0 if count <= 10 else 8.0)  # fmt: skip
        short = [_short(name) for name in names]
        axes.set_yticks(range(count), short)
        axes.set_xticks(range(count), short, rotation=40, ha="right", rotation_mode="anchor")
        axes.grid(visible=False)
        axes.tick_params(length=0)
        for spine in axes.spines.values():
            spine.set_visible(False)
        bar = figure.colorbar(image, ax=axes, fraction=0.05, pad=0.03, ticks=[-1.0, 0.0, 1.0])
        bar.outline.set_visible(False)  # type: ignore[operator]
        more = "" if len(correlation.names) <= MOST else f" The first {MOST} of {len(correlation.names)}."
        return picture(
            "correlation", "Which numbers move together",
            "Correlation of the estimates. Near 1 or -1 the logs cannot tell two numbers apart, however narrow the "
            f"interval of their sum.{more}", figure,
        )  # fmt: skip


def _short(name: str) -> str:
    """A key without what all keys share: "friction.axes.viscous[0]" is "viscous x"."""
    key = find_key(name)
    if key is None:
        return name.replace("_", " ")
    if key.axis is not None and key.index is not None:
        return f"{key.field} {AXES[key.axis]}"
    return str(key).removeprefix(f"{key.table}.").replace("_", " ")
