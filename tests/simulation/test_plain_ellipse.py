"""Friction (Cx vx, Cy vy)/|v| along the direction of travel, beside levels at the wheels."""

import numpy as np
import pytest

from omnidyn.control.table import feedforward_table
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.features import FEATURES, refuse
from omnidyn.model.dynamics import acceleration, drive_wrench
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot_file import load_robot, save_robot
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes

PLAIN = DirectionFriction(coulomb=(3.0, 2.0), yaw_coulomb=0.1, ellipse="plain")
WHEELS = WheelFriction(coulomb=(0.2, 0.4, 0.1))
ROBOT = load_robot("axebot").replace(name="plain", friction=Friction(direction=PLAIN, wheels=WHEELS))
DT = 0.01


def stairs(seed, count=6, hold=20):
    return np.repeat(np.random.default_rng(seed).uniform(-6.0, 6.0, (count, 3)), hold, axis=0)


def by_small_steps(robot, volts, step=1e-4):
    """Twists by steps in which every friction is a resistance, its force over its speed at the begin of the step."""
    mass, g, slow = mass_matrix(robot), robot.wheels.wrench_matrix, 1e-6
    twist, seen = np.zeros(3), []
    for row in volts:
        seen.append(twist)
        for _ in range(round(DT / step)):
            x, y = np.array(robot.friction.direction.coulomb) / max(np.hypot(*twist[:2]), slow)
            turning = robot.friction.direction.yaw_coulomb / max(abs(twist[2]), slow)
            rims = np.array(robot.friction.wheels.coulomb) / np.maximum(np.abs(twist @ g), slow)
            resists = np.diag([x, y, turning]) + (g * rims) @ g.T
            push = drive_wrench(robot, twist, row)
            twist = np.linalg.solve(mass + step * resists, mass @ twist + step * push)
    return np.array(seen)


def test_motion_is_that_of_another_integrator():
    volts = stairs(0)
    fine, coarse = (by_small_steps(ROBOT, volts, step) for step in (1e-4, 2e-4))
    other = 2.0 * fine - coarse  # their error is in proportion to the step
    twist = simulate(ROBOT, volts, DT, tol=1e-6).twist[: len(volts)]
    assert np.abs(twist - other)[:, :2].max() < 1e-3
    law = ROBOT.friction.replace(direction=PLAIN.replace(ellipse="dissipation"))
    associated = simulate(ROBOT.replace(friction=law), volts, DT, tol=1e-6).twist[: len(volts)]
    assert np.abs(associated - other)[:, :2].max() > 0.02


def test_every_step_converges_and_what_cannot_move_rests():
    rng = np.random.default_rng(1)
    for _ in range(12):
        levels = rng.uniform(0.5, 6.0, 2)
        law = PLAIN.replace(coulomb=tuple(levels.tolist()), yaw_coulomb=float(rng.uniform(0.0, 0.3)))
        wheels = WheelFriction(coulomb=float(rng.uniform(0.0, 1.0)))
        robot = ROBOT.replace(friction=Friction(direction=law, wheels=wheels))
        volts = np.repeat(rng.uniform(-6.0, 6.0, (20, 3)) * rng.choice([0.0, 0.3, 1.0], (20, 1)), 20, axis=0)
        assert "not_converged" not in codes(simulate(robot, volts, DT).warnings)
        push = drive_wrench(robot, np.zeros((3, 3)), np.eye(3))  # of 1 V at each wheel
        held = 0.99 * np.linalg.solve(push.T, np.append(levels * [0.6, 0.8], 0.0))
        assert not np.any(simulate(robot, np.tile(held, (20, 1)), DT).twist)


@pytest.mark.parametrize("key", ["friction.direction.coulomb[0]", "friction.wheels.coulomb[1]"])
def test_derivatives_are_those_of_differences(key):
    volts, place = stairs(3), Key.parse(key)
    slope = derivatives(ROBOT, volts, DT, [key]).twist[..., 0]
    level, step = float(place.get(ROBOT)), 1e-4
    up, down = (simulate(place.set(ROBOT, level + s), volts, DT, tol=1e-9).twist for s in (step, -step))
    assert np.abs(slope - (up - down) / (2.0 * step)).max() < 1e-3 * np.abs(slope).max()


def test_feedforward_holds_a_speed():
    table = feedforward_table(ROBOT)
    for twist in ([0.4, 0.3, 0.5], [-0.2, 0.5, -1.0]):
        volts = table.volts(twist, np.zeros(3))
        assert acceleration(ROBOT, twist, volts) == pytest.approx(np.zeros(3), abs=1e-9)
    assert any("sqrtf(vx*vx + vy*vy)" in line for line in table.code())


def test_a_file_holds_it_and_what_cannot_say_it_refuses_by_name(tmp_path):
    save_robot(ROBOT, tmp_path / "robot.toml")
    assert load_robot(tmp_path / "robot.toml").friction == ROBOT.friction
    assert FEATURES["plain"].has(ROBOT)
    with pytest.raises(UnsupportedError, match='ellipse = "plain"'):
        refuse("c-controller", ROBOT)
    slips = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=0.5, wheel_inertia=1e-4))
    with pytest.raises(UnsupportedError, match='ellipse = "plain"'):
        simulate(slips, np.zeros((3, 3)), DT)
    with pytest.raises(InputError, match="without stribeck_speed"):
        PLAIN.replace(breakaway=(4.0, 3.0), stribeck_speed=0.1)
