"""Laws of friction that the robot file lacks: named, taken by the ladder, and what holds with them.

Logs of the integrators of tests/reference, which share no code with simulation/.
"""

import numpy as np
import pytest

from benchmarks.laws_ladder import of_law, right
from omnidyn.identification.structure.missing.laws import arm, bent, bristled, held_above, may_break_away, may_fall
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.friction.kinds import LUGRE
from omnidyn.model.robot_file import load_robot


@pytest.mark.parametrize("name, seed", [("Stribeck", 0), ("Dahl", 1), ("LuGre", 0)])
def test_a_law_that_the_file_lacks_is_named_and_taken(name, seed):
    """Its fall, or the way that bristles bend, is 10 standard errors: found, first or second, the first step, and
    only noise is left. Of Dahl and LuGre each has a key of its own. (Of Dahl's log 0 one of two 95 % intervals misses.)
    """
    log, early = of_law(name, 10.0, seed)
    assert log.found
    assert early
    assert log.cause
    assert log.after == [True, True]
    assert log.words.endswith("the residuals hold nothing but noise")


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(2, id="two of three axes never moved"),
        pytest.param(7, id="without the law viscous friction stands at its bound"),
        pytest.param(9, id="only the law tells that something is left, and what it leaves has less memory"),
    ],
)
def test_a_law_of_five_standard_errors_is_taken(seed):
    """Logs in which it went unseen: numbers of axes at rest were counted, those at a bound not, noise was too long."""
    log, early = of_law("Stribeck", 5.0, seed)
    assert log.found
    assert early
    assert log.cause
    assert log.words.endswith("the residuals hold nothing but noise")


def test_a_law_is_taken_where_a_linear_step_of_one_block_leads_far_astray():
    """One block alone tells of the speed; what a fit to the others predicts there is simulated."""
    log, _ = of_law("Stribeck", 5.0, 17)
    assert log.found
    assert log.cause
    assert log.words.endswith("the residuals hold nothing but noise")


def test_breakaway_is_offered_where_friction_holds_no_more_than_it_slides_with():
    """Of the paper's robot one law, as before; along the direction of travel a level of that, and one of turning."""
    box = load_robot("axebot")
    assert may_break_away(box.friction) == ["friction.axes"]
    round_ = DirectionFriction(coulomb=(2.0, 1.6), yaw_coulomb=0.1)
    both = box.replace(friction=Friction(direction=round_, wheels=WheelFriction(coulomb=(0.4, 0.5, 0.6))))
    assert may_break_away(both.friction) == ["friction.direction", "friction.wheels"]
    held = held_above(both, "friction.direction", np.array([1.5, 1.2]))
    assert held == {"breakaway": (3.0, pytest.approx(2.4)), "yaw_breakaway": pytest.approx(0.12)}
    assert held_above(both, "friction.wheels", np.array([2.0])) == {"breakaway": (0.8, 1.0, 1.2)}
    rests = round_.replace(breakaway=(2.5, 2.0))
    assert may_break_away(Friction(direction=rests)) == []


def test_what_may_fall_is_level_at_every_speed():
    axes = AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))
    assert may_fall(Friction(axes=axes)) == ["friction.axes"]
    falling = axes.replace(breakaway=(2.8, 1.9, 0.13), stribeck_speed=(0.02, 0.02, 0.2))
    assert may_fall(Friction(axes=falling, wheels=WheelFriction(coulomb=0.4))) == ["friction.wheels"]


def test_dahls_bristles_on_the_axes_fall_with_lugres_law_only():
    axes = AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))
    robot = load_robot("axebot").replace(friction=Friction(axes=axes))
    dahl = bent(robot, 1e-3)
    assert (dahl.axes.law, dahl.axes.breakaway) == ("dahl", None)
    assert may_fall(dahl) == []
    assert bristled(robot.replace(friction=dahl), 5e-3).axes.stiffness == dahl.axes.stiffness


def test_the_law_that_is_right_is_kept():
    log, _ = right(1)
    assert log.steps == 0
    assert log.before == log.after == [True, True]


def test_bristles_begin_as_long_as_they_are_said_to_bend():
    """On every axis, at the rims; a fall that is there stays."""
    axes = AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))
    robot = load_robot("axebot").replace(friction=Friction(axes=axes))
    lugre = bristled(robot, 1e-3).axes
    assert lugre.law == LUGRE
    lengths = np.array(axes.coulomb) / np.array(lugre.stiffness) * [1.0, 1.0, arm(robot)]
    assert lengths == pytest.approx([1e-3] * 3)
    falling = axes.replace(breakaway=(2.8, 1.9, 0.13), stribeck_speed=(0.02, 0.02, 0.2))
    again = bristled(robot.replace(friction=Friction(axes=falling)), 1e-3).axes
    assert (again.breakaway, again.stribeck_speed) == (falling.breakaway, falling.stribeck_speed)
