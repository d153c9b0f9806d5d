"""Derivatives through the firmware's speed loop: against a loop in plain Python, and against differences of runs."""

import math

import numpy as np
import pytest
import scipy.linalg

from omnidyn.errors import UnsupportedError
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.simulation.commands import commands
from omnidyn.simulation.sensitivity.derivatives import derivatives, differentiate
from omnidyn.simulation.sensitivity.directions import prepared
from omnidyn.simulation.simulate import simulate
from tests.support.run_differences import AGREES, BODY, MOTOR, differences, held, worst

KP, KI, LIMIT, COULOMB = "drive.kp_V_s_rad", "drive.ki_V_rad", "motor.voltage_limit_V", "friction.axes.coulomb[0]"


def driven(robot, kp=0.4, ki=2.0, rate=100.0, name="loop", **changes):
    drive = robot.drive.replace(kind="speed", kp=kp, ki=ki, rate=rate)
    return robot.replace(name=name, drive=drive, **changes)


def by_hand(p, ticks, period, speed, command):
    """v_x of Table 3's robot at the ticks under +-command [rad/s] of wheels 2 and 3, forward from v_x = speed.

    Between ticks v' = -a v + g u - c by its exponential; parameters may be complex. Returns (speeds, voltages).
    """
    gain = 19.0 * 0.0059 / (1.69 * 0.035)
    rate = (1.5 * gain * 19.0 * 0.0059 / 0.035 + p["viscous"]) / 1.5
    share, v, total, speeds, volts = math.sqrt(3.0) / 2.0, speed, 0.0, [speed], []
    for _ in range(ticks):
        error = command - share * v / 0.035
        more = total + p["ki"] * error * period
        wanted = p["kp"] * error + more
        if abs(wanted) <= p["limit"].real or (wanted * error).real < 0.0:
            total = more
        u = p["kp"] * error + total
        u = u if abs(u) <= p["limit"].real else p["limit"] * np.sign(u.real)
        pull = (2.0 * share * gain * u - p["coulomb"]) / 1.5
        kept = np.exp(-rate * period)
        v = kept * v + (1.0 - kept) / rate * pull
        assert v.real > 0.0
        speeds.append(v)
        volts.append(u)
    return np.array(speeds), np.array(volts)


def test_against_a_loop_in_plain_python(axebot):
    """By a complex step: saturated at first, then not, the integral standing still while it is."""
    robot = driven(axebot)
    names = {"kp": KP, "ki": KI, "limit": LIMIT, "viscous": "friction.axes.viscous[0]", "coulomb": COULOMB}
    values = {"kp": 0.4, "ki": 2.0, "limit": 6.0, "viscous": 0.94, "coulomb": 2.2}
    values = {key: complex(value) for key, value in values.items()}
    found = derivatives(
        robot,
        dt=0.01,
        keys=list(names.values()),
        wheel_speed_command=held((80, [0, 35, -35])),
        twist=(0.1, 0.0, 0.0),
        tol=1e-9,
    )
    speeds, volts = by_hand(values, 80, 0.01, 0.1, 35.0)
    np.testing.assert_allclose(found.run.twist[:, 0], speeds.real, atol=1e-8)
    np.testing.assert_allclose(found.run.voltage[:-1, 1], volts.real, atol=1e-6)
    saturated = volts.real >= 6.0
    assert 5 < saturated.sum() < 60
    for j, name in enumerate(names):
        moved, _ = by_hand({**values, name: values[name] + 1e-30j}, 80, 0.01, 0.1, 35.0)
        error = worst(found.twist[:, 0, j], moved.imag / 1e-30)
        print(f"by hand {names[name]:30} {error:.1e}")
        assert error <= AGREES
        assert (found.twist[:, 1:, j] == 0.0).all()
    first = int(np.argmin(saturated))  # rows up to it
    assert (found.twist[: first + 1, 0, :2] == 0.0).all()  # what is saturated does not feel the gains
    assert (found.twist[-1, 0, :2] != 0.0).all()


