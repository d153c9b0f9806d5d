"""mjcf: a MuJoCo model: one body that slides in the plane, its motors as actuators in volts, back-EMF in their bias.

Each motor pushes along a line of the body (its column of the wrench matrix G, as `gear` of a site), with the force
l K_t i/r of eqs (10) (11): a gain per volt, and a bias in proportion to the speed of its rim, back-EMF and viscous
friction of the wheel. Its force range is the current limit. What spins is armature of the joints. Dry friction is that
of the joints: MuJoCo knows none in the frame of a body. By default it creeps (46 mm a minute at half of breakaway on
the paper's robot): the solver is told to hold it as stiff as it can, and to remove what slip is left.
"""

from __future__ import annotations

import numpy as np

from omnidyn.export.bodies.links import height_of, inertias, places, several
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
STIFF = 'solreffriction="0.002 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
NOTES = (
    "ctrl is the volts of the motors, u1, u2, ...; qvel is vx, vy in the frame of the world and omega; the sensors "
    "twist and gyro give them in the frame of the body",
    "the body slides in the plane and does not tip; it stands on no floor, and nothing rolls",
)


def mjcf(robot: Robot, height: float | None = None) -> Export:
    """A robot as a MuJoCo model. height [m]: of the body, for the inertia about the other axes."""
    refuse("mjcf", robot)
    omissions, tall = left_out("mjcf", robot), height_of(robot, height)
    text = "\n".join(
        [
            f"<mujoco model={attribute(robot.name)}>",
            xml_comment(
                [
                    f"{robot.name}, by omnidyn. SI units.",
                    *(f"Not as in omnidyn: {words}" for words in omissions),
                    f"Height of the body {tall:g} m, for its inertia about x and y: a guess, it does not tip.",
                ]
            ),
            f'  <option timestep="{STEP}" integrator="implicitfast" noslip_iterations="10"/>',
            "  <worldbody>",
            *_body(robot, tall),
            "  </worldbody>",
            "  <actuator>",
            *_actuators(robot),
            "  </actuator>",
            '  <sensor>\n    <velocimeter name="twist" site="body"/>\n    <gyro name="gyro" site="body"/>\n  </sensor>',
            "</mujoco>\n",
        ]
    )
    return Export("mjcf", robot.name, {"robot.xml": text}, omissions, NOTES)


def _body(robot: Robot, tall: float) -> list[str]:
    """The body, its three joints, and its looks."""
    mass, coulomb, spin = robot.body.mass, coulomb_along(robot), np.diag(added_mass(robot))
    viscous = np.array(robot.friction.axes.viscous)
    along = robot.friction.direction
    viscous = viscous + np.array([along.viscous, along.viscous, along.yaw_viscous])
    lines = [
        f'    <body name="base" pos="0 0 {number(float(robot.wheels.radii.max()))}">',
        f'      <inertial pos="{several(*robot.body.centre, 0.0)}" mass="{number(mass)}" diaginertia="'
        f'{several(*inertias(mass, robot.body.inertia, tall))}"/>',
    ]
    for axis, (name, kind, line) in enumerate(
        (("x", "slide", "1 0 0"), ("y", "slide", "0 1 0"), ("heading", "hinge", "0 0 1"))
    ):
        armature = f' armature="{number(spin[axis])}"' if spin[axis] else ""
        lines.append(
            f'      <joint name="{name}" type="{kind}" axis="{line}" damping="{number(viscous[axis])}" '
            f'frictionloss="{number(coulomb[axis])}" {STIFF}{armature}/>'
        )
    lines.append('      <site name="body"/>')
    lines += [
        f'      <geom name="wheel{k + 1}" type="cylinder" pos="{several(place.x, place.y, 0.0)}" '
        f'zaxis="{several(np.cos(place.azimuth), np.sin(place.azimuth), 0.0)}" '
        f'size="{several(place.radius, 0.3 * place.radius)}" mass="0" contype="0" conaffinity="0"/>'
        for k, place in enumerate(places(robot))
    ]
    return [*lines, "    </body>"]


def _actuators(robot: Robot) -> list[str]:
    """The motors, as forces along lines of the body."""
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
            f'    <general name="u{k + 1}" site="body" gear="{several(line[0], line[1], 0.0, 0.0, 0.0, line[2])}" '
            f'ctrlrange="-{number(limit[k])} {number(limit[k])}" gainprm="{number(gain[k])}" '
            f'biastype="affine" biasprm="0 0 -{number(braking[k])}"{force_range}/>'
        )
    return lines
