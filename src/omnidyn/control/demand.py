"""What a path asks of a robot: speed, acceleration, volts, amperes; and whether the robot can follow it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.control.feedforward import effort_for
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.path import path as path_named
from omnidyn.control.without_slip import without_slip
from omnidyn.document import Document, Points, plain
from omnidyn.model.inverse import inverse
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.run import Run
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict

SAMPLES = 4001  # times at which a path is asked
JUMP = 1e-6  # [m/s, rad/s] less is rounding
CORNER = 3.0  # times what the acceleration beside it makes of a sample: more is a jump


@dataclass(frozen=True, eq=False)
class Demand(Displayable):
    """What a path asks of a robot.

    robot, path: names. speed [m/s], turn [rad/s], acceleration [m/s^2], turn_acceleration [rad/s^2]: the largest.
    voltage, voltage_limit [V]: of the motor that comes nearest to its limit, or goes furthest beyond; the same for
    current and current_limit [A], the limit None where there is none. grip: whether that limit is the current at which
    a wheel loses its grip of the floor. share_beyond: of its time, that in which some
    limit is exceeded. corners: places where its speed jumps, by `jump` [m/s] or `turn_jump` [rad/s] at the most.
    """

    robot: str
    path: str
    speed: float
    turn: float
    acceleration: float
    turn_acceleration: float
    voltage: float
    voltage_limit: float
    current: float
    current_limit: float | None
    grip: bool
    share_beyond: float
    corners: int
    jump: float
    turn_jump: float

    @cached_property
    def follows(self) -> bool:
        """Whether the robot can follow it between its corners: no limit is exceeded."""
        return self.share_beyond == 0.0

    @property
    def verdict(self) -> Statement:
        """Whether it can."""
        names = ("path", "voltage", "voltage_limit", "current", "current_limit", "grip", "corners")
        numbers = {name: getattr(self, name) for name in names}
        if not self.follows:
            return Statement("cannot_follow", WARNING, self.robot, numbers | {"share": self.share_beyond})
        return Statement("can_follow", NOTE, self.robot, numbers)

    def statements(self) -> list[Statement]:
        """What it asks for."""
        names = ("speed", "acceleration", "turn", "turn_acceleration")
        statements = [Statement("path_asks_for", NOTE, self.path, {name: getattr(self, name) for name in names})]
        if self.corners:
            jumps = {name: getattr(self, name) for name in ("corners", "jump", "turn_jump")}
            statements.append(Statement("speed_jumps", NOTE, numbers=jumps))
        return statements

    def document(self) -> Document:
        """What it says."""
        data = plain(vars(self) | {"follows": self.follows})
        return Document([Points(self.statements())], as_verdict(self.verdict) | data, verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return dict(self.document().data)


def path_demand(robot: Robot, path: Any) -> Demand:
    """What a path asks of a robot, and whether motors and floor can give that: by the inverse model, with friction.

    path: a Path, or what `omnidyn.path` takes. The start from rest is not counted: a robot that begins at rest is late
    by it. Corners are counted by themselves.
    """
    kinds = (Path, Run, str) if isinstance(path, Robot) else object
    check_order("path_demand(robot, path)", (robot, Robot), (path, kinds))
    follow = path_named(path)
    t = np.linspace(0.0, follow.duration, SAMPLES)
    _, twist, change = follow.twist_at(t)
    rolls = without_slip(robot)
    effort = effort_for(inverse(rolls), twist, change)
    count, motor = robot.wheels.count, rolls.motor
    limit = per_wheel(motor.voltage_limit, count)
    limit_amperes = per_wheel(np.inf if motor.current_limit is None else motor.current_limit, count)
    motor_amperes = per_wheel(np.inf if robot.motor.current_limit is None else robot.motor.current_limit, count)
    volts, amperes = np.abs(effort.voltage), np.abs(effort.current)
    beyond = (volts > limit * (1.0 + 1e-9)).any(axis=1) | (amperes > limit_amperes * (1.0 + 1e-9)).any(axis=1)
    worst = int(np.argmax(volts.max(axis=0) / limit))
    hottest = int(np.argmax(amperes.max(axis=0) / (limit_amperes if np.isfinite(limit_amperes).all() else 1.0)))
    corners, jump, turn_jump = _corners(t, follow.at(t).velocity, follow.at(t).acceleration)
    return Demand(
        robot.name,
        follow.name,
        _largest(twist[:, :2]),
        _largest(twist[:, 2:]),
        _largest(change[:, :2]),
        _largest(change[:, 2:]),
        float(volts[:, worst].max()),
        float(limit[worst]),
        float(amperes[:, hottest].max()),
        None if motor.current_limit is None else float(limit_amperes[hottest]),
        bool(limit_amperes[hottest] < motor_amperes[hottest]),
        float(beyond.mean()),
        corners,
        jump,
        turn_jump,
    )


def _largest(vectors: FloatArray) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _corners(t: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> tuple[int, float, float]:
    """(number of jumps of the velocity in the world, the largest in the plane [m/s], of the turning [rad/s])."""
    step = np.diff(velocity, axis=0)
    smooth = np.maximum(np.abs(acceleration[1:]), np.abs(acceleration[:-1])) * np.diff(t)[:, None]
    sudden = np.abs(step) > CORNER * smooth + JUMP
    rows = np.asarray(sudden.any(axis=1), dtype=bool)
    rows[-1] = False  # where a path ends, it stops: that is no corner
    if not rows.any():
        return 0, 0.0, 0.0
    plane = np.hypot(step[rows, 0], step[rows, 1])
    return int(rows.sum()), float(plane.max()), float(np.abs(step[rows, 2]).max())
