"""Simulated logs of robots whose friction is known: driven in many directions under held voltages, then spoiled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from omnidyn.model.dynamics import acceleration
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-4  # [m/s] far below the noise
FRICTIONS = {
    "box": Friction(axes=AxesFriction(coulomb=(2.4, 1.6, 0.099), viscous=(0.0, 0.0, 0.0))),
    "disc": Friction(direction=DirectionFriction(coulomb=(2.0, 2.0), yaw_coulomb=0.099)),
    "ellipse": Friction(direction=DirectionFriction(coulomb=(2.4, 1.6), yaw_coulomb=0.099)),
    "wheel": Friction(wheels=WheelFriction(coulomb=0.9)),
}
TRUTH = {
    "box": {"friction.axes.coulomb[0]": 2.4, "friction.axes.coulomb[1]": 1.6},
    "disc": {"friction.direction.coulomb": 2.0},
    "ellipse": {"friction.direction.coulomb[0]": 2.4, "friction.direction.coulomb[1]": 1.6},
    "wheel": {"friction.wheels.coulomb": 0.9},
}


def robot_with(shape: str) -> Robot:
    """The preset axebot with friction of one shape, of a size that the paper's robot has."""
    return load_robot("axebot").replace(name=shape, friction=FRICTIONS[shape])


def steady_voltage(robot: Robot, twist: Sequence[float]) -> FloatArray:
    """Voltages [V] under which a twist stays as it is: the acceleration is affine in the voltage. Shape (wheels,)."""
    none = acceleration(robot, twist, np.zeros(robot.wheels.count))
    columns = np.stack([acceleration(robot, twist, row) - none for row in np.eye(robot.wheels.count)], axis=1)
    return np.linalg.lstsq(columns, -none, rcond=None)[0]


def clean_runs(
    robot: Robot, directions: Sequence[float], speeds: Sequence[float] = (0.4,), seconds: float = 2.0, dt: float = 0.01
) -> list[Run]:
    """A run from rest for each speed [m/s] and direction [degree]: what an honest log would hold."""
    runs = []
    for speed in speeds:
        for degrees in directions:
            angle = np.radians(degrees)
            twist = (speed * np.round(np.cos(angle), 12), speed * np.round(np.sin(angle), 12), 0.0)
            volts = np.tile(steady_voltage(robot, twist), (round(seconds / dt), 1))
            run = simulate(robot, volts, dt, tol=TOLERANCE)
            command = np.tile(twist, (len(run), 1))
            runs.append(run.replace(twist=None, pose=None, twist_command=command, source=f"{robot.name} {degrees:g}"))
    return runs


def spoiled(
    run: Run, generator: np.random.Generator, *, noise: float = 0.1, between: float = 0.03, step: float = 0.02
) -> Run:
    """As a robot would log it: noise [A], a share by which runs differ, readings in steps [A], a few spikes."""
    assert run.current is not None
    assert run.wheel_speed is not None
    shape = run.current.shape
    current = run.current * (1.0 + between * generator.standard_normal()) + noise * generator.standard_normal(shape)
    current = np.where(generator.random(shape) < 0.005, 5.0, current)
    speed = run.wheel_speed + 0.3 * generator.standard_normal(shape)
    return run.replace(current=step * np.round(current / step), wheel_speed=0.25 * np.round(speed / 0.25))
