"""Points at constant speed with all axes at once: the motion, and the force of the motors that friction balances there.

traction   f = l K_t i / r from currents, or with i = (u - K_v l w)/R from voltage and speed, eqs (10) (11)
wrench     G f - M dv/dt, eqs (4)-(9): what still accelerates in a window is not balanced by friction; in a turning
           frame friction also balances M omega v
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.findings.needs import CURRENT, VOLTAGE, force_origin
from omnidyn.identification.fingerprints import count_once
from omnidyn.identification.steady.points import refuse_losses
from omnidyn.logs.plateaus import ANGLE, COMMANDS, SAME_COMMAND, Plateau, find_plateaus, held_pieces, live_angle, pool
from omnidyn.logs.sensor_rows import on_clock_of_wheels
from omnidyn.model.actuation import asked_voltage, reaching
from omnidyn.model.dynamics import frame_wrench
from omnidyn.model.mass import mass_matrix
from omnidyn.model.motor import settled_current, traction
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import rim_speed, twist_from_wheel_speed, wrench_from_traction
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement, statements

WHEEL, SET, GROUND = "wheel", "set", "ground"
SPEEDS = {
    WHEEL: "speed of the wheels",
    SET: "set speed",
    GROUND: "speed over the ground",
}
FORCES = {CURRENT: "motor currents, eqs (7)-(10)", VOLTAGE: "voltage and speed, eq (11)"}
STILL_SHARE = 1e-6  # of the fastest rim: slower is not moving, whatever the speed is
STILL_ERRORS = 2.0  # standard errors: a measured speed below is not known to move
AT_REST = 1e-3  # [m/s] at the rim
SPOT_SHARE = 0.1  # of the speed of the rims by turning: a robot that travels less than this turns on the spot
ACCELERATES = 0.01  # of the force: what the acceleration takes of it is told from there on
UNSIGNED_SHARE = 0.1  # of the windows, in which a wheel turns backward while no current is below 0


@dataclass(frozen=True, eq=False)
class ForcePoints:
    """Points at constant speed. One row per point; the arrays have shape (points, ...).

    twist [m/s, m/s, rad/s], (points, 3), by `speed_from`. traction [N], (points, wheels); wrench [N, N, N m], (points,
    3): what friction balances; wrench_std: of its mean over the window. still [m/s], (points,): a component of the
    motion slower than this is not known to move. travels, turns: whether the point has a direction of travel, and
    whether it turns, (points,); a turn on the spot has no direction of travel. direction: of the commanded motion
    [degree], or of the twist where no command was logged. group: name of each point's group. run: number of its run.
    rows: rows of the log behind it. span: start and end of its window [s], shape (points, 2).
    speed_from: "wheel", "set" or "ground". force_from: "current" or "voltage". notes: how they were made.
    """

    twist: FloatArray
    traction: FloatArray
    wrench: FloatArray
    wrench_std: FloatArray
    still: FloatArray
    travels: BoolArray
    turns: BoolArray
    direction: FloatArray
    group: tuple[str, ...]
    run: IntArray
    rows: IntArray
    span: FloatArray
    speed_from: str
    force_from: str
    notes: tuple[Statement, ...] = ()

    def __len__(self) -> int:
        return len(self.twist)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups in order of appearance."""
        return tuple(dict.fromkeys(self.group))

    def of(self, group: str) -> ForcePoints:
        """The points of one group."""
        return self.chosen(np.array([name == group for name in self.group]))

    @property
    def speed(self) -> FloatArray:
        """|(v_x, v_y)| [m/s]. Shape (points,)."""
        return np.hypot(self.twist[:, 0], self.twist[:, 1])

    @property
    def along(self) -> FloatArray:
        """Force along travel [N]; NaN where the robot has no direction of travel. Shape (points,)."""
        speed = self.speed
        with np.errstate(invalid="ignore", divide="ignore"):
            along = (self.wrench[:, :2] * self.twist[:, :2]).sum(axis=1) / speed
        return np.where(self.travels, along, np.nan)

    def chosen(self, selection: NDArray) -> ForcePoints:
        """Some of the points: a mask or indices."""
        index = np.arange(len(self))[selection]
        arrays = (
            "twist",
            "traction",
            "wrench",
            "wrench_std",
            "still",
            "travels",
            "turns",
            "direction",
            "run",
            "rows",
            "span",
        )
        parts = {name: getattr(self, name)[index] for name in arrays}
        return replace(self, **parts, group=tuple(self.group[k] for k in index))


