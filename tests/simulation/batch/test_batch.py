"""Batches: the same bits in any company, what is kept, what fails, resets; against `simulate` and closed forms."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from tests.support.exported import exact_robot

DT, ROWS = 0.004, 300
RNG = np.random.default_rng(5)
VOLTAGE = np.repeat(RNG.uniform(-4.0, 4.0, (ROWS // 20, 3)), 20, axis=0) * (np.arange(ROWS)[:, None] % 60 < 45)
ROBOT = omnidyn.load_robot("axebot")


@pytest.fixture(scope="module")
def robots():
    """Robots of three wheels with breakaway and dead bands; one of them goes alone."""
    robots = [exact_robot(4 * k) for k in range(130)]
    robots[5] = robots[5].replace(motor=robots[5].motor.replace(current_limit=2.0))
    return robots


@pytest.mark.parametrize("pose", [None, "fast", "exact"])
def test_bits_do_not_depend_on_company_or_threads(robots, pose):
    options = {"every": 10, "statistics": True, "pose": pose}
    one_thread = omnidyn.simulate_batch(robots, VOLTAGE, DT, threads=1, **options)
    two_threads = omnidyn.simulate_batch(robots, VOLTAGE, DT, threads=2, **options)
    own_volts = omnidyn.simulate_batch(robots, np.tile(VOLTAGE, (130, 1, 1)), DT, threads=2, **options)
    for other in (two_threads, own_volts):
        np.testing.assert_array_equal(one_thread.twists, other.twists)
        np.testing.assert_array_equal(one_thread.twist_statistics, other.twist_statistics)
        if pose:
            np.testing.assert_array_equal(one_thread.poses, other.poses)
    for k in (0, 64, 129):
        alone = omnidyn.simulate_batch(robots[k : k + 1], VOLTAGE, DT, **options)
        np.testing.assert_array_equal(alone.twists[0], one_thread.twists[k])
        np.testing.assert_array_equal(alone.end.twist[0], one_thread.end.twist[k])
        if pose:
            np.testing.assert_array_equal(alone.end.pose[0], one_thread.end.pose[k])


def test_exact_is_what_simulate_gives(robots):
    batch = omnidyn.simulate_batch(robots, VOLTAGE, DT, every=1, statistics=True)
    for k in range(0, 130, 7):
        run = omnidyn.simulate(robots[k], VOLTAGE, DT, tol=None)
        assert np.abs(batch.twists[k] - run.twist).max() < 1e-12
        assert np.abs(batch.poses[k] - run.pose).max() < 1e-12
        np.testing.assert_array_equal(batch.twists[k] == 0.0, run.twist == 0.0)
        for kept, values in ((batch.twist_statistics, run.twist[1:]), (batch.pose_statistics, run.pose[1:])):
            np.testing.assert_allclose(kept.mean[k], values.mean(axis=0), atol=1e-12)
            np.testing.assert_allclose(kept.rms[k], np.sqrt((values**2).mean(axis=0)), atol=1e-12)
            np.testing.assert_allclose(kept.least[k], values.min(axis=0), atol=1e-12)
            np.testing.assert_allclose(kept.largest[k], values.max(axis=0), atol=1e-12)


def test_fast_pose_is_near_over_ten_seconds_at_1_khz():
    t = np.arange(10_000)[:, None] * 1e-3
    voltage = 6.0 * np.sin(2.0 * np.pi * t * [1.3, 2.1, 3.7]) * (np.arange(10_000)[:, None] % 3000 < 2500)
    fast = omnidyn.simulate_batch([ROBOT], voltage, 1e-3, pose="fast", every=100)
    exact = omnidyn.simulate(ROBOT, voltage, 1e-3)
    np.testing.assert_array_equal(fast.twists[0], exact.twist[::100])
    assert np.abs(fast.poses[0] - exact.pose[::100]).max() < 2e-6


def test_a_step_of_a_second_goes_as_simulate_goes():
    voltage = np.array([[0.0, 4.0, -2.0], [0.0, 0.0, 0.0], [5.0, 5.0, 5.0]])
    batch, run = omnidyn.simulate_batch([ROBOT] * 3, voltage, 1.0, every=1), omnidyn.simulate(ROBOT, voltage, 1.0)
    assert np.abs(batch.poses[1] - run.pose).max() < 1e-12


def test_single_precision_is_near(robots):
    half = omnidyn.simulate_batch(robots, VOLTAGE, DT, dtype=np.float32, pose="fast")
    full = omnidyn.simulate_batch(robots, VOLTAGE, DT, pose="fast")
    assert np.abs(half.end.twist - full.end.twist).max() < 1e-4
    assert np.abs(half.end.pose - full.end.pose).max() < 1e-3
    assert np.any(half.end.twist != full.end.twist)


def test_steps_are_the_run(robots):
    batch = omnidyn.Batch(robots[:70], DT)
    for row in VOLTAGE[:60]:
        state = batch.step(row)
    run = omnidyn.simulate_batch(robots[:70], VOLTAGE[:60], DT)
    np.testing.assert_array_equal(state.twist, run.end.twist)
    np.testing.assert_array_equal(state.pose, run.end.pose)


def test_a_partial_reset_touches_no_other_robot(robots):
    members, mask = robots[:70], np.arange(70) % 3 == 0
    batch, other = omnidyn.Batch(members, DT), omnidyn.Batch(members, DT)
    for row in VOLTAGE[:30]:
        batch.step(row)
        other.step(row)
    batch.reset(mask)
    for row in VOLTAGE[30:60]:
        state, undisturbed = batch.step(row), other.step(row)
    np.testing.assert_array_equal(state.twist[~mask], undisturbed.twist[~mask])
    np.testing.assert_array_equal(state.pose[~mask], undisturbed.pose[~mask])
    fresh = omnidyn.simulate_batch(members, VOLTAGE[30:60], DT)
    np.testing.assert_array_equal(state.twist[mask], fresh.end.twist[mask])
    np.testing.assert_array_equal(state.pose[mask], fresh.end.pose[mask])


@pytest.mark.parametrize("pose", [None, "fast", "exact"])
def test_one_robot_fails_alone(robots, pose):
    members = robots[:70]  # of all engines
    own = np.tile(VOLTAGE[:40], (70, 1, 1))
    own[[1, 3, 65], [0, 20, 39], 1] = np.nan, np.inf, np.nan
    batch = omnidyn.Batch(members, DT, pose=pose)
    run = batch.run(own, every=1, statistics=True)
    failed = np.isin(np.arange(70), [1, 3, 65])
    np.testing.assert_array_equal(run.end.failed, failed)
    np.testing.assert_array_equal(np.isnan(run.end.twist).all(axis=1), failed)
    np.testing.assert_array_equal(np.isnan(run.twist_statistics.mean).all(axis=1), failed)
    assert np.isfinite(run.twists[3, :21]).all()
    assert np.isnan(run.twists[3, 21:]).all()
    right = omnidyn.simulate_batch(members, VOLTAGE[:40], DT, pose=pose)
    np.testing.assert_array_equal(run.end.twist[~failed], right.end.twist[~failed])
    assert batch.step([0.0, 0.0, 0.0]).failed[3]
    state = batch.reset(failed)
    assert not state.failed.any()
    assert not state.twist[failed].any()


def test_starts_of_their_own_and_a_start_that_is_no_number():
    twist = np.array([[0.3, 0.0, 1.0], [np.nan, 0.0, 0.0], [0.0, -0.2, 0.0]])
    run = omnidyn.simulate_batch([ROBOT] * 3, VOLTAGE[:50], DT, start_twist=twist, start_pose=(1.0, 2.0, 0.5))
    np.testing.assert_array_equal(run.end.failed, [False, True, False])
    single = omnidyn.simulate(ROBOT, VOLTAGE[:50], DT, twist=twist[0], pose=(1.0, 2.0, 0.5))
    assert np.abs(run.end.pose[0] - single.pose[-1]).max() < 1e-12


def test_a_robot_that_turns_too_far_in_a_step_fails_where_simulate_refuses():
    twist = [[0.0, 0.0, 900.0], [0.0, 0.0, 1.0]]
    with pytest.raises(InputError, match="too far"):
        omnidyn.simulate(ROBOT, np.zeros((2, 3)), 1000.0, twist=twist[0])
    run = omnidyn.simulate_batch([ROBOT] * 2, np.zeros((2, 3)), 1000.0, start_twist=twist)
    np.testing.assert_array_equal(run.end.failed, [True, False])
    assert np.isnan(run.end.pose[0]).all()


def test_duties_and_wheel_speeds():
    duty = VOLTAGE[:50] / 6.0
    driven = ROBOT.replace(drive=ROBOT.drive.replace(kind="duty", supply=7.0))
    run = omnidyn.simulate_batch([driven] * 2, duty=duty, dt=DT)
    assert np.abs(run.end.twist[1] - omnidyn.simulate(driven, duty=duty, dt=DT).twist[-1]).max() < 1e-12
    loop = omnidyn.load_robot("robotino")
    speeds = np.tile([3.0, -1.0, -2.0], (30, 1))
    run = omnidyn.simulate_batch([loop], wheel_speed_command=speeds, dt=0.01, every=1)
    single = omnidyn.simulate(loop, wheel_speed_command=speeds, dt=0.01, tol=None)
    np.testing.assert_allclose(run.twists[0], single.twist, atol=1e-12)
    with pytest.raises(InputError, match="takes no wheel_speed_command"):
        omnidyn.simulate_batch([ROBOT], wheel_speed_command=speeds, dt=0.01)


def test_volts_beyond_the_limit_are_clipped_and_told():
    limits = [ROBOT, ROBOT.replace(motor=ROBOT.motor.replace(voltage_limit=3.0))]
    run = omnidyn.simulate_batch(limits, np.full((20, 3), 5.0), DT, every=1)
    assert [statement.code for statement in run.warnings] == ["clipped"]
    for k, robot in enumerate(limits):
        assert np.abs(run.twists[k] - omnidyn.simulate(robot, np.full((20, 3), 5.0), DT).twist).max() < 1e-12


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: omnidyn.simulate_batch([], VOLTAGE, DT), "no robot"),
        (lambda: omnidyn.simulate_batch([ROBOT, omnidyn.load_robot("four-wheel")], VOLTAGE, DT), "3 and 4 wheels"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE[:, :2], DT), "wrong shape"),
        (lambda: omnidyn.simulate_batch([ROBOT], np.tile(VOLTAGE, (2, 1, 1)), DT), "wrong shape"),
        (lambda: omnidyn.simulate_batch([ROBOT], np.full((2, 3), np.nan), DT), "not a finite number"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, [DT] * ROWS), "one number"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, DT, pose="slow"), "no such pose"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, DT, dtype=int), "no such dtype"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, DT, threads=0), "threads"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, DT, every=0), "every"),
        (lambda: omnidyn.simulate_batch([ROBOT], VOLTAGE, DT, duty=VOLTAGE), "voltage and duty"),
        (lambda: omnidyn.Batch([ROBOT], DT).reset([1]), "not a mask"),
        (lambda: omnidyn.simulate_batch([ROBOT], duty=VOLTAGE, dt=DT), "needs a supply"),
    ],
)
def test_bad_calls_are_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.parametrize("robots", [omnidyn.load_robot("axebot"), "axebot", ["axebot"]])
def test_what_is_no_list_of_robots_is_refused(robots):
    with pytest.raises(InputError, match=r"not robots.*\[robot\] \* n is n robots alike"):
        omnidyn.simulate_batch(robots, np.zeros((5, 3)), 0.01)
