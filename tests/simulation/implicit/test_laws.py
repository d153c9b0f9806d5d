"""Laws beyond Coulomb's in the implicit engine, against integrators that share nothing with it, and in their limits."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from omnidyn.errors import UnsupportedError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.simulation.implicit.implicit_march import run_implicit
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.speed_loop import no_loop
from tests.reference import bristles
from tests.reference.modes import reference
from tests.reference.modes_plant import plant_of
from tests.support.events import meet_events, of_error
from tests.support.mixed_robots import random_robot, random_voltages, with_bristles, with_stribeck

AXEBOT = load_robot("axebot")
VISCOUS, COULOMB, BREAKAWAY = (0.94, 0.96, 0.01), (2.2, 1.5, 0.099), (2.8, 1.9, 0.13)
FALL = (0.02, 0.02, 0.2)
EAGER = range(1, 40, 2)  # robots with breakaway above coulomb


def axes(**numbers):
    return AXEBOT.replace(friction=Friction(axes=AxesFriction(viscous=VISCOUS, coulomb=COULOMB, **numbers)))


def program(rows, scale, seed=0):
    """Levels drawn anew every 20 rows, some of them too small to move anything."""
    random = np.random.default_rng(seed)
    levels = random.uniform(-scale, scale, (-(-rows // 20), 3)) * random.choice([0.1, 0.5, 1.0], (-(-rows // 20), 1))
    return np.repeat(levels, 20, axis=0)[:rows]


# --- against other integrators ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", EAGER)
@pytest.mark.some(6)
def test_what_falls_with_the_speed_against_events(seed):
    """Twenty robots, everything mixed: within tol [m/s], 10 tol [rad/s], and at rest in the same rows."""
    meet_events(with_stribeck(random_robot(seed), seed), seed)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.some(6)
def test_what_bends_against_its_differential_equation(seed):
    """Dahl and LuGre on axes, direction and wheels, twenty robots: within tol [m/s], 10 tol [rad/s]."""
    robot = with_bristles(random_robot(seed), seed)
    voltage, dt = (part[:6] for part in random_voltages(robot, seed))
    twist, pose = bristles.reference(robot, voltage, dt)
    for tol in (1e-5, 1e-7):
        run = simulate(robot, voltage, dt, tol=tol)
        assert of_error(run, twist) <= tol
        assert np.abs(run.pose - pose).max() <= tol
        assert not run.warnings


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_every_exponent_against_events(exponent):
    robot = axes(breakaway=BREAKAWAY, stribeck_speed=(0.03, 0.02, 0.3), stribeck_exponent=exponent)
    voltage = program(80, 4.0, seed=3)[::20]
    truth = reference(robot, voltage, 0.06)
    assert of_error(simulate(robot, voltage, 0.06, tol=1e-7), truth.twist) <= 1e-7


def test_forward_unlike_backward_against_events():
    robot = axes(coulomb_backward=(1.1, 2.0, 0.05), breakaway_backward=(1.3, 2.2, 0.06))
    voltage = program(160, 4.0, seed=4)[::20]
    truth = reference(robot, voltage, 0.06)
    run = simulate(robot, voltage, 0.06, tol=1e-7)
    assert of_error(run, truth.twist) <= 1e-7
    assert ((run.twist == 0.0) == truth.stuck[:, :3]).all()
    assert "implicit" in run.source


KEYS = [f"friction.axes.{name}[{axis}]" for name in ("coulomb", "breakaway", "stribeck_speed") for axis in (0, 2)]


def test_derivatives_by_what_a_fall_takes():
    """Against differences of two runs: Stribeck speed and exponent, levels at rest and sliding, and the mass."""
    robot = axes(breakaway=BREAKAWAY, stribeck_speed=(0.05, 0.05, 0.3))
    keys, voltage = [*KEYS, "friction.axes.stribeck_exponent", "body.mass_kg"], program(80, 4.0, seed=3)[::7]
    found = derivatives(robot, voltage, 0.02, keys, tol=1e-7)
    for k, key in enumerate(map(Key.parse, keys)):
        value = key.get(robot)
        up, down = (
            simulate(key.set(robot, value * (1.0 + side)), voltage, 0.02, tol=1e-8).twist for side in (1e-3, -1e-3)
        )
        differences = (up - down) / (2e-3 * value)
        assert np.abs(found.twist[:, :, k] - differences).max() <= 1e-4 * np.abs(differences).max() + 1e-6


def test_karnopps_band_has_no_derivatives_and_it_says_what_to_do():
    with pytest.raises(UnsupportedError, match=r"no derivatives of a run.*take law = \"coulomb\""):
        derivatives(axes(law="karnopp"), np.ones((3, 3)), 0.01, ["friction.axes.coulomb[0]"])


# --- limits -----------------------------------------------------------------------------------------------------------


def test_stribeck_without_a_fall_is_coulomb_to_the_last_bit():
    """Breakaway = coulomb, or none: no level falls, the same engine runs and every bit is the same."""
    plain, voltage = axes(), program(400, 4.0)
    for breakaway in (None, COULOMB):
        falls = axes(breakaway=breakaway, stribeck_speed=(0.02, 0.02, 0.2), stribeck_exponent=1.3)
        one, two = simulate(plain, voltage, 2e-3), simulate(falls, voltage, 2e-3)
        np.testing.assert_array_equal(one.twist, two.twist)
        np.testing.assert_array_equal(one.pose, two.pose)
        assert one.source == two.source


@pytest.mark.parametrize("place", ["direction", "wheels"])
def test_so_it_is_elsewhere(place):
    law = {"direction": DirectionFriction(coulomb=(2.2, 1.8), yaw_coulomb=0.1), "wheels": WheelFriction(coulomb=0.7)}
    falls = {
        "direction": law["direction"].replace(stribeck_speed=0.02, yaw_stribeck_speed=0.2),
        "wheels": law["wheels"].replace(stribeck_speed=0.02),
    }
    voltage = program(200, 4.0)
    runs = [simulate(AXEBOT.replace(friction=Friction(**{place: each[place]})), voltage, 2e-3) for each in (law, falls)]
    np.testing.assert_array_equal(runs[0].twist, runs[1].twist)


@pytest.mark.parametrize("falls", [False, True])
def test_lugre_becomes_coulomb_or_stribeck_as_it_stiffens(falls):
    """Its error stays below S/sqrt(sigma0 M), the speed of a body with the energy of a bent bristle."""
    more = {"breakaway": BREAKAWAY, "stribeck_speed": (0.03, 0.03, 0.3)} if falls else {}
    voltage, errors = program(100, 4.0, seed=1), []
    rigid = simulate(axes(**more), voltage, 4e-3, tol=1e-6)
    for stiff in (1e4, 1e5, 1e6, 1e7):
        robot = axes(law="lugre", stiffness=(stiff, stiff, 1e-2 * stiff), **more)
        errors.append(np.abs(simulate(robot, voltage, 4e-3, tol=1e-5).twist - rigid.twist)[:, :2].max())
        assert errors[-1] <= robot.friction.axes.levels[2][0] / math.sqrt(stiff * robot.body.mass)
    assert (np.diff(np.log10(errors)) < -0.4).all()


def test_a_stiff_bristle_takes_one_step_a_row_all_the_same():
    """1e9 N/m in steps of 5 ms: stable, no cap is met, and it holds within its bend."""
    robot = axes(law="lugre", stiffness=(1e9, 1e9, 1e7))
    voltage = program(200, 4.0)
    run = simulate(robot, voltage, 5e-3, tol=None)
    rigid = simulate(axes(), voltage, 5e-3)
    assert not run.warnings
    assert np.abs(run.twist - rigid.twist)[:, :2].max() <= 0.02


def test_rows_are_cut_where_friction_falls_too_fast_for_one_step():
    """A stage has one solution as long as friction falls by less than the inertia of the step: rows are cut for it."""
    robot = axes(breakaway=BREAKAWAY, stribeck_speed=(1e-3, 1e-3, 1e-2))
    voltage = program(40, 4.0)
    fixed, fine = simulate(robot, voltage, 20e-3, tol=None), simulate(robot, voltage, 20e-3, tol=1e-7)
    assert not fixed.warnings
    assert of_error(fixed, fine.twist) <= 5e-3
    np.testing.assert_array_equal((fixed.twist == 0.0)[:5], (fine.twist == 0.0)[:5])


# --- what the laws are known for --------------------------------------------------------------------------------------


def test_held_below_breakaway_to_the_last_bit_for_a_minute():
    """What has no bristle holds exactly."""
    robot = axes(breakaway=BREAKAWAY, stribeck_speed=(0.02, 0.02, 0.2))
    edge = BREAKAWAY[0] / (math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69)
    run = simulate(robot, np.tile([0.0, 0.999 * edge, -0.999 * edge], (600, 1)), 0.1)
    assert (run.twist == 0.0).all()
    assert (run.pose == 0.0).all()
    moves = simulate(robot, np.tile([0.0, 1.2 * edge, -1.2 * edge], (20, 1)), 0.1)
    assert moves.twist[-1, 0] > 0.1


@pytest.mark.parametrize("law", ["dahl", "lugre", "stribeck"])
def test_friction_never_gives_energy_along_random_motion(law):
    """Without voltage, kinetic energy and what bristles store never rise. LuGre: with a damping that fades, Olsson."""
    if law == "stribeck":
        robot = axes(breakaway=BREAKAWAY, stribeck_speed=(0.05, 0.05, 0.5))
    elif law == "dahl":
        robot = axes(law="dahl", stiffness=(1e4, 1e4, 1e2), dahl_exponent=1.5)
    else:
        robot = axes(law="lugre", stiffness=(1e4, 1e4, 1e2), damping=(50.0, 50.0, 0.5), damping_speed=(0.02, 0.02, 0.2))
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    for start in np.random.default_rng(5).normal(size=(6, 3)) * [0.4, 0.4, 3.0]:
        run = simulate(robot, np.zeros((250, 3)), 2e-3, twist=start, tol=1e-7)
        kinetic = (0.5 * mass * run.twist**2).sum(axis=1)
        stiffness = robot.friction.axes.stiffness
        if stiffness is None:
            assert (np.diff(kinetic) <= 1e-9).all()
            assert (run.twist[-1] == 0.0).all()
        else:
            most = (0.5 * np.array(COULOMB) ** 2 / stiffness).sum()  # what bent bristles can give back
            assert (kinetic <= np.minimum.accumulate(kinetic) + most + 1e-9).all()
            assert kinetic[-1] <= most


def bend_along_x(robot, voltage, dt, tol=1e-8):
    """(displacement [m], force of the bristle sigma0 z [N]) along x at the rows, from the states of the engine."""
    numbers = plant(robot)
    state = start_state(numbers, np.zeros(3), np.zeros(3))
    bound, lengths = np.full(voltage.shape, np.inf), np.full(len(voltage), dt)
    out = run_implicit(numbers, voltage.copy(), bound, lengths, state, np.zeros(3), no_loop(3), tol)
    return out.pose[:, 0], robot.friction.axes.stiffness[0] * out.state.each["bend"][:, 0]


def test_dahl_runs_along_its_exact_hysteresis():
    """Between two turns F = C s - (C s - F0) exp(-sigma0 |x - x0|/C), whatever the speeds: here the turns are found."""
    robot = axes(law="dahl", stiffness=(1e4, 1e4, 1e2))
    swing = np.sin(np.linspace(0.0, 6.0 * np.pi, 600)) * 0.9
    way, force = bend_along_x(robot, np.outer(swing, [0.0, 1.0, -1.0]), 1e-3)
    side = np.sign(np.diff(way))
    turns = np.flatnonzero(side[1:] != side[:-1]) + 1
    assert len(turns) >= 4
    level = COULOMB[0]
    for begin, end in zip(turns[:-1] + 2, turns[1:] - 1, strict=True):
        s, x = side[begin + 1], way[begin:end]
        exact = level * s - (level * s - force[begin]) * np.exp(-1e4 * np.abs(x - x[0]) / level)
        np.testing.assert_allclose(force[begin:end], exact, rtol=0.0, atol=2e-4 * level)


def test_lugre_of_1995_breaks_away_at_less_the_faster_the_force_rises():
    """1e5 N/m, sqrt(1e5), 0.4, 1, 1.5, 1e-3 and 1 kg: the peak of sigma0 z falls from near 1.5 N as in fig. 4."""
    levels = AxesFriction(
        viscous=(0.4, 0.4, 0.01),
        coulomb=(1.0, 1.0, 0.1),
        breakaway=(1.5, 1.5, 0.15),
        law="lugre",
        stribeck_speed=(1e-3, 1e-3, 1e-2),
        stiffness=(1e5, 1e5, 1e3),
        damping=(math.sqrt(1e5), math.sqrt(1e5), 3.0),
    )
    robot = AXEBOT.replace(body=AXEBOT.body.replace(mass=1.0), friction=Friction(axes=levels))
    volt = 1.0 / (math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69)  # of each of two motors, for a force of 1 N
    p, peaks = plant_of(robot.rigid), []
    braking = float(p.K[1] * p.E[1] / p.R[1] * (p.G[0] @ p.G[0])) + 0.4

    def rates(time, state, rate):
        v, z = state
        bent = v - 1e5 * abs(v) * z / (1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2)))
        return [rate * time - braking * v - 1e5 * z - math.sqrt(1e5) * bent, bent]

    for rate in (1.0, 5.0, 20.0, 50.0):
        rows, length = 300, 2.4 / rate
        force = (np.arange(rows) + 0.5) / rows * 2.4
        bend = bend_along_x(robot, np.outer(force * volt, [0.0, 1.0, -1.0]), length / rows, tol=1e-7)[1]
        exact = solve_ivp(
            rates, (0.0, length), [0.0, 0.0], "LSODA", args=(rate,), rtol=1e-8, atol=1e-12, max_step=length / 500
        )
        assert bend.max() == pytest.approx(1e5 * exact.y[1].max(), rel=0.01)
        peaks.append(bend.max())
    assert 1.35 < peaks[0] < 1.5
    assert (np.diff(peaks) < 0.0).all()
    assert peaks[-1] > 0.99


@pytest.mark.parametrize(
    ("more", "drift"),
    [
        ({"law": "dahl", "stiffness": (2e4, 2e4, 2e2)}, 4.4e-3),
        ({"law": "lugre", "stiffness": (2e4, 2e4, 2e2), "breakaway": BREAKAWAY, "stribeck_speed": FALL}, 0.8e-3),
        ({"breakaway": BREAKAWAY, "stribeck_speed": FALL}, 0.0),
        ({"breakaway": BREAKAWAY}, 0.0),
        ({}, 0.0),
    ],
    ids=["Dahl", "LuGre", "Stribeck", "breakaway", "Coulomb"],
)
@pytest.mark.some(3)
def test_bristles_drift_under_a_force_that_swings_below_breakaway_and_nothing_else_does(more, drift):
    """1.1 +- 0.5 N at 20 Hz on the paper's robot: [m in 2 s], as its differential equation has it; 1.1 N: none."""
    t = (np.arange(2000) + 0.5) * 1e-3
    volt = 1.0 / (math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69)
    robot, far = axes(**more), {}
    for swing in (0.5, 0.0):
        voltage = np.outer((1.1 + swing * np.sin(2 * np.pi * 20.0 * t)) * volt, [0.0, 1.0, -1.0])
        far[swing] = simulate(robot, voltage, 1e-3, tol=1e-6).pose[:, 0]
        if drift == 0.0:
            assert (far[swing] == 0.0).all()
        else:
            truth = bristles.reference(robot, voltage, 1e-3, rtol=1e-8, atol=1e-11)[1]
            assert np.abs(far[swing] - truth[:, 0]).max() <= 1e-6
    assert 2.0 * (far[0.5][2000] - far[0.5][1000]) == pytest.approx(drift, rel=0.01)
    assert abs(far[0.0][2000] - far[0.0][1000]) <= 2e-3 * drift


