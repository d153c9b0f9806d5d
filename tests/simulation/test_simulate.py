"""The contract of simulate(): samples, inputs, warnings, rest, and everything it refuses, in words."""

import re

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.robot_file import PRESETS, load_robot, parse_robot
from omnidyn.simulation.exact.exact_march import why_not_exact
from omnidyn.simulation.simulate import simulate
from tests.support.robots import table_3_voltages

OPTIONS = {
    "gear_ratio = 19.0": [
        ("gear_ratio = 19.0\ncurrent_limit_A = 2.0", "current_limit_A"),
        ("gear_ratio = 19.0\nvoltage_drop_V = 0.3", "voltage_drop_V"),
        ("gear_ratio = 19.0\ngear_efficiency = 0.8", "gear_efficiency"),
        ("gear_ratio = [19.0, 19.0, 20.0]", "unequal motors"),
    ],
    "rotating_frame = false": [("rotating_frame = true", "rotating_frame")],
    "wheel_radius_m = 0.035": [("wheel_radius_m = [0.035, 0.035, 0.036]", "wheel radii")],
    "resistance_ohm = 1.69": [("resistance_ohm = [1.69, 1.69, 1.7]", "unequal motors")],
    "[180.0, -60.0, 60.0]": [("[180.0, -60.0, 61.0]", "axes couple")],
    "[friction.axes]": [
        ("[friction.direction]\ncoulomb = [1.0, 1.0]\n[friction.axes]", r"friction\.direction"),
        ("[friction.wheels]\ncoulomb = 0.5\n[friction.axes]", "at the wheels"),
    ],
}
CASES = [(old, new, words) for old, options in OPTIONS.items() for new, words in options]


