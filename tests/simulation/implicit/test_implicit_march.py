"""The implicit engine against truths it has no part in: 50 digits, DOP853 mode by mode, closed forms.

Sources: tests/reference/table_3.npz (50 digits), tests/reference/modes.npz and modes.py (mode by mode, 40 robots that
mix all options), the exponential of one axis.
"""

import time

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.layout import N_AXES, new_state
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.simulation.implicit.implicit_march import run_implicit
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.speed_loop import no_loop
from tests.reference.make import FILE as TABLE_3_FILE
from tests.reference.modes import reference
from tests.reference.modes_make import SEEDS, load
from tests.support.friction_shapes import AXEBOT, LEVELS, YAW, implicit, shaped
from tests.support.mixed_robots import random_robot, random_voltages
from tests.support.robots import TABLE_3, robot_of, table_3_voltages, with_breakaway

# --- adaptive ---------------------------------------------------------------------------------------------------------


def truth_of(seed):
    truth = load(seed)
    assert truth is not None, f"modes.npz has no truth for robot {seed}; run tests/reference/modes_make.py"
    return truth


def cost(robot, voltage, dt, tol):
    """What a run of the kernel takes, in words; it prices a solved step, of which an accepted one takes three."""
    numbers = plant(robot)
    bound = np.tile(numbers.element["limit"][N_AXES:], (len(voltage), 1))
    dt = np.broadcast_to(dt, len(voltage)).copy()
    begin = time.process_time()
    loop = no_loop(robot.wheels.count)
    run = run_implicit(numbers, voltage.copy(), bound, dt, new_state(numbers), np.zeros(3), loop, tol)
    steps = int(run.steps.sum())
    return f"{steps} steps, {(time.process_time() - begin) / steps * 1e6:.2f} us each"


def worst(run, truth):
    """Largest error of the twist, [m/s] or a tenth of [rad/s], whichever is larger."""
    return float((np.abs(run.twist - truth.twist) / [1.0, 1.0, 10.0]).max())


