"""Wheels that slip on random robots: twist, rims and place by the event-driven reference, at every tolerance."""

from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.simulation.slip.plant import load_shift, wheel_loads
from tests.support.random_logs import random_robot
from tests.support.slipping import EDGE, Slip

ROBOTS, ROWS, DT = 20, 8, 0.25
REJECTED = 4  # draws of 24 at which a decision is within rounding of its edge


def drawn(seed, place="axes"):
    """A robot of any geometry, mass and motor whose wheels may slip, and levels for its motors. place: of friction."""
    rng = np.random.default_rng([seed, 9])
    robot = random_robot(rng)
    while not any(getattr(robot.friction, place).coulomb):
        robot = random_robot(rng)
    r, b = float(np.mean(robot.wheels.radii)), float(np.mean(robot.wheels.robot_radius))
    spin = robot.body.mass * r**2 * rng.uniform(0.005, 0.05) / robot.wheels.count
    robot = robot.replace(
        wheels=robot.wheels.replace(traction_mu=rng.uniform(0.13, 0.3), wheel_inertia=spin),
        body=robot.body.replace(centre_height=b * rng.uniform(0.0, 0.4)),
    )
    levels = rng.uniform(-1.0, 1.0, (ROWS, robot.wheels.count)) * robot.motor.voltage_limit
    levels[ROWS // 2] = 0.0
    return robot, levels


@cache
def reference(seed):
    """(robot, levels, twist, rims, place, contact) of a draw; None where it does not count."""
    robot, levels = drawn(seed)
    found = Slip(robot, wheel_loads(robot).newtons, load_shift(robot))
    twist, rims, contact = found.run(levels, DT)
    return None if found.least < EDGE else (robot, levels, twist, rims, found.pose, contact)


def references(count):
    """The first draws that count, and how many before the last of them did not."""
    found, seed = [], 0
    while len(found) < count:
        found += [made for made in (reference(seed),) if made is not None]
        seed += 1
    return found, seed - count


@pytest.mark.long
def test_few_draws_are_rejected_and_most_slip():
    found, rejected = references(ROBOTS)
    assert rejected <= REJECTED
    assert sum(bool(contact.any()) for *_, contact in found) >= 0.9 * ROBOTS


@pytest.mark.parametrize("number", [k if k < 6 else pytest.param(k, marks=pytest.mark.long) for k in range(ROBOTS)])
def test_against_the_events(number):
    """Within tol [m/s] and [m], 10 tol [rad/s] and [rad]; rims within what both of these leave them."""
    tol, (robot, levels, twist, rims, pose, _) = (1e-5, 1e-6, 1e-7)[number % 3], references(number + 1)[0][number]
    run = omnidyn.simulate(robot, levels, DT, tol=tol)
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() < tol
    assert (np.abs(run.pose - pose) / [1.0, 1.0, 10.0]).max() < tol
    assert np.abs(run.wheel_speed * robot.wheels.radii - rims).max() < 10.0 * tol
