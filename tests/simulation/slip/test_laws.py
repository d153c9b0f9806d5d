"""Every law of friction under wheels that slip, and windings and gears: random robots by the event-driven reference."""

from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.simulation.slip.loads import load_shift, wheel_loads
from tests.simulation.slip.test_random_robots import DT, drawn
from tests.support.slipping import EDGE, Slip

ROBOTS = 20
REJECTED = 4  # draws of 24 at which a decision is within rounding of its edge
LAWS = ("breakaway", "stribeck", "wheels", "wheels stribeck", "winding", "gear", "bristles")


def pieces(robot, rng):
    """(levels of the axes, of the wheels): half of the friction of a robot each."""
    axes = robot.friction.axes
    return np.array(axes.coulomb), float(axes.coulomb[0]) / 2.0 / robot.wheels.count * rng.uniform(0.7, 1.3)


def falls(rng):
    return {"stribeck_shape": str(rng.choice(["exponential", "lorentzian"])),
            "stribeck_exponent": float(rng.choice([1.0, 1.5, 2.0]))}  # fmt: skip


def with_law(robot, law, rng):
    """The robot with a law, its levels and its numbers drawn."""
    coulomb, rim = pieces(robot, rng)
    arm, more = float(np.mean(robot.wheels.robot_radius)), rng.uniform(1.1, 1.5, 3)
    speed, friction, motor = rng.uniform(0.02, 0.1), robot.friction, robot.motor
    axes, wheels, half = friction.axes, friction.wheels, friction.axes.replace(coulomb=tuple(0.5 * coulomb))
    rims = {"coulomb": rim, "coulomb_backward": 0.9 * rim, "breakaway": 1.3 * rim, "breakaway_backward": 1.2 * rim,
            "viscous": 0.2 * rim}  # fmt: skip
    if law == "breakaway":
        axes = axes.replace(breakaway=tuple(coulomb * more), coulomb_backward=tuple(0.9 * coulomb),
                            breakaway_backward=tuple(coulomb))  # fmt: skip
    elif law == "stribeck":
        axes = axes.replace(breakaway=tuple(coulomb * more), stribeck_speed=(speed, speed, speed / arm), **falls(rng))
    elif law == "wheels":
        axes, wheels = half.replace(breakaway=tuple(0.5 * coulomb * more)), wheels.replace(**rims)
    elif law == "wheels stribeck":
        axes, wheels = half, wheels.replace(**rims, stribeck_speed=speed, **falls(rng))
    elif law == "winding":
        settles = rng.uniform(0.3, 3.0) * 1e-3
        axes = axes.replace(breakaway=tuple(coulomb * more))
        motor = motor.replace(electrical="dynamic", inductance=settles * motor.resistance)
    elif law == "gear":
        axes = axes.replace(breakaway=tuple(coulomb * more))
        motor = motor.replace(gear_efficiency=tuple(rng.uniform(0.75, 0.95, robot.wheels.count)))
    else:
        stiff = coulomb / 1e-3
        axes = axes.replace(law="lugre", breakaway=tuple(coulomb * more), stribeck_speed=(speed, speed, speed / arm),
                            stiffness=(stiff[0], stiff[1], stiff[2] * arm), damping=(10.0, 10.0, 10.0 * arm**2),
                            coulomb=tuple(coulomb))  # fmt: skip
        wheels = wheels.replace(law="dahl", coulomb=rim, stiffness=rim / 2e-3)
    return robot.replace(friction=friction.replace(axes=axes, wheels=wheels), motor=motor)


@cache
def references():
    """(law, robot, levels, twist, rims, place, currents) of the draws that count, and how many did not."""
    found, rejected, seed = [], 0, 100
    while len(found) < ROBOTS:
        robot, levels = drawn(seed)
        law = LAWS[len(found) % len(LAWS)]
        robot = with_law(robot, law, np.random.default_rng([seed, 10]))
        reference = Slip(robot, wheel_loads(robot).newtons, load_shift(robot))
        twist, rims, contact = reference.run(levels, DT)
        rejected += reference.least < EDGE
        if reference.least >= EDGE:
            found.append((law, robot, levels, twist, rims, reference.pose, reference.current, contact))
        seed += 1
    return found, rejected
