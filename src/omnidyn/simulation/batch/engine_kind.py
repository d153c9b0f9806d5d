"""Which engine moves which robot of a batch: what a robot is decides, not the company it is in."""

from __future__ import annotations

import numpy as np

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.simulation.exact.exact_march import why_not_exact

EXACT, BOX, DIRECTION, GENERAL = "exact", "box", "direction", "general"
LIMITED = {BOX: "box, limited", DIRECTION: "direction, limited"}  # motors with a current limit, or that coast
VOLTAGE, DUTY, WHEEL_SPEED = "voltage", "duty", "wheel_speed_command"
NO_FRICTION = (0.0, 0.0, 0.0)


def engine_kind(robot: Robot, command: str, tol: float | None) -> str:
    """EXACT: blocks by the exact formula. BOX, DIRECTION: blocks of fixed implicit steps, friction of the axes or along
    the direction of travel; LIMITED: the same of motors with a current limit, or that coast. GENERAL: the engine of
    `simulate`, robot by robot.

    command: what is given. tol [m/s]: of an engine that is not exact, None for one fixed step a row.
    """
    if robot.motor.electrical == DYNAMIC:
        return GENERAL
    limited = robot.motor.current_limit is not None or (command == DUTY and robot.drive.coasts)
    if command != WHEEL_SPEED and not limited and not why_not_exact(robot):
        return EXACT
    shape = _shape(robot.friction)
    if tol is not None or shape == GENERAL or why_not_exact(_on_axes(robot)):
        return GENERAL
    if limited:
        return GENERAL if command == WHEEL_SPEED else LIMITED[shape]
    return shape


def _shape(friction: Friction) -> str:
    """BOX or DIRECTION, where no level falls and nothing holds more than it slides with."""
    axes, direction = friction.axes, friction.direction
    bare = DirectionFriction(
        coulomb=direction.coulomb,
        breakaway=direction.coulomb,
        viscous=direction.viscous,
        yaw_coulomb=direction.yaw_coulomb,
        yaw_breakaway=direction.yaw_coulomb,
        yaw_viscous=direction.yaw_viscous,
        ellipse=direction.ellipse,
    )
    if friction.wheels != WheelFriction() or not axes.is_plain or axes.breakaway not in (None, axes.coulomb):
        return GENERAL
    held = (
        direction.breakaway or direction.coulomb,
        direction.yaw_coulomb if direction.yaw_breakaway is None else direction.yaw_breakaway,
    )
    if direction.replace(breakaway=held[0], yaw_breakaway=held[1]) != bare:
        return GENERAL
    if direction.coulomb == (0.0, 0.0):
        return BOX
    round_ = direction.coulomb[0] == direction.coulomb[1] or direction.ellipse == "dissipation"
    return DIRECTION if round_ and min(direction.coulomb) > 0.0 and axes.coulomb[:2] == (0.0, 0.0) else GENERAL


def _on_axes(robot: Robot) -> Robot:
    """The robot without turning frame and limit, its damping on the axes: what else the exact engine lacks stays."""
    direction = robot.friction.direction
    damping = np.add(robot.friction.axes.viscous, (direction.viscous, direction.viscous, direction.yaw_viscous))
    return robot.model_copy(
        update={
            "body": robot.body.model_copy(update={"rotating_frame": False}),
            "motor": robot.motor.model_copy(update={"current_limit": None}),
            "friction": Friction(axes=AxesFriction(viscous=tuple(damping.tolist()), coulomb=NO_FRICTION)),
        }
    )
