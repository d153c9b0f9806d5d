"""Where a free run starts: the first samples, robustly."""

import numpy as np
import pytest

from omnidyn.comparison.start import first_level, first_slope, scatter, start_of, theil_sen
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run

T = np.arange(200) * 0.01
ALL = slice(0, 200)


def test_a_line_through_outliers():
    """Median slope of 9 points on 3 t + 1, two of them spikes."""
    t = np.arange(9.0)
    values = 3.0 * t + 1.0
    values[[2, 7]] = 500.0, -900.0
    slope, level = theil_sen(t, values)
    assert slope == pytest.approx(3.0)
    assert level == pytest.approx(1.0)


@pytest.mark.parametrize("level, slope", [(0.5, 0.0), (0.5, 2.0), (-1.0, -5.0), (0.0, 3.0)])
def test_level_and_slope_without_noise(level, slope):
    assert first_level(T, level + slope * T) == pytest.approx(level, abs=1e-12)


def test_noise_spikes_and_holes_do_little():
    """0.3 m/s, rising by 1 m/s^2, noise 0.01, a spike of 5 and a hole: on average exact, no worse than one sample."""
    found = []
    for seed in range(300):
        values = 0.3 + T + 0.01 * np.random.default_rng(seed).normal(size=200)
        values[seed % 3], values[4] = 5.0, np.nan
        found.append(first_level(T, values, at_rest=True))
    assert np.abs(np.array(found) - 0.3).max() < 0.06
    assert np.mean(found) == pytest.approx(0.3, abs=0.003)
    assert np.std(found) < 0.015


def test_many_samples_make_it_surer():
    """At 1 kHz the 50 ms hold 51 samples: the error is well below that of one."""
    t = np.arange(1000) * 1e-3
    found = [first_level(t, 0.3 + t + 0.01 * np.random.default_rng(seed).normal(size=1000)) for seed in range(200)]
    assert np.std(found) < 0.005
    assert np.mean(found) == pytest.approx(0.3, abs=0.001)


def test_noise_is_told_from_motion():
    """Second differences of a slow sine with noise 0.02; spikes do not count."""
    values = np.sin(T) + 0.02 * np.random.default_rng(0).normal(size=200)
    values[::20] += 5.0
    assert scatter(T, values) == pytest.approx(0.02, rel=0.35)
    assert scatter(T, np.sin(T)) < 1e-4
    jittered = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.015, 200))
    assert scatter(jittered, 5.0 * jittered) < 1e-12  # a steady turn at irregular times is no noise
    assert scatter(T[:2], T[:2]) == 0.0


def test_rest_is_exactly_rest():
    """Zeros, or noise about 0: mostly exactly 0. A pose is never set to 0."""
    assert first_level(T, np.zeros(200), at_rest=True) == 0.0
    noise = [0.01 * np.random.default_rng(seed).normal(size=200) for seed in range(200)]
    at_rest = np.array([first_level(T, each, at_rest=True) for each in noise])
    assert np.mean(at_rest == 0.0) > 0.85
    assert np.abs(at_rest).max() < 0.04
    assert all(first_level(T, each) != 0.0 for each in noise)


@pytest.mark.parametrize("rows", [1, 2, 4])
def test_a_robot_that_sets_off_at_once_starts_at_rest(rows):
    """Some rows at rest, then full speed within a row of 30 ms; also with noise."""
    t = np.arange(50) * 0.03
    speed = np.where(np.arange(50) < rows, 0.0, 7.0)
    assert first_level(t, speed, at_rest=True) == 0.0
    assert abs(first_level(t, speed + 0.05 * np.random.default_rng(0).normal(size=50), at_rest=True)) < 0.15


def test_numbers_that_come_late_are_waited_for():
    """The first 20 rows hold nothing: the first number counts, and the ones after it."""
    values = np.where(np.arange(200) < 20, np.nan, 0.7)
    assert first_level(T, values, at_rest=True) == pytest.approx(0.7)
    assert first_level(T, np.full(200, np.nan)) == 0.0


