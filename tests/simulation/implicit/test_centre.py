"""A centre of mass beside that of the wheels: against the equations of the centre of mass, and what must be conserved.

There a body is plain: m a = F along the axes of the room, I alpha = torque. So is the reference of modes.py, and so is
the integrator below; the twist of the centre of the wheels is worked out from theirs.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.dynamics import acceleration, drive_wrench
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.surroundings import Floor
from omnidyn.simulation.simulate import simulate
from tests.reference import bristles
from tests.reference.modes import plant_of, reference
from tests.reference.modes_stepper import stepped
from tests.support.events import meet_modes
from tests.support.friction_shapes import AXEBOT, implicit
from tests.support.mixed_robots import (
    eager,
    random_robot,
    random_voltages,
    with_bristles,
    with_centre,
    with_spin,
    with_stribeck,
)

ROWS = 15
SCALAR = [seed for seed in range(40) if seed % 7 in (0, 2, 3)]  # axes, wheels, both: no ellipse
CENTRE = (0.03, -0.05)
FREE = AXEBOT.motor.replace(torque_constant=1e-9, emf_constant=1e-9)  # no force worth the name


def beside(robot, centre=CENTRE, turns=True, **body):
    return robot.replace(body=robot.body.replace(centre=centre, rotating_frame=turns, **body))


def in_the_room(robot, twist, pose):
    """Of samples of a run: places (n, 2) and velocities (n, 2) of the centre of mass in the room."""
    x, y = robot.body.centre
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    place = pose[:, :2] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    along, across = twist[:, 0] - twist[:, 2] * y, twist[:, 1] + twist[:, 2] * x
    return place, np.stack([cos * along - sin * across, sin * along + cos * across], axis=1)


def by_centre_of_mass(robot, voltage, dt, force, start=(0.0, 0.0, 0.0)):
    """(twist, pose) at the ends of rows of held voltage: Newton in the room, by DOP853.

    force(twist, heading, voltage): wrench on the body at the centre of the wheels, in its axes; gravity aside.
    """
    (x, y), mass, inertia = robot.body.centre, robot.body.mass, robot.body.inertia
    pull = robot.floor.pull(mass)

    def wheels_twist(z):
        cos, sin = np.cos(z[2]), np.sin(z[2])
        along, across = cos * z[3] + sin * z[4], cos * z[4] - sin * z[3]
        return np.array([along + z[5] * y, across - z[5] * x, z[5]])

    def rate(_, z, u):
        cos, sin = np.cos(z[2]), np.sin(z[2])
        f = force(wheels_twist(z), z[2], u)
        about = f[2] - x * f[1] + y * f[0]  # what pushes at the centre of the wheels, about that of mass
        room = np.array([cos * f[0] - sin * f[1], sin * f[0] + cos * f[1]]) + pull
        return [z[3], z[4], z[5], *(room / mass), about / inertia]

    first = np.array([start[0] - start[2] * y, start[1] + start[2] * x])
    z, found = np.array([x, y, 0.0, *first, start[2]]), []
    for u in voltage:
        z = solve_ivp(rate, (0.0, dt), z, method="DOP853", rtol=1e-12, atol=1e-13, args=(u,)).y[:, -1]
        cos, sin = np.cos(z[2]), np.sin(z[2])
        found.append([*wheels_twist(z), z[0] - cos * x + sin * y, z[1] - sin * x - cos * y, z[2]])
    return np.array(found)[:, :3], np.array(found)[:, 3:]


# --- against other integrators ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("spin", [0.0, 3.0])
@pytest.mark.parametrize("seed", SCALAR)
@pytest.mark.some(10)
def test_random_robots_against_the_modes_of_the_centre_of_mass(seed, spin):
    """Every option of motors, dry friction on axes and wheels, with rotors and without: stops, rests, reversals."""
    robot = with_centre(with_spin(random_robot(seed), seed, spin), seed + 40)  # of 16, 16 is a tie of the reference
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    meet_modes(robot, voltage, dt)


@pytest.mark.parametrize("seed", [seed for seed in SCALAR if eager(seed)][:6])
@pytest.mark.some(3)
def test_friction_that_falls_with_the_speed_against_the_modes(seed):
    robot = with_centre(with_stribeck(random_robot(seed), seed), seed)
    voltage, dt = (each[:8] for each in random_voltages(robot, seed))
    truth, run = reference(robot, voltage, dt), simulate(robot, voltage, dt, tol=1e-7)
    assert (np.abs(run.twist - truth.twist) / [1.0, 1.0, 10.0]).max() <= 1e-6
    np.testing.assert_array_equal(run.twist == 0.0, truth.stuck[:, :3])


@pytest.mark.parametrize("seed", SCALAR[:6])
@pytest.mark.some(3)
def test_friction_that_bends_against_its_differential_equation(seed):
    robot = with_centre(with_bristles(random_robot(seed), seed), seed)
    voltage, dt = (each[:6] for each in random_voltages(robot, seed))
    twist, pose = bristles.reference(robot, voltage, dt)
    run = simulate(robot, voltage, dt, tol=1e-6)
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() <= 1e-6
    assert np.abs(run.pose - pose).max() <= 1e-6
    assert not run.warnings


def test_karnopp_s_law_with_a_narrow_band_is_the_law_that_sticks():
    """Masses that couple gather momentum together; the band stands in for Coulomb friction, which sticks exactly."""
    axes = AXEBOT.friction.axes.replace(law="karnopp", karnopp_speed=(1e-7, 1e-7, 1e-6))
    volts = np.repeat(np.random.default_rng(4).uniform(-6.0, 6.0, (12, 3)), 10, axis=0)
    sticks, gathers = (
        simulate(beside(AXEBOT).replace(friction=Friction(axes=own)), volts, 0.01, tol=1e-7).twist
        for own in (AXEBOT.friction.axes, axes)
    )
    assert np.abs(sticks).max() > 0.3
    assert (np.abs(sticks - gathers) / [1.0, 1.0, 10.0]).max() < 1e-5


def test_what_holds_a_robot_is_not_its_mass():
    """Dead zones are those of the robot whose centre stands in the middle, wheel friction and lossy gears included."""
    for seed in (0, 2, 3):
        robot = random_robot(seed)
        for pattern in np.eye(robot.wheels.count):
            one, other = breakaway_voltage(robot, pattern), breakaway_voltage(with_centre(robot, seed), pattern)
            assert other == pytest.approx(one, rel=1e-9)


@pytest.mark.parametrize("seed", [0, 2, 3, 10])
def test_a_centre_in_the_middle_would_not_do(seed):
    """The test above would see it: without the centre the robot is elsewhere by a thousand times its bounds."""
    robot = with_centre(random_robot(seed), seed)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    plain = beside(robot, (0.0, 0.0), robot.body.rotating_frame)
    assert np.abs(simulate(robot, voltage, dt).twist - simulate(plain, voltage, dt).twist).max() > 1e-2


@pytest.mark.parametrize("seed", [0, 2, 3, 10])
@pytest.mark.some(2)
def test_the_reference_keeps_its_energy_and_meets_a_stepper_without_modes(seed):
    robot = with_centre(random_robot(seed), seed)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    assert np.abs(reference(robot, voltage, dt, energy=True).energy).max() < 1e-11
    p, truth = plant_of(robot), reference(robot, voltage, dt)
    coarse, fine = (stepped(p, voltage, dt, h)[0] for h in (4e-5, 5e-6))
    x, y = robot.body.centre
    back = np.linalg.inv([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    worst, better = (np.abs(run @ back.T - truth.twist[1:]).max() for run in (coarse, fine))
    assert better < 0.3 * worst
    assert better < 2e-4


@pytest.mark.parametrize("seed", [0, 3, 17])
@pytest.mark.some(1)
def test_the_error_follows_the_tolerance(seed):
    robot = with_centre(random_robot(seed), seed)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    truth = reference(robot, voltage, dt)
    for tol in (1e-3, 1e-4, 1e-5, 1e-6):
        error = np.abs(simulate(robot, voltage, dt, tol=tol).twist - truth.twist) / [1.0, 1.0, 10.0]
        assert error.max() <= tol, tol


@pytest.mark.parametrize("centre", [CENTRE, (0.0, 0.06), (-0.09, 0.0)])
@pytest.mark.parametrize("tilt", [0.0, 4.0])
def test_an_ellipse_that_slides_and_a_slope_against_newton_in_the_room(centre, tilt):
    """Friction along the direction of travel of the centre of the wheels; gravity pulls at that of mass."""
    ellipse = DirectionFriction(coulomb=(0.6, 0.4), viscous=0.9, yaw_coulomb=0.0, yaw_viscous=0.01)
    robot = beside(AXEBOT, centre).replace(friction=Friction(direction=ellipse), floor=Floor(tilt=tilt, downhill=70.0))
    voltage = np.repeat([[1.0, 5.0, -4.0], [3.0, 3.0, -2.0], [-2.0, 5.0, -1.0]], 5, axis=0)

    def force(twist, heading, u):
        vx, vy, omega = twist
        size = max(np.hypot(0.6 * vx, 0.4 * vy), 1e-300)
        dry = np.array([0.36 * vx / size, 0.16 * vy / size, 0.0])
        return drive_wrench(robot, twist, u) - [0.9 * vx, 0.9 * vy, 0.01 * omega] - dry

    start = (0.4, -0.3, 2.0)
    twist, pose = by_centre_of_mass(robot, voltage, 0.02, force, start)
    run = simulate(robot, voltage, 0.02, twist=start, tol=1e-8)
    assert np.hypot(*run.twist[:, :2].T).min() > 0.02  # it never stops: the equations above are smooth
    assert np.abs(run.twist[1:] - twist).max() <= 1e-7
    assert np.abs(run.pose[1:] - pose).max() <= 1e-7


def test_acceleration_is_that_of_the_centre_of_mass():
    """From the wrench at the wheels: a_c = F/m, alpha = torque about it/I; back to the wheels by rigid kinematics."""
    robot = beside(AXEBOT).replace(friction=Friction())
    (x, y), mass, inertia = robot.body.centre, robot.body.mass, robot.body.inertia
    for twist in ([0.3, -0.2, 2.0], [0.0, 0.0, 0.0], [-0.5, 0.1, -4.0]):
        twist = np.array(twist)
        f = drive_wrench(robot, twist, [1.0, 4.0, -2.0])
        omega, alpha = twist[2], (f[2] - x * f[1] + y * f[0]) / inertia
        # v' of the body frame = a - omega x v;   a = a_c - alpha x c + omega^2 c
        wheels = f[:2] / mass - alpha * np.array([-y, x]) + omega**2 * np.array([x, y])
        expected = [*(wheels - omega * np.array([-twist[1], twist[0]])), alpha]
        np.testing.assert_allclose(acceleration(robot, twist, [1.0, 4.0, -2.0]), expected, rtol=1e-12, atol=1e-12)
        stuck = robot.replace(friction=Friction(wheels=AXEBOT.friction.wheels.replace(coulomb=1e-13)))
        np.testing.assert_allclose(acceleration(stuck, twist, [1.0, 4.0, -2.0]), expected, rtol=1e-9, atol=1e-9)


# --- what must be conserved -------------------------------------------------------------------------------------------


def test_a_free_body_keeps_energy_and_momentum_and_its_centre_goes_straight():
    robot = beside(implicit(AXEBOT)).replace(motor=FREE, friction=Friction())
    run = simulate(robot, np.zeros((200, 3)), 0.01, twist=(0.5, -0.3, 5.0), tol=1e-9)
    place, velocity = in_the_room(robot, run.twist, run.pose)
    assert np.abs(run.twist[:, :2] - run.twist[0, :2]).max() > 0.1  # the centre of the wheels circles about it
    np.testing.assert_allclose(velocity, np.tile(velocity[0], (201, 1)), rtol=0, atol=2e-8)
    np.testing.assert_allclose(place, place[0] + run.t[:, None] * velocity[0], rtol=0, atol=2e-8)
    np.testing.assert_allclose(run.twist[:, 2], 5.0, rtol=0, atol=2e-8)  # so angular momentum, anywhere in the room


def test_on_a_slope_the_centre_of_mass_falls_as_a_stone_and_nothing_turns_it():
    robot = beside(implicit(AXEBOT)).replace(motor=FREE, friction=Friction(), floor=Floor(tilt=3.0, downhill=40.0))
    run = simulate(robot, np.zeros((100, 3)), 0.01, twist=(0.2, 0.0, 3.0), tol=1e-9)
    place, velocity = in_the_room(robot, run.twist, run.pose)
    down = 9.81 * np.sin(np.radians(3.0)) * np.array([np.cos(np.radians(40.0)), np.sin(np.radians(40.0))])
    np.testing.assert_allclose(velocity, velocity[0] + run.t[:, None] * down, rtol=0, atol=2e-8)
    np.testing.assert_allclose(
        place, place[0] + run.t[:, None] * velocity[0] + 0.5 * run.t[:, None] ** 2 * down, rtol=0, atol=3e-8
    )
    np.testing.assert_allclose(run.twist[:, 2], 3.0, rtol=0, atol=2e-8)


def test_without_the_turning_frame_energy_stays_too():
    """The paper's simplification leaves out all that goes with omega v and omega^2: nothing then moves what coasts."""
    robot = beside(implicit(AXEBOT), turns=False).replace(motor=FREE, friction=Friction())
    run = simulate(robot, np.zeros((50, 3)), 0.01, twist=(0.5, -0.3, 5.0))
    np.testing.assert_allclose(run.twist, np.tile([0.5, -0.3, 5.0], (51, 1)), rtol=0, atol=1e-9)


