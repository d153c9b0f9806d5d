"""Derivatives of the exact step against central differences of a step with 50 digits, written out in this test."""

import mpmath as mp
import numpy as np
import pytest

from omnidyn.simulation.exact.slopes import acceleration_at_end, hold_slopes, step_slopes, travel_slopes
from omnidyn.simulation.exact.step import exact_step

mp.mp.dps = 50
DRAWS = 2000


def truth(speed, drive, coulomb, breakaway, rate, dt):
    """(speed after the step, way, which pieces) by marching from event to event, straight from dv/dt = -a v + f."""
    v, way, left, story = speed, mp.mpf(0), dt, ""
    while left > 0:
        if v == 0 and abs(drive) <= breakaway:
            return v, way, story + "rests"
        side = mp.sign(v) if v != 0 else mp.sign(drive)
        force = drive - side * coulomb
        terminal = force / rate
        ahead = terminal + (v - terminal) * mp.exp(-rate * left)
        if v != 0 and ahead * side < 0:
            event = mp.log((v - terminal) / -terminal) / rate
            way += terminal * event + (v - terminal) * -mp.expm1(-rate * event) / rate
            v, left, story = mp.mpf(0), left - event, story + "stops "
            continue
        way += terminal * left + (v - terminal) * -mp.expm1(-rate * left) / rate
        return ahead, way, story + "slides"
    return v, way, story


def draw(rng):
    """Numbers of a random robot and step: S = c and S > c, steps from 1e-6 to 0.3 s, half of them near a stop."""
    rate, dt = np.exp(rng.uniform(np.log(0.05), np.log(60.0))), np.exp(rng.uniform(np.log(1e-6), np.log(0.3)))
    coulomb = rng.uniform(0.0, 4.0)
    breakaway = coulomb * rng.choice([1.0, 1.3])
    drive = rng.uniform(-8.0, 8.0)
    speed = rng.normal() * (abs(drive) + coulomb) * (dt if rng.random() < 0.6 else 0.3)
    return (0.0 if rng.random() < 0.15 else speed), drive, coulomb, breakaway, rate, dt


def test_every_branch_against_50_digits():
    """The issue asks for 1e-6 on 99 % of the samples."""
    rng = np.random.default_rng(20261120)
    errors, stories = [], set()
    for _ in range(DRAWS):
        numbers = draw(rng)
        speed, drive, coulomb, breakaway, rate, dt = numbers
        phi, dphi, psi, dpsi = hold_slopes(rate, dt)
        got = step_slopes(speed, drive, coulomb, breakaway, rate, phi, dphi)
        assert got[0] == exact_step(speed, drive, coulomb, breakaway, rate, phi, 0.0)
        way = travel_slopes(speed, drive, coulomb, breakaway, rate, dt, phi, dphi, psi, dpsi)
        exact = [mp.mpf(x) for x in numbers]
        after, path, story = truth(*exact)
        stories.add(story)
        assert abs(way[0] - path) <= 1e-13 * (abs(path) + abs(speed) * dt)
        ends = acceleration_at_end(float(after), drive, coulomb, breakaway, rate)
        for place, k in ((0, 1), (1, 2), (2, 3), (4, 4), (5, None)):
            step = mp.mpf(10) ** -20 * (abs(exact[place]) or 1)
            sides = []
            for sign in (1, -1):
                moved = list(exact)
                moved[place] += sign * step
                if place == 2 and breakaway == coulomb:
                    moved[3] = moved[2]  # tied
                sides.append(truth(*moved))
            if len({story, sides[0][2], sides[1][2]}) > 1:
                continue  # rest has a kink in v: the two sides are different stories
            slopes = [(a - b) / (2 * step) for a, b in zip(sides[0][:2], sides[1][:2], strict=True)]
            if k is None:
                pairs = [(ends, slopes[0], abs(drive) + coulomb + abs(rate * speed))]
            else:
                sizes = (dt if k != 1 else 1.0) * np.array([1.0, dt]) * (abs(speed) + abs(drive) * dt if k == 4 else 1)
                pairs = [(got[k], slopes[0], sizes[0]), (way[k], slopes[1], sizes[1])]
            for ours, theirs, size in pairs:
                errors.append(float(abs(ours - theirs) / max(abs(theirs), size * mp.mpf(10) ** -3)))
    assert stories == {"rests", "slides", "stops rests", "stops slides"}
    assert np.quantile(errors, 0.99) < 1e-11
    assert max(errors) < 1e-6  # a reversal just after a stop loses digits in its difference


@pytest.mark.parametrize("x", [1e-9, 1e-4, 0.00999, 0.01, 0.5, 30.0])
def test_the_integrals_of_a_held_voltage(x):
    rate, dt = mp.mpf("3.7"), mp.mpf(x) / mp.mpf("3.7")
    got = hold_slopes(float(rate), float(dt))
    phi = lambda a: -mp.expm1(-a * mp.mpf(float(dt))) / a  # noqa: E731
    psi = lambda a: (mp.mpf(float(dt)) - phi(a)) / a  # noqa: E731
    a = mp.mpf(float(rate))
    expected = (phi(a), mp.diff(phi, a), psi(a), mp.diff(psi, a))
    np.testing.assert_allclose(got, [float(value) for value in expected], rtol=2e-11)
