"""Windows of a motor's log in integral form: what was put in, how far it turned, which way, how its speed changed.

    integral of u dt = k (angle turned) + c (integral of sgn w dt) + m (change of w)

divided by the length of the window. The integral needs no derivative of a noisy speed, and windows need not be steady.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import BAND, LAG, OFFSET, SLOPE
from omnidyn.identification.motors.input_between_rows import InputIntegral
from omnidyn.identification.motors.log import MotorLog, rows_with
from omnidyn.logs.plateaus import STEPWISE, find_plateaus
from omnidyn.logs.resolved import unresolved_input
from omnidyn.statistics import (
    MAD_TO_STD,
    robust_mean,
    sensor_step,
)

LENGTHS = (0.05, 0.1, 0.2, 0.5)  # [s] the shortest whose mean speed is sharp enough is taken
SHARP = 0.02  # of the spread of the speeds: a mean speed with this error needs no longer window
MIN_ROWS, MAX_WINDOWS = 5, 3000
OUTLIER_SCALES = 5.0  # scales from the median beyond which a speed is not believed
SETTLED_SHARE = (1.0 / 3.0, 1.0)  # of each command's rows, where speeds are too noisy to correct for a start-up
EDGE_SHARE = 0.2  # of a window, around each end: where the speed at the end is taken from
SIGN_NOISE = 0.2  # of the usual speed: noise that a sign can bear
SLOW = 0.02  # of the usual speed: slower is at rest
TURNS = 5.0  # standard errors of a mean speed, from which it is one
REST_SHARE = 0.1  # of the rows of a window at rest from which it says nothing about sliding friction


@dataclass(frozen=True, eq=False)
class MotorWindows:
    """Windows of all motors. One row per window and motor; arrays of shape (rows,).

    input_values: mean input, in `unit`. speed: mean speed [rad/s], and its standard error. side: mean of sgn w. change:
    of the speed, over the length of the window [rad/s^2]. motor: its number from 0. block: number of the window.
    rest: per motor the largest mean input [unit] under which it stayed at rest, NaN where it never rested.
    unresolved, resting: windows left out because the log does not resolve their input, or because the motor rested.
    settled: start-ups were left out, so that nothing is known of the inertia. every: of a very long log, only every so
    many-th window was used. smear [s]: over which the speed at an end of a window is averaged; a lag that is shorter
    comes out too short. NaN where nothing is known of the inertia. travel: of `MotorLog`.
    """

    input_values: FloatArray
    speed: FloatArray
    speed_std: FloatArray
    side: FloatArray
    change: FloatArray
    motor: IntArray
    block: IntArray
    unit: str
    kind: str
    speed_from: str
    length: float
    rest: FloatArray
    unresolved: int
    resting: int
    settled: bool
    every: int
    smear: float = math.nan
    travel: str = "rad"

    def of(self, motor: int | None) -> tuple[FloatArray, ...]:
        """(input_values, speed, speed_std, side, change, block) of one motor, or of all."""
        mask = slice(None) if motor is None else self.motor == motor
        return tuple(
            getattr(self, name)[mask] for name in ("input_values", "speed", "speed_std", "side", "change", "block")
        )

    def turned_under(self, motor: int) -> float:
        """The least input, as a size, under which a motor turns steadily; infinite where no window is steady."""
        input_values, speed, speed_std, *_ = self.of(motor)
        turns = (np.abs(speed) > TURNS * speed_std) & (input_values != 0.0)
        return float(np.abs(input_values[turns]).min(initial=np.inf)) if self.settled else np.inf


def motor_windows(
    logs: Sequence[MotorLog],
    *,
    steady: bool = False,
    share: tuple[float, float] | None = None,
    least_length: float = 0.0,
) -> MotorWindows:
    """Windows of the motors in logs.

    They are as short as gives a sharp mean speed; where nothing does and the input comes in steps, a window is the last
    two thirds of each step. steady: take the steady windows of `find_plateaus` instead; share: with these shares of
    each command's rows. least_length [s]: no window is shorter. Raises InsufficientDataError where no window is left.
    """
    usual_speed = _usual_speed(logs)
    length, is_sharp = _length(logs, usual_speed, least_length)
    # the input stands still most of the time
    in_steps = all(np.mean((np.diff(log.input_values, axis=0) != 0.0).any(axis=1)) <= STEPWISE for log in logs)
    if in_steps and not (is_sharp or steady or share):
        share = SETTLED_SHARE if all(_windows(log, length, False, SETTLED_SHARE) for log in logs) else None
    windows = [_windows(log, length, steady, share) for log in logs]
    row_stride = max(1, -(-sum(map(len, windows)) // MAX_WINDOWS))
    block, readers = 0, []
    rows: list[tuple[float, ...]] = []
    for log, log_windows in zip(logs, windows, strict=True):
        reader = _Reader(log, usual_speed)
        readers.append(reader)
        for window in log_windows[::row_stride]:
            rows += [(*row, block) for row in reader.rows_of(window)]
            block += 1
        block += 1  # no block of the bootstrap reaches over the end of a run
    unresolved, resting = (sum(getattr(reader, name) for reader in readers) for name in ("unresolved", "resting"))
    if not rows:
        raise InsufficientDataError(
            "no window tells how the motors answer",
            got=f"{resting} windows at rest, {unresolved} whose input the log does not resolve",
            expected="a motor that turns",
        )
    table, first = np.array(rows), logs[0]
    return MotorWindows(
        *table[:, :5].T,
        motor=table[:, 5].astype(np.int64),
        block=table[:, 6].astype(np.int64),
        unit=first.unit,
        kind=first.kind,
        speed_from=first.motion_from,
        length=length,
        unresolved=unresolved,
        resting=resting,
        rest=np.fmax.reduce([reader.rest for reader in readers]),
        settled=steady or share is not None,
        every=row_stride,
        smear=max(_smear(log, length) for log in logs),
        travel=first.travel,
    )


def line_numbers(logs: Sequence[MotorLog], motor: int) -> dict[str, float] | None:
    """Slope, dead band, offset and lag of a motor by least squares over its windows, where a free run may begin; None
    where the windows do not tell them, or what they tell is no motor.

    mean u = k (mean w) + c (mean sgn w) + offset + m (change of w / length)
    """
    try:
        long = [log for log in logs if len(log.t) > MIN_ROWS]
        input_values, speed, _, side, change, _ = motor_windows(long).of(motor)
    except InsufficientDataError:
        return None
    table = np.stack([speed, side, np.ones(len(speed)), change], axis=1)
    numbers, _, rank, _ = np.linalg.lstsq(table, input_values, rcond=1e-9)
    slope, band, offset, inertia = numbers.tolist()
    if rank < table.shape[1] or slope <= 0.0 or inertia <= 0.0:
        return None
    return {SLOPE: slope, BAND: max(band, 0.0), OFFSET: offset, LAG: inertia / slope}


def _usual_speed(logs: Sequence[MotorLog]) -> float:
    """The usual size of a speed that is one: the upper quartile of the means over half seconds."""
    means = [
        np.abs(_mean_speed(log, window)[0])
        for log in logs
        for window in _windows(log, LENGTHS[-1])[:: max(1, len(log.t) // 20_000)]
    ]
    known_means = np.concatenate(means) if means else np.zeros(0)
    known_means = known_means[np.isfinite(known_means)]
    return float(np.quantile(known_means, 0.75)) if known_means.size else 0.0


def _smear(log: MotorLog, length: float) -> float:
    """Time over which `_Reader` averages the speed at an end of a window [s]."""
    row = log.step
    return 2.0 * row * max(1, round(EDGE_SHARE * length / row / 2.0)) if row > 0.0 else 0.0


def _length(logs: Sequence[MotorLog], usual_speed: float, least_length: float) -> tuple[float, bool]:
    """The shortest length of a window whose mean speed is sharp and that has rows enough; whether there is one."""
    for length in (length for length in LENGTHS if length >= least_length):
        errors, rows = [], []
        for log in logs:
            for window in _windows(log, length)[:: max(1, len(log.t) // 500)]:
                error = _mean_speed(log, window)[1]
                known_errors = np.isfinite(error)  # a robot may have more wheels than the log has motors
                errors += [float(error[known_errors].max())] if known_errors.any() else []
                rows.append(window.stop - window.start)
        if errors and np.median(errors) <= SHARP * usual_speed and np.median(rows) >= 2 * MIN_ROWS:
            return length, True
    return LENGTHS[-1], False


def _windows(
    log: MotorLog, length: float, steady: bool = False, share: tuple[float, float] | None = None
) -> list[slice]:
    """Windows of about `length` between gaps; each ends on the row where the next begins."""
    if steady or share:
        plateaus = find_plateaus(log.run, start=share[0], end=share[1]) if share else find_plateaus(log.run)
        return [plateau.rows for plateau in plateaus]
    windows_found = []
    for piece in log.pieces:
        t = log.t[piece]
        count = int((t[-1] - t[0]) / length + 1e-9)
        edges = np.searchsorted(t, t[0] + length * np.arange(count + 1) - 1e-9)
        ends = [min(int(edge), len(t) - 1) for edge in edges]
        windows_found += [slice(piece.start + a, piece.start + b + 1) for a, b in pairwise(ends)]
    return [window for window in windows_found if window.stop - window.start > MIN_ROWS]


def _mean_speed(log: MotorLog, window: slice) -> tuple[FloatArray, FloatArray]:
    """Mean speed of each motor over a window, and its standard error [rad/s]."""
    t = log.t[window]
    if log.angle is None:
        pairs = np.array([_mean_of_noisy(t, column) for column in log.motion[window].T])
        return pairs[:, 0], pairs[:, 1]
    angle = log.angle[window]
    steps = np.diff(angle, axis=0) / np.diff(t)[:, None]
    # white noise of the angle, as it shows in the second differences, enters through the two ends
    noise = np.median(np.abs(np.diff(angle, n=2, axis=0)), axis=0) * MAD_TO_STD / np.sqrt(6.0)
    mean = (angle[-1] - angle[0]) / (t[-1] - t[0])
    return np.where(np.isfinite(steps).all(axis=0), mean, np.nan), np.sqrt(2.0) * noise / (t[-1] - t[0])


def _mean_of_noisy(t: FloatArray, speed: FloatArray) -> tuple[float, float]:
    """Mean of a noisy speed and its error: of what is left beside a cubic, for a start-up is no noise."""
    known_rows = np.isfinite(speed)
    if known_rows.sum() < MIN_ROWS:
        return np.nan, np.nan
    x, y = 2.0 * (t[known_rows] - t[0]) / (t[-1] - t[0]) - 1.0, speed[known_rows]
    middle = np.median(y)
    reach = OUTLIER_SCALES * MAD_TO_STD * np.median(np.abs(y - middle)) + sensor_step(y)
    table = np.polynomial.legendre.legvander(x, min(3, len(x) // 6))
    smooth = table @ np.linalg.lstsq(table, np.clip(y, middle - reach, middle + reach), rcond=None)[0]
    mean_residual, error = robust_mean(y - smooth)
    return float(np.mean(smooth) + mean_residual), float(error)


class _Reader:
    """Reads the rows of windows off one log, and keeps what was left out."""

    def __init__(self, log: MotorLog, usual_speed: float):
        self.log, self.usual = log, usual_speed
        self.unresolved = self.resting = 0
        self.rest = np.full(log.motors, np.nan)
        self._largest = np.nanmax(np.abs(log.input_values), axis=0, initial=0.0)
        self._put_in = [
            InputIntegral(
                log.t,
                log.input_values[:, m],
                rows_with(np.isfinite(log.input_values[:, m]), log.pieces),
                log.mean_rows[m],
                None if log.stamped_input is None else (log.stamped_input[0], log.stamped_input[1][:, m]),
            )
            for m in range(log.motors)
        ]

    def rows_of(self, window: slice) -> list[tuple[float, ...]]:
        """The rows of one window, a motor each: (input, speed, its error, side, change, motor)."""
        log, span = self.log, float(np.ptp(self.log.t[window]))
        mean, error = _mean_speed(log, window)
        window_rows = []
        for motor in range(log.motors):
            if not np.isfinite(log.input_values[window, motor]).all() or not np.isfinite(mean[motor]):
                continue
            if unresolved_input(log.input_values[:, motor], window, float(self._largest[motor])):
                self.unresolved += 1
                continue
            mean_input = self._put_in[motor].over(window) / span
            if not np.isfinite(mean_input):
                continue
            wide_window = self._wide(window, motor)
            sides = self._sides(wide_window, motor, float(error[motor]), mean_input)
            if np.mean(sides == 0.0) > REST_SHARE:
                self.resting += 1
                if not sides.any():
                    self.rest[motor] = np.nanmax([self.rest[motor], abs(mean_input)])
                continue
            sides = self._mean_sides(sides, motor)
            change = (
                self._speed_at(window, motor, window.stop - 1) - self._speed_at(window, motor, window.start)
            ) / span
            window_rows.append((mean_input, mean[motor], error[motor], float(np.mean(sides)), change, motor))
        return window_rows

    def _wide(self, window: slice, motor: int) -> slice:
        """The window with as many rows on either side as the mean of its sides reaches, where there are so many."""
        rows_before, piece = self.log.mean_rows[motor] // 2, self.log.piece(window.start)
        rows_after = self.log.mean_rows[motor] - 1 - rows_before
        return slice(max(piece.start, window.start - rows_before), min(piece.stop, window.stop + rows_after))

    def _mean_sides(self, sides: FloatArray, motor: int) -> FloatArray:
        """The mean of sgn w over the rows over which the speed is one.

        A mean changes sign about half its rows later than what it is of: its own signs half as far to either side.
        """
        rows = min(self.log.mean_rows[motor], len(sides))
        return sides if rows == 1 else np.convolve(sides, np.full(rows, 1.0 / rows), mode="valid")

    def _sides(self, window: slice, motor: int, error: float, mean_input: float) -> FloatArray:
        """Which way the motor turns, row by row: of the speed averaged until its noise no longer turns the sign. Where
        the mean over the whole window is too noisy for a sign, the input tells.
        """
        speed = self.log.motion[window, motor]
        speed = np.where(np.isfinite(speed), speed, np.nanmedian(speed))
        rows = len(speed)
        noise = max(float(np.median(np.abs(np.diff(speed)))) * MAD_TO_STD / np.sqrt(2.0), error * np.sqrt(rows))
        count = int(np.ceil((noise / (SIGN_NOISE * self.usual)) ** 2)) if self.usual > 0.0 else rows
        if count >= rows:
            return np.full(rows, np.sign(mean_input))
        if count > 1:
            padded_speed = np.pad(speed, (count // 2, count - 1 - count // 2), mode="edge")
            speed = np.convolve(padded_speed, np.full(count, 1.0 / count), mode="valid")
        return np.where(np.abs(speed) > SLOW * self.usual, np.sign(speed), 0.0)

    def _speed_at(self, window: slice, motor: int, row: int) -> float:
        """Speed at an end of a window, from the rows around it [rad/s]."""
        log, piece = self.log, self.log.piece(row)
        half = max(1, round(EDGE_SHARE * (window.stop - window.start) / 2))
        nearby_rows = slice(max(piece.start, row - half), min(piece.stop, row + half + 1))
        if log.angle is None:
            return float(robust_mean(log.motion[nearby_rows, motor])[0])
        angle, t = log.angle[nearby_rows, motor], log.t[nearby_rows]
        return float((angle[-1] - angle[0]) / (t[-1] - t[0]))
