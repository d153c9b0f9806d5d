"""Logs as the fits of motors see them: input, speed and angle of each motor, from whatever column they came."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.clocks import usual_step
from omnidyn.errors import InputError
from omnidyn.findings.needs import MOTOR_INPUTS, motor_input
from omnidyn.logs.plateaus import live_angle
from omnidyn.logs.resolved import rows_of_mean
from omnidyn.logs.segments import on_clock_of, segments
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import SENSORS, Run
from omnidyn.statement import Statement
from omnidyn.statistics import stretches

# Unit of each input, and how many of it in one SI unit.
INPUTS: dict[str, tuple[str, float]] = dict(zip(MOTOR_INPUTS, (("V", 1.0), ("%", 100.0), ("A", 1.0)), strict=True))
WHEEL, GROUND = "wheel", "ground"
HEADING = "heading, the robot turning on the spot"


@dataclass(frozen=True, eq=False)
class MotorLog:
    """One run. Arrays of shape (rows, motors).

    put_in: in `unit`, of `kind` (INPUTS). speed [rad/s] and angle [rad], as measured; one of them may be None.
    motion [rad/s]: by the angle where there is one. motion_from: its origin in words. pieces: rows between gaps.
    averaged: per motor, over how many rows its motion is a mean; 1 where it is none.
    given: the input as it held, at the times of all sensors, where they share no stamps: rows are those of the motion.
    """

    run: Run
    kind: str
    put_in: FloatArray
    speed: FloatArray | None
    angle: FloatArray | None
    motion: FloatArray
    motion_from: str
    pieces: tuple[slice, ...]
    averaged: tuple[int, ...]
    given: tuple[FloatArray, FloatArray] | None = None

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
        return self.pieces[bisect_right([each.start for each in self.pieces], row) - 1]


def motor_logs(
    runs: Sequence[Run], kind: str = "", speed: str = WHEEL, robot: Robot | None = None,
    kinds: Sequence[str] = tuple(INPUTS),
) -> list[MotorLog]:  # fmt: skip
    """The runs with one input. kind: one of `kinds`; "" takes the first of them that all runs have.

    speed: "wheel", or "ground": of the heading of a robot that turns on the spot, which needs `robot`.
    Raises InputError for a run without the channels.
    """
    if kind and kind not in kinds:
        raise InputError("no such input", got=kind, expected=", ".join(kinds), where="input")
    wanted = [kind] if kind else kinds
    if found := motor_input(runs, wanted):
        return [_motor_log(run, found, speed, robot) for run in runs]
    lacking = next((run for run in runs if all(getattr(run, name) is None for name in wanted)), None)
    lacking = lacking or (runs[0] if runs else None)
    raise InputError(
        "the motors' input is not in the log", got=", ".join(lacking.channels) if lacking else "no runs",
        expected=", ".join(wanted), where=lacking.source if lacking else "",
    )  # fmt: skip


def _motor_log(run: Run, kind: str, speed: str, robot: Robot | None) -> MotorLog:
    moved = "pose" if speed == GROUND else "wheel_speed" if live_angle(run) is None else "wheel_angle"
    given = (run.t, getattr(run, kind) * INPUTS[kind][1]) if run.staggered and kind not in SENSORS else None
    run = on_clock_of(run, moved)
    put_in, pieces = getattr(run, kind) * INPUTS[kind][1], tuple(segments(run.t))
    if speed == GROUND:
        if run.pose is None or robot is None or not np.isfinite(run.pose[:, 2]).any():
            raise InputError("the heading is not known", got=", ".join(run.channels), expected="heading, and a robot",
                             where=run.source)  # fmt: skip
        angle, measured = run.pose[:, 2:] * wheel_speed(robot.wheels, [0.0, 0.0, 1.0]), None
        origin = HEADING
    elif speed == WHEEL:
        angle, measured = live_angle(run), run.wheel_speed
        origin = "wheel_speed" if angle is None else "wheel_angle"
    else:
        raise InputError("no such speed", got=speed, expected=f"{WHEEL} or {GROUND}", where="speed")
    motion = measured if angle is None else np.gradient(angle, run.t, axis=0) if len(run) > 1 else np.zeros_like(angle)
    if motion is None:
        raise InputError("the log has no speed and no angle of the motors", got=", ".join(run.channels),
                         expected="wheel_angle or wheel_speed", where=run.source)  # fmt: skip
    averaged = [rows_of_mean(np.asarray(column)) or 1 if angle is None else 1 for column in motion.T]
    return MotorLog(run, kind, put_in, measured, angle, motion, origin, pieces, tuple(averaged), given)


def averaged_statements(logs: Sequence[MotorLog], allowed: bool = True) -> list[Statement]:
    """Of which motors the speed is a mean over rows. allowed: whether the fit takes that into account."""
    found: dict[int, list[str]] = {}
    for motor in range(max((log.motors for log in logs), default=0)):
        rows = {log.averaged[motor] for log in logs if motor < log.motors} - {1}
        for each in rows:
            found.setdefault(each, []).append(str(motor + 1))
    return [
        Statement("speed_is_mean", numbers={"motors": names, "rows": rows, "allowed": allowed})
        for rows, names in found.items()
    ]


def orientation(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """+1.0 where a positive input turns a motor forward, -1.0 where it turns it backward. pairs: (input, speed)."""
    return -1.0 if sum(float(np.nansum(put_in * speed)) for put_in, speed in pairs) < 0.0 else 1.0


def orientation_of(logs: Sequence[MotorLog], motor: int) -> float:
    """The same of a motor of some logs."""
    return orientation([(log.put_in[:, motor], log.motion[:, motor]) for log in logs])


def rows_with(known: BoolArray, pieces: Sequence[slice]) -> list[tuple[int, int]]:
    """(first, last) rows between gaps throughout which `known` (rows,) holds."""
    return [(p.start + a, p.start + b - 1) for p in pieces for a, b in stretches(known[p]).tolist()]
