"""What each motor needs to turn: input against speed, with the fitted line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.report.style import BLUE, GREY, INK, VERMILLION, WIDTH, Picture, look, new_figure, picture, thin_out

MOST = 6  # motors that are drawn


def draw_motor_lines(motors: Sequence[MotorEstimate], windows: MotorWindows) -> Picture:
    """One panel per motor: a mark per window, its inertia taken off, and the line with its dead band."""
    lines = [line for line in motors if line.motor is not None][:MOST]
    with look():
        columns = 2 if len(lines) in (2, 4) else min(len(lines), 3)
        rows = -(-len(lines) // columns)
        figure = new_figure(WIDTH, 0.9 + 3.1 * rows)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        height = 0.9 + 3.1 * rows
        figure.subplots_adjust(
            left=0.1, right=0.98, top=1 - 0.35 / height, bottom=1.0 / height, wspace=0.34, hspace=0.45
        )
        for k, (panel, line) in enumerate(zip(panels, lines, strict=False)):
            _panel(panel, windows, line)
            if k % columns == 0:
                panel.set_ylabel(f"{windows.kind}, {windows.unit}")
        for panel in panels[len(lines) :]:
            panel.set_axis_off()
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.08, 0.0), ncols=3)
        return picture("motor_lines", "What each motor needs to turn", _words(windows), figure)


def _panel(axes: Axes, windows: MotorWindows, line: MotorEstimate) -> None:
    put_in, speed, error, side, change, _ = windows.of(line.motor)
    inertia = np.nan_to_num(line.value["inertia"]) * change
    axes.errorbar(speed, put_in - inertia, xerr=error, fmt="o", color=GREY, markersize=3.5, elinewidth=0.6, alpha=0.4,
                  zorder=1, label="windows, inertia taken off")  # fmt: skip
    slope, band = line.value["slope"], float(np.nan_to_num(line.value["dead_band"]))
    reach = np.abs(speed).max()
    sides = [way for way in (-1.0, 1.0) if (side * way > 0.0).any()]
    for k, way in enumerate(sides):
        span = way * np.linspace(0.0, reach, 20)
        axes.plot(span, slope * span + band * way, color=BLUE, label="line" if k == 0 else None)
    low, high = line.ci95["dead_band"]
    if np.isfinite(low):
        for k, way in enumerate(sides):
            # A mark of its own size: the interval of a dead band that is well known is thinner than any line.
            axes.plot([0.0, 0.0], [way * low, way * high], color=VERMILLION, linewidth=4, alpha=0.8, marker="_",
                      markersize=13, markeredgewidth=1.5, zorder=4, solid_capstyle="butt",
                      label="dead band, 95 %" if k == 0 else None)  # fmt: skip
    axes.axhline(0.0, color=INK, linewidth=0.6)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.set_title(line.name)
    axes.set_xlabel("speed, rad/s")
    thin_out(axes, 4, 5)


def _words(windows: MotorWindows) -> str:
    return (
        f"Mean {windows.kind} over each window against the mean speed ({windows.speed_from}), with the "
        "standard error of the speed. Where the line meets speed 0 is the dead band; the bar is its 95 % interval: "
        "where it contains 0, the data do not show one."
    )
