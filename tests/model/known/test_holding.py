"""Levels of breakaway by their keys: lists that appear, and what none is below."""

import numpy as np

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.known.breakaway_levels import holding, slides_least
from omnidyn.model.robot_file import load_robot

AXEBOT = load_robot("axebot")


def of(robot, levels):
    return holding(robot, levels).friction


def test_a_level_puts_its_list_there_and_the_others_follow_coulomb():
    assert of(AXEBOT, {"friction.axes.breakaway[1]": 1.9}).axes.breakaway == (2.2, 1.9, 0.099)
    along = AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(2.0, 1.6), yaw_coulomb=0.1)))
    found = of(along, {"friction.direction.breakaway[0]": 2.5, "friction.direction.yaw_breakaway": 0.13}).direction
    assert (found.breakaway, found.yaw_breakaway) == ((2.5, 1.6), 0.13)
    rolling = AXEBOT.replace(friction=Friction(wheels=WheelFriction(coulomb=0.4)))
    assert of(rolling, {"friction.wheels.breakaway": 0.5}).wheels.breakaway == 0.5
    assert of(rolling, {"friction.wheels.breakaway[2]": 0.5}).wheels.breakaway == (0.4, 0.4, 0.5)
    assert holding(AXEBOT, {}) is AXEBOT


def test_none_is_below_the_coulomb_friction_of_its_own_way():
    axes = AxesFriction(viscous=(1.0,) * 3, coulomb=(2.0, 1.0, 0.1), coulomb_backward=(3.0, 1.0, 0.1))
    box = AXEBOT.replace(friction=Friction(axes=axes))
    found = of(box, {"friction.axes.breakaway[0]": 0.0, "friction.axes.breakaway_backward[0]": 2.5}).axes
    assert (found.breakaway, found.breakaway_backward) == ((2.0, 1.0, 0.1), (3.0, 1.0, 0.1))
    assert slides_least(box, "friction.axes.breakaway_backward[0]") == 3.0
    uneven = AXEBOT.replace(friction=Friction(wheels=WheelFriction(coulomb=(0.4, 0.5, 0.6))))
    assert of(uneven, {"friction.wheels.breakaway": 0.55}).wheels.breakaway == (0.55, 0.55, 0.6)
    assert slides_least(uneven, "friction.wheels.breakaway") == 0.4
    np.testing.assert_allclose(slides_least(uneven, "friction.wheels.breakaway[1]"), 0.5)
