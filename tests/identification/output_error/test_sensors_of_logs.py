"""What a fit writes of the sensors of its logs: of a gyroscope, the noise and bias that were added to a simulation."""

from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn.control.pose_estimator import BY_TURN, TURN_BY_TIME, estimator_numbers
from omnidyn.identification.output_error.sensors_of_logs import _gyroscope, _is_possible, _poses, has_gyroscope
from omnidyn.model.robot_file import parse_robot, robot_to_toml

AXEBOT = omnidyn.load_robot("axebot")
DT, NOISE, BIAS, TICK = 0.02, 5e-3, 8e-3, 2.0 * np.pi / 2048


def moved(volts):
    """(times, omega off by BIAS and NOISE, speeds of wheels) under volts."""
    run = omnidyn.simulate(AXEBOT, volts, DT)
    assert run.twist is not None
    assert run.wheel_speed is not None
    return run.t, run.twist[:, 2] + BIAS + NOISE * np.random.default_rng(1).standard_normal(len(run.t)), run.wheel_speed


def as_twist(omega):
    return np.column_stack([np.full((len(omega), 2), np.nan), omega])


def log_with_gyroscope(wheels: str, own_clock: bool = False) -> omnidyn.Run:
    """10 s by volts, counts or speeds of wheels and omega of a gyroscope."""
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-5.0, 5.0, (20, 3)), 25, axis=0)
    t, omega, speed = moved(volts)
    if own_clock:
        omega[::3] = np.nan
    log = omnidyn.Run(t=t, voltage=np.vstack([volts, volts[-1:]]), twist=as_twist(omega))
    if wheels == "counts":
        turned = np.cumsum(0.5 * (speed[1:] + speed[:-1]) * DT, axis=0)
        return replace(log, wheel_angle=np.floor(np.concatenate([np.zeros((1, 3)), turned]) / TICK) * TICK)
    return replace(log, wheel_speed=speed + 0.02 * rng.standard_normal(speed.shape))


@pytest.mark.parametrize(("wheels", "own_clock"), [("counts", False), ("counts", True), ("speeds", False)])
@pytest.mark.some(2)
def test_noise_and_bias_of_a_gyroscope_stand_in_the_table_of_the_log(wheels, own_clock):
    fitted = omnidyn.identify(log_with_gyroscope(wheels, own_clock=own_clock), AXEBOT, quick=True).robot
    assert fitted.log is not None
    assert fitted.log.gyro_noise == pytest.approx(NOISE, rel=0.25)  # what a bias leaves of it
    assert fitted.log.gyro_bias == pytest.approx(BIAS, rel=0.15)
    again = parse_robot(robot_to_toml(fitted))
    assert again.log == fitted.log
    sensors = again.sensor_model
    assert (sensors.gyro_noise, sensors.gyro_bias) == (fitted.log.gyro_noise, fitted.log.gyro_bias)
    assert sensors.has_gyroscope
    assert again.sensors is None


def test_controllers_expect_the_drift_of_that_gyroscope():
    """By time, by its bias, and not by how far the robot has turned, as wheels do."""
    fitted = omnidyn.identify(log_with_gyroscope("counts"), AXEBOT, quick=True).robot
    late = {"pose_delay": 0.06, "pose_rate": 30.0}
    told = fitted.replace(sensors=fitted.sensor_model.replace(**late))
    plain = fitted.replace(sensors=fitted.sensor_model.replace(**late, gyro_noise=None, gyro_bias=None))
    by_gyroscope, by_wheels = (estimator_numbers(robot, DT) for robot in (told, plain))
    assert by_gyroscope[BY_TURN] == 0.0 < by_wheels[BY_TURN]
    assert by_gyroscope[TURN_BY_TIME] - by_wheels[TURN_BY_TIME] == pytest.approx(BIAS + NOISE * np.sqrt(DT), rel=0.15)


def test_a_robot_that_only_spins_shows_no_bias():
    """A bias of it is a slightly other size of the robot."""
    volts = np.full((500, 3), 3.0)
    t, omega, speed = moved(volts)
    log = omnidyn.Run(t=t, twist=as_twist(omega), wheel_speed=speed)
    shown = _gyroscope([log], AXEBOT.wheels)
    assert shown["gyro_noise"] == pytest.approx(NOISE, rel=0.25)  # what a bias leaves of it
    assert "gyro_bias" not in shown


def test_a_twist_of_all_axes_is_no_gyroscope():
    run = log_with_gyroscope("counts")
    assert run.twist is not None
    whole = replace(run, twist=np.column_stack([np.full((len(run), 2), 0.1), run.twist[:, 2]]))
    assert has_gyroscope(run)
    assert not has_gyroscope(whole)


def a_gap(omega, rng):
    omega[200:320] = np.nan
    return omega


def spikes(omega, rng):
    omega[rng.random(len(omega)) < 0.01] = 30.0
    return omega


def late(omega, rng):
    return np.append(np.full(4, omega[0]), omega[:-4])


def held(omega, rng):
    return np.repeat(omega[::2], 2)[: len(omega)]


@pytest.mark.parametrize("change", [a_gap, spikes, late, held])
def test_gaps_spikes_lateness_and_held_samples_are_no_bias_and_no_less_noise(change):
    log = log_with_gyroscope("counts")
    assert log.twist is not None
    omega = change(log.twist[:, 2].copy(), np.random.default_rng(4))
    shown = _gyroscope([replace(log, twist=as_twist(omega))], AXEBOT.wheels)
    assert 0.8 * NOISE < shown["gyro_noise"] < 2.0 * NOISE  # with what the motion of this robot leaves of it
    assert shown["gyro_bias"] == pytest.approx(BIAS, rel=0.3)


def camera_log(is_staggered: bool):
    """10 s of noisy poses: in every third row of a logger beside speeds, or in rows of their own, 1 us behind those."""
    rng, count = np.random.default_rng(2), 1000
    poses = np.cumsum(0.002 * np.ones((count, 3)), axis=0) + 1e-3 * rng.standard_normal((count, 3))
    t, speeds = DT * np.arange(count), np.ones((count, 3))
    if not is_staggered:
        poses[np.arange(count) % 3 != 0] = np.nan
        return omnidyn.Run(t=t, voltage=speeds, wheel_speed=speeds, pose=poses)
    t, nothing = np.sort(np.append(t, t + 1e-6)), np.full((2 * count, 3), np.nan)
    both = {"wheel_speed": nothing.copy(), "pose": nothing.copy()}
    both["wheel_speed"][::2], both["pose"][1::2] = speeds, poses
    return omnidyn.Run(t=t, voltage=np.ones((2 * count, 3)), **both)


def test_poses_with_times_of_their_own_waited_for_no_row():
    """The row of a staggered log is the time from one sensor to the next: 1 us here, which no file holds."""
    assert _poses([camera_log(is_staggered=False)])["row"] == pytest.approx(DT)
    shown = _poses([camera_log(is_staggered=True)])
    assert "row" not in shown
    assert shown["pose_rate"] == pytest.approx(1.0 / DT)


def test_what_no_file_can_hold_is_left_out():
    assert _is_possible("pose_rate", 30.0)
    assert not _is_possible("pose_rate", 0.05)
    assert not _is_possible("row", 1e-6)
