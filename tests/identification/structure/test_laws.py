"""Laws of friction that the robot file lacks: named, taken by the ladder, and what holds with them.

Logs of the integrators of tests/reference, which share no code with simulation/.
"""

import numpy as np
import pytest

from benchmarks.identification.laws_ladder import of_law, right
from omnidyn.identification.structure.missing.laws import (
    arm,
    bent,
    bristled,
    held_above,
    lowered,
    may_break_away,
    other_laws,
    table_of,
)
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.friction.kinds import LUGRE
from omnidyn.model.robot_file import load_robot


@pytest.mark.parametrize("name, seed", [("Dahl", 1), ("LuGre", 0)])
@pytest.mark.long
def test_a_law_that_the_file_lacks_is_named_and_taken(name, seed):
    """Its fall, or the way that bristles bend, is 10 standard errors: found, first or second, the first step, and
    only noise is left. Of Dahl and LuGre each has a key of its own. (Of Dahl's log 0 one of two 95 % intervals misses.)
    """
    log, early = of_law(name, 10.0, seed)
    assert log.found
    assert early
    assert log.cause
    assert log.after == [True, True]
    assert "the residuals hold nothing but noise" in log.words


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(7, id="without the law viscous friction stands at its bound"),
    ],
)
@pytest.mark.long
def test_a_law_of_five_standard_errors_is_taken(seed):
    """Logs in which it went unseen: numbers of axes at rest were counted, those at a bound not, noise was too long."""
    log, early = of_law("Stribeck", 5.0, seed)
    assert log.found
    assert early
    assert log.cause
    assert "the residuals hold nothing but noise" in log.words


def test_a_law_is_taken_where_a_linear_step_of_one_block_leads_far_astray():
    """One block alone tells of the speed; what a fit to the others predicts there is simulated."""
    log, _ = of_law("Stribeck", 5.0, 17)
    assert log.found
    assert log.cause
    assert "the residuals hold nothing but noise" in log.words


BOX = AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))
FALLING = BOX.replace(breakaway=(2.8, 1.9, 0.13), stribeck_speed=(0.02, 0.02, 0.2))
ROUND = DirectionFriction(coulomb=(2.2, 1.5), yaw_coulomb=0.099)
ROLLING = WheelFriction(coulomb=(0.4, 0.5, 0.6))
STIFF = {"law": "dahl", "stiffness": 1e3, "yaw_stiffness": 10.0, "dahl_exponent": 1.5}
AXES, DIRECTION, WHEELS = "friction.axes", "friction.direction", "friction.wheels"
THREE = ("stribeck_speed", "stiffness", "damping")


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


@pytest.mark.parametrize(
    ("friction", "expected"),
    [
        (Friction(axes=BOX), {AXES: THREE}),
        (Friction(axes=BOX, wheels=WheelFriction(viscous=0.3)), {AXES: THREE}),
        (Friction(axes=BOX.replace(breakaway=(2.8, 1.9, 0.13))), {AXES: ("stribeck_speed", "damping")}),
        (Friction(axes=BOX.replace(coulomb_backward=(2.0, 2.0, 0.1))), {AXES: ("stribeck_speed",)}),
        (Friction(axes=FALLING, wheels=ROLLING), {AXES: ("damping",), WHEELS: THREE}),
        (Friction(direction=ROUND), {DIRECTION: THREE}),
        (Friction(direction=ROUND.replace(**STIFF)), {DIRECTION: ("damping",)}),
        (Friction(wheels=ROLLING.replace(coulomb_backward=0.3)), {WHEELS: ("stribeck_speed",)}),
        (Friction(wheels=ROLLING.replace(law="elastoplastic", stiffness=1e3)), {WHEELS: ("stribeck_speed",)}),
    ],
)
def test_a_table_may_take_the_laws_that_it_has_not_where_it_has_coulomb_friction(friction, expected):
    assert other_laws(friction) == [f"{table}.{name}" for table, names in expected.items() for name in names]


def test_dahls_bristles_become_lugres_as_stiff_as_they_are():
    """With a fall, and without an exponent that LuGre has not."""
    robot = load_robot("axebot")
    for table, own in ((AXES, {"axes": BOX}), (DIRECTION, {"direction": ROUND}), (WHEELS, {"wheels": ROLLING})):
        dahl = bent(robot.replace(friction=Friction(**own)), table, 1e-3)
        law = table_of(dahl, table)
        assert (law.law, law.breakaway, law.stribeck_speed) == ("dahl", None, None)
        softer = dahl.replace(**{table.rpartition(".")[2]: law.replace(dahl_exponent=1.5)})
        lugre = table_of(bristled(robot.replace(friction=softer), table, 5e-3), table)
        assert (lugre.law, lugre.stiffness, lugre.dahl_exponent) == ("lugre", law.stiffness, 1.0)
        assert np.array(lugre.breakaway) == pytest.approx(1.3 * np.array(law.coulomb))
        if table == DIRECTION:
            assert lugre.yaw_stiffness == law.yaw_stiffness
            assert lugre.yaw_breakaway == pytest.approx(1.3 * law.yaw_coulomb)


def test_no_bristles_are_tried_that_the_motors_could_not_bend():
    """Of a level that a fit drove far beyond what moves the robot; what stands up to it stays."""
    stall = 3.0 * 6.0 / 1.69 * 0.0059 * 19.0 / 0.035  # [N] of all three wheels
    wide = ROUND.replace(coulomb=(1e6, 1.5), yaw_coulomb=1e6)
    boxed, rolling = BOX.replace(coulomb=(2.2, 1.5, 1e6)), ROLLING.replace(coulomb=1e6)
    everywhere = Friction(axes=boxed, direction=wide, wheels=rolling)
    robot = load_robot("axebot").replace(friction=everywhere)
    assert lowered(robot, AXES).friction.axes.coulomb == pytest.approx((2.2, 1.5, 0.2 * stall))
    found = lowered(robot, DIRECTION).friction.direction
    assert (*found.coulomb, found.yaw_coulomb) == pytest.approx((2.0 * stall, 1.5, 0.2 * stall))
    assert lowered(robot, WHEELS).friction.wheels.coulomb == pytest.approx(2.0 * stall)


def test_the_law_that_is_right_is_kept():
    log, _ = right(1)
    assert log.steps == 0
    assert log.before == log.after == [True, True]


def test_bristles_begin_as_long_as_they_are_said_to_bend():
    """At every table, at the rims; a fall that is there stays."""
    robot = load_robot("axebot")
    lugre = bristled(robot.replace(friction=Friction(axes=BOX)), AXES, 1e-3).axes
    assert lugre.law == LUGRE
    lengths = np.array(BOX.coulomb) / np.array(lugre.stiffness) * [1.0, 1.0, arm(robot)]
    assert lengths == pytest.approx([1e-3] * 3)
    again = bristled(robot.replace(friction=Friction(axes=FALLING)), AXES, 1e-3).axes
    assert (again.breakaway, again.stribeck_speed) == (FALLING.breakaway, FALLING.stribeck_speed)
    dahl = bent(robot.replace(friction=Friction(direction=ROUND)), DIRECTION, 1e-3).direction
    assert (dahl.stiffness, dahl.yaw_stiffness) == pytest.approx((1.85 / 1e-3, 0.099 * arm(robot) / 1e-3))
    assert bent(robot.replace(friction=Friction(wheels=ROLLING)), WHEELS, 1e-3).wheels.stiffness == pytest.approx(500.0)
