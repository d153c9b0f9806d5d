"""Logs as the fits of motors see them: input, speed and angle of each motor, from whatever column they came."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.clocks import usual_step
from omnidyn.errors import InputError
from omnidyn.findings.needs import MOTOR_INPUTS, motor_input, turns_known
from omnidyn.logs.plateaus import live_angle
from omnidyn.logs.segments import segments
from omnidyn.logs.sensor_rows import on_clock_of
from omnidyn.logs.window_means import rows_of_mean
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import SENSORS, Run
from omnidyn.statement import Statement
from omnidyn.statistics import stretches, t_quantile

if TYPE_CHECKING:
    pass

# Unit of each input, and how many of it in one SI unit.
INPUTS: dict[str, tuple[str, float]] = dict(
    zip(MOTOR_INPUTS, (("V", 1.0), ("%", 100.0), ("A", 1.0), ("N", 1.0)), strict=True)
)
WHEEL, GROUND = "wheel", "ground"
ANGLE, LENGTH = "rad", "m"  # units of what a motor travels
HEADING = "heading, the robot turning on the spot"


@dataclass(frozen=True, eq=False)
class MotorLog:
    """One run. Arrays of shape (rows, motors).

    input_values: in `unit`, of `kind` (INPUTS). speed [rad/s] and angle [rad], as measured; one of them may be None.
    motion [rad/s]: by the angle where there is one. motion_from: its origin in words. pieces: rows between gaps.
    mean_rows: per motor, over how many rows its motion is a mean; 1 where it is none.
    stamped_input: the input as it held, at the times of all sensors, where they share no stamps: rows are those of the
    motion.
    travel: unit of the angle, ANGLE; LENGTH of a linear axis, whose speed is in m/s.
    """

    run: Run
    kind: str
    input_values: FloatArray
    speed: FloatArray | None
    angle: FloatArray | None
    motion: FloatArray
    motion_from: str
    pieces: tuple[slice, ...]
    mean_rows: tuple[int, ...]
    stamped_input: tuple[FloatArray, FloatArray] | None = None
    travel: str = ANGLE

    @property
    def t(self) -> FloatArray:
        return self.run.t

    @property
    def step(self) -> float:
        """Usual time from row to row [s]: the rows are those of the motors, whatever other sensors there are."""
        return usual_step(self.t)

    @property
    def unit(self) -> str:
        return INPUTS[self.kind][0]

    @property
    def motors(self) -> int:
        return self.motion.shape[1]

    def piece(self, row: int) -> slice:
        """The rows between the two gaps around a row."""
        return self.pieces[bisect_right([piece.start for piece in self.pieces], row) - 1]


def motor_logs(
    runs: Sequence[Run],
    kind: str = "",
    speed: str = WHEEL,
    robot: Robot | None = None,
    kinds: Sequence[str] = tuple(INPUTS),
) -> list[MotorLog]:
    """The runs with one input. kind: one of `kinds`; "" takes the first of them that all runs have.

    speed: "wheel", or "ground": of the heading of a robot that turns on the spot, which needs `robot`.
    Raises InputError for a run without the channels.
    """
    if kind and kind not in kinds:
        raise InputError("no such input", got=kind, expected=", ".join(kinds), where="input")
    wanted_kinds = [kind] if kind else kinds
    if logs_found := motor_input(runs, wanted_kinds):
        return [_motor_log(run, logs_found, speed, robot) for run in runs]
    run_without_input = next((run for run in runs if all(getattr(run, name) is None for name in wanted_kinds)), None)
    run_without_input = run_without_input or (runs[0] if runs else None)
    raise InputError(
        "the motors' input is not in the log",
        got=", ".join(run_without_input.channels) if run_without_input else "no runs",
        expected=", ".join(wanted_kinds),
        where=run_without_input.source if run_without_input else "",
    )


def _motor_log(run: Run, kind: str, speed: str, robot: Robot | None) -> MotorLog:
    axis = speed == WHEEL and is_axis(run)
    motion_channel = "pose" if speed == GROUND else "wheel_speed" if live_angle(run) is None else "wheel_angle"
    if axis:
        motion_channel = "pose" if _along_x(run.pose) is not None else "twist"
    stamped_input = (run.t, getattr(run, kind) * INPUTS[kind][1]) if run.staggered and kind not in SENSORS else None
    run = on_clock_of(run, motion_channel)
    input_values, pieces = getattr(run, kind) * INPUTS[kind][1], tuple(segments(run.t))
    if speed == GROUND:
        if run.pose is None or robot is None or not np.isfinite(run.pose[:, 2]).any():
            raise InputError(
                "the heading is not known",
                got=", ".join(run.channels),
                expected="heading, and a robot",
                where=run.source,
            )
        angle, measured = run.pose[:, 2:] * wheel_speed(robot.wheels, [0.0, 0.0, 1.0]), None
        origin = HEADING
    elif axis:
        angle, measured, origin = (
            _along_x(run.pose),
            _along_x(run.twist),
            "x of an axis" if motion_channel == "pose" else "vx",
        )
    elif speed == WHEEL:
        angle, measured = live_angle(run), run.wheel_speed
        origin = "wheel_speed" if angle is None else "wheel_angle"
    else:
        raise InputError("no such speed", got=speed, expected=f"{WHEEL} or {GROUND}", where="speed")
    motion = measured if angle is None else np.gradient(angle, run.t, axis=0) if len(run) > 1 else np.zeros_like(angle)
    if motion is None:
        raise InputError(
            "the log has no speed and no angle of the motors",
            got=", ".join(run.channels),
            expected="wheel_angle or wheel_speed; x or vx of a linear axis",
            where=run.source,
        )
    mean_rows = [rows_of_mean(np.asarray(column)) or 1 if angle is None else 1 for column in motion.T]
    travel = LENGTH if axis else ANGLE
    return MotorLog(
        run, kind, input_values, measured, angle, motion, origin, pieces, tuple(mean_rows), stamped_input, travel
    )


def is_axis(run: Run) -> bool:
    """Whether a log is of a linear axis: one motor, no speed and no angle of a wheel, but x or vx."""
    is_single_motor = run.wheels == 1 and not turns_known(run)
    return is_single_motor and (_along_x(run.pose) is not None or _along_x(run.twist) is not None)


def _along_x(values: FloatArray | None) -> FloatArray | None:
    """The first column of a pose or a twist, shape (rows, 1); None where it was not measured."""
    return None if values is None or not np.isfinite(values[:, 0]).any() else values[:, :1]


def averaged_statements(logs: Sequence[MotorLog], is_allowed: bool = True) -> list[Statement]:
    """Of which motors the speed is a mean over rows. is_allowed: whether the fit takes that into account."""
    logs_by_motor: dict[int, list[str]] = {}
    for motor in range(max((log.motors for log in logs), default=0)):
        rows = {log.mean_rows[motor] for log in logs if motor < log.motors} - {1}
        for row in rows:
            logs_by_motor.setdefault(row, []).append(str(motor + 1))
    return [
        Statement("speed_is_mean", numbers={"motors": names, "rows": rows, "allowed": is_allowed})
        for rows, names in logs_by_motor.items()
    ]


def orientation(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """+1.0 where a positive input turns a motor forward, -1.0 where it turns it backward. pairs: (input, speed)."""
    return -1.0 if sum(float(np.nansum(input_values * speed)) for input_values, speed in pairs) < 0.0 else 1.0


def orientation_of(logs: Sequence[MotorLog], motor: int) -> float:
    """The same of a motor of some logs."""
    return orientation([(log.input_values[:, motor], log.motion[:, motor]) for log in logs])


BLOCKS, LEAST_BLOCKS = 20, 8
MEMORIES = (0.0, 0.05, 0.5)  # [s] over which an input may act
COVARIANCE_QUANTILE = 0.998  # quantile of a covariance that is no chance, of which several are tried


def follows(pairs: Sequence[tuple[FloatArray, FloatArray]], step: float = 0.0) -> bool | None:
    """Whether speeds go with their inputs, whichever way, beyond chance; None where too few rows tell.

    pairs: (input, speed) of each log, shape (rows,). step [s]: of a row, 0 of points that have no time: else what the
    input was up to the row before counts, smoothed over each of MEMORIES.
    The covariance of both in each of BLOCKS blocks is one number, and their mean is told from 0 by their scatter.
    """
    correlations = []
    for memory in MEMORIES if step > 0.0 else MEMORIES[:1]:
        smooth = [_smoothed(input_values, memory / step) if step > 0.0 else input_values for input_values, _ in pairs]
        u, w = np.concatenate(smooth), np.concatenate([speed for _, speed in pairs])
        known_rows = np.isfinite(u) & np.isfinite(w)
        u, w = u[known_rows] - u[known_rows].mean() if known_rows.any() else u[known_rows], w[known_rows]
        count = min(BLOCKS, len(w) // 2)
        if count < LEAST_BLOCKS:
            return None
        sums = np.array([float(part.sum()) for part in np.array_split(u * (w - w.mean()), count)])
        correlations.append(
            abs(float(sums.mean())) > t_quantile(count - 1, COVARIANCE_QUANTILE) * float(sums.std(ddof=1)) / count**0.5
        )
    return any(correlations)


def _smoothed(input_values: FloatArray, rows: float) -> FloatArray:
    """The input up to the row before each, its mean by a memory of so many rows. Shape (rows,)."""
    share, mean_now, means = 1.0 / (1.0 + rows), 0.0, []
    for value in np.nan_to_num(input_values).tolist():
        means.append(mean_now)
        mean_now += share * (value - mean_now)
    return np.array(means)


def rows_with(mask: BoolArray, pieces: Sequence[slice]) -> list[tuple[int, int]]:
    """(first, last) rows between gaps throughout which `mask` (rows,) holds."""
    return [(p.start + a, p.start + b - 1) for p in pieces for a, b in stretches(mask[p]).tolist()]
