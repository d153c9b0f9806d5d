"""The dead zone of friction of every shape: each level against simulate() just below and just above it."""

import numpy as np
import pytest

from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, dead_zone_force, dead_zone_map
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

AXEBOT, FOUR = load_robot("axebot"), load_robot("four-wheel")
PER_VOLT = 19 * 0.0059 / (1.69 * 0.035)  # g = l K_t/(R r) [N/V] of one wheel
BOX = AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(2.2, 1.5, 0.099))
DISC = DirectionFriction(coulomb=(1.8, 1.8), yaw_coulomb=0.1)
ELLIPSE = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.5, yaw_coulomb=0.1)
WHEELS = WheelFriction(coulomb=0.9)
UNEVEN = WheelFriction(coulomb=(0.7, 0.9, 1.1), coulomb_backward=(0.8, 0.6, 1.0))
DIRECTIONS = np.radians([0.0, 17.0, 30.0, 45.0, 90.0, 120.0, 151.0, 180.0, 233.0, 270.0, 300.0, 341.0])


def with_friction(robot, motor=None, **friction):
    return robot.replace(friction=Friction(**friction), motor=robot.motor.replace(**(motor or {})))


SHAPES = {
    "box": with_friction(AXEBOT, axes=BOX),
    "box, breakaway": with_friction(AXEBOT, axes=BOX.replace(breakaway=(3.0, 1.6, 0.12))),
    "box, turning frame": with_friction(AXEBOT, axes=BOX).replace(body=AXEBOT.body.replace(rotating_frame=True)),
    "disc": with_friction(AXEBOT, direction=DISC),
    "ellipse": with_friction(AXEBOT, direction=ELLIPSE),
    "ellipse, breakaway": with_friction(AXEBOT, direction=ELLIPSE.replace(breakaway=(2.5, 2.0), yaw_breakaway=0.2)),
    "wheels": with_friction(AXEBOT, wheels=WHEELS),
    "wheels, uneven": with_friction(AXEBOT, wheels=UNEVEN),
    "wheels, breakaway": with_friction(AXEBOT, wheels=WHEELS.replace(breakaway=1.3)),
    "disc + wheels": with_friction(AXEBOT, direction=DISC, wheels=WHEELS),
    "box + ellipse + wheels": with_friction(AXEBOT, axes=BOX, direction=ELLIPSE, wheels=UNEVEN),
    "box, drop": with_friction(AXEBOT, {"voltage_drop": 0.4}, axes=BOX),
    "box, lossy gear": with_friction(AXEBOT, {"gear_efficiency": 0.7}, axes=BOX),
    "ellipse + wheels, drop, lossy gear": with_friction(
        AXEBOT, {"voltage_drop": (0.3, 0.4, 0.5), "gear_efficiency": 0.8}, direction=ELLIPSE, wheels=UNEVEN
    ),
    "disc, dynamic, current limit": with_friction(
        AXEBOT, {"electrical": "dynamic", "current_limit": 2.0}, direction=DISC
    ),
    "four wheels, box": with_friction(FOUR, axes=BOX),
    "four wheels, disc": with_friction(FOUR, direction=DISC),
    "four wheels, wheels": with_friction(FOUR, wheels=WHEELS),
    "four wheels, sum, drop, lossy gear": with_friction(
        FOUR, {"voltage_drop": 0.3, "gear_efficiency": 0.75}, axes=BOX, direction=ELLIPSE, wheels=WHEELS
    ),
}


def rests_below_and_moves_above(robot, scale, pattern):
    """Bitwise at rest for 10 s at 0.999; moving within a millisecond at 1.001."""
    assert 0.05 < scale < 5.9
    below = simulate(robot, [0.999 * scale * pattern] * 10, 1.0)
    assert below.twist.tobytes() == np.zeros_like(below.twist).tobytes()
    assert below.pose.tobytes() == np.zeros_like(below.pose).tobytes()
    assert below.wheel_speed.tobytes() == np.zeros_like(below.wheel_speed).tobytes()
    above = simulate(robot, [1.001 * scale * pattern], 0.02)
    assert above.twist[-1].any()
    assert below.warnings == above.warnings == ()


@pytest.mark.parametrize("shape", SHAPES)
def test_every_direction_of_the_map_against_the_simulation(shape):
    robot = SHAPES[shape]
    volts, patterns = dead_zone_map(robot, DIRECTIONS)
    np.testing.assert_array_equal(np.abs(patterns).max(axis=1), 1.0)
    for scale, pattern in zip(volts, patterns, strict=True):
        rests_below_and_moves_above(robot, scale, pattern)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_axis_against_the_simulation(shape):
    robot = SHAPES[shape]
    for pattern in axis_patterns(robot):
        rests_below_and_moves_above(robot, float(breakaway_voltage(robot, pattern)), pattern)


# ---- closed forms ----------------------------------------------------------------------------------------

AROUND = np.radians(np.arange(0.0, 360.0, 7.0))


