"""One implicit step is the formula of its method, to rounding: SDIRK2 of a linear system, Euler where friction lets go.

Of x' = A x + b one SDIRK2 step of length h gives x + R(hA) (x0 - x), x = -A^-1 b, with the stability function of its
tableau, R(Z) = (1 - gamma Z)^-2 (1 + (1 - 2 gamma) Z), gamma = 1 - 1/sqrt 2 (Hairer & Wanner 1996, IV.6); one of
implicit Euler has (1 - Z)^-1. Of the paper's robot that drives along x, by the numbers of its Table 3.
"""

import numpy as np
import pytest
from scipy.optimize import root

from omnidyn import simulate
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from tests.support.friction_shapes import AXEBOT, implicit

MASS, RESISTANCE, RADIUS, GEAR, CONSTANT = 1.5, 1.69, 0.035, 19.0, 0.0059
VISCOUS, COULOMB, BREAKAWAY = 0.94, 2.2, 3.0
GAMMA = 1.0 - 1.0 / np.sqrt(2.0)
PLACES = ("axes", "direction")
NEAR = {"rel": 0.0, "abs": 1e-11}


def robot(place, breakaway=COULOMB, inductance=None):
    """Friction on the axes of the body, left to the implicit engine, or along the direction of travel."""
    if place == "axes":
        levels = {"coulomb": (COULOMB, COULOMB, 0.1), "breakaway": (breakaway, breakaway, 0.1)}
        law = AxesFriction(viscous=(VISCOUS,) * 3, **levels)
        friction = Friction(axes=law)
    else:
        law = DirectionFriction(coulomb=(COULOMB,) * 2, breakaway=(breakaway,) * 2, viscous=VISCOUS, yaw_coulomb=0.1)
        friction = Friction(direction=law)
    motor = {} if inductance is None else {"electrical": "dynamic", "inductance": inductance}
    return implicit(AXEBOT.replace(friction=friction, motor=AXEBOT.motor.replace(**motor)))


def one_step(which, volts, h, speed=0.0, current=0.0):
    """(speed along x, current of wheel 3) after one step from there, wheels 2 and 3 driven against each other."""
    run = simulate(
        which,
        [[0.0, volts, -volts]],
        h,
        twist=(speed, 0.0, 0.0),
        current=(0.0, current, -current),
        tol=None,
    )
    assert "implicit" in run.source
    assert (run.twist[:, 1:] == 0.0).all()
    return run.twist[1, 0], run.current[1, 1]


def system(volts, friction, inductance=None):
    """(A, b) of the speed, or of speed and current: M v' = sqrt 3 G K i - B v - friction, L i' = u - R i - K_e v."""
    force, emf = np.sqrt(3.0) * GEAR * CONSTANT / RADIUS, np.sqrt(0.75) * GEAR * CONSTANT / RADIUS
    if inductance is None:
        return (
            np.array([[-(force * emf / RESISTANCE + VISCOUS) / MASS]]),
            np.array([(force * volts / RESISTANCE - friction) / MASS]),
        )
    return (
        np.array([[-VISCOUS / MASS, force / MASS], [-emf / inductance, -RESISTANCE / inductance]]),
        np.array([-friction / MASS, volts / inductance]),
    )


def sdirk2(matrix, forced, start, h):
    """One step of the method; 0 of friction inside."""
    ends, one = -np.linalg.solve(matrix, forced), np.eye(len(forced))
    stage = one - GAMMA * h * matrix
    return ends + np.linalg.solve(
        stage, np.linalg.solve(stage, (one + (1.0 - 2.0 * GAMMA) * h * matrix) @ (start - ends))
    )


def euler(matrix, forced, start, h):
    return np.linalg.solve(np.eye(len(forced)) - h * matrix, np.asarray(start) + h * forced)


@pytest.mark.parametrize("breakaway", [COULOMB, BREAKAWAY])
@pytest.mark.parametrize("place", PLACES)
def test_while_it_slides(place, breakaway):
    """Forward, backward, and from rest under more than breakaway."""
    for volts, speed in ((3.0, 0.5), (-4.0, -0.2), (1.5, 0.3), (5.0, 0.0), (-5.0, 0.0)):
        h, sign = 0.03, np.sign(speed) or np.sign(volts)
        expected = sdirk2(*system(volts, sign * COULOMB), [speed], h)
        assert one_step(robot(place, breakaway), volts, h, speed)[0] == pytest.approx(expected[0], **NEAR)


@pytest.mark.parametrize("place", PLACES)
def test_currents_follow_the_same_two_stages(place):
    """In steps that are short and long beside L/R."""
    for h in (1e-4, 2e-3, 0.02):
        which = robot(place, inductance=1e-3)
        expected = sdirk2(*system(3.0, COULOMB, 1e-3), [0.5, 0.7], h)
        assert one_step(which, 3.0, h, 0.5, 0.7) == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("place", PLACES)
def test_what_holds_stays_at_0_and_what_stops_is_0(place):
    force = np.sqrt(3.0) * GEAR * CONSTANT / RADIUS / RESISTANCE  # [N/V]
    for breakaway, shares in ((COULOMB, (0.0, 0.5)), (BREAKAWAY, (0.0, 0.5, -0.99))):
        which = robot(place, breakaway)
        for share in shares:
            assert one_step(which, share * breakaway / force, 0.03)[0] == 0.0
            assert one_step(which, share * breakaway / force, 0.5, 0.05)[0] == 0.0