def test_of_rows_far_apart_only_the_first_counts():
    """Half a second between rows: the next ones are another motion, and say nothing of noise."""
    t = np.arange(8) * 0.5
    assert first_level(t, np.array([0.02, 0.9, 0.1, -0.7, 0.5, 0.0, 0.3, 0.9]), at_rest=True) == 0.02
    start = start_of(Run(t=t, twist=np.outer(np.arange(8) ** 2, TWIST), pose=np.outer(t**3, TWIST)), ROBOT, slice(0, 8))
    assert not start.twist.any()
    assert not start.pose.any()


ROBOT = load_robot("axebot")
TWIST = np.array([0.3, -0.2, 1.5])


def moving(**channels):
    return Run(t=T, **channels)


def test_the_ground_comes_before_the_wheels_before_the_pose_before_rest():
    twist, wheels = np.tile(TWIST, (200, 1)), np.tile(wheel_speed(ROBOT.wheels, 0.5 * TWIST), (200, 1))
    heading = 0.4 + TWIST[2] * T
    world = np.array([np.cos(0.4) * 0.3 + np.sin(0.4) * 0.2, np.sin(0.4) * 0.3 - np.cos(0.4) * 0.2])
    pose = np.column_stack([1.0 + world[0] * T, 2.0 + world[1] * T, np.mod(heading, 2.0 * np.pi)])
    start = start_of(moving(twist=twist, wheel_speed=wheels, pose=pose), ROBOT, ALL)
    np.testing.assert_allclose(start.twist, TWIST, rtol=1e-12)
    np.testing.assert_allclose(start.pose, [1.0, 2.0, 0.4], rtol=1e-9)
    start = start_of(moving(wheel_speed=wheels), ROBOT, ALL)
    np.testing.assert_allclose(start.twist, 0.5 * TWIST, rtol=1e-12)
    assert start.source == "wheel_speed"
    np.testing.assert_array_equal(start.pose, np.zeros(3))
    start = start_of(moving(pose=pose, wheel_speed=np.full((200, 3), np.nan)), ROBOT, ALL)
    np.testing.assert_allclose(start.twist, TWIST, rtol=1e-9)
    assert start.source == "pose"
    start = start_of(moving(voltage=wheels), ROBOT, ALL)
    assert start.source == "rest"
    assert not start.twist.any()


def test_a_piece_starts_at_its_own_first_row():
    twist = np.outer(T, TWIST)
    start = start_of(moving(twist=twist), ROBOT, slice(100, 200))
    np.testing.assert_allclose(start.twist, TWIST, rtol=1e-9)


def test_the_slope_at_the_start_of_what_sets_off_is_0():
    """From rest under a held voltage: the line through the first samples has the speed of 25 ms later."""
    v = 0.8 * (1.0 - np.exp(-T / 0.15))
    path = 0.8 * (T - 0.15 * (1.0 - np.exp(-T / 0.15)))
    assert abs(first_slope(T, path)) < 0.02 < 0.5 * v[3]
    tick = 2e-4
    assert abs(first_slope(T, np.floor(path / tick) * tick)) < 0.02
    assert first_slope(T, 0.3 * T + path) == pytest.approx(0.3, abs=0.02)
    noise = np.random.default_rng(1).normal(size=(200, 200)) * 0.002
    found = [first_slope(T, each) for each in noise]
    assert np.mean(np.array(found) == 0.0) > 0.8
    spiked = 0.3 * T + 1e-4 * noise[0]
    spiked[2] = 5.0
    assert first_slope(T, spiked) == pytest.approx(0.3, abs=0.01)


def test_wheel_angles_tell_where_a_run_starts():
    """Both their level and, where no speed was logged, the twist."""
    twist = np.array([0.3, -0.1, 1.0])
    angle = wheel_speed(ROBOT.wheels, twist) * T[:, None] + [1.0, -2.0, 3.0]
    found = start_of(Run(t=T, wheel_angle=angle), ROBOT, ALL)
    np.testing.assert_allclose(found.twist, twist, atol=1e-9)
    np.testing.assert_allclose(found.angle, [1.0, -2.0, 3.0], atol=1e-9)
    assert found.source == "wheel_angle"
