"""Duty, brake and coast, and the firmware's speed loop, against closed forms and a loop in plain Python."""

import math

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.drive import Drive
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.live import LiveRobot
from omnidyn.simulation.simulate import simulate

AXEBOT = load_robot("axebot")
PER_AMPERE = 19.0 * 0.0059 / 0.035  # N/A at the rim, and V s/m: K_t = K_v
MASS, INERTIA, RADIUS = 1.5, 0.025, 0.1
VISCOUS = (0.94, 0.96, 0.01)


def driven(friction=None, voltage_limit=6.0, **drive):
    """Table 3 with a drive; friction viscous only unless given, so that one axis is one linear equation."""
    loss = Friction(axes=AxesFriction(viscous=VISCOUS, coulomb=(0.0, 0.0, 0.0))) if friction is None else friction
    motor = AXEBOT.motor.replace(voltage_limit=voltage_limit)
    return AXEBOT.replace(friction=loss, motor=motor, drive=Drive(**drive))


# --- duty -------------------------------------------------------------------------------------------------------------


def test_duty_is_a_share_of_the_supply():
    """voltage = duty * supply, from the file, a number, or row by row; the same run as with those voltages."""
    duty = np.array([[0.5, -0.25, 0.1], [0.0, 0.7, -0.7], [-0.3, 0.2, 1.0]])
    robot = driven(kind="duty", supply=5.0)
    for supply, volts in ((None, 5.0), (4.0, 4.0), ([5.0, 4.0, 3.0], np.array([[5.0], [4.0], [3.0]]))):
        run = simulate(robot, duty=duty, dt=0.1, supply=supply)
        same = simulate(robot, duty * volts, 0.1)
        np.testing.assert_array_equal(run.voltage, same.voltage)
        np.testing.assert_array_equal(run.twist, same.twist)
        np.testing.assert_array_equal(run.duty, duty[[0, 1, 2, 2]])
        np.testing.assert_array_equal(run.supply, np.broadcast_to(np.ravel(volts), 3)[[0, 1, 2, 2]])
        assert not run.warnings


def test_clipping_is_reported():
    """Duties beyond 1 and voltages beyond the motor's limit are clipped, each with a count and the first row."""
    run = simulate(driven(kind="duty", supply=8.0), duty=[[0.5, 0.0, 0.0], [0.9, 0.0, 0.0], [-1.5, 0.0, 0.0]], dt=0.01)
    np.testing.assert_array_equal(run.voltage[:, 0], [4.0, 6.0, -6.0, -6.0])
    np.testing.assert_array_equal(run.duty[:, 0], [0.5, 0.9, -1.0, -1.0])
    assert [(each.code, each.subject) for each in run.warnings] == [("clipped", "duty"), ("clipped", "voltage")]
    assert [[*each.numbers.values()] for each in run.warnings] == [[1, 3, 2], [2, 3, 1]]
    run = simulate(driven(), [[7.0, 0.0, 0.0]], 0.01)
    assert [[*each.numbers.values()] for each in run.warnings] == [[1, 1, 0]]


@pytest.mark.parametrize("axis, damping, inertia", [(0, 1.5, MASS), (1, 1.5, MASS), (2, 3 * RADIUS**2, INERTIA)])
def test_brake_and_coast_at_zero(axis, damping, inertia):
    """Braking: v e^(-(k + B) t/M), k = K^2/R per wheel. Coasting: no current, v e^(-B t/M); viscous only."""
    start = np.eye(3)[axis]
    for off in ("brake", "coast"):
        robot = driven(kind="duty", supply=6.0, off=off)
        run = simulate(robot, duty=np.zeros((50, 3)), dt=0.02, twist=start, tol=1e-8)
        rate = (VISCOUS[axis] + (damping * PER_AMPERE**2 / 1.69 if off == "brake" else 0.0)) / inertia
        np.testing.assert_allclose(run.twist[:, axis], np.exp(-rate * run.t), rtol=0.0, atol=2e-7)
        assert (np.delete(run.twist, axis, axis=1) == 0.0).all()
        assert (run.current == 0.0).all() == (off == "coast")


