"""Paths: where they lead, what they ask for, and what is refused. References: closed forms."""

import math

import numpy as np
import pytest

import omnidyn
from omnidyn.control.paths.polyline import lines, through
from omnidyn.errors import InputError
from omnidyn.run import Run

SMOOTH = [
    "eight",
    "eight:heading=along",
    "eight:size_m=0.25,period_s=12",
    "circle",
    "circle:heading=along",
    "circle:turn_rad_s=2",
    "goal:x_m=0.4,y_m=-0.3,heading_rad=1.0,travel_s=1.5",
]
EVERY = [*SMOOTH, "square", "square:turn_rad_s=1", "zigzag"]


@pytest.mark.parametrize("name", SMOOTH)
def test_velocity_and_acceleration_are_the_derivatives(name):
    path = omnidyn.path(name)
    t = np.linspace(0.01, path.duration - 0.01, 501)
    step = 1e-5
    before, now, after = path.at(t - step), path.at(t), path.at(t + step)
    np.testing.assert_allclose((after.pose - before.pose) / (2 * step), now.velocity, atol=1e-6)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * step), now.acceleration, atol=1e-5)
    turned, then = path.twist_at(t - step)[1], path.twist_at(t + step)[1]
    np.testing.assert_allclose((then - turned) / (2 * step), path.twist_at(t)[2], atol=1e-5)


@pytest.mark.parametrize("name", EVERY)
def test_poses_do_not_jump_and_any_shape_of_times_will_do(name):
    path = omnidyn.path(name)
    t = np.linspace(0.0, path.duration + 1.0, 20_001)
    motion = path.at(t)
    speed = np.abs(motion.velocity).max(axis=0) + 1e-9
    assert (np.abs(np.diff(motion.pose, axis=0)) <= 1.001 * speed * np.diff(t)[:, None] + 1e-12).all()
    one, many = path.at(1.25), path.at(np.full((2, 3), 1.25))
    assert one.pose.shape == (3,)
    for part, parts in zip(one, many, strict=True):
        np.testing.assert_array_equal(parts, np.broadcast_to(part, (2, 3, 3)))
    assert not path.at(-1.0).velocity.any()
    np.testing.assert_array_equal(path.at(-1.0).pose, path.at(0.0).pose)


def test_an_eight_by_hand():
    motion = omnidyn.path("eight", size_m=0.5, period_s=4.0).at([0.0, 0.5, 1.0])
    np.testing.assert_allclose(motion.pose[:, 0], [0.0, 0.5 * math.sqrt(0.5), 0.5], atol=1e-15)
    np.testing.assert_allclose(motion.pose[:, 1], [0.0, 0.25, 0.0], atol=1e-15)
    np.testing.assert_allclose(motion.velocity[0], [0.5 * math.pi / 2, 0.5 * math.pi / 2, 0.0], atol=1e-15)


def test_a_circle_along_is_a_constant_twist():
    """v = r w forward, w about yaw, and no change of either: the centre stays to the left."""
    path = omnidyn.path("circle:radius_m=0.5,speed_m_s=0.4,heading=along")
    pose, twist, change = path.twist_at(np.linspace(0.0, 40.0, 300))
    np.testing.assert_allclose(twist, np.tile([0.4, 0.0, 0.8], (300, 1)), atol=1e-13)
    np.testing.assert_allclose(change, 0.0, atol=1e-12)
    np.testing.assert_allclose(pose[:, 2], math.pi / 2 + 0.8 * np.linspace(0.0, 40.0, 300), atol=1e-12)


def test_a_square_turns_at_its_corners():
    motion = omnidyn.path("square:side_m=0.8,speed_m_s=0.5").at([0.8, 1.6, 3.2, 4.8, 6.4])
    np.testing.assert_allclose(motion.pose[:, :2], [[0.4, 0], [0.8, 0], [0.8, 0.8], [0, 0.8], [0, 0]], atol=1e-15)
    np.testing.assert_allclose(motion.velocity[:, :2], [[0.5, 0], [0, 0.5], [-0.5, 0], [0, -0.5], [0.5, 0]], atol=1e-15)


def test_rows_of_a_file_are_joined_by_straight_lines(tmp_path):
    file = tmp_path / "way.csv"
    file.write_text("t_s,x_m,y_m,heading_rad\n1,0,0,3.0\n2,1,0,-3.0\n4,1,2,-3.0\n")
    path = omnidyn.path(str(file))
    motion = path.at([-1.0, 0.5, 1.0, 2.0, 3.0, 9.0])
    wrapped = 2 * math.pi - 3.0
    np.testing.assert_allclose(
        motion.pose, [[0, 0, 3], [0.5, 0, math.pi], *[[1, y, wrapped] for y in (0, 1, 2, 2)]], atol=1e-15
    )
    np.testing.assert_allclose(motion.velocity[1], [1.0, 0.0, 2 * math.pi - 6.0], atol=1e-15)
    np.testing.assert_allclose(motion.velocity[2], [0.0, 1.0, 0.0], atol=1e-15)
    assert path.duration == path.end == 3.0
    assert not motion.velocity[[0, -1]].any()