# --- Karnopp ----------------------------------------------------------------------------------------------------------

DV = (2e-3, 3e-3, 2e-2)


def karnopp_axis(rate, slide, hold, width, drives, dt):
    """Speeds of one axis at the rows by closed forms: v' = g - a v - c s outside the band, w' = (|g| - S)+ s in it."""
    v, w, out = 0.0, 0.0, [0.0]
    for g in drives:
        left = dt
        while left > 0.0:
            if v == 0.0:
                excess = math.copysign(max(abs(g) - hold, 0.0), g)
                end = (math.copysign(width, excess) - w) / excess if excess != 0.0 else math.inf
                if end > left:
                    w, left = w + excess * left, 0.0
                else:
                    v, w, left = math.copysign(width, excess), 0.0, left - end
                    if (g - rate * v - slide * math.copysign(1.0, v)) * v < 0.0:
                        raise AssertionError("it would come back at once: no test of this kind")
                continue
            s = math.copysign(1.0, v)
            goal = (g - slide * s) / rate
            end = math.inf
            if (goal - v) * s < 0.0 and (width * s - goal) * s > 0.0:
                end = -math.log((width * s - goal) / (v - goal)) / rate
            if end > left:
                v, left = goal + (v - goal) * math.exp(-rate * left), 0.0
            else:
                v, w, left = 0.0, width * s * (1.0 - 1e-15), left - end
        out.append(v)
    return np.array(out)


