"""Sensors that a loop simulates show what a real robot measures, and what they show costs controllers little."""

import math
from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.control.filtered_twist import FilteredTwist
from omnidyn.control.instruments import Instruments, instruments
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid
from omnidyn.control.readings import Readings
from omnidyn.control.speed_loop import SpeedLoop
from omnidyn.errors import InputError
from omnidyn.model.log_effects import Sensors
from omnidyn.simulation.live import LiveRobot

AXEBOT = omnidyn.load_robot("axebot")
DT = 0.02
VOLTS = np.array([1.0, 4.0, -3.0])
QUIET = np.zeros(6)
TURNING = "eight:period_s=5,heading=turning,turn_rad_s=0.6"


def seen_on_the_way(spec, steps=60, robot=AXEBOT):
    """(times, poses, twists) that sensors show of a robot under steady volts, from its start at rest."""
    live = LiveRobot(robot, DT)
    readings, rows = Readings(instruments(spec, robot), live, 0.0, QUIET), []
    for _ in range(steps):
        rows.append(readings.seen(QUIET, False))
        live.step(VOLTS)
        readings.passed(DT)
    poses, twists = (np.array(column) for column in zip(*rows, strict=True))
    return DT * np.arange(steps), poses, twists


def finely(steps=60, parts=200):
    """(twists, poses) under the same volts, each step cut in parts: times that are no steps are among its own."""
    run = omnidyn.simulate(AXEBOT, np.tile(VOLTS, (steps * parts, 1)), DT / parts)
    assert run.twist is not None
    assert run.pose is not None
    return run.twist, run.pose


@pytest.mark.parametrize(
    "text",
    [
        "instantaneous",
        "encoder",
        "encoder:2048",
        "encoder:2048,pose",
        "encoder:1024,filter:30ms,pose:60Hz,40ms,dropouts:5%,jitter:2ms,missed:1%",
        "instantaneous,pose:40ms",
        "encoder:512,gyro:5mrad/s,bias:4mrad/s,pose:30Hz,60ms,1mm,2mrad",
    ],
)
def test_a_text_is_read_and_said_again(text):
    kit = instruments(text, AXEBOT)
    assert str(kit) == text
    assert instruments(str(kit), AXEBOT) == kit


def test_what_a_text_says_and_what_a_file_says():
    assert instruments("encoder:2048, pose:60Hz,0.04s, missed:2%", AXEBOT) == Instruments(
        Sensors(twist="mean", pose_delay=0.04, pose_rate=60.0, encoder_counts=2048.0), missed=0.02
    )
    assert instruments("encoder:2048", AXEBOT).odometry
    sensors = Sensors(twist="mean", twist_filter=0.03, pose_delay=0.04)
    assert instruments(None, AXEBOT.replace(sensors=sensors)) == Instruments(sensors)


@pytest.mark.parametrize(
    "text, words",
    [
        ("encodr:2048", "did you mean encoder"),
        ("2048", "expected encoder:2048, pose:60Hz,40ms"),
        ("encoder:2048ms", "a number behind encoder"),
        ("encoder:0.5", "out of range"),
        ("pose:60", "a number of Hz or a number of s or .* behind pose"),
        ("pose:2s", r"out of range; got pose:2s; expected 0 to 1"),
        ("jitter", "a value behind it, such as jitter:5ms"),
        ("dropouts:99%", "out of range"),
        ("encoder,encoder", "each part once"),
        ("instantaneous,encoder", "not both"),
        ("jitter:15ms", "at most 0.01 s, half of dt"),
        (7, "got int"),
    ],
)
def test_a_text_that_says_no_sensors_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        omnidyn.track(AXEBOT, "eight", sensors=text, duration=0.1)


