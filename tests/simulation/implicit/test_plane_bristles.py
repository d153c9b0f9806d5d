"""Dahl's exponent and elasto-plastic bristles along the direction of travel: a vector, where axes have a number."""

import math

import numpy as np
import pytest

import omnidyn
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.layout import YAW
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.run import Run
from omnidyn.simulation.friction_study import friction_study
from omnidyn.simulation.implicit.implicit_march import run_implicit
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.speed_loop import no_loop
from tests.reference import bristles
from tests.support.events import of_error
from tests.support.mixed_robots import random_robot, random_voltages, with_bristles

AXEBOT = load_robot("axebot")
LAWS = {
    "dahl": {"law": "dahl", "dahl_exponent": 1.7},
    "brittle": {"law": "dahl", "dahl_exponent": 0.6},
    "elastoplastic": {"law": "elastoplastic", "elastic_share": 0.6, "damping": 0.0},
}
SEEDS = {"dahl": (1, 4, 5, 6, 11, 12, 13, 15, 19, 22, 26), "elastoplastic": (1, 4, 5, 6, 8, 11, 12, 13, 15, 19, 20)}


def along(coulomb=(2.2, 1.5), stiffness=1e4, yaw_coulomb=0.0, **numbers):
    yaw = {"yaw_coulomb": yaw_coulomb, "yaw_stiffness": 1e2} if yaw_coulomb else {}
    law = DirectionFriction(coulomb=coulomb, stiffness=stiffness, viscous=0.95, yaw_viscous=0.01, **yaw, **numbers)
    return AXEBOT.replace(friction=Friction(direction=law))


def pushes(rows, seed=0, scale=4.0):
    random = np.random.default_rng(seed)
    return random.uniform(-scale, scale, (rows, 3)) * random.choice([0.15, 0.5, 1.0], (rows, 1))


@pytest.mark.parametrize("law, seed", [(law, seed) for law, seeds in SEEDS.items() for seed in seeds])
@pytest.mark.some(7)
def test_against_its_differential_equation(law, seed):
    """Eleven robots each, wherever they have friction: within tol [m/s], 10 tol [rad/s], and the pose."""
    robot = with_bristles(random_robot(seed), seed, (law,))
    voltage, dt = (part[:6] for part in random_voltages(robot, seed))
    twist, pose = bristles.reference(robot, voltage, dt)
    for tol in (1e-5, 1e-7):
        run = simulate(robot, voltage, dt, tol=tol)
        assert of_error(run, twist) <= tol
        assert np.abs(run.pose - pose).max() <= tol
        assert not run.warnings


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("axis", [0, 1])
def test_along_an_axis_it_is_the_law_of_one_axis(law, axis):
    """To 1e-12 in the same steps, levels that fall and damping included."""
    more = dict(LAWS[law])
    if more["law"] == "elastoplastic":
        more |= {"damping": 60.0}
    one = along(**more)
    triple = {k: (v, v, 0.0) for k, v in more.items() if k == "damping"}
    box = AxesFriction(viscous=(0.95, 0.95, 0.01), coulomb=(2.2, 1.5, 0.0), stiffness=(1e4, 1e4, 1.0), **more | triple)
    pattern = ([0.0, 1.0, -1.0], [-1.0, 0.5, 0.5])[axis]
    voltage = np.outer(pushes(60)[:, 0], pattern)
    runs = [simulate(robot, voltage, 4e-3, tol=None) for robot in (one, AXEBOT.replace(friction=Friction(axes=box)))]
    assert np.abs(runs[0].twist[:, axis]).max() > 0.03
    assert np.abs(runs[0].twist - runs[1].twist).max() <= 1e-12


@pytest.mark.parametrize("law", LAWS)
def test_a_disc_knows_no_direction(law):
    """Three equal wheels: what the next wheel is given next turns the motion by 120 degrees."""
    robot = along(coulomb=(2.0, 2.0), yaw_coulomb=0.1, **LAWS[law])
    voltage = pushes(60, seed=3)
    one, two = simulate(robot, voltage, 4e-3, tol=1e-8), simulate(robot, np.roll(voltage, 1, axis=1), 4e-3, tol=1e-8)
    turn = -2.0 * math.pi / 3.0 if robot.wheels.azimuth_deg[0] == 180.0 else 0.0
    turned = [two.twist[:, :2] @ _turning(angle).T for angle in (turn, -turn)]
    assert min(np.abs(each - one.twist[:, :2]).max() for each in turned) <= 1e-7
    assert np.abs(two.twist[:, 2] - one.twist[:, 2]).max() <= 1e-6


