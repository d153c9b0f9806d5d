"""Dynamics and state space, eqs (4)-(6), (13), (14): hand formulas, finite differences and printed digits.

Independent sources: A = -(k G G^T + B)/M and friends, typed here from DESIGN.md; numbers of EVIDENCE.md, section 1.
"""

import numpy as np
import pytest
from scipy.linalg import expm

import omnidyn
from omnidyn.errors import InputError
from omnidyn.model.dynamics import (
    acceleration,
    discretise,
    drive_wrench,
    frame_wrench,
    friction_wrench,
    is_decoupled,
    state_space,
)
from omnidyn.model.friction import Friction
from tests.support.robots import random_robot, robot_of


def test_state_space_to_the_digits_of_the_evidence(axebot):
    system = state_space(axebot)
    assert np.diag(system.A).round(4).tolist() == [-6.6967, -6.7100, -7.6840]
    assert system.B.round(4).tolist() == [
        [0.0, 1.0942, -1.0942],
        [-1.2635, 0.6317, 0.6317],
        [7.5807, 7.5807, 7.5807],
    ]
    assert np.diag(system.K).round(4).tolist() == [-1.4667, -1.0, -3.96]
    assert system.time_constants.round(4).tolist() == [0.1493, 0.1490, 0.1301]
    assert system.C.tolist() == np.eye(3).tolist()
    assert system.B[0, 0] == 0.0  # wheel 1 does not push forward: bitwise


@pytest.mark.parametrize("seed", range(5))
def test_state_space_is_the_hand_formula(seed):
    """A = -(k G G^T + B)/M, k = l^2 K_t K_v/(R r^2); input l K_t/(R r) G/M; K = -C/M."""
    p = random_robot(seed)
    phi = np.radians(p.azimuth_deg)
    matrix = np.stack([-np.sin(phi), np.cos(phi), np.full(len(phi), p.robot_radius)])
    mass = np.array([p.mass, p.mass, p.inertia])[:, None]
    per_speed = p.gear_ratio**2 * p.torque_constant * p.emf_constant / (p.resistance * p.wheel_radius**2)
    per_volt = p.gear_ratio * p.torque_constant / (p.resistance * p.wheel_radius)
    system = state_space(robot_of(p))
    np.testing.assert_allclose(system.A, -(per_speed * matrix @ matrix.T + np.diag(p.viscous)) / mass, atol=1e-12)
    np.testing.assert_allclose(system.B, per_volt * matrix / mass, atol=1e-13)
    np.testing.assert_allclose(np.diag(system.K), -np.array(p.coulomb) / mass[:, 0], rtol=1e-14)
    assert np.count_nonzero(system.K) == 3


def test_state_space_is_the_derivative_of_the_dynamics(four_wheel):
    """Central differences of `acceleration` at a sliding twist; exact for a linear law but for rounding."""
    twist, volts, step = np.array([0.3, -0.4, 2.0]), np.array([1.0, -2.0, 3.0, 0.5]), 1e-3
    system = state_space(four_wheel)

    def difference(of, size):
        columns = [(of(step * e) - of(-step * e)) / (2 * step) for e in np.eye(size)]
        return np.stack(columns, axis=1)

    np.testing.assert_allclose(
        difference(lambda d: acceleration(four_wheel, twist + d, volts), 3), system.A, atol=1e-10
    )
    np.testing.assert_allclose(
        difference(lambda d: acceleration(four_wheel, twist, volts + d), 4), system.B, atol=1e-10
    )
    expected = system.A @ twist + system.B @ volts + system.K @ np.sign(twist)
    np.testing.assert_allclose(acceleration(four_wheel, twist, volts), expected, rtol=1e-13)


@pytest.mark.parametrize(
    "volts, speed, axis",
    [
        *[((0.0, u, -u), v, 0) for u, v in ((2.0, 0.435), (3.0, 0.761), (4.0, 1.088))],
        *[((-u, u / 2, u / 2), v, 1) for u, v in ((3.0, 0.698), (4.0, 0.981), (5.0, 1.263))],
        *[((u, u, u), w, 2) for u, w in ((1.5, 3.92), (2.0, 5.40), (2.5, 6.88))],
    ],
)
def test_steady_speeds_of_table_3(axebot, volts, speed, axis):
    """EVIDENCE.md, "Table 3 against Table 1": a robot at that speed does not accelerate (to the printed digits)."""
    system = state_space(axebot)
    settled = np.linalg.solve(-system.A, system.B @ volts + system.K @ np.eye(3)[axis])
    assert settled[axis] == pytest.approx(speed, abs=6e-3 if axis == 2 else 6e-4)
    twist = np.where(np.arange(3) == axis, settled, 0.0)
    np.testing.assert_allclose(acceleration(axebot, twist, volts), 0.0, atol=1e-13)


