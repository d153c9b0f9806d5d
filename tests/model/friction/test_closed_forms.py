"""Beside the laws: slow motions by an integrator of ODEs, bounds by a fine grid, slopes by differences."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from omnidyn.compiled.kernel import plain
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, dahl, elastoplastic, lugre
from omnidyn.model.friction.bristle import bristle_force, fade_of
from omnidyn.model.friction.newton import newton
from omnidyn.model.friction.stribeck import excess, fallen, steepest_of, steepness_left
from omnidyn.model.layout import Plant, new_stage
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant
from tests.reference.modes_plant import FALLS

AXEBOT = load_robot("axebot")
NONE = (0.0, 0.0, 0.0)
STIFFNESS = 2e3


def axis(coulomb=2.0, **numbers):
    """The record of the x axis; a number stands for all three."""
    numbers = {key: (value,) * 3 if isinstance(value, float) else value for key, value in numbers.items()}
    single = {
        key: numbers.pop(key)[0] for key in ("dahl_exponent", "elastic_share", "stribeck_exponent") if key in numbers
    }
    law = AxesFriction(viscous=NONE, coulomb=(coulomb,) * 3, **numbers, **single)
    return plant(AXEBOT.replace(friction=Friction(axes=law))).element[0]


# ---- slow motions -------------------------------------------------------------------------------------------


def dahl_psi(a):
    return lambda w: math.copysign(abs(1.0 - w) ** a, 1.0 - w)


def dupont_psi(b):
    def psi(w):
        alpha = 0.5 * (1.0 + math.sin(math.pi * (w - 0.5 * (1.0 + b)) / (1.0 - b)))
        return 1.0 - (0.0 if w <= b else 1.0 if w >= 1.0 else alpha) * w

    return psi


SLOW = {
    "dahl": (dahl, {"law": "dahl"}, dahl_psi(1.0), 1e-9),
    "dahl 0.5": (dahl, {"law": "dahl", "dahl_exponent": 0.5}, dahl_psi(0.5), 1e-7),
    "dahl 2.5": (dahl, {"law": "dahl", "dahl_exponent": 2.5}, dahl_psi(2.5), 1e-9),
    "lugre": (lugre, {"law": "lugre"}, dahl_psi(1.0), 1e-9),
    "elastic 0": (elastoplastic, {"law": "elastoplastic", "elastic_share": 0.0}, dupont_psi(0.0), 2e-3),
    "elastic 0.7": (elastoplastic, {"law": "elastoplastic", "elastic_share": 0.7}, dupont_psi(0.7), 2e-3),
}


@pytest.mark.parametrize("name", SLOW)
def test_a_slow_motion_solves_the_law(name):
    """dw/dx = psi(w), w the bend and x the way in C/sigma0: from rest, from half a bend, and after a reversal."""
    law, numbers, psi, near = SLOW[name]
    record = axis(stiffness=STIFFNESS, **numbers)
    for w, distance in ((0.0, 0.3), (0.0, 0.9), (0.5, 0.2), (-1.0, 0.04), (-1.0, 1.2), (-0.8, 2.4)):
        solved = solve_ivp(lambda _, y: [psi(y[0])], (0.0, distance), [w], rtol=1e-11, atol=1e-12, max_step=0.02)
        assert 1.0 - law.slow(record, 1.0 - w, distance) == pytest.approx(solved.y[0, -1], abs=near)
        assert law.slow(record, 1.0 - w, 0.0) == pytest.approx(1.0 - w, rel=1e-15)


@pytest.mark.parametrize("name", SLOW)
def test_what_slips_goes_on_slipping(name):
    """The edge is met after a way of 2 where a = 1/2, and nearly after a long way by every other law."""
    law, numbers, _, _ = SLOW[name]
    record = axis(stiffness=STIFFNESS, **numbers)
    assert law.slow(record, 0.0, 0.5) == pytest.approx(0.0, abs=1e-15)
    left = (1.0 + 1.5 * 400.0) ** (-1.0 / 1.5) if name == "dahl 2.5" else 0.0
    assert law.slow(record, 1.0, 400.0) == pytest.approx(left, abs=1e-6)
    if name == "dahl 0.5":
        assert law.slow(record, 1.0, 1.99) == pytest.approx((1.0 - 1.99 / 2.0) ** 2)
        assert law.slow(record, 1.0, 2.01) == 0.0


# ---- levels that differ forward and backward ------------------------------------------------------------------

LEVELS = {"coulomb": 2.0, "coulomb_backward": 1.5, "breakaway": 3.0, "breakaway_backward": 1.75}
V_S = 0.05


def level(speed, exponent):
    """[N] of the side to which it moves."""
    slide, hold = (2.0, 3.0) if speed >= 0.0 else (1.5, 1.75)
    return slide + (hold - slide) * math.exp(-((abs(speed) / V_S) ** exponent))


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_a_level_that_falls_is_that_of_its_side(exponent):
    """F = -sgn(s) (C + (S - C) f), beyond C by `excess`, and its slope by differences; against its sign all of it."""
    row = axis(**LEVELS, stribeck_speed=V_S, stribeck_exponent=exponent)
    at = new_stage(Plant(plant(AXEBOT).body, np.array([row]))).each[0]
    at.hold[:] = 3.0, 1.75
    for speed in (0.003, 0.04, 0.11, -0.003, -0.04, -0.11):
        at.sign = math.copysign(1.0, speed)
        slide = 2.0 if speed > 0.0 else 1.5
        force, slope = excess(row, at, speed)
        assert force == pytest.approx(-at.sign * (level(speed, exponent) - slide), rel=1e-12)
        up, down = (-at.sign * level(speed + off, exponent) for off in (1e-7, -1e-7))
        assert slope == pytest.approx((up - down) / 2e-7, rel=1e-6)
        assert excess(row, at, -speed)[0] == pytest.approx(-at.sign * (1.0 if speed > 0.0 else 0.25))


@pytest.mark.parametrize("law", ["lugre", "elastoplastic"])
def test_a_bristle_slips_at_the_level_of_its_side(law):
    """Bent long enough z' = 0 and sigma0 |z| = g(s); from there its force follows the level, by differences."""
    row = axis(**LEVELS, law=law, stiffness=STIFFNESS, damping=20.0, damping_speed=0.08, stribeck_speed=V_S)
    for speed in (0.003, 0.04, 0.11, -0.003, -0.04, -0.11):
        force, slope, bent = plain(bristle_force)(row, speed, 0.0, 1e9)
        side = math.copysign(1.0, speed)
        assert STIFFNESS * bent == pytest.approx(side * level(speed, 2.0), rel=1e-6)
        assert force == pytest.approx(-side * level(speed, 2.0), rel=1e-6)
        up, down = (plain(bristle_force)(row, speed + off, bent, 1e-3)[0] for off in (1e-7, -1e-7))
        slope = plain(bristle_force)(row, speed, bent, 1e-3)[1]
        assert slope == pytest.approx((up - down) / 2e-7, rel=1e-5)


