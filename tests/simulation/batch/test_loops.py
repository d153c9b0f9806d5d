"""Speed loops in blocks: against `simulate`, robot by robot; the same bits in any company; latencies at the ticks."""

import numpy as np
import pytest

import omnidyn
from tests.simulation.batch.test_latency import ROBOTS

DT, ROWS = 0.02, 60
RNG = np.random.default_rng(11)
SPEEDS = np.repeat(RNG.uniform(-15.0, 15.0, (ROWS // 10, 3)), 10, axis=0) * (np.arange(ROWS)[:, None] % 30 < 20)
OWN = SPEEDS + RNG.uniform(-2.0, 2.0, (70, ROWS, 3))


def looped(name, **drive):
    robot = ROBOTS[name]
    numbers = {"kind": "speed", "kp": 0.3, "ki": 2.0, "rate": 100.0, "dead_band": 0.2} | drive
    return robot.replace(drive=robot.drive.replace(**numbers))


@pytest.mark.parametrize("rate", [30.0, 50.0, 100.0, 130.0])
@pytest.mark.parametrize("name", list(ROBOTS))
def test_a_loop_does_as_simulate_says(name, rate):
    robot = looped(name, rate=rate)
    run = omnidyn.simulate_batch([robot] * 3, wheel_speed_command=SPEEDS, dt=DT, every=1, statistics=True)
    assert run.engines == {"implicit engine, fixed step, in blocks": 3}
    one = omnidyn.simulate(robot, wheel_speed_command=SPEEDS, dt=DT, tol=None)
    np.testing.assert_allclose(run.twists[1], one.twist, atol=1e-10)
    np.testing.assert_allclose(run.poses[1], one.pose, atol=1e-10)
    np.testing.assert_array_equal(run.twists[1] == 0.0, one.twist == 0.0)
    np.testing.assert_allclose(run.twist_statistics.mean[2], one.twist[1:].mean(axis=0), atol=1e-10)


@pytest.mark.parametrize("name", list(ROBOTS))
@pytest.mark.parametrize("latency", [13e-6, 0.0137, 0.045])
def test_a_late_set_point_counts_from_the_next_tick(name, latency):
    """Against adaptive steps of 1e-8 m/s, in rows of a quarter; a tick more of latency would be seen."""
    one = omnidyn.simulate(looped(name, latency=latency), wheel_speed_command=SPEEDS, dt=DT, tol=1e-8)

    def error(latency):
        robot, rows = looped(name, latency=latency), np.repeat(SPEEDS, 4, axis=0)
        run = omnidyn.simulate_batch([robot], wheel_speed_command=rows, dt=DT / 4, every=4)
        return float(np.sqrt(np.mean((run.twists[0] - one.twist) ** 2)))

    assert error(latency) < 1e-3 < 0.1 * error(latency + 0.01)


@pytest.mark.parametrize("pose", [None, "exact"])
def test_bits_do_not_depend_on_company_or_stretches(pose):
    robots = [looped("ellipse", rate=(30.0, 100.0, 130.0)[k % 3], latency=0.013 * (k % 4)) for k in range(70)]
    run = omnidyn.simulate_batch(robots, wheel_speed_command=OWN, dt=DT, pose=pose, every=1, threads=2)
    batch = omnidyn.Batch(robots, DT, command="wheel_speed_command", pose=pose)
    batch.run(OWN[:, :20])
    for k in range(20, 30):
        batch.step(OWN[:, k])
    state = batch.run(OWN[:, 30:]).end
    np.testing.assert_array_equal(state.twist, run.end.twist)
    for k in (0, 1, 2, 69):
        alone = omnidyn.simulate_batch([robots[k]], wheel_speed_command=OWN[k], dt=DT, pose=pose)
        np.testing.assert_array_equal(alone.end.twist[0], run.end.twist[k])
        if pose:
            np.testing.assert_array_equal(alone.end.pose[0], run.end.pose[k])


def test_a_reset_begins_the_loops_of_its_own_robots_anew():
    robots, mask = [looped("ellipse", rate=130.0, latency=0.013 * (k % 4)) for k in range(70)], np.arange(70) % 3 == 0
    batch, other = (omnidyn.Batch(robots, DT, command="wheel_speed_command") for _ in range(2))
    for one in (batch, other):
        one.run(SPEEDS[:13])
    batch.reset(mask)
    for row in SPEEDS[13:25]:
        state, undisturbed = batch.step(row), other.step(row)
    np.testing.assert_array_equal(state.twist[~mask], undisturbed.twist[~mask])
    fresh = omnidyn.simulate_batch(robots, wheel_speed_command=SPEEDS[13:25], dt=DT)
    np.testing.assert_array_equal(state.twist[mask], fresh.end.twist[mask])
    np.testing.assert_array_equal(state.pose[mask], fresh.end.pose[mask])


def test_a_loop_fails_alone():
    robots, own = [looped("box")] * 70, OWN.copy()
    own[5, 30, 1] = np.nan
    run, right = (omnidyn.simulate_batch(robots, wheel_speed_command=rows, dt=DT, every=1) for rows in (own, OWN))
    np.testing.assert_array_equal(np.flatnonzero(run.end.failed), [5])
    others = np.arange(70) != 5
    np.testing.assert_array_equal(run.twists[others], right.twists[others])
    assert np.isnan(run.twists[5, 31:]).all()
