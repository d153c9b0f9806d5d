"""Controllers take speeds and poses for what the robot file says they are: means over a step, poses that are late."""

import math
from typing import Any

import numpy as np
import pytest

import omnidyn
from benchmarks.control_real import errors, told
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, robot_of
from omnidyn.control.controllers import controller_named
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.mpc.model import DECAY, LINEAR_SIZE, PHI, PSI, STEP, held_for, numbers
from omnidyn.control.pid import Pid
from omnidyn.control.pid_batch import PidBatch
from omnidyn.control.pose_estimator import pose_estimator
from omnidyn.export.code.c_controller import c_controller
from omnidyn.export.ros.node import ros2_node
from omnidyn.model.log_effects import Lateness, LogEffects, Sensors
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from omnidyn.simulation.live import LiveRobot
from tests.support.controlled import Averaged
from tests.support.mixed_robots import random_robot

AXEBOT = omnidyn.load_robot("axebot")
MEAN = Sensors(twist="mean")


@pytest.mark.parametrize("make", [Pid, Mpc, lambda robot: Mpc(robot, observer=False)], ids=["pid", "mpc", "alone"])
@pytest.mark.some(2)
def test_encoder_differences_cost_little(make):
    instant = omnidyn.track(AXEBOT, "eight:period_s=5", make(AXEBOT), duration=6.0)
    averaged: Any = Averaged(make(AXEBOT.replace(sensors=MEAN)))
    mean = omnidyn.track(AXEBOT, "eight:period_s=5", averaged, duration=6.0)
    assert mean.rmse_position <= 1.1 * instant.rmse_position


@pytest.mark.parametrize("kind, limit", [("camera", 1.5), ("jitter", 0.7)])
@pytest.mark.parametrize("make", [Pid, Mpc])
def test_an_independent_plant_is_driven_with_real_sensors(make, kind, limit):
    """A camera of 40 ms, or a clock that is up to 2 ms off, on a plant that shares no code with ours [mm]."""
    plant = Plant(NUMBERS["axebot"])
    control = make(told(robot_of("axebot", NUMBERS["axebot"]), kind))
    assert errors(plant, control, paths()["clover"], kind)[0] < limit


def test_a_pose_that_is_late_is_moved_by_what_was_counted_since():
    """On a circle at a constant twist: the pose now, in closed form, from one 0.07 s old."""
    speed, omega, age, dt = 0.5, 1.2, 0.07, 0.02

    def place(t):
        angle = 0.3 + omega * t
        radius = speed / omega
        return np.array(
            [radius * (math.sin(angle) - math.sin(0.3)), -radius * (math.cos(angle) - math.cos(0.3)), angle]
        )

    bridge = estimator(Sensors(twist="mean", pose_delay=age))
    twist, found = np.array([speed, 0.0, omega]), np.zeros(3)
    for k in range(20):
        found = believed(bridge, k * dt, place(k * dt - age), twist)
    np.testing.assert_allclose(found, place(19 * dt), atol=5e-5)
    frozen = place(19 * dt - age)
    for k in range(20, 24):  # what comes again as it was only grows older
        found = believed(bridge, k * dt, frozen, twist)
    np.testing.assert_allclose(found, place(23 * dt), atol=5e-5)


def estimator(sensors):
    """That of the axebot with these sensors."""
    made = pose_estimator(AXEBOT.replace(sensors=sensors), 0.02)
    assert made is not None
    return made


def believed(bridge, t, pose, twist):
    """The pose that an estimator makes of a measured one."""
    state = np.array([*pose, *twist], dtype=float)
    bridge.estimate(t, state)
    return state[:3]


@pytest.mark.parametrize("noise", [1e-3, 4e-3])
@pytest.mark.parametrize("off", [0.0, 0.01])
def test_noise_of_poses_is_averaged_and_wheels_of_another_size_are_followed(noise, off):
    """Straight on at 0.4 m/s, twists `off` too large: the gain g that makes u/g and s sqrt(g/2) least together."""
    dt, speed, random = 0.02, 0.4, np.random.default_rng(1)
    bridge = estimator(Sensors(twist="mean", pose_delay=0.06, pose_noise=noise, heading_noise=2.0 * noise))
    errors = []
    for k in range(2000):
        t = k * dt
        pose = [speed * max(t - 0.06, 0.0), 0.0, 0.0] + noise * np.array([1.0, 1.0, 2.0]) * random.standard_normal(3)
        found = believed(bridge, t, pose, [(1.0 + off) * speed if k else 0.0, 0.0, 0.0])
        errors.append(found - [speed * t, 0.0, 0.0])
    rms = np.sqrt(np.mean(np.square(errors[200:]), axis=0))
    gain = (2.0 * (3e-3 * speed + 1e-4) * dt / noise) ** (2.0 / 3.0)
    assert rms[1] < 1.3 * noise * math.sqrt(gain / 2.0)
    assert rms[2] < noise
    late = off * speed * 0.06  # what wheels of another size count while a pose is on its way
    assert rms[0] < 1.3 * math.hypot(off * speed * dt / gain + late, noise * math.sqrt(gain / 2.0))