@pytest.mark.parametrize("seed", [0, 1])
def test_karnopp_against_its_closed_form(seed):
    robot = axes(breakaway=BREAKAWAY, law="karnopp", karnopp_speed=DV)
    p, voltage, dt = plant_of(robot.rigid), program(300, 4.0, seed=seed)[::20], 0.08
    exact = np.empty((len(voltage) + 1, 3))
    for k in range(3):
        push = float(p.K[0] / p.R[0]) * (voltage @ p.G[k])
        rate = float(p.K[0] * p.E[0] / p.R[0] * (p.G[k] @ p.G[k]) + p.viscous[k, k]) / p.mass[k]
        m = p.mass[k]
        exact[:, k] = karnopp_axis(rate, COULOMB[k] / m, BREAKAWAY[k] / m, DV[k], push / m, dt)
    for tol in (1e-5, 1e-6):
        run = simulate(robot, voltage, dt, tol=tol)
        assert of_error(run, exact) <= tol
        assert ((run.twist == 0.0) == (exact == 0.0)).all()
        assert not run.warnings


def test_karnopp_rests_to_the_last_bit_below_breakaway_and_leaves_at_its_speed():
    robot = axes(breakaway=BREAKAWAY, law="karnopp", karnopp_speed=DV)
    edge = BREAKAWAY[0] / (math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69)
    for start in (0.0, 1e-3):
        held = simulate(robot, np.tile([0.0, 0.99 * edge, -0.99 * edge], (50, 1)), 0.1, twist=(start, 0.0, 0.0))
        assert (held.twist[1:] == 0.0).all()
        assert (held.pose == held.pose[0]).all()
    excess = 0.05 * BREAKAWAY[0] / robot.body.mass
    rows = np.tile([0.0, 1.05 * edge, -1.05 * edge], (60, 1))
    left = simulate(robot, rows, 1e-3)
    waits = np.count_nonzero(left.twist[:, 0] == 0.0) - 1
    assert waits == math.floor(DV[0] / excess / 1e-3)
    assert left.twist[waits + 1, 0] >= DV[0]


def test_karnopp_with_a_narrow_band_is_the_law_that_sticks():
    """The error of a narrower band falls with it."""
    voltage, errors = program(200, 4.0, seed=2), []
    exact = simulate(axes(breakaway=BREAKAWAY), voltage, 4e-3)
    for width in (1e-2, 1e-3, 1e-4):
        robot = axes(breakaway=BREAKAWAY, law="karnopp", karnopp_speed=(width, width, 10.0 * width))
        errors.append(of_error(simulate(robot, voltage, 4e-3, tol=1e-7), exact.twist))
    assert errors[1] <= 0.3 * errors[0]
    assert errors[2] <= 0.3 * errors[1]
