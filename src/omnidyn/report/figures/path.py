"""Where logs went: their paths seen from above, and how far they drove in which direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.projections.polar import PolarAxes

from omnidyn.logs.path import BodyPath
from omnidyn.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH,
    Picture,
    around_robot,
    look,
    new_figure,
    picture,
)

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, SKY)
SECTORS = 36
MAX_POINTS = 4000


def draw_path(paths: Sequence[BodyPath]) -> Picture:
    """The paths seen from above, a start as a ring and an end as a dot; and the metres driven per direction."""
    with look():
        figure = new_figure(WIDTH, 4.3)
        left = figure.add_axes((0.095, 0.13, 0.42, 0.76))
        right = cast(PolarAxes, figure.add_axes((0.61, 0.1, 0.31, 0.6), projection="polar"))
        for k, path in enumerate(paths):
            _path(left, path, COLOURS[k] if k < len(COLOURS) else GREY)
        left.set_aspect("equal", adjustable="datalim")
        left.margins(0.08)
        left.set_xlabel("x, m")
        left.set_title("path, y in m")
        _directions(right, paths)
        figure.text(0.575, 0.905, "metres driven per 10° of direction", fontsize=11.5)
        return picture("where_it_went", f"Where the log{'s' * (len(paths) > 1)} went", _caption(paths), figure)


def _path(axes: Axes, path: BodyPath, colour: str) -> None:
    stride = max(1, len(path.position) // MAX_POINTS)
    x, y = path.position[::stride].T
    axes.plot(x, y, color=colour, linewidth=1.1, alpha=0.9)
    finite_points = path.position[np.isfinite(path.position).all(axis=1)]
    axes.plot(
        *finite_points[0], "o", color="white", markeredgecolor=colour, markersize=8, markeredgewidth=1.6, zorder=4
    )
    axes.plot(*finite_points[-1], "o", color=colour, markersize=6, zorder=5)


def _directions(axes: PolarAxes, paths: Sequence[BodyPath]) -> None:
    length = np.concatenate([path.length for path in paths])
    direction = np.concatenate([path.direction for path in paths])
    width = 2.0 * np.pi / SECTORS
    sector = np.round(np.nan_to_num(direction) / width).astype(int) % SECTORS
    metres = np.bincount(sector, weights=length, minlength=SECTORS)
    axes.bar(width * np.arange(SECTORS), metres, width=width, color=BLUE, alpha=0.8, edgecolor=INK, linewidth=0.4)
    around_robot(axes, max(float(metres.max()), 1e-9))
    axes.set_axisbelow(False)  # numbers stand above the bars


def _caption(paths: Sequence[BodyPath]) -> str:
    origins = " or ".join(dict.fromkeys(path.origin for path in paths))
    total = sum(float(path.length.sum()) for path in paths)
    drift = "" if origins == "measured positions" else " Integrated speeds drift: only the shape of the path counts."
    remark = f" The first {len(COLOURS)} of {len(paths)} logs have a colour." if len(paths) > len(COLOURS) else ""
    return (
        f"Left: the way of the robot from {origins}, {total:.3g} m in all; a ring is a start, a dot an end.{drift}"
        f"{remark} Right: how far it drove in which direction of its own frame (forward is up, left is left). Friction "
        "along directions that are missing there is not in the data."
    )