def test_a_robot_that_was_carried_away_is_believed_where_it_is():
    bridge = estimator(Sensors(twist="mean", pose_delay=0.04))
    for k in range(50):
        believed(bridge, 0.02 * k, [1e-4 * (k % 2), 0.0, 0.0], np.zeros(3))
    np.testing.assert_array_equal(believed(bridge, 1.0, [0.5, 0.1, 3.0], np.zeros(3)), [0.5, 0.1, 3.0])


@pytest.mark.parametrize("make", [Pid, Mpc])
@pytest.mark.parametrize("kind", ["encoder", "camera"])
def test_a_fit_of_late_poses_drives_on_encoders_and_on_a_camera(make, kind):
    """[log.latency] says how late poses of the log were; nobody says what feeds the loop: 18 mm and more, it was."""
    plant, along, fit = Plant(NUMBERS["axebot"]), paths()["clover"], robot_of("axebot", NUMBERS["axebot"])
    known = errors(plant, make(told(fit, kind)), along, kind)
    age = 0.04 + 0.5 / 60.0  # of the camera, and the mean time that a frame waits for a step
    late = Lateness(position=age, heading=age, wheel_angle=0.0)
    fitted = errors(plant, make(fit.replace(log=LogEffects(latency=late))), along, kind)
    for own, true, least in zip(fitted[:2], known, (0.05, 0.2), strict=False):
        assert own < 1.2 * true + least


@pytest.mark.parametrize("kind", ["pid", "mpc"])
def test_many_robots_with_late_poses_are_one_each(kind):
    robot = AXEBOT.replace(sensors=Sensors(twist="mean", pose_delay=0.05, pose_rate=30.0, encoder_counts=2048))
    follow, random = omnidyn.path("eight"), np.random.default_rng(0)
    one: Any = Pid(robot) if kind == "pid" else Mpc(robot)
    many: Any = PidBatch(one, 2) if kind == "pid" else Mpc(robot).batch(2)
    for k in range(60):
        t = 0.02 * k
        pose = follow.at(math.floor((t - 0.05) * 30.0) / 30.0).pose + 1e-3 * random.standard_normal(3)
        twist = follow.twist_at(t)[1]
        sent = one.step(t, pose, twist, follow)
        both = many.step_batch(t, np.stack([np.zeros(3), pose]), np.stack([np.zeros(3), twist]), follow)
        np.testing.assert_allclose(both[1], sent, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.55, 0.9, 1.3, 1.49, 2.4])
def test_a_step_of_another_length_is_that_of_its_own_numbers(seed, share):
    """Against the matrix exponential of that length."""
    robot, dt = random_robot(seed), 0.02
    changed = np.zeros((1, LINEAR_SIZE))
    held_for(numbers(robot, dt).linear, share * dt, changed)
    wanted = numbers(robot, share * dt).linear
    for column in (DECAY, PHI, PSI):
        np.testing.assert_allclose(
            changed[0, column : column + 9], wanted[0, column : column + 9], rtol=1e-9, atol=1e-15
        )
    assert changed[0, STEP] == share * dt


def test_what_a_fit_found_of_its_logs_is_what_controllers_take():
    late = Lateness(averaged=True, position=0.05)
    fitted = AXEBOT.replace(log=LogEffects(latency=late))
    assert fitted.sensor_model == Sensors(twist="mean", pose_delay=0.05)
    assert fitted.replace(sensors=Sensors()).sensor_model == Sensors()
    noisy = fitted.replace(log=LogEffects(latency=late, pose_rate=30.0, pose_noise=1e-3, heading_noise=2e-3))
    expected = Sensors(twist="mean", pose_delay=0.05, pose_rate=30.0, pose_noise=1e-3, heading_noise=2e-3)
    assert noisy.sensor_model == expected
    # Rows of 20 ms, a pose every 33 ms: of the 50 ms each pose waited 10 ms for its row in the mean.
    rows = noisy.replace(log=noisy.log.replace(row=0.02))
    assert rows.sensor_model.pose_delay == pytest.approx(0.04)
    assert rows.sensor_model.pose_age(0.02) == pytest.approx(0.05)
    counts = noisy.replace(log=noisy.log.replace(encoder_counts=512.0))
    assert counts.sensor_model == expected.replace(encoder_counts=512.0)
    assert AXEBOT.sensor_model == Sensors()


def test_speeds_of_a_log_of_counts_are_means():
    counted = AXEBOT.replace(log=LogEffects(latency=Lateness(wheel_angle=0.01)))
    assert counted.sensor_model == Sensors(twist="mean")