def most_loaded(robot, directions):
    """Largest traction of a wheel [N] for a unit push, traction of least norm: G^+ e."""
    unit = np.stack([np.cos(directions), np.sin(directions), 0.0 * directions])
    return np.abs(np.linalg.pinv(robot.wheels.wrench_matrix) @ unit).max(axis=0)


@pytest.mark.parametrize("name", ["disc", "four wheels, disc"])
def test_a_disc_takes_the_same_push_in_every_direction(name):
    robot = SHAPES[name]
    np.testing.assert_allclose(dead_zone_force(robot, AROUND), 1.8, rtol=1e-12)
    volts, _ = dead_zone_map(robot, AROUND)
    np.testing.assert_allclose(volts, 1.8 * most_loaded(robot, AROUND) / PER_VOLT, rtol=1e-12)


@pytest.mark.parametrize("name, level", [("ellipse", (2.2, 1.5)), ("ellipse, breakaway", (2.5, 2.0))])
def test_an_ellipse_in_polar_form(name, level):
    """1/sqrt((cos/Sx)^2 + (sin/Sy)^2)."""
    wanted = 1.0 / np.hypot(np.cos(AROUND) / level[0], np.sin(AROUND) / level[1])
    np.testing.assert_allclose(dead_zone_force(SHAPES[name], AROUND), wanted, rtol=1e-12)


@pytest.mark.parametrize(
    "name, level", [("box", (2.2, 1.5)), ("box, breakaway", (3.0, 1.6)), ("four wheels, box", (2.2, 1.5))]
)
def test_of_a_box_the_first_axis_decides(name, level):
    """min(Sx/|cos|, Sy/|sin|): a rectangle."""
    with np.errstate(divide="ignore"):
        wanted = np.minimum(level[0] / np.abs(np.cos(AROUND)), level[1] / np.abs(np.sin(AROUND)))
    np.testing.assert_allclose(dead_zone_force(SHAPES[name], AROUND), wanted, rtol=1e-12)


def test_three_equal_wheels_take_the_same_voltage_in_every_direction():
    """The most loaded wheel gives way at c: c/g volts, whatever the direction, and a hexagon of forces."""
    robot = SHAPES["wheels"]
    np.testing.assert_allclose(dead_zone_map(robot, AROUND)[0], 0.9 / PER_VOLT, rtol=1e-12)
    np.testing.assert_allclose(dead_zone_force(robot, AROUND), 0.9 / most_loaded(robot, AROUND), rtol=1e-12)
    np.testing.assert_allclose(dead_zone_force(robot, np.radians([0.0, 90.0])), [0.9 * np.sqrt(3), 1.35], rtol=1e-12)


def test_a_voltage_drop_comes_on_top_on_one_loaded_axis():
    """Along yaw all wheels carry the same: the drop adds to the breakaway voltage."""
    plain, drop = SHAPES["box"], SHAPES["box, drop"]
    yaw = axis_patterns(plain)[2]
    assert breakaway_voltage(drop, yaw) == pytest.approx(breakaway_voltage(plain, yaw) + 0.4, rel=1e-9)


def test_a_lossy_gear_takes_its_share():
    """Driving power through a gear of efficiency eta: the voltage goes with 1/eta."""
    plain, lossy = SHAPES["box"], SHAPES["box, lossy gear"]
    for pattern in axis_patterns(plain):
        assert breakaway_voltage(lossy, pattern) == pytest.approx(breakaway_voltage(plain, pattern) / 0.7, rel=1e-9)


def test_half_a_turn_of_an_even_robot_changes_nothing():
    for name in ("box", "disc", "ellipse", "wheels", "disc + wheels", "four wheels, sum, drop, lossy gear"):
        one, other = (dead_zone_force(SHAPES[name], AROUND + turn) for turn in (0.0, np.pi))
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_what_never_moves_is_infinite():
    """A current limit below what friction holds."""
    weak = SHAPES["disc, dynamic, current limit"].replace(
        motor=AXEBOT.motor.replace(current_limit=0.1), friction=Friction(direction=DISC)
    )
    assert np.isinf(dead_zone_map(weak, [0.0, 1.0])[0]).all()
    assert np.isinf(dead_zone_force(weak, [0.0, 1.0])).all()


@pytest.mark.parametrize("name", ["disc", "ellipse", "ellipse, breakaway", "four wheels, disc"])
def test_the_closed_form_of_an_ellipse_is_what_the_inclusion_holds(name, monkeypatch):
    """Bisection asks the solver of what sticks, and knows no ellipse."""
    robot = SHAPES[name]
    patterns = np.random.default_rng(3).uniform(-1.0, 1.0, (50, robot.wheels.count))
    closed = breakaway_voltage(robot, patterns)
    monkeypatch.setattr("omnidyn.model.deadzone.direction_holds_alone", lambda robot: False)
    np.testing.assert_allclose(closed, breakaway_voltage(robot, patterns), rtol=1e-9)
