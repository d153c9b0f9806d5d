"""What a plan spares beside the room: the battery, the motors, and the grip of the wheels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.motor import traction
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import GRAVITY
from omnidyn.model.wheels import per_wheel
from omnidyn.run import Run

GRIP = "wheels.traction_mu"
GRIP_SHARE = 0.8  # of what the file says the floor takes


class PlanLimits(NamedTuple):
    """current [A]: of all motors together, at any time. heat [W]: in the windings of the hottest motor, in the mean of
    a move and its rest. traction [-]: force of a wheel over what it carries."""

    current: float = np.inf
    heat: float = np.inf
    traction: float = np.inf


class Strain(NamedTuple):
    """What a run asks of a robot: current [A] and traction [-] at most, as of a plan; energy [J]: in the windings of
    the hottest motor."""

    current: float
    energy: float
    traction: float


def limits_of(robot: Robot, given: Mapping[str, Any] | None, learns_grip: bool) -> PlanLimits:
    """The limits of a plan; of wheels that slip, the grip of the file unless it is to be learnt.

    Raises InputError for another name, or what is no number above 0.
    """
    mu, limits = robot.wheels.traction_mu, dict[str, float]()
    if mu is not None and not learns_grip:
        limits["traction"] = GRIP_SHARE * float(np.min(mu))
    for name, value in (given or {}).items():
        if name not in PlanLimits._fields:
            raise InputError("no such limit", got=name, expected=", ".join(PlanLimits._fields), where="limits")
        if not is_number(value) or not value > 0.0:
            raise InputError(f"not a limit of {name}", got=value, expected="a number above 0", where="limits")
        limits[name] = float(value)
    return PlanLimits(**limits)


def strain(robot: Robot, run: Run, dt: float) -> Strain:
    """What a run of wheels that roll asks of a robot. dt [s]: of its rows."""
    current = np.asarray(run.current)
    energy = (current**2 * per_wheel(robot.motor.resistance, robot.wheels.count)).sum(axis=0) * dt
    return Strain(float(np.abs(current).sum(axis=1).max()), float(energy.max()), float(_grip(robot, current).max()))


def _grip(robot: Robot, current: FloatArray) -> FloatArray:
    """Force of the wheels on the floor over what each carries, an equal share of the weight. Shape (rows,)."""
    along = np.cos(np.radians(per_wheel(robot.wheels.roller_angle_deg, robot.wheels.count)))
    load = robot.body.mass * GRAVITY / robot.wheels.count
    return np.abs(traction(robot.motor, robot.wheels, current) / along).max(axis=1) / load
