"""What a robot may have beyond the plainest one, and what each kind of export does with it: the published table.

    says        it is in the file, as exact as the format's own motion is
    partly      it is in the file, with a word on what differs
    leaves out  a comment in the file, and a line when it is written, say so
    refuses     the file would be another robot: the export ends with an error that names the feature

A kind does not decide for itself: `refuse` and `left_out` read this table, docs/exports.md shows it, tests walk it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from omnidyn.errors import UnsupportedError
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.dynamics import is_decoupled, state_space
from omnidyn.model.friction.direction import PLAIN
from omnidyn.model.friction.kinds import COULOMB, KINDS
from omnidyn.model.mass import of_body_alone, spin_couples
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import levels_of

SAYS, PARTLY, LEAVES_OUT, REFUSES = "says", "partly", "leaves out", "refuses"


_BEND = ", ".join(f'"{law}"' for law in KINDS if law != COULOMB)


class Feature(NamedTuple):
    """Something a robot may have. words: with the key that switches it on. has: whether a robot has it."""

    words: str
    has: Callable[[Robot], bool]


class Cell(NamedTuple):
    """What a kind does with a feature, and what a reader of the file must know."""

    does: str
    words: str = ""


def _any(value: object, plain: float = 0.0) -> bool:
    return bool(np.any(np.asarray(value) != plain))


def _unequal(robot: Robot) -> bool:
    motor = robot.motor
    values = (
        motor.resistance,
        motor.torque_constant,
        motor.emf_constant,
        motor.gear_ratio,
        motor.inductance,
        robot.wheels.wheel_radius,
    )
    return any(isinstance(value, tuple) and len(set(value)) > 1 for value in values)


def _couples(robot: Robot) -> bool:
    return spin_couples(robot) or (not _unequal(robot) and not is_decoupled(state_space(of_body_alone(robot))))


def _holds_more(robot: Robot) -> bool:
    axes, along, wheels = robot.friction.axes, robot.friction.direction, robot.friction.wheels
    pairs = (
        (axes.breakaway, axes.coulomb),
        (along.breakaway, along.coulomb),
        (along.yaw_breakaway, along.yaw_coulomb),
        (wheels.hold_forward, wheels.coulomb),
        (wheels.hold_backward, wheels.backward),
    )
    return any(hold is not None and _any(np.subtract(hold, slide)) for hold, slide in pairs)


def uneven(robot: Robot) -> bool:
    """Whether the wheels do not stand at equal angles, at one distance, with one radius."""
    azimuth = np.sort(np.mod(robot.wheels.azimuth_deg, 360.0))
    gaps = np.diff(np.append(azimuth, azimuth[0] + 360.0))
    lists = (robot.wheels.robot_radius, robot.wheels.wheel_radius)
    return bool(np.max(np.abs(gaps - 360.0 / len(azimuth))) > 1e-6) or any(
        isinstance(value, tuple) and len(set(value)) > 1 for value in lists
    )


# Place of a mecanum wheel -> the row of r w = (v_x, v_y, k omega) of its joint in
# mecanum_drive_controller, and whether that is minus our row.
PLACES = {
    "front_left": ((1.0, -1.0, -1.0), True),
    "front_right": ((1.0, 1.0, 1.0), False),
    "rear_right": ((1.0, -1.0, 1.0), False),
    "rear_left": ((1.0, 1.0, -1.0), True),
}
SAME = 1e-9  # of an entry of G


def mecanum_places(robot: Robot) -> dict[str, int] | None:
    """Place -> wheel, counted from 0, of four equal mecanum wheels in an X at 45 degrees; None for other wheels."""
    wheels = robot.wheels
    rows, b = wheels.wrench_matrix.T, float(np.mean(wheels.robot_radius))
    if wheels.count != 4 or np.ptp(wheels.radii) > 0.0:
        return None
    found = {}
    for place, (row, is_minus) in PLACES.items():
        ours = np.array(row) * (-1.0 if is_minus else 1.0) * (1.0, 1.0, b)
        alike = np.flatnonzero(np.abs(rows - ours).max(axis=1) < SAME * max(1.0, b))
        if len(alike) != 1:
            return None
        found[place] = int(alike[0])
    return found


FEATURES = {
    "axes": Feature(
        "friction on the body axes ([friction.axes])",
        lambda robot: _any(robot.friction.axes.coulomb) or _any(robot.friction.axes.viscous),
    ),
    "direction": Feature(
        "friction along the direction of travel ([friction.direction])",
        lambda robot: robot.friction.direction != type(robot.friction.direction)(),
    ),
    "plain": Feature(
        'a plain ellipse along the direction of travel ([friction.direction] ellipse = "plain")',
        lambda robot: robot.friction.direction.ellipse == PLAIN,
    ),
    "wheels": Feature(
        "friction at the wheels ([friction.wheels])",
        lambda robot: robot.friction.wheels != type(robot.friction.wheels)(),
    ),
    "breakaway": Feature("a breakaway above Coulomb friction (breakaway)", _holds_more),
    "falls": Feature(
        "friction that falls with the speed (stribeck_speed)", lambda robot: bool(levels_of(robot).falls.any())
    ),
    "bends": Feature(
        f"friction that bends, or rests in a band (law = {_BEND})",
        lambda robot: robot.rigid is not robot,
    ),
    "sides": Feature(
        "friction of an axis forward unlike backward ([friction.axes] coulomb_backward, breakaway_backward)",
        lambda robot: (
            robot.friction.axes.backward != robot.friction.axes.coulomb
            or robot.friction.axes.hold_backward != (robot.friction.axes.breakaway or robot.friction.axes.coulomb)
        ),
    ),
    "centre": Feature(
        "a centre of mass beside that of the wheels ([body] centre_m)", lambda robot: any(robot.body.centre)
    ),
    "frame": Feature("the turning frame ([body] rotating_frame = true)", lambda robot: robot.body.rotating_frame),
    "no-frame": Feature(
        "no turning frame ([body] rotating_frame = false)", lambda robot: not robot.body.rotating_frame
    ),
    "inductance": Feature(
        'winding inductance ([motor] electrical = "dynamic")', lambda robot: robot.motor.electrical == DYNAMIC
    ),
    "current": Feature(
        "a current limit ([motor] current_limit_A)", lambda robot: robot.motor.current_limit is not None
    ),
    "drop": Feature("a voltage drop ([motor] voltage_drop_V)", lambda robot: _any(robot.motor.voltage_drop)),
    "gear": Feature("gear efficiency ([motor] gear_efficiency)", lambda robot: _any(robot.motor.gear_efficiency, 1.0)),
    "spin": Feature(
        "inertia of rotors and wheels ([motor] rotor_inertia_kg_m2, [wheels] inertia_kg_m2)",
        lambda robot: _any(robot.motor.rotor_inertia) or _any(robot.wheels.wheel_inertia),
    ),
    "unequal": Feature("unequal motors or wheel radii (a list in [motor] or [wheels])", _unequal),
    "couples": Feature("a wheel layout or inertias whose axes couple", _couples),
    "rollers": Feature(
        "mecanum rollers ([wheels] roller_angle_deg)", lambda robot: _any(robot.wheels.roller_angle_deg)
    ),
    "uneven": Feature(
        "neither even omni wheels nor four mecanum wheels in an X ([wheels])",
        lambda robot: mecanum_places(robot) is None and (_any(robot.wheels.roller_angle_deg) or uneven(robot)),
    ),
    "slip": Feature("wheels that may slip ([wheels] traction_mu)", lambda robot: robot.wheels.traction_mu is not None),
    "slope": Feature("a floor that is not level ([floor] tilt_deg)", lambda robot: robot.floor.tilt != 0.0),
    "band": Feature("a dead band of the driver ([drive] dead_band_V)", lambda robot: robot.drive.dead_band > 0.0),
    "map": Feature("a driver that is no line ([drive] voltage_map_V)", lambda robot: bool(robot.drive.voltage_map)),
    "latency": Feature("latency of the drive ([drive] latency_s)", lambda robot: robot.drive.latency > 0.0),
    "loop": Feature('a speed loop in the firmware ([drive] kind = "speed")', lambda robot: robot.drive.kind == SPEED),
    "duty": Feature('a duty as command ([drive] kind = "duty")', lambda robot: robot.drive.kind == DUTY),
}

_DELAY = Cell(LEAVES_OUT, "the commands act at once: delay them by [drive] latency_s yourself")
_LOOP = Cell(LEAVES_OUT, "inputs are the volts at the motors: the speed loop of the firmware is not in it")
_DUTY = Cell(
    LEAVES_OUT, "inputs are the volts at the motors: give duty x supply; a motor at 0 V is shorted, never open"
)
_MAP = Cell(REFUSES, "its volts are those at the motors, which a driver that is no line does not pass on as asked")
_DRIVE = {"latency": _DELAY, "loop": _LOOP, "duty": _DUTY, "map": _MAP}
_STEP = {"slip": Cell(REFUSES, "it holds the steps of wheels that roll"), **_DRIVE}

_LEVEL = Cell(LEAVES_OUT, "the floor is level")
_ROLL = Cell(LEAVES_OUT, "its wheels roll, whatever they push with")
_COULOMB = Cell(LEAVES_OUT, "it slides with the Coulomb level at every speed")
_RIGID = Cell(LEAVES_OUT, "nothing bends, and nothing rests in a band: its levels count")
_FORWARD = Cell(LEAVES_OUT, "the level forward counts both ways")
_ALONG = Cell(LEAVES_OUT, "of the ellipse it knows the levels along each axis alone")
_LAWS = {"falls": _COULOMB, "bends": _RIGID, "sides": _FORWARD, "plain": _ALONG}

_GAINS = {
    "slope": _LEVEL,
    "slip": _ROLL,
    **_LAWS,
    "direction": Cell(PARTLY, "its level along each axis alone: in between, the axes share it"),
    "wheels": Cell(PARTLY, "its level along each axis alone: where a wheel turns back, the axes share it"),
    "breakaway": Cell(LEAVES_OUT, "kS is what sliding takes; from rest the robot needs more"),
    "frame": Cell(LEAVES_OUT, "each axis for itself: driving and turning at once takes M omega v more"),
    "inductance": Cell(LEAVES_OUT, "the currents have settled"),
    **dict.fromkeys(
        ("band", "drop"),
        Cell(PARTLY, "kS makes up for it on axes whose motors all turn; a motor whose share is within it gets none"),
    ),
    "current": Cell(LEAVES_OUT, "volts beyond what the current limit allows do not act"),
    "gear": Cell(LEAVES_OUT, "no gear takes anything"),
    "couples": Cell(LEAVES_OUT, "each axis for itself: here one axis also drives another one"),
    "centre": Cell(PARTLY, "kA of turning is about the centre of the wheels; that a push turns the robot is left out"),
    "latency": _DELAY,
    "map": _MAP,
    "loop": Cell(LEAVES_OUT, "volts at the motors: the speed loop of the firmware is not in it"),
}

_NEWTON = Cell(PARTLY, "its body is Newtonian: the turning frame is in it, as in any real body")
_MUJOCO = {
    "slope": _LEVEL,
    "slip": _ROLL,
    **_LAWS,
    "axes": Cell(
        PARTLY, "viscous friction stands still in the world: levels along x and y that differ are those at heading 0"
    ),
    "wheels": Cell(PARTLY, "its dry part is a box along x and y of the body, of the level along each axis alone"),
    "plain": Cell(LEAVES_OUT, "its ellipse is that of maximum dissipation"),
    "breakaway": Cell(
        LEAVES_OUT,
        "it breaks away at the Coulomb level, and slides on a slope that the robot holds; to hold there, export a copy "
        "of the robot file with coulomb raised to breakaway",
    ),
    "no-frame": _NEWTON,
    "inductance": Cell(LEAVES_OUT, "currents settle at once"),
    "drop": Cell(LEAVES_OUT, "actuators are linear in the volts"),
    "gear": Cell(LEAVES_OUT, "no gear takes anything"),
    "spin": Cell(PARTLY, "armature of joints turns with the world: as if what spins were mass, without coupling"),
    "band": Cell(LEAVES_OUT, "all of the volts act: take the dead band off yourself"),
    **_DRIVE,
}

_ON_WHEELS = "the format has friction at joints only: none of it is in the file"
_LINKS = {
    "slope": _LEVEL,
    "slip": _ROLL,
    **_LAWS,
    "axes": Cell(LEAVES_OUT, _ON_WHEELS),
    "direction": Cell(LEAVES_OUT, _ON_WHEELS),
    "wheels": Cell(PARTLY, "at the axle, the level of turning forward, both ways"),
    "breakaway": Cell(LEAVES_OUT, "a joint breaks away at the Coulomb level"),
    "no-frame": _NEWTON,
    "inductance": Cell(LEAVES_OUT, "there are no motors in the file, but their largest torque and speed"),
    "current": Cell(PARTLY, "the effort of a joint: what the limit allows at stall"),
    "drop": Cell(PARTLY, "the effort of a joint: less by the drop"),
    "gear": Cell(LEAVES_OUT, "no gear takes anything"),
    "spin": Cell(PARTLY, "wheels spin about their axles; the format has no word for rotors"),
    "rollers": Cell(LEAVES_OUT, "wheels are plain discs: URDF has no direction of friction"),
    **dict.fromkeys(("band", "map", "loop", "duty"), Cell(LEAVES_OUT, "there are no motors in the file")),
    "latency": Cell(LEAVES_OUT, "commands act at once"),
}

_KINEMATICS = "the controller knows kinematics only; the limits of velocity_smoother.yaml know it along each axis alone"
_ROS = {
    "slope": _LEVEL,
    "slip": _ROLL,
    **_LAWS,
    **dict.fromkeys(("axes", "direction", "wheels", "drop", "band", "map", "centre"), Cell(PARTLY, _KINEMATICS)),
    **dict.fromkeys(("breakaway", "frame", "inductance", "current", "gear"), Cell(LEAVES_OUT, "kinematics only")),
    "uneven": Cell(
        REFUSES,
        "ROS has drive controllers for evenly spaced omni wheels, and for four mecanum wheels in an X, of one size",
    ),
    "spin": Cell(PARTLY, _KINEMATICS),
    "latency": Cell(LEAVES_OUT, "the controller waits for nothing"),
    "loop": Cell(PARTLY, "joint velocities are commands to that loop; its gains stay in the firmware"),
    "duty": Cell(LEAVES_OUT, "the controller commands velocities: a loop in the hardware makes duties of them"),
}

# kind -> feature -> what it does; a feature that is not named is said.
TABLE: dict[str, dict[str, Cell]] = {
    "json": {},
    "c-model": _STEP,
    "c-controller": {
        "plain": Cell(REFUSES, 'its formula has the ellipse of maximum dissipation only: leave ellipse = "plain" out'),
        "falls": Cell(REFUSES, "its formula has signs and sums only: leave stribeck_speed out"),
        "bends": Cell(LEAVES_OUT, "nothing bends, and nothing rests in a band, as for the controller in Python"),
        "map": Cell(REFUSES, "its formula has signs and sums only: leave voltage_map_V out"),
        "inductance": Cell(LEAVES_OUT, "the currents have settled, as for the controller in Python"),
        "slope": Cell(REFUSES, "controllers know level floors only"),
        "slip": Cell(PARTLY, "it drives as if wheels rolled, with no more current than static loads let them"),
        "gear": Cell(REFUSES, "which gears drive is found by trying, and the C has no loops"),
    },
    "fmu": _STEP,
    "wpilib": _GAINS,
    "road-runner": _GAINS,
    "gains": _GAINS,
    "mjcf": _MUJOCO,
    "urdf": _LINKS,
    "sdf": {
        **_LINKS,
        "rollers": Cell(PARTLY, "discs whose friction acts along the axles of their rollers alone (fdir1)"),
        "slip": Cell(PARTLY, "traction_mu is mu of the contact: what slips, and how, is Gazebo's"),
    },
    "ros2-control": _ROS,
    "ros2-node": {
        **_GAINS,
        "slope": Cell(REFUSES, "its dead zone is that of a level floor"),
        "slip": Cell(REFUSES, "its dead zone is that of wheels that roll"),
        "breakaway": Cell(PARTLY, "from rest it pushes with the breakaway level, one axis at a time"),
    },
}

# controller -> what c-controller does with it; it refuses others.
CONTROLLERS: dict[str, Cell] = {
    "feedforward": Cell(SAYS),
    "pid": Cell(SAYS),
    "speed": Cell(SAYS),
    "mpc": Cell(SAYS),
}


def cell(kind: str, feature: str) -> Cell:
    """What a kind does with a feature."""
    return TABLE[kind].get(feature, Cell(SAYS))


def refuse(kind: str, robot: Robot) -> None:
    """Raises UnsupportedError, which names every feature of a robot that a kind refuses."""
    refused = [name for name, feature in FEATURES.items() if cell(kind, name).does == REFUSES and feature.has(robot)]
    if refused:
        words = dict.fromkeys(cell(kind, name).words for name in refused)
        raise UnsupportedError(
            f"{kind} cannot be exported for {robot.name}: {'; '.join(words)}",
            got="; ".join(FEATURES[name].words for name in refused)[:300],
            remedy="docs/exports.md says which kinds take it",
        )


def refuse_controller(kind: str, controller: str) -> None:
    """Raises UnsupportedError for a controller that a kind refuses."""
    support = CONTROLLERS.get(controller, Cell(REFUSES, "there is no C code of it"))
    if support.does == REFUSES:
        raise UnsupportedError(
            f"{kind} cannot be exported for the controller {controller}: {support.words}",
            got=controller,
            expected=" or ".join(name for name, candidate in CONTROLLERS.items() if candidate.does != REFUSES),
            where="controller",
        )


def left_out(kind: str, robot: Robot, instead: Mapping[str, Cell] | None = None) -> tuple[str, ...]:
    """What a kind cannot say of a robot, or says only partly: one line for each feature that the robot has.

    instead: feature -> what an option of the kind makes of it.
    """
    cells = ((feature, (instead or {}).get(name, cell(kind, name))) for name, feature in FEATURES.items())
    return tuple(
        f"{feature.words}: {support.words}" for feature, support in cells if support.words and feature.has(robot)
    )
