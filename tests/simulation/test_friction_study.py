"""What a robot's friction does near zero speed: closed forms, and the limits that each law has."""

import math

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.friction_study import friction_study
from tests.support.codes import codes

AXEBOT = load_robot("axebot")
VISCOUS, COULOMB, BREAKAWAY = (0.94, 0.96, 0.01), (2.2, 1.5, 0.099), (2.8, 1.9, 0.13)
STIFF = (2e4, 2e4, 2e2)


def study(**numbers):
    axes = AxesFriction(viscous=VISCOUS, coulomb=COULOMB, **numbers)
    return friction_study(AXEBOT.replace(friction=Friction(axes=axes)))


def test_the_paper_s_law_holds_at_every_rate_and_bends_nowhere():
    for own, coulomb, viscous in zip(study().axes, COULOMB, VISCOUS, strict=True):
        assert own.holds == (coulomb, coulomb)
        np.testing.assert_allclose(own.breakaway, coulomb, rtol=1e-9)
        np.testing.assert_allclose(own.force, coulomb * np.sign(own.speed) + viscous * own.speed, rtol=1e-12)
        assert own.bends == 0.0
        assert len(own.loop) == 0


def test_wheels_that_may_slip_are_studied_as_they_roll():
    slips = AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=0.5, wheel_inertia=2e-6))
    found, rolls = friction_study(slips), friction_study(AXEBOT)
    for one, other in zip(found.axes, rolls.axes, strict=True):
        np.testing.assert_array_equal(one.force, other.force)
    assert "wheels_roll" in codes(found.notes)


def test_stribeck_falls_as_its_formula_says():
    own = study(breakaway=BREAKAWAY, stribeck_speed=(0.02, 0.02, 0.2), stribeck_exponent=1.5).axes[2]
    fall = np.exp(-((np.abs(own.speed) / 0.2) ** 1.5))
    level = COULOMB[2] + (BREAKAWAY[2] - COULOMB[2]) * fall
    np.testing.assert_allclose(own.force, level * np.sign(own.speed) + VISCOUS[2] * own.speed, rtol=1e-12)
    assert own.law == "Stribeck (axes)"


@pytest.mark.parametrize("axis", [0, 2])
def test_a_slow_loop_is_dahl_s_closed_form(axis):
    """Half a loop from F0: F = C - (C - F0) exp(-sigma0 (x - x0)/C), and back with the other sign."""
    own = study(law="dahl", stiffness=STIFF).axes[axis]
    level, stiff = COULOMB[axis], STIFF[axis]
    count = len(own.travel) // 3
    up = level * (1.0 - np.exp(-stiff * own.travel[:count] / level))
    np.testing.assert_allclose(own.loop[:count], up, rtol=1e-9, atol=1e-12)
    gone = own.travel[count] - own.travel[count : 2 * count]
    back = -level + (level + up[-1]) * np.exp(-stiff * gone / level)
    np.testing.assert_allclose(own.loop[count : 2 * count], back, rtol=1e-9, atol=1e-12)
    assert own.bends == pytest.approx(level / stiff)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 0.6])
def test_a_loop_has_the_slope_of_its_law(exponent):
    """dF/dx = sigma0 w^a on the way up, by differences."""
    own = study(law="dahl", stiffness=STIFF, dahl_exponent=exponent).axes[0]
    way, force = own.travel[:60], own.loop[:60]
    left = np.maximum(1.0 - 0.5 * (force[1:] + force[:-1]) / COULOMB[0], 0.0)
    np.testing.assert_allclose(np.diff(force) / np.diff(way), STIFF[0] * left**exponent, rtol=0.01, atol=2.0)


def test_lugre_breaks_away_at_less_where_the_force_rises_faster():
    """From near the breakaway level at slow rates down towards the Coulomb level, while damping hardly counts."""
    numbers = {"stribeck_speed": (2e-3, 2e-3, 2e-2), "stiffness": STIFF, "damping": (5.0, 5.0, 0.05)}
    own = study(law="lugre", breakaway=BREAKAWAY, **numbers).axes[0]
    assert own.breakaway[0] == pytest.approx(BREAKAWAY[0], rel=0.05)
    assert (np.diff(own.breakaway[:3]) < 0.0).all()
    assert own.breakaway[-1] > 0.9 * COULOMB[0]
    assert own.law == "LuGre (axes)"


def test_every_place_counts():
    """Direction and wheels at once: the disc and the levers of the wheels add up; wheel 1 does not turn along x."""
    way, rim = DirectionFriction(coulomb=(1.0, 1.0), law="dahl", stiffness=1e4), WheelFriction(coulomb=0.5)
    found = friction_study(AXEBOT.replace(friction=Friction(direction=way, wheels=rim)))
    assert found.axes[0].holds[0] == pytest.approx(1.0 + 0.5 * math.sqrt(3.0))
    assert found.axes[0].law == "Dahl (direction) + Coulomb (wheels)"
    assert found.axes[2].holds[0] == pytest.approx(0.5 * 0.3)
    assert "creeps" in codes(found.notes)
    assert {row["axis"] for row in found.document().data["axes"]} == {"x", "y", "yaw"}
