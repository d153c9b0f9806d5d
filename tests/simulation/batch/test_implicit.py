"""Blocks of implicit steps against the general engine, robot by robot: friction of the axes and of the direction."""

from random import Random

import numpy as np
import pytest

import omnidyn
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.simulation.batch.engine_kind import BOX, GENERAL, engine_kind
from omnidyn.simulation.batch.engine_kind import DIRECTION as ALONG
from tests.support.exported import exact_robot

DT, ROWS, ROBOTS = 0.004, 200, 1000


def turning_robot(seed):
    """A robot in a turning frame under a disc, an ellipse or a box, by its seed; light and strange ones among them."""
    random, robot = Random(f"turning {seed}"), exact_robot(4 * seed)  # of three wheels

    def spread(value, factor=3.0):
        return value * factor ** random.uniform(-1.0, 1.0)

    levels = spread(1.5), spread(1.5)
    if seed % 3 == 0:
        coulomb = (*levels, spread(0.06)) if seed % 2 else (0.0, levels[1], spread(0.06))
        friction = Friction(axes=AxesFriction(viscous=(0.9, 0.8, 0.01), coulomb=coulomb))
    else:
        way = DirectionFriction(
            coulomb=levels if seed % 3 == 1 else (levels[0],) * 2,
            viscous=spread(0.5),
            yaw_coulomb=spread(0.06),
            yaw_viscous=0.01,
        )
        friction = Friction(direction=way)
    body = robot.body.replace(rotating_frame=True, mass=spread(1.5), inertia=spread(0.02))
    motor = robot.motor.replace(electrical="quasi-static")
    return robot.replace(body=body, friction=friction, motor=motor, drive=robot.drive.replace(dead_band=0.0))


def volts(rows):
    rng = np.random.default_rng(3)
    held = np.repeat(rng.uniform(-5.0, 5.0, (rows // 25 + 1, 3)), 25, axis=0)[:rows]
    return held * (np.arange(rows)[:, None] % 100 < 50)


@pytest.fixture(scope="module")
def runs():
    """(the robots, their batch run, the run of each alone)."""
    robots, voltage = [turning_robot(seed) for seed in range(ROBOTS)], volts(ROWS)
    batch = omnidyn.simulate_batch(robots, voltage, DT, every=1)
    return robots, batch, [omnidyn.simulate(robot, voltage, DT, tol=None) for robot in robots]


def test_both_shapes_move_in_blocks(runs):
    robots, batch, _ = runs
    assert {engine_kind(robot, "voltage", None) for robot in robots} == {BOX, ALONG}
    assert batch.engines == {"implicit engine, fixed step, in blocks": ROBOTS}
    assert not batch.end.failed.any()


def test_a_thousand_robots_do_as_the_general_engine_says(runs):
    robots, batch, singles = runs
    for k, run in enumerate(singles):
        scale = np.maximum(1.0, np.abs(run.twist).max(axis=0))
        assert np.max(np.abs(batch.twists[k] - run.twist) / scale) < 1e-12, robots[k].name
        assert np.max(np.abs(batch.poses[k] - run.pose)) < 1e-11, robots[k].name


def test_the_same_rows_are_at_rest(runs):
    _, batch, singles = runs
    rest = np.array([run.twist for run in singles]) == 0.0
    assert 0.05 < rest.mean() < 0.9
    np.testing.assert_array_equal(batch.twists == 0.0, rest)


@pytest.mark.parametrize("held", [{"breakaway": (2.4, 1.6)}, {"yaw_breakaway": 0.08}])
def test_a_breakaway_above_its_coulomb_level_is_not_left_out(held):
    """Along the direction of travel or about yaw."""
    way = DirectionFriction(coulomb=(1.2, 0.8), yaw_coulomb=0.04, viscous=0.5, yaw_viscous=0.005)
    robot = turning_robot(1).replace(friction=Friction(direction=way.replace(**held)))
    levels = {"breakaway": way.coulomb, "yaw_breakaway": way.yaw_coulomb}
    assert engine_kind(robot, "voltage", None) == GENERAL
    assert engine_kind(robot.replace(friction=Friction(direction=way.replace(**levels))), "voltage", None) == ALONG
    run, one = omnidyn.simulate_batch([robot], volts(40), DT), omnidyn.simulate(robot, volts(40), DT, tol=None)
    np.testing.assert_allclose(run.end.twist[0], one.twist[-1], atol=1e-12)


def test_what_has_no_block_goes_to_the_engine_of_simulate():
    robot = turning_robot(1)
    dropping = robot.replace(motor=robot.motor.replace(voltage_drop=0.5))
    assert engine_kind(dropping, "voltage", None) == GENERAL
    assert engine_kind(robot, "voltage", 1e-6) == GENERAL
    voltage = volts(40)
    batch = omnidyn.simulate_batch([robot, dropping, exact_robot(4)], voltage, DT, every=10)
    assert batch.engines == {
        "implicit engine, fixed step, in blocks": 1,
        "implicit engine, fixed step": 1,
        "exact engine, in blocks": 1,
    }
    run = omnidyn.simulate(dropping, voltage, DT, tol=None)
    np.testing.assert_array_equal(batch.twists[1], run.twist[::10])
    np.testing.assert_array_equal(batch.poses[1], run.pose[::10])
