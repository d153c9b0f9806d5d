"""Every preset: where its numbers come from, that it moves when told to and rests when not."""

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from omnidyn.model.deadzone import axis_patterns, dead_zone_force
from omnidyn.model.drive import SPEED
from omnidyn.model.robot_file import PRESETS, load_robot, parse_robot, preset_names, robot_to_toml
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed
from omnidyn.simulation.simulate import simulate

DATA = Path(os.environ.get("OMNIDYN_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
GRAY = DATA / "robotino" / "one_surface_type" / "gray_surface"


def command(robot, share):
    """One second of a command along x of this share of the most there is, as the drive of the robot takes it."""
    pattern = axis_patterns(robot)[0]
    if robot.drive.kind == SPEED:
        return {"wheel_speed_command": np.tile(share * 20.0 * pattern, (100, 1)), "dt": 0.01}
    return {"voltage": np.tile(share * robot.motor.voltage_limit * pattern, (100, 1)), "dt": 0.01}


def test_the_presets():
    assert preset_names() == ["axebot", "axebot-lab", "four-wheel", "lekiwi", "mecanum", "robotino"]


@pytest.mark.parametrize("name", preset_names())
def test_it_loads_and_round_trips(name):
    robot = load_robot(name)
    assert robot.name == name
    assert parse_robot(robot_to_toml(robot)) == robot


@pytest.mark.parametrize("name", preset_names())
def test_it_says_where_its_numbers_come_from(name):
    robot = load_robot(name)
    assert len(robot.source) > 40
    for key, prior in robot.priors.items():
        assert prior.source, key
        assert prior.origin != "guess" or prior.std, f"{key}: a guess without a spread"


@pytest.mark.parametrize("name", preset_names())
def test_it_moves_at_full_command(name):
    robot = load_robot(name)
    run = simulate(robot, **command(robot, 1.0))
    assert run.warnings == ()
    assert len(run) == 101
    assert 0.2 < run.twist[-1, 0] < 3.0
    assert run.pose[-1, 0] > 0.15
    assert np.isfinite(run.current).all()


@pytest.mark.parametrize("name", preset_names())
def test_it_rests_to_the_last_bit_without_a_command(name):
    robot = load_robot(name)
    run = simulate(robot, **command(robot, 0.0))
    assert run.warnings == ()
    for channel in (run.twist, run.pose, run.current, run.wheel_speed):
        assert not channel.any()


def test_the_robotino_s_constants():
    """Those of its source, one by one (data/README.md)."""
    robot = load_robot("robotino")
    motor = robot.motor
    assert robot.wheels.azimuth_deg == (60.0, 180.0, 300.0)
    assert (robot.wheels.robot_radius, robot.wheels.wheel_radius) == (0.125, 0.04)
    assert (motor.resistance, motor.inductance, motor.gear_ratio) == (5.95, 0.0089, 16.0)
    assert motor.torque_constant == motor.emf_constant == 0.0514
    assert (robot.body.mass, robot.priors["body.mass_kg"].std) == (8.0, 1.0)
    assert robot.friction.direction.coulomb == (42.5, 36.1)
    assert robot.drive.kind == SPEED
    np.testing.assert_allclose(dead_zone_force(robot, [0.0, np.pi / 2, np.pi]), [42.5, 36.1, 42.5], rtol=1e-12)


@pytest.mark.parametrize("speed, measured", [(0.1, 0.72), (0.2, 0.86), (0.3, 0.90)])
def test_the_robotino_s_wheels_turn_slower_than_set_as_in_its_logs(speed, measured):
    """0.72, 0.86, 0.90 of the set speed on the gray floor, mean over all directions (data/README.md)."""
    robot, ratios = load_robot("robotino"), []
    for direction in np.radians(np.arange(0.0, 360.0, 30.0)):
        wanted = [speed * np.cos(direction), speed * np.sin(direction), 0.0]
        run = simulate(robot, twist_command=[wanted] * 100, dt=0.01)
        reached = twist_from_wheel_speed(robot.wheels, run.wheel_speed[-1])
        ratios.append(np.hypot(*reached[:2]) / speed)
    assert np.mean(ratios) == pytest.approx(measured, abs=0.04)


def test_the_robotino_s_friction_is_that_of_its_logs():
    """The ellipse again from the 216 runs: motor currents to body forces, least squares along each axis."""
    if not GRAY.is_dir():
        pytest.skip(f"no robot logs at {GRAY}")
    along, force = gray_forces()
    for axis in range(2):
        unit = np.array([np.cos(along), np.sin(along)])[axis]
        level = unit @ force[:, axis] / (unit @ unit)
        error = np.std(force[:, axis] - level * unit) / np.sqrt(unit @ unit)
        preset = load_robot("robotino")
        assert preset.friction.direction.coulomb[axis] == pytest.approx(level, abs=0.06)
        assert preset.priors[f"friction.direction.coulomb[{axis}]"].std == pytest.approx(error, abs=0.07)


def gray_forces():
    """(direction of travel [rad] (216,), body force [N] (216, 2)) by the preprocessing of data/README.md."""
    robot = load_robot("robotino")
    newton = robot.motor.torque_constant * robot.motor.gear_ratio / robot.wheels.wheel_radius
    along, forces = [], []
    for number in range(216):
        lines = next(GRAY.glob(f"exp{number:02d}.csv")).read_text().splitlines()
        names = lines[2].split(";")
        rows = np.array([[float(cell) for cell in line.split(";")[: len(names) - 1]] for line in lines[3:] if line])
        rows = rows[int(0.4 * len(rows)) : int(0.95 * len(rows))]
        current = np.abs(rows[:, [names.index(f"m{k}cur") for k in (1, 2, 3)]]).mean(axis=0)
        wanted = rows[:, [names.index(f"m{k}setvel") for k in (1, 2, 3)]].mean(axis=0)
        sign = np.where(np.abs(wanted) < 1e-6, 0.0, np.sign(wanted))
        forces.append(robot.wheels.wrench_matrix[:2] @ (newton * current * sign))
        along.append(np.radians(5.0 * (number % 72)))
    return np.array(along), np.array(forces)


def test_the_comments_of_a_preset_are_for_its_readers():
    """Sources stand in the file where a number was measured or guessed."""
    text = (PRESETS / "robotino.toml").read_text("utf-8")
    for words in ("b4303b4c142a785a2a26468727d7156f8d39a9ec", "Apache-2.0", "gray runs", "IFAC-PapersOnLine"):
        assert words in text
    assert tomllib.loads(text)["schema"] == 1


def test_the_lekiwi_s_wheels_turn_as_its_software_has_it():
    """Rim speeds of left, back, right: cos a vx + sin a vy + b omega, a = 150, -90, 30 degrees; r = 0.05, b = 0.125."""
    robot, twist = load_robot("lekiwi"), np.array([0.2, -0.1, 0.5])
    angle = np.radians([150.0, -90.0, 30.0])
    rims = np.cos(angle) * twist[0] + np.sin(angle) * twist[1] + 0.125 * twist[2]
    np.testing.assert_allclose(wheel_speed(robot.wheels, twist), rims / 0.05, rtol=1e-12)
    assert robot.drive.kind == SPEED
    top = robot.motor.voltage_limit / (robot.motor.emf_constant * robot.motor.gear_ratio)
    assert top * 60.0 / (2.0 * np.pi) == pytest.approx(45.0, rel=0.02)  # rpm without load
