"""Points from currents and voltages: against the model's own steady states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.steady.points import points_from_currents, points_from_voltage
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.model.dynamics import drive_wrench, frame_wrench, settled_currents
from omnidyn.model.robot_file import load_robot
from tests.support.codes import codes

ROBOT = load_robot("axebot")
TURNING = ROBOT.replace(body=ROBOT.body.replace(rotating_frame=True))
TWIST = np.array(
    [[0.4, 0, 0], [0.8, 0, 0], [-1.0, 0, 0], [0, 0.3, 0], [0, -0.6, 0], [0, 0.9, 0], [0, 0, 3], [0, 0, 5], [0, 0, -4.0]]
)


def steady_voltage(robot, twist):
    """The voltages that hold a twist: drive + frame + friction = 0."""
    twist = np.asarray(twist, dtype=float)
    needed = -robot.friction.axes.sliding_wrench(twist) - frame_wrench(robot, twist)
    missing = needed - drive_wrench(robot, twist, np.zeros((*twist.shape[:-1], robot.wheels.count)))
    per_volt = drive_wrench(robot, np.zeros(3), np.eye(robot.wheels.count))
    return missing @ np.linalg.pinv(per_volt)


def check(fit, robot=ROBOT):
    for axis in range(3):
        assert fit.value[f"friction.axes.viscous[{axis}]"] == pytest.approx(robot.friction.axes.viscous[axis], rel=1e-9)
        assert fit.value[f"friction.axes.coulomb[{axis}]"] == pytest.approx(robot.friction.axes.coulomb[axis], rel=1e-9)


def test_voltages_of_the_model_give_back_its_friction():
    points = points_from_voltage(ROBOT, TWIST, steady_voltage(ROBOT, TWIST))
    fit = fit_steady_state(ROBOT, points)
    check(fit)
    assert "eq (11)" in fit.method
    assert "forces_from_voltage" in codes(fit.warnings)


def test_currents_of_the_model_give_back_its_friction():
    current = settled_currents(ROBOT, TWIST, steady_voltage(ROBOT, TWIST))
    fit = fit_steady_state(ROBOT, points_from_currents(ROBOT, TWIST, current))
    check(fit)
    assert "motor currents, eqs (7)-(10)" in fit.method
    assert "forces_from_voltage" not in codes(fit.warnings)


def test_four_wheels_do_as_well():
    robot = load_robot("four-wheel")
    check(fit_steady_state(robot, points_from_voltage(robot, TWIST, steady_voltage(robot, TWIST))), robot)


def test_a_turning_robot_needs_the_frame_terms():
    """All axes at once, rotating frame: the force on the axes includes M omega v, and friction comes out right."""
    twist = np.array([[0.5, 0.3, 2.0], [0.9, -0.6, 4.0], [-0.4, 0.8, 3.0], [0.7, 0.5, -5.0]])
    points = points_from_voltage(TURNING, twist, steady_voltage(TURNING, twist))
    assert len(points) == 12
    check(fit_steady_state(TURNING, points))
    other = fit_steady_state(ROBOT, points_from_voltage(ROBOT, twist, steady_voltage(TURNING, twist)))
    assert other.value["friction.axes.coulomb[0]"] != pytest.approx(2.2, rel=0.02)


def test_an_axis_that_is_not_driven_gives_no_point():
    twist = [[0.5, 0.01, 0.1], [0.0, 0.0, 0.0]]
    points = points_from_currents(ROBOT, twist, [[0.0, 0.5, -0.5], [0.01, 0.4, -0.39]])
    assert points.axis == ("x", "x")
    assert points.speed.tolist() == [0.5, 0.0]
    assert points.twist.tolist() == twist
    assert [*map(str, points.notes)] == ["2 speeds below 10% of the fastest in their row were left out"]
    named = points_from_currents(ROBOT, twist, [[0.0, 0.5, -0.5], [0.01, 0.4, -0.39]], axis=["y", "w"])
    assert named.axis == ("y", "yaw")


def test_forces_by_hand():
    """Table 1, u = (0, 4, -4) V at 1.08 m/s: EVIDENCE has 3.30 N. And 2 A against 1 N m/A by eqs (7)-(10)."""
    points = points_from_voltage(ROBOT, [[1.08, 0, 0]], [[0, 4, -4]])
    assert points.force[0] == pytest.approx(3.30, abs=0.005)
    points = points_from_currents(ROBOT, [[0, 0, 5.0]], [[0.1, 0.1, 0.1]])
    assert points.force[0] == pytest.approx(3 * 0.1 * 19 * 0.0059 * 0.1 / 0.035, rel=1e-12)


def test_std_of_currents_and_voltages_reach_the_force():
    random = np.random.default_rng(8)
    twist, draws = np.array([[0.5, 0, 0]]), 20000
    voltage = steady_voltage(ROBOT, twist) + 0.1 * random.standard_normal((draws, 3))
    many = points_from_voltage(ROBOT, np.repeat(twist, draws, axis=0), voltage, axis="x", voltage_std=0.1)
    assert many.force_std[0] == pytest.approx(np.std(many.force), rel=0.02)
    current = random.standard_normal((draws, 3)) * [0.1, 0.2, 0.3]
    many = points_from_currents(
        ROBOT,
        np.repeat(twist, draws, axis=0),
        current,
        axis="yaw",
        current_std=[0.1, 0.2, 0.3],
        speed_std=[0.1, 0.2, 0.3],
    )
    assert many.force_std[0] == pytest.approx(np.std(many.force), rel=0.02)
    assert many.speed_std[0] == 0.3


def test_current_against_voltage_in_numbers():
    voltage = steady_voltage(ROBOT, TWIST)
    current = settled_currents(ROBOT, TWIST, voltage)
    agree = fit_steady_state(ROBOT, points_from_currents(ROBOT, TWIST, current, voltage=voltage))
    assert "forces_disagree" not in codes(agree.warnings)
    fit = fit_steady_state(ROBOT, points_from_currents(ROBOT, TWIST, 0.8 * current, voltage=voltage))
    found = [one for one in fit.warnings if one.code == "forces_disagree" and one.numbers["origins"][0] == "current"]
    assert len(found) == 3
    assert "axis x: the force from voltage and speed, eq (11) is 1.25 times the force from motor currents" in str(
        found[0]
    )
    assert "(3 rows, rms difference 0.58 N)" in str(found[0])


def test_faster_than_the_voltage_allows():
    voltage = steady_voltage(ROBOT, TWIST)
    fit = fit_steady_state(ROBOT, points_from_voltage(ROBOT, TWIST, voltage))
    assert "beyond_no_load" not in codes(fit.warnings)
    points = points_from_currents(ROBOT, 2.0 * TWIST, settled_currents(ROBOT, TWIST, voltage), voltage=voltage)
    beyond = [one for one in fit_steady_state(ROBOT, points).warnings if one.code == "beyond_no_load"]
    # By hand for 0.4 m/s: 2.576 N and 9.105 N s/m of back-EMF ask for the voltage of 0.683 m/s without load.
    assert str(beyond[0]).startswith("axis x: 3 of 3 moving rows are faster than the no-load speed (17 to 49 % faster)")


def test_a_current_limit_is_told():
    limited = ROBOT.replace(motor=ROBOT.motor.replace(current_limit=0.5))
    points = points_from_voltage(limited, TWIST, steady_voltage(ROBOT, TWIST))
    assert [(note.code, note.numbers) for note in points.notes] == [("at_current_limit", {"rows": 2})]


def test_a_voltage_drop_is_taken_off_before_eq_11():
    """By hand: 3.3 V less 0.3 V on two wheels at standstill drive x with sqrt(3) l K_t/(R r) per volt."""
    dropping = ROBOT.replace(motor=ROBOT.motor.replace(voltage_drop=0.3))
    point = points_from_voltage(dropping, [[0, 0, 0]], [[0, 3.3, -3.3]], axis="x")
    assert point.force[0] == pytest.approx(3.0 * 3**0.5 * 19 * 0.0059 / (1.69 * 0.035), rel=1e-12)


def test_a_lossy_gear_is_refused():
    """What it loses would be counted as friction."""
    lossy = ROBOT.replace(motor=ROBOT.motor.replace(gear_efficiency=0.9))
    with pytest.raises(UnsupportedError, match=r"no such loss yet; got gear_efficiency below 1"):
        points_from_currents(lossy, [[1, 0, 0]], [[0, 1, -1]])


@pytest.mark.parametrize(
    "twist, current, more, words",
    [
        ([[1, 0]], [[1, 1, 1]], {}, r"twist: wrong shape; got \(1, 2\); expected \(rows, 3\)"),
        ([[1, 0, 0]], [[1, 1]], {}, r"current: wrong shape; got \(1, 2\); expected \(1, 3\)"),
        ([[1, 0, 0]], [[1, 1, 1], [1, 1, 1]], {}, r"current: wrong shape; got \(2, 3\); expected \(1, 3\)"),
        ([[1, 0, 0]], [[1, np.nan, 1]], {}, r"current row 0: not a finite number"),
        ([["a", 0, 0]], [[1, 1, 1]], {}, r"twist: not numbers"),
        ([[0, 0, 0]], [[0, 0, 0]], {}, r"nothing is driven in any row"),
        ([[1, 0, 0]], [[1, 1, 1]], {"axis": "z"}, r"no such axis; got z"),
        (
            [[1, 0, 0]],
            [[1, 1, 1]],
            {"current_std": [1, 2]},
            r"current_std: wrong shape; got \[1, 2\]; expected a number, or one per",
        ),
        ([[1, 0, 0]], [[1, 1, 1]], {"speed_std": [1, 2, 3]}, r"speed_std without force_std"),
        ([[1, 0, 0]], [[1, 1, 1]], {"current_std": 1, "speed_std": [1, 2]}, r"speed_std: wrong shape"),
    ],
)
def test_wrong_arrays(twist, current, more, words):
    with pytest.raises(InputError, match=words):
        points_from_currents(ROBOT, twist, current, **more)


@given(st.lists(st.floats(-2, 2), min_size=3, max_size=3), st.lists(st.floats(-6, 6), min_size=3, max_size=3))
def test_power_at_the_points_is_power_at_the_motors(twist, voltage):
    """Summed over the axes, force times speed is the mechanical power of the motors: K_v = K_t loses nothing."""
    twist, voltage = np.array([twist]), np.array([voltage])
    current = settled_currents(ROBOT, twist, voltage)
    wheel = twist @ ROBOT.wheels.wrench_matrix / 0.035
    points = [points_from_currents(ROBOT, twist, current, axis=axis) for axis in ("x", "y", "yaw")]
    power = sum(float(each.force[0] * each.speed[0]) for each in points)
    assert power == pytest.approx(float(np.sum(current * 19 * 0.0059 * wheel)), rel=1e-9, abs=1e-9)
