"""Laws that hold for every robot the implicit engine serves: limits that must meet, and symmetries.

Each compares two runs whose answers must be the same (or mirrored, turned) by the law, not by the code.
"""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels
from omnidyn.simulation.simulate import simulate
from tests.support.friction_shapes import AXEBOT, SHAPES, implicit, shaped
from tests.support.mixed_robots import random_robot, random_voltages

TOL = 1e-7
NEAR = {"rtol": 0.0, "atol": 10 * TOL}


def program(seed, wheels=3, rows=40, scale=6.0):
    """Random levels, each held for a few rows, with stretches of nothing and of little."""
    random = np.random.default_rng(seed)
    levels = np.round(random.uniform(-scale, scale, (rows // 4, wheels)), 3)
    levels[::5] = 0.0
    levels[2::5] *= 0.1
    return np.repeat(levels, 4, axis=0)


def near(one, other, twist=1.0):
    np.testing.assert_allclose(other.twist[:, :2], (one.twist * twist)[:, :2], **NEAR)
    np.testing.assert_allclose(other.twist[:, 2], (one.twist * twist)[:, 2], rtol=0.0, atol=100 * TOL)


# --- limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1.0, 1.3])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_disc_is_the_box_on_a_single_axis(axis, ratio):
    """C v/|v| = C sgn v along one axis; the box runs on the exact engine."""
    box = AxesFriction(viscous=(0.9, 0.9, 0.01), coulomb=(2.0, 2.0, 0.1), breakaway=(2.0 * ratio, 2.0 * ratio, 0.1))
    disc = DirectionFriction(
        coulomb=(2.0, 2.0), breakaway=(2.0 * ratio, 2.0 * ratio), viscous=0.9, yaw_coulomb=0.1, yaw_viscous=0.01
    )
    pattern = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])[axis]
    voltage = np.outer([3.0, -2.0, 0.5, 0.0, 0.1, 4.0, 0.8, -0.66, -0.9], pattern)
    one = simulate(AXEBOT.replace(friction=Friction(axes=box)), voltage, 0.07)
    other = simulate(AXEBOT.replace(friction=Friction(direction=disc)), voltage, 0.07, tol=TOL)
    assert "exact" in one.source
    assert ("Coulomb" if ratio == 1.0 else "implicit") in other.source
    near(one, other)
    np.testing.assert_array_equal(one.twist == 0.0, other.twist == 0.0)
    assert (np.delete(other.twist, axis, axis=1) == 0.0).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_without_inductance_the_windings_settle(shape):
    """L -> 0: the gap to the quasi-static run falls in proportion to L."""
    voltage = program(1)
    settled = simulate(shaped(shape), voltage, 5e-3, tol=TOL)
    gaps = []
    for inductance in (1.7e-4, 1.7e-5, 1.7e-6):
        robot = shaped(shape, electrical="dynamic", inductance=inductance)
        gaps.append(np.abs(simulate(robot, voltage, 5e-3, tol=TOL).twist - settled.twist).max() / 10.0)
    assert gaps[2] <= 2e-4
    if "breakaway" not in shape and shape != "all":  # there a late start may decide a stop otherwise
        assert gaps[1] <= 0.2 * gaps[0]
        assert gaps[2] <= 0.2 * gaps[1] + 10 * TOL


@pytest.mark.parametrize("electrical", ["quasi-static", "dynamic"])
@pytest.mark.parametrize("shape", SHAPES)
def test_what_is_switched_off_is_absent(shape, electrical):
    """A limit never reached and an efficiency of 1 change not one bit."""
    bare = implicit(shaped(shape, electrical=electrical, inductance=1e-3))
    off = shaped(shape, electrical=electrical, inductance=1e-3, current_limit=100.0, gear_efficiency=1.0)
    for tol in (1e-5, None):
        one, other = (simulate(robot, program(2), 5e-3, tol=tol) for robot in (bare, implicit(off)))
        for channel in ("twist", "pose", "current", "wheel_speed"):
            np.testing.assert_array_equal(getattr(one, channel), getattr(other, channel))


def test_the_paper_robot_on_either_engine():
    """Table 3 on the implicit engine, kept from the exact one by a drop of next to nothing: to tol, rests alike."""
    for seed in range(5):
        voltage = program(10 + seed)
        one, other = simulate(AXEBOT, voltage, 5e-3), simulate(implicit(AXEBOT), voltage, 5e-3, tol=TOL)
        near(one, other)
        np.testing.assert_allclose(other.pose, one.pose, rtol=0.0, atol=10 * TOL)
        np.testing.assert_array_equal(one.twist == 0.0, other.twist == 0.0)


def test_small_drop_and_loss_change_little():
    """V_d -> 0 and eta -> 1 meet their absence in proportion."""
    plain = simulate(shaped("ellipse and wheels"), program(3), 5e-3, tol=TOL)
    gaps = []
    for small in (1e-3, 1e-4):
        robot = shaped("ellipse and wheels", voltage_drop=small, gear_efficiency=1.0 - small)
        gaps.append(np.abs(simulate(robot, program(3), 5e-3, tol=TOL).twist - plain.twist).max())
    assert gaps[0] <= 0.03
    assert gaps[1] <= 0.2 * gaps[0]


def square(count, resistance):
    """`count` equal wheels evenly spaced, with the resistance that makes the body's damping the same."""
    return Robot(
        name=f"{count} wheels",
        body=Body(mass=1.5, inertia=0.025, rotating_frame=True),
        wheels=Wheels(
            azimuth_deg=tuple(45.0 + 360.0 / count * k for k in range(count)), robot_radius=0.1, wheel_radius=0.035
        ),
        motor=Motor(
            resistance=resistance, torque_constant=0.0059, emf_constant=0.0059, gear_ratio=19.0, voltage_limit=20.0
        ),
        friction=SHAPES["ellipse"],
    )


@pytest.mark.parametrize("count", [4, 5, 6])
def test_more_wheels_move_the_body_as_three(count):
    """G G^T grows with the count, so resistance n/3 R gives the same damping, and G+ u the same wrench: same motion."""
    three, many = square(3, 1.69), square(count, 1.69 * count / 3.0)
    voltage = program(4, scale=4.0)
    wrench = voltage @ three.wheels.wrench_matrix.T / 1.69
    other = wrench @ np.linalg.pinv(many.wheels.wrench_matrix).T * (1.69 * count / 3.0)
    assert np.abs(other).max() < 20.0
    one, two = simulate(three, voltage, 5e-3, tol=TOL), simulate(many, other, 5e-3, tol=TOL)
    near(one, two)
    np.testing.assert_array_equal(one.twist == 0.0, two.twist == 0.0)


@pytest.mark.parametrize("turns, settled", [(False, (1.088, 0.0, 3.92)), (True, (0.875, -0.363, 3.92))])
def test_the_turning_example(turns, settled):
    """EVIDENCE.md, section 1: u = (1.5, 5.5, -2.5) V with and without the terms of the turning frame."""
    robot = implicit(AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=turns)))
    for tol in (TOL, None):
        run = simulate(robot, np.tile([1.5, 5.5, -2.5], (4000, 1)), 1e-3, tol=tol)
        assert (np.abs(run.twist[-1] - settled) <= [6e-4, 6e-4, 6e-3]).all()
        assert (run.twist[-1, 1] == 0.0) != turns


