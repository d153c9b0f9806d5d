"""The contract of a shape of Stribeck's fall, asked of all of them: stribeck.py derives all else from it."""

import numpy as np
import pytest

from omnidyn.compiled.kernel import plain
from omnidyn.errors import InputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.friction.stribeck import CHORD, SHAPES, fall, fallen, steepest
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.sliding import sliding_wrench
from omnidyn.simulation.friction_study import friction_study
from tests.reference.modes_plant import FALLS

AXEBOT = load_robot("axebot")
EXPONENTS = (0.5, 1.0, 1.7, 2.0, 4.0)
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099), "breakaway": (2.8, 1.9, 0.13)}


def slope_of(shape, u, exponent):
    """df/du by a complex step, to the last digits."""
    return FALLS[shape](u + 1e-30j, exponent).imag / 1e-30


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_it_falls_from_1_to_0_as_its_formula_says_in_numbers_and_arrays(shape, exponent):
    number, u = list(SHAPES).index(shape), np.geomspace(1e-3, 3.0, 40)
    exact = FALLS[shape](u, exponent)
    found = np.array([fall(each, number, exponent) for each in u])
    np.testing.assert_allclose(found[:, 0], exact, rtol=1e-13)
    np.testing.assert_allclose(found[:, 1], slope_of(shape, u, exponent), rtol=1e-12)
    np.testing.assert_allclose(fallen(-0.03 * u, 1.0 / 0.03, exponent, number), exact, rtol=1e-12)
    assert fall(0.0, number, exponent)[0] == fallen(0.0, 50.0, exponent, number) == 1.0
    assert 0.0 <= fall(1e6, number, exponent)[0] <= 1.1e-3
    assert (np.diff(exact) < 0.0).all()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_its_slope_at_rest_is_that_of_its_formula_or_of_its_chord(shape, exponent):
    chord = (FALLS[shape](CHORD, exponent) - 1.0) / CHORD
    expected = chord if exponent < 1.0 else (slope_of(shape, 0.0, 1.0) if exponent == 1.0 else 0.0)
    number, below = list(SHAPES).index(shape), 0.25 * CHORD
    assert fall(0.0, number, exponent)[1] == pytest.approx(expected, rel=1e-9)
    value = 1.0 + chord * below if exponent < 1.0 else FALLS[shape](below, exponent)
    assert fall(below, number, exponent)[0] == pytest.approx(value, rel=1e-12)
    assert fallen(below, 1.0, exponent, number) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_its_steepest_fall_is_the_steepest_of_a_fine_grid(shape, exponent):
    number, beyond = list(SHAPES).index(shape), np.append(0.0, np.geomspace(1e-6, 30.0, 20001))
    for start in (1e-4, 0.3, 1.1, 4.0):
        most = -slope_of(shape, start + beyond, exponent).min()
        assert steepest(start, number, exponent) == pytest.approx(most, rel=1e-6, abs=1e-150)
    whole = steepest(0.0, number, exponent)
    assert whole == pytest.approx(
        -fall(0.0, number, exponent)[1] if exponent <= 1.0 else steepest(1e-4, number, exponent)
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_a_robot_slides_on_it_wherever_friction_acts(shape):
    """Along each table's own direction, by hand; the study of friction shows the same."""
    more, f = {"stribeck_shape": shape, "stribeck_exponent": 1.5}, FALLS[shape](0.03 / 0.02, 1.5)
    axes = AxesFriction(**LEVELS, stribeck_speed=(0.02, 0.02, 0.2), **more)
    direction = DirectionFriction(coulomb=(2.2, 1.5), breakaway=(2.8, 1.9), stribeck_speed=0.02, **more)
    wheels = WheelFriction(coulomb=0.7, breakaway=0.9, stribeck_speed=0.02, **more)
    forward = np.array([0.03, 0.0, 0.0])
    for name, law, expected in (
        ("axes", axes, 2.2 + 0.6 * f + 0.94 * 0.03),
        ("direction", direction, 2.2 + 0.6 * f),
    ):
        robot = AXEBOT.replace(friction=Friction(**{name: law}))
        assert -sliding_wrench(robot, forward)[0] == pytest.approx(expected, rel=1e-12)
    robot = AXEBOT.replace(friction=Friction(wheels=wheels))
    rims = np.array(robot.wheels.wrench_matrix)[0]
    level = 0.7 + 0.2 * FALLS[shape](np.abs(rims) * 0.03 / 0.02, 1.5)
    assert -sliding_wrench(robot, forward)[0] == pytest.approx((np.abs(rims) * level)[rims != 0.0].sum(), rel=1e-9)
    own = friction_study(AXEBOT.replace(friction=Friction(axes=axes))).axes[0]
    expected = 2.2 + 0.6 * FALLS[shape](np.abs(own.speed) / 0.02, 1.5) + 0.94 * np.abs(own.speed)
    np.testing.assert_allclose(np.abs(own.force), expected, rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_file_keeps_it(shape):
    law = AxesFriction(**LEVELS, stribeck_speed=(0.02, 0.02, 0.2), stribeck_shape=shape)
    robot = AXEBOT.replace(friction=Friction(axes=law))
    assert parse_robot(robot_to_toml(robot)) == robot
    assert (f'stribeck_shape = "{shape}"' in robot_to_toml(robot)) == (shape != "exponential")


def test_another_word_is_refused_with_those_that_there_are():
    with pytest.raises(InputError, match=r"stribeck_shape.*got gauss.*'exponential'.*'lorentzian'"):
        AxesFriction(**LEVELS, stribeck_shape="gauss")


def test_the_formula_is_written_once():
    """In a kernel and in NumPy it is one function."""
    for each in SHAPES.values():
        p = np.array([0.0, 0.3, 2.0])
        np.testing.assert_allclose(plain(each.left)(p)[0], [each.left(one)[0] for one in p], rtol=1e-15)
