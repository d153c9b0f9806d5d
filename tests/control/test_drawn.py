"""Paths drawn by hand, smoothed: against closed forms of a corner and of a straight line."""

import numpy as np
import pytest

import omnidyn
from omnidyn.control.demand import path_demand
from omnidyn.control.drawn import MOST_ROWS, Smooth, least_smoothing, smoothed
from omnidyn.control.paths.polyline import through

CORNER = through([(0, 0), (1, 0), (1, 1)], 0.5, False, "corner")  # [m], at 0.5 m/s
SQUARE = through([(0, 0), (1, 0), (1, 1), (0, 1)], 0.5, True, "square")


def largest_acceleration(path):
    """[m/s^2] of its rows."""
    velocity = np.gradient(path.pose[:, :2], path.t, axis=0)
    return np.hypot(*np.gradient(velocity, path.t, axis=0).T).max()


def test_ends_and_time_stay_and_a_line_is_itself():
    made = smoothed(CORNER, 0.4)
    np.testing.assert_allclose(made.pose[[0, -1], :2], [(0, 0), (1, 1)], atol=1e-12)
    assert made.duration == pytest.approx(CORNER.duration)
    line = smoothed(through([(0, 0), (2, 1)], 0.5, False, "line"), 0.8)
    np.testing.assert_allclose(line.pose[:, 0], 2.0 * line.pose[:, 1], atol=1e-12)


def test_a_corner_is_turned_with_the_acceleration_of_its_window():
    for width in (0.2, 0.4, 0.8):  # a jump of the speed over a Hann window: its peak is twice the mean
        expected = 2.0 * 0.5 * np.sqrt(2.0) / width
        assert largest_acceleration(smoothed(CORNER, width)) == pytest.approx(expected, rel=0.03)


def test_a_closed_path_is_smooth_where_it_began():
    made = smoothed(SQUARE, 0.4, closed=True)
    np.testing.assert_allclose(made.pose[0], made.pose[-1], atol=1e-12)
    away = np.hypot(*made.pose[0, :2])
    assert away == pytest.approx(np.hypot(*(smoothed(CORNER, 0.4).at(2.0).pose[:2] - [1.0, 0.0])), rel=0.02)


def test_a_robot_gets_the_least_window_with_which_it_can_follow():
    robot = omnidyn.load_robot("axebot")
    width = least_smoothing(robot, CORNER)
    assert 0.1 < width < 1.6

    def follows(seconds):
        made = smoothed(CORNER, seconds)
        return path_demand(robot, Smooth(made.name, made.t, made.pose)).follows

    assert follows(width)
    assert not follows(0.5 * width)
    assert least_smoothing(robot, through([(0, 0), (1, 0), (1, 1)], 0.05, False, "slow")) < width


def test_a_path_that_takes_long_has_few_rows_and_keeps_its_corners():
    """An hour; and months, of which nothing is smoothed: `track` refuses that in words."""
    hour = through([(0, 0), (18, 0), (18, 18)], 0.01, False, "slow")
    made = smoothed(hour, 0.8)
    assert len(made.t) <= MOST_ROWS + 1
    assert made.duration == pytest.approx(hour.duration)
    np.testing.assert_allclose(made.at(hour.t[1]).pose[:2], [18.0, 0.0], atol=1e-2)
    far = through([(0, 0), (1e4, 0), (1e4, 1e4)], 1e-3, False, "far")
    assert smoothed(far, 1.6) is far
