"""Replay: the same inputs give the same run; free runs; gaps; held inputs; a speed loop written by hand; refusals."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from omnidyn.comparison.replay import choose_input, held_inputs, replay
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.drive import Drive
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes
from tests.support.compared_logs import clean_log, coulomb_times, noisy

AXEBOT = load_robot("axebot")
SIMULATED = ("voltage", "current", "wheel_speed", "twist", "pose")


def only(run, *channels):
    return Run(t=run.t, **{name: getattr(run, name) for name in channels})


# --- the same inputs --------------------------------------------------------------------------------------------------


def test_the_true_robot_repeats_its_run():
    """At irregular times, from rest: to rounding, in every channel."""
    run = clean_log(AXEBOT, 1)
    found = replay(AXEBOT, run)
    assert found.pieces == (slice(0, len(run)),)
    assert (found.applied, str(found.driver), found.warnings) == ("voltage", "the logged voltage", ())
    for name in SIMULATED:
        np.testing.assert_allclose(getattr(found.run, name), getattr(run, name), rtol=0.0, atol=1e-9)


def test_it_starts_from_the_measured_twist_and_pose():
    run = clean_log(AXEBOT, 2, twist=(0.4, -0.3, 2.0), pose=(1.0, -2.0, 3.0))
    found = replay(AXEBOT, only(run, "voltage", "twist", "pose"))
    np.testing.assert_allclose(found.run.twist[0], [0.4, -0.3, 2.0], atol=0.05)
    np.testing.assert_allclose(found.run.pose[0], [1.0, -2.0, 3.0], atol=2e-3)
    np.testing.assert_allclose(found.run.twist[100:], run.twist[100:], atol=2e-4)


def test_a_free_run_is_never_set_back():
    """Wrong friction: position drifts on and on. With the measured speeds set to garbage after the start, it is the
    same run to the last bit: the model never saw them."""
    run = simulate(AXEBOT, [[0.0, 3.0, -3.0]] * 600, 0.01)
    wrong = coulomb_times(AXEBOT, 1.3)
    found = replay(wrong, run)
    off = np.abs(found.run.pose - run.pose)[:, 0]
    assert (np.diff(off[20:]) > 0.0).all()
    settled = simulate(wrong, [[0.0, 3.0, -3.0]] * 600, 0.01).twist[-1, 0] - run.twist[-1, 0]
    assert off[-1] - off[300] == pytest.approx(3.0 * abs(settled), rel=1e-3)
    blind = run.replace(
        **{
            name: np.where(np.arange(601)[:, None] < 10, getattr(run, name), 77.0)
            for name in ("twist", "wheel_speed", "pose", "current")
        }
    )
    for name in SIMULATED:
        np.testing.assert_array_equal(getattr(replay(wrong, blind).run, name), getattr(found.run, name))


# --- duty, supply -----------------------------------------------------------------------------------------------------

SAGGING = AXEBOT.replace(drive=Drive(kind="duty", supply=6.0))


def test_duty_times_the_logged_supply_else_the_nominal_one():
    duty, sag = np.tile([0.0, 0.6, -0.6], (200, 1)), np.linspace(5.5, 4.0, 200)
    run = simulate(SAGGING, duty=duty, dt=0.01, supply=sag)
    found = replay(SAGGING, only(run, "duty", "supply", "twist"))
    assert str(found.driver) == "the logged duty times the logged supply"
    np.testing.assert_allclose(found.run.twist, run.twist, atol=1e-12)
    nominal = replay(SAGGING, only(run, "duty", "twist"))
    assert nominal.driver.numbers["supply"] == 6.0
    np.testing.assert_allclose(nominal.run.twist, simulate(SAGGING, duty=duty, dt=0.01).twist, atol=1e-12)
    assert nominal.run.twist[-1, 0] > found.run.twist[-1, 0]
    with pytest.raises(InputError, match="a duty needs a supply"):
        replay(AXEBOT, only(run, "duty", "twist"))


def test_a_motor_that_coasts_is_replayed_by_its_duty():
    """At duty 0 it is open: its logged voltage of 0 would brake."""
    coasts = AXEBOT.replace(drive=Drive(kind="duty", supply=6.0, off="coast"))
    run = simulate(coasts, duty=np.repeat([[0.0, 0.6, -0.6], [0.0, 0.0, 0.0]], 60, axis=0), dt=0.01)
    found = replay(coasts, run)
    assert found.applied == "duty"
    np.testing.assert_allclose(found.run.twist, run.twist, atol=2e-6)
    assert np.abs(replay(coasts, run, apply="voltage").run.twist - run.twist).max() > 0.05


# --- gaps and missing inputs ------------------------------------------------------------------------------------------


def test_nothing_is_integrated_across_a_gap():
    """40 of 400 rows cut out: two free runs, the second from what was measured there, right from its first rows."""
    run = clean_log(AXEBOT, 3)
    kept = np.r_[0:150, 190:401]
    cut = Run(t=run.t[kept], **{name: getattr(run, name)[kept] for name in SIMULATED})
    found = replay(AXEBOT, cut)
    assert found.pieces == (slice(0, 150), slice(150, 361))
    assert codes(found.warnings) == ["restarts_at_gaps"]
    assert found.warnings[0].numbers == {"gaps": 1}
    np.testing.assert_allclose(found.run.twist[:150], run.twist[:150], atol=1e-9)
    assert np.abs(found.run.twist[150:160] - run.twist[190:200]).max() < 0.15
    np.testing.assert_allclose(found.run.twist[250:], run.twist[290:], atol=2e-4)
    # What the voltage would do in the gap does not matter: only its measured end does.
    assert np.isfinite(found.run.twist).all()


def test_an_input_that_is_missing_holds_and_then_ends_the_piece():
    run = simulate(AXEBOT, [[0.0, 3.0, -3.0]] * 300, 0.01)
    volts = run.voltage.copy()
    volts[50:60, 1] = np.nan  # 0.1 s: held
    volts[150:200] = np.nan  # 0.5 s: too long
    found = replay(AXEBOT, run.replace(voltage=volts))
    # row 149 holds to 1.5 s; 0.2 s later, at row 170, the piece ends
    assert found.pieces == (slice(0, 171), slice(200, 301))
    np.testing.assert_allclose(found.run.twist[:171], run.twist[:171], atol=1e-12)
    assert np.isnan(found.run.twist[171:200]).all()
    assert np.isfinite(found.run.twist[200:]).all()
    assert codes(found.warnings)[0] == "rows_not_replayed"
    assert found.warnings[0].numbers == {"left": 29, "rows": 301, "hold": 0.2}
    assert replay(AXEBOT, run.replace(voltage=volts), hold=1.0).pieces == (slice(0, 301),)
    assert replay(AXEBOT, run.replace(voltage=volts), hold=0.0).pieces == (
        slice(0, 51),
        slice(60, 151),
        slice(200, 301),
    )


def test_held_inputs_by_hand():
    nan, t = math.nan, np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    values = np.array([[nan, 1.0], [2.0, nan], [nan, nan], [nan, 4.0], [5.0, 5.0], [6.0, nan], [nan, nan]])
    filled, usable = held_inputs(t, values, 1.0)
    np.testing.assert_array_equal(filled, [[nan, 1], [2, 1], [2, 1], [2, 4], [5, 5], [6, 5], [6, 5]])
    np.testing.assert_array_equal(usable, [False, True, False, False, True, True, True])


def test_a_supply_may_be_missing_for_a_while_too():
    run = simulate(SAGGING, duty=[[0.0, 0.6, -0.6]] * 100, dt=0.01)
    supply = np.where(np.arange(101) % 10 == 0, 6.0, np.nan)
    held = replay(SAGGING, run.replace(supply=supply, voltage=None))
    np.testing.assert_allclose(held.run.twist, run.twist, atol=1e-12)
    blank = replay(SAGGING, run.replace(supply=np.full(101, np.nan), voltage=None))
    np.testing.assert_allclose(blank.run.twist, run.twist, atol=1e-12)


# --- the speed loop ---------------------------------------------------------------------------------------------------

AZIMUTH, RIM, OUT, MASS, INERTIA = np.radians([180.0, -60.0, 60.0]), 0.035, 0.1, 1.5, 0.025
VISCOUS, GEARED, OHM, LIMIT = np.array([0.94, 0.96, 0.01]), 19.0 * 0.0059, 1.69, 6.0
PUSH = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), np.full(3, OUT)])  # eqs (7)-(9): force of a wheel to the body


def loop_by_hand(t, commands, kp, ki, rate):
    """PI loops on three wheels and the body they share, without dry friction; the body by the exponential of its own
    3 x 3 matrix between ticks and rows. Twist and voltage at the times t; a row of commands counts from the first
    tick at or after it.
    """
    mass = np.diag([MASS, MASS, INERTIA])
    motor = GEARED / RIM  # N/A, and V s/m
    a = -np.linalg.solve(mass, motor**2 / OHM * PUSH @ PUSH.T + np.diag(VISCOUS))
    b = np.linalg.solve(mass, motor / OHM * PUSH)
    twist, total, volts, tick = np.zeros(3), np.zeros(3), np.zeros(3), 0
    twists, applied = [twist], []
    for k in range(len(t) - 1):
        now, first = t[k], True
        while now < t[k + 1] - 1e-12:
            if abs(now - tick / rate) < 1e-9:
                error = commands[k] - PUSH.T @ twist / RIM
                for w in range(3):
                    more = total[w] + ki * error[w] / rate
                    wanted = kp * error[w] + more
                    if abs(wanted) <= LIMIT or wanted * error[w] < 0.0:
                        total[w] = more
                    volts[w] = np.clip(kp * error[w] + total[w], -LIMIT, LIMIT)
                tick += 1
            if first:
                applied.append(volts.copy())
                first = False
            step = min(t[k + 1], tick / rate) - now
            whole = expm(np.block([[a, (b @ volts)[:, None]], [np.zeros((1, 4))]]) * step)
            twist = whole[:3, :3] @ twist + whole[:3, 3]
            now += step
        twists.append(twist)
    return np.array(twists), np.array(applied)


def random_steps(seed, rows, hold):
    random = np.random.default_rng(seed)
    return np.repeat(random.uniform(-25.0, 25.0, (rows // hold, 3)), hold, axis=0)


@pytest.mark.parametrize("kp, ki, rate", [(0.25, 0.0, 100.0), (0.25, 3.0, 100.0), (0.4, 1.0, 37.0), (0.05, 6.0, 250.0)])
def test_set_speeds_go_through_the_loop_of_the_robot_file(kp, ki, rate):
    """Three coupled wheels, random set points, irregular rows, saturating: against loops written by hand."""
    loss = Friction(axes=AxesFriction(viscous=tuple(VISCOUS), coulomb=(0.0, 0.0, 0.0)))
    robot = AXEBOT.replace(friction=loss, drive=Drive(kind="speed", kp=kp, ki=ki, rate=rate))
    t = np.concatenate([[0.0], np.cumsum(np.random.default_rng(1).uniform(0.005, 0.03, 240))])
    commands = random_steps(2, 240, 30)
    commands = np.vstack([commands, commands[-1]])
    twists, volts = loop_by_hand(t, commands, kp, ki, rate)
    assert (np.abs(volts) == LIMIT).any() == (kp >= 0.25)
    found = replay(robot, Run(t=t, wheel_speed_command=commands, twist=twists), tol=1e-9)
    assert found.applied == "wheel_speed_command"
    assert {"kp", "ki", "rate"} <= found.driver.numbers.keys()
    np.testing.assert_allclose(found.run.twist, twists, rtol=0.0, atol=3e-7)
    np.testing.assert_allclose(found.run.voltage[:-1], volts, rtol=0.0, atol=1e-5)
    body = Run(t=t, twist_command=np.linalg.solve(PUSH.T / RIM, commands.T).T, twist=twists)
    by_body = replay(robot, body, tol=1e-9)
    assert by_body.applied == "twist_command"
    np.testing.assert_allclose(by_body.run.twist, twists, rtol=0.0, atol=3e-7)


def test_what_a_log_does_not_tell_about_the_loop_is_said():
    robot = AXEBOT.replace(drive=Drive(kind="speed", kp=0.3, ki=2.0, rate=1000.0))
    run = simulate(robot, wheel_speed_command=random_steps(3, 200, 50), dt=0.01)
    kept = np.r_[0:80, 120:201]
    cut = Run(t=run.t[kept], wheel_speed_command=run.wheel_speed_command[kept], wheel_speed=run.wheel_speed[kept])
    integral = replay(robot, cut).warnings[-1]
    assert (integral.code, integral.numbers) == ("integral_not_logged", {"pieces": 1})
    by_voltage = replay(robot, run)
    assert by_voltage.applied == "voltage"
    assert by_voltage.warnings[-1].code == "loop_faster_than_log"
    assert by_voltage.warnings[-1].numbers == pytest.approx({"loop_period": 1e-3, "log_period": 0.01})
    assert replay(robot, run, apply="wheel_speed_command").applied == "wheel_speed_command"


# --- refusals ---------------------------------------------------------------------------------------------------------

SET = {"wheel_speed_command": np.ones((4, 3)), "wheel_speed": np.ones((4, 3))}


def log(n=4, **channels):
    return Run(t=np.arange(float(n)) * 0.01, source="log.csv", **channels)


@pytest.mark.parametrize(
    "run, words",
    [
        (log(voltage=np.ones((4, 4))), "log.csv: the log is of another robot; got voltage of 4 wheels; expected 3"),
        (log(voltage=np.ones((4, 1))), "a log of one motor cannot be compared with a robot.*motor bench"),
        (log(twist=np.ones((4, 3))), "the log has no input to replay; got twist; expected voltage or duty"),
        (log(voltage=np.full((4, 3), np.nan)), "the log has no input to replay"),
        (log(voltage=np.tile([1.0, np.nan, 1.0], (4, 1))), "u2 was not recorded; .*all 3 wheels"),
        (log(**SET), r'set speeds only, and the robot no speed loop.*kind = "voltage" of axebot.*add \[drive\]'),
        (log(twist_command=np.ones((4, 3))), "set speeds only"),
    ],
)
def test_a_log_that_does_not_fit_is_refused(run, words):
    with pytest.raises(InputError, match=words):
        replay(AXEBOT, run)


@pytest.mark.parametrize(
    "apply, words",
    [
        ("duty", "the log does not hold this input; got duty; expected voltage or wheel_speed_command"),
        ("wheel_speed", "no such input; got wheel_speed; .*did you mean wheel_speed_command"),
    ],
)
def test_an_input_that_is_not_there_is_refused(apply, words):
    run = log(voltage=np.ones((4, 3)), wheel_speed_command=np.ones((4, 3)))
    with pytest.raises(InputError, match=words):
        choose_input(AXEBOT, run, apply)


def test_nothing_to_replay_is_too_little_data():
    with pytest.raises(InsufficientDataError, match=r"nothing can be replayed.*expected 3 rows in a row"):
        replay(AXEBOT, log(2, voltage=np.ones((2, 3))))


def test_warnings_of_the_simulation_come_along():
    run = noisy(clean_log(AXEBOT, 4), 4)
    found = replay(AXEBOT, run.replace(voltage=2.0 * run.voltage))
    assert found.warnings[0].code == "clipped"
