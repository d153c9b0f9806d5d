"""track: its numbers by hand, its circumstances, and what it refuses."""

from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.control.closed_loop import NOISE
from omnidyn.control.controllers import ControllerFile
from omnidyn.errors import InputError
from omnidyn.model.robot_file import load_robot
from tests.support.friction_shapes import shaped
from tests.support.mixed_robots import random_robot

AXEBOT = load_robot("axebot")


def test_its_numbers_by_hand():
    found = omnidyn.track(AXEBOT, "eight:period_s=3.2", "pid", skip=1.0)
    run, path = found.run, omnidyn.path("eight:period_s=3.2")
    off = run.pose - path.at(run.t).pose
    late = off[run.t >= 1.0 - 1e-9]
    np.testing.assert_array_equal(found.error, off)
    np.testing.assert_allclose(found.distance, np.sqrt(off[:, 0] ** 2 + off[:, 1] ** 2), rtol=1e-12)
    assert found.rmse_position == pytest.approx(np.sqrt(np.mean(late[:, 0] ** 2 + late[:, 1] ** 2)), rel=1e-12)
    assert found.worst_position == pytest.approx(np.max(np.hypot(late[:, 0], late[:, 1])), rel=1e-12)
    assert found.rmse_heading == pytest.approx(np.sqrt(np.mean(late[:, 2] ** 2)), abs=1e-15)
    assert found.effort == pytest.approx(np.sqrt(np.mean(run.voltage[:-1] ** 2)), rel=1e-12)
    limit = np.abs(run.voltage[:-1]).max(axis=1) >= 6.0 * (1.0 - 1e-9)
    assert found.saturated_share == limit.mean() > 0.2
    assert len(found.step_times) == 320
    assert found.step_us["median"] <= found.step_us["p99"]


def test_it_starts_on_the_path_at_rest_and_is_what_simulate_says():
    path = omnidyn.path("circle", heading_rad=0.5)
    found = omnidyn.track(AXEBOT, path, "pid", duration=2.0)
    np.testing.assert_array_equal(found.run.pose[0], path.at(0.0).pose)
    assert not found.run.twist[0].any()
    again = omnidyn.simulate(AXEBOT, found.run.voltage[:-1], 0.02, pose=found.run.pose[0])
    np.testing.assert_allclose(again.pose, found.run.pose, atol=1e-12)
    np.testing.assert_allclose(again.twist, found.run.twist, atol=1e-12)


def test_friction_is_worth_more_than_half_the_error():
    with_it, without = (omnidyn.track(AXEBOT, "eight", name) for name in ("pid", "pid_no_friction"))
    assert with_it.rmse_position < 0.25 * without.rmse_position


def test_a_plant_that_is_not_the_robot():
    heavy = AXEBOT.replace(body=AXEBOT.body.replace(mass=2.0), name="heavy")
    found = omnidyn.track(AXEBOT, "eight", "pid", plant=heavy, duration=4.0)
    assert found.plant == "heavy"
    assert found.rmse_position > omnidyn.track(AXEBOT, "eight", "pid", duration=4.0).rmse_position


def test_one_seed_is_one_noise_and_the_noise_is_as_said():
    class Listener:
        name, robot, output, limit = "listener", AXEBOT, "voltage", np.full(3, 6.0)

        def __init__(self):
            from omnidyn.control.controller import Info

            self.info, self.heard = Info("ok"), []

        def reset(self):
            self.heard = []

        def step(self, t, pose, twist, path):
            self.heard.append([*pose, *twist])
            return np.zeros(3)

    listener = Listener()
    omnidyn.track(AXEBOT, "goal:x_m=0", listener, noise=0.01, duration=40.0, rng=3)
    heard = np.array(listener.heard)
    np.testing.assert_allclose(heard.std(axis=0), 0.01 * NOISE, rtol=0.06)
    omnidyn.track(AXEBOT, "goal:x_m=0", listener, noise=0.01, duration=40.0, rng=3)
    np.testing.assert_array_equal(np.array(listener.heard), heard)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.some(2)
def test_any_robot_is_driven(seed):
    robot = random_robot(seed)
    robot = robot.replace(friction=robot.friction.replace(axes=robot.friction.axes.replace(breakaway=None)))
    found = omnidyn.track(robot, "circle:radius_m=0.3,speed_m_s=0.2,turn_rad_s=0.5", "pid", duration=4.0)
    assert found.rmse_position < 5e-3
    assert not found.statuses


@pytest.mark.parametrize(
    "drive",
    [{"kind": "duty", "supply": 7.0}, {"kind": "speed", "kp": 0.3, "ki": 3.0, "rate": 200.0}, {"latency": 0.03}],
)
def test_any_drive_is_driven(drive):
    robot = AXEBOT.replace(drive=AXEBOT.drive.replace(**drive))
    found = omnidyn.track(robot, "circle:speed_m_s=0.3", "pid", duration=5.0)
    assert found.rmse_position < 0.02
    assert ("duty" in found.run.channels) == (drive.get("kind") == "duty")
    assert ("wheel_speed_command" in found.run.channels) == (drive.get("kind") == "speed")


def test_it_says_what_it_found():
    found = omnidyn.track(AXEBOT, "goal:travel_s=1,hold_s=1", "pid")
    words = str(found)
    assert words.startswith("The controller pid keeps axebot within ")
    assert "of the path goal:travel_s=1,hold_s=1" in words
    assert found.statuses == {"path ended: holding its last pose": 49}
    assert "warning" not in words
    assert set(found.to_dict()) >= {
        "name",
        "rmse_position_m",
        "rmse_heading_rad",
        "worst_position_m",
        "saturated_share",
        "step_us",
    }


