"""A free base for the MuJoCo model: it falls, lands on its wheels and tips; motors and friction are as in the plane.

Wheels are cylinders without friction: they bear the robot. Half of its weight stands on feet (feet.py), which carry the
dry friction, so that it is what the robot file says and does not go with what the wheels bear: those of x and y as in
the plane, and one for yaw, whose contact has a torsional coefficient, and a hundredth of its press along the floor. A
foot hangs no lower than REACH below the wheels: in the air there is no friction, and a robot that tips lifts it off the
floor. Viscous friction, which a free joint takes alike for all of its axes only, is that of actuators without a
command. What spins is a mass without weight.
"""

from __future__ import annotations

import numpy as np

from omnidyn.export.bodies.feet import Foot, feet_of, foot_lines, inertial
from omnidyn.export.bodies.inertias import places, several
from omnidyn.export.features import LEAVES_OUT, PARTLY, SAYS, Cell
from omnidyn.export.spelling import number
from omnidyn.model.frames import AXES
from omnidyn.model.mass import added_mass
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import coulomb_along

GRAVITY = 9.81  # [m/s^2] MuJoCo's own
WEIGHT = 0.5  # share of the weight that stands on feet
SHARE = 0.01  # of mass and inertia that each foot has: a spring throws what is lighter, and friction goes with it
REACH = 0.02  # of the radius of a wheel: how far below it a foot hangs in the air
SETTLING = 0.005  # [s] in which a foot comes to rest
# In place of what features.py says of the model that slides in the plane.
CELLS = {
    "axes": Cell(SAYS),
    "slope": Cell(LEAVES_OUT, "the floor is level: tilt gravity"),
    "spin": Cell(PARTLY, "what spins is mass without weight, as much along x as along y, and falls with the body"),
}
NOTES = (
    "ctrl is the volts of the motors, u1, u2, ...; actuators drag_* behind them are viscous friction, their ctrl stays "
    "0; qpos and qvel begin with the 7 and 6 of the free joint, those of the feet come behind them; the sensors twist "
    "and gyro are in the frame of the body",
    "half of the weight stands on feet that carry the dry friction, on the plane `floor` only: it does not grow with a "
    "load, and is the same on any ground; a robot that tips begins to at half of the moment",
    "motors push the body in the air, too: nothing rolls; wheels are all that touches other bodies: add geoms of it",
)


def base(robot: Robot, tall: float) -> list[str]:
    """The body with its free joint, wheels that bear it, and feet."""
    feet = free_feet(robot)
    low = several(0.0, 0.0, -float(robot.wheels.radii.max()))
    lines = [
        f'    <body name="base" pos="0 0 {number(float(robot.wheels.radii.max()))}">',
        '      <freejoint name="base"/>',
        inertial(robot, tall, 1.0 - SHARE * len(feet)),
        '      <site name="body"/>',
        f'      <site name="drive" pos="{low}"/>',
    ]
    lines += [
        f'      <geom name="wheel{k + 1}" type="cylinder" '
        f'pos="{several(place.x, place.y, place.radius - float(robot.wheels.radii.max()))}" '
        f'zaxis="{several(np.cos(place.azimuth), np.sin(place.azimuth), 0.0)}" '
        f'size="{several(place.radius, 0.3 * place.radius)}" mass="0" condim="1" priority="1" solref="0.005 1"/>'
        for k, place in enumerate(places(robot))
    ]
    spin = np.diag(added_mass(robot))
    if spin[2] > 0.0:
        about = several(0.5 * spin[2], 0.5 * spin[2], spin[2])
        lines += [
            '      <body name="spin" gravcomp="1">',
            f'        <inertial pos="0 0 0" mass="{number(0.5 * (spin[0] + spin[1]))}" diaginertia="{about}"/>',
            "      </body>",
        ]
    lines += [line for k, foot in enumerate(feet) for line in foot_lines(robot, tall, k + 1, foot)]
    return [*lines, "    </body>"]


def free_feet(robot: Robot) -> list[Foot]:
    """Those of the plane, and one for yaw; each bears the same share of the weight."""
    feet, turning = feet_of(robot), float(coulomb_along(robot)[2])
    feet += [Foot(0.0, 0.0, False, 0.0)] if turning > 0.0 else []
    radius = float(robot.wheels.radii.max())
    press = WEIGHT * robot.body.mass * GRAVITY / max(len(feet), 1)
    damping = SHARE * robot.body.mass / SETTLING
    joint = f' range="{several(-radius, REACH * radius)}" damping="{number(damping)}"'
    return [
        foot._replace(press=press, share=SHARE, joint=joint, turning=0.0 if foot.level > 0.0 else turning)
        for foot in feet
    ]


def drags(robot: Robot) -> list[str]:
    """Viscous friction of the body, as forces at the floor along its axes."""
    along = robot.friction.direction
    viscous = np.add(robot.friction.axes.viscous, (along.viscous, along.viscous, along.yaw_viscous))
    lines = []
    for axis, level in enumerate(viscous):
        if level > 0.0:
            gear = np.zeros(6)
            gear[axis if axis < 2 else 5] = 1.0
            lines.append(
                f'    <general name="drag_{AXES[axis]}" site="drive" gear="{several(*gear)}" ctrlrange="0 0" '
                f'gainprm="0" biastype="affine" biasprm="0 0 -{number(level)}"/>'
            )
    return lines
