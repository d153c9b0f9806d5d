"""The predictive controller and feed-forward on robots whose friction bends, or rests in a band.

What is predicted is the law of sliding; what that leaves out costs about as much as a bristle bends.
"""

from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.control.mpc.model import numbers
from omnidyn.control.mpc.stages import friction_at
from omnidyn.errors import UnsupportedError
from omnidyn.model.friction import DirectionFriction, Friction
from tests.reference.modes_plant import plant_of

AXEBOT, DT = omnidyn.load_robot("axebot"), 0.02
AXES = AXEBOT.friction.axes
WAY = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
BENDS, BENDS_ALONG = {"stiffness": (1e4, 1e4, 1e2)}, {"stiffness": 1e4, "yaw_stiffness": 1e2}
HOLDS, HOLDS_ALONG = {"breakaway": (2.8, 1.9, 0.13)}, {"breakaway": (2.8, 1.9), "yaw_breakaway": 0.13}
FALLS = HOLDS | {"stribeck_speed": (0.1, 0.1, 1.0)}
FALLS_ALONG = HOLDS_ALONG | {"stribeck_speed": 0.1, "yaw_stribeck_speed": 1.0}


def on_axes(**numbers):
    return AXEBOT.replace(friction=Friction(axes=AXES.replace(**numbers)))


def along(**numbers):
    return AXEBOT.replace(friction=Friction(direction=WAY.replace(**numbers)))


SLIDING = {
    "elasto-plastic": on_axes(law="elastoplastic", **BENDS, **FALLS),
    "Karnopp": on_axes(law="karnopp", **HOLDS),
    "Dahl along": along(law="dahl", dahl_exponent=1.7, **BENDS_ALONG),
    "LuGre along": along(law="lugre", **BENDS_ALONG, **FALLS_ALONG),
    "elasto-plastic along": along(law="elastoplastic", **BENDS_ALONG, **FALLS_ALONG),
    "Karnopp along": along(law="karnopp", **HOLDS_ALONG),
}


def settled(robot, volts):
    """(steady twist under held volts, dry friction there over the mass, as the motors and the drag leave it)."""
    twist = omnidyn.simulate(robot, np.tile(volts, (60, 1)), 0.05, tol=1e-8).twist[-1]
    p, law = plant_of(robot.replace(friction=robot.friction.rigid)), robot.friction
    viscous = np.add(law.axes.viscous, (law.direction.viscous, law.direction.viscous, law.direction.yaw_viscous))
    driven = p.G @ (p.K * (volts - p.E * (p.G.T @ twist)) / p.R)
    return twist, (driven - viscous * twist) / p.mass


@pytest.mark.parametrize("name", SLIDING)
@pytest.mark.some(3)
def test_what_is_predicted_is_the_law_as_a_simulation_slides_on_it(name):
    """Force and slope by two steady motions of `simulate`, a bristle bent as far as it goes, near each other."""
    robot = SLIDING[name]
    own = numbers(robot, DT)
    for volts in ((-4.0, 5.0, 2.0), (4.0, -5.0, -3.0)):
        (a, at_a), (b, at_b) = settled(robot, np.array(volts)), settled(robot, 1.02 * np.array(volts))
        assert np.abs(a).min() > 0.02
        middle, slope = friction_at(own.linear, own.levels, np.ones(3), tuple(0.5 * (a + b)), 1.0, False)
        np.testing.assert_allclose(middle, 0.5 * (at_a + at_b), rtol=1e-4, atol=1e-4)
        np.testing.assert_allclose((b - a) @ np.reshape(slope, (3, 3)), at_b - at_a, rtol=0.02, atol=2e-5)


TRACKED = {
    "elasto-plastic": (on_axes(law="elastoplastic", **BENDS), on_axes),
    "Karnopp": (on_axes(law="karnopp"), on_axes),
    "Dahl along": (along(law="dahl", dahl_exponent=1.5, **BENDS_ALONG), along),
    "LuGre along": (along(law="lugre", **BENDS_ALONG), along),
    "elasto-plastic along": (along(law="elastoplastic", **BENDS_ALONG), along),
    "Karnopp along": (along(law="karnopp"), along),
}


@cache
def error_of_twin(twin, controller):
    """[m] of a robot that sticks; several laws have the same one."""
    robot = twin()
    return omnidyn.track(robot, "eight", controller, plant=robot).rmse_position


@pytest.mark.parametrize("controller", ["mpc", "feedforward"])
@pytest.mark.parametrize("name", TRACKED)
@pytest.mark.some(3)
def test_a_path_is_followed_as_on_the_twin_that_sticks(name, controller):
    """Within what a bristle bends when it is turned round, 2 C/sigma0 = 0.44 mm; in Karnopp's band, a hundredth.

    Feed-forward looks at nothing: turned round again and again, elasto-plastic bristles lead it astray by 1.5 % more.
    """
    robot, twin = TRACKED[name]
    found, rigid = omnidyn.track(robot, "eight", controller, plant=robot).rmse_position, error_of_twin(twin, controller)
    more = 1.02 if name == "elasto-plastic" and controller == "feedforward" else 1.0
    assert found <= (1.01 * rigid if "Karnopp" in name else more * rigid + 2.0 * 2.2 / 1e4)


def slippery(robot):
    return robot.replace(wheels=robot.wheels.replace(traction_mu=0.6, wheel_inertia=2e-6))


@pytest.mark.long
def test_a_path_is_followed_where_wheels_slip_and_bristles_bend_along_it():
    """As on the twin that sticks: there the grip of the floor, and no bristle, is what is missed by."""
    bends, sticks = TRACKED["LuGre along"]
    found, rigid = (
        omnidyn.track(each, "eight", "mpc", plant=each).rmse_position for each in map(slippery, (bends, sticks()))
    )
    assert found <= 1.1 * rigid


@pytest.mark.parametrize("name", ["Karnopp", "Karnopp along"])
def test_what_cannot_slip_is_refused_by_name(name):
    floor = slippery(SLIDING[name])
    with pytest.raises(UnsupportedError, match='law = "karnopp"'):
        omnidyn.track(floor, "eight", "mpc", plant=floor)