def test_an_encoder_counts_what_the_wheels_turn():
    """Against a run of 0.1 ms a step: means of the twist to 1e-5, counts to one count of each wheel."""
    fine_twist, fine_pose = finely()
    means = 0.5 * (fine_twist[:-1] + fine_twist[1:]).reshape(60, 200, 3).mean(axis=1)
    _, poses, exact = seen_on_the_way("encoder")
    np.testing.assert_allclose(exact[1:], means[:-1], atol=1e-5)
    np.testing.assert_allclose(poses[-1], fine_pose[59 * 200], atol=5e-5)
    _, _, counted = seen_on_the_way("encoder:2048")
    count = 2.0 * math.pi / 2048 * AXEBOT.wheels.radii[0] / DT  # [m/s] at the rim
    rims = (counted - exact) @ AXEBOT.wheels.wrench_matrix
    assert 0.3 * count < np.abs(rims).max() <= count * (1.0 + 1e-9)


def test_a_camera_shows_where_the_robot_was():
    """At 60 Hz and 40 ms late: the pose of the last frame that has arrived."""
    fine_pose = finely(parts=120)[1]
    t, poses, _ = seen_on_the_way("pose:60Hz,40ms")
    frame = np.floor((t - 0.04) * 60.0 + 1e-9) / 60.0
    rows = np.maximum(np.round(frame / (DT / 120)).astype(int), 0)
    np.testing.assert_allclose(poses, fine_pose[rows], atol=2e-5)


@pytest.mark.parametrize("constant", [0.01, 0.05])
def test_a_filter_forgets_as_one_of_first_order_does(constant):
    """Against its differential equation, in steps of 0.1 ms; what a controller makes of it is the mean of a step."""
    (fine_twist, _), shown = finely(), [np.zeros(3)]
    kept = math.exp(-DT / 200 / constant)
    for twist in 0.5 * (fine_twist[1:] + fine_twist[:-1]):
        shown.append(twist + kept * (shown[-1] - twist))
    t, _, twists = seen_on_the_way(f"filter:{1e3 * constant}ms")
    np.testing.assert_allclose(twists, np.array(shown)[: 200 * 60 : 200], atol=3e-3)
    taken_back = FilteredTwist(constant)
    at_steps = zip(t.tolist(), np.array(shown)[::200], strict=False)
    means = np.array([taken_back.mean(time, twist) for time, twist in at_steps])
    weights = np.exp(-(DT - (np.arange(200) + 0.5) * DT / 200) / constant)
    middle = 0.5 * (fine_twist[1:] + fine_twist[:-1]).reshape(60, 200, 3)
    expected = np.einsum("kic,i->kc", middle, weights / weights.sum())
    np.testing.assert_allclose(means[1:], expected[:-1], atol=1e-9)


def test_a_filter_that_is_short_beside_a_step_is_left_out():
    sensors = Sensors(twist_filter=0.005)
    assert Pid(AXEBOT.replace(sensors=sensors)).sensors == Sensors()
    assert Pid(AXEBOT.replace(sensors=sensors), dt=0.01).sensors == sensors


@pytest.mark.parametrize("make, limit", [(Pid, 1.1), (Mpc, 2.5)])
def test_filtered_speeds_cost_little_where_the_file_says_so(make, limit):
    """A filter of 60 ms; without the word of it an mpc is 80 mm off [times]."""
    kit = instruments("filter:60ms", AXEBOT)
    instant = omnidyn.track(AXEBOT, TURNING, make(AXEBOT), duration=4.0)
    filtered = omnidyn.track(AXEBOT, TURNING, make(AXEBOT.replace(sensors=kit.sensors)), sensors=kit, duration=4.0)
    assert filtered.rmse_position < limit * instant.rmse_position
    assert filtered.sensors == "instantaneous,filter:60ms"


@pytest.mark.parametrize("name", ["pid", "mpc"])
@pytest.mark.parametrize("spec, limit", [("encoder:2048", 1.0), ("encoder:2048,pose:60Hz,40ms,dropouts:10%", 3.0)])
def test_a_robot_is_driven_by_what_it_measures(name, spec, limit):
    """Error against the true pose, its start from rest included; odometry of 2048 counts is 0.4 mm off itself [mm]."""
    found = omnidyn.track(AXEBOT, TURNING, name, sensors=spec, duration=4.0)
    assert 1e3 * found.rmse_position < limit
    assert ("pose missing: bridged" in found.statuses) == ("dropouts" in spec)