# --- symmetries -------------------------------------------------------------------------------------------------------


def turned(vectors, degrees):
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return vectors @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("motor", [{}, {"current_limit": 1.2, "voltage_drop": 0.2, "gear_efficiency": 0.8}])
@pytest.mark.parametrize("ratio", [1.0, 1.3])
def test_a_third_of_a_turn_permutes_the_motors(motor, ratio):
    """Disc and equal wheels have the symmetry of the layout: turned by 120 degrees, motor 1 stands where 3 stood."""
    friction = Friction(
        direction=DirectionFriction(coulomb=(1.2, 1.2), breakaway=(1.2 * ratio, 1.2 * ratio), yaw_coulomb=0.05),
        wheels=WheelFriction(coulomb=0.5, coulomb_backward=0.4, viscous=0.2),
    )
    robot = shaped("disc", **motor).replace(friction=friction)
    voltage = program(5)
    run, other = (simulate(robot, v, 5e-3, tol=TOL) for v in (voltage, voltage[:, [2, 0, 1]]))
    np.testing.assert_allclose(other.twist, turned(run.twist, 120.0), rtol=0.0, atol=100 * TOL)
    np.testing.assert_allclose(other.wheel_speed, run.wheel_speed[:, [2, 0, 1]], rtol=0.0, atol=1000 * TOL)
    assert ((other.wheel_speed == 0.0) == (run.wheel_speed[:, [2, 0, 1]] == 0.0)).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_mirror_image(shape):
    """Left for right: wheels 2 and 3 change places, each pushes and holds the other way round."""
    friction = SHAPES[shape]
    w = friction.wheels
    forward, backward = (np.broadcast_to(np.asarray(v, dtype=float), 3) for v in (w.coulomb, w.backward))
    hold_forward, hold_backward = (np.broadcast_to(np.asarray(v, float), 3) for v in (w.hold_forward, w.hold_backward))
    swap = [0, 2, 1]
    mirrored = WheelFriction(
        coulomb=tuple(backward[swap]),
        coulomb_backward=tuple(forward[swap]),
        breakaway=tuple(hold_backward[swap]),
        breakaway_backward=tuple(hold_forward[swap]),
        viscous=w.viscous,
    )
    robot = shaped(shape)
    image = robot.replace(friction=friction.replace(wheels=mirrored))
    voltage = program(6)
    run = simulate(robot, voltage, 5e-3, tol=TOL)
    other = simulate(image, -voltage[:, swap], 5e-3, tol=TOL)
    near(run, other, np.array([1.0, -1.0, -1.0]))
    np.testing.assert_array_equal(run.twist == 0.0, other.twist == 0.0)