def test_a_row_cut_short_by_a_latency_does_not_cut_the_steps_after_it():
    """A latency of 13 us splits each row of 10 ms: one more step a row, not the way back from 13 us."""
    rows = 200
    volts = np.repeat(np.random.default_rng(0).uniform(-5.0, 5.0, (rows // 20, 3)), 20, axis=0)
    numbers, loop, solved = plant(shaped("ellipse")), no_loop(3), []
    for pieces in (np.array([0.01]), np.array([13e-6, 0.01 - 13e-6])):
        voltage, dt = np.repeat(volts, len(pieces), axis=0), np.tile(pieces, rows)
        bound = np.full(voltage.shape, np.inf)
        run = run_implicit(numbers, voltage, bound, dt, new_state(numbers), np.zeros(3), loop, 1e-6)
        solved.append(int(run.steps.sum()))
    assert solved[1] <= 1.2 * solved[0], solved


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.some(11)
def test_adaptive_against_the_modes(seed):
    """DOP853 mode by mode: <= 1e-6 m/s and 1e-5 rad/s at tol 1e-7; pose, currents and what rests beside it."""
    robot, truth = random_robot(seed), truth_of(seed)
    run = simulate(robot, *random_voltages(robot, seed), tol=1e-7)
    assert "implicit engine" in run.source
    assert not run.warnings
    print(f"robot {seed}: {cost(robot, *random_voltages(robot, seed), 1e-7)}; error {worst(run, truth):.1e} m/s")
    assert np.abs(run.twist[:, :2] - truth.twist[:, :2]).max() <= 1e-6
    assert np.abs(run.twist[:, 2] - truth.twist[:, 2]).max() <= 1e-5
    assert np.abs(run.pose - truth.pose).max() <= 1e-6
    np.testing.assert_array_equal(run.twist == 0.0, truth.stuck[:, :3])
    np.testing.assert_array_equal(run.wheel_speed == 0.0, truth.stuck[:, 4:])
    if robot.motor.electrical == "dynamic":
        assert np.abs(run.current - truth.current).max() <= 2e-5


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.some(11)
def test_the_error_follows_the_tolerance(seed):
    """`tol` is the global error [m/s], 10 tol [rad/s]."""
    robot, truth = random_robot(seed), truth_of(seed)
    voltage, dt = random_voltages(robot, seed)
    for tol in (1e-3, 1e-4, 1e-5, 1e-6):
        assert worst(simulate(robot, voltage, dt, tol=tol), truth) <= tol, tol


@pytest.mark.parametrize("seed", [15, 31])
def test_a_current_that_reverses_under_a_voltage_drop_is_no_floor(seed):
    """Where i passes 0 its slope jumps by 2 V_d/L; step doubling does not see it early in a step (DOP853 does)."""
    robot, truth = random_robot(seed), truth_of(seed)
    voltage, dt = random_voltages(robot, seed)
    assert robot.motor.electrical == "dynamic"
    assert np.all(robot.motor.voltage_drop)
    for tol in (1e-7, 1e-8):
        run = simulate(robot, voltage, dt, tol=tol)
        assert worst(run, truth) <= tol
        assert np.abs(run.current - truth.current).max() <= 100 * tol


def slow(**motor):
    """A robot with little friction, which forgets an error only by its motors."""
    friction = DirectionFriction(coulomb=(0.2, 0.15), viscous=0.01, yaw_coulomb=0.002)
    return shaped("axes", **motor).replace(friction=Friction(direction=friction))


FORGETFUL = {
    "150 kg, 15 s": slow().replace(body=AXEBOT.body.replace(mass=150.0, inertia=20.0, rotating_frame=True)),
    "at its current limit": slow(current_limit=0.01),
    "in the dead band of its drivers": slow(voltage_drop=2.0),
}


@pytest.mark.parametrize("name", FORGETFUL)
@pytest.mark.long
def test_the_error_follows_the_tolerance_however_long_a_robot_remembers(name):
    """DOP853: nothing but the local share of `tol` keeps errors from adding up where motors do not damp them."""
    robot, start = FORGETFUL[name], (1.0, 0.3, 5.0)
    voltage = np.tile([3.0, -3.0, 1.0] if name.startswith("150") else [0.0, 0.0, 0.0], (50, 1))
    dt = 2.0 if name.startswith("150") else 0.2
    truth = reference(robot, voltage, dt, twist=start)
    for tol in (1e-4, 1e-6, 1e-7):
        assert worst(simulate(robot, voltage, dt, tol=tol, twist=start), truth) <= tol, tol


def test_a_release_inside_a_row_is_found_at_every_tolerance():
    """Currents rise slowly and breakaway, above Coulomb, is met inside a row; judge: the exact engine.

    The error falls with tol, and a tenth of tol costs less than four times the steps (second order: 10^(1/2)).
    """
    friction = AxesFriction(viscous=LEVELS["viscous"], coulomb=(1.5, 1.0, 0.05), breakaway=LEVELS["coulomb"])
    motor = AXEBOT.motor.replace(electrical="dynamic", inductance=0.02)
    robot = AXEBOT.replace(motor=motor, friction=Friction(axes=friction))
    voltage = np.repeat([[1.0, 5.0, -3.0], [2.0, -4.0, 5.0], [0.0, 0.0, 0.0], [-3.0, 1.0, 4.0]], [20, 25, 15, 15], 0)
    exact, steps = simulate(robot, voltage, 0.01), []
    assert "exact engine" in exact.source
    general = robot.replace(motor=motor.replace(current_limit=1e4))
    for tol in (1e-5, 1e-6, 1e-7, 1e-8):
        assert worst(simulate(general, voltage, 0.01, tol=tol), exact) <= tol
        numbers = plant(general)
        bound, dt, pose = np.full(voltage.shape, np.inf), np.full(len(voltage), 0.01), np.zeros(3)
        outcome = run_implicit(numbers, voltage.copy(), bound, dt, new_state(numbers), pose, no_loop(3), tol)
        steps.append(int(outcome.steps.sum()))
        print(f"tol {tol:g}: {steps[-1]} steps")
    assert (np.diff(np.log(steps)) <= np.log(4.0)).all()


# --- fixed step -------------------------------------------------------------------------------------------------------


def work_item(ratio):
    """(robot, twist every 10 ms in 50 digits, what rests at every sample) of Table 3 over 10 s at 1 kHz."""
    with np.load(TABLE_3_FILE) as file:
        twist = file[f"twist_{ratio}"]
        rest = np.unpackbits(file[f"rest_{ratio}"], count=10_001 * 3).reshape(-1, 3).astype(bool)
    return implicit(robot_of(with_breakaway(TABLE_3, ratio))), twist, rest


def test_fixed_step_on_the_work_item():
    """50 digits: <= 1.6e-3 m/s and 1e-2 rad/s at 1 ms; bitwise 0.0 where the truth is at rest, and nowhere else.

    Where a rest of the truth is two rows old; a few samples of 10,000 at the very edge of breakaway may differ.
    """
    robot, twist, rest = work_item(1.0)
    run = simulate(robot, table_3_voltages(), 1e-3, tol=None)
    assert "fixed step" in run.source
    error = np.abs(run.twist[::10] - twist).max(axis=0)
    assert error[:2].max() <= 1.6e-3
    assert error[2] <= 1e-2
    inside = rest[2:] & rest[1:-1] & rest[:-2]
    assert inside.sum() > 5000
    assert (run.twist[2:][inside] != 0.0).sum() <= 5
    moving = ~(rest[2:] | rest[1:-1] | rest[:-2])
    assert moving.sum() > 20000
    assert (run.twist[1:-1][moving] == 0.0).sum() <= 40


@pytest.mark.parametrize("ratio", [1.0, 1.25, 1.5])
def test_adaptive_step_on_the_work_item(ratio):
    """50 digits: 10 s with hundreds of stops, to the tolerance, and every rest of the truth is a rest."""
    robot, twist, rest = work_item(ratio)
    run = simulate(robot, table_3_voltages(), 1e-3, tol=1e-6)
    assert (np.abs(run.twist[::10] - twist) / [1.0, 1.0, 10.0]).max() <= 1e-6
    assert ((run.twist == 0.0) == rest).all()


SMOOTH = {
    "rotating frame": (shaped("axes"), 4e-3),
    "ellipse": (shaped("ellipse"), 4e-3),
    "wheels": (shaped("wheels"), 4e-3),
    "all": (shaped("all"), 4e-3),
    "drop and gear": (shaped("wheels", voltage_drop=0.3, gear_efficiency=0.8), 1e-3),
    "dynamic": (shaped("ellipse", electrical="dynamic", inductance=0.03), 1e-3),
    "dynamic, drop and gear": (
        shaped("wheels", electrical="dynamic", inductance=0.03, voltage_drop=0.3, gear_efficiency=0.8),
        1e-3,
    ),
    "current limit": (shaped("ellipse", current_limit=1.0), 4e-3),
}
# (voltage, twist, current): every speed and every current keeps its sign, and a limited current its limit.
STEADY = ((4.0, 6.0, -4.0), (0.8, -0.25, 4.0), (1.0, 1.5, -1.5))


@pytest.mark.parametrize("name", SMOOTH)
def test_the_fixed_step_is_of_second_order_in_smooth_motion(name):
    """DOP853: errors at h, h/2, h/4, h/8 fall by 2^1.9 to 2^2.1 each. 0.16 s in which nothing stops or reverses."""
    robot, h = SMOOTH[name]
    voltage, twist, current = STEADY
    voltage = (0.3, 5.9, -5.9) if name == "current limit" else voltage
    twist = (0.3, -0.1, 1.0) if name == "current limit" else twist
    end = 40 * h
    truth = reference(robot, [voltage], [end], twist=twist, current=current)
    assert all(event[3] in ("top", "bottom") for event in truth.log)
    assert not (truth.log and name != "current limit")
    runs = [
        simulate(robot, np.tile(voltage, (40 * n, 1)), h / n, twist=twist, current=current, tol=None)
        for n in (1, 2, 4, 8)
    ]
    for part in (slice(0, 2), slice(2, 3)):
        errors = [np.abs(run.twist[-1] - truth.twist[-1])[part].max() for run in runs]
        order = np.log2(np.array(errors[:-1]) / errors[1:])
        assert ((order >= 1.9) & (order <= 2.1)).all(), (order, errors)
    path = [np.abs(run.pose[-1] - truth.pose[-1]).max() for run in runs]
    assert (np.log2(np.array(path[:-1]) / path[1:]) >= 1.9).all(), path


def test_the_closed_form_of_one_axis():
    """v = w (1 - e^(-a t)) of the paper's law, at both kinds of step; the other axes at bitwise 0.0."""
    robot = implicit(AXEBOT)
    k = (19.0 * 0.0059) ** 2 / (1.69 * 0.035**2)
    a = (1.5 * k + 0.94) / 1.5
    g = np.sqrt(3) * 3.0 * 19.0 * 0.0059 / (1.69 * 0.035) / 1.5
    for tol, bound in ((1e-8, 1e-8), (None, 2e-6)):
        run = simulate(robot, np.tile([0.0, 3.0, -3.0], (1000, 1)), 1e-3, tol=tol)
        exact = -(g - 2.2 / 1.5) / a * np.expm1(-a * run.t)
        assert np.abs(run.twist[:, 0] - exact).max() <= bound
        assert (run.twist[:, 1:] == 0.0).all()
        assert (run.wheel_speed[:, 0] == 0.0).all()


@pytest.mark.parametrize("dynamic", [False, True])
def test_it_stops_when_the_closed_form_says_so(dynamic):
    """A coasting disc: v falls by (C/B + v) e^(-B t/M) - C/B and is 0.0 from t* = M/B log(1 + B v/C) on."""
    robot = shaped("disc", **({"electrical": "dynamic", "inductance": 1e-3} if dynamic else {}))
    robot = robot.replace(drive=robot.drive.replace(kind="duty", supply=6.0, off="coast"))
    speed, rate = np.array([0.5, -0.3, 0.0]), 0.9 / 1.5
    size = np.hypot(*speed[:2])
    stop = np.log1p(0.9 * size / 2.0) / rate
    run = simulate(robot, duty=np.zeros((80, 3)), dt=0.01, twist=speed, tol=1e-7)
    expected = np.where(run.t < stop, (2.0 / 0.9 + size) * np.exp(-rate * run.t) - 2.0 / 0.9, 0.0)
    assert np.abs(run.twist[:, :2] - expected[:, None] * speed[:2] / size).max() <= 1e-7
    assert ((run.twist[:, 0] == 0.0) == (run.t >= stop)).all()
    assert ((run.twist[:, 1] == 0.0) == (run.t >= stop)).all()


@pytest.mark.parametrize("fixed", [False, True])
def test_breakaway_above_coulomb_catches_what_reverses(fixed):
    """The paper's axis, S = 1.5 C: driven back with C < |q| < S it must stop for good; judge: the exact engine."""
    axes = AXEBOT.friction.axes
    sticky = AXEBOT.replace(friction=Friction(axes=axes.replace(breakaway=tuple(1.5 * c for c in axes.coulomb))))
    random = np.random.default_rng(0)
    per_volt = np.sqrt(3) * 19.0 * 0.0059 / (1.69 * 0.035)
    for _ in range(100):
        u = 2.2 * random.uniform(1.02, 1.48) / per_volt
        n = 250 if fixed else 1
        voltage, start = np.tile([0.0, -u, u], (n, 1)), (random.uniform(0.01, 0.5), 0.0, 0.0)
        exact = simulate(sticky, voltage, 0.5 / n, twist=start)
        run = simulate(implicit(sticky), voltage, 0.5 / n, twist=start, tol=None if fixed else 1e-7)
        assert exact.twist[-1, 0] == 0.0
        assert run.twist[-1, 0] == 0.0
        assert np.abs(run.twist - exact.twist).max() <= (3e-3 if fixed else 1e-6)


def test_what_is_as_strong_as_its_hold_does_not_take_forever():
    """The drive comes to the hold of an ellipse that is nearly a line, and stays within rounding of it for a while.

    It gave way and stuck again in every step, the steps as short as they get: half a minute for 50 ms.
    """
    robot = load_robot("mecanum")
    motor = robot.motor.replace(electrical="dynamic", voltage_drop=0.5, current_limit=2.0)
    robot = robot.replace(motor=motor, friction=Friction(direction=DirectionFriction(coulomb=(9.0, 270e3), **YAW)))
    voltage = np.array([[5.92564202, -1.19735065, 0.57748773, 0.39531321]])
    numbers, bound = plant(robot), np.full((1, 4), 2.0)
    runs = [
        run_implicit(numbers, voltage, bound, np.array([0.05]), new_state(numbers), np.zeros(3), no_loop(4), tol)
        for tol in (1e-5, 1e-6)
    ]
    assert runs[0].steps[0] < 20_000
    assert np.abs(runs[0].state.x[1] - runs[1].state.x[1]).max() <= 1e-5
    assert runs[1].state.x[1, 0] < -2e-3, "it has given way"
