"""Steady turning of a motor, and steady rest: what its input was in windows of either."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.identification.motors.log import MotorLog
from omnidyn.identification.motors.rest import NOISE, SAME_INPUT, SLOW, SLOWING_ERRORS, TURNING_ERRORS
from omnidyn.logs.plateaus import find_plateaus
from omnidyn.statistics import robust_mean


def turned_under(logs: Sequence[MotorLog], motor: int, side: float = 0.0, orientation: float = 1.0) -> float:
    """The least input, as a size, under which a motor is seen to turn steadily; infinite where it never is.

    side: +1.0 or -1.0: of its speed, 0.0: either. orientation: +1.0 where a positive input turns it forward, else -1.0.
    """
    turning_inputs = (
        orientation * float(np.sign(window.speed)) * window.input_value + window.error
        for window in _steady(logs, motor)
        if window.turns and side * window.speed >= 0.0
    )
    return min((level for level in turning_inputs if level > 0.0), default=math.inf)


def rested_under(logs: Sequence[MotorLog], motor: int) -> float:
    """The largest input, as a size, under which a motor rested; 0 where none shows."""
    return max(
        (abs(window.input_value) - window.error for window in _steady(logs, motor) if window.is_resting), default=0.0
    )


def turns_at_one_input(logs: Sequence[MotorLog], motor: int) -> bool:
    """Whether a motor turns steadily under inputs of one size alone: they tell its slope and its dead band together."""
    levels = [abs(window.input_value) for window in _steady(logs, motor) if window.turns]
    return bool(levels) and max(levels) - min(levels) <= SAME_INPUT * max(levels)


def slope_between(logs: Sequence[MotorLog], motor: int, dead_band: tuple[float, float]) -> tuple[float, float]:
    """Between which a slope lies, by the windows of steady turning: slope |speed| = |input| - dead band.

    dead_band: its ends, as sizes. (inf, -inf), which bounds nothing, where no window is known.
    """
    windows = [window for window in _steady(logs, motor) if window.turns]
    ends = [(abs(window.input_value) - band) / abs(window.speed) for window in windows for band in dead_band]
    return max(min(ends, default=math.inf), 0.0), max(ends, default=-math.inf)


class _Window(NamedTuple):
    """One in which a motor turns and does not slow down, or rests. error: by how much the input may be another."""

    input_value: float
    speed: float
    error: float
    turns: bool
    is_resting: bool


def _steady(logs: Sequence[MotorLog], motor: int) -> list[_Window]:
    windows = [window for log in logs for window in _windows_of(log, motor)]
    slow = SLOW * max((abs(window.speed) for window in windows), default=0.0)
    return [
        window._replace(
            turns=window.turns and abs(window.speed) > slow, is_resting=window.is_resting and abs(window.speed) <= slow
        )
        for window in windows
    ]


def _windows_of(log: MotorLog, motor: int) -> Iterator[_Window]:
    for plateau in find_plateaus(log.run):
        input_values, speed = log.input_values[plateau.rows, motor], log.motion[plateau.rows, motor]
        if not np.isfinite(input_values).all() or np.isfinite(speed).sum() < 2:
            continue
        half = len(speed) // 2
        (early_speed, early_std), (late_speed, late_std) = (robust_mean(part) for part in (speed[:half], speed[half:]))
        mean, std = (float(part) for part in robust_mean(speed))
        is_slower = np.sign(mean) * (early_speed - late_speed) > SLOWING_ERRORS * np.hypot(early_std, late_std)
        middle, error = (float(part) for part in robust_mean(input_values))
        yield _Window(
            middle,
            mean,
            NOISE * error,
            abs(mean) > TURNING_ERRORS * std and not is_slower,
            abs(mean) <= TURNING_ERRORS * std,
        )
