"""The numbers of a robot whose wheels may slip, as the kernels of this room read them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.mass import off_centre
from omnidyn.model.motor import DYNAMIC, mass_at_rim
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, sin_cos_deg
from omnidyn.simulation.slip.loads import load_shift, wheel_loads

FORGETS = (0.15, 30.0)  # [s] in which a robot is taken to forget an error, at least and at most

# The keys of friction that this engine knows; one that a later law brings is refused by its name.
KNOWN = {
    "axes": ("viscous", "coulomb", "breakaway"),
    "direction": ("coulomb", "breakaway", "viscous", "yaw_coulomb", "yaw_breakaway", "yaw_viscous"),
    "wheels": ("coulomb", "coulomb_backward", "breakaway", "breakaway_backward", "viscous"),
}


class SlipPlant(NamedTuple):
    """Body: mass (3,) [kg, kg, kg m^2], about the centre of the wheels; centre (2,) of mass [m]; alone: the share of it
    that is left to a force where the centre stands off; turning [kg], the mass in the terms of a turning frame, or 0;
    viscous (3,) and dry (3,) along the axes [N s/m, N]; ellipse (2,) of the direction of travel [N]; room (2,): a pull
    on the centre of mass there [N].

    Wheels (n,): g (n, 3) their columns of the wrench matrix; spin [kg] at the rim; grip [N], what the floor takes, and
    shift (n, 2), what a force of the floor on the body adds to it [N/N], zeros (0, 2) where it adds nothing;
    thrust [N/A], emf [V s/m], resistance, drop of the motors; drag [N s/m], forward, backward [N]: friction at the rim;
    radius. memory [s].
    """

    mass: FloatArray
    centre: FloatArray
    alone: float
    turning: float
    viscous: FloatArray
    dry: FloatArray
    ellipse: FloatArray
    room: FloatArray
    g: FloatArray
    spin: FloatArray
    grip: FloatArray
    shift: FloatArray
    thrust: FloatArray
    emf: FloatArray
    resistance: FloatArray
    drop: FloatArray
    drag: FloatArray
    forward: FloatArray
    backward: FloatArray
    radius: FloatArray
    memory: float


def slip_plant(robot: Robot) -> SlipPlant:
    """The numbers of a robot. Raises UnsupportedError for what has no law here yet, by name."""
    _refuse(robot)
    n, motor, friction = robot.wheels.count, robot.motor, robot.friction
    axes, along, rim = friction.axes, friction.direction, friction.wheels
    at_rim = per_wheel(motor.gear_ratio, n) / robot.wheels.radii
    mass = np.diag(np.diag([robot.body.mass, robot.body.mass, robot.body.inertia]) + off_centre(robot)).copy()
    alone = 1.0 - float(np.hypot(*robot.body.centre)) * float(np.sqrt(mass[0] / mass[2]))
    viscous = np.add(axes.viscous, [along.viscous, along.viscous, along.yaw_viscous])
    slowest = float(np.max(mass / np.maximum(viscous, 1e-9 * mass)))
    return SlipPlant(
        mass, np.array(robot.body.centre), alone, robot.body.mass if robot.body.rotating_frame else 0.0, viscous,
        np.add(axes.coulomb, [0.0, 0.0, along.yaw_coulomb]), np.array(along.coulomb, dtype=float),
        robot.floor.pull(robot.body.mass), np.ascontiguousarray(robot.wheels.wrench_matrix.T),
        mass_at_rim(motor, robot.wheels), grips(robot), _shift(robot), at_rim * per_wheel(motor.torque_constant, n),
        at_rim * per_wheel(motor.emf_constant, n), per_wheel(motor.resistance, n), per_wheel(motor.voltage_drop, n),
        per_wheel(rim.viscous, n), per_wheel(rim.coulomb, n), per_wheel(rim.backward, n), robot.wheels.radii,
        min(max(slowest, FORGETS[0]), FORGETS[1]),
    )  # fmt: skip


def grips(robot: Robot) -> FloatArray:
    """The traction that the floor takes of each wheel along its rolling direction [N]: mu N. Shape (wheels,).

    A mecanum wheel pushes along the axle of its roller, 1/cos(roller angle) as hard: its limit is less by that.
    """
    return _per_load(robot) * wheel_loads(robot).newtons


def _per_load(robot: Robot) -> FloatArray:
    """Traction over load of each wheel. Shape (wheels,)."""
    count = robot.wheels.count
    _, cos = sin_cos_deg(per_wheel(robot.wheels.roller_angle_deg, count))
    mu = np.inf if robot.wheels.traction_mu is None else robot.wheels.traction_mu
    return per_wheel(mu, count) * cos


def _shift(robot: Robot) -> FloatArray:
    """What forces of the floor add to the grip of each wheel."""
    if robot.body.centre_height == 0.0:
        return np.zeros((0, 2))
    return np.ascontiguousarray(_per_load(robot)[:, None] * load_shift(robot))


def _refuse(robot: Robot) -> None:
    """Names what this engine cannot do about a robot."""
    found, friction = [], robot.friction
    if robot.motor.electrical == DYNAMIC:
        found.append('winding inductance ([motor] electrical = "dynamic")')
    if np.any(np.asarray(robot.motor.gear_efficiency) != 1.0):
        found.append("gear efficiency ([motor] gear_efficiency)")
    if (mass_at_rim(robot.motor, robot.wheels) <= 0.0).any():
        found.append("wheels that weigh nothing ([wheels] inertia_kg_m2 = 0)")
    pairs = (
        (friction.axes.breakaway, friction.axes.coulomb), (friction.direction.breakaway, friction.direction.coulomb),
        (friction.direction.yaw_breakaway, friction.direction.yaw_coulomb),
        (friction.wheels.hold_forward, friction.wheels.coulomb),
        (friction.wheels.hold_backward, friction.wheels.backward),
    )  # fmt: skip
    if any(hold is not None and np.any(np.subtract(hold, slide) != 0.0) for hold, slide in pairs):
        found.append("a breakaway above Coulomb friction (breakaway)")
    for name, known in KNOWN.items():
        law = getattr(friction, name)
        more = [key for key in type(law).model_fields if key not in known]
        strange = [key for key in more if getattr(law, key) != type(law).model_fields[key].default]
        found += [f"{', '.join(strange)} of [friction.{name}]"] if strange else []
    if robot.body.centre_height > 0.0 and np.any(np.asarray(robot.wheels.roller_angle_deg) != 0.0):
        found.append("the height of the centre of mass on mecanum wheels, whose places no key has")
    if found:
        raise UnsupportedError(
            "wheels that slip are simulated without some of what this robot has", got="; ".join(found),
            expected="settled currents, wheels with an inertia, breakaway as coulomb", where="[wheels] traction_mu",
            remedy="change that, or leave traction_mu out",
        )  # fmt: skip