def test_samples_times_and_inputs(axebot):
    voltage = [[0.0, 3.0, -3.0], [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]
    run = simulate(axebot, voltage, [0.5, 0.25, 1.0])
    assert run.t.tolist() == [0.0, 0.5, 0.75, 1.75]
    assert run.voltage.tolist() == [*voltage, voltage[-1]]
    for channel in (run.current, run.wheel_speed, run.twist, run.pose):
        assert channel.shape == (4, 3)
    assert (run.twist[0] == 0.0).all()
    assert (run.pose[0] == 0.0).all()
    assert run.source == "simulated: axebot, exact engine"
    assert run.warnings == ()
    assert run.duty is None


def test_time_of_equal_steps_does_not_drift(axebot):
    """Sample 30,000 of 1 ms is 30.0 s as one rounds it, not a sum of 30,000 rounded milliseconds."""
    run = simulate(axebot, np.zeros((30_000, 3)), 1e-3)
    np.testing.assert_allclose(run.t, np.arange(30_001) / 1000, rtol=3e-16)


def test_wheels_and_currents_belong_to_the_sample(axebot):
    """Eq (3) with its sign right and eq (11) with the gear ratio, by hand, at every sample."""
    run = simulate(axebot, np.tile([1.5, 5.5, -2.5], (40, 1)), 0.01, twist=(0.2, -0.3, 1.0))
    v, n, w = run.twist.T
    cos, sin, b, r = np.sqrt(3) / 2, 0.5, 0.1, 0.035
    wheels = np.stack([-n + b * w, cos * v + sin * n + b * w, -cos * v + sin * n + b * w], axis=1) / r
    np.testing.assert_allclose(run.wheel_speed, wheels, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(run.current, (run.voltage - 19 * 0.0059 * wheels) / 1.69, rtol=1e-13, atol=1e-13)


def test_the_start_is_the_first_sample(axebot):
    run = simulate(axebot, [[0.0, 0.0, 0.0]], 1e-3, twist=(0.5, 0.0, -2.0), pose=(1.0, 2.0, 30.0))
    assert run.twist[0].tolist() == [0.5, 0.0, -2.0]
    assert run.pose[0].tolist() == [1.0, 2.0, 30.0]


def test_voltage_beyond_the_limit_is_clipped_and_said(axebot):
    voltage = np.array([[0.0, 6.0, -6.0], [0.0, 9.0, -9.0], [0.0, 6.5, -6.0], [0.0, 1.0, 0.0]])
    run = simulate(axebot, voltage, 0.1)
    assert run.voltage[:4].tolist() == np.clip(voltage, -6, 6).tolist()
    (warning,) = run.warnings
    assert (warning.code, warning.subject) == ("clipped", "voltage")
    assert warning.numbers == {"clipped": 2, "rows": 4, "first": 1}
    assert str(warning) == "voltage above the limit was clipped in 2 of 4 rows, first in row 1"
    assert run == simulate(axebot, np.clip(voltage, -6, 6), 0.1).replace(warnings=run.warnings)


def test_arrays_are_read_only_and_the_callers_stay_his_own(axebot):
    voltage, dt = np.full((5, 3), 7.0), np.full(5, 0.1)
    run = simulate(axebot, voltage, dt)
    assert (voltage == 7.0).all()
    voltage[:], dt[:] = 0.0, 1.0
    assert (run.voltage == 6.0).all()
    for channel in (run.t, *run.channels.values()):
        with pytest.raises(ValueError, match="read-only"):
            channel[0] = 1.0


@pytest.mark.parametrize("kind", [np.float32, np.int64, list, "fortran", "strided"])
def test_any_array_of_numbers_will_do(axebot, kind):
    rows = np.array([[0, 3, -3], [1, 2, 3], [-2, 0, 2]], dtype=float)
    given = {
        list: rows.tolist,
        "fortran": lambda: np.asfortranarray(rows),
        "strided": lambda: np.repeat(rows, 2, 0)[::2],
    }
    voltage = given[kind]() if kind in given else rows.astype(kind)
    assert simulate(axebot, voltage, 0.05) == simulate(axebot, rows, 0.05)


# ---- rest is exactly rest --------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [1e-3, 60.0])
@pytest.mark.parametrize(
    "volts", [(0.0, 0.335, -0.335), (-0.26, 0.13, 0.13), (0.087, 0.087, 0.087), (-0.03, 0.06, -0.02)]
)
def test_a_minute_inside_the_dead_zone(axebot, dt, volts):
    """Half of the breakaway voltage and other rows inside: nothing moves, to the last bit."""
    run = simulate(axebot, np.tile(volts, (round(60.0 / dt), 1)), dt, pose=(0.1, 0.2, 0.3))
    assert run.t[-1] == pytest.approx(60.0)
    for channel in (run.twist, run.wheel_speed):
        assert channel.tobytes() == bytes(channel.nbytes)  # all +0.0
    assert (run.pose == [0.1, 0.2, 0.3]).all()
    assert (run.current == np.array(volts) / 1.69).all()


def test_rest_under_a_negative_drive_is_plus_zero(axebot):
    """The same voltages with the other sign; -0.0 would be written as such into files."""
    run = simulate(axebot, np.tile([0.03, -0.06, 0.02], (10, 1)), 1e-3)
    assert run.twist.tobytes() == bytes(run.twist.nbytes)


def test_wheel_1_stands_while_the_others_drive(axebot):
    """u = (0, 2, -2) V of the paper: only v moves, so wheel 1 has exactly no speed and no current."""
    run = simulate(axebot, np.tile([0.0, 2.0, -2.0], (2000, 1)), 1e-3)
    assert run.twist[-1, 0] == pytest.approx(0.435, abs=5e-4)  # the steady speed of Table 3
    assert (run.wheel_speed[:, 0] == 0.0).all()
    assert (run.current[:, 0] == 0.0).all()
    assert (run.twist[:, 1:] == 0.0).all()
    assert (run.wheel_speed[1:, 1] > 0.0).all()


# ---- what it refuses -------------------------------------------------------------------------------------

ROWS = np.zeros((4, 3))
NAN_ROW = np.array([[0.0, 0, 0], [0, 0, 0], [0, np.nan, 0], [np.nan, 0, 0]])


@pytest.mark.parametrize(
    "voltage, dt, words",
    [
        (ROWS, 0.0, r"dt row 0: step out of range; got 0\.0; expected 1e-09 to 3600 s"),
        (ROWS, -1e-3, r"dt row 0: step out of range; got -0\.001"),
        (ROWS, np.nan, "dt row 0: step out of range; got nan"),
        (ROWS, np.inf, "dt row 0: step out of range; got inf"),
        (ROWS, 1e9, r"dt row 0: step out of range; got 1000000000\.0"),
        (ROWS, [0.1, 0.1, 0.0, 0.1], r"dt row 2: step out of range; got 0\.0"),
        (ROWS, [0.1, 0.1], r"dt: wrong shape; got \(2,\); expected a number or \(4,\)"),
        (ROWS, [[0.1] * 4], r"dt: wrong shape; got \(1, 4\)"),
        (ROWS, "fast", "dt: not numbers; got fast"),
        (ROWS, None, "dt"),
        (ROWS[:, :2], 0.1, r"voltage: wrong shape; got \(4, 2\); expected \(n, 3\), n >= 1"),
        (ROWS[0], 0.1, r"voltage: wrong shape; got \(3,\)"),
        (ROWS[:0], 0.1, r"voltage: wrong shape; got \(0, 3\)"),
        (3.0, 0.1, r"voltage: wrong shape; got \(\)"),
        (ROWS[None], 0.1, r"voltage: wrong shape; got \(1, 4, 3\)"),
        ([[1.0, 2.0, 3.0], [1.0, 2.0]], 0.1, "voltage: not numbers"),
        ([["a", "b", "c"]], 0.1, "voltage: not numbers"),
        (NAN_ROW, 0.1, "voltage row 2: not a finite number"),
        ([[np.inf, 0.0, 0.0]], 0.1, r"voltage row 0: not a finite number; got \[inf, 0\.0, 0\.0\]; expected numbers"),
    ],
)
def test_bad_inputs_are_refused_with_their_row(axebot, voltage, dt, words):
    with pytest.raises(InputError, match=words):
        simulate(axebot, voltage, dt)


@pytest.mark.parametrize("tol", [-1.0, 0.0, np.nan, 1e-11, 2.0])
@pytest.mark.parametrize("turning", [False, True])
def test_a_tolerance_out_of_range_is_refused_by_either_engine(axebot, tol, turning):
    robot = axebot.replace(body=axebot.body.replace(rotating_frame=turning))
    words = (
        f"tol: tolerance out of range; got {tol!r}; expected 1e-10 to 1 m/s, or None for a fixed step; leave `tol` out"
    )
    with pytest.raises(InputError, match=re.escape(words)):
        simulate(robot, ROWS, 0.1, tol=tol)


@pytest.mark.parametrize(
    "start", [{"twist": (0.0, np.nan, 0.0)}, {"pose": (0.0, 0.0)}, {"twist": "x"}, {"pose": [[0, 0, 0]]}]
)
def test_a_bad_start_is_refused(axebot, start):
    (name,) = start
    with pytest.raises(InputError, match=f"{name}: (cannot start there|not numbers)"):
        simulate(axebot, ROWS, 0.1, **start)


def test_a_spin_too_fast_to_integrate_is_refused_at_once(axebot):
    with pytest.raises(InputError, match=r"one step turns the robot too far; got .* rad in row 0.*use a shorter dt"):
        simulate(axebot, ROWS, 3600.0, twist=(1.0, 0.0, 1e3))


DRIVING = np.tile([4.0, 5.0, -3.0], (60, 1))


@pytest.mark.parametrize("old, new, words", CASES, ids=[words for _, _, words in CASES])
def test_an_option_of_the_robot_file_is_never_ignored(axebot, old, new, words):
    """The exact engine names it as the reason not to serve; the engine that does moves the robot otherwise."""
    text = (PRESETS / "axebot.toml").read_text()
    assert old in text
    robot = parse_robot(text.replace(old, new, 1))
    (reason,) = why_not_exact(robot)
    assert re.search(words, reason)
    run, plain = simulate(robot, DRIVING, 0.01), simulate(axebot, DRIVING, 0.01)
    assert "exact engine" not in run.source
    assert np.abs(run.twist - plain.twist).max() > 1e-4


def test_every_reason_is_named(axebot):
    robot = axebot.replace(
        body=axebot.body.replace(rotating_frame=True),
        motor=axebot.motor.replace(current_limit=1.0, voltage_drop=0.1),
    )
    reasons = why_not_exact(robot)
    assert len(reasons) == 3
    assert re.search(r"current_limit_A.*rotating_frame.*voltage_drop", " ".join(reasons))
    assert why_not_exact(axebot) == []


@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("ratio", [1.0, 1.25])
def test_an_option_that_never_acts_changes_nothing(axebot, ratio, tol):
    """A current limit far above stall: other engines find the exact one's run within `tol`, rest included."""
    levels = axebot.friction.axes
    sticky = levels.replace(breakaway=tuple(ratio * c for c in levels.coulomb))
    robot = axebot.replace(friction=axebot.friction.replace(axes=sticky))
    limited = robot.replace(motor=robot.motor.replace(current_limit=100.0))
    voltage = table_3_voltages()[::10]
    exact, run = simulate(robot, voltage, 0.01), simulate(limited, voltage, 0.01, tol=tol)
    engine = "Coulomb" if ratio == 1.0 else "implicit"
    assert run.source == f"simulated: axebot, {engine} engine, tol {tol:g} m/s"
    assert run.warnings == ()
    assert (np.abs(run.twist - exact.twist).max(axis=0) <= np.array([tol, tol, 10 * tol])).all()
    np.testing.assert_allclose(run.pose, exact.pose, atol=100 * tol)
    np.testing.assert_array_equal(run.twist == 0.0, exact.twist == 0.0)


def test_the_turning_frame_does_not_matter_on_a_straight_line(axebot):
    """Along x alone omega is 0, so M omega v is 0: both engines, the same run."""
    turning = axebot.replace(body=axebot.body.replace(rotating_frame=True))
    voltage = np.outer(4.0 * np.sin(np.arange(200) * 0.05), [0.0, 1.0, -1.0])
    exact, run = simulate(axebot, voltage, 0.01), simulate(turning, voltage, 0.01)
    np.testing.assert_allclose(run.twist, exact.twist, atol=1e-6)
    assert (run.twist[:, 1:] == 0.0).all()
    assert (run.wheel_speed[:, 0] == 0.0).all()


def test_equal_numbers_in_a_list_are_no_obstacle(axebot):
    listed = axebot.replace(motor=axebot.motor.replace(resistance=(1.69, 1.69, 1.69), gear_ratio=(19.0,) * 3))
    volts = np.tile([1.0, 2.0, 3.0], (9, 1))
    assert simulate(listed, volts, 0.1) == simulate(axebot, volts, 0.1)


def test_without_any_friction_the_speed_only_tends_to_zero(axebot):
    """B = C = 0: the back-EMF alone brakes, v = v0 e^(-a t), and rest is never reached."""
    zero = (0.0, 0.0, 0.0)
    free = axebot.replace(
        friction=axebot.friction.replace(axes=axebot.friction.axes.replace(viscous=zero, coulomb=zero))
    )
    a = 1.5 * (19 * 0.0059) ** 2 / (1.69 * 0.035**2) / 1.5
    run = simulate(free, np.zeros((20, 3)), 0.05, twist=(1.0, 0.0, 0.0))
    np.testing.assert_allclose(run.twist[:, 0], np.exp(-a * run.t), rtol=1e-12)
    assert (run.twist[:, 1:] == 0.0).all()


def test_dynamic_electrics_run_on_the_exact_engine(axebot):
    """And agree with the implicit one, which a turning frame forces but which acts on nothing along one axis."""
    dynamic = axebot.replace(motor=axebot.motor.replace(electrical="dynamic", inductance=2e-3))
    turning = dynamic.replace(body=dynamic.body.replace(rotating_frame=True))
    voltage = np.outer(4.0 * np.sin(np.arange(100) * 0.1), [0.0, 1.0, -1.0])
    exact, run = simulate(dynamic, voltage, 0.01), simulate(turning, voltage, 0.01, tol=1e-8)
    assert exact.source == "simulated: axebot, exact engine"
    np.testing.assert_allclose(run.twist, exact.twist, atol=1e-8)
    np.testing.assert_allclose(run.current, exact.current, atol=1e-5)
    assert np.abs(exact.twist - simulate(axebot, voltage, 0.01).twist).max() > 1e-3


@pytest.mark.parametrize("name", ["axebot", "robotino"])
@pytest.mark.parametrize(
    "key, start", [("twist", (1e300, 0.0, 0.0)), ("twist", (0.0, 0.0, -2e9)), ("pose", (0.0, 1e10, 0.0))]
)
def test_no_robot_starts_beyond_all_sense(name, key, start):
    with pytest.raises(InputError, match=rf"^{key}: no robot starts there; got .*; expected 3 numbers within"):
        simulate(load_robot(name), np.zeros((10, 3)), 0.01, **{key: start})


def test_a_start_at_the_bound_comes_to_an_end():
    run = simulate(load_robot("robotino"), np.zeros((200, 3)), 0.01, twist=(1e3, -1e3, 1e3))
    assert not run.twist[-1].any()
