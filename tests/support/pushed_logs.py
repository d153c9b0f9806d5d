"""A clean log to break: a simulated robot under pushes in many directions, seen through noisy sensors."""

import numpy as np

from omnidyn.logs.log import Log
from omnidyn.simulation.simulate import simulate

RATE = 100.0


def clean_log(robot, seconds=20.0, seed=0, level=4.0):
    """Voltage, current, wheel speed, twist and pose of a run, each with noise."""
    rng = np.random.default_rng(seed)
    segments = []
    n = robot.wheels.count
    for _ in range(int(seconds / 0.5) - 1):
        push = robot.wheels.wrench_matrix.T @ (
            rng.normal(size=3) / [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))]
        )
        segments.append(np.tile(level * rng.uniform(0.5, 1.0) * push / np.abs(push).max(), (int(0.5 * RATE), 1)))
    voltage = np.vstack([np.zeros((int(0.5 * RATE), n)), *segments])
    run = simulate(robot, voltage, 1.0 / RATE, tol=None)
    noisy = {
        name: values + 0.01 * np.abs(values).max(axis=0) * rng.normal(size=values.shape)
        for name, values in {"current": run.current, "wheel_speed": run.wheel_speed, "twist": run.twist}.items()
    }
    pose = run.pose + 1e-3 * rng.normal(size=run.pose.shape)
    channels = {"voltage": run.voltage, **noisy, "pose": pose}
    return Log(run.t, channels, np.arange(len(run)) + 2, source="run.csv")
