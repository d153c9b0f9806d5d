"""Current limits and motors that coast, in blocks: against the general engine, robot by robot."""

import numpy as np
import pytest

import omnidyn
from omnidyn.simulation.batch.engine_kind import LIMITED, engine_kind
from tests.simulation.batch.test_implicit import turning_robot
from tests.simulation.batch.test_latency import ROBOTS

DT, ROWS = 0.004, 150
RNG = np.random.default_rng(4)
VOLTS = np.repeat(RNG.uniform(-6.0, 6.0, (ROWS // 10, 3)), 10, axis=0) * (np.arange(ROWS)[:, None] % 50 < 40)
DUTY = np.where(RNG.random((ROWS // 10, 3)).repeat(10, axis=0) < 0.2, 0.0, VOLTS / 6.0)


def limited(robot, most):
    return robot.replace(motor=robot.motor.replace(current_limit=most))


def coasting(robot, latency=0.0):
    drive = robot.drive.replace(kind="duty", supply=6.0, off="coast", latency=latency)
    return robot.replace(drive=drive)


@pytest.fixture(scope="module")
def fleet():
    return [
        limited(turning_robot(seed), 1.5 * 3.0 ** np.random.default_rng(seed).uniform(-1, 1)) for seed in range(200)
    ]


def near(batch, robots, runs):
    for k, run in enumerate(runs):
        scale = np.maximum(1.0, np.abs(run.twist).max(axis=0))
        assert np.max(np.abs(batch.twists[k] - run.twist) / scale) < 1e-10, robots[k].name
        assert np.max(np.abs(batch.poses[k] - run.pose)) < 1e-9, robots[k].name
        np.testing.assert_array_equal(batch.twists[k] == 0.0, run.twist == 0.0)


def test_limits_are_those_of_the_general_engine(fleet):
    assert {engine_kind(robot, "voltage", None) for robot in fleet} == set(LIMITED.values())
    batch = omnidyn.simulate_batch(fleet, VOLTS, DT, every=1)
    assert batch.engines == {"implicit engine, fixed step, in blocks": 200}
    runs = [omnidyn.simulate(robot, VOLTS, DT, tol=None) for robot in fleet]
    met = [
        np.abs(run.current).max() >= robot.motor.current_limit * (1.0 - 1e-9)
        for run, robot in zip(runs, fleet, strict=True)
    ]
    assert 0.2 < np.mean(met) < 0.98
    near(batch, fleet, runs)


@pytest.mark.parametrize("name", list(ROBOTS))
def test_motors_coast_one_and_all(name):
    robots = [coasting(ROBOTS[name]), limited(coasting(ROBOTS[name]), 1.0)]
    batch = omnidyn.simulate_batch(robots, duty=DUTY, dt=DT, every=1)
    assert batch.engines == {"implicit engine, fixed step, in blocks": 2}
    near(batch, robots, [omnidyn.simulate(robot, duty=DUTY, dt=DT, tol=None) for robot in robots])


def test_nothing_under_way_coasts():
    """Before the first command acts a robot that moves coasts; a reset forgets what was under way."""
    robot = coasting(ROBOTS["ellipse"], latency=DT * 2.0)
    begin = np.zeros((40, 3)) + 0.4
    run = omnidyn.simulate_batch([robot] * 3, duty=begin, dt=DT, every=1, start_twist=(0.5, 0.2, 1.0))
    one = omnidyn.simulate(robot, duty=begin, dt=DT, twist=(0.5, 0.2, 1.0), tol=None)
    np.testing.assert_allclose(run.twists[1], one.twist, atol=1e-12)
    batch = omnidyn.Batch([robot] * 70, DT, command="duty", start_twist=(0.5, 0.2, 1.0))
    batch.run(begin)
    batch.reset(np.arange(70) == 3)
    np.testing.assert_array_equal(batch.run(begin).end.twist[3], run.end.twist[1])


def test_bits_do_not_depend_on_company_or_threads(fleet):
    one = omnidyn.simulate_batch(fleet, VOLTS, DT, threads=1)
    two = omnidyn.simulate_batch(fleet, np.tile(VOLTS, (200, 1, 1)), DT, threads=2)
    np.testing.assert_array_equal(one.end.twist, two.end.twist)
    np.testing.assert_array_equal(one.end.pose, two.end.pose)
    for k in (0, 65, 199):
        alone = omnidyn.simulate_batch([fleet[k]], VOLTS, DT)
        np.testing.assert_array_equal(alone.end.pose[0], one.end.pose[k])