def test_a_demand_by_hand():
    """A circle along at v: v/r about yaw; a square jumps by sqrt 2 v at its corners."""
    asked = omnidyn.path_demand(AXEBOT, "circle:radius_m=0.5,speed_m_s=0.4,heading=along")
    assert (asked.speed, asked.turn) == (pytest.approx(0.4), pytest.approx(0.8))
    assert asked.corners == 0
    assert asked.follows
    volts = omnidyn.voltage_for(AXEBOT, [0.4, 0.0, 0.8], [0.0, 0.0, 0.0])
    assert asked.voltage == pytest.approx(np.abs(volts).max(), rel=1e-9)
    corners = omnidyn.path_demand(AXEBOT, "square:speed_m_s=0.5,rounds=1")
    assert corners.corners == 3
    assert corners.jump == pytest.approx(0.5 * np.sqrt(2.0))
    assert "between its corners" in str(corners.verdict)
    fast = omnidyn.path_demand(AXEBOT, "eight:period_s=2")
    assert not fast.follows
    assert "cannot follow" in str(fast.verdict)
    warm = omnidyn.path_demand(shaped("disc", current_limit=0.5), "eight:period_s=4")
    assert not warm.follows
    assert "A of 0.5 A" in str(warm.verdict)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"dt": 0.0}, "dt: step out of range"),
        ({"delay": -1}, "delay"),
        ({"delay": 1.5}, "delay"),
        ({"noise": float("nan")}, "noise: out of range"),
        ({"duration": 0.001}, "cannot track for that long"),
        ({"duration": float("inf")}, "cannot track for that long"),
        ({"plant": random_robot(0)}, "made for another drive"),
        ({"controller": "mpcc"}, "unknown controller"),
    ],
)
def test_what_cannot_be_tracked_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        omnidyn.track(AXEBOT, "eight", **options)


def test_arguments_in_each_other_s_place_are_told():
    with pytest.raises(InputError, match="arguments swapped"):
        omnidyn.track("eight", AXEBOT)


@cache
def restlessness(name, delay=0):
    return omnidyn.track(AXEBOT, "circle:speed_m_s=0.4,heading=held", name, delay=delay, duration=6.0).restlessness


@pytest.mark.parametrize("delay", [1, 2, 4])
@pytest.mark.parametrize("name", ["pid", "speed"])
@pytest.mark.some(2)
def test_a_delay_that_is_known_does_not_make_it_swing(name, delay):
    assert restlessness(name, delay) < 1.5 * restlessness(name) + 0.02


@pytest.mark.parametrize("name", ["feedforward", "mpc"])
def test_who_knows_of_a_delay_is_in_motion_on_time(name):
    late = omnidyn.track(AXEBOT, "circle:speed_m_s=0.4", name, delay=3, duration=0.3, skip=0.0)
    ready = omnidyn.track(AXEBOT, "circle:speed_m_s=0.4", name, duration=0.3, skip=0.0)
    assert late.run.twist is not None
    assert ready.run.twist is not None
    assert not late.run.twist[0].any()
    assert np.allclose(late.run.twist[1], ready.run.twist[1], rtol=0.02, atol=1e-3)
    assert late.rmse_position == pytest.approx(ready.rmse_position, rel=0.05)


def test_a_controller_as_read_from_a_file_is_taken_and_what_is_none_is_said():
    settled = {"duration": 1.0}
    named = omnidyn.track(load_robot("axebot"), "eight", "mpc", **settled)
    read = omnidyn.track(load_robot("axebot"), "eight", ControllerFile("mpc"), **settled)
    assert read.rmse_position == named.rmse_position
    with pytest.raises(InputError, match=r"not a controller; got int; expected a Controller"):
        omnidyn.track(load_robot("axebot"), "eight", 3)


def test_how_far_it_is_is_told_of_each_controller():
    reports = []
    omnidyn.track(AXEBOT, "circle", ["pid", "feedforward"], duration=4.0, progress=reports.append)
    assert [report.phase for report in reports if report.done == 0] == [
        "tracking with pid",
        "tracking with feedforward",
    ]
    assert [report.done for report in reports[: len(reports) // 2]] == [0, 64, 128, 192]
    assert {report.total for report in reports} == {200}


def test_several_are_one_tracking_and_a_sequence_of_each():
    several = omnidyn.track(AXEBOT, "circle", ["feedforward", "pid"], duration=1.0, dt=0.01)
    alone = omnidyn.track(AXEBOT, "circle", "pid", duration=1.0, dt=0.01)
    assert [tracking.controller for tracking in several] == ["feedforward", "pid"]
    assert several.controller == several[0].controller == "feedforward"
    assert several.rmse_position == several[0].rmse_position
    assert several[1].rmse_position == several.best.rmse_position == alone.rmse_position
    assert list(alone) == [alone]
    assert not several[0].others
    assert "pid" in several.summary()


def test_an_option_that_the_loop_has_not_is_told_with_the_nearest():
    with pytest.raises(InputError, match=r"no such option; got durration.*did you mean duration"):
        omnidyn.track(AXEBOT, "circle", "pid", durration=1.0)
    with pytest.raises(InputError, match="no such option; got skip"):
        omnidyn.tune(AXEBOT, "circle", "pid", skip=1.0)
