"""Logs of encoders and of motion capture, of runs that no engine of omnidyn has made: DOP853, mode by mode."""

from __future__ import annotations

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.reference.modes import reference

TICK = 2.0 * np.pi / 2048  # [rad] of an encoder
CAPTURE = np.array([0.002, 0.002, 0.005])  # [m, m, rad] noise of motion capture
PARTS = 4  # rows of the reference in one of the log, over which speeds are summed by Simpson's rule
RULE = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12.0


def rolled(robot: Robot, voltage: np.ndarray, dt: float) -> tuple[Run, np.ndarray]:
    """(the run from rest, angles of its wheels [rad], shape (rows, n)) under held voltages, shape (rows - 1, n)."""
    true = reference(robot, np.repeat(voltage, PARTS, axis=0), dt / PARTS, rtol=1e-10, atol=1e-11)
    speed = wheel_speed(robot.wheels, true.twist)
    steps = sum(w * speed[k : len(speed) - PARTS + k : PARTS] for k, w in enumerate(RULE)) * dt
    angle = np.vstack([np.zeros(speed.shape[1]), np.cumsum(steps, axis=0)])
    rows = slice(None, None, PARTS)
    held = np.vstack([voltage, voltage[-1:]])
    return Run(
        t=np.linspace(0.0, dt * (len(angle) - 1), len(angle)),
        voltage=held,
        twist=true.twist[rows],
        pose=true.pose[rows],
    ), angle


def counted_log(run: Run, angle: np.ndarray, seed: int) -> Run:
    """What encoders show that begin anywhere within a tick and round down."""
    phase = np.random.default_rng(seed).uniform(0.0, TICK, angle.shape[1])
    return Run(t=run.t, voltage=run.voltage, wheel_angle=np.floor((angle + phase) / TICK) * TICK, source="counts")


def captured_log(run: Run, seed: int) -> Run:
    """What motion capture shows, heading included."""
    assert run.pose is not None
    noise = CAPTURE * np.random.default_rng(seed).standard_normal(run.pose.shape)
    return Run(t=run.t, voltage=run.voltage, pose=run.pose + noise, source="motion capture")
