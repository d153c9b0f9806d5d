"""Simulated logs with known noise, for the tests of comparison."""

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.prbs import prbs

SPEED_NOISE, WHEEL_NOISE, POSE_NOISE = np.array([0.01, 0.01, 0.05]), 0.3, np.array([2e-3, 2e-3, 5e-3])
NOISE = {"vx": 0.01, "vy": 0.01, "omega": 0.05, "w1": 0.3, "w2": 0.3, "w3": 0.3}


REST = 10  # rows


def clean_log(robot: Robot, seed: int, rows: int = 400, dt: float = 0.01, **start) -> Run:
    """A random drive at irregular times, as an ideal robot would record it. It rests first, unless it starts moving."""
    steps = dt * np.random.default_rng(seed).uniform(0.7, 1.3, rows)
    volts = prbs([4.0] * robot.wheels.count, 0.2, rows * dt, dt, seed)[:rows]
    volts[: 0 if "twist" in start else REST] = 0.0
    return simulate(robot, volts, steps, **start)


def noisy(run: Run, seed: int, **changes) -> Run:
    """The run with white noise on speeds and pose."""
    random = np.random.default_rng(seed)
    given = {
        "twist": run.twist + SPEED_NOISE * random.normal(size=run.twist.shape),
        "wheel_speed": run.wheel_speed + WHEEL_NOISE * random.normal(size=run.wheel_speed.shape),
        "pose": run.pose + POSE_NOISE * random.normal(size=run.pose.shape),
        "current": None,
        "source": f"log {seed}",
    }
    return run.replace(**(given | changes))


def coulomb_times(robot: Robot, factor: float) -> Robot:
    """The robot with its Coulomb friction along the axes scaled."""
    axes = robot.friction.axes
    scaled = axes.replace(coulomb=tuple(factor * each for each in axes.coulomb))
    return robot.replace(friction=robot.friction.replace(axes=scaled), name=f"coulomb x {factor:g}")
