"""Drives with a speed loop in their firmware: its sum makes the volts too, and a controller has to know that."""

from types import SimpleNamespace

import numpy as np
import pytest

import omnidyn
from benchmarks.control_real import errors, told
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.rivals import KinematicPi
from benchmarks.control_real.robots import NUMBERS
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.paths.path import path
from omnidyn.control.pid import Pid
from omnidyn.model.robot import Robot
from omnidyn.simulation.live import LiveRobot

LEKIWI = omnidyn.load_robot("lekiwi")
CIRCLE = "circle:radius_m=0.3,speed_m_s=0.1"
CONTROLLERS = {"pid": Pid, "mpc": Mpc}


def looped(ki: float, kp: float = 5.0) -> Robot:
    """LeKiwi with another loop."""
    return LEKIWI.replace(drive=LEKIWI.drive.replace(kp=kp, ki=ki))


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.some(1)
def test_what_a_loop_sums_up_is_known_whatever_its_gain(name):
    off = [
        omnidyn.track(looped(ki), CIRCLE, name, duration=6.0).rmse_position for ki in (0.0, 1.0, 5.0, 25.0, 80.0, 250.0)
    ]
    assert max(off) < 3e-5  # [m]; mpc was 0.27 off, pid 0.006
    assert max(off) < 1.3 * min(off) + 1e-5


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("ki", [0.0, 25.0])
def test_a_push_and_a_wrong_model_leave_no_lasting_error(name, ki):
    own = looped(ki)
    plant = own.replace(
        body=own.body.replace(mass=3.5),
        motor=own.motor.replace(resistance=5.5),
        friction=own.friction.replace(direction=own.friction.direction.replace(coulomb=(8.0, 8.0))),
    )
    found = omnidyn.track(own, CIRCLE, name, plant=plant, push=(2.0, -1.0, 0.1), duration=8.0)
    last = found.error[-100:]
    assert np.hypot(*last[:, :2].T).max() < 2.5e-4
    assert np.abs(last[:, 2]).max() < 5e-4


LOOPS = [(5.0, 0.0), (5.0, 25.0), (0.0, 50.0)]  # without a sum, with both, the sum alone
MORE_LOOPS = [(5.0, 5.0), (5.0, 250.0), (1.0, 25.0)]  # between these


@pytest.mark.parametrize("loop", [*LOOPS, *MORE_LOOPS], ids=str)
@pytest.mark.parametrize("sensors", ["encoder", "camera"])
@pytest.mark.some(1)
def test_it_beats_a_kinematic_pi_on_a_plant_of_others(loop, sensors):
    plant, along = Plant(NUMBERS["lekiwi"] | {"loop": (*loop, 1000.0)}), paths(3.0)["clover"]
    robot = told(looped(loop[1], loop[0]), sensors)
    rival = errors(plant, KinematicPi(plant), along, sensors)
    for make in CONTROLLERS.values():
        own = errors(plant, make(robot), along, sensors)
        assert own[0] < 1.1 * rival[0] + 0.02
        assert own[1] < 1.1 * rival[1] + 0.1


def test_many_in_one_are_one_each():
    robot, along = looped(25.0), path(CIRCLE)
    one, many = Mpc(robot), Mpc(robot).batch(2)
    live = LiveRobot(robot, one.dt, pose=along.at(0.0).pose)
    for k in range(40):
        pose, twist = np.array(live.pose), np.array(live.twist)
        sent = one.step(k * one.dt, pose, twist, along)
        np.testing.assert_array_equal(
            many.step_batch(k * one.dt, np.tile(pose, (2, 1)), np.tile(twist, (2, 1)), along)[1], sent
        )
        live.step(sent)


@pytest.mark.parametrize("observer", [True, False])
@pytest.mark.some(1)
def test_a_wheel_that_turns_less_than_it_is_said_to_does_not_wind_up(observer):
    """Twists measured 2 % too large: the loop holds what its encoders say, for ever."""
    control = Mpc(LEKIWI, observer=observer)

    def step(t, pose, twist, follow):
        return control.step(t, pose, 1.02 * np.asarray(twist), follow)

    liar = SimpleNamespace(
        **{name: getattr(control, name) for name in ("name", "robot", "output", "limit", "replace", "reset")},
        step=step,
        info=control.info,
    )
    found = omnidyn.track(LEKIWI, CIRCLE, liar, duration=40.0)
    assert found.rmse_position < 1e-3
    assert np.abs(control.learned["push"]).max() < 200.0