def by_hand_with_inductance(p, ticks, period, speed, command):
    """As `by_hand`, unsaturated, with L i' = u - R i - E v of wheels 2 and 3: (v, i, 1) by its exponential.

    Returns (speeds, currents of wheel 2).
    """
    gain, share = 19.0 * 0.0059 / 0.035, math.sqrt(3.0) / 2.0
    state, total, speeds, currents = np.array([speed, 0.0, 1.0 + 0j]), 0.0, [speed], [0.0]
    for _ in range(ticks):
        error = command - share * state[0] / 0.035
        total += p["ki"] * error * period
        u = p["kp"] * error + total
        assert abs(u) < 6.0
        rates = np.array(
            [
                [-p["viscous"] / 1.5, 2.0 * share * gain / 1.5, -p["coulomb"] / 1.5],
                [-share * gain / p["inductance"], -1.69 / p["inductance"], u / p["inductance"]],
                [0.0, 0.0, 0.0],
            ]
        )
        state = scipy.linalg.expm(rates * period) @ state
        assert state[0].real > 0.0
        speeds.append(state[0])
        currents.append(state[1])
    return np.array(speeds), np.array(currents)


def test_windings_against_a_loop_in_plain_python(axebot):
    """By a complex step, to which no noise belongs; currents too."""
    robot = driven(
        axebot, kp=0.2, ki=1.0, name="windings", motor=axebot.motor.replace(electrical="dynamic", inductance=0.004)
    )
    names = {"kp": KP, "ki": KI, "inductance": "motor.inductance_H", "viscous": "friction.axes.viscous[0]"}
    names["coulomb"] = COULOMB
    values = {"kp": 0.2, "ki": 1.0, "inductance": 0.004, "viscous": 0.94, "coulomb": 2.2}
    command = held((60, [0, 20, -20]))
    found = derivatives(
        robot, dt=0.01, keys=list(names.values()), wheel_speed_command=command, twist=(0.1, 0.0, 0.0), tol=1e-9
    )
    speeds, currents = by_hand_with_inductance(values, 60, 0.01, 0.1, 20.0)
    np.testing.assert_allclose(found.run.twist[:, 0], speeds.real, atol=1e-8)
    np.testing.assert_allclose(found.run.current[:, 1], currents.real, atol=1e-6)
    for j, name in enumerate(names):
        true = by_hand_with_inductance({**values, name: values[name] + 1e-30j}, 60, 0.01, 0.1, 20.0)
        errors = [
            worst(own, one.imag / 1e-30)
            for own, one in zip((found.twist[:, 0, j], found.current[:, 1, j]), true, strict=True)
        ]
        print(f"by hand {names[name]:30} twist {errors[0]:.1e} current {errors[1]:.1e}")
        assert max(errors) <= AGREES


SET = held((40, [6, 14, -22]), (40, [-9, -20, 8]), (30, [0, 0, 0]), (40, [8, 0, -8]))
TWISTS = held((50, [0.4, -0.2, 1.5]), (50, [-0.3, 0.3, -2.0]), (40, [0.2, 0.0, 0.0]))


def check(robot, keys, width=1e-3, tol=1e-10, agrees=AGREES, **commands):
    """Against differences of whole runs, which must show the same events; currents too, at the ticks.

    The rows at which a voltage leaves its limit must be the same ones as well: there the integral has steps.
    """
    found = derivatives(robot, dt=0.01, keys=keys, tol=tol, **commands)
    assert found.run == simulate(robot, dt=0.01, tol=tol, **commands)
    errors = {}
    for j, key in enumerate(keys):
        true = differences(lambda r: simulate(r, dt=0.01, tol=tol, **commands), robot, key, width)
        pairs = zip((found.twist, found.pose, found.current), true, strict=True)
        errors[key] = [worst(own[..., j], expected) for own, expected in pairs]
        print(f"{robot.name:12} {key:34}", *(f"{e:.1e}" for e in errors[key]))
    assert max(max(e) for e in errors.values()) <= agrees, errors
    return found


