"""What each motor needs to turn: input against speed, with the fitted lines, and the input at which it sets off."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.start import OFFSET, START, MotorStart
from omnidyn.identification.motors.steady_curve import SteadyCurve
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.report.style import BLUE, GREY, INK, VERMILLION, WIDTH, Picture, look, new_figure, picture, thin_out

MOST_MOTORS = 6  # motors that are drawn
LINE, STEADY, WINDOWS = "line", "steady speeds", "windows, inertia taken off"
STARTS, BAND = "start from rest, 95 %", "dead band by the line, 95 %"


def draw_motor_lines(
    motors: Sequence[MotorEstimate],
    windows: MotorWindows,
    starts: Sequence[MotorStart] = (),
    curves: Sequence[SteadyCurve] = (),
) -> Picture:
    """One panel per motor: a mark per window, its inertia taken off, the line, and where the motor starts.

    starts: of each direction, which has its own line then. Where none is known, the bar is the dead band of the line.
    curves: of motors whose speed is no line.
    """
    lines = [line for line in motors if line.motor is not None][:MOST_MOTORS]
    with look():
        columns = 2 if len(lines) in (2, 4) else min(len(lines), 3)
        rows = -(-len(lines) // columns)
        height = 0.9 + 3.1 * rows
        figure = new_figure(WIDTH, height)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        figure.subplots_adjust(
            left=0.1, right=0.98, top=1 - 0.35 / height, bottom=1.0 / height, wspace=0.34, hspace=0.45
        )
        for k, (panel, line) in enumerate(zip(panels, lines, strict=False)):
            starts_of_motor = {start.side: start for start in starts if start.motor == line.motor}
            _panel(
                panel,
                windows,
                line,
                starts_of_motor,
                next((curve for curve in curves if curve.motor == line.motor), None),
            )
            if k % columns == 0:
                panel.set_ylabel(f"{windows.kind}, {windows.unit}")
        for panel in panels[len(lines) :]:
            panel.set_axis_off()
        handles = dict(pair[::-1] for panel in panels for pair in zip(*panel.get_legend_handles_labels(), strict=True))
        names = [name for name in (LINE, STEADY, STARTS, BAND, WINDOWS) if name in handles]
        columns = 3 if len(names) < 4 else 2
        figure.legend([handles[n] for n in names], names, loc="lower left", bbox_to_anchor=(0.08, 0.0), ncols=columns)
        return picture("motor_lines", "What each motor needs to turn", _words(windows, names), figure)


def _panel(
    axes: Axes,
    windows: MotorWindows,
    line: MotorEstimate,
    starts: dict[float, MotorStart],
    curve: SteadyCurve | None,
) -> None:
    put_in, speed, error, side, change, _ = windows.of(line.motor)
    inertia = np.nan_to_num(line.value["inertia"]) * change
    axes.errorbar(
        speed,
        put_in - inertia,
        xerr=error,
        fmt="o",
        color=GREY,
        markersize=3.5,
        elinewidth=0.6,
        alpha=0.4,
        zorder=1,
        label=WINDOWS,
    )
    reach = np.abs(speed).max()
    for sign in (-1.0, 1.0):
        if (side * sign > 0.0).any():
            _direction(axes, sign, reach, line, starts.get(sign), curve)
    axes.axhline(0.0, color=INK, linewidth=0.6)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.set_title(line.name)
    axes.set_xlabel("speed, rad/s")
    thin_out(axes, 4, 5)


def _direction(
    axes: Axes,
    sign: float,
    reach: float,
    line: MotorEstimate,
    start: MotorStart | None,
    curve: SteadyCurve | None,
) -> None:
    """The line or the curve of one direction, and where the motor starts in it."""
    slope, at_rest = line.value["slope"], float(np.nan_to_num(line.value["dead_band"]))
    (low, high), name = line.ci95["dead_band"], BAND
    if start is not None and math.isfinite(start.value[OFFSET]):
        slope, at_rest = start.value["slope"], start.value[OFFSET]
    if start is not None and all(map(math.isfinite, start.ci95[START])):
        (low, high), name = start.ci95[START], STARTS
    if curve is not None:
        axes.plot(sign * curve.speed, sign * curve.level, "o-", color=BLUE, markersize=3.0, label=STEADY)
    else:
        span = sign * np.linspace(0.0, reach, 20)
        axes.plot(span, slope * span + at_rest * sign, color=BLUE, label=LINE)
    if math.isfinite(low) and math.isfinite(high):
        # A mark of its own size: the interval of a start that is well known is thinner than any line.
        axes.plot(
            [0.0, 0.0],
            [sign * low, sign * high],
            color=VERMILLION,
            linewidth=4,
            alpha=0.8,
            marker="_",
            markersize=13,
            markeredgewidth=1.5,
            zorder=4,
            solid_capstyle="butt",
            label=name,
        )


def _words(windows: MotorWindows, names: Sequence[str]) -> str:
    words = (
        f"Mean {windows.kind} over each window against the mean speed ({windows.speed_from}), with the "
        "standard error of the speed."
    )
    if STARTS in names:
        words += (
            " The bar at speed 0 is the input at which the motor sets off from rest, with its 95 % interval: that is "
            "the dead band, and not where the line crosses."
        )
    if BAND in names:
        words += (
            f" {'Where no start was seen, the' if STARTS in names else 'The'} bar is where the line meets speed 0, "
            "with its 95 % interval: where it contains 0, the data do not show a dead band."
        )
    return words
