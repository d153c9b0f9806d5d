"""mjcf: MuJoCo loads it, its motors push as ours do, and it moves as we do as far as its friction can."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.export.bodies.mjcf import mjcf
from omnidyn.model.actuation import clip_voltage
from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.friction import Friction
from omnidyn.model.mass import per_mass
from omnidyn.model.sliding import coulomb_along
from omnidyn.model.wheels import per_wheel
from tests.support.mixed_robots import random_robot, with_spin

mujoco = pytest.importorskip("mujoco")
ROBOT = omnidyn.load_robot("axebot")


def loaded(robot):
    model = mujoco.MjModel.from_xml_string(mjcf(robot).text)
    return model, mujoco.MjData(model)


def simulated(robot, volts, dt=1e-3):
    """(speeds, positions) of the joints after each row. Shape (rows + 1, 3) each."""
    model, data = loaded(robot)
    assert model.opt.timestep == dt
    out = np.zeros((len(volts) + 1, 2, 3))
    for k, row in enumerate(volts):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        out[k + 1] = data.qvel[:3], data.qpos[:3]
    return out[:, 0], out[:, 1]


@pytest.mark.parametrize("seed", range(30))
def test_motors_push_as_ours_do(seed):
    """Without dry friction, at heading 0: accelerations of a random robot at a random speed under random volts."""
    robot, rng = random_robot(seed), np.random.default_rng(seed)
    model, data = loaded(with_spin(robot, seed))
    assert model.nu == robot.wheels.count
    model, data = loaded(robot)
    model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    twist, volts = rng.normal(size=3), rng.uniform(-8.0, 8.0, model.nu)
    data.qvel[:3], data.ctrl[:] = twist, volts
    mujoco.mj_forward(model, data)
    plain = robot.replace(
        motor=robot.motor.replace(voltage_drop=0.0, gear_efficiency=1.0, electrical="quasi-static"),
    )
    rims = robot.wheels.wrench_matrix.T @ twist
    viscous = np.array(robot.friction.axes.viscous) * twist
    along = robot.friction.direction
    viscous += np.array([along.viscous, along.viscous, along.yaw_viscous]) * twist
    wheels = per_wheel(robot.friction.wheels.viscous, model.nu) * rims
    limited = robot.motor.current_limit is not None  # it then bounds the force with the wheel's own friction in it
    wrench = (
        drive_wrench(plain, twist, clip_voltage(robot.motor, volts)) - viscous - robot.wheels.wrench_matrix @ wheels
    )
    if not (limited and np.any(wheels)):
        np.testing.assert_allclose(data.qacc[:3], per_mass(robot, wrench), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(model.actuator_ctrlrange[:, 1], per_wheel(robot.motor.voltage_limit, model.nu))


def test_inertias_are_those_of_a_body():
    for tall in (None, 0.01, 2.0):
        model = mujoco.MjModel.from_xml_string(mjcf(ROBOT, height=tall).text)
        x, y, z = sorted(model.body_inertia[1])
        assert x + y > z
        assert model.body_subtreemass[1] == pytest.approx(1.5, rel=1e-14)
    with pytest.raises(InputError, match="no body has this height; got 0"):
        mjcf(ROBOT, height=0.0)


@pytest.mark.parametrize("pattern", [[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])
def test_within_its_dead_zone_it_drifts_less_than_a_tenth_of_a_millimetre_in_a_minute(pattern):
    volts = 0.5 * breakaway_voltage(ROBOT, pattern) * np.array(pattern)
    _, places = simulated(ROBOT, np.tile(volts, (6_000, 1)))
    assert 10.0 * np.abs(places[-1]).max() < 1e-4  # steady creep: six seconds tell of sixty


@pytest.mark.parametrize("volts", [[0, 2, -2], [0, 4, -4], [-3, 1.5, 1.5], [-5, 2.5, 2.5], [1.5, 1.5, 1.5]])
def test_on_the_runs_of_the_paper_it_is_near(volts):
    """To 2e-3 m/s and 1e-2 rad/s at steps of 1 ms: an implicit Euler's own error."""
    program = np.repeat([volts, np.zeros(3), np.negative(volts)], [800, 400, 400], axis=0)
    run = omnidyn.simulate(ROBOT, program, 1e-3)
    speeds, _ = simulated(ROBOT, program)
    assert run.twist is not None
    assert (np.abs(speeds - run.twist).max(axis=0) < [2e-3, 2e-3, 1.2e-2]).all()


def test_a_turning_robot_is_ours_with_the_turning_frame():
    robot = ROBOT.replace(body=ROBOT.body.replace(rotating_frame=True), friction=type(ROBOT.friction)())
    volts = np.tile([1.5, 5.5, -2.5], (1000, 1))
    _, places = simulated(robot, volts)
    run = omnidyn.simulate(robot, volts, 1e-3)
    assert run.pose is not None
    np.testing.assert_allclose(places[-1], run.pose[-1], atol=2e-2)
    assert not any("Newtonian" in words for words in mjcf(robot).missing)
    assert any("Newtonian" in words for words in mjcf(ROBOT).missing)