def test_set_speeds_with_stops_reversals_and_saturation(axebot):
    robot = driven(axebot, kp=0.25, ki=0.8)
    keys = [KP, KI, LIMIT, *BODY, *MOTOR, "friction.axes.viscous[0]", COULOMB, "friction.axes.coulomb[2]"]
    found = check(robot, keys, wheel_speed_command=SET)
    assert (np.abs(found.run.voltage) == 6.0).any()
    assert (np.sign(found.run.twist[38]) * np.sign(found.run.twist[78]) < 0.0).any()


def test_set_twists_of_an_ellipse_robot_whose_ticks_are_not_its_rows(axebot):
    """Gains of one wheel alone; the wheel radius enters the set speeds, the loop and the drive; 7 ms ticks."""
    friction = Friction(
        direction=DirectionFriction(coulomb=(1.2, 0.8), viscous=0.5, yaw_coulomb=0.04, yaw_viscous=0.005),
        wheels=WheelFriction(coulomb=(0.3, 0.2, 0.25), viscous=0.1),
    )
    body = axebot.body.replace(rotating_frame=True)
    robot = driven(axebot, kp=0.15, rate=1.0 / 0.007, friction=friction, body=body, name="ellipse")
    keys = [KP, f"{KP}[1]", f"{KI}[2]", *BODY, "friction.direction.coulomb[0]", "friction.wheels.coulomb[2]"]
    check(robot, keys, twist_command=TWISTS[:90])


def test_dynamic_electrics(axebot):
    motor = axebot.motor.replace(electrical="dynamic", inductance=0.004)
    robot = driven(axebot, kp=0.3, ki=1.0, motor=motor, name="dynamic")
    # a quarter of this width leaves 1e-5 of noise in the difference; derivatives at 1e-9 and 1e-10 are 3e-8 apart
    check(robot, [KP, KI, "motor.inductance_H"], width=8e-3, tol=1e-9, twist_command=TWISTS[30:80])


def test_what_sticks_has_a_derivative_of_exactly_0_until_the_integral_moves_it(axebot):
    """Held at first; the integral grows until the robot is released. Its voltage knows gains and command alone."""
    robot = driven(axebot, kp=0.05, ki=0.5)
    keys = [KP, KI, COULOMB, "body.mass_kg"]
    found = check(robot, keys, wheel_speed_command=held((100, [0, 3, -3])))
    rest = found.run.twist[:, 0] == 0.0
    assert 20 < rest.sum() < 90
    assert (found.twist[rest] == 0.0).all()
    t = found.run.t[rest] + 0.01  # the tick at the start of a row counts
    np.testing.assert_allclose(found.current[rest, 1, :2], np.stack([3.0 + 0.0 * t, 3.0 * t], axis=1) / 1.69)
    assert (found.current[rest, :, 2:] == 0.0).all()


@pytest.mark.parametrize("tol", [0.0, 1e-6])
def test_a_settled_run_is_left_as_it_is(axebot, tol):
    """What stands still from tick to tick is not simulated again: the same numbers to 1e-9."""
    robot = driven(axebot, kp=0.5, ki=0.0, rate=1000.0)
    steps = held((60, [0, 9, -9]), (40, [5, -9, 4]))
    given = commands(robot, None, 0.02, None, steps, None, None)
    ready, start, rates = (
        prepared(robot, [KP, COULOMB, "body.mass_kg"]),
        (np.zeros(3), np.zeros(3)),
        np.zeros((3, 100, 3)),
    )
    whole, short = (differentiate(ready, given, rates, start, tol, settled) for settled in (0.0, 1e-12))
    for name in ("twist", "pose", "current"):
        np.testing.assert_allclose(getattr(short.run, name), getattr(whole.run, name), atol=1e-9)
        np.testing.assert_allclose(getattr(short, name), getattr(whole, name), atol=1e-9)


def test_the_rate_is_refused_by_name(axebot):
    with pytest.raises(UnsupportedError, match=r"no derivative by the rate.*drive\.rate_Hz.*ticks would move"):
        derivatives(driven(axebot), dt=0.01, keys=["drive.rate_Hz"], twist_command=[[0.1, 0.0, 0.0]])