@dataclass(frozen=True, eq=False)
class SteadyWindows:
    """The steady windows of runs, whatever the numbers of the robot are: (number of the run, run, window) of each.

    names: group of each run. speed, origin: of the points that are made of them. notes: how they were found.
    """

    found: tuple[tuple[int, Run, Plateau], ...]
    names: tuple[str, ...]
    speed: str
    origin: str
    notes: tuple[Statement, ...]

    def points(self, robot: Robot) -> ForcePoints:
        """What the forces of a robot's motors are there. Errors: as of `force_points`."""
        made_points = [
            (number, _point(run, robot, plateau, self.speed, self.origin), plateau)
            for number, run, plateau in self.found
        ]
        return _moving(_stacked(made_points, robot, self.names, self.speed, self.origin, [*self.notes]), robot)


def force_points(
    runs: Sequence[Run],
    robot: Robot,
    *,
    groups: Sequence[str] | None = None,
    speed: str = WHEEL,
    force_from: str = "",
    window: tuple[float, float] | None = None,
) -> ForcePoints:
    """Points from the steady windows of runs; windows of one run and one command are one point.

    groups: name of the group of each run. speed: which speed the points have, "wheel", "set" or "ground". force_from:
    "current" or "voltage"; "" takes current where all runs have it. window: shares of each command's rows instead of
    steady rows found, see `find_plateaus`.
    Currents must carry the sign of the torque. Voltage may be duty times supply.
    A recording given twice counts once, and the notes say so.
    Raises InputError for a run without what is asked for, InsufficientDataError when no window is steady and moves,
    UnsupportedError for losses in the gear.
    """
    return steady_windows(runs, robot, groups=groups, speed=speed, force_from=force_from, window=window).points(robot)


def steady_windows(
    runs: Sequence[Run],
    robot: Robot,
    *,
    groups: Sequence[str] | None = None,
    speed: str = WHEEL,
    force_from: str = "",
    window: tuple[float, float] | None = None,
) -> SteadyWindows:
    """The windows that `force_points` makes its points of. Errors: as there."""
    if speed not in SPEEDS:
        raise InputError("no such speed", got=speed, expected=", ".join(SPEEDS), where="speed")
    refuse_losses(robot)
    names = tuple(groups) if groups is not None else ("all",) * len(runs)
    if len(names) != len(runs):
        raise InputError("one group per run", got=f"{len(names)} groups", expected=str(len(runs)), where="groups")
    kept_runs, repeat_notes = count_once(runs, names)
    runs, names = [runs[k] for k in kept_runs], tuple(names[k] for k in kept_runs)
    origin = _origin(runs, force_from)
    windows_found, empty = [], []
    for number, run in enumerate(runs):
        if run.wheels is not None and run.wheels != robot.wheels.count:
            raise InputError(
                "the run has another number of wheels than the robot",
                got=str(run.wheels),
                expected=f"{robot.wheels.count} ({robot.name})",
                where=run.source,
            )
        run = on_clock_of_wheels(_with_voltage(run, robot) if origin == VOLTAGE else run)
        windows = pool(find_plateaus(run, start=window[0], end=window[1]) if window else find_plateaus(run))
        empty += [] if windows else [run.source]
        windows_found += [(number, run, rows) for rows in windows]
    missing_notes = (
        [Statement("no_steady_window", subject=empty[0] or "run 0", numbers={"empty": len(empty), "runs": len(runs)})]
        if empty
        else []
    )
    if origin == CURRENT:
        _refuse_unsigned(runs, [plateau for *_, plateau in windows_found])
    return SteadyWindows(tuple(windows_found), names, speed, origin, (*statements(repeat_notes), *missing_notes))


@dataclass(frozen=True, eq=False)
class HeldForces:
    """The pieces of the holds of one run in the order of time. span (n, 2): start and end [s]. command (n,): number of
    the command, alike where that is the same. force (n, 2): what friction balances along x and y [N]."""

    span: FloatArray
    command: IntArray
    force: FloatArray