def test_a_bristle_at_rest_begins_as_a_spring():
    """z' = s psi(w): at s = 0 nothing moves, and the slope of z' is psi(w) of a motion forward."""
    for numbers, psi in (
        ({"law": "dahl", "dahl_exponent": 1.7}, dahl_psi(1.7)),
        ({"law": "dahl"}, dahl_psi(1.0)),
        ({"law": "elastoplastic", "elastic_share": 0.3}, dupont_psi(0.3)),
        ({"law": "lugre"}, dahl_psi(1.0)),
    ):
        row = axis(stiffness=STIFFNESS, **({"damping": 0.0} if numbers["law"] != "dahl" else {}), **numbers)
        for w in (-0.9, 0.0, 0.2, 0.8):
            force, slope, bent = plain(bristle_force)(row, 0.0, w * 2.0 / STIFFNESS, 1e-3)
            assert bent == w * 2.0 / STIFFNESS
            assert force == pytest.approx(-2.0 * w)
            assert slope == pytest.approx(-STIFFNESS * 1e-3 * psi(w), rel=1e-9)


# ---- bounds ---------------------------------------------------------------------------------------------------


def test_the_steepest_fall_of_an_element():
    """exp(-u^2) falls by sqrt(2/e) at u = 1/sqrt 2; what bends follows the fall late, 1.5 times as steeply at most."""
    steepest = math.sqrt(2.0 / math.e) / V_S
    assert steepest_of(axis(breakaway=3.0, stribeck_speed=V_S)) == pytest.approx(1.0 * steepest, rel=1e-12)
    assert steepest_of(axis(breakaway_backward=3.5, stribeck_speed=V_S)) == pytest.approx(1.5 * steepest, rel=1e-12)
    bends = axis(breakaway=2.5, stribeck_speed=V_S, law="lugre", stiffness=STIFFNESS)
    assert steepest_of(bends) == pytest.approx(1.5 * 0.5 * steepest, rel=1e-12)
    assert steepest_of(axis(breakaway=3.0)) == 0.0
    assert steepest_of(axis(law="lugre", stiffness=STIFFNESS)) == 0.0


def test_a_damping_that_fades_lets_go_no_faster_than_its_bound():
    """sigma1 exp(-u^2) s by s, of the damping alone: 2 u^2 exp(-u^2) is at most 2/e. The bound is next above it."""
    u = np.linspace(0.0, 4.0, 4001)
    most = 30.0 * (2.0 * u**2 * np.exp(-(u**2))).max()
    bound = fade_of(axis(law="lugre", stiffness=STIFFNESS, damping=30.0, damping_speed=0.1))
    assert most <= bound <= 1.03 * most
    assert fade_of(axis(law="lugre", stiffness=STIFFNESS, damping=30.0)) == 0.0
    disc = DirectionFriction(coulomb=(2.0, 2.0), law="lugre", stiffness=STIFFNESS, damping=30.0, damping_speed=0.02)
    assert fade_of(plant(AXEBOT.replace(friction=Friction(direction=disc))).body) == bound


