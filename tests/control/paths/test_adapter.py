"""Paths of one's own: arrays, functions and plain objects are followed as the same path by name is, in every loop."""

import math
import shutil

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controllers import NAMES, controller_named
from omnidyn.control.paths.adapter import as_path
from omnidyn.control.paths.path import is_several
from omnidyn.errors import InputError

ROBOT = omnidyn.load_robot("axebot")
NAMED = omnidyn.path("circle:radius_m=0.4,speed_m_s=0.4,turn_rad_s=0.7,heading=turning")  # closed forms


def circle(t):
    """The same circle by hand."""
    return 0.4 * math.cos(t) - 0.4, 0.4 * math.sin(t), 0.7 * t


class Plain:
    """The documented members, and a plain tuple of lists."""

    end = math.inf

    def at(self, t):
        t = np.asarray(t)
        one, none = np.ones_like(t), np.zeros_like(t)
        pose = [0.4 * np.cos(t) - 0.4, 0.4 * np.sin(t), 0.7 * t]
        velocity = [-0.4 * np.sin(t), 0.4 * np.cos(t), 0.7 * one]
        acceleration = [-0.4 * np.cos(t), -0.4 * np.sin(t), none]
        return tuple(np.stack(part, axis=-1).tolist() for part in (pose, velocity, acceleration))


class OneByOne(Plain):
    """The same for one time only, as math has it."""

    def at(self, t):
        return (
            list(circle(t)),
            [-0.4 * math.sin(t), 0.4 * math.cos(t), 0.7],
            [-0.4 * math.cos(t), -0.4 * math.sin(t), 0.0],
        )


def wrapped(t):
    """The circle with a heading within half a turn of 0."""
    x, y, heading = circle(t)
    return x, y, math.remainder(heading, 2.0 * math.pi)