def held_forces(run: Run, robot: Robot, origin: str, window: tuple[float, float] | None = None) -> HeldForces:
    """The pieces of a run one by one; in ForcePoints all rows of one command are a single point. As `force_points`."""
    run = on_clock_of_wheels(_with_voltage(run, robot) if origin == VOLTAGE else run)
    pieces = held_pieces(run, start=window[0], end=window[1]) if window else held_pieces(run)
    drive, speed, angle = run.current if origin == CURRENT else run.voltage, run.wheel_speed, live_angle(run)
    if drive is None or not pieces:
        return HeldForces(np.zeros((0, 2)), np.zeros(0, dtype=int), np.zeros((0, 2)))
    span = np.array([(run.t[rows.start], run.t[rows.stop - 1]) for rows in pieces])
    if speed is None and angle is not None:
        speed = np.gradient(angle, run.t, axis=0)
    mean = _means(drive, pieces)
    if speed is None:
        twist = rate = np.zeros((len(pieces), 3))
    else:
        wheels = _means(speed, pieces)
        if angle is not None:
            turned_angles = np.array([angle[rows.stop - 1] - angle[rows.start] for rows in pieces])
            wheels = turned_angles / np.diff(span, axis=1)
        mean = mean if origin == CURRENT else settled_current(robot.motor, reaching(robot, mean), wheels)
        twist = twist_from_wheel_speed(robot.wheels, wheels)
        rate = twist_from_wheel_speed(robot.wheels, np.array([_slope(run.t[rows], speed[rows]) for rows in pieces]))
    wrench = wrench_from_traction(robot.wheels, traction(robot.motor, robot.wheels, mean))
    force = (wrench - rate @ mass_matrix(robot).T + frame_wrench(robot, twist))[:, :2]
    command = _commands(run, pieces)
    known_pieces = np.isfinite(force).all(axis=1)
    return HeldForces(span[known_pieces], command[known_pieces], force[known_pieces])


def _means(values: FloatArray, pieces: Sequence[slice]) -> FloatArray:
    """The mean of the known rows of each piece; NaN where there is none. Shape (pieces, columns)."""
    known_mask = np.isfinite(values)
    sums, counts = (
        np.array([part[rows].sum(axis=0) for rows in pieces], dtype=float)
        for part in (np.where(known_mask, values, 0.0), known_mask)
    )
    return np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan)


def _slope(t: FloatArray, values: FloatArray) -> FloatArray:
    """Rate of change by least squares [1/s], 0 where a number is missing. Shape (columns,)."""
    centred = t - t.mean()
    return np.nan_to_num(centred @ values / (centred @ centred))


def _commands(run: Run, pieces: Sequence[slice]) -> IntArray:
    """The number of the command of each piece, alike where it is the same."""
    command_values = next((run.channels[name] for name in COMMANDS if name in run.channels), None)
    if command_values is None:
        return np.zeros(len(pieces), dtype=int)
    command = np.nan_to_num(_means(command_values, pieces))
    command_tolerance = SAME_COMMAND * max(float(np.abs(command).max(initial=0.0)), 1e-12)
    return np.unique(np.round(command / command_tolerance / 2.0), axis=0, return_inverse=True)[1].ravel()


def _origin(runs: Sequence[Run], requested_origin: str) -> str:
    if not runs:
        raise InsufficientDataError("no runs", got="0 runs", expected="at least one")
    if requested_origin not in ("", CURRENT, VOLTAGE):
        raise InputError(
            "no such origin of the force", got=requested_origin, expected="current or voltage", where="force_from"
        )
    if requested_origin:
        return requested_origin
    if origin := force_origin(runs):
        return origin
    run_without_current = next(run for run in runs if run.current is None)
    raise InputError(
        "no force can be had from this run",
        got=", ".join(run_without_current.channels) or "no channels",
        expected="current, or voltage (or duty and supply) with a speed",
        where=run_without_current.source,
    )


def _with_voltage(run: Run, robot: Robot) -> Run:
    """The run with the voltage that a duty of the supply makes, where no voltage was logged."""
    if run.voltage is not None or run.duty is None:
        return run
    voltage = asked_voltage(None, run.duty, run.supply, robot.drive.supply)
    if voltage is None:
        raise InputError(
            "a duty needs the voltage of the supply",
            got="neither logged nor in the robot file",
            expected="a column supply, or [drive] supply_V",
            where=run.source,
        )
    return run.replace(voltage=voltage)


