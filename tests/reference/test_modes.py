"""The mode-by-mode reference against closed forms, convex programs, energy and a stepper that knows no
modes."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import linprog, minimize

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from tests.reference.modes import plant_of, reference
from tests.reference.modes_friction import Gauge, decide
from tests.reference.modes_make import CLOSE, FILE, RTOL, SEEDS, load
from tests.reference.modes_stepper import stepped
from tests.support.mixed_robots import PLACES, random_robot, random_voltages

TURNING_VOLTAGE = (1.5, 5.5, -2.5)


def with_friction(robot, **parts):
    return robot.replace(friction=Friction(**parts))


def axis_of(robot, voltage, axis):
    """(a, g, c) of v' = -a v + g - c sgn v along one axis of the paper's robot."""
    p = plant_of(robot)
    k = p.K[0] * p.E[0] / p.R[0] * (p.G[axis] @ p.G[axis])
    a = (k + p.viscous[axis, axis]) / p.mass[axis]
    return (
        a,
        p.G[axis] @ voltage * p.K[0] / p.R[0] / p.mass[axis],
        robot.friction.axes.coulomb[axis] / p.mass[axis],
    )


# --- closed forms ---


@pytest.mark.parametrize(
    "axis, voltage",
    [(0, (0.0, 3.0, -3.0)), (1, (-4.0, 2.0, 2.0)), (2, (1.5, 1.5, 1.5)), (0, (0.0, 0.7, -0.7))],
)
def test_one_axis_moves_as_the_exponential(axebot, axis, voltage):
    dt = np.array([1e-3, 0.02, 0.1, 0.3, 1.0])
    truth = reference(axebot, [voltage] * len(dt), dt)
    a, g, c = axis_of(axebot, np.array(voltage), axis)
    expected = np.zeros((len(dt) + 1, 3))
    expected[:, axis] = -(g - c) / a * np.expm1(-a * truth.t)
    np.testing.assert_allclose(truth.twist, expected, rtol=0, atol=1e-12)
    assert not truth.stuck[1:, axis].any()
    assert (truth.twist[:, [k for k in range(3) if k != axis]] == 0.0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_axis_stops_when_the_closed_form_says_so_and_stays(axebot, axis):
    a, _, c = axis_of(axebot, np.zeros(3), axis)
    start = np.eye(3)[axis] * 0.8
    stop = math.log1p(a * 0.8 / c) / a
    truth = reference(axebot, np.zeros((3, 3)), [stop * 0.9, stop * 0.1 + 1e-3, 60.0], twist=start)
    at = [event for event in truth.log if event[1] == "stops"]
    assert abs(at[0][0] - stop) < 1e-13
    assert truth.twist[1, axis] == pytest.approx((0.8 + c / a) * math.exp(-a * stop * 0.9) - c / a, abs=1e-13)
    assert (truth.twist[2:] == 0.0).all()
    assert truth.stuck[2:].all()
    assert (truth.pose[2] == truth.pose[3]).all()


def test_reversal_within_a_row(axebot):
    voltage = np.array([0.0, -3.0, 3.0])
    a, g, c = axis_of(axebot, voltage, 0)
    truth = reference(axebot, [voltage], 0.5, twist=(0.6, 0.0, 0.0))
    crossing = math.log1p(a * 0.6 / (c - g)) / a
    assert truth.twist[1, 0] == pytest.approx(-(g + c) / a * math.expm1(-a * (0.5 - crossing)), abs=1e-12)


def test_held_below_breakaway_and_released_above_it_at_coulomb(axebot):
    axes = axebot.friction.axes.replace(breakaway=(3.3, 1.5, 0.099))
    robot = with_friction(axebot, axes=axes)
    p = plant_of(robot)
    edge = 3.3 / (p.K[1] / p.R[1] * math.sqrt(3))
    held = reference(robot, [(0, edge * 0.999, -edge * 0.999)], 60.0)
    assert (held.twist == 0.0).all()
    assert (held.pose == 0.0).all()
    voltage = np.array([0, edge * 1.001, -edge * 1.001])
    moved = reference(robot, [voltage], 0.2)
    a, g, c = axis_of(robot, voltage, 0)
    assert moved.twist[1, 0] == pytest.approx(-(g - c) / a * math.expm1(-a * 0.2), abs=1e-12)


@pytest.mark.parametrize("turns, settled", [(False, (1.088, 0.0, 3.92)), (True, (0.875, -0.363, 3.92))])
def test_the_turning_example_of_the_evidence(axebot, turns, settled):
    robot = axebot.replace(body=axebot.body.replace(rotating_frame=turns))
    truth = reference(robot, [TURNING_VOLTAGE], 4.0)
    np.testing.assert_allclose(truth.twist[-1], settled, atol=6e-3)
    np.testing.assert_allclose(truth.twist[-1][:2], settled[:2], atol=6e-4)
    assert truth.stuck[-1, 1] != turns


def test_a_disc_on_one_axis_is_the_box(axebot):
    box = with_friction(axebot, axes=AxesFriction(viscous=(0.9, 0.9, 0.01), coulomb=(2.2, 2.2, 0.099)))
    disc = with_friction(
        axebot,
        direction=DirectionFriction(coulomb=(2.2, 2.2), viscous=0.9, yaw_coulomb=0.099, yaw_viscous=0.01),
    )
    for pattern in ((0, 1.0, -1.0), (-1.0, 0.5, 0.5)):
        voltage = np.outer([4.0, -3.0, 0.4, 0.0, 5.0, 0.2], pattern)
        one, other = reference(box, voltage, 0.11), reference(disc, voltage, 0.11)
        np.testing.assert_allclose(other.twist, one.twist, rtol=0, atol=1e-10)
        assert (other.stuck.all(axis=1) == one.stuck.all(axis=1)).all()


def test_wheel_1_sticks_where_only_the_others_drive(axebot):
    robot = with_friction(axebot, axes=axebot.friction.axes, wheels=WheelFriction(coulomb=0.4, viscous=0.1))
    robot = robot.replace(body=robot.body.replace(rotating_frame=True))
    truth = reference(robot, [(0.0, 2.0, -2.0)], 1.0)
    assert truth.stuck[1].tolist() == [False, True, True, False, True, False, False]
    assert (truth.twist[1, 1:] == 0.0).all()
    p = plant_of(robot)
    pull = math.sqrt(3) * (p.K[0] / p.R[0] * 2.0 - 0.4) - 2.2
    slope = (p.K[0] * p.E[0] / p.R[0] + 0.1) * 1.5 + 0.94
    assert truth.twist[1, 0] == pytest.approx(-pull / slope * math.expm1(-slope / 1.5), abs=1e-12)


@pytest.mark.parametrize("shape", ["box", "disc"])
def test_currents_that_rise_release_the_robot_and_follow_the_matrix_exponential(axebot, shape):
    robot = axebot.replace(motor=axebot.motor.replace(electrical="dynamic", inductance=5e-3))
    if shape == "disc":
        robot = with_friction(robot, direction=DirectionFriction(coulomb=(2.2, 2.2), viscous=0.94, yaw_coulomb=0.1))
    p, u = plant_of(robot), np.array([0.0, 2.0, -2.0])
    truth = reference(robot, [u], 0.05)
    drive, lag = math.sqrt(3) * p.K[0], p.R[0] / p.L[0]
    release = -math.log1p(-2.2 / drive * p.R[0] / 2.0) / lag
    assert truth.log[0][0] == pytest.approx(release, abs=1e-13)
    matrix = np.array(
        [
            [-0.94 / 1.5, drive / 1.5, -2.2 / 1.5],
            [-p.E[0] * math.sqrt(3) / 2 / p.L[0], -lag, 2.0 / p.L[0]],
            [0.0, 0.0, 0.0],
        ]
    )
    v, i, _ = expm(matrix * (0.05 - release)) @ [0.0, 2.2 / drive, 1.0]
    near = 1e-12 if shape == "box" else 1e-10
    assert truth.twist[1, 0] == pytest.approx(v, abs=near)
    np.testing.assert_allclose(truth.current[1], [0.0, i, -i], rtol=0, atol=10 * near)


def test_drop_efficiency_and_limit_in_steady_motion_and_coasting(axebot):
    motor = axebot.motor.replace(voltage_drop=0.3, gear_efficiency=0.8)
    robot = axebot.replace(motor=motor)
    truth = reference(robot, [(0.0, 4.0, -4.0)], 8.0)
    p, v = plant_of(robot), truth.twist[1, 0]
    s = v * math.sqrt(3) / 2
    assert truth.current[1, 1] == pytest.approx((4.0 - 0.3 - p.E[0] * s) / p.R[0], abs=1e-10)
    assert 0.8 * p.K[0] * truth.current[1, 1] * math.sqrt(3) == pytest.approx(2.2 + 0.94 * v, abs=1e-9)

    limited = axebot.replace(motor=axebot.motor.replace(current_limit=1.0))
    truth = reference(limited, [(0.0, 6.0, -6.0)] * 2, 0.05)
    v = -(math.sqrt(3) * p.K[0] - 2.2) / 0.94 * np.expm1(-0.94 / 1.5 * truth.t)
    np.testing.assert_allclose(truth.twist[:, 0], v, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(truth.current[1:], [[0.0, 1.0, -1.0]] * 2)

    rolling = reference(axebot, [(0.0, 6.0, -6.0)], 0.1, twist=(1.0, 0, 0), open_circuit=[(True, True, True)])
    assert rolling.twist[1, 0] == pytest.approx((1 + 2.2 / 0.94) * math.exp(-0.94 / 1.5 * 0.1) - 2.2 / 0.94, abs=1e-12)
    assert (rolling.current[1] == 0.0).all()


# --- what decides ---


@pytest.mark.parametrize("seed", range(12))
def test_the_gauge_of_segments_is_the_linear_program(seed):
    random = np.random.default_rng(seed)
    count = random.integers(1, 7)
    d = random.normal(size=(count, 3))
    if seed % 3 == 0:
        d[:, 2] = 0.0
    forward, backward = random.uniform(0.1, 2, count), random.uniform(0.1, 2, count)
    load = d.T @ random.normal(size=count)
    gauge = Gauge(d, None)(load[:, None], forward[:, None], backward[:, None])[0]
    # minimise t so that load = d^T rho, -t backward <= rho <= t forward
    matrix = np.vstack([np.hstack([np.eye(count), -forward[:, None]]), np.hstack([-np.eye(count), -backward[:, None]])])
    equal = np.hstack([d.T, np.zeros((3, 1))])
    bounds = [(None, None)] * count + [(0, None)]
    best = linprog(np.eye(count + 1)[-1], matrix, np.zeros(2 * count), equal, load, bounds)
    assert gauge == pytest.approx(best.fun, rel=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_the_gauge_with_an_ellipse_is_the_cone_program(seed):
    random = np.random.default_rng(100 + seed)
    flat = seed % 3 == 0
    d = np.eye(3)[: 1 + seed % 2] if flat else np.vstack([np.eye(3)[2], random.normal(size=(random.integers(0, 6), 3))])
    count = len(d)
    forward, backward, ellipse = (
        random.uniform(0.1, 2, count),
        random.uniform(0.1, 2, count),
        random.uniform(0.3, 2, 2),
    )
    load = random.normal(size=3) * ([1, 1, 0] if flat else [1, 1, 0.3])
    gauge = Gauge(d, ellipse)(load[:, None], forward[:, None], backward[:, None])[0]

    def rest(x):
        return (load - d.T @ x[:-1])[:2] / ellipse

    constraints = [
        {"type": "ineq", "fun": lambda x: x[-1] - np.sqrt(rest(x) @ rest(x) + 1e-16)},
        {"type": "ineq", "fun": lambda x: x[-1] * forward - x[:-1]},
        {"type": "ineq", "fun": lambda x: x[-1] * backward + x[:-1]},
    ]
    constraints += [] if flat else [{"type": "eq", "fun": lambda x: (load - d.T @ x[:-1])[2:]}]
    start, options = np.r_[np.zeros(count), 10.0], {"maxiter": 500, "ftol": 1e-12}
    start[0] = 0.0 if flat else load[2]
    best = minimize(lambda x: x[-1], start, constraints=constraints, method="SLSQP", options=options)
    assert best.status in (0, 8)  # 8: it can come no nearer
    assert gauge == pytest.approx(best.fun, rel=1e-5)


@pytest.mark.parametrize("seed", range(0, 40, 2))
def test_accelerations_from_rest_minimise_the_convex_function(seed):
    random = np.random.default_rng(seed)
    p = plant_of(random_robot(seed))
    some = frozenset(np.flatnonzero(random.random(len(p.direction)) < 0.7).tolist())
    flat = p.hold_ellipse is not None and bool(random.random() < 0.7)
    extra = np.zeros(len(p.direction))

    def cost(a, force):
        speed = p.direction @ a
        levels = np.where(speed > 0, p.hold[:, 0] * speed, -p.hold[:, 1] * speed)
        value = 0.5 * (p.mass * a) @ a - force @ a + levels[sorted(some)].sum()
        return value + (np.hypot(*(p.hold_ellipse * a[:2])) if flat else 0.0)

    for size in (0.3, 1.0, 3.0):
        force = random.normal(size=3) * [2.0, 2.0, 0.1] * size
        a = decide(p, force, some, flat, np.zeros(len(p.direction)), extra).acceleration
        least = cost(a, force)
        for scale in (1e-4, 1e-2, 1.0):
            for change in random.normal(size=(60, 3)) * scale:
                assert cost(a + change, force) >= least - 1e-13


# --- random robots ---


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 9, 10, 11, 13])
@pytest.mark.some(3)
def test_energy_is_accounted_for(seed):
    robot = random_robot(seed)
    voltage, dt = random_voltages(robot, seed)
    truth = reference(robot, voltage[:9], dt[:9], energy=True)
    assert np.abs(truth.energy).max() < 1e-11


def stored(seed):
    truth = load(seed)
    if truth is None:
        pytest.skip(f"no reference is stored for seed {seed}: python tests/reference/modes_make.py")
    return truth


@pytest.mark.parametrize("kind", range(len(PLACES)))
def test_the_stepper_without_modes_arrives_at_the_same_motion(kind):
    for seed in SEEDS[kind : kind + 7 * 2 : 7]:
        robot, truth = random_robot(seed), stored(seed)
        voltage, dt = random_voltages(robot, seed)
        rows = 15
        coarse, fine = (stepped(plant_of(robot), voltage[:rows], dt[:rows], h) for h in (4e-5, 5e-6))
        worst, better = (np.abs(run[0] - truth.twist[1 : rows + 1]).max() for run in (coarse, fine))
        assert better < 0.3 * worst, seed  # first order: an eighth
        assert better < 2e-4, seed
        assert np.abs(fine[1] - truth.pose[1 : rows + 1]).max() < 1e-4, seed
        assert ((np.abs(fine[0]) < 1e-9) == truth.stuck[1 : rows + 1, :3]).all(), seed


def test_stored_references_are_whole_small_and_not_ties():
    assert FILE.stat().st_size < 1e6
    for seed in SEEDS:
        truth = stored(seed)
        assert truth.margin > CLOSE, seed
        assert (truth.twist[truth.stuck[:, :3]] == 0.0).all(), seed
    with np.load(FILE) as file:
        spread = np.array([file[f"spread_{seed}"] for seed in SEEDS])
    assert spread[:, :3].max() < 1e-9
    assert spread[:, 4].max() < 1e-9


@pytest.mark.parametrize("seed", [0, 8, 16])
def test_a_stored_reference_is_what_the_reference_gives(seed):
    robot, truth = random_robot(seed), stored(seed)
    voltage, dt = random_voltages(robot, seed)
    again = reference(robot, voltage[:12], dt[:12], rtol=10 * RTOL)
    np.testing.assert_allclose(again.twist, truth.twist[:13], rtol=0, atol=1e-10)
    np.testing.assert_allclose(again.pose, truth.pose[:13], rtol=0, atol=1e-10)
    assert (again.stuck == truth.stuck[:13]).all()
