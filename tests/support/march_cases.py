"""Random robots on random voltages, and all that their sensors would show: what the march of output error must meet."""

import numpy as np

from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.simulate import simulate
from tests.support.robots import random_program, random_robot, robot_of

ROBOT_KEYS = (
    *(f"friction.axes.{name}[{axis}]" for name in ("viscous", "coulomb") for axis in range(3)),
    "body.mass_kg",
    "body.inertia_kg_m2",
    "motor.resistance_ohm",
    "motor.torque_constant_Nm_A",
    "motor.emf_constant_Vs_rad",
    "motor.gear_ratio",
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
)
FACING = 0.7  # heading at the start [rad]


def a_case(seed, steps=300):
    """(robot, run): a random robot with S = C and irregular steps of 1 to 30 ms, from a start in motion."""
    robot = robot_of(random_robot(seed))
    robot = robot.replace(
        friction=robot.friction.replace(axes=robot.friction.axes.replace(breakaway=None)),
        motor=robot.motor.replace(voltage_limit=24.0),
    )
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.001, 0.03, steps) if seed % 2 else np.full(steps, 0.01)
    voltage = 0.8 * random_program(seed, steps, robot.wheels.count)
    start = rng.normal(size=3) * [0.3, 0.3, 2.0]
    return robot, simulate(robot, voltage, dt, twist=start), voltage, dt, start


def truth(robot, voltage, dt, start, facing=FACING):
    """(heading, x, y, angles of the wheels) at every row.

    The axes do not couple: with a yaw that cannot move, the path of simulate is the integral of the speeds, which the
    wheels have rolled.
    """
    run = simulate(robot, voltage, dt, twist=start, pose=[0.0, 0.0, facing])
    levels = [*robot.friction.axes.coulomb[:2], 1e5]
    stuck = robot.replace(friction=robot.friction.replace(axes=robot.friction.axes.replace(coulomb=tuple(levels))))
    rolled = simulate(stuck, voltage, dt, twist=[*start[:2], 0.0]).pose.copy()
    rolled[:, 2] = run.pose[:, 2] - facing
    return np.hstack([run.pose[:, 2:], run.pose[:, :2], wheel_speed(robot.wheels, rolled)])
