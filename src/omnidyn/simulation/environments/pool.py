"""Robots as rows of numbers, one row per member of a pool: what an episode may be given. Drawn beforehand.

    drive = gain share + push/M,   gain = B u_max [m/s^2],   c = C/M, S/M [m/s^2],   a [1/s],   phi = (1 - e^(-a h))/a

The pool has a place for every combination of what is drawn for life (startup), for an episode (reset), and for an
interval: startup x reset x interval rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.drive import DUTY
from omnidyn.model.keys import Key, expand
from omnidyn.model.known.uncertainty import plausible
from omnidyn.model.motor import DYNAMIC, no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.simulation.batch.engine_kind import BOX, DIRECTION, EXACT, VOLTAGE, engine_kind
from omnidyn.simulation.batch.parameters import BatchParameters, batch_parameters
from omnidyn.simulation.commands import loop_gains
from omnidyn.simulation.environments.layout import BOX_LAW, DIRECTION_LAW, EXACT_LAW
from omnidyn.simulation.exact.exact_march import why_not_exact

STARTUP, RESET, INTERVAL = WHEN = "startup", "reset", "interval"
ABS, SCALE, ADD = HOW = "abs", "scale", "add"
MOST_MEMBERS = 1024  # of a pool that ranges make


@dataclass(frozen=True)
class Range:
    """Between which ends a number of the robot is drawn, evenly. how: it is the number, a factor, or is added.

    when: for life ("startup"), for each episode ("reset"), or each time an interval is over.
    """

    low: float
    high: float
    how: Literal["abs", "scale", "add"] = SCALE
    when: Literal["startup", "reset", "interval"] = RESET

    def __post_init__(self) -> None:
        if self.how not in HOW:
            raise InputError("unknown kind of range", got=self.how, expected=" or ".join(HOW), where="how")
        if self.when not in WHEN:
            raise InputError("unknown time of a draw", got=self.when, expected=" or ".join(WHEN), where="when")
        if not (np.isfinite([self.low, self.high]).all() and self.low <= self.high):
            got = f"{self.low:g} to {self.high:g}"
            raise InputError("not a range", got=got, expected="two finite numbers, the lower one first", where="range")

    def of(self, value: float, share: float) -> float:
        """The number at a share of the way from the lower end to the upper one."""
        drawn = self.low + share * (self.high - self.low)
        return {ABS: drawn, SCALE: value * drawn, ADD: value + drawn}[self.how]


@dataclass(frozen=True)
class Pool:
    """parameters: of a robot for every place, the last one fastest. sizes: draws for life, for episodes, for intervals.

    robots: of the same places, those that were given or drawn; none where only parameters were given.
    """

    parameters: BatchParameters
    sizes: tuple[int, int, int]
    robots: tuple[Robot, ...] = ()


def drawn_pool(robots: Sequence[Robot], ranges: Mapping[str, Range], uncertainty: str = "", seed: int = 0) -> Pool:
    """The pool of robots that are given, for life, of what their numbers may be off by, and of ranges of these.

    A key of a list without its place, such as "friction.axes.coulomb", draws one factor or number for all of its
    entries. The draws of a range are spread evenly over it, those of a std over its normal (Latin hypercubes).

    Args:
        robots: For life, one after the other.
        ranges: By keys of the robot file.
        uncertainty: When other draws of the std and correlations of the robot file are taken: "startup", "reset" or
            "interval"; "" takes none. They need one robot.
        seed: Of the draws.

    Raises InputError for an unknown key or time, or a range in which the robot leaves what a robot file may hold, and
    InsufficientDataError where no number of a robot has a std.
    """
    if uncertainty not in ("", *WHEN):
        raise InputError("unknown time of a draw", got=uncertainty, expected=", ".join(WHEN), where="uncertainty")
    sizes = _sizes(len(robots), {entry.when for entry in ranges.values()} | ({uncertainty} - {""}))
    bases, along = list(robots), 0
    if uncertainty:
        if len(robots) > 1:
            got = f"{len(robots)} robots"
            raise InputError("draws of std take one robot", got=got, expected="one, or no draws", where="uncertainty")
        along = WHEN.index(uncertainty)
        bases = plausible(robots[0], sizes[along], seed)
    random, shares = np.random.default_rng(seed), {}
    for name, entry in ranges.items():
        count = sizes[WHEN.index(entry.when)]
        shares[name] = (random.permutation(count) + 0.5) / count
    members = []
    for place in np.ndindex(sizes):
        robot = bases[place[along] % len(bases)]
        for name, entry in ranges.items():
            robot = _changed(robot, name, entry, float(shares[name][place[WHEN.index(entry.when)]]))
        members.append(robot)
    return Pool(batch_parameters(members), sizes, tuple(members))


def _sizes(robots: int, when: set[str]) -> tuple[int, int, int]:
    """How many draws there are of each kind."""
    draws = max(2, int(MOST_MEMBERS ** (1.0 / max(1, len(when)))))
    startup, reset, interval = (draws if kind in when else 1 for kind in WHEN)
    return max(startup, robots), reset, interval


def _changed(robot: Robot, name: str, entry: Range, share: float) -> Robot:
    """The robot with one number, or all numbers of a list, changed."""
    keys = [Key.parse(key) for key in expand(name, robot)]
    for key in keys:
        try:
            robot = key.set(robot, entry.of(float(key.get(robot)), share))
        except InputError as error:
            raise error.at(f"range of {name}") from None
    return robot


LAWS = {EXACT: EXACT_LAW, BOX: BOX_LAW, DIRECTION: DIRECTION_LAW}


def law_of(robot: Robot) -> int | None:
    """How a robot is moved in blocks; None where it cannot be."""
    return LAWS.get(engine_kind(robot, VOLTAGE, None))


def why_no_environment(robot: Robot) -> list[str]:
    """What environments cannot do about this robot, each in words; empty when they can."""
    reasons = why_not_exact(robot) if law_of(robot) is None else []
    if robot.motor.electrical == DYNAMIC:
        reasons.append('winding inductance ([motor] electrical = "dynamic")')
    if robot.drive.coasts:
        reasons.append('motors that coast ([drive] off = "coast")')
    if robot.drive.voltage_map:
        reasons.append("a map of its driver ([drive] voltage_map)")
    return reasons


def check_robots(robots: Sequence[Robot]) -> None:
    """Raises UnsupportedError for a robot that has no environment, InputError for those of different kinds."""
    kinds = {}
    for robot in robots:
        if reasons := why_no_environment(robot):
            raise UnsupportedError(
                "environments cannot move this robot",
                got=f"{robot.name}: {', '.join(reasons)}",
                expected="friction on the body axes or along the direction of travel, volts, duties or wheel speeds",
                remedy="switch it off in a copy of the robot, by robot.replace(..)",
                where="robot",
            )
        kinds[(robot.wheels.count, robot.drive.kind, law_of(robot))] = robot.name
    if len(kinds) > 1:
        got = ", ".join(f"{name}: {wheels} wheels, {drive}, law {law}" for (wheels, drive, law), name in kinds.items())
        raise InputError("robots of different kinds", got=got, expected="one kind of drive and friction", where="robot")


def largest_voltage(robot: Robot) -> FloatArray:
    """What an action of 1 is [V]: the limit of the motor, or the supply where that is less. Shape (wheels,)."""
    volts = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    if robot.drive.kind != DUTY or robot.drive.supply is None:
        return volts
    return np.minimum(volts, robot.drive.supply)


def largest_speed(robot: Robot) -> FloatArray:
    """What an action of 1 is of a drive with a speed loop [rad/s]: the speed without load at the limit. (wheels,)."""
    return no_load_speed(robot.motor, per_wheel(robot.motor.voltage_limit, robot.wheels.count))


def loop_rows(robots: Sequence[Robot]) -> FloatArray:
    """The numbers of speed loops: LOOP of each wheel. Shape (wheels LOOP, robots)."""
    columns = []
    for robot in robots:
        kp, ki, limit, radius = loop_gains(robot)
        rims = robot.wheels.wrench_matrix / radius
        columns.append(np.stack([kp, ki / float(robot.drive.rate or np.inf), limit, *rims], axis=1).reshape(-1))
    return np.array(columns).T


def rows_of(
    parameters: BatchParameters,
    law: int,
    turning: Any,
    voltage: FloatArray,
    pieces: FloatArray,
    dtype: Any,
    loops: FloatArray | None = None,
) -> FloatArray:
    """The numbers of robots. Shape (robots, rows).

    Args:
        parameters: Of the robots.
        law: How they are moved.
        turning: Whether their frame turns, shape (robots,) or one for all.
        voltage: What an action of 1 is [V], (wheels,).
        pieces: Lengths whose phi is needed [s], shape (pieces,).
        dtype: Of the rows.
        loops: Of `loop_rows`, where there are speed loops.
    """
    mass, push = parameters.mass, (parameters.push * voltage[:, None]).swapaxes(0, 1)  # (wheels, 3, n)
    between = np.zeros((0, parameters.count)) if loops is None else loops
    if law == EXACT_LAW:
        rate = parameters.damping / mass
        held = [-np.expm1(-rate * length) / rate for length in pieces]
        columns = [
            parameters.coulomb / mass,
            parameters.breakaway / mass,
            rate,
            1.0 / mass,
            *held,
            between,
            *(push / mass),
        ]
    else:
        frame = np.zeros((3 * len(pieces), parameters.count))
        frame[0] = np.where(turning, parameters.body_mass, 0.0)
        columns = [parameters.coulomb, parameters.damping, mass, np.ones_like(mass), frame, between, *push]
    return np.ascontiguousarray(np.concatenate(columns).T, dtype=dtype)