@pytest.mark.parametrize("seed", range(0, 40, 3))
def test_rows_may_be_split(seed):
    """Held voltages do not know where rows end: each row cut at a third gives the same run, to the tolerance."""
    robot = random_robot(seed)
    voltage, dt = random_voltages(robot, seed)
    run = simulate(robot, voltage, dt, tol=TOL)
    cut = np.stack([dt / 3.0, dt - dt / 3.0], axis=1).ravel()
    other = simulate(robot, np.repeat(voltage, 2, axis=0), cut, tol=TOL)
    np.testing.assert_allclose(other.twist[::2, :2], run.twist[:, :2], rtol=0.0, atol=20 * TOL)
    np.testing.assert_allclose(other.twist[::2, 2], run.twist[:, 2], rtol=0.0, atol=200 * TOL)
    np.testing.assert_array_equal(other.twist[::2] == 0.0, run.twist == 0.0)


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_the_view_does_not_matter(seed):
    """Another heading and place at the start: the same twist to the last bit, the path turned and moved."""
    robot = random_robot(seed)
    voltage, dt = random_voltages(robot, seed)
    run, moved = (simulate(robot, voltage, dt, pose=pose, tol=1e-5) for pose in ((0.0, 0.0, 0.0), (3.0, -1.0, 0.7)))
    np.testing.assert_array_equal(moved.twist, run.twist)
    expected = turned(run.pose, np.degrees(0.7)) + np.array([3.0, -1.0, 0.7])
    np.testing.assert_allclose(moved.pose, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("seed", range(0, 40, 4))
def test_friction_only_takes_energy(seed):
    """Without voltage the kinetic and magnetic energy of any robot never rises, from any start."""
    robot = random_robot(seed)
    random = np.random.default_rng(seed)
    n = robot.wheels.count
    run = simulate(robot, np.zeros((300, n)), 2e-3, twist=random.normal(size=3) * [0.5, 0.5, 4.0], tol=1e-6)
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    energy = (0.5 * mass * run.twist**2).sum(axis=1)
    if robot.motor.electrical == "dynamic":
        energy = energy + (0.5 * np.array(robot.motor.inductance) * run.current**2).sum(axis=1)
    assert (np.diff(energy) <= 1e-7).all()
    assert (run.twist[-1] == 0.0).all()
