"""Commands that act late, in blocks: against `simulate` on the grid of times at which they act."""

import numpy as np
import pytest

import omnidyn
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction

DT, ROWS = 0.01, 120
AXEBOT = omnidyn.load_robot("axebot")
TURNING = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))
ELLIPSE = DirectionFriction(coulomb=(1.2, 0.8), viscous=0.5, yaw_coulomb=0.04, yaw_viscous=0.005)
ROBOTS = {
    "exact": AXEBOT,
    "box": TURNING.replace(friction=Friction(axes=AxesFriction(viscous=(0.9, 0.9, 0.01), coulomb=(1.5, 1.2, 0.06)))),
    "ellipse": TURNING.replace(friction=Friction(direction=ELLIPSE)),
}
LATENCIES = (13e-6, 0.004, 0.01, 0.0237)
RNG = np.random.default_rng(7)
VOLTS = np.repeat(RNG.uniform(-5.0, 5.0, (ROWS // 10, 3)), 10, axis=0) * (np.arange(ROWS)[:, None] % 40 < 30)
OWN = VOLTS + RNG.uniform(-1.0, 1.0, (70, ROWS, 3))


def late(robot, latency):
    return robot.replace(drive=robot.drive.replace(latency=latency))


def on_the_grid_of_commands(robot, latency):
    """(twists, poses) at the ends of rows: whole steps from command to command, then the rest of a row."""
    whole = int(np.floor(latency / DT + 1e-9))
    part = max(latency - whole * DT, 0.0) if latency - whole * DT > 1e-9 * DT else 0.0
    acting = np.concatenate([np.zeros((whole + 1, 3)), VOLTS])[: ROWS + 1]
    lengths = np.full(ROWS, DT)
    if part:
        lengths[0] = part
    first = 0 if part else 1
    steps = omnidyn.simulate(robot, acting[first:ROWS], lengths[first:], tol=None)
    twists, poses = [steps.twist[0]], [steps.pose[0]]
    for k in range(ROWS):
        at = k + 1 - first
        run = omnidyn.simulate(
            robot, acting[k + 1 :][:1], DT - part, tol=None, twist=steps.twist[at], pose=steps.pose[at]
        )
        twists.append(run.twist[-1])
        poses.append(run.pose[-1])
    return np.array(twists), np.array(poses)


@pytest.mark.parametrize("latency", LATENCIES)
@pytest.mark.parametrize("name", list(ROBOTS))
@pytest.mark.some(4)
def test_a_late_robot_takes_whole_steps_between_its_commands(name, latency):
    robot = ROBOTS[name]
    run = omnidyn.simulate_batch([late(robot, latency)] * 3, VOLTS, DT, every=1)
    assert all("in blocks" in engine for engine in run.engines)
    twists, poses = on_the_grid_of_commands(robot, latency)
    np.testing.assert_allclose(run.twists[1], twists, atol=1e-12)
    np.testing.assert_allclose(run.poses[1], poses, atol=1e-11)


@pytest.mark.parametrize("latency", LATENCIES)
@pytest.mark.parametrize("pose", [None, "fast", "exact"])
def test_the_exact_engine_is_simulate(latency, pose):
    robot = late(AXEBOT, latency)
    run, one = omnidyn.simulate_batch([robot], VOLTS, DT, every=1, pose=pose), omnidyn.simulate(robot, VOLTS, DT)
    np.testing.assert_allclose(run.twists[0], one.twist, atol=1e-12)
    if pose:
        np.testing.assert_allclose(run.poses[0], one.pose, atol=1e-12 if pose == "exact" else 1e-4)


@pytest.mark.parametrize("name", ["box", "ellipse"])
def test_implicit_steps_are_as_near_as_without_a_latency(name):
    """Against adaptive steps of 1e-9 m/s: a latency of 3.7 ms costs no digit."""
    errors = []
    for latency in (0.0, 0.0037, 0.0237):
        robot = late(ROBOTS[name], latency)
        run = omnidyn.simulate_batch([robot], np.repeat(VOLTS, 10, axis=0), 1e-3, every=1)
        errors.append(
            np.abs(run.twists[0] - omnidyn.simulate(robot, np.repeat(VOLTS, 10, axis=0), 1e-3, tol=1e-9).twist)
        )
    rms = [float(np.sqrt(np.mean(error**2))) for error in errors]
    assert rms[0] < 2e-3
    assert max(rms[1:]) < 1.3 * rms[0]


@pytest.mark.parametrize("name", list(ROBOTS))
@pytest.mark.parametrize("pose", [None, "fast", "exact"])
@pytest.mark.some(3)
def test_bits_do_not_depend_on_company_on_what_is_kept_or_on_stretches(name, pose):
    latencies = [LATENCIES[k % 4] for k in range(70)]
    latencies[3] = 0.0
    robots = [late(ROBOTS[name], latency) for latency in latencies]
    run = omnidyn.simulate_batch(robots, OWN, DT, pose=pose, every=1, statistics=True, threads=2)
    bare = omnidyn.simulate_batch(robots, OWN, DT, pose=pose, threads=1)
    np.testing.assert_array_equal(run.end.twist, bare.end.twist)
    batch = omnidyn.Batch(robots, DT, pose=pose)
    batch.run(OWN[:, :50])
    for k in range(50, 80):
        batch.step(OWN[:, k])
    np.testing.assert_array_equal(batch.state.twist, run.twists[:, 80])
    state = batch.run(OWN[:, 80:]).end
    np.testing.assert_array_equal(state.twist, run.end.twist)
    if pose:
        np.testing.assert_array_equal(state.pose, run.end.pose)
        np.testing.assert_array_equal(bare.end.pose, run.end.pose)
    for k in (0, 1, 2, 69):
        alone = omnidyn.simulate_batch([robots[k]], OWN[k], DT, pose=pose)
        np.testing.assert_array_equal(alone.end.twist[0], run.end.twist[k])


@pytest.mark.parametrize("name", list(ROBOTS))
def test_a_reset_forgets_what_is_under_way_to_its_own_robots_alone(name):
    robots, mask = [late(ROBOTS[name], LATENCIES[k % 4]) for k in range(70)], np.arange(70) % 3 == 0
    batch, other = omnidyn.Batch(robots, DT), omnidyn.Batch(robots, DT)
    for run in (batch, other):
        run.run(VOLTS[:20])
    batch.reset(mask)
    for row in VOLTS[20:40]:
        state, undisturbed = batch.step(row), other.step(row)
    np.testing.assert_array_equal(state.twist[~mask], undisturbed.twist[~mask])
    np.testing.assert_array_equal(state.pose[~mask], undisturbed.pose[~mask])
    fresh = omnidyn.simulate_batch(robots, VOLTS[20:40], DT)
    np.testing.assert_array_equal(state.twist[mask], fresh.end.twist[mask])
    np.testing.assert_array_equal(state.pose[mask], fresh.end.pose[mask])


def test_a_late_robot_fails_alone():
    robots, own = [late(ROBOTS["ellipse"], LATENCIES[k % 4]) for k in range(70)], OWN.copy()
    own[5, 30, 1] = np.nan
    run, right = omnidyn.simulate_batch(robots, own, DT, every=1), omnidyn.simulate_batch(robots, OWN, DT, every=1)
    np.testing.assert_array_equal(np.flatnonzero(run.end.failed), [5])
    np.testing.assert_array_equal(run.twists[5, :31], right.twists[5, :31])
    assert np.isnan(run.twists[5, 31:]).all()
    others = np.arange(70) != 5
    np.testing.assert_array_equal(run.twists[others], right.twists[others])
