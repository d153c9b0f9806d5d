"""mjcf with a free base, in MuJoCo: it drives as we do, falls on its wheels, and rubs as we do, on the floor only."""

import numpy as np
import pytest

import omnidyn
from omnidyn.export.bodies.mjcf import mjcf
from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.mass import added_mass

mujoco = pytest.importorskip("mujoco")
AXEBOT = omnidyn.load_robot("axebot")
ROBOT = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))
OTHERS = [omnidyn.load_robot(name) for name in ("lekiwi", "mecanum", "robotino")]
G = 9.81


def loaded(robot):
    model = mujoco.MjModel.from_xml_string(mjcf(robot, free_base=True).text)
    return model, mujoco.MjData(model)


def twists(robot, volts, free_base=True):
    """Twist in the frame of the body after each row of 1 ms. Shape (rows, 3)."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot, free_base=free_base).text)
    data = mujoco.MjData(model)
    seen = []
    for row in volts:
        data.ctrl[: len(row)] = row
        mujoco.mj_step(model, data)
        seen.append([*data.sensordata[:2], data.sensordata[5]])
    return np.array(seen)


@pytest.mark.parametrize("volts", [[0, 2, -2], [0, 4, -4], [-3, 1.5, 1.5], [-5, 2.5, 2.5], [1.5, 1.5, 1.5]])
def test_on_the_runs_of_the_paper_it_is_near(volts):
    """To 1.2e-2 m/s and 2.5e-2 rad/s at steps of 1 ms: it pitches as it speeds up, and the foot of yaw rubs along."""
    program = np.repeat([volts, np.zeros(3), np.negative(volts)], [800, 400, 400], axis=0)
    run = omnidyn.simulate(ROBOT, program, 1e-3)
    assert run.twist is not None
    assert (np.abs(twists(ROBOT, program) - run.twist[:-1]).max(axis=0) < [1.2e-2, 1.2e-2, 2.5e-2]).all()


@pytest.mark.parametrize("robot", OTHERS, ids=lambda robot: robot.name)
def test_robots_drive_as_they_do_in_the_plane(robot):
    """To 5 %: friction of more than half of the weight lifts its foot a little."""
    direction = np.linalg.pinv(robot.wheels.wrench_matrix) @ [1.0, 0.0, 0.0]
    volts = 0.5 * np.max(robot.motor.voltage_limit) * direction / np.abs(direction).max()
    free, plane = (twists(robot, np.tile(volts, (1000, 1)), free_base) for free_base in (True, False))
    assert plane[-1, 0] > 0.02  # forward
    np.testing.assert_allclose(free[-1, 0], plane[-1, 0], rtol=0.05)
    assert np.abs(free[-1, 1:]).max() < 0.05 * plane[-1, 0]


def test_it_falls_and_lands_on_its_wheels():
    model, data = loaded(ROBOT)
    rest, height = float(ROBOT.wheels.radii.max()), 0.1
    data.qpos[2] += height
    falling = int(1e3 * np.sqrt(2.0 * height / G))
    for _ in range(falling - 2):
        mujoco.mj_step(model, data)
    assert data.qpos[2] - rest == pytest.approx(height - 0.5 * G * data.time**2, abs=3e-3)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.qpos[2] == pytest.approx(rest, abs=2e-4)
    np.testing.assert_allclose(data.qpos[3:7], [1.0, 0.0, 0.0, 0.0], atol=1e-4)
    wheels = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) for pair in data.contact.geom for geom in pair}
    assert {"wheel1", "wheel2", "wheel3"} <= wheels


@pytest.mark.parametrize("axis", range(3))
def test_friction_on_the_floor_is_ours_and_none_is_in_the_air(axis):
    """Motors off, their back-EMF too: deceleration is friction over mass, along each axis and about yaw."""
    decelerations = list[float]()
    for height in (0.0, 5.0):
        model, data = loaded(ROBOT)
        model.actuator_biasprm[:] = 0.0
        data.qpos[2] += height
        start = np.array([0.6, 0.5, 6.0])[axis]
        for _ in range(100):
            mujoco.mj_step(model, data)
        data.qvel[axis if axis < 2 else 5] = start
        for _ in range(100):
            mujoco.mj_step(model, data)
        shown = np.array([*data.sensordata[:2], data.sensordata[5]])
        decelerations.append(float(start - shown[axis]) / 0.1)
    mass = np.diag([ROBOT.body.mass, ROBOT.body.mass, ROBOT.body.inertia]) + added_mass(ROBOT)
    expected = float(np.array(ROBOT.friction.axes.coulomb)[axis] / mass[axis, axis])
    np.testing.assert_allclose(decelerations, [expected, 0.0], rtol=0.02, atol=0.02 * expected)


@pytest.mark.parametrize("pattern", [[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])
def test_it_rests_within_its_dead_zone_and_leaves_it_outside(pattern):
    moved = []
    for times in (0.5, 1.3):
        volts = times * breakaway_voltage(ROBOT, pattern) * np.array(pattern)
        seen = twists(ROBOT, np.tile(volts, (1000, 1)))
        moved.append(np.abs(seen[200:].mean(axis=0)).max())
    assert moved[0] < 1e-4  # m/s or rad/s
    assert moved[1] > 1e-2


def test_what_it_misses_stands_in_the_file_and_on_the_screen():
    exported = mjcf(OTHERS[0], free_base=True)
    assert any("motors push the body in the air" in note for note in exported.notes)
    assert all(note[:40] in exported.text for note in exported.notes)
    assert any("mass without weight" in words for words in exported.missing)
    assert not any("stands still in the world" in words for words in mjcf(AXEBOT, free_base=True).missing)
    assert any("stands still in the world" in words for words in mjcf(AXEBOT).missing)


def test_a_push_far_above_the_floor_tips_it():
    model, data = loaded(ROBOT)
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "base")
    data.xfrc_applied[base, :] = [0.0, 0.0, 0.0, 0.0, 2.0, 0.0]  # more than half of the weight times the lever
    for _ in range(400):
        mujoco.mj_step(model, data)
    assert 2.0 * np.arccos(abs(data.qpos[3])) > 0.3
