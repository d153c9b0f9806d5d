"""Windows of a motor's log in integral form: what was put in, how far it turned, which way, how its speed changed.

    integral of u dt = k (angle turned) + c (integral of sgn w dt) + m (change of w)

divided by the length of the window. The integral needs no derivative of a noisy speed, and windows need not be steady.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.plateaus import STEPWISE, find_plateaus, live_angle
from omnidyn.logs.resolved import unresolved_input
from omnidyn.logs.segments import segments
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import MAD_TO_STD, robust_mean, sensor_step

FloatArray = NDArray[np.float64]

INPUTS = {"voltage": ("V", 1.0), "duty": ("%", 100.0), "current": ("A", 1.0)}  # unit, and how many of it in one SI unit
WHEEL, GROUND = "wheel", "ground"
LENGTHS = (0.05, 0.1, 0.2, 0.5)  # [s] the shortest whose mean speed is sharp enough is taken
SHARP = 0.02  # of the spread of the speeds: a mean speed with this error needs no longer window
MIN_ROWS, MAX_WINDOWS = 5, 3000
WILD = 5.0  # scales from the median beyond which a speed is not believed
SETTLED_SHARE = (1.0 / 3.0, 1.0)  # of each command's rows, where speeds are too noisy to correct for a start-up
EDGE_SHARE = 0.2  # of a window, around each end: where the speed at the end is taken from
SIGN_NOISE = 0.2  # of the usual speed: noise that a sign can bear
SLOW = 0.02  # of the usual speed: slower is at rest
REST_SHARE = 0.1  # of the rows of a window at rest from which it says nothing about sliding friction
SPLINE_ROWS = 6


@dataclass(frozen=True, eq=False)
class DriveWindows:
    """Windows of all motors. One row per window and motor; arrays of shape (rows,).

    put_in: mean input, in `unit`. speed: mean speed [rad/s], and its standard error. side: mean of sgn w. change: of
    the speed, over the length of the window [rad/s^2]. motor: its number from 0. block: number of the window.
    rest: per motor the largest mean input [unit] under which it stayed at rest, NaN where it never rested.
    unresolved, resting: windows left out because the log does not resolve their input, or because the motor rested.
    settled: start-ups were left out, so that nothing is known of the inertia. every: of a very long log, only every so
    many-th window was used.
    """

    put_in: FloatArray
    speed: FloatArray
    speed_std: FloatArray
    side: FloatArray
    change: FloatArray
    motor: NDArray[np.int64]
    block: NDArray[np.int64]
    unit: str
    kind: str
    length: float
    rest: FloatArray
    unresolved: int
    resting: int
    speed_from: str
    settled: bool
    every: int = 1

    def of(self, motor: int | None) -> tuple[FloatArray, ...]:
        """(put_in, speed, speed_std, side, change, block) of one motor, or of all."""
        keep = slice(None) if motor is None else self.motor == motor
        return tuple(getattr(self, name)[keep] for name in ("put_in", "speed", "speed_std", "side", "change", "block"))


def drive_windows(
    runs: Sequence[Run],
    *,
    kind: str = "",
    speed: str = WHEEL,
    robot: Robot | None = None,
    length: float | None = None,
    steady: bool = False,
    share: tuple[float, float] | None = None,
) -> DriveWindows:
    """Windows of the motors in runs.

    kind: "voltage", "duty" or "current"; "" takes the first of them that all runs have. speed: "wheel", or "ground": of
    the heading of a robot that turns on the spot, which needs `robot`. length [s]: of the windows; None takes the
    shortest that gives a sharp mean speed; where none does and the input comes in steps, a window is the last two
    thirds of each step. steady: take the steady windows of `find_plateaus` instead; share: with
    these shares of each command's rows.
    Raises InputError for a run without the channels, InsufficientDataError where no window is left.
    """
    kind = _kind(runs, kind)
    angles = [_motion(run, speed, robot) for run in runs]
    inputs = [getattr(run, kind) * INPUTS[kind][1] for run in runs]
    usual = _usual_speed(runs, angles)
    if length is None:
        length, sharp = _length(runs, angles, usual)
        if not sharp and not steady and share is None and all(_in_steps(run, kind) for run in runs):
            share = SETTLED_SHARE if all(_windows(run, length, False, SETTLED_SHARE) for run in runs) else None
    windows = [_windows(run, length, steady, share) for run in runs]
    every = -(-sum(map(len, windows)) // MAX_WINDOWS)
    rows: list[tuple[float, ...]] = []
    counts, rest = {"unresolved": 0, "resting": 0}, np.full(angles[0].count, np.nan)
    block = 0
    for run, motion, values, several in zip(runs, angles, inputs, windows, strict=True):
        largest = np.nanmax(np.abs(values), axis=0, initial=0.0)
        for window in several[::every]:
            own = _window(run, motion, window, values, largest, usual, counts, rest)
            rows += [(*each, block) for each in own]
            block += 1
        block += 1  # no block of the bootstrap reaches over the end of a run
    if not rows:
        raise InsufficientDataError(
            "no window tells how the motors answer", got=f"{counts['resting']} windows at rest, "
            f"{counts['unresolved']} whose input the log does not resolve", expected="a motor that turns",
        )  # fmt: skip
    table = np.array(rows)
    return DriveWindows(
        put_in=table[:, 0], speed=table[:, 1], speed_std=table[:, 2], side=table[:, 3], change=table[:, 4],
        motor=table[:, 5].astype(np.int64), block=table[:, 6].astype(np.int64), unit=INPUTS[kind][0], kind=kind,
        length=length, rest=rest, unresolved=counts["unresolved"], resting=counts["resting"],
        speed_from=angles[0].origin, settled=steady or share is not None, every=every,
    )  # fmt: skip


def _kind(runs: Sequence[Run], asked: str) -> str:
    if asked and asked not in INPUTS:
        raise InputError("no such input", got=asked, expected=", ".join(INPUTS), where="input")
    for kind in [asked] if asked else INPUTS:
        if runs and all(getattr(run, kind) is not None for run in runs):
            return kind
    lacking = next((run for run in runs if asked and getattr(run, asked) is None), runs[0] if runs else None)
    raise InputError(
        "the motors' input is not in the log", got=", ".join(lacking.channels) if lacking else "no runs",
        expected=asked or ", ".join(INPUTS), where=lacking.source if lacking else "",
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Motion:
    """How the motors of a run turned: angle [rad] or speed [rad/s], shape (samples, motors)."""

    angle: FloatArray | None
    speed: FloatArray
    origin: str
    pieces: tuple[slice, ...]

    @property
    def count(self) -> int:
        return self.speed.shape[1]

    def piece(self, row: int) -> slice:
        """The rows between the two gaps around a row."""
        return self.pieces[bisect_right([each.start for each in self.pieces], row) - 1]


def _motion(run: Run, speed: str, robot: Robot | None) -> _Motion:
    pieces = tuple(segments(run.t))
    if speed == GROUND:
        if run.pose is None or robot is None or not np.isfinite(run.pose[:, 2]).any():
            raise InputError("the heading is not known", got=", ".join(run.channels), expected="heading, and a robot",
                             where=run.source)  # fmt: skip
        angle = run.pose[:, 2:] * wheel_speed(robot.wheels, [0.0, 0.0, 1.0])
        return _Motion(angle, np.gradient(angle, run.t, axis=0), "heading, the robot turning on the spot", pieces)
    if speed != WHEEL:
        raise InputError("no such speed", got=speed, expected=f"{WHEEL} or {GROUND}", where="speed")
    angle = live_angle(run)
    if angle is not None:
        return _Motion(angle, np.gradient(angle, run.t, axis=0), "wheel_angle", pieces)
    if run.wheel_speed is None:
        raise InputError(
            "the log does not show how the motors turn", got=", ".join(run.channels) or "no channels",
            expected="wheel_angle or wheel_speed", where=run.source,
        )  # fmt: skip
    return _Motion(None, run.wheel_speed, "wheel_speed", pieces)


def _usual_speed(runs: Sequence[Run], motions: Sequence[_Motion]) -> float:
    """The usual size of a speed that is one: the upper quartile of the means over half seconds."""
    means = [
        abs(float(value))
        for run, motion in zip(runs, motions, strict=True)
        for window in _windows(run, LENGTHS[-1], False)[:: max(1, len(run) // 20_000)]
        for value in np.atleast_1d(_mean_speed(run, motion, window)[0])
    ]
    known = np.array([value for value in means if np.isfinite(value)])
    return float(np.quantile(known, 0.75)) if known.size else 0.0


def _in_steps(run: Run, kind: str) -> bool:
    """Whether the input stands still most of the time."""
    changed = (np.diff(getattr(run, kind), axis=0) != 0.0).any(axis=1)
    return bool(np.mean(changed) <= STEPWISE)


def _length(runs: Sequence[Run], motions: Sequence[_Motion], usual: float) -> tuple[float, bool]:
    """The shortest length of a window whose mean speed is sharp and that has rows enough; whether there is one."""
    for length in LENGTHS:
        errors, rows = [], []
        for run, motion in zip(runs, motions, strict=True):
            for window in _windows(run, length, False)[:: max(1, len(run) // 500)]:
                errors.append(np.max(_mean_speed(run, motion, window)[1]))
                rows.append(window.stop - window.start)
        if errors and np.nanmedian(errors) <= SHARP * usual and np.median(rows) >= 2 * MIN_ROWS:
            return length, True
    return LENGTHS[-1], False


def _windows(run: Run, length: float, steady: bool, share: tuple[float, float] | None = None) -> list[slice]:
    """Windows of about `length` between gaps; each ends on the row where the next begins."""
    if steady or share:
        plateaus = find_plateaus(run, start=share[0], end=share[1]) if share else find_plateaus(run)
        return [each.rows for each in plateaus]
    found = []
    for piece in segments(run.t):
        t = run.t[piece]
        count = int((t[-1] - t[0]) / length + 1e-9)
        edges = np.searchsorted(t, t[0] + length * np.arange(count + 1) - 1e-9)
        ends = [min(int(edge), len(t) - 1) for edge in edges]
        found += [slice(piece.start + a, piece.start + b + 1) for a, b in pairwise(ends)]
    return [window for window in found if window.stop - window.start > MIN_ROWS]


def _mean_speed(run: Run, motion: _Motion, window: slice) -> tuple[FloatArray, FloatArray]:
    """Mean speed of each motor over a window, and its standard error [rad/s]."""
    t = run.t[window]
    if motion.angle is None:
        pairs = np.array([_mean_of_noisy(t, column) for column in motion.speed[window].T])
        return pairs[:, 0], pairs[:, 1]
    angle = motion.angle[window]
    steps = np.diff(angle, axis=0) / np.diff(t)[:, None]
    # white noise of the angle, as it shows in the second differences, enters through the two ends
    noise = np.median(np.abs(np.diff(angle, n=2, axis=0)), axis=0) * MAD_TO_STD / np.sqrt(6.0)
    mean = (angle[-1] - angle[0]) / (t[-1] - t[0])
    return np.where(np.isfinite(steps).all(axis=0), mean, np.nan), np.sqrt(2.0) * noise / (t[-1] - t[0])


def _mean_of_noisy(t: FloatArray, speed: FloatArray) -> tuple[float, float]:
    """Mean of a noisy speed and its error: of what is left beside a cubic, for a start-up is no noise."""
    known = np.isfinite(speed)
    if known.sum() < MIN_ROWS:
        return np.nan, np.nan
    x, y = 2.0 * (t[known] - t[0]) / (t[-1] - t[0]) - 1.0, speed[known]
    middle = np.median(y)
    reach = WILD * MAD_TO_STD * np.median(np.abs(y - middle)) + sensor_step(y)
    table = np.polynomial.legendre.legvander(x, min(3, len(x) // 6))
    smooth = table @ np.linalg.lstsq(table, np.clip(y, middle - reach, middle + reach), rcond=None)[0]
    rest, error = robust_mean(y - smooth)
    return float(np.mean(smooth) + rest), float(error)


def _window(
    run: Run, motion: _Motion, window: slice, values: FloatArray, largest: FloatArray, usual: float,
    counts: dict[str, int], rest: FloatArray,
) -> list[tuple[float, ...]]:  # fmt: skip
    """The rows of one window, a motor each: (input, speed, its error, side, change, motor)."""
    t = run.t[window]
    mean, error = _mean_speed(run, motion, window)
    found = []
    for motor in range(motion.count):
        own = values[window, motor]
        if not np.isfinite(own).all() or not np.isfinite(mean[motor]):
            continue
        put_in = _mean_input(run, motion, values[:, motor], window)
        if unresolved_input(values[:, motor], window, float(largest[motor])):
            counts["unresolved"] += 1
            continue
        sides = _sides(motion, window, motor, usual, float(error[motor]), put_in)
        if np.mean(sides == 0.0) > REST_SHARE:
            counts["resting"] += 1
            if not sides.any():
                rest[motor] = np.nanmax([rest[motor], abs(put_in)])
            continue
        change = (_end_speed(run, motion, window, motor, -1) - _end_speed(run, motion, window, motor, 0)) / np.ptp(t)
        found.append((put_in, mean[motor], error[motor], float(np.mean(sides)), change, motor))
    return found


def _mean_input(run: Run, motion: _Motion, whole: FloatArray, window: slice) -> float:
    """Mean over the window: of held values where the input comes in steps, else of a cubic through the rows.

    Straight lines from row to row would cut the crests of a sine of 20 rows by almost a percent.
    """
    t, own = run.t[window], whole[window]
    held = np.mean(np.diff(own) != 0.0) <= max(STEPWISE, 2.0 / len(own))
    if held:
        return float(np.sum(own[:-1] * np.diff(t)) / (t[-1] - t[0]))
    piece = motion.piece(window.start)
    near = slice(max(piece.start, window.start - SPLINE_ROWS), min(piece.stop, window.stop + SPLINE_ROWS))
    if not np.isfinite(whole[near]).all():
        near = window
    return float(CubicSpline(run.t[near], whole[near]).integrate(t[0], t[-1]) / (t[-1] - t[0]))


def _sides(motion: _Motion, window: slice, motor: int, usual: float, error: float, put_in: float) -> FloatArray:
    """Which way the motor turns, row by row: of the speed averaged until its noise no longer turns the sign. Where the
    mean over the whole window is too noisy for a sign, the input tells.
    """
    speed = motion.speed[window, motor]
    speed = np.where(np.isfinite(speed), speed, np.nanmedian(speed))
    rows = len(speed)
    noise = max(float(np.median(np.abs(np.diff(speed)))) * MAD_TO_STD / np.sqrt(2.0), error * np.sqrt(rows))
    count = int(np.ceil((noise / (SIGN_NOISE * usual)) ** 2)) if usual > 0.0 else rows
    if count >= rows:
        return np.full(rows, np.sign(put_in))
    if count > 1:
        padded = np.pad(speed, (count // 2, count - 1 - count // 2), mode="edge")
        speed = np.convolve(padded, np.full(count, 1.0 / count), mode="valid")
    return np.where(np.abs(speed) > SLOW * usual, np.sign(speed), 0.0)


def _end_speed(run: Run, motion: _Motion, window: slice, motor: int, end: int) -> float:
    """Speed at an end of a window, from the rows around it [rad/s]."""
    rows = window.stop - window.start
    half = max(1, round(EDGE_SHARE * rows / 2))
    middle = window.start if end == 0 else window.stop - 1
    piece = motion.piece(middle)
    near = slice(max(piece.start, middle - half), min(piece.stop, middle + half + 1))
    if motion.angle is None:
        return float(robust_mean(motion.speed[near, motor])[0])
    angle, t = motion.angle[near, motor], run.t[near]
    return float((angle[-1] - angle[0]) / (t[-1] - t[0]))