def test_a_slope_turns_a_robot_on_casters_like_a_pendulum():
    """Held at the centre of the wheels by stiff friction there, free about yaw: (I + m c^2) theta'' = torque."""
    free = Friction(axes=AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(500.0, 500.0, 0.0)))
    robot = beside(implicit(AXEBOT), (0.05, 0.0)).replace(motor=FREE, friction=free, floor=Floor(tilt=5.0))
    run = simulate(robot, np.zeros((200, 3)), 0.01, pose=(0.0, 0.0, 1.0), tol=1e-8)
    about = robot.body.inertia + robot.body.mass * 0.05**2
    pull = robot.body.mass * 9.81 * np.sin(np.radians(5.0)) * 0.05
    swing = solve_ivp(
        lambda _, z: [z[1], -pull / about * np.sin(z[0])],
        (0.0, 2.0),
        [1.0, 0.0],
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
        t_eval=run.t,
    )
    np.testing.assert_allclose(run.pose[:, 2], swing.y[0], rtol=0, atol=1e-6)
    assert (run.twist[:, :2] == 0.0).all()


# --- limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 2, 6])
def test_a_centre_that_is_none_changes_no_bit(seed):
    robot = random_robot(seed)
    voltage, dt = (each[:8] for each in random_voltages(robot, seed))
    one, other = simulate(robot, voltage, dt), simulate(beside(robot, (0, 0), robot.body.rotating_frame), voltage, dt)
    np.testing.assert_array_equal(one.twist, other.twist)
    near = simulate(beside(robot, (1e-9, 0.0), robot.body.rotating_frame), voltage, dt, tol=1e-8)
    far = simulate(robot, voltage, dt, tol=1e-8)
    assert np.abs(near.twist - far.twist).max() < 1e-5


def test_turning_robot_and_frame_by_a_third_turns_the_motion():
    """The paper's robot looks the same after 120 degrees; the centre of mass must be turned along."""
    turn = np.radians(120.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    smooth = Friction(wheels=AXEBOT.friction.wheels.replace(coulomb=0.3, viscous=0.1))
    robot = beside(AXEBOT).replace(friction=smooth)
    turned = beside(AXEBOT, tuple((rotation @ CENTRE).tolist())).replace(friction=smooth)
    voltage = np.repeat([[1.0, 5.0, -4.0], [0.0, 0.0, 0.0], [3.0, 1.0, -2.0]], 10, axis=0)
    order = [
        int(np.argmin(np.abs(np.angle(np.exp(1j * np.radians(np.array(AXEBOT.wheels.azimuth_deg) - a))))))
        for a in np.array(AXEBOT.wheels.azimuth_deg) - 120.0
    ]
    one, other = simulate(robot, voltage, 0.02), simulate(turned, voltage[:, order], 0.02)
    np.testing.assert_allclose(other.twist[:, :2], one.twist[:, :2] @ rotation.T, rtol=0, atol=2e-6)
    np.testing.assert_allclose(other.twist[:, 2], one.twist[:, 2], rtol=0, atol=2e-5)