@pytest.mark.parametrize("tol", [1e-8, None])
@pytest.mark.parametrize("axis, start, inertia", [(0, 0.4, MASS), (1, -0.3, MASS), (2, 3.0, INERTIA)])
def test_coasting_against_dry_friction(axis, start, inertia, tol):
    """v = (v0 + C/B) e^(-B t/M) - C/B until t* = M/B log(1 + B v0/C), then bitwise 0.0: friction alone."""
    robot = driven(AXEBOT.friction, kind="duty", supply=6.0, off="coast")
    run = simulate(robot, duty=np.zeros((800, 3)), dt=1e-3, twist=start * np.eye(3)[axis], tol=tol)
    B, C = AXEBOT.friction.axes.viscous[axis], AXEBOT.friction.axes.coulomb[axis]
    stop = inertia / B * math.log1p(B * abs(start) / C)
    size = np.where(run.t < stop, (abs(start) + C / B) * np.exp(-B / inertia * run.t) - C / B, 0.0)
    error = np.abs(run.twist[:, axis] - np.sign(start) * size).max()
    assert error <= (1e-7 if tol else 4e-3) * max(1.0, abs(start))
    assert (run.twist[run.t > stop + 2e-3] == 0.0).all()
    assert (run.current == 0.0).all()


def test_only_the_motor_at_zero_coasts():
    """One motor open, two driven: the open one carries no current though its wheel turns; coasting needs duty 0."""
    robot = driven(AXEBOT.friction, kind="duty", supply=6.0, off="coast")
    run = simulate(robot, duty=np.tile([0.0, 0.8, 0.3], (100, 1)), dt=1e-3)
    assert (run.current[:, 0] == 0.0).all()
    assert np.abs(run.wheel_speed[-1, 0]) > 1.0
    assert (np.abs(run.current[1:, 1:]) > 0.1).all()


# --- the speed loop ---------------------------------------------------------------------------------------------------


def by_hand(command, rows, dt, rate, kp, ki, limit, axis, friction=0.0):
    """A PI loop on one axis of the viscous robot, the motion between ticks by its exponential. command(t) [rad/s].

    At each tick: e = command - speed; u = clip(kp e + sum); the sum takes ki e/rate unless u saturates and e pushes on.
    All wheels that turn do so alike but for a factor, so one wheel and one axis tell all. Returns speeds and voltages.
    """
    share = {0: math.sqrt(3) / 2, 1: 0.5, 2: RADIUS}[axis]  # rim speed of wheel 2 per twist
    count = {0: 2 * 0.75, 1: 1.5, 2: 3 * RADIUS**2}[axis]  # sum of squares of shares over the wheels
    inertia = (MASS, MASS, INERTIA)[axis]
    a = (count * PER_AMPERE**2 / 1.69 + VISCOUS[axis]) / inertia
    gain = count / share * PER_AMPERE / 1.69 / inertia
    v, total, u, t, tick, speeds, voltages = 0.0, 0.0, 0.0, 0.0, 0, [0.0], []
    for k in range(rows):
        end, first = (k + 1) * dt, True
        while t < end - 1e-12:
            if abs(t - tick / rate) < 1e-9:
                e = command(k) - share * v / 0.035
                more = total + ki * e / rate
                if abs(kp * e + more) <= limit or (kp * e + more) * e < 0.0:
                    total = more
                u = max(-limit, min(limit, kp * e + total))
                tick += 1
            if first:
                voltages.append(u)
                first = False
            step = min(end, tick / rate) - t
            v = v * math.exp(-a * step) - gain * u / a * math.expm1(-a * step)
            t += step
        speeds.append(v)
    return np.array(speeds), np.array(voltages)


