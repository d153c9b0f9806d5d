"""Environments against `simulate` and a live robot: latency, dead band, pushes, means, late poses, draws of robots."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.log_effects import Sensors
from omnidyn.simulation.batch.parameters import batch_parameters
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.pool import Range, largest_voltage
from omnidyn.simulation.live import LiveRobot

AXEBOT = omnidyn.load_robot("axebot")
STILL = (0.0, 0.0, 0.0)
SOMETIMES = Range(1.0, 2.0, when="interval")


def driven(robot, setting, steps=60, seed=2, **options):
    """(environments, actions, twists, poses, observations) of three robots under random actions held for 5 steps."""
    envs = Environments(robot, 3, setting, dtype=np.float64, **options)
    observations = [envs.reset(seed=seed).copy()]
    actions = np.repeat(np.random.default_rng(seed).uniform(-1, 1, (-(-steps // 5), 3, envs.wheels)), 5, axis=0)[:steps]
    twists, poses = [envs.twist], [envs.pose]
    for action in actions:
        observations.append(envs.step(action).observation.copy())
        twists.append(envs.twist)
        poses.append(envs.pose)
    return envs, actions, np.array(twists), np.array(poses), np.array(observations)


@pytest.mark.parametrize("preset", ["axebot", "four-wheel"])
@pytest.mark.parametrize("substeps", [1, 4])
def test_twists_are_those_of_simulate(preset, substeps):
    robot = omnidyn.load_robot(preset)
    envs, actions, twists, _, _ = driven(robot, Setting(substeps=substeps))
    for k in range(3):
        run = omnidyn.simulate(robot, actions[:, k] * largest_voltage(robot), 0.02)
        assert np.abs(twists[:, k] - run.twist).max() < 1e-12
    assert envs.wheels == robot.wheels.count


@pytest.mark.parametrize("dt, substeps, bound", [(0.02, 1, 3e-4), (0.02, 20, 3e-6), (0.001, 1, 3e-6)])
def test_poses_are_those_of_simulate_but_for_stops_within_a_substep(dt, substeps, bound):
    _, actions, _, poses, _ = driven(AXEBOT, Setting("pose", dt, substeps))
    for k in range(3):
        run = omnidyn.simulate(AXEBOT, actions[:, k] * 6.0, dt)
        assert np.abs(poses[:, k] - run.pose).max() < bound


@pytest.mark.parametrize("latency", [0.02, 0.05, 0.026])
def test_actions_are_late_as_those_of_a_live_robot(latency):
    robot = AXEBOT.replace(drive=AXEBOT.drive.replace(latency=latency, dead_band=0.7))
    _, actions, twists, _, _ = driven(robot, Setting())
    live = LiveRobot(robot, 0.02)
    for k, action in enumerate(actions[:, 1]):
        live.step(6.0 * action)
        assert np.abs(live.twist - twists[k + 1, 1]).max() < 1e-12


def test_a_latency_of_the_setting_comes_on_top():
    late = AXEBOT.replace(drive=AXEBOT.drive.replace(latency=0.03))
    assert np.array_equal(driven(late, Setting())[2], driven(AXEBOT, Setting(latency=0.03))[2])


def test_pushes_are_wrenches_that_change_each_interval():
    setting, still = Setting("path", push=(3.0, 3.0, 0.2), interval=0.2, spread=STILL, substeps=5), np.zeros((400, 6))
    envs = Environments(AXEBOT, 1, setting, path=still, dtype=np.float64)
    envs.reset(seed=2)
    live, pushes = LiveRobot(AXEBOT, 0.02), []
    for _ in range(3):
        pushes.append(envs.privileged[0, 6:9])
        live = LiveRobot(AXEBOT, 0.02, pose=live.pose, twist=live.twist, push=tuple(pushes[-1]))
        for _ in range(10):
            live.step(np.zeros(3))
            envs.step(np.zeros((1, 3)))
            assert np.abs(live.twist - envs.twist[0]).max() < 1e-9
    assert len(np.unique(pushes, axis=0)) == 3
    assert (np.abs(pushes) <= [3.0, 3.0, 0.2]).all()
    assert np.abs(live.pose).max() > 0.02


def test_a_mean_twist_is_the_way_over_the_time():
    robot = AXEBOT.replace(sensors=Sensors(twist="mean"))
    _, actions, twists, _, observations = driven(robot, Setting("velocity", substeps=20))
    run = omnidyn.simulate(AXEBOT, np.repeat(actions[:, 0] * 6.0, 40, axis=0), 0.0005)
    middle = 0.5 * (run.twist[1:] + run.twist[:-1])
    assert np.abs(observations[1:, 0, :3] - middle.reshape(-1, 40, 3).mean(axis=1)).max() < 2e-4
    assert np.abs(twists[1:, 0] - observations[1:, 0, :3]).max() > 0.05


def test_a_low_pass_forgets_by_its_time_constant():
    robot = AXEBOT.replace(sensors=Sensors(twist_filter=0.05))
    filtered = driven(robot, Setting(substeps=4))[4][:, 0, :3]
    means = driven(AXEBOT.replace(sensors=Sensors(twist="mean")), Setting(substeps=4))[4][:, 0, :3]
    kept, expected = np.exp(-0.02 / 0.05), np.zeros(3)
    for seen, mean in zip(filtered, means, strict=True):
        expected = kept * expected + (1.0 - kept) * mean
        assert seen == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("rate, delay", [(None, 0.06), (10.0, 0.0), (12.5, 0.04)])
def test_poses_are_seen_late_and_seldom(rate, delay):
    robot = AXEBOT.replace(sensors=Sensors(pose_delay=delay, pose_rate=rate))
    envs, _, _, poses, observations = driven(robot, Setting("pose", spread=STILL))
    late, hold = envs.numbers.late, envs.numbers.hold
    for k in range(60):
        seen = poses[max(0, (k - late) // hold * hold), 0]
        cos, sin = np.cos(seen[2]), np.sin(seen[2])
        way = [-cos * seen[0] - sin * seen[1], sin * seen[0] - cos * seen[1], np.sin(-seen[2]), np.cos(seen[2])]
        assert observations[k, 0, 3:7] == pytest.approx(way, abs=1e-12)


def test_a_goal_that_is_reached_ends_the_episode():
    envs = Environments(AXEBOT, 2, Setting("pose", spread=STILL), autoreset="same_step")
    envs.reset(seed=1)
    assert envs.step(np.zeros((2, 3))).terminated.all()
    envs = Environments(AXEBOT, 2, Setting("pose", duration=0.06))
    envs.reset(seed=1)
    for k in range(3):
        step = envs.step(np.zeros((2, 3)))
        assert not step.terminated.any()
        assert (step.truncated == (k == 2)).all()


# Draws of robots


def test_ranges_are_drawn_for_life_for_episodes_and_for_intervals():
    ranges = {
        "body.mass_kg": Range(0.5, 2.0, when="startup"),
        "friction.axes.coulomb": Range(0.5, 1.5, when="reset"),
        "friction.axes.viscous[2]": Range(0.0, 0.02, "add", "interval"),
    }
    setting = Setting(duration=0.4, interval=0.1, randomise=ranges)
    envs = Environments(AXEBOT, 200, setting, dtype=np.float64, autoreset="same_step")
    envs.reset(seed=3)
    masses, frictions, rates = [], [], []
    for _ in range(40):
        envs.step(np.zeros((200, 3)))
        privileged = envs.privileged
        masses.append(1.0 / privileged[:, 18])
        frictions.append(privileged[:, 9] * masses[-1])
        rates.append(privileged[:, 17])
    masses, frictions, rates = np.array(masses), np.array(frictions), np.array(rates)
    assert np.ptp(masses, axis=0).max() < 1e-12
    assert masses.min() > 0.75
    assert masses.max() < 3.0
    assert np.ptp(masses[0]) > 1.5
    assert [len(np.unique(np.round(frictions[k : k + 19, 0], 9))) for k in (0, 20)] == [1, 1]
    assert len(np.unique(np.round(frictions[:, 0], 9))) == 3
    assert frictions.min() > 1.1
    assert frictions.max() < 3.3
    assert 6 <= len(np.unique(np.round(rates[:, 0], 9))) <= 9


def test_uncertainty_draws_from_std_and_correlation():
    robot = omnidyn.load_robot("axebot")
    keys = ("friction.axes.coulomb[0]", "friction.axes.viscous[0]")
    stds = dict(zip(keys, (0.2, 0.09), strict=True))
    correlation = {"keys": keys, "matrix": [[1.0, -0.9], [-0.9, 1.0]]}
    priors = {key: {"std": std, "source": "fit", "origin": "identified"} for key, std in stds.items()}
    robot = robot.replace(priors=priors, correlation=correlation)
    envs = Environments(robot, 1024, Setting(uncertainty="startup"), dtype=np.float64)
    members = envs.pool.robots
    drawn = np.array([(one.friction.axes.coulomb[0], one.friction.axes.viscous[0]) for one in members])
    assert np.log(drawn).std(axis=0) == pytest.approx([0.2 / 2.2, 0.09 / 0.94], rel=0.1)
    assert np.corrcoef(np.log(drawn).T)[0, 1] == pytest.approx(-0.9, abs=0.04)
    envs.reset(seed=1)
    assert np.allclose(np.sort(envs.privileged[:, 9] * 1.5), np.sort(drawn[:, 0]))


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: Setting("fly"), "unknown task"),
        (lambda: Setting(dt=-1.0), "out of range"),
        (lambda: Setting(push=(1.0, -1.0, 0.0)), "three sizes"),
        (lambda: Range(2.0, 1.0), "not a range"),
        (lambda: Range(0.0, 1.0, "times"), "kind of range"),
        (lambda: Environments(AXEBOT, 0), "out of range"),
        (lambda: Environments(AXEBOT, 2, Setting("path")), "no path"),
        (lambda: Environments(AXEBOT, 2).step(np.zeros((2, 3))), "not begun"),
        (lambda: Environments(AXEBOT, 2, dtype=int), "no such numbers"),
        (lambda: Environments(AXEBOT, 2, Setting(randomise={"body.mas_kg": Range(0.9, 1.1)})), "mass_kg"),
        (lambda: Environments(AXEBOT, 2, Setting(randomise={"body.mass_kg": Range(-2, -1)})), "range of body.mass_kg"),
        (
            lambda: Environments(AXEBOT, 2, Setting(randomise={"body.mass_kg": Range(1, 2, when="interval")})),
            "interval",
        ),
    ],
)
def test_what_cannot_be_is_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


# Robots of the implicit engine: a turning frame, friction along the direction of travel


def turning(friction=None):
    robot = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))
    return robot if friction is None else robot.replace(friction=Friction(direction=friction))


ELLIPSE = DirectionFriction(coulomb=(2.6, 1.9), viscous=0.9, yaw_coulomb=0.11, yaw_viscous=0.01)
IMPLICIT = {"box": turning(), "ellipse": turning(ELLIPSE), "mecanum": omnidyn.load_robot("mecanum")}


@pytest.mark.parametrize("name", IMPLICIT)
def test_implicit_steps_are_those_of_simulate(name):
    robot = IMPLICIT[name]
    _, actions, twists, _, _ = driven(robot, Setting(substeps=4))
    for k in range(3):
        volts = np.repeat(actions[:, k] * largest_voltage(robot), 4, axis=0)
        run = omnidyn.simulate(robot, volts, 0.005, tol=None)
        assert np.abs(twists[:, k] - run.twist[::4]).max() < 1e-11
        assert np.array_equal(twists[:, k] == 0.0, run.twist[::4] == 0.0)


@pytest.mark.parametrize("name", IMPLICIT)
def test_implicit_poses_are_near_those_of_a_fine_tolerance(name):
    robot = IMPLICIT[name]
    late = robot.replace(drive=robot.drive.replace(latency=0.026))
    _, actions, twists, poses, _ = driven(late, Setting("pose", substeps=20), steps=40)
    run = omnidyn.simulate(late, actions[:, 0] * largest_voltage(robot), 0.02, tol=1e-5)
    assert np.abs(twists[:, 0] - run.twist).max() < 3e-3 * max(1.0, np.abs(run.twist).max())
    assert np.abs(poses[:, 0] - run.pose).max() < 1e-3


def test_other_laws_are_refused_by_name():
    with pytest.raises(UnsupportedError, match="current limit"):
        Environments(AXEBOT.replace(motor=AXEBOT.motor.replace(current_limit=2.0)))
    speed = omnidyn.load_robot("robotino")
    with pytest.raises(InputError, match="they leave out the loop"):
        Environments(speed, parameters=batch_parameters([speed]))
    with pytest.raises(InputError, match="one kind of drive"):
        Environments([AXEBOT, turning()])
