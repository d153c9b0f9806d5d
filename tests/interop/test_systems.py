"""Systems of python-control move as we do: the linear one without dry friction, the other one with it."""

import sys

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import MissingExtraError

ROBOT = omnidyn.load_robot("axebot")
FREE = ROBOT.replace(friction=ROBOT.friction.replace(axes=ROBOT.friction.axes.replace(coulomb=(0.0, 0.0, 0.0))))
VOLTS = np.array([1.5, 5.5, -2.5])


@pytest.mark.filterwarnings("ignore")
def test_the_linear_system_is_the_robot_without_dry_friction():
    control = pytest.importorskip("control")
    system = omnidyn.interop.linear_system(FREE)
    assert list(system.input_labels) == ["u1", "u2", "u3"]
    assert list(system.state_labels) == ["vx", "vy", "omega"]
    t = np.linspace(0.0, 1.0, 101)
    found = control.forced_response(system, t, np.tile(VOLTS, (101, 1)).T)
    run = omnidyn.simulate(FREE, np.tile(VOLTS, (100, 1)), 0.01)
    np.testing.assert_allclose(found.outputs.T, run.twist, rtol=1e-9, atol=1e-12)
    same = omnidyn.state_space(ROBOT).to_control()
    np.testing.assert_array_equal(same.A, system.A)
    np.testing.assert_array_equal(same.D, np.zeros((3, 3)))
    assert list(same.input_labels) == ["u1", "u2", "u3"]


@pytest.mark.filterwarnings("ignore")
def test_the_nonlinear_system_is_the_robot():
    control = pytest.importorskip("control")
    system = omnidyn.interop.nonlinear_system(ROBOT)
    t = np.linspace(0.0, 1.0, 51)
    given = np.tile(10.0 * VOLTS / 5.5, (51, 1)).T  # beyond the limit: clipped
    found = control.input_output_response(system, t, given, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-10})
    run = omnidyn.simulate(ROBOT, np.tile(given[:, 0], (50, 1)), 0.02)
    np.testing.assert_allclose(found.outputs.T, np.hstack([run.twist, run.pose]), rtol=0, atol=1e-6)
    assert not system.dynamics(0.0, np.zeros(6), np.array([0.0, 0.5, -0.5])).any()  # holds in its dead zone


def to_control(robot):
    return omnidyn.state_space(robot).to_control()


def test_without_the_library_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    for make in (omnidyn.interop.linear_system, omnidyn.interop.nonlinear_system, to_control):
        with pytest.raises(MissingExtraError, match=r"pip install .omnidyn\[control\]"):
            make(ROBOT)