def test_the_turning_frame(axebot):
    """EVIDENCE.md: 7.5 N at 1 m/s and 5 rad/s; u = (1.5, 5.5, -2.5) V settles at two different twists."""
    volts = (1.5, 5.5, -2.5)
    turning = axebot.replace(body=axebot.body.replace(rotating_frame=True))
    assert frame_wrench(axebot, [1.0, 0.0, 5.0]).tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(frame_wrench(turning, [1.0, 0.0, 5.0]), [0.0, -7.5, 0.0], rtol=1e-15)
    np.testing.assert_allclose(frame_wrench(turning, [0.0, 1.0, 5.0]), [7.5, 0.0, 0.0], rtol=1e-15)
    without, within = (1.088, 0.0, 3.92), (0.875, -0.363, 3.92)
    assert np.abs(acceleration(axebot, without, volts)).max() < 0.05
    assert np.abs(acceleration(turning, within, volts)).max() < 0.05
    assert np.abs(acceleration(turning, without, volts)).max() > 1.0


def test_wrench_of_a_stalled_robot(axebot):
    """u = (0, 2, -2) V: F_v = 2 cos 30 * 2 * l K_t/(R r) and nothing else, exactly."""
    wrench = drive_wrench(axebot, np.zeros(3), [0.0, 2.0, -2.0])
    per_volt = 19 * 0.0059 / (1.69 * 0.035)
    assert wrench[0] == pytest.approx(2 * np.sqrt(3) * per_volt, rel=1e-15)
    assert wrench[1:].tolist() == [0.0, 0.0]


def test_friction_at_rest_balances_up_to_breakaway_then_gives_way_to_coulomb(axebot):
    friction = axebot.friction.axes.replace(breakaway=(3.0, 1.5, 0.099))
    applied = np.array([[2.9, 1.4, -0.09], [3.1, -1.6, 0.1], [3.0, 1.5, -0.099]])
    assert friction.wrench(np.zeros(3), applied).tolist() == [
        [-2.9, -1.4, 0.09],
        [-2.2, 1.5, -0.099],
        [-3.0, -1.5, 0.099],
    ]
    assert friction.wrench([0.5, -0.5, 2.0], np.zeros(3)) == pytest.approx([-2.2 - 0.47, 1.5 + 0.48, -0.099 - 0.02])


TWISTS, VOLTS = np.zeros((2, 3)), np.zeros((2, 3))


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize(
    "twist, voltage, words",
    [
        (TWISTS, np.zeros(4), r"voltage: wrong shape; got \(4,\); expected \(\*batch, 3\); give one value per wheel"),
        (TWISTS, np.zeros((2, 2)), r"voltage: wrong shape; got \(2, 2\)"),
        (TWISTS, 6.0, r"voltage: wrong shape; got \(\)"),
        (np.zeros(2), VOLTS, r"twist: wrong shape; got \(2,\); expected \(\*batch, 3\); give vx, vy and omega"),
        (np.zeros((4, 3)), VOLTS, r"voltage: twist and voltage do not go together; got \(4, 3\) and \(2, 3\)"),
    ],
)
def test_a_wrong_shape_is_refused_by_name(axebot, twist, voltage, words, turning):
    direction = axebot.friction.direction.replace(coulomb=(1.0, 1.0) if turning else (0.0, 0.0))
    robot = axebot.replace(friction=axebot.friction.replace(direction=direction))
    with pytest.raises(InputError, match=words):
        acceleration(robot, twist, voltage)