def _point(run: Run, robot: Robot, plateau: Plateau, speed: str, origin: str) -> dict[str, FloatArray]:
    """Motion and force of one window."""
    moves = _twist(run, robot, plateau, speed)
    current, current_std = _current(run, robot, plateau, origin)
    force = traction(robot.motor, robot.wheels, current)
    inertial, inertial_std = _inertial_wrench(robot, plateau)
    unit_force = traction(robot.motor, robot.wheels, np.eye(len(current)))
    per_wheel = wrench_from_traction(robot.wheels, unit_force)  # of one ampere in each motor, (wheels, 3)
    twist, still_speed = moves
    travel, turn = np.hypot(*twist[:2]), abs(twist[2]) * float(np.mean(robot.wheels.robot_radius))
    return {
        "twist": twist,
        "still": still_speed,
        "travels": travel > max(still_speed, SPOT_SHARE * turn),
        "turns": turn > max(still_speed, SPOT_SHARE * travel),
        "traction": force,
        "wrench": wrench_from_traction(robot.wheels, force) - inertial + frame_wrench(robot, twist),
        "wrench_std": np.sqrt(current_std**2 @ per_wheel**2 + inertial_std**2),
        "inertial": inertial,
        "direction": _direction(robot, plateau, twist),
    }


def _inertial_wrench(robot: Robot, plateau: Plateau) -> tuple[FloatArray, FloatArray]:
    """M dv/dt [N, N, N m] of a window, and its standard error; by the wheels, else by the twist, else 0."""
    name = "wheel_speed" if "wheel_speed" in plateau.rate else "twist"
    rate, std = plateau.rate.get(name, np.zeros(3)), plateau.rate_std.get(name, np.zeros(3))
    if not np.isfinite(std).all():  # too few numbers to tell
        return np.zeros(3), np.zeros(3)
    if name == "wheel_speed":
        unit_twists = twist_from_wheel_speed(robot.wheels, np.eye(len(rate)))  # of 1 rad/s^2 at each wheel, (wheels, 3)
        rate, std = rate @ unit_twists, np.sqrt(std**2 @ unit_twists**2)
    mass = mass_matrix(robot)
    return mass @ rate, np.sqrt(mass**2 @ std**2)


def _current(run: Run, robot: Robot, plateau: Plateau, origin: str) -> tuple[FloatArray, FloatArray]:
    """Current of each motor and its standard error [A]."""
    if origin == CURRENT:
        _need(run, plateau, "current")
        return plateau.mean["current"], plateau.std["current"]
    _need(run, plateau, "voltage")
    _need(run, plateau, "wheel_speed")
    volts, speed = reaching(robot, plateau.mean["voltage"]), plateau.mean["wheel_speed"]
    current = settled_current(robot.motor, volts, speed)
    by_volts = settled_current(robot.motor, volts + plateau.std["voltage"], speed) - current
    by_speed = settled_current(robot.motor, volts, speed + plateau.std["wheel_speed"]) - current
    return current, np.hypot(by_volts, by_speed)


def _need(run: Run, plateau: Plateau, channel: str) -> None:
    if channel not in plateau.mean or not np.isfinite(plateau.mean[channel]).all():
        raise InputError(
            "the run lacks a channel", got=", ".join(run.channels) or "no channels", expected=channel, where=run.source
        )


def _twist(run: Run, robot: Robot, plateau: Plateau, speed: str) -> tuple[FloatArray, FloatArray]:
    """(twist, what counts as still [m/s]) of one window."""
    if speed == GROUND:
        _need(run, plateau, "twist")
        rims, spread = rim_speed(robot.wheels, plateau.mean["twist"]), np.hypot(*plateau.std["twist"][:2])
        return plateau.mean["twist"], _still(rims, STILL_ERRORS * float(spread))
    if speed == SET:
        commanded = _commanded(robot, plateau)
        if commanded is None:
            raise InputError(
                "the run lacks a set speed",
                got=", ".join(run.channels),
                expected="twist_command or wheel_speed_command",
                remedy="use `speed` wheel",
                where=run.source,
            )
        return commanded, _still(rim_speed(robot.wheels, commanded), 0.0)
    _need(run, plateau, "wheel_speed")
    twist = twist_from_wheel_speed(robot.wheels, plateau.mean["wheel_speed"])
    spread = float((plateau.std["wheel_speed"] * robot.wheels.radii).max())
    return twist, _still(rim_speed(robot.wheels, twist), STILL_ERRORS * spread)


def _still(rims: FloatArray, floor: float) -> FloatArray:
    return np.asarray(max(STILL_SHARE * float(np.abs(rims).max()), floor))