def _turning(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.some(1)
def test_energy_never_rises(law):
    """Without voltage, from bristles bent at random: 1/2 v M v + sigma0 |z|^2/2 falls at every row, disc or ellipse."""
    robot = along(coulomb=(2.6, 1.3), stiffness=2e3, yaw_coulomb=0.1, **LAWS[law])
    numbers, random = plant(robot), np.random.default_rng(1)
    m = len(numbers.element)
    for start in random.normal(size=(6, 3)) * [0.3, 0.3, 2.0]:
        state = start_state(numbers, start, np.zeros(3))
        bent = random.uniform(-0.7, 0.7, 3) * [2.6 / 2e3, 1.3 / 2e3, 0.0]
        state.each["bend"][m : m + 2] = bent[:2]
        rows, off = 250, np.zeros((250, 3))
        bound, dt = np.full((rows, 3), np.inf), np.full(rows, 1e-3)
        out = run_implicit(numbers, off, bound, dt, state, np.zeros(3), no_loop(3), 1e-8).state
        stored = 0.5 * 2e3 * (out.each["bend"][:, m : m + 2] ** 2).sum(axis=1)
        stored += 0.5 * numbers.element["stiffness"][YAW] * out.each["bend"][:, YAW] ** 2
        energy = 0.5 * robot.body.mass * (out.x**2).sum(axis=1) + stored
        assert (np.diff(energy) <= 1e-9).all()
        assert energy[-1] < 0.5 * energy[0]


@pytest.mark.parametrize("law", ["dahl", "elastoplastic"])
def test_derivatives_are_differences_of_the_other_integrator(law):
    own = {"dahl": "dahl_exponent", "elastoplastic": "elastic_share"}[law]
    robot = along(coulomb=(2.4, 1.6), stiffness=3e3, yaw_coulomb=0.1, **LAWS[law])
    keys, voltage = [f"friction.direction.{name}" for name in ("coulomb[0]", "stiffness", own)], pushes(8, seed=5)
    found = derivatives(robot, voltage, 0.02, keys, tol=1e-7)
    for k, key in enumerate(map(Key.parse, keys)):
        step = 1e-4 * key.get(robot)
        up, down = (bristles.reference(key.set(robot, key.get(robot) + by), voltage, 0.02)[0] for by in (step, -step))
        expected = (up - down) / (2.0 * step)
        assert np.abs(found.twist[:, :2, k] - expected[:, :2]).max() <= 3e-4 * np.abs(expected[:, :2]).max()


@pytest.mark.parametrize("law", ["dahl", "elastoplastic"])
def test_a_fit_finds_its_numbers(law):
    """From a log of the other integrator, soft bristles and little noise; its intervals hold them."""
    own = {"dahl": "dahl_exponent", "elastoplastic": "elastic_share"}[law]
    robot = along(stiffness=500.0, **LAWS[law])
    voltage = np.repeat(pushes(12, seed=7, scale=3.0), 10, axis=0)
    twist, _ = bristles.reference(robot, voltage, 0.01, rtol=1e-9, atol=1e-11)
    noise = np.random.default_rng(0).normal(size=twist.shape) * [0.002, 0.002, 0.01]
    log = Run(t=0.01 * np.arange(len(twist)), voltage=np.append(voltage, voltage[-1:], axis=0), twist=twist + noise)
    keys = tuple(f"friction.direction.{name}" for name in ("coulomb[0]", "coulomb[1]", own))
    guess = robot
    for key, factor in zip(keys, (1.15, 0.9, 1.15 if law == "dahl" else 0.9), strict=True):
        place = Key.parse(key)
        guess = place.set(guess, factor * place.get(guess))
    fit = omnidyn.identify([log], guess, omnidyn.OutputError(free=keys)).estimate
    for key in keys:
        low, high = fit.ci95[key]
        assert low <= Key.parse(key).get(robot) <= high, key
    assert fit.std[keys[0]] < 0.1


@pytest.mark.parametrize("law", LAWS)
def test_a_file_keeps_it_and_it_is_drawn(law):
    robot = along(yaw_coulomb=0.1, **LAWS[law])
    assert parse_robot(robot_to_toml(robot)) == robot
    both = AxesFriction(
        viscous=(0.95, 0.95, 0.01),
        coulomb=(2.2, 1.5, 0.1),
        stiffness=(1e4, 1e4, 1e2),
        **LAWS[law] | ({"damping": (0.0, 0.0, 0.0)} if "damping" in LAWS[law] else {}),
    )
    one, box = friction_study(robot).axes, friction_study(AXEBOT.replace(friction=Friction(axes=both))).axes
    for k in range(3):
        np.testing.assert_allclose(one[k].loop, box[k].loop, rtol=1e-9, atol=1e-12)
