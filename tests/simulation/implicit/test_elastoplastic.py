"""Elasto-plastic bristles: against their differential equation, a closed form, and what they are known for."""

import math

import numpy as np
import pytest
from scipy.integrate import DOP853

from omnidyn.errors import InputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.simulation.friction_study import friction_study
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from tests.reference.modes_plant import plant_of

AXEBOT = load_robot("axebot")
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099)}
FALLS = {"breakaway": (2.8, 1.9, 0.13), "stribeck_speed": (0.02, 0.02, 0.2)}
BENDS = {"law": "elastoplastic", "stiffness": (1e4, 1e4, 1e2), "damping": (100.0, 90.0, 0.9)}
PER_VOLT = math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69  # force along x of (0, 1, -1) V


def axes(**numbers):
    return AXEBOT.replace(friction=Friction(axes=AxesFriction(**LEVELS | BENDS | numbers)))


def psi(w, b):
    """z'/s as the paper of 2002 has it."""
    if w < 0.0 or abs(w) <= b:
        return 1.0
    alpha = 1.0 if w >= 1.0 else 0.5 * math.sin(math.pi * (w - (1.0 + b) / 2.0) / (1.0 - b)) + 0.5
    return 1.0 - alpha * w


def truth(robot, voltage, dt):
    """Twist at the rows, by DOP853, of friction on the body axes alone: settled currents, one bristle an axis."""
    p, law = plant_of(robot.replace(friction=robot.friction.rigid)), robot.friction.axes
    viscous, inverse, out, state = np.diag(law.viscous), np.linalg.inv(p.M), [np.zeros(6)], np.zeros(6)

    def rates(t, state, u):
        v, z, dz, dry = state[:3], state[3:], np.zeros(3), np.zeros(3)
        for k in range(3):
            hold = (law.breakaway or law.coulomb)[k]
            left = math.exp(-((v[k] / law.stribeck_speed[k]) ** 2)) if law.stribeck_speed else 0.0
            g = law.coulomb[k] + (hold - law.coulomb[k]) * left
            dz[k] = v[k] * psi(law.stiffness[k] * z[k] * math.copysign(1.0, v[k]) / g, law.elastic_share)
            dry[k] = law.stiffness[k] * z[k] + law.damping[k] * dz[k]
        return np.concatenate([inverse @ (p.G @ (p.K * (u - p.E * (p.G.T @ v)) / p.R) - viscous @ v - dry), dz])

    for u in voltage:
        solver = DOP853(lambda t, y, u=u: rates(t, y, u), 0.0, state, dt, rtol=1e-10, atol=1e-12)
        while solver.status == "running":
            solver.step()
        state = solver.y.copy()
        out.append(state)
    return np.array(out)[:, :3]


@pytest.mark.parametrize("more", [{}, FALLS, FALLS | {"elastic_share": 0.3}, {"elastic_share": 0.95}])
def test_it_is_its_differential_equation(more):
    robot = axes(**more)
    voltage = np.random.default_rng(2).uniform(-4.0, 4.0, (6, 3)) * np.array([1.0, 0.1, 0.6, 0.0, 1.0, 0.3])[:, None]
    exact = truth(robot, voltage, 0.03)
    for tol in (1e-5, 1e-7):
        run = simulate(robot, voltage, 0.03, tol=tol)
        assert (np.abs(run.twist - exact) * [1.0, 1.0, 0.1]).max() <= tol
        assert not run.warnings


def test_below_its_elastic_share_it_is_a_spring():
    """A push that bends by less than half of the share: a damped oscillation in closed form, and it comes back."""
    robot = axes(elastic_share=0.9)
    force = 0.4 * 2.2
    voltage = np.outer(np.append(np.full(40, force), np.zeros(160)) / PER_VOLT, [0.0, 1.0, -1.0])
    run = simulate(robot, voltage, 1e-3, tol=1e-8)
    p = plant_of(robot.rigid)
    damping = 100.0 + 0.94 + float(p.K[1] * p.E[1] / p.R[1] * (p.G[0] @ p.G[0]))
    t, mass = np.arange(41) * 1e-3, robot.body.mass
    half, omega = 0.5 * damping / mass, math.sqrt(1e4 / mass - (0.5 * damping / mass) ** 2)
    speed = force / (mass * omega) * np.exp(-half * t) * np.sin(omega * t)
    np.testing.assert_allclose(run.twist[:41, 0], speed, rtol=0.0, atol=1e-6)
    assert abs(run.pose[-1, 0]) < 1e-3 * run.pose[:, 0].max()


def test_it_does_not_drift_where_lugre_does():
    """1.1 +- 0.5 N at 20 Hz, below a breakaway of 2.8 N."""
    t = (np.arange(500) + 0.5) * 1e-3
    voltage = np.outer((1.1 + 0.5 * np.sin(2 * np.pi * 20.0 * t)) / PER_VOLT, [0.0, 1.0, -1.0])
    far = {
        law: simulate(axes(law=law, **FALLS), voltage, 1e-3, tol=1e-7).pose[:, 0] for law in ("elastoplastic", "lugre")
    }
    gone = {law: way[500] - way[250] for law, way in far.items()}  # five whole swings
    assert gone["lugre"] > 1e-7
    assert abs(gone["elastoplastic"]) < 1e-3 * gone["lugre"]


def test_derivatives_are_differences():
    robot, voltage = axes(**FALLS), np.outer(np.linspace(0.5, 4.0, 12), [0.0, 1.0, -1.0])
    keys = [f"friction.axes.{name}" for name in ("coulomb[0]", "stiffness[0]", "elastic_share")]
    found = derivatives(robot, voltage, 0.01, keys, tol=1e-7)
    for k, key in enumerate(map(Key.parse, keys)):
        step = 1e-4 * key.get(robot)
        up, down = (truth(key.set(robot, key.get(robot) + by), voltage, 0.01) for by in (step, -step))
        expected = ((up - down) / (2.0 * step))[:, 0]
        assert np.abs(found.twist[:, 0, k] - expected).max() <= 3e-4 * np.abs(expected).max()


def test_a_slow_loop_is_stiff_first_and_comes_to_its_level():
    own = friction_study(axes(elastic_share=0.5)).axes[0]
    assert own.law == "elasto-plastic (axes)"
    elastic = own.loop <= 0.5 * 2.2
    start = np.flatnonzero(~elastic)[0]
    np.testing.assert_allclose(own.loop[:start], 1e4 * own.travel[:start], rtol=1e-6)
    assert own.loop[: len(own.loop) // 3][-1] == pytest.approx(2.2, rel=0.01)


def test_a_file_keeps_it_everywhere():
    rim = AXEBOT.replace(friction=Friction(wheels=WheelFriction(coulomb=0.7, law="elastoplastic", stiffness=1e4)))
    along = DirectionFriction(coulomb=(1.0, 1.0), law="elastoplastic", stiffness=1e4, elastic_share=0.4)
    for robot in (axes(elastic_share=0.4), rim, AXEBOT.replace(friction=Friction(direction=along))):
        assert parse_robot(robot_to_toml(robot)) == robot
    with pytest.raises(InputError, match=r'elastic_share is of law = "elastoplastic"'):
        AxesFriction(**LEVELS, elastic_share=0.4)