@pytest.mark.parametrize("centre", [(0.05, -0.03), (0.0, 0.08)])
def test_a_centre_of_mass_beside_the_wheels_moves_mujoco_as_us(centre):
    """Its bodies know nothing of our equations: accelerations to the last digits, and a run at small steps."""
    body = ROBOT.body.replace(rotating_frame=True, centre=centre)
    robot = ROBOT.replace(body=body, friction=type(ROBOT.friction)())
    model, data = loaded(robot)
    twist, volts = np.array([0.4, -0.3, 5.0]), np.array([1.5, 5.5, -2.5])
    data.qvel[:3], data.ctrl[:] = twist, volts
    mujoco.mj_forward(model, data)
    # qvel is along the axes of the room, which at heading 0 are those of the body: v' there, and omega x v here
    turned = twist[2] * np.array([-twist[1], twist[0], 0.0])
    np.testing.assert_allclose(data.qacc[:3] - turned, omnidyn.acceleration(robot, twist, volts), rtol=1e-9, atol=1e-9)
    rows = np.tile(volts, (10_000, 1))
    model.opt.timestep = 1e-4
    mujoco.mj_resetData(model, data)
    places = []
    for row in rows:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        places.append(data.qpos[:3].copy())
    run = omnidyn.simulate(robot, rows[:100], 1e-2)
    assert run.pose is not None
    np.testing.assert_allclose(np.array(places)[99::100], run.pose[1:], atol=2e-3)
    middle = omnidyn.simulate(robot.replace(body=body.replace(centre=(0.0, 0.0))), rows[:100], 1e-2)
    assert middle.pose is not None
    assert np.abs(middle.pose - run.pose).max() > 0.02


TURNING = ROBOT.replace(body=ROBOT.body.replace(rotating_frame=True))
ELLIPSE = TURNING.replace(
    name="ellipse", friction=Friction(direction={"coulomb": (2.6, 1.5), "viscous": 0.9, "yaw_coulomb": 0.1})
)
BOTH = ELLIPSE.replace(
    name="both",
    friction=ELLIPSE.friction.replace(axes={"coulomb": (0.8, 0.3, 0.05), "viscous": (0.1, 0.1, 0.01)}),
)


@pytest.mark.parametrize("robot", [TURNING, ELLIPSE, BOTH], ids=lambda robot: robot.name)
def test_a_robot_that_drives_and_turns_takes_its_friction_along(robot):
    """Against our engine, pushed one way and the other: 0.44 m/s off where friction stood still in the world."""
    largest = np.zeros(3)
    for volts in ([4.36, 0.5, -2.4], [0.52, 5.22, 3.79], [4.29, -5.6, 2.76]):
        program = np.repeat([volts, np.zeros(3), np.negative(volts)], [800, 400, 400], axis=0)
        speeds, places = simulated(robot, program)
        cos, sin = np.cos(places[:, 2]), np.sin(places[:, 2])
        twist = np.stack(
            [cos * speeds[:, 0] + sin * speeds[:, 1], cos * speeds[:, 1] - sin * speeds[:, 0], speeds[:, 2]], axis=1
        )
        run = omnidyn.simulate(robot, program, 1e-3)
        largest = np.maximum(largest, np.abs(twist - run.twist).max(axis=0))
    assert (largest < [0.006, 0.006, 0.03]).all()


def test_within_its_dead_zone_it_rests_at_any_heading():
    model, data = loaded(TURNING)
    data.qpos[2] = 0.7
    data.ctrl[:] = 0.5 * breakaway_voltage(TURNING, [0.0, 1.0, -1.0]) * np.array([0.0, 1.0, -1.0])
    mujoco.mj_step(model, data, 6000)
    assert 10.0 * np.abs(data.qpos[:2]).max() < 1e-4  # as above


def test_friction_of_other_shapes_is_its_level_along_each_axis():
    robot = omnidyn.load_robot("robotino")
    model, _ = loaded(robot)
    levels = coulomb_along(robot)
    np.testing.assert_allclose(model.dof_frictionloss, [0.0, 0.0, levels[2], 0.0], rtol=1e-12)
    pressure = model.jnt_stiffness[3] * model.qpos_spring[3]
    np.testing.assert_allclose(pressure * model.pair_friction[0, :2], np.sort(levels[:2])[::-1], rtol=1e-12)
    made = mjcf(omnidyn.load_robot("lekiwi").replace(friction=Friction(wheels={"coulomb": 1.0, "viscous": 0.1})))
    assert any("a box along x and y of the body" in words for words in made.missing)
    assert all(words in made.text for words in made.missing)


@pytest.mark.parametrize("name", ['<&"x">', "a--b", "速度", "-->", "'"])
def test_whatever_the_robot_is_called(name):
    model, _ = loaded(ROBOT.replace(name=name))
    assert model.nu == 3


def test_a_robot_that_holds_more_than_it_slides_by_is_said_to_slide_on_a_slope():
    """MuJoCo has one level: between the two it slides, and the copy that is advised holds."""
    robot = omnidyn.load_robot("axebot")
    axes = robot.friction.axes
    sticky = robot.replace(friction=robot.friction.replace(axes=axes.replace(breakaway=(4.4, 3.0, 0.2))))
    (words,) = [words for words in mjcf(sticky).missing if "breakaway" in words]
    assert "slides on a slope that the robot holds" in words
    assert "coulomb raised to breakaway" in words
    held = robot.replace(friction=robot.friction.replace(axes=axes.replace(coulomb=(4.4, 3.0, 0.2))))
    assert slid(sticky, 0.8 * 4.4) > 0.05
    assert slid(held, 0.8 * 4.4) < 1e-4


def slid(robot, force):
    """How far it is after 5 s on a slope that pulls by so much along x [m]."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot).text)
    data = mujoco.MjData(model)
    pull = force / robot.body.mass
    model.opt.gravity[:] = pull, 0.0, -np.sqrt(9.81**2 - pull**2)
    for _ in range(5000):
        mujoco.mj_step(model, data)
    return abs(data.qpos[0])
