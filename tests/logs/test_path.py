"""Where a log went: circles and squares that one can check by hand."""

import numpy as np
import pytest

from omnidyn.logs.path import POSE, TWIST, WHEELS, body_twist, driven, path_of
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run

ROBOT = load_robot("axebot")
T = np.linspace(0.0, 2.0 * np.pi, 4001)
CIRCLE = np.tile([1.0, 0.0, 1.0], (len(T), 1))  # forward and turning left: a circle of 1 m around (0, 1)


@pytest.mark.parametrize("origin", [TWIST, WHEELS])
def test_a_circle_closes(origin):
    if origin == TWIST:
        run = Run(t=T, twist=CIRCLE)
    else:
        run = Run(t=T, wheel_speed=wheel_speed(ROBOT.wheels, CIRCLE))
    path = path_of(run, ROBOT)
    assert path.origin == origin
    np.testing.assert_allclose(path.position[-1], [0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(path.position - [0.0, 1.0], axis=1), 1.0, atol=1e-6)
    assert path.length.sum() == pytest.approx(2.0 * np.pi)
    np.testing.assert_allclose(path.direction, 0.0, atol=1e-12)


def test_of_positions_the_direction_is_that_of_the_body():
    """A crab: it drives along the x of the world with its heading to the left, so to its own right."""
    pose = np.stack([np.linspace(0.0, 2.0, 11), np.zeros(11), np.full(11, np.pi / 2.0)], axis=1)
    path = path_of(Run(t=np.arange(11.0), pose=pose))
    assert path.origin == POSE
    np.testing.assert_allclose(path.direction, -np.pi / 2.0, atol=1e-12)
    assert path.length.sum() == pytest.approx(2.0)


def test_nothing_is_driven_across_a_gap():
    kept = np.r_[0:1000, 3000:4001]
    path = path_of(Run(t=T[kept], twist=CIRCLE[kept]))
    assert path.length.sum() == pytest.approx(np.pi, rel=1e-2)
    pose = np.stack([T, 0.0 * T, 0.0 * T], axis=1)[kept]
    assert path_of(Run(t=T[kept], pose=pose)).length.sum() == pytest.approx(np.pi, rel=1e-2)


def test_holes_in_positions_are_bridged():
    pose = np.stack([T, 0.0 * T, 0.0 * T], axis=1)
    pose[5:15] = np.nan
    path = path_of(Run(t=T, pose=pose))
    assert path.length.sum() == pytest.approx(2.0 * np.pi)


def test_without_speeds_or_positions_there_is_none():
    assert path_of(Run(t=T, voltage=np.zeros((len(T), 3)))) is None
    assert path_of(Run(t=T, wheel_speed=np.zeros((len(T), 3)))) is None
    assert body_twist(Run(t=T, supply=T), ROBOT) is None


def test_what_was_driven_is_the_middle_of_the_speeds():
    twist = np.zeros((1001, 3))
    twist[:, 0] = np.linspace(-1.0, 1.0, 1001)
    along = driven([twist, None])
    assert along[0] == pytest.approx((-0.9, 0.9), abs=5e-3)
    assert along[1:] == [None, None]


def test_topics_with_clocks_of_their_own_leave_no_holes():
    """The twist of the circle beside another sensor 3 ms later: the way is as long, and the circle closes."""
    t = np.unique(np.concatenate([T, T + 0.0007]))
    mine, others = np.isin(t, T), np.isin(t, T + 0.0007)
    twist = np.where(mine[:, None], [1.0, 0.0, 1.0], np.nan)
    run = Run(t=t, twist=twist, current=np.where(others[:, None], 1.0, np.nan))
    path = path_of(run)
    assert path.length.sum() == pytest.approx(2.0 * np.pi, rel=1e-3)
    np.testing.assert_allclose(path.position[np.flatnonzero(mine)[-1]], [0.0, 0.0], atol=1e-3)