@pytest.mark.parametrize("dt", [1e-9, 1e-5, 1e-3, 0.02, 0.5, 30.0])
def test_discretisation_is_the_matrix_exponential(axebot, dt):
    """Against scipy's expm of the augmented matrix, which knows nothing of axes."""
    system = state_space(axebot)
    phi = discretise(system, dt)
    inputs = np.hstack([system.B, np.eye(3)])
    augmented = np.zeros((9, 9))
    augmented[:3, :3], augmented[:3, 3:] = system.A, inputs
    exponential = expm(augmented * dt)
    np.testing.assert_allclose(1.0 + np.diag(system.A) * phi, np.diag(exponential[:3, :3]), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(phi[:, None] * system.B, exponential[:3, 3:6], rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(phi, np.diag(exponential[:3, 6:]), rtol=1e-12)


def test_discretisation_of_a_batch_of_steps(axebot):
    phi = discretise(state_space(axebot), np.array([1e-3, 0.1]))
    assert phi.shape == (2, 3)
    assert phi[1].tolist() == discretise(state_space(axebot), 0.1).tolist()


def test_which_layouts_decouple(axebot, four_wheel):
    assert is_decoupled(state_space(axebot))
    assert is_decoupled(state_space(four_wheel))
    skewed = axebot.replace(wheels=axebot.wheels.replace(azimuth_deg=(180.0, -60.0, 60.001)))
    assert not is_decoupled(state_space(skewed))


MOVING = np.array([0.4, -0.2, 1.5])


@pytest.mark.parametrize("name", ["axebot", "mecanum"])
def test_at_an_operating_point_the_turning_frame_and_the_slopes_count(name):
    """By hand: eqs (13) (14), and the derivatives of omega v_y and -omega v_x where the frame turns."""
    robot = omnidyn.load_robot(name)
    plain, found = omnidyn.state_space(robot), omnidyn.state_space(robot, twist=MOVING)
    vx, vy, omega = MOVING
    frame = np.array([[0.0, omega, vy], [-omega, 0.0, -vx], [0.0, 0.0, 0.0]]) * robot.body.rotating_frame
    np.testing.assert_allclose(found.A, plain.A + frame, atol=1e-6)
    np.testing.assert_allclose(found.B, plain.B, atol=1e-9)
    for system in (plain, found):
        np.testing.assert_array_equal(system.D, np.zeros((3, robot.wheels.count)))
    np.testing.assert_array_equal(found.twist, MOVING)
    assert not found.K.any()
    assert not plain.voltage.any()
    np.testing.assert_allclose(omnidyn.acceleration(robot, MOVING, found.voltage), 0.0, atol=1e-10)


def test_a_disc_of_friction_turns_with_the_direction_of_travel():
    """F = -C v/|v|: along the way it has no slope, across it -C/(M |v|); at rest it is left out."""
    robot = omnidyn.load_robot("axebot")
    disc = {"coulomb": (2.0, 2.0), "yaw_coulomb": 0.05, "viscous": 0.7, "yaw_viscous": 0.01}
    bare = robot.replace(friction=Friction(direction=disc | {"coulomb": (0.0, 0.0), "yaw_coulomb": 0.0}))
    robot = robot.replace(friction=Friction(direction=disc))
    viscous = omnidyn.state_space(bare, twist=[0.5, 0.0, 0.0])
    found = omnidyn.state_space(robot, twist=[0.5, 0.0, 0.0])
    np.testing.assert_allclose(found.A - viscous.A, np.diag([0.0, -2.0 / 1.5 / 0.5, 0.0]), atol=1e-5)
    np.testing.assert_allclose(
        np.diag(viscous.A)[:2] - np.diag(omnidyn.state_space(robot).A)[:2], -0.7 / 1.5, atol=1e-6
    )
    resting = omnidyn.state_space(robot, twist=[0.0, 0.0, 0.0])
    np.testing.assert_allclose(resting.A, viscous.A, atol=1e-5)
    np.testing.assert_array_equal(resting.voltage, np.zeros(3))
    with pytest.raises(InputError, match=r"not an operating point; got shape \(1, 3\)"):
        omnidyn.state_space(robot, twist=[[0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"not an operating point; got \[nan, 0.0, 0.0\]; expected finite numbers"):
        omnidyn.state_space(robot, twist=[np.nan, 0.0, 0.0])


def test_wrench_of_friction_is_that_of_its_law_in_motion_and_balances_the_motors_at_rest():
    robot = omnidyn.load_robot("axebot")
    robot = robot.replace(body=robot.body.replace(rotating_frame=True))  # its terms are no friction
    twist, axes = np.array([0.4, -0.3, 2.0]), robot.friction.axes
    law = -(np.array(axes.viscous) * twist + np.array(axes.coulomb) * np.sign(twist))
    assert friction_wrench(robot, twist, [1.0, 2.0, -1.0]) == pytest.approx(law, rel=1e-12)
    at_rest = friction_wrench(robot, np.zeros(3), [0.0, 0.1, -0.1])
    assert at_rest == pytest.approx(-drive_wrench(robot, np.zeros(3), [0.0, 0.1, -0.1]), abs=1e-12)
    assert at_rest[0] < -0.1
