"""Laws beyond Coulomb's in what is asked of a robot without a run: dead zone, acceleration, feed-forward, file."""

import numpy as np
import pytest

from omnidyn.control.feedforward import voltage_for
from omnidyn.control.table import feedforward_table
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.features import refuse
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, moving_axes
from omnidyn.model.dynamics import acceleration
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml

AXEBOT = load_robot("axebot")
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099), "breakaway": (2.8, 1.9, 0.13)}
FALLS = {"stribeck_speed": (0.02, 0.03, 0.2), "stribeck_exponent": 1.5}
BENDS = {"law": "lugre", "stiffness": (1e5, 1e5, 1e3)}


def of(**parts):
    return AXEBOT.replace(friction=Friction(**parts))


STRIBECK = {
    "axes": of(axes=AxesFriction(**LEVELS, **FALLS)),
    "direction": of(
        direction=DirectionFriction(
            coulomb=(2.2, 1.8),
            breakaway=(2.8, 2.0),
            stribeck_speed=0.03,
            yaw_coulomb=0.1,
            yaw_breakaway=0.13,
            yaw_stribeck_speed=0.3,
        )
    ),
    "wheels": of(wheels=WheelFriction(coulomb=0.7, breakaway=0.9, stribeck_speed=0.02, stribeck_exponent=1.0)),
}


@pytest.mark.parametrize("place", STRIBECK)
def test_feed_forward_is_acceleration_backward(place):
    robot, random = STRIBECK[place], np.random.default_rng(1)
    twist = random.normal(size=(40, 3)) * [0.05, 0.05, 0.4]
    wanted = random.normal(size=(40, 3)) * [1.0, 1.0, 6.0]
    volts = voltage_for(robot, twist, wanted)
    np.testing.assert_allclose(acceleration(robot, twist, volts), wanted, rtol=1e-9, atol=1e-9)


def test_the_dead_zone_of_what_falls_or_bends_is_that_of_its_breakaway():
    plain = of(axes=AxesFriction(**LEVELS))
    edges = breakaway_voltage(plain, axis_patterns(plain))
    for more in (FALLS, FALLS | BENDS, {"law": "karnopp"}):
        robot = of(axes=AxesFriction(**LEVELS, **more))
        np.testing.assert_allclose(breakaway_voltage(robot, axis_patterns(robot)), edges, rtol=1e-9)
        for axis, edge in enumerate(edges):
            assert not moving_axes(robot, 0.999 * edge * axis_patterns(robot)[axis]).any()
            assert moving_axes(robot, 1.001 * edge * axis_patterns(robot)[axis])[axis]


def test_a_file_keeps_every_law():
    for more in (FALLS, FALLS | BENDS, {"law": "karnopp", "karnopp_speed": (1e-3, 1e-3, 1e-2)}):
        robot = of(axes=AxesFriction(**LEVELS, **more))
        assert parse_robot(robot_to_toml(robot)) == robot


@pytest.mark.parametrize(
    "numbers, words",
    [
        ({"stiffness": (1.0, 1.0, 1.0)}, 'stiffness is of law = "dahl" or "lugre".*; this table has law = "coulomb"'),
        ({"law": "lugre"}, 'law = "lugre" needs stiffness'),
        ({"law": "dahl", "stiffness": (1e4, 1e4, 1e2)}, 'law = "dahl" has one level, coulomb: no breakaway'),
        ({"law": "lugre", "stiffness": (1e4, 1e4, 1e2)}, 'law = "lugre" with a breakaway needs stribeck_speed'),
        ({"law": "karnopp", **FALLS}, 'law = "karnopp" slides with coulomb at once'),
        ({"breakaway_backward": (1.0, 1.0, 0.05)}, "breakaway_backward .* is below coulomb"),
        ({"law": "viscous"}, "cannot use this value"),
        ({"stribeck_exponent": 0.1}, "cannot use this value"),
    ],
)
def test_what_does_not_go_together_is_refused_in_words(numbers, words):
    with pytest.raises(InputError, match=words):
        AxesFriction(**LEVELS, **numbers)


def test_yaw_has_one_law():
    with pytest.raises(InputError, match="friction about yaw stands in"):
        of(axes=AxesFriction(**LEVELS, **FALLS), direction=DirectionFriction(coulomb=(1.0, 1.0), yaw_coulomb=0.1))


def test_exports_refuse_or_say_what_they_leave_out():
    for robot in (STRIBECK["axes"], of(axes=AxesFriction(**LEVELS, **FALLS, **BENDS))):
        for kind in ("c-model", "fmu"):
            refuse(kind, robot)
        with pytest.raises(UnsupportedError, match="stribeck_speed"):
            refuse("c-controller", robot)
    with pytest.raises(UnsupportedError, match="falls with the speed"):
        feedforward_table(STRIBECK["axes"])


def test_keys_have_units_and_words():
    for text, unit, words in (
        ("friction.axes.stribeck_speed[0]", "m/s", "Stribeck speed forward"),
        ("friction.axes.stribeck_speed[2]", "rad/s", "Stribeck speed turning"),
        ("friction.axes.stiffness[2]", "N m/rad", "stiffness turning"),
        ("friction.direction.yaw_damping", "N m s", "damping turning"),
        ("friction.wheels.stribeck_exponent", "", "Stribeck exponent at the wheels"),
        ("friction.wheels.damping[1]", "N s/m", "damping of wheel 2"),
    ):
        key = Key.parse(text)
        assert (key.unit, key.words) == (unit, words)
