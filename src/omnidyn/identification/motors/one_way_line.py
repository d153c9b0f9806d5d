"""The line of a motor through the windows in which it turns one way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import BAND, LAG, OFFSET, SLOPE, MotorEstimate
from omnidyn.identification.motors.log import MotorLog
from omnidyn.identification.motors.rest import LEAST_REST, noise_of_rows
from omnidyn.identification.motors.window_fit import fit_line
from omnidyn.identification.motors.windows import EDGE_SHARE, LENGTHS, MotorWindows, motor_windows
from omnidyn.statistics import sensor_step

NO_LINE: dict[str, tuple[float, tuple[float, float]]] = {
    name: (math.nan, (math.nan, math.nan)) for name in (SLOPE, OFFSET, LAG)
}
NOISE_SHARE = 0.02  # of the change of speed over a window: noise by which the inertia may come out too small
ONE_WAY = 0.98  # of the sides of a window, so that it belongs to one direction


def turned_ends(ends: tuple[float, float], facing: float) -> tuple[float, float]:
    """An interval of the numbers of the other direction."""
    return ends if facing > 0.0 else (-ends[1], -ends[0])


def windows_for_a_lag(logs: Sequence[MotorLog], windows: MotorWindows | None, motor: int) -> MotorWindows | None:
    """The windows, or longer ones where noise hides the change of speed over them.

    Noise in that column, like any in what a line goes over, would make the inertia come out too small by its share.
    """
    if windows is None or windows.settled:
        return windows
    noise = max(_noise_of(log.motion[:, motor]) for log in logs)
    row = max(log.step for log in logs if len(log.t) > 1)
    for least_length in (length for length in LENGTHS if length >= windows.length):
        try:
            windows_found = motor_windows(logs, least_length=least_length) if least_length > windows.length else windows
        except InsufficientDataError:
            break
        windows, change = windows_found, windows_found.change[windows_found.motor == motor]
        rows = 2 * max(1, round(0.5 * EDGE_SHARE * windows_found.length / row)) + 1  # that tell the speed at an end
        if not change.size or 2.0 * noise**2 / rows / windows_found.length**2 <= NOISE_SHARE * float(np.var(change)):
            break
    return windows


def _noise_of(speed: FloatArray) -> float:
    """Standard deviation of the noise of a speed, or of the steps in which it is read [rad/s]."""
    known_speeds = speed[np.isfinite(speed)]
    return (
        max(noise_of_rows(known_speeds), sensor_step(known_speeds) / math.sqrt(6.0))
        if len(known_speeds) > LEAST_REST
        else 0.0
    )


def line_one_way(windows: MotorWindows | None, motor: int, side: float) -> MotorEstimate | None:
    """The line through the windows in which a motor turns one way; None where there are too few."""
    if windows is None:
        return None
    mask = (windows.motor == motor) & (windows.side * side > ONE_WAY)
    names = ("input_values", "speed", "speed_std", "side", "change", "motor", "block")
    try:
        return fit_line(replace(windows, **{name: getattr(windows, name)[mask] for name in names}), motor, "")
    except InsufficientDataError:
        return None


def numbers_one_way(
    line: MotorEstimate | None, facing: float, row: float
) -> dict[str, tuple[float, tuple[float, float]]]:
    """Slope, offset and lag of a line, as the direction has them.

    The interval of the lag is wider by a row [s], of which the log does not tell: an input that is held from row to
    row, and one that goes on in between, are apart by half a row, and so are a speed and its mean over a row.
    """
    if line is None:
        return dict(NO_LINE)
    lag_low, lag_high = line.ci95[LAG]
    return {
        SLOPE: (line.value[SLOPE], line.ci95[SLOPE]),
        OFFSET: (facing * line.value[BAND], turned_ends(line.ci95[BAND], facing)),
        LAG: (line.value[LAG], (lag_low - row, lag_high + row)),
    }