@pytest.mark.parametrize("place", PLACES)
def test_a_second_stage_may_begin_beyond_a_stop(place):
    """Coulomb friction alone: the first stage stops at 0, x* of the second is x0 - (1 - gamma)/gamma x0."""
    h, speed, volts = 0.5, 0.05, -0.99 * COULOMB * RESISTANCE * RADIUS / (np.sqrt(3.0) * GEAR * CONSTANT)
    begins = speed * (2.0 * GAMMA - 1.0) / GAMMA
    expected = euler(*system(volts, -COULOMB), [begins], GAMMA * h)[0]
    assert expected < 0.0
    assert one_step(robot(place), volts, h, speed)[0] == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("place, method", [("axes", euler), ("direction", sdirk2)])
def test_what_reverses_under_more_than_it_slides_with(place, method):
    """Breakaway above Coulomb, and a drive above it: on an axis an Euler step. A direction has no sign that changes."""
    volts, h, speed = -4.0, 0.05, 0.05
    expected = method(*system(volts, -COULOMB), [speed], h)[0]
    assert expected < 0.0
    assert one_step(robot(place, BREAKAWAY), volts, h, speed)[0] == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("place", PLACES)
def test_what_gives_way_in_a_step_too_long_for_its_currents(place):
    """h R/L > 1 + sqrt 2: an Euler step; just below it SDIRK2."""
    inductance = 1e-2
    limit = (1.0 + np.sqrt(2.0)) * inductance / RESISTANCE
    which, problem = robot(place, inductance=inductance), system(5.0, COULOMB, inductance)
    for h, method in ((1.02 * limit, euler), (0.98 * limit, sdirk2)):
        assert one_step(which, 5.0, h) == pytest.approx(method(*problem, np.zeros(2), h), **NEAR)


STIFFNESS, DAMPING, FALL = 2e3, 30.0, 0.1


def two_stages(rate, start, h):
    """SDIRK2 of x' = rate(x): each stage x = x* + gamma h rate(x), by SciPy's root."""
    start, stage = np.asarray(start), np.asarray(start)
    for back in (0.0, (1.0 - GAMMA) / GAMMA):
        aimed = start + back * (stage - start)
        stage = root(lambda x, aimed=aimed: x - aimed - GAMMA * h * rate(x), stage, tol=1e-14).x
    return stage


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("law", ["Stribeck", "LuGre"])
def test_friction_that_falls_and_bristles_follow_the_same_two_stages(law, place):
    """Breakaway that falls with the speed; bristles from straight on, whose force holds nothing at first."""
    which = robot(place, BREAKAWAY)
    more = {"stribeck_speed": FALL} if law == "Stribeck" else {"law": "lugre", "breakaway": None}
    more |= {} if law == "Stribeck" else {"stiffness": STIFFNESS, "damping": DAMPING}
    more |= {"yaw_coulomb": 0.0} if place == "direction" else {}
    if place == "axes":
        lists = {name: (value,) * 3 if isinstance(value, float) else value for name, value in more.items()}
        which = which.replace(friction=Friction(axes=which.friction.axes.replace(**lists)))
    else:
        which = which.replace(friction=Friction(direction=which.friction.direction.replace(**more)))
    (matrix,), (forced,) = system(3.0, 0.0)

    def rate(x):
        if law == "Stribeck":
            level = COULOMB + (BREAKAWAY - COULOMB) * np.exp(-((x[0] / FALL) ** 2))
            return np.array([matrix[0] * x[0] + forced - level / MASS])
        bend_rate = x[0] - STIFFNESS * abs(x[0]) * x[1] / COULOMB
        force = STIFFNESS * x[1] + DAMPING * bend_rate
        return np.array([matrix[0] * x[0] + forced - force / MASS, bend_rate])

    for h in (1e-3, 0.01):
        run = simulate(which, [[0.0, 3.0, -3.0]] * 2, h, twist=(0.12, 0.0, 0.0), tol=None)
        expected = two_stages(rate, [0.12] if law == "Stribeck" else [0.12, 0.0], h)
        assert run.twist[1, 0] == pytest.approx(expected[0], rel=0.0, abs=1e-9)
        assert run.twist[2, 0] == pytest.approx(two_stages(rate, expected, h)[0], rel=0.0, abs=1e-9)


@pytest.mark.parametrize("place", PLACES)
def test_a_speed_within_the_band_of_karnopp_is_0_and_one_beyond_it_slides(place):
    if place == "axes":
        law = {"axes": AxesFriction(viscous=(VISCOUS,) * 3, coulomb=(COULOMB,) * 3, **karnopp(3 * (0.05,)))}
    else:
        law = {"direction": DirectionFriction(coulomb=(COULOMB,) * 2, viscous=VISCOUS, **karnopp(0.05))}
    which = implicit(AXEBOT.replace(friction=Friction(**law)))
    assert one_step(which, 0.2, 1e-3, 0.04)[0] == 0.0
    assert one_step(which, 3.0, 0.01, 0.4)[0] == pytest.approx(sdirk2(*system(3.0, COULOMB), [0.4], 0.01)[0], **NEAR)


def karnopp(width):
    """Its band [m/s]."""
    return {"law": "karnopp", "karnopp_speed": width}
