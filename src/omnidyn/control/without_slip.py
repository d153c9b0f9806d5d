"""What controllers believe of a robot whose wheels may slip: wheels that roll, and currents that keep them rolling."""

from __future__ import annotations

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.simulation.slip.plant import grips

LEAST_AMPERES = 1e-6  # [A] of the motor of a wheel that carries nothing


def without_slip(robot: Robot) -> Robot:
    """The robot without slip: a motor may push no harder at the rim than the floor takes, mu N (static loads).

    Rotors and friction at the wheel take their part of that push, so the floor is asked for less. The same robot where
    wheels never slip.
    """
    if robot.wheels.traction_mu is None:
        return robot
    motor, count = robot.motor, robot.wheels.count
    push = per_wheel(motor.gear_ratio, count) * per_wheel(motor.torque_constant, count) / robot.wheels.radii  # [N/A]
    motor_limit = per_wheel(np.inf if motor.current_limit is None else motor.current_limit, count)
    limit = np.clip(grips(robot) / push, LEAST_AMPERES, motor_limit)
    return robot.replace(
        wheels=robot.wheels.replace(traction_mu=None), motor=motor.replace(current_limit=tuple(limit.tolist()))
    )
