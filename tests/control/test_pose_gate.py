"""What is believed of measurements that disagree: jumps, wheels that slip, samples that come again."""

import math

import numpy as np
import pytest

from benchmarks.control.control_mismatch import cells_of
from benchmarks.control_real.robots import NUMBERS
from omnidyn.control.pid import Pid
from omnidyn.control.pose_gate import JUMPED, MEMORY, RATE, REPEATED, SLIPPED, TRUSTED, PoseGate
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot_file import load_robot
from omnidyn.model.sliding import top_speeds

ROBOT, DT = load_robot("axebot"), 0.02
SPEED, OMEGA = 0.4, 0.5


def circle(k):
    """Pose and twist of a robot that drives a circle, exactly. Shape (6,)."""
    heading = OMEGA * DT * k
    place = SPEED / OMEGA * np.array([math.sin(heading), 1.0 - math.cos(heading)])
    return np.array([*place, heading, SPEED, 0.0, OMEGA])


def test_what_is_noise_is_left_as_it_is_to_the_last_bit():
    gate, random = PoseGate(ROBOT, DT), np.random.default_rng(0)
    for k in range(500):
        given = circle(k) + 1e-3 * random.standard_normal(6)
        given[2] = math.remainder(given[2], 2.0 * math.pi)
        state = given.copy()
        assert gate.judge(k * DT, state) == TRUSTED
        np.testing.assert_array_equal(state, given)


def test_a_pose_that_jumps_is_reached_at_a_share_of_the_top_speed():
    gate, jump = PoseGate(ROBOT, DT), np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
    away = []
    for k in range(40):
        state = circle(k) + (jump if k == 10 or k >= 20 else 0.0)
        verdict = gate.judge(k * DT, state)
        away.append(np.hypot(*(state - circle(k))[:2]))
        assert (verdict == JUMPED) == (k == 10 or 0.0 < away[-1] < 0.0499)
    step = RATE * top_speeds(ROBOT)[0] * DT
    assert away[10] == pytest.approx(step, rel=1e-3)
    assert away[11] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(away[20:26], np.minimum(step * np.arange(1, 7), 0.05), rtol=0.02)


def test_a_twist_of_wheels_that_slip_is_corrected_by_poses():
    gate, slip = PoseGate(ROBOT, DT), np.array([0.0, 0.0, 0.0, 0.1, 0.0, 2.0])
    random = np.random.default_rng(1)
    for k in range(120):
        state = circle(k) + 1e-4 * random.standard_normal(6) + (slip if k >= 100 else 0.0)
        assert gate.judge(k * DT, state) == (SLIPPED if k > 100 else TRUSTED) or k == 100
        if k == 109:
            np.testing.assert_allclose(
                (circle(k) + slip - state)[[3, 5]], slip[[3, 5]] * (1.0 - (1.0 - MEMORY) ** 10), rtol=0.1
            )
        assert np.hypot(*(state - circle(k))[:2]) < 1e-3  # poses are believed meanwhile


def test_poses_that_are_late_say_nothing_of_slip():
    """The age of a picture trembles; that of a quick turn looked like slip, and made the heading 17 mrad wrong."""
    gate = PoseGate(ROBOT.replace(sensors=Sensors(pose_delay=0.04, pose_rate=60.0)), DT)
    for k in range(50):
        given = circle(k) + (0.0 if k < 20 else np.array([0.0, 0.0, 0.0, 0.1, 0.0, 1.0]))
        state = given.copy()
        assert gate.judge(k * DT, state) == TRUSTED
        np.testing.assert_array_equal(state, given)


def test_a_sample_that_comes_again_is_moved_on_by_its_twist():
    gate = PoseGate(ROBOT, DT)
    for k in range(10):
        gate.judge(k * DT, circle(k))
    for k in range(10, 13):
        state = circle(9)
        assert gate.judge(k * DT, state) == REPEATED
        np.testing.assert_allclose(state, circle(k), atol=1e-5)
    assert gate.judge(13 * DT, circle(13)) == TRUSTED
    rest = np.zeros(6)
    assert PoseGate(ROBOT, DT).judge(0.0, rest) == TRUSTED


def test_a_robot_at_rest_may_say_the_same_for_ever():
    gate = PoseGate(ROBOT, DT)
    assert {gate.judge(k * DT, np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])) for k in range(20)} == {TRUSTED}


def test_controllers_say_it_and_do_better_than_those_written_by_hand():
    control, path = Pid(ROBOT), _Rest()
    control.step(0.0, np.zeros(3), np.zeros(3), path)
    control.step(DT, np.array([0.3, 0.0, 0.0]), np.zeros(3), path)
    assert control.info.status == "pose jumped: followed slowly"
    assert control.info.ok
    cells = cells_of("axebot", NUMBERS["axebot"], "slip", "instantaneous", 5)
    assert cells["pid"][1] < 0.5 * cells["PID + kS"][1]
    assert cells["mpc"][1] < cells["PID + kS"][1]


class _Rest:
    end = math.inf

    def at(self, t):
        return tuple(np.zeros((*np.shape(t), 3)) for _ in range(3))
