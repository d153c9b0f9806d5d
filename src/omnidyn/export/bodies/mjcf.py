"""mjcf: a MuJoCo model: one body that slides in the plane, its motors as actuators in volts, back-EMF in their bias.

Each motor pushes along a line of the body (its column of the wrench matrix G, as `gear` of a site), with the force
l K_t i/r of eqs (10) (11): a gain per volt, and a bias in proportion to the speed of its rim, back-EMF and viscous
friction of the wheel. Its force range is the current limit. What spins is armature of the joints.

Dry friction along x and y is that of feet (feet.py), that about yaw of the joint. With a free base the body falls and
tips: see free_base.py.
"""

from __future__ import annotations

import numpy as np

from omnidyn.export.bodies import free_base as free
from omnidyn.export.bodies.feet import IMPRATIO, SHARE, SOLVER, contacts, feet_of, foot_lines, inertial
from omnidyn.export.bodies.inertias import height_of, places, several
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import attribute, number, xml_comment
from omnidyn.model.dynamics import linear_part
from omnidyn.model.mass import added_mass
from omnidyn.model.motor import settled_current, traction
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import coulomb_along
from omnidyn.model.wheels import per_wheel

STEP = 0.001  # [s]
STIFF = f'solreffriction="{SOLVER[0]}" solimpfriction="{SOLVER[1]}"'
NOTES = (
    "ctrl is the volts of the motors, u1, u2, ...; the first of qvel are vx, vy in the frame of the world and omega, "
    "the others of its feet; the sensors twist and gyro give them in the frame of the body",
    "the body slides in the plane and does not tip; it stands on its feet on a floor of its own, and nothing rolls",
)


def mjcf(robot: Robot, height: float | None = None, free_base: bool = False) -> Export:
    """A robot as a MuJoCo model. height [m]: of the body, for the inertia about the other axes.

    free_base: it falls and tips, in place of sliding in the plane.
    """
    refuse("mjcf", robot)
    omissions = left_out("mjcf", robot, free.CELLS if free_base else None)
    tall, touches = height_of(robot, height), int(free_base)
    tips = "a guess" if free_base else "a guess, it does not tip"
    text = "\n".join(
        [
            f"<mujoco model={attribute(robot.name)}>",
            xml_comment(
                [
                    f"{robot.name}, by omnidyn. SI units.",
                    *(f"Not as in omnidyn: {words}" for words in omissions),
                    f"Height of the body {tall:g} m, for its inertia about x and y: {tips}.",
                    *(free.NOTES if free_base else ()),
                ]
            ),
            f'  <option timestep="{STEP}" integrator="implicitfast" noslip_iterations="10" cone="elliptic" '
            f'impratio="{IMPRATIO:g}"/>',
            "  <worldbody>",
            f'    <geom name="floor" type="plane" size="0 0 1" contype="{touches}" conaffinity="{touches}" group="3"/>',
            *(free.base if free_base else _body)(robot, tall),
            "  </worldbody>",
            "  <contact>",
            *contacts(free.free_feet(robot) if free_base else feet_of(robot)),
            "  </contact>",
            "  <actuator>",
            *_actuators(robot, "drive" if free_base else "body"),
            *(free.drags(robot) if free_base else ()),
            "  </actuator>",
            '  <sensor>\n    <velocimeter name="twist" site="body"/>\n    <gyro name="gyro" site="body"/>\n  </sensor>',
            "</mujoco>\n",
        ]
    )
    return Export("mjcf", robot.name, {"robot.xml": text}, omissions, free.NOTES if free_base else NOTES)


def _body(robot: Robot, tall: float) -> list[str]:
    """The body, its three joints, and its looks."""
    feet, spin = feet_of(robot), np.diag(added_mass(robot))
    share = 1.0 - SHARE * len(feet)
    viscous = np.array(robot.friction.axes.viscous)
    along = robot.friction.direction
    viscous = viscous + np.array([along.viscous, along.viscous, along.yaw_viscous])
    lines = [
        f'    <body name="base" pos="0 0 {number(float(robot.wheels.radii.max()))}">',
        inertial(robot, tall, share),
    ]
    for axis, (name, kind, line) in enumerate(
        (("x", "slide", "1 0 0"), ("y", "slide", "0 1 0"), ("heading", "hinge", "0 0 1"))
    ):
        armature = f' armature="{number(spin[axis])}"' if spin[axis] else ""
        dry = f' frictionloss="{number(float(coulomb_along(robot)[2]))}" {STIFF}' if axis == 2 else ""
        lines.append(
            f'      <joint name="{name}" type="{kind}" axis="{line}" damping="{number(viscous[axis])}"{dry}{armature}/>'
        )
    lines.append('      <site name="body"/>')
    lines += [
        f'      <geom name="wheel{k + 1}" type="cylinder" pos="{several(place.x, place.y, 0.0)}" '
        f'zaxis="{several(np.cos(place.azimuth), np.sin(place.azimuth), 0.0)}" '
        f'size="{several(place.radius, 0.3 * place.radius)}" mass="0" contype="0" conaffinity="0"/>'
        for k, place in enumerate(places(robot))
    ]
    lines += [line for k, foot in enumerate(feet) for line in foot_lines(robot, tall, k + 1, foot)]
    return [*lines, "    </body>"]


def _actuators(robot: Robot, site: str) -> list[str]:
    """The motors, as forces along lines of the body, which act at a site."""
    motor, wheels, n = robot.motor, robot.wheels, robot.wheels.count
    linear = linear_part(robot).motor
    gain = traction(linear, wheels, settled_current(linear, np.ones(n), np.zeros(n)))  # [N/V] at the rim
    braking = -traction(linear, wheels, settled_current(linear, np.zeros(n), 1.0 / wheels.radii))  # [N s/m]
    limit = per_wheel(motor.voltage_limit, n)
    braking = braking + per_wheel(robot.friction.wheels.viscous, n)
    lines = []
    for k, line in enumerate(wheels.wrench_matrix.T):
        force_range = ""
        if motor.current_limit is not None:
            largest = number(traction(motor, wheels, per_wheel(motor.current_limit, n))[k])
            force_range += f' forcerange="-{largest} {largest}"'
        lines.append(
            f'    <general name="u{k + 1}" site="{site}" gear="{several(line[0], line[1], 0.0, 0.0, 0.0, line[2])}" '
            f'ctrlrange="-{number(limit[k])} {number(limit[k])}" gainprm="{number(gain[k])}" '
            f'biastype="affine" biasprm="0 0 -{number(braking[k])}"{force_range}/>'
        )
    return lines
