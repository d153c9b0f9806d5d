"""Dahl and LuGre are fitted: derivatives against an integrator that shares nothing, numbers back from its logs."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.bristles import with_damping
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.sensitivity.derivatives import derivatives
from tests.reference.bristles import reference

AXEBOT = load_robot("axebot")
AXES = "friction.axes."
OF_DAHL = tuple(f"{AXES}{name}[0]" for name in ("viscous", "coulomb", "stiffness"))
OF_LUGRE = (*OF_DAHL, *(f"{AXES}{name}[0]" for name in ("breakaway", "stribeck_speed", "damping")))


def dahl(viscous=0.94, coulomb=2.2, stiffness=2e3, exponent=1.0):
    return AXEBOT.replace(
        friction=Friction(
            axes=AxesFriction(
                law="dahl",
                viscous=(viscous, 0.96, 0.01),
                coulomb=(coulomb, 1.5, 0.099),
                stiffness=(stiffness, 1e3, 50.0),
                dahl_exponent=exponent,
            )
        )
    )


def lugre(viscous=0.94, coulomb=2.2, breakaway=2.8, speed=0.05, stiffness=2e3, damping: float | None = 80.0):
    return AXEBOT.replace(
        friction=Friction(
            axes=AxesFriction(
                law="lugre",
                viscous=(viscous, 0.96, 0.01),
                coulomb=(coulomb, 1.5, 0.099),
                breakaway=(breakaway, 1.9, 0.13),
                stribeck_speed=(speed, 0.05, 0.4),
                stiffness=(stiffness, 1e3, 50.0),
                damping=None if damping is None else (damping, 60.0, 1.0),
            )
        )
    )


DIRECTED = Friction(
    direction=DirectionFriction(
        law="lugre",
        coulomb=(2.0, 1.6),
        breakaway=(2.6, 2.1),
        stribeck_speed=0.05,
        stiffness=2e3,
        damping=60.0,
        viscous=0.9,
    )
)
ROLLING = Friction(
    wheels=WheelFriction(
        law="lugre", coulomb=0.7, breakaway=1.0, stribeck_speed=0.05, stiffness=1e3, damping=30.0, viscous=0.3
    )
)
OF_TABLE = ("breakaway", "stribeck_speed", "stiffness", "damping")


@pytest.mark.parametrize(
    ("robot", "keys"),
    [
        (lugre(), (*OF_LUGRE, "body.mass_kg")),
        (lugre(damping=None, stiffness=1e5), (OF_LUGRE[1], OF_LUGRE[2])),
        (dahl(exponent=1.5), (*OF_DAHL, f"{AXES}stiffness[2]")),
        (
            AXEBOT.replace(friction=DIRECTED),
            (
                "friction.direction.coulomb[0]",
                "friction.direction.breakaway[1]",
                "friction.direction.stiffness",
                "friction.direction.damping",
            ),
        ),
        (AXEBOT.replace(friction=ROLLING), tuple(f"friction.wheels.{name}" for name in OF_TABLE)),
    ],
    ids=["lugre", "critical", "dahl", "direction", "wheels"],
)
@pytest.mark.some(2)
def test_derivatives_are_differences_of_the_differential_equation(robot, keys):
    """How far things are bent goes along: within what `derivatives` promises."""
    levels = np.random.default_rng(0).uniform(-3.0, 3.0, (6, 3)) * [[1.0], [0.3], [1.0], [0.5], [1.0], [0.2]]
    voltage = np.repeat(levels, 4, axis=0)
    found = derivatives(robot, voltage, 0.02, keys, tol=1e-7)
    for k, key in enumerate(keys):
        value = Key.parse(key).get(robot)
        step = 1e-3 * value
        up, down = (reference(Key.parse(key).set(robot, value + by), voltage, 0.02)[0] for by in (step, -step))
        expected = (up - down) / (2.0 * step)
        assert np.abs(found.twist[..., k] - expected).max() <= 3e-4 * np.abs(expected).max()


def ramps():
    """Ramps along x to levels below and above what it takes to move, both ways."""
    pushes = [np.linspace(0.2, (1.6, 2.5, 4.0)[k % 3], 20) * (-1) ** (k // 3) for k in range(12)]
    return np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])


def fast():
    """Forward, at four speeds: it slides from its second row on."""
    return np.outer(np.repeat([3.0, 4.0, 3.5, 4.5], 60), [0.0, 1.0, -1.0])


def log_of(robot, seed, noise=0.002, voltage=None):
    """A log of the differential equation, with noise [m/s]."""
    voltage = ramps() if voltage is None else voltage
    twist = reference(robot, voltage, 0.02, rtol=1e-9, atol=1e-11)[0]
    voltage = np.concatenate([voltage, voltage[-1:]])
    off = np.random.default_rng(seed).normal(size=twist.shape) * [noise, noise, 4.0 * noise]
    return Run(t=np.linspace(0.0, 0.02 * (len(voltage) - 1), len(voltage)), voltage=voltage, twist=twist + off)


@pytest.mark.parametrize(
    ("true", "guess", "keys"),
    [
        (dahl(), dahl(1.2, 2.0, 1e3), OF_DAHL),
        pytest.param(  # by the same engine as of dahl; its derivatives are tested above
            lugre(), lugre(1.2, 2.0, 2.4, 0.03, 1e3, None), OF_LUGRE, marks=pytest.mark.long
        ),
    ],
    ids=["dahl", "lugre"],
)
def test_a_soft_bristle_is_found(true, guess, keys):
    """From a damping that the file leaves to the critical rule, too."""
    fit = omnidyn.identify([log_of(true, 0)], guess, omnidyn.OutputError(free=keys)).estimate
    for key in keys:
        value = Key.parse(key).get(true)
        assert abs(fit.value[key] - value) <= 3.0 * fit.std[key]
        assert fit.std[key] <= 0.15 * value


@pytest.mark.long  # trust/test_uncertainty.py has what a log does not show, of other numbers
def test_a_stiffness_that_the_log_does_not_show_is_not_determined():
    """A bristle that bends by 22 micrometres, once, under noise of 2 cm/s."""
    true, guess = dahl(stiffness=1e5), dahl(1.2, 2.0, 3e4)
    fit = omnidyn.identify([log_of(true, 0, 0.02, fast())], guess, omnidyn.OutputError(free=OF_DAHL)).estimate
    assert OF_DAHL[2] in fit.unidentifiable
    assert ("not_identifiable", OF_DAHL[2]) in {(each.code, each.subject) for each in fit.warnings}
    for key in OF_DAHL[:2]:
        assert abs(fit.value[key] - Key.parse(key).get(true)) <= 3.0 * fit.std[key]


def test_a_damping_that_is_asked_for_begins_at_the_critical_one():
    """2 sqrt(sigma0 m) - viscous, where the file has none; where it has one, there."""
    robot = with_damping(lugre(damping=None), (f"{AXES}damping[0]",))
    mass, inertia = AXEBOT.body.mass, AXEBOT.body.inertia
    expected = (2 * (2e3 * mass) ** 0.5 - 0.94, 2 * (1e3 * mass) ** 0.5 - 0.96, 2 * (50 * inertia) ** 0.5 - 0.01)
    assert robot.friction.axes.damping == pytest.approx(expected)
    assert with_damping(lugre(), (f"{AXES}damping[0]",)) == lugre()
    assert with_damping(lugre(damping=None), OF_DAHL) == lugre(damping=None)


def test_a_bristle_without_a_level_has_no_derivative():
    robot = dahl(coulomb=0.0)
    with pytest.raises(InputError, match="what is off"):
        derivatives(robot, np.ones((2, 3)), 0.02, (OF_DAHL[1],))