GOAL = "goal:x_m=0.8,y_m=0.4,heading_rad=1.2,travel_s=2,hold_s=1"


@cache
def steadily(name, sensors):
    """By a loop that does not tremble."""
    return omnidyn.track(AXEBOT, GOAL, name, sensors=sensors)


@pytest.mark.parametrize("name", ["pid", "mpc", "speed"])
@pytest.mark.parametrize("spec", ["jitter:2ms", "jitter:5ms", "missed:5%", "encoder,pose,jitter:5ms,missed:5%"])
@pytest.mark.some(4)
def test_a_loop_that_trembles_or_misses_a_step_costs_little(name, spec):
    """A goal at rest, so that a loop on the speed arrives too: at most 1.3 times as far off, or 0.1 mm more.

    Who sees no pose keeps what a step of another length costs: 2 mm.
    """
    steady = steadily(name, spec.partition("jitter")[0].strip(",") or None)
    trembling = omnidyn.track(AXEBOT, GOAL, name, sensors=spec, rng=2)
    blind = 2e-3 if name == "speed" else 0.0
    assert trembling.rmse_position < max(1.3 * steady.rmse_position, steady.rmse_position + 1e-4 + blind)
    assert trembling.rmse_heading < max(1.3 * steady.rmse_heading, steady.rmse_heading + 2e-4 + blind)
    lengths = np.diff(trembling.run.t)
    assert lengths.std() > 0.5e-3
    assert ("missed" in spec) == bool(lengths.max() > 1.5 * DT)


def test_the_default_is_what_the_file_of_the_plant_says():
    mean = AXEBOT.replace(sensors=Sensors(twist="mean"))
    assert omnidyn.track(AXEBOT, "eight", "pid", plant=mean, duration=0.2).sensors == "encoder,pose"
    assert omnidyn.track(AXEBOT, "eight", "pid", duration=0.2).sensors == "instantaneous"


def test_a_push_may_come_and_go():
    """Closed form: v = (F - C) / (B + k G G^T) at the end of a long one; at rest before it."""
    live = LiveRobot(AXEBOT, DT)
    for k in range(300):
        live.push((4.0, 0.0, 0.0) if k >= 100 else (0.0, 0.0, 0.0))
        live.step(np.zeros(3))
        assert live.twist.any() == (k >= 100)
    assert live.twist[0] == pytest.approx((4.0 - 2.2) / 1.5 / -omnidyn.state_space(AXEBOT).A[0, 0], rel=1e-9)
    pushed = omnidyn.track(AXEBOT, "goal", "pid", push=lambda t: (3.0, 0.0, 0.0) if t > 1.0 else (0.0, 0.0, 0.0))
    assert pushed.rmse_position > 1.5 * omnidyn.track(AXEBOT, "goal", "pid").rmse_position


@pytest.mark.parametrize("latency, sensors, limit", [(0.0, "encoder", 0.3), (0.03, "encoder", 1.0), (0.03, None, 1.0)])
def test_a_loop_on_the_speed_compares_speeds_of_one_time(latency, sensors, limit):
    """Means are half a step old, and outputs act late: compared with the reference of then, both cost little [mm]."""
    late = AXEBOT.replace(drive=AXEBOT.drive.replace(latency=latency))
    goal = "goal:x_m=0.8,y_m=0.4,heading_rad=1.2,travel_s=2,hold_s=1"
    assert 1e3 * omnidyn.track(late, goal, "speed", sensors=sensors).rmse_position < limit
    command, kit = np.array([0.3, 0.0, 0.5]), instruments(sensors, late)
    loop, live = SpeedLoop(late.replace(sensors=kit.sensors)), LiveRobot(late, DT)
    readings, way = Readings(kit, live, 0.0, QUIET), 0.0
    for k in range(100):
        live.step(loop.step(DT * k, readings.seen(QUIET, False)[1], command))
        readings.passed(DT)
        way += DT * live.twist[2]
    expected, rate = 0.5 * 2.0, loop.gains.decay[2]
    lag = 0.5 * (latency + DT * rate / (1.0 - rate))  # of the reference behind the command, and of the output
    assert way == pytest.approx(expected - lag, abs=0.02)