@pytest.mark.parametrize("what", [circle, wrapped, Plain(), OneByOne()], ids=["function", "wrapped", "plain", "one"])
def test_it_is_where_the_named_path_is(what):
    path, t = omnidyn.path(what), np.array([[0.0005, 0.3, 4.4883], [7.0, 2.0, 0.1]])
    found, expected = path.at(t), NAMED.at(t)
    assert found.pose.shape == (2, 3, 3)
    turns = (found.pose - expected.pose)[..., 2] / (2.0 * math.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    np.testing.assert_allclose(found.pose[..., :2], expected.pose[..., :2], atol=1e-12)
    np.testing.assert_allclose(found.velocity, expected.velocity, atol=1e-6)
    np.testing.assert_allclose(found.acceleration, expected.acceleration, atol=1e-3)
    np.testing.assert_allclose(path.at(2.0).velocity, NAMED.at(2.0).velocity, atol=1e-10)
    np.testing.assert_allclose(path.twist_at(2.0)[2], NAMED.twist_at(2.0)[2], atol=1e-8)


@pytest.mark.parametrize("name", NAMES)  # a policy has paths of its own: tests/control/test_policy.py
def test_every_controller_takes_them_as_they_are(name):
    """Step by step, without a call of `path` before: the outputs are those of the named path."""
    for own in (Plain(), OneByOne()):
        first, other = (controller_named(name, ROBOT) for _ in range(2))
        for k in range(8):
            pose, twist = [0.01, 0.02 * k, 0.0], [0.1, 0.2, 0.0]
            expected = first.step(0.02 * k, pose, twist, NAMED)
            np.testing.assert_allclose(other.step(0.02 * k, pose, twist, own), expected, rtol=1e-9, atol=1e-9)
            assert other.info.ok


def test_track_tune_and_the_demand_take_them():
    expected = omnidyn.track(ROBOT, NAMED, "pid", duration=1.5).rmse_position
    t = np.arange(0.0, 2.0, 1e-3)
    rows = np.column_stack([t, [circle(moment) for moment in t]])
    for what in (circle, Plain(), OneByOne()):
        assert omnidyn.track(ROBOT, what, "pid", duration=1.5).rmse_position == pytest.approx(expected, rel=1e-6)
        asked = omnidyn.path_demand(ROBOT, what)
        assert asked.speed == pytest.approx(0.4, rel=1e-5)
    for what in (rows, rows.tolist()):
        tracking = omnidyn.track(ROBOT, what, "pid", duration=1.5)
        assert tracking.rmse_position == pytest.approx(expected, rel=0.05)
        assert tracking.path == "array of 2000 rows"
    tuned = omnidyn.tune(ROBOT, [circle, Plain()], "pid", evaluations=2, duration=0.6)
    assert tuned.paths == ("function circle", "Plain")
    assert omnidyn.tune(ROBOT, rows, "pid", evaluations=2, duration=0.6).paths == ("array of 2000 rows",)
    assert not is_several(rows.tolist())
    assert not is_several([row for row in rows])
    assert is_several(["eight", rows, circle])


def test_a_function_that_ends_stands_still_there():
    def line(t):
        assert 0.0 <= t <= 2.0  # never asked beyond
        return t, 0.0, 0.0

    path = omnidyn.path(line, duration_s=2.0)
    assert (path.end, path.duration) == (2.0, 2.0)
    np.testing.assert_allclose(path.at([-1.0, 0.0, 1.9995, 2.0, 9.0]).velocity[:, 0], [0, 1, 1, 0, 0], atol=1e-9)
    np.testing.assert_array_equal(path.at([-1.0, 9.0]).pose[:, 0], [0.0, 2.0])
    assert math.isinf(omnidyn.path(circle).end)


class Wrong:
    end = 1.0

    def __init__(self, answer):
        self.answer = answer

    def at(self, t):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def test_errors_name_the_true_cause():
    with pytest.raises(InputError, match=r"not a path; got object; expected a name, .*a function.*rows of t_s, x_m"):
        omnidyn.path(object())
    with pytest.raises(InputError, match=r"got list of shape \(2, 3\)"):
        omnidyn.path([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match=r"function of a path gives no pose; got shape \(2,\) at t = 0 s"):
        omnidyn.path(lambda t: (t, 0.0))
    with pytest.raises(ZeroDivisionError):
        omnidyn.path(lambda t: (1.0 / t, 0.0, 0.0))
    with pytest.raises(InputError, match=r"a function has no such option; got speed; expected duration_s"):
        omnidyn.path(circle, speed=1.0)
    with pytest.raises(InputError, match=r"time does not increase"):
        omnidyn.path([[0.0, 0, 0, 0], [0.0, 1, 0, 0]])
    with pytest.raises(InputError, match=r"does not say where to be; got \(3,\), \(3,\); expected \(pose, vel"):
        omnidyn.track(ROBOT, Wrong((np.zeros(3), np.zeros(3))), "pid")
    with pytest.raises(InputError, match="not a path; got int"):
        as_path(3)
    with pytest.raises(InputError, match="arguments swapped"):
        omnidyn.track("eight", ROBOT)  # pyright: ignore[reportCallIssue, reportArgumentType]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "answer, words",
    [
        ((np.zeros(3),), "no output found: a path does not say where to be"),
        ((np.full(3, np.nan),) * 3, "no output found: a path holds a number that is not finite"),
        (RuntimeError("map lost"), "no output found: RuntimeError"),
    ],
    ids=["shape", "nan", "raises"],
)
def test_a_step_says_what_is_wrong_with_a_path_and_gives_zeros(name, answer, words):
    controller = controller_named(name, ROBOT)
    assert not controller.step(0.0, [0.0] * 3, [0.0] * 3, Wrong(answer)).any()
    assert controller.info.status == words
    assert not controller.step(0.1, [0.0] * 3, [0.0] * 3, 3).any()
    assert controller.info.status in ("no path", "no output found: not a path")
    assert controller.step(0.2, [0.0] * 3, [0.0] * 3, NAMED).any()


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
def test_the_c_of_a_controller_follows_a_function(tmp_path):
    """The rows that C wants (now, when it acts, a step later) come from `at`: its output is Python's."""
    from tests.export.ros.test_follower import built

    loop, path = built(tmp_path / "node", controller="pid").PathLoop(), omnidyn.path(circle)
    law = controller_named("pid", ROBOT)
    loop.course, loop.until = path, 1e9
    path_at = path.at
    loop.course = type("Course", (), {"at": lambda self, t: tuple(part.tolist() for part in path_at(t)[:2])})()
    for k in range(20):
        pose = (path_at(0.02 * k).pose + 0.01).tolist()
        loop.measured(0.02 * k, pose, [0.0, 0.3, 0.7])
        np.testing.assert_allclose(
            6.0 * np.array(loop.step(0.02 * k)), law.step(0.02 * k, pose, [0.0, 0.3, 0.7], path), atol=2e-3
        )


def test_several_controllers_side_by_side():
    found = omnidyn.track(ROBOT, NAMED, ["pid", "mpc", "pid"], duration=1.0)
    assert [tracking.controller for tracking in found] == ["pid", "mpc", "pid 2"]
    assert len(found) == 3
    assert found[0].rmse_position == found[2].rmse_position
    assert found.best is found[1]
    alone = omnidyn.track(ROBOT, NAMED, "mpc", duration=1.0)
    assert found[1].rmse_position == alone.rmse_position
    assert len(found.document().data["controllers"]) == 3
    assert "mpc" in found.summary()
    with pytest.raises(InputError, match="no controller; got an empty list"):
        omnidyn.track(ROBOT, NAMED, [])


def test_a_controller_file_is_loaded_and_drives(tmp_path):
    (tmp_path / "pid.toml").write_text('schema = 1\ncontroller = "pid"\nsource = "x"\n\n[options]\nfaster = 2.0\n')
    spec = omnidyn.load_controller(tmp_path / "pid.toml")
    made = spec.make(ROBOT, dt=0.02)
    same = controller_named("pid", ROBOT, dt=0.02, faster=2.0)
    np.testing.assert_array_equal(
        made.step(0.0, [0.0, 0.1, 0.0], [0.0] * 3, NAMED), same.step(0.0, [0.0, 0.1, 0.0], [0.0] * 3, NAMED)
    )
    by_path = omnidyn.track(ROBOT, NAMED, tmp_path / "pid.toml", duration=0.5)
    assert by_path.rmse_position == omnidyn.track(ROBOT, NAMED, spec, duration=0.5).rmse_position
