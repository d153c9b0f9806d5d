"""Runs against the reference that goes from event to event."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.reference.modes import reference
from tests.support.mixed_robots import random_voltages

ROWS = 7


def of_error(run: Run, twist: FloatArray) -> float:
    """The largest error of a run [m/s], yaw counted by a tenth."""
    return float((np.abs(run.twist - twist) * [1.0, 1.0, 0.1]).max())


def meet_events(robot: Robot, seed: int) -> None:
    """Within tol [m/s], 10 tol [rad/s] under random voltages, and at rest in the same rows."""
    voltage, dt = (part[:ROWS] for part in random_voltages(robot, seed))
    truth = reference(robot, voltage, dt)
    assert truth.margin > 1e-9
    for tol in (1e-5, 1e-7):
        run = simulate(robot, voltage, dt, tol=tol)
        assert of_error(run, truth.twist) <= tol
        assert np.abs(run.pose - truth.pose).max() <= tol
        assert ((run.twist == 0.0) == truth.stuck[:, :3]).all()
        assert not run.warnings


def meet_modes(robot: Robot, voltage: FloatArray, dt: FloatArray) -> None:
    """At tol 1e-7: within 1e-6 [m/s], 1e-5 [rad/s], 1e-6 [m, rad], and at rest in the same rows."""
    truth = reference(robot, voltage, dt)
    run = simulate(robot, voltage, dt, tol=1e-7)
    assert not run.warnings
    assert np.abs(run.twist[:, :2] - truth.twist[:, :2]).max() <= 1e-6
    assert np.abs(run.twist[:, 2] - truth.twist[:, 2]).max() <= 1e-5
    assert np.abs(run.pose - truth.pose).max() <= 1e-6
    np.testing.assert_array_equal(run.twist == 0.0, truth.stuck[:, :3])
