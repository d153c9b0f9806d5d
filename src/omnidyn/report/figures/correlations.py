"""Which fitted numbers move together: their correlations, as a picture."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.estimate import Correlation
from omnidyn.model.frames import AXES
from omnidyn.model.keys import find_key
from omnidyn.report.style import (
    INK,
    WIDTH,
    Picture,
    look,
    new_figure,
    picture,
)

MOST_NAMES = 16
INCHES = 0.092  # of a letter, about
DARK_GROUND = 0.6  # beyond it the ground is dark, and the number on it white


def draw_correlation(correlation: Correlation) -> Picture:
    """The lower triangle of the correlations, the number in each field; orange goes together, purple against."""
    names, matrix = correlation.names[:MOST_NAMES], correlation.matrix[:MOST_NAMES, :MOST_NAMES]
    count = len(names)
    short = [_short(name) for name in names]
    longest = INCHES * max(map(len, short))
    side = min(0.52 * count, WIDTH - longest - 1.3)
    foot = 0.25 + 0.6 * longest  # of labels that lean
    width, height = WIDTH, side + 0.15 + foot
    with look():
        figure = new_figure(width, height)
        left = (longest + 0.25) / width
        axes = figure.add_axes((left, foot / height, side / width, side / height))
        triangle = np.where(np.tril(np.ones((count, count), dtype=bool)), matrix, np.nan)
        image = axes.imshow(triangle, cmap="PuOr_r", vmin=-1.0, vmax=1.0, aspect="auto")
        for i in range(count):
            for j in range(i + 1):
                colour = "white" if abs(matrix[i, j]) > DARK_GROUND else INK
                axes.text(
                    j,
                    i,
                    f"{matrix[i, j]:.2f}".replace("0.", "."),
                    ha="center",
                    va="center",
                    color=colour,
                    fontsize=10.0 if count <= 10 else 8.0,
                )
        axes.set_yticks(range(count), short)
        axes.set_xticks(range(count), short, rotation=40, ha="right", rotation_mode="anchor")
        axes.grid(visible=False)
        axes.tick_params(length=0)
        for spine in axes.spines.values():
            spine.set_visible(False)
        bar_axes = figure.add_axes((left + (side + 0.2) / width, foot / height, 0.16 / width, side / height))
        bar = figure.colorbar(image, cax=bar_axes, ticks=[-1.0, 0.0, 1.0])
        bar.outline.set_visible(False)  # type: ignore[operator]
        remark = "" if len(correlation.names) <= MOST_NAMES else f" The first {MOST_NAMES} of {len(correlation.names)}."
        return picture(
            "correlation",
            "Which numbers move together",
            "Correlation of the estimates. Near 1 or -1 the logs cannot tell two numbers apart, however narrow the "
            f"interval of their sum.{remark}",
            figure,
        )


def _short(name: str) -> str:
    """A key without what all keys share: "friction.axes.viscous[0]" is "viscous x"."""
    key = find_key(name)
    if key is None:
        return name.replace("_", " ").replace(".", " ")
    if key.axis is not None and key.index is not None:
        return f"{key.field} {AXES[key.axis]}"
    return str(key).removeprefix(f"{key.table}.").replace("_", " ")
