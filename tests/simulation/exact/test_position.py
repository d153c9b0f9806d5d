"""How far a body gets in one step, beside SciPy's quadrature of the speeds; its derivatives, beside differences."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import quad

from omnidyn.simulation.exact.position import PLACE_SIZE, move_on, put_displacement
from omnidyn.simulation.exact.step import exact_step, pieces, speed_within, turned_within

BY = 1e-6


class Step(NamedTuple):
    """speed, drive (3,); law (3, 3): rate, coulomb, breakaway of the axes; dt [s]."""

    speed: np.ndarray
    drive: np.ndarray
    law: np.ndarray
    dt: float


LAW = np.array([[3.0, 2.0, 5.0], [1.5, 1.1, 4.0], [1.5, 1.3, 4.4]])
STEPS = {
    "drives and turns": Step(np.array([0.8, -0.3, 1.2]), np.array([4.0, -3.0, 9.0]), LAW, 0.2),
    "stops, reverses, turns back": Step(np.array([0.1, 0.2, -0.3]), np.array([0.5, -3.0, 8.0]), LAW, 0.4),
    "starts from rest": Step(np.zeros(3), np.array([3.0, 0.2, -7.0]), LAW, 0.3),
    "does not turn": Step(np.array([0.5, 0.4, 0.0]), np.array([0.0, 2.5, 1.0]), LAW, 0.1),
    "turns alone": Step(np.array([0.0, 0.0, 2.0]), np.array([1.0, 1.0, 5.0]), LAW, 0.2),
    "is fast in a short step": Step(np.array([5.0, -4.0, 30.0]), np.array([1.0, 9.0, 90.0]), LAW, 2e-3),
    "rests": Step(np.zeros(3), np.array([1.0, 1.0, 4.0]), LAW, 0.3),
}


def place_of(step):
    place = np.full((2, PLACE_SIZE), np.nan)
    put_displacement(place, np.empty((3, 3)), step.speed, step.drive, step.law, step.dt)
    return place


def by_quadrature(step):
    """The integral of R(theta) v, theta and v in closed form (tests/laws/test_exact_step.py), piece by piece."""
    parts = []
    for axis in range(3):
        rate, coulomb, breakaway = step.law[:, axis]
        phi = -math.expm1(-rate * step.dt) / rate
        parts.append((*pieces(step.speed[axis], step.drive[axis], coulomb, breakaway, rate, phi, step.dt), rate))

    def speed(axis, t):
        return speed_within(t, step.speed[axis], *parts[axis])

    def moves(t, row):
        angle = turned_within(t, step.speed[2], speed(2, t), *parts[2])
        cos, sin = math.cos(angle), math.sin(angle)
        return (cos * speed(0, t) - sin * speed(1, t), sin * speed(0, t) + cos * speed(1, t))[row]

    edges = sorted({0.0, step.dt, *(part[0] for part in parts)})
    return [sum(quad(moves, *ends, args=(row,), epsabs=1e-15)[0] for ends in pairwise(edges)) for row in (0, 1)]


@pytest.mark.parametrize("name", STEPS)
def test_it_is_the_integral_of_the_turned_speeds(name):
    assert place_of(STEPS[name])[:, 0] == pytest.approx(by_quadrature(STEPS[name]), rel=0.0, abs=1e-11)


def moved(step, row, axis, off):
    """The step with one argument of an axis moved; with coulomb goes breakaway."""
    changed = Step(step.speed.copy(), step.drive.copy(), step.law.copy(), step.dt)
    if row < 2:
        changed[row][axis] += off
    else:
        changed.law[[1, 2] if row == 2 else [0], axis] += off
    return changed


@pytest.mark.parametrize("name", [name for name, step in STEPS.items() if step.speed.all() or name == "rests"])
def test_its_derivatives_are_differences(name):
    """By speed, drive, coulomb and rate of each axis; at rest not by speed, where the law has a corner."""
    step = STEPS[name]
    place = place_of(step)
    for row in range(1 if name == "rests" else 0, 4):
        for axis in range(3):
            up, down = (place_of(moved(step, row, axis, off))[:, 0] for off in (BY, -BY))
            assert place[:, 1 + 3 * row + axis] == pytest.approx((up - down) / (2.0 * BY), rel=1e-5, abs=1e-8)


def test_a_path_of_two_steps_and_its_derivatives():
    """Of a parameter that changes all arguments at once, in a body that has turned already."""
    first, second = STEPS["drives and turns"], STEPS["is fast in a short step"]
    by = np.random.default_rng(0).normal(size=(4, 3))

    def after(off):
        """(where it is after two steps, whose second begins as it is written) with its derivatives."""
        s, ds = np.array([0.0, 0.0, 0.4, 0.0, 0.0]), np.zeros((5, 1))
        for step in (first, second):
            law = step.law + off * np.array([by[3], by[2], by[2]])
            changed = Step(step.speed + off * by[0], step.drive + off * by[1], law, step.dt)
            place = place_of(changed)
            move_on(s, ds, place, *(each[:, None] for each in by))
            s[2] += 0.7 + 0.1 * off
            ds[2] += 0.1
        return s, ds

    s, ds = after(0.0)
    angle = 0.4
    expected = np.zeros(2)
    for step in (first, second):
        x, y = by_quadrature(step)
        expected += [math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y]
        angle += 0.7
    assert s[3:] == pytest.approx(expected, rel=0.0, abs=1e-11)
    differences = (after(BY)[0] - after(-BY)[0])[3:] / (2.0 * BY)
    assert ds[3:, 0] == pytest.approx(differences, rel=1e-5, abs=1e-8)


def test_the_steps_stop_and_reverse_where_they_say_so():
    """Of the second: x stops, y reverses, yaw reverses."""
    step = STEPS["stops, reverses, turns back"]
    ends = []
    for axis in range(3):
        rate, coulomb, breakaway = step.law[:, axis]
        phi = -math.expm1(-rate * step.dt) / rate
        ends.append(exact_step(step.speed[axis], step.drive[axis], coulomb, breakaway, rate, phi, 0.0))
    assert np.sign(ends).tolist() == [0.0, -1.0, 1.0]
