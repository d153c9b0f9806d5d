"""The numbers of a robot whose wheels may slip, as the kernels of this room read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.friction.bristle import fade_of
from omnidyn.model.friction.direction import PLAIN
from omnidyn.model.friction.kinds import AXES, COULOMB, DIRECTION, KARNOPP, WHEELS
from omnidyn.model.friction.stribeck import steepest_of
from omnidyn.model.layout import BODY, N_AXES, YAW, Plant
from omnidyn.model.mass import off_centre
from omnidyn.model.motor import mass_at_rim
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.surroundings import GRAVITY
from omnidyn.model.wheels import per_wheel, sin_cos_deg

MEMORY_BOUNDS = (0.15, 30.0)  # [s] in which a robot is taken to forget an error, at least and at most
POWERS = {
    "coulomb": 1,
    "breakaway": 1,
    "bristle_coulomb": 1,
    "bristle_breakaway": 1,
    "fall": 1,
    "fade": 1,
    "viscous": 2,
    "stiffness": 2,
    "damping": 2,
}
"""Of the length by which yaw is measured, in each field of ELEMENT."""


class SlipPlant(NamedTuple):
    """Body: mass (3,) [kg, kg, kg m^2], about the centre of the wheels; centre (2,) of mass [m]; alone: the share of it
    that is left to a force where the centre stands off; turning [kg], the mass in the terms of a turning frame, or 0;
    room (2,): a pull on the centre of mass there [N].

    Friction and motors: body (1,) of BODY and element (3 + n,) of ELEMENT, see model/layout.py, but yaw is in rad; of
    BODY, what is friction. steep: [1/s] the rate at which friction that falls with the speed lets a body or a rim run
    away; gaps: 1 where a breakaway level is more than Coulomb's, without a fall between; remembers: 1 where currents or
    bristles have a memory.

    Wheels (n,): g (n, 3) their columns of the wrench matrix; spin [kg] at the rim; grip [N], what the floor takes, and
    shift (n, 2), what a force of the floor on the body adds to it [N/N], zeros (0, 2) where it adds nothing; radius.
    memory [s].
    """

    mass: FloatArray
    centre: FloatArray
    alone: float
    turning: float
    room: FloatArray
    body: Any
    element: Any
    steep: float
    gaps: float
    remembers: float
    g: FloatArray
    spin: FloatArray
    grip: FloatArray
    shift: FloatArray
    radius: FloatArray
    memory: float


def slip_plant(robot: Robot) -> SlipPlant:
    """The numbers of a robot. Raises UnsupportedError for what has no law here yet, by name."""
    _refuse(robot)
    mass = np.diag(np.diag([robot.body.mass, robot.body.mass, robot.body.inertia]) + off_centre(robot)).copy()
    uncoupled = 1.0 - float(np.hypot(*robot.body.centre)) * float(np.sqrt(mass[0] / mass[2]))
    spin, laws = mass_at_rim(robot.motor, robot.wheels), _in_radians(plant(robot))
    body, element = laws.body, laws.element
    for record, mass_of in zip(element[N_AXES:], spin, strict=True):
        record.steep = (steepest_of(record) + fade_of(record)) / mass_of
    steep = max(float(body.steep) + float(element["steep"][:N_AXES].sum()), float(element["steep"][N_AXES:].max()))
    has_gap = (element["breakaway"] > element["coulomb"]).any(axis=1) & (element["fall"] == 0.0)
    gaps = has_gap.any() or (body.fall == 0.0 and (body.breakaway > body.coulomb).any())
    bends = body.stiffness > 0.0 or (element["stiffness"] > 0.0).any()
    remembers = bends or (element["inductance"] > 0.0).any()
    slowest = float(np.max(mass / np.maximum(element["viscous"][:N_AXES], 1e-9 * mass)))
    return SlipPlant(
        mass,
        np.array(robot.body.centre),
        uncoupled,
        robot.body.mass if robot.body.rotating_frame else 0.0,
        robot.floor.pull(robot.body.mass),
        np.array([body], BODY),
        element,
        steep,
        float(gaps),
        float(remembers),
        np.ascontiguousarray(robot.wheels.wrench_matrix.T),
        spin,
        grips(robot),
        _shift(robot),
        robot.wheels.radii,
        min(max(slowest, MEMORY_BOUNDS[0]), MEMORY_BOUNDS[1]),
    )


def _in_radians(numbers: Plant) -> Plant:
    """The same plant, what acts about yaw in N m and rad, not in N and m of the length by which yaw is measured."""
    yaw, length = numbers.element[YAW], float(numbers.body.length)
    for name, power in POWERS.items():
        yaw[name] *= length**power
    return numbers


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


def _law(robot: Robot, place: str) -> str:
    """The word of a law."""
    return str(getattr(robot.friction, place).law)


def _refuse(robot: Robot) -> None:
    """Names what this engine cannot do about a robot."""
    refusals = []
    if (mass_at_rim(robot.motor, robot.wheels) <= 0.0).any():
        refusals.append("wheels that weigh nothing ([wheels] inertia_kg_m2 = 0)")
    places = (AXES, DIRECTION, WHEELS)
    bands = [place for place in places if _law(robot, place) == KARNOPP]
    refusals += [f'law = "{KARNOPP}" of [friction.{place}]' for place in bands]
    if robot.friction.direction.ellipse == PLAIN:
        refusals.append(f'ellipse = "{PLAIN}" of [friction.direction]: leave it out')
    if robot.body.centre_height > 0.0 and robot.wheels.places is None:
        refusals.append("the height of the centre of mass on mecanum wheels without wheelbase_m")
    if refusals:
        raise UnsupportedError(
            "wheels that slip are simulated without some of what this robot has",
            got="; ".join(refusals),
            expected="wheels with an inertia; laws that stick, or bend",
            where="[wheels] traction_mu",
            remedy=f'take law = "{COULOMB}", which sticks with the same levels: "{KARNOPP}" stands in for it where a '
            "solver cannot stick"
            if bands
            else "change that, or leave traction_mu out",
        )


# What each wheel carries: the weight, by where the wheels stand under the centre of mass c
#
# W = sum N = M g cos(tilt),   sum N x = W c_x,   sum N y = W c_y
#
# Three wheels: statics. Four or more, on equally stiff suspensions: of all loads that balance, those of the least sum
# of squares, N = a + b x + c y. A load that would have to be negative is that of a wheel in the air: it carries
# nothing, and the others share the weight.
#
# A centre of mass at a height h shifts loads as the robot speeds up, by the forces F of the floor on it:
#
#     sum N x = W c_x - h F_x,   sum N y = W c_y - h F_y

ROUNDING = 1e-9  # of the weight


@dataclass(frozen=True, eq=False)
class WheelLoads:
    """newtons (wheels,): 0 of a wheel in the air. lifted: which are, counted from 0."""

    newtons: FloatArray
    lifted: tuple[int, ...] = ()


def wheel_loads(robot: Robot) -> WheelLoads:
    """The static loads of the wheels of a robot [N].

    Raises UnsupportedError for mecanum wheels without a wheelbase under a centre of mass beside their own.
    """
    count, centre = robot.wheels.count, robot.body.centre
    if any(centre) and robot.wheels.places is None:
        raise UnsupportedError(
            "what mecanum wheels carry depends on where they stand, and no key says so",
            got=f"centre_m = {[*centre]}",
            expected="[0, 0] for mecanum wheels that slip, or [wheels] wheelbase_m",
            remedy="add wheelbase_m, from the axles in front to those behind",
            where="[body] centre_m",
        )
    weight = robot.body.mass * GRAVITY * float(np.cos(np.radians(robot.floor.tilt)))
    places = _places(robot)
    down = np.ones(count, dtype=bool)
    while True:
        loads = np.zeros(count)
        loads[down] = np.linalg.pinv(places[:, down]) @ [weight, weight * centre[0], weight * centre[1]]
        lowest = int(np.argmin(loads))
        if loads[lowest] >= -ROUNDING * weight or down.sum() <= 1:
            return WheelLoads(np.maximum(loads, 0.0), tuple(np.flatnonzero(~down).tolist()))
        down[lowest] = False


def load_shift(robot: Robot) -> FloatArray:
    """What a force of the floor along x and along y adds to each load [N/N]. Shape (wheels, 2)."""
    return -robot.body.centre_height * np.asarray(np.linalg.pinv(_places(robot))[:, 1:], dtype=float)


def _places(robot: Robot) -> FloatArray:
    """Rows of 1, x and y of the wheels; of mecanum wheels whose places no key has, one that is told not to matter."""
    places = robot.wheels.places
    return np.vstack([np.ones(robot.wheels.count), np.zeros((2, robot.wheels.count)) if places is None else places])