PATTERN = np.array([[0.0, 1.0, -1.0], [-2.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
# (rows, dt, rate): ticks on the rows, many to a row, one to many rows, and never together but by chance.
GRIDS = [(200, 0.01, 100.0), (60, 0.03, 400.0), (600, 0.002, 50.0), (150, 0.007, 130.0)]


@pytest.mark.parametrize("rows, dt, rate", GRIDS)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_speed_loop_is_the_loop_by_hand(axis, rows, dt, rate):
    """PI on one axis, saturating first: speeds, voltages, set points against the plain loop; it ends at the command."""
    robot = driven(kind="speed", kp=0.3, ki=2.0, rate=rate)
    target = 8.0

    def command(k):
        return target if k < rows // 2 else -0.5 * target

    commands = np.array([command(k) for k in range(rows)])[:, None] * PATTERN[axis]
    run = simulate(robot, wheel_speed_command=commands, dt=dt, tol=1e-9)
    speeds, voltages = by_hand(command, rows, dt, rate, 0.3, 2.0, 6.0 / np.abs(PATTERN[axis]).max(), axis)
    if axis != 1:  # wheel 1 asks for twice as much on y and saturates by itself
        np.testing.assert_allclose(run.twist[:, axis], speeds, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(run.voltage[:-1, 1], voltages, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(run.voltage[:-1, 2], voltages * PATTERN[axis, 2], rtol=0.0, atol=1e-6)
    np.testing.assert_array_equal(run.wheel_speed_command[:-1], commands)
    assert np.abs(run.wheel_speed[-1, 1] + 0.5 * target) < 0.8
    assert run.t[-1] == pytest.approx(rows * dt)


def test_the_y_axis_without_saturation():
    """Where no wheel saturates, wheel 1 at twice the speed of the others keeps the axes apart."""
    robot = driven(kind="speed", kp=0.05, ki=1.0, rate=100.0)
    run = simulate(robot, wheel_speed_command=np.tile(2.0 * PATTERN[1], (200, 1)), dt=0.01, tol=1e-9)
    speeds, voltages = by_hand(lambda k: 2.0, 200, 0.01, 100.0, 0.05, 1.0, 6.0, 1)
    np.testing.assert_allclose(run.twist[:, 1], speeds, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(run.voltage[:-1, 0], -2.0 * voltages, rtol=0.0, atol=1e-6)
    assert np.abs(run.voltage).max() < 6.0


def test_saturation_does_not_wind_up():
    """3 s at a command out of reach, then one within: the loop with its sum stopped leaves the limit at once."""
    robot = driven(kind="speed", kp=0.3, ki=2.0, rate=100.0)
    rows = np.repeat([200.0, 10.0], [300, 100])[:, None] * PATTERN[0]
    run = simulate(robot, wheel_speed_command=rows, dt=0.01, tol=1e-8)
    assert (run.voltage[1:300, 1] == 6.0).all()
    assert run.voltage[300, 1] < 0.0
    assert (np.abs(run.voltage[310:, 1]) < 6.0).all()
    assert np.abs(run.wheel_speed[-1, 1] - 10.0) < 0.2
    by, _ = by_hand(lambda k: 200.0 if k < 300 else 10.0, 400, 0.01, 100.0, 0.3, 2.0, 6.0, 0)
    np.testing.assert_allclose(run.twist[:, 0], by, rtol=0.0, atol=1e-7)


def test_a_command_counts_from_the_first_tick_at_or_after_it():
    """10 Hz loop, P only: a step at 0.13 s is seen at 0.2 s; until then the voltage of the tick before holds."""
    robot = driven(kind="speed", kp=0.5, rate=10.0)
    rows = np.where(np.arange(40) < 13, 0.0, 6.0)[:, None] * PATTERN[2]
    run = simulate(robot, wheel_speed_command=rows, dt=0.01, tol=1e-8)
    assert (run.twist[:21] == 0.0).all()
    assert (run.voltage[:20] == 0.0).all()
    np.testing.assert_array_equal(run.voltage[20:30], np.full((10, 3), 3.0))
    assert (run.voltage[30] < 3.0).all()


def test_a_stuck_wheel_is_at_rest_for_the_loop_too():
    """Inside the dead zone: u = kp e, no motion at all, and the integral breaks away in the end."""
    robot = driven(AXEBOT.friction, kind="speed", kp=0.01, rate=100.0)
    run = simulate(robot, wheel_speed_command=np.tile(5.0 * PATTERN[0], (300, 1)), dt=0.01)
    assert (run.twist == 0.0).all()
    np.testing.assert_array_equal(run.voltage, np.tile(0.05 * PATTERN[0], (301, 1)))
    robot = driven(AXEBOT.friction, kind="speed", kp=0.01, ki=0.1, rate=100.0)
    run = simulate(robot, wheel_speed_command=np.tile(5.0 * PATTERN[0], (300, 1)), dt=0.01)
    breaks = 2.2 / (math.sqrt(3) * PER_AMPERE / 1.69)  # u = 0.05 + 0.5 t reaches it at tick n = 100 (u - 0.05)/0.5
    n = math.floor(100 * (breaks - 0.05) / 0.5)
    assert (run.twist[: n + 1] == 0.0).all()
    assert run.twist[n + 1, 0] > 0.0 or run.twist[n, 0] == 0.0
    assert (run.twist[n + 3 :, 0] > 0.0).all()


def test_twist_command_is_a_command_of_all_wheels():
    """G^T twist/r by hand for the paper's robot; x, y and yaw settle where they were asked to."""
    robot = driven(kind="speed", kp=0.3, ki=3.0, rate=200.0)
    asked = np.tile([0.3, -0.2, 1.0], (400, 1))
    run = simulate(robot, twist_command=asked, dt=0.01)
    half, root = 0.5, math.sqrt(3) / 2
    by_wheel = np.array([0.2 + 0.1, root * 0.3 + half * -0.2 + 0.1, -root * 0.3 + half * -0.2 + 0.1]) / 0.035
    np.testing.assert_allclose(run.wheel_speed_command, np.tile(by_wheel, (401, 1)), rtol=1e-14)
    np.testing.assert_array_equal(run.twist_command, asked[[*range(400), 399]])
    np.testing.assert_allclose(run.twist[-1], asked[0], rtol=0.0, atol=2e-3)
    same = simulate(robot, wheel_speed_command=run.wheel_speed_command[:-1], dt=0.01)
    np.testing.assert_array_equal(same.twist, run.twist)
    assert same.twist_command is None


@pytest.mark.parametrize(
    "drive, given, words",
    [
        ({}, {}, "cannot tell what to apply.*no command"),
        ({}, {"voltage": [[1.0] * 3], "duty": [[0.1] * 3]}, "cannot tell what to apply.*voltage and duty"),
        ({}, {"wheel_speed_command": [[1.0] * 3]}, 'takes no wheel_speed_command.*kind = "speed"'),
        ({}, {"twist_command": [[1.0] * 3]}, "takes no twist_command"),
        ({"kind": "duty"}, {"duty": [[0.1] * 3]}, "a duty needs a supply"),
        ({"kind": "duty"}, {"duty": [[0.1] * 3], "supply": -1.0}, "cannot use this supply"),
        ({"kind": "duty"}, {"duty": [[0.1] * 3], "supply": [5.0, 5.0]}, "cannot use this supply"),
        ({"kind": "duty", "supply": 5.0}, {"duty": [[0.1, np.nan, 0.0]]}, "duty row 0: not a finite number"),
        ({"kind": "duty", "supply": 5.0}, {"duty": [[0.1, 0.0]]}, r"wrong shape.*\(n, 3\)"),
        ({"kind": "speed", "kp": 1.0, "rate": 10.0}, {"twist_command": [[0.1, 0.0]]}, r"wrong shape.*\(n, 3\)"),
    ],
)
def test_what_is_refused(drive, given, words):
    with pytest.raises(InputError, match=f"(?s){words}"):
        simulate(driven(**drive), dt=0.01, **given)


def set_speeds(rows, held):
    """A set speed that changes every `held` rows, shape (rows, 3) [rad/s]."""
    levels = np.random.default_rng(0).uniform(-9.0, 9.0, (-(-rows // held), 3))
    return levels.repeat(held, axis=0)[:rows]


def test_a_command_meets_its_tick_in_a_long_run_too():
    """A hundred ticks a second for a minute: rows of 1 ms and rows of 10 ms are the same motion, whole or in parts.

    Times that are sums of 1 ms are wrong by more than 1e-11 s after 27 s, and a command then was a tick late."""
    robot = driven(kind="speed", kp=0.4, ki=1.0, rate=100.0)
    command = set_speeds(6000, 50)
    coarse = simulate(robot, dt=0.01, wheel_speed_command=command)
    fine = simulate(robot, dt=0.001, wheel_speed_command=command.repeat(10, axis=0))
    np.testing.assert_allclose(fine.twist[::10], coarse.twist, rtol=0.0, atol=1e-5)
    live = LiveRobot(robot, 0.001)
    for first in range(0, 60_000, 1234):
        part = slice(first, min(first + 1234, 60_000))
        live.run(command.repeat(10, axis=0)[part])
        np.testing.assert_allclose(live.twist, fine.twist[part.stop], rtol=0.0, atol=1e-6)


def test_times_of_six_decimals_meet_the_ticks():
    """Rows of a thirtieth of a second, rounded as logs round them, in a loop of 30 Hz."""
    robot = driven(kind="speed", kp=0.4, ki=1.0, rate=30.0)
    command, times = set_speeds(300, 7), np.arange(301) / 30.0
    exact = simulate(robot, dt=np.diff(times), wheel_speed_command=command)
    rounded = simulate(robot, dt=np.diff(np.round(times, 6)), wheel_speed_command=command)
    np.testing.assert_allclose(rounded.twist, exact.twist, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("drive", [{"kp": 1.0}, {"rate": 100.0}, {"ki": 1.0}])
def test_a_speed_loop_must_be_complete(drive):
    with pytest.raises(InputError, match="rate_Hz and kp_V_s_rad or ki_V_rad"):
        Drive(kind="speed", **drive)