def test_how_steep_a_fall_still_is():
    """All of it up to the steepest point, less beyond, by the formula; nothing is below rest."""
    for speed in (-1.0, 0.0, 0.3, 1.0 / math.sqrt(2.0)):
        assert steepness_left(speed, 0, 2.0) == pytest.approx(1.0, rel=1e-12)
    left = 2.0 * 1.5 * math.exp(-(1.5**2)) / math.sqrt(2.0 / math.e)
    assert steepness_left(1.5, 0, 2.0) == pytest.approx(left, rel=1e-12)
    assert steepness_left(1.0, 1, 1.0) == pytest.approx(0.25, rel=1e-12)  # 1/(1 + u): slope -1/(1 + u)^2


def test_the_fall_of_many_of_several_shapes():
    """Each with its own exponent, speed and shape; far beyond its speed without a warning."""
    speed, v_s = np.array([0.01, -0.02, 0.03, 0.04]), np.array([0.02, 0.03, 0.04, 0.05])
    exponent, shape = np.array([2.0, 1.0, 0.5, 3.0]), np.array([0.0, 1.0, 1.0, 0.0])
    names = ("exponential", "lorentzian")
    expected = [FALLS[names[int(k)]](abs(v) / s, d) for v, s, d, k in zip(speed, v_s, exponent, shape, strict=True)]
    np.testing.assert_allclose(fallen(speed, 1.0 / v_s, exponent, shape), expected, rtol=1e-12)
    with np.errstate(all="raise"):
        assert fallen(30.0, 1.0, 2.0) == 0.0
    assert fallen(speed, 0.0, 2.0).tolist() == [1.0] * 4  # no fall at all


# ---- slopes of what is solved for ------------------------------------------------------------------------------


@pytest.fixture
def steps(monkeypatch):
    """The first step of Newton's method in a function, beside f/f' by differences of what it is given: a probe takes
    the place of the iteration for two looks beside the first guess. f: of a guess and what is left there."""
    looks = []

    def probe(guess, off, slope, low, high):
        looks.append((guess, off, slope))
        if len(looks) < 3:
            return looks[0][0] * (1.0 + (1e-6, -1e-6)[len(looks) - 1]), low, high
        return plain(newton)(*(looks[0] if len(looks) == 3 else (guess, off, slope)), low, high)

    for module in (dahl, elastoplastic):
        monkeypatch.setattr(module, "newton", probe)

    def steps_of(f, function, *arguments):
        looks.clear()
        plain(function)(*arguments)
        (first, off, slope), (right, above, _), (left, below, _) = looks[:3]
        return off / slope, f(first, off) * (right - left) / (f(right, above) - f(left, below))

    return steps_of


def what_is_left(_, off):
    return off


def relative(guess, off):
    """q/|Y| - 1 of what is left there, q - |Y|."""
    return off / (guess - off)


@pytest.mark.parametrize("a", [0.6, 1.7, 3.0])
def test_newtons_steps_of_dahls_law(steps, a):
    rng, row = np.random.default_rng(5), axis(law="dahl", stiffness=STIFFNESS, dahl_exponent=a)
    for _ in range(20):
        aimed, bends = tuple(rng.uniform(-1.5, 1.5, 2)), 10.0 ** rng.uniform(-1.0, 1.0, 2)
        step, expected = steps(relative, dahl._left_of_way, aimed, *bends, a)
        assert step == pytest.approx(expected, rel=1e-5)
        z, v = rng.uniform(-0.9, 0.9) * 2.0 / STIFFNESS, rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.2)
        step, expected = steps(what_is_left, dahl._by_newton, row, z, v, 10.0 ** rng.uniform(-3.0, -1.5), 2.0, 0.0)
        assert step == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("b", [0.0, 0.3])
def test_newtons_steps_of_elastoplastic_bristles(steps, b):
    """Bent nearly to its level, and driven on."""
    rng, levels = np.random.default_rng(6), (2.6, 1.7, 0.0, 0.0, 0.1)
    row = axis(law="elastoplastic", stiffness=STIFFNESS, elastic_share=b, damping=0.0)
    for _ in range(20):
        angle = rng.uniform(0.2, 1.4)
        trial, speed = (0.9 * math.cos(angle), 0.9 * math.sin(angle)), tuple(rng.uniform(0.02, 0.1, 2))
        tau = 10.0 ** rng.uniform(-3.5, -2.5)
        step, expected = steps(what_is_left, elastoplastic._slip_within, row, trial, speed, tau, levels)
        assert step == pytest.approx(expected, rel=1e-4)