def test_the_lag_of_poses_in_a_log_is_told_where_a_controller_takes_it():
    fitted = AXEBOT.replace(log=LogEffects(latency=Lateness(averaged=True, position=0.05)))
    found = omnidyn.track(fitted, "circle", "pid", duration=1.0)
    assert [warning.code for warning in found.run.warnings] == ["pose_lag_of_log"]
    assert 'write twist = "mean" and pose_delay_s = 0 under [sensors]' in " ".join(found.summary().split())
    assert "0.05 s old" in " ".join(c_controller(fitted).notes)
    assert "0.05 s old" in " ".join(ros2_node(fitted, controller="pid").notes)
    told_by_file = fitted.replace(sensors=Sensors(twist="mean"))
    for quiet in (
        omnidyn.track(told_by_file, "circle", "pid", duration=1.0),
        omnidyn.track(fitted, "circle", "pid", duration=1.0, sensors="encoder"),
    ):
        assert not quiet.run.warnings


def test_a_fit_to_counts_of_wheels_gives_means_and_says_what_controllers_take_of_its_camera():
    """From a log of counts and a late camera to a loop on encoders, as its user would go."""
    robot, dt, late = AXEBOT, 0.02, 3
    rng, n = np.random.default_rng(0), 500
    volts = np.repeat(rng.uniform(-5.0, 5.0, (n // 25, 3)), 25, axis=0)
    run = omnidyn.simulate(robot, volts, dt)
    tick = 2.0 * np.pi / 4096
    angle = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1]) * dt, axis=0)]
    )
    pose = run.pose[np.maximum(np.arange(len(run.t)) - late, 0)] + 5e-4 * rng.standard_normal(run.pose.shape)
    log = omnidyn.Run(t=run.t, voltage=run.voltage, wheel_angle=np.round(angle / tick) * tick, pose=pose)
    found = omnidyn.identify(log, robot)
    fitted = found.estimate.robot
    assert fitted.sensor_model.twist == "mean"
    assert fitted.sensor_model.pose_age(dt) == pytest.approx(late * dt, abs=1e-3)  # with what it waits for a step
    assert fitted.sensor_model.pose_rate == pytest.approx(1.0 / dt, rel=1e-6)
    assert fitted.sensor_model.pose_noise == pytest.approx(5e-4, rel=0.15)
    assert fitted.sensor_model.heading_noise == pytest.approx(5e-4, rel=0.2)
    assert fitted.sensors is None  # of the log: what feeds the loop says the file
    assert "pose_lag_of_log" in [step.code for step in found.advice]


def test_the_table_of_a_file_is_read_and_written():
    robot = AXEBOT.replace(sensors=Sensors(twist="mean", pose_delay=0.04, pose_rate=60.0))
    text = robot_to_toml(robot)
    assert "[sensors]" in text
    assert "pose_rate_Hz = 60" in text
    assert parse_robot(text).sensors == robot.sensors
    assert "sensors" not in robot_to_toml(AXEBOT)


@pytest.mark.parametrize("name", ["axebot", "mecanum"])
def test_weights_follow_what_a_volt_does(name):
    """A robot of four times the mass and inertia is as quick with four times the volts, at a weight 16 times less."""
    robot = omnidyn.load_robot(name)
    body = robot.body.replace(mass=4.0 * robot.body.mass, inertia=4.0 * robot.body.inertia)
    heavy = robot.replace(body=body)
    light_weight, heavy_weight = (float(Mpc(each)._tables.weight[0]) for each in (robot, heavy))
    assert heavy_weight == pytest.approx(light_weight / 16.0, rel=1e-6)
    assert float(Mpc(AXEBOT)._tables.weight[0]) == 2e-3


@pytest.mark.parametrize("name", ["pid", "mpc", "speed", "feedforward"])
def test_two_missing_samples_are_bridged_and_no_more(name):
    follow, control = omnidyn.path("eight"), controller_named(name, AXEBOT)
    live = LiveRobot(AXEBOT, 0.02, pose=follow.at(0.0).pose)
    words, sent = [], []
    for k in range(60):
        lost = 40 <= k < 43 or k == 50
        pose = np.full(3, np.nan) if lost else np.array(live.pose)
        sent.append(control.step(0.02 * k, pose, np.array(live.twist), follow))
        words.append(control.info.status)
        live.step(sent[-1])
    assert words[40:44] == ["pose missing: bridged"] * 2 + ["pose missing", "ok"]
    assert words[50:52] == ["pose missing: bridged", "ok"]
    assert sent[41].any()
    assert not sent[42].any()
    if name != "mpc":
        assert np.array_equal(sent[40], sent[39])


@pytest.mark.parametrize("make", [Pid, Mpc])
def test_a_fifth_of_all_samples_may_be_missing(make):
    """The error of a loop that loses each sample with a chance of one in five [m]."""
    follow, random, off = omnidyn.path("eight"), np.random.default_rng(5), []
    control, live = make(AXEBOT), LiveRobot(AXEBOT, 0.02, pose=follow.at(0.0).pose)
    for k in range(250):
        pose = np.full(3, np.nan) if random.random() < 0.2 else np.array(live.pose)
        live.step(control.step(0.02 * k, pose, np.array(live.twist), follow))
        off.append(np.hypot(*(np.array(live.pose) - follow.at(0.02 * (k + 1)).pose)[:2]))
    assert np.sqrt(np.mean(np.square(off[25:]))) < 4e-3