def _commanded(robot: Robot, plateau: Plateau) -> FloatArray | None:
    """The commanded twist of a window, None where no set speed was logged."""
    for name in ("twist_command", "wheel_speed_command"):
        command = plateau.mean.get(name)
        if command is not None and np.isfinite(command).all():
            return command if name == "twist_command" else twist_from_wheel_speed(robot.wheels, command)
    return None


def _direction(robot: Robot, plateau: Plateau, twist: FloatArray) -> FloatArray:
    commanded = _commanded(robot, plateau)
    direction = twist if commanded is None or not commanded.any() else commanded
    return np.degrees(np.arctan2(direction[1], direction[0]))


def _refuse_unsigned(runs: Sequence[Run], windows: Sequence[Plateau]) -> None:
    """A sensor without sign: no current is ever below 0 although wheels turn both ways."""
    lowest = min((float(np.nanmin(run.current, initial=0.0)) for run in runs if run.current is not None), default=0.0)
    speeds = [window.mean.get("wheel_speed", window.mean.get("wheel_speed_command")) for window in windows]
    backward_count = sum(bool((speed < 0.0).any()) for speed in speeds if speed is not None)
    if lowest >= 0.0 and backward_count > UNSIGNED_SHARE * len(windows):
        raise InputError(
            "the currents have no sign: none is below 0",
            got=f"wheels that turn backward in {backward_count} of {len(windows)} windows",
            expected="currents signed as the torque",
            remedy="use `current_unsigned`",
            where=runs[0].source,
        )


def _stacked(
    point_rows: list[tuple[int, dict[str, FloatArray], Plateau]],
    robot: Robot,
    names: tuple[str, ...],
    speed: str,
    origin: str,
    notes: list[Statement],
) -> ForcePoints:
    if not point_rows:
        raise InsufficientDataError(
            "no steady window was found",
            got="; ".join(map(str, notes)) or "no rows",
            expected="stretches of constant speed, half a second or longer",
            remedy="hold each command longer",
        )
    arrays = {name: np.array([point[name] for _, point, _ in point_rows]) for name in point_rows[0][1]}
    notes = [*notes, *_about_acceleration(arrays.pop("inertial"), arrays["wrench"], robot)]
    if any(plateau.speed_from == ANGLE for *_, plateau in point_rows) and speed == WHEEL:
        notes = [*notes, Statement("speeds_from_angles", NOTE)]
    travels, turns = arrays.pop("travels") > 0.0, arrays.pop("turns") > 0.0
    return ForcePoints(
        **arrays,
        travels=travels,
        turns=turns,
        group=tuple(names[number] for number, _, _ in point_rows),
        run=np.array([number for number, _, _ in point_rows]),
        rows=np.array([plateau.count for *_, plateau in point_rows]),
        span=np.array([(plateau.start, plateau.end) for *_, plateau in point_rows]),
        speed_from=speed,
        force_from=origin,
        notes=tuple(notes),
    )


def _about_acceleration(inertial: FloatArray, wrench: FloatArray, robot: Robot) -> list[Statement]:
    """What accelerations took of the forces, where it is worth a word."""
    scale = [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))]
    largest_share = float(np.linalg.norm(inertial / scale, axis=1).max())
    if largest_share <= ACCELERATES * float(np.median(np.linalg.norm(wrench / scale, axis=1))):
        return []
    return [Statement("windows_accelerate", numbers={"force": largest_share})]


def _moving(points: ForcePoints, robot: Robot) -> ForcePoints:
    """The points in motion. Raises InsufficientDataError where the robot never moved; friction is then bounded only."""
    fastest = np.abs(rim_speed(robot.wheels, points.twist)).max(axis=1)
    moves = fastest > np.maximum(points.still, AT_REST)
    if not moves.any():
        force = np.hypot(points.wrench[:, 0], points.wrench[:, 1]).max()
        raise InsufficientDataError(
            "the robot never moved: it stayed inside its dead zone, so friction is only known to hold what pushed",
            got=f"at most {force:.3g} N of push",
            expected="windows in motion",
        )
    resting = int((~moves).sum())
    moving_points = points.chosen(moves)
    rest_note = Statement("windows_at_rest", NOTE, numbers={"windows": resting})
    return replace(moving_points, notes=(*moving_points.notes, rest_note)) if resting else moving_points