def test_a_run_is_a_path():
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), [[0.0, 3.0, -3.0]] * 100, 0.02)
    np.testing.assert_array_equal(omnidyn.path(run).at(run.t).pose[:-1], run.pose[:-1])
    with pytest.raises(InputError, match="no poses to follow"):
        omnidyn.path(Run(t=[0.0, 1.0], twist=np.zeros((2, 3))))


@pytest.mark.parametrize(
    "name, words",
    [
        ("eigt", "unknown path; got eigt; .*did you mean eight"),
        ("eight:perod_s=3", "no such option; got perod_s; .*did you mean period_s"),
        ("eight:period_s", "not an option of a path; got period_s"),
        ("eight:period_s=nan", "out of range; got nan"),
        ("eight:period_s=0", "out of range; got 0.0; expected at least 1e-06"),
        ("eight:period_s=1e400", "out of range"),
        ("eight:period_s=soon", "not a number; got soon"),
        ("eight:heading=up", "unknown heading; got up; expected held or turning or along"),
        ("square:heading=along", "turns at once at its corners"),
        ("circle:speed_m_s=1,period_s=3", "say the same"),
        ("eight:heading=held,turn_rad_s=1", "held does not turn"),
        ("goal:travel_s=0,hold_s=0", "takes some time"),
        ("missing.csv", "missing.csv"),
    ],
)
def test_what_is_no_path_is_refused(name, words):
    with pytest.raises(InputError, match=words):
        omnidyn.path(name)


@pytest.mark.parametrize(
    "t, pose, words",
    [
        ([0.0], [[0, 0, 0]], "rows >= 2"),
        ([0.0, 1.0], [[0, 0], [1, 0]], "not a path"),
        ([0.0, 0.0], [[0, 0, 0], [1, 0, 0]], "time does not increase; got 0 after 0"),
        ([0.0, 1.0], [[0, 0, 0], [np.nan, 0, 0]], "not a finite number"),
    ],
)
def test_rows_that_are_no_path_are_refused(t, pose, words):
    with pytest.raises(InputError, match=words):
        lines(t, pose, "rows")


def test_a_file_without_poses_is_refused(tmp_path):
    (tmp_path / "speeds.csv").write_text("t_s,x_m,y_m\n0,0,0\n1,1,0\n")
    with pytest.raises(InputError, match=r"no path in this file; got t_s, x_m, y_m; .*add heading_rad"):
        omnidyn.path(tmp_path / "speeds.csv")


def test_a_drawn_path_goes_through_its_points_at_its_speed():
    corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 0.5], [0.0, 0.5]]  # one of them twice
    path = through(corners, 0.25, True, "drawn")
    assert path.duration == pytest.approx(3.0 / 0.25, rel=1e-12)
    motion = path.at(np.linspace(0.0, 11.9, 120))
    np.testing.assert_allclose(np.hypot(*motion.velocity[:, :2].T), 0.25, rtol=1e-12)
    np.testing.assert_allclose(
        path.at(np.array([2.0, 4.0, 8.0, 12.0])).pose[:, :2], [[0.5, 0], [1, 0], [0.5, 0.5], [0, 0]]
    )
    assert not motion.pose[:, 2].any()
    assert through(corners, 0.25, False, "drawn").duration == pytest.approx(2.5 / 0.25, rel=1e-12)


@pytest.mark.parametrize(
    ("points", "speed", "words"),
    [
        ([], 1.0, r"not a drawn path.*got 0 points.*expected points"),
        ([[0, 0], [1]], 1.0, "not a drawn path"),
        ([["a", 0], [1, 1]], 1.0, "not a drawn path"),
        ([[0, 0, 0], [1, 1, 1]], 1.0, "not a drawn path"),
        ([[0, 0], [math.nan, 1]], 1.0, "not a drawn path"),
        ([[0, 0], [1e300, 1]], 1.0, r"expected points \(x, y\) up to 10000 m"),
        ([[1, 1]], 1.0, r"not a drawn path.*two different points"),
        ([[1, 1], [1, 1]], 1.0, r"not a drawn path.*draw one"),
        ([[0, 0], [1, 1]], 0.0, r"out of range.*expected 0\.001 to 100 m/s"),
        ([[0, 0], [1, 1]], math.nan, "out of range"),
        ([[0, 0], [1, 1]], math.inf, "out of range"),
    ],
)
def test_what_is_no_drawn_path_is_refused(points, speed, words):
    with pytest.raises(InputError, match=words):
        through(points, speed, True, "drawn")
