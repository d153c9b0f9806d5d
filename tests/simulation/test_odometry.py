"""What a twist is worth that a robot computed from its wheels, with a radius that is wrong: by the equations of motion.

With wheels s times as large as said, odometry shows v/s. Put in M v' = G K (u - E G'v/(s r))/(R s r) - F sgn v is
the motion of the robot as said with R s^2 for R and F/s for F. With wheels at s times their distance, turning shows as
of a robot with I/s^2, its levels about the vertical over s and over s^2. So such a log can never tell them apart.
"""

import numpy as np
import pytest

from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.simulation.simulate import simulate

AXEBOT = load_robot("axebot")
VOLTAGE = np.repeat(np.random.default_rng(0).uniform(-6.0, 6.0, (30, 3)), 20, axis=0)


def odometry(robot):
    """As the file has it, of a robot that is another one."""
    return twist_from_wheel_speed(AXEBOT.wheels, simulate(robot, VOLTAGE, 0.02).wheel_speed)


@pytest.mark.parametrize("s", [0.9, 1.1])
def test_a_wheel_radius_looks_like_a_resistance(s):
    wheels, motor, axes = AXEBOT.wheels, AXEBOT.motor, AXEBOT.friction.axes
    seen = odometry(AXEBOT.replace(wheels=wheels.replace(wheel_radius=s * wheels.wheel_radius)))
    levels = axes.replace(coulomb=tuple(level / s for level in axes.coulomb))
    other = AXEBOT.replace(
        motor=motor.replace(resistance=motor.resistance * s**2), friction=AXEBOT.friction.replace(axes=levels)
    )
    np.testing.assert_allclose(seen, simulate(other, VOLTAGE, 0.02).twist, rtol=0.0, atol=1e-13)
    assert np.abs(seen - simulate(AXEBOT, VOLTAGE, 0.02).twist).max() > 0.1


def test_the_distance_of_the_wheels_looks_like_an_inertia():
    s, wheels, body, axes = 1.2, AXEBOT.wheels, AXEBOT.body, AXEBOT.friction.axes
    seen = odometry(AXEBOT.replace(wheels=wheels.replace(robot_radius=s * wheels.robot_radius)))
    levels = axes.replace(
        coulomb=(*axes.coulomb[:2], axes.coulomb[2] / s), viscous=(*axes.viscous[:2], axes.viscous[2] / s**2)
    )
    other = AXEBOT.replace(
        body=body.replace(inertia=body.inertia / s**2), friction=AXEBOT.friction.replace(axes=levels)
    )
    np.testing.assert_allclose(seen, simulate(other, VOLTAGE, 0.02).twist, rtol=0.0, atol=1e-13)
