"""Blind: a direction that the logs do not show, in words, and what would show it, found by experiments with the model.

The robot is moved a little along the direction and driven again: by the voltages of the log, to see which channels that
were not logged would show it, and by voltages along all axes, to see whether another drive would.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.compiled.beside import side_by_side
from omnidyn.document import all_of, short
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.engines.actuation import driver_of
from omnidyn.identification.output_error.problem.motion import DRIVE
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.blind import Way
from omnidyn.model.actuation import at_motors
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.keys import CENTRE, EMF, ROTOR, TORQUE, WHEEL, Key, find_key, in_words
from omnidyn.model.layout import YAW
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.simulate import simulate

EXACT = 30.0  # times its numbers that a direction may go: the same to the log, and not only nearly
TOLD = 0.1  # the change of the largest number that the words name
TRIED, SEEN = 1e-3, 0.01  # size of the change that is tried; share of it in a channel from which that shows it
ROWS, STEP, HOLD = 1000, 0.01, 50  # of an experiment: rows, their length [s], rows of one level
MOST = 5  # cures that are named
MEASURED = {
    "body.mass_kg": "weigh the robot", "wheels.wheel_radius_m": "measure the wheel radius",
    "wheels.robot_radius_m": "measure the robot radius", "motor.gear_ratio": "read the gear ratio off its data sheet",
    "motor.resistance_ohm": "measure the resistance of a motor", TORQUE: "take the torque constant from the data sheet",
    EMF: "take the emf constant from the data sheet (in SI it is the torque constant)",
    ROTOR: "take the rotor inertia from the data sheet", WHEEL: "weigh a wheel",
    CENTRE: "balance the robot on an edge",
    "body.inertia_kg_m2": "measure the inertia (swing the robot)", "gain": "measure the voltage at the motors",
}  # fmt: skip
CHANNELS = {
    "current": ("log currents", ("current",)), "wheel_speed": ("log wheel speeds", ("wheel_speed", "wheel_angle")),
    "twist": ("log the speed over the ground, or where the robot is", ("twist", "position")),
}  # fmt: skip


@dataclass(frozen=True)
class Blind:
    """A direction that the logs do not show. changes: number -> relative change, the largest 1 % of itself or of what
    it counts as. exact: whether the outputs stay the same, or nearly. cures: what would show it, easiest first."""

    changes: Mapping[str, float]
    exact: bool
    words: str
    cures: tuple[str, ...]

    def __str__(self) -> str:
        what = "them apart" if len(self.changes) > 1 else "it"
        return f"{self.words}; to tell {what}: {' or '.join(self.cures)}" if self.cures else self.words


def blind_in_words(
    problem: Problem, values: FloatArray, ways: Sequence[Way], moved: BoolArray
) -> tuple[Blind, ...]:  # fmt: skip
    """Each direction in words, with what would show it. values (P,); moved (3,): which axes did."""
    drives = _drives(problem, values) if ways else ()
    return tuple(side_by_side(lambda way: _in_words(problem, values, way, moved, drives), ways))


def _in_words(
    problem: Problem, values: FloatArray, way: Way, moved: BoolArray, drives: Sequence[_Drive]
) -> Blind:  # fmt: skip
    at = np.flatnonzero(way.step)
    names = [problem.names[j].partition("@")[0] for j in at]
    changes = {name: _relative(problem, values, way, int(j)) for name, j in zip(names, at, strict=True)}
    exact = way.reach > EXACT
    cures = tuple(dict.fromkeys(_cures(problem, values, way, names, moved, drives)))[:MOST]
    return Blind({name: 0.01 * change for name, change in changes.items()}, exact, _words(changes, exact), cures)


def _relative(problem: Problem, values: FloatArray, way: Way, j: int) -> float:
    """The change of a number along the direction, over the number, or over what it counts as where it is near 0."""
    p, value = problem.parameters[j], float(values[j])
    return float(way.step[j]) if p.log else float(way.step[j]) / max(abs(value), 0.1 * float(way.size[j]))


def _words(changes: Mapping[str, float], exact: bool) -> str:
    """ "mass +10 % and resistance -10 %: the same to this log"; entries of a list that change alike are one."""
    if len(changes) == 1:
        return f"{in_words(next(iter(changes)))}: this log {'does not show' if exact else 'hardly shows'} it"
    largest = max(map(abs, changes.values()))
    sign = np.sign(next(iter(changes.values())))
    percent = {name: 100.0 * TOLD * sign * change / largest for name, change in changes.items()}
    parts = all_of([f"{name} {short(share, '+.2g')} %" for name, share in _alike(percent)])
    return f"{parts}: {'the same to this log' if exact else 'this log hardly tells them apart'}"


def _alike(percent: Mapping[str, float]) -> Iterator[tuple[str, float]]:
    left = dict(percent)
    while left:
        name, share = next(iter(left.items()))
        key = find_key(name)
        alike = [
            each for each, other in left.items()
            if key is not None and (own := find_key(each)) is not None and own.name == key.name
            and abs(other - share) < 0.02 * abs(share)
        ]  # fmt: skip
        several = key is not None and len(alike) > 1
        yield (in_words(key.name) if key is not None and several else in_words(name)), share
        for each in alike if several else [name]:
            del left[each]


def _cures(
    problem: Problem, values: FloatArray, way: Way, names: list[str], moved: BoolArray, drives: Sequence[_Drive]
) -> Iterator[str]:
    yield from (MEASURED[one] for one in MEASURED if any(_is(name, one) for name in names))
    if not drives:
        return
    of_the_log, of_all_axes = drives
    try:
        yield from _by_channels(problem, of_the_log.differs(problem, values, way))
        seen = of_all_axes.differs(problem, values, way)
        if any(seen[name] for name in dict.fromkeys(name for name, _ in problem.columns) if name in seen):
            axes = {key.axis for name in names if (key := find_key(name)) is not None and key.axis is not None}
            still = sorted(axis for axis in axes if not moved[axis])
            yield all_of([DRIVE[axis] for axis in still]) or "drive at several speeds, both ways, with starts and stops"
    except OmnidynError:
        return


def _is(name: str, one: str) -> bool:
    key = find_key(name)
    return (Key.parse(name).name if key is not None else name) == one


def _by_channels(problem: Problem, seen: Mapping[str, bool]) -> Iterator[str]:
    """Channels that were not logged, and would show it under the same voltages."""
    logged = {name for name, _ in problem.columns}
    for channel, (words, instead) in CHANNELS.items():
        if not logged & set(instead) and seen[channel]:
            yield words


@dataclass(frozen=True, eq=False)
class _Drive:
    """Voltages (n, W) over dt (n,) from a twist (3,), and what each channel shows of the fitted robot under them."""

    volts: FloatArray
    dt: FloatArray
    start: FloatArray
    before: Mapping[str, FloatArray]

    @classmethod
    def of(
        cls, problem: Problem, values: FloatArray, volts: FloatArray, dt: FloatArray, start: FloatArray
    ) -> _Drive:  # fmt: skip
        return cls(volts, dt, start, _channels(problem, values, volts, dt, start))

    def differs(self, problem: Problem, values: FloatArray, way: Way) -> dict[str, bool]:
        """Channel -> whether a change along the direction shows in it."""
        other = values.copy()
        for j in np.flatnonzero(way.step):
            p = problem.parameters[j]
            other[j] = p.outer(p.inner(float(values[j])) + TRIED * float(way.step[j]))
        after, found = _channels(problem, other, self.volts, self.dt, self.start), {}
        for name, own in self.before.items():
            size = np.sqrt((own**2).mean(axis=0))
            change = np.sqrt(((after[name] - own) ** 2).mean(axis=0))
            found[name] = bool((change > SEEN * TRIED * np.maximum(size, 1e-3 * size.max(initial=1e-9))).any())
        return found


def _drives(problem: Problem, values: FloatArray) -> tuple[_Drive, ...]:
    """That of the log, and one along all axes; none where there are no voltages, or no engine simulates them."""
    if any(piece.record.set_point is not None for piece in problem.pieces):
        return ()
    piece = max(problem.pieces, key=lambda each: each.last - each.first)
    rows = slice(piece.first, min(piece.last, piece.first + ROWS))
    t = piece.record.t[piece.first : rows.stop + 1]
    robot = problem.robot_at(values)
    shape = np.linalg.pinv(robot.wheels.wrench_matrix)
    shape /= np.abs(shape).max(axis=0)
    levels = np.random.default_rng(0).uniform(-1.0, 1.0, (ROWS // HOLD, 3)) @ shape.T
    limit = robot.motor.voltage_limit or max(float(np.nanmax(np.abs(p.record.voltage))) for p in problem.pieces)
    volts = np.repeat(np.clip(levels, -1.0, 1.0) * float(np.min(limit)), HOLD, axis=0)
    asked = (piece.record.voltage[rows], np.diff(t), piece.start), (volts, np.full(len(volts), STEP), np.zeros(3))
    try:
        return tuple(side_by_side(lambda each: _Drive.of(problem, values, *each), asked))
    except OmnidynError:
        return ()


def _channels(
    problem: Problem, values: FloatArray, volts: FloatArray, dt: FloatArray, start: FloatArray
) -> dict[str, FloatArray]:
    robot: Robot = problem.robot_at(values)
    driver, _ = driver_of(problem, values)
    share = np.linspace(0.0, 1.0, len(volts))
    at_the_motors = at_motors(np.ascontiguousarray(volts), share, driver)[0]
    run = simulate(robot, at_the_motors, dt, twist=start)
    assert run.twist is not None
    assert run.pose is not None
    speed = wheel_speed(robot.wheels, run.twist)
    return {
        "twist": run.twist, "wheel_speed": speed, "wheel_angle": speed,
        "current": settled_currents(robot, run.twist[:-1], at_the_motors), "position": run.pose[:, :YAW],
        "heading": run.pose[:, YAW:],
    }  # fmt: skip
