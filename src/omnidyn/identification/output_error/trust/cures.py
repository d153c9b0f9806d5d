"""Blind: a direction that the logs do not show, and what would show it, found by experiments with the model.

The robot is moved a little along the direction and driven again: by the voltages of the log, to see which channels that
were not logged would show it, and by voltages along all axes, to see whether another drive would.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.compiled.parallel import side_by_side
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.engines.engine import driver_of
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import FitProblem, Problem
from omnidyn.model.actuation import DEAD_BAND, at_motors, without_map
from omnidyn.model.dynamics import drive_wrench, settled_currents
from omnidyn.model.frames import AXES
from omnidyn.model.keys import BREAKAWAY, CENTRE, COULOMB, EMF, ROTOR, TORQUE, VISCOUS, WHEEL, Key, find_key
from omnidyn.model.layout import YAW
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.simulate import simulate
from omnidyn.statement import NOTE, Statement

EXACT = 30.0  # times its numbers that a direction may go: the same to the log, and not only nearly
TRIAL_CHANGE, SEEN_SHARE = (
    1e-3,
    0.01,
)  # size of the change that is tried; share of it in a channel from which that shows it
ROWS, STEP, HOLD = 1000, 0.01, 50  # of an experiment: rows, their length [s], rows of one level
MOST_CURES = 5  # cures that are named
MEASURABLE_KEYS = (
    "body.mass_kg",
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
    "motor.gear_ratio",
    "motor.resistance_ohm",
    TORQUE,
    EMF,
    ROTOR,
    WHEEL,
    CENTRE,
    "body.inertia_kg_m2",
    "gain",
)
CHANNELS = {  # that would show it -> outputs that show the same
    "current": ("current",),
    "wheel_speed": ("wheel_speed", "wheel_angle"),
    "twist": ("twist", "position"),
}


@dataclass(frozen=True)
class Blind:
    """A direction that the logs do not show. changes: number -> relative change, the largest 1 % of itself or of what
    it counts as. exact: whether the outputs stay the same, or nearly. cures: what would show it, easiest first: the key
    of a number to be measured, a channel to be logged, an axis along which to drive, or "drive"."""

    changes: Mapping[str, float]
    exact: bool
    cures: tuple[str, ...]

    def statement(self) -> Statement:
        """What the logs do not show, and what would."""
        numbers = {"keys": tuple(self.changes), "changes": tuple(self.changes.values())}
        return Statement("not_shown", NOTE, numbers=numbers | {"exact": self.exact, "cures": self.cures})

    def how_to_show(self) -> Statement:
        """What would show it."""
        return Statement("cures", NOTE, numbers={"cures": self.cures})


def blind_directions(
    problem: Problem, values: FloatArray, ways: Sequence[Way], moving_axes: BoolArray
) -> tuple[Blind, ...]:
    """Each direction with what would show it. values (P,); moving_axes (3,): which axes did."""
    drives = _drives(problem, values) if ways else ()
    return tuple(side_by_side(lambda way: _direction(problem, values, way, moving_axes, drives), ways))


def _direction(
    problem: Problem, values: FloatArray, way: Way, moving_axes: BoolArray, drives: Sequence[_Drive]
) -> Blind:
    indices = np.flatnonzero(way.step)
    names = [problem.names[j].partition("@")[0] for j in indices]
    changes = {name: 0.01 * _relative(problem, values, way, int(j)) for name, j in zip(names, indices, strict=True)}
    cures = tuple(dict.fromkeys(_cures(problem, values, way, names, moving_axes, drives)))[:MOST_CURES]
    return Blind(changes, way.reach > EXACT, cures)


def _relative(problem: Problem, values: FloatArray, way: Way, j: int) -> float:
    """The change of a number along the direction, over the number, or over what it counts as where it is near 0."""
    p, value = problem.parameters[j], float(values[j])
    return float(way.step[j]) if p.log else float(way.step[j]) / max(abs(value), 0.1 * float(way.size[j]))


def _cures(
    problem: Problem, values: FloatArray, way: Way, names: list[str], moving_axes: BoolArray, drives: Sequence[_Drive]
) -> Iterator[str]:
    yield from (measurable for measurable in MEASURABLE_KEYS if any(_is(name, measurable) for name in names))
    if not drives:
        return
    of_the_log, of_all_axes = drives
    try:
        yield from _by_channels(problem, of_the_log.differs(problem, values, way))
        seen_channels = of_all_axes.differs(problem, values, way)
        if any(
            seen_channels[name] for name in dict.fromkeys(name for name, _ in problem.columns) if name in seen_channels
        ):
            axes = {key.axis for name in names if (key := find_key(name)) is not None and key.axis is not None}
            yield from [AXES[axis] for axis in sorted(axes) if not moving_axes[axis]] or ["drive"]
    except OmnidynError:
        return


def _is(name: str, pattern: str) -> bool:
    key = find_key(name)
    return (Key.parse(name).name if key is not None else name) == pattern


def _by_channels(problem: Problem, seen_channels: Mapping[str, bool]) -> Iterator[str]:
    """Channels that were not logged, and would show it under the same voltages."""
    logged = {name for name, _ in problem.columns}
    for channel, replaced_channels in CHANNELS.items():
        if not logged & set(replaced_channels) and seen_channels[channel]:
            yield channel


@dataclass(frozen=True, eq=False)
class _Drive:
    """Voltages (n, W) over dt (n,) from a twist (3,), and what each channel shows of the fitted robot under them."""

    volts: FloatArray
    dt: FloatArray
    start: FloatArray
    channels_before: Mapping[str, FloatArray]

    @classmethod
    def of(cls, problem: Problem, values: FloatArray, volts: FloatArray, dt: FloatArray, start: FloatArray) -> _Drive:
        return cls(volts, dt, start, _channels(problem, values, volts, dt, start))

    def differs(self, problem: Problem, values: FloatArray, way: Way) -> dict[str, bool]:
        """Channel -> whether a change along the direction shows in it."""
        other_values = values.copy()
        for j in np.flatnonzero(way.step):
            p = problem.parameters[j]
            other_values[j] = p.outer(p.inner(float(values[j])) + TRIAL_CHANGE * float(way.step[j]))
        channels_after, differs_by_channel = _channels(problem, other_values, self.volts, self.dt, self.start), {}
        for name, channel_values in self.channels_before.items():
            size = np.sqrt((channel_values**2).mean(axis=0))
            change = np.sqrt(((channels_after[name] - channel_values) ** 2).mean(axis=0))
            differs_by_channel[name] = bool(
                (change > SEEN_SHARE * TRIAL_CHANGE * np.maximum(size, 1e-3 * size.max(initial=1e-9))).any()
            )
        return differs_by_channel


def _drives(problem: Problem, values: FloatArray) -> tuple[_Drive, ...]:
    """That of the log, and one along all axes; none where there are no voltages, or no engine simulates them."""
    if any(piece.record.set_point is not None for piece in problem.pieces):
        return ()
    piece = max(problem.pieces, key=lambda drive_input: drive_input.last - drive_input.first)
    rows = slice(piece.first, min(piece.last, piece.first + ROWS))
    t = piece.record.t[piece.first : rows.stop + 1]
    robot = problem.robot_at(values)
    shape = np.linalg.pinv(robot.wheels.wrench_matrix)
    shape /= np.abs(shape).max(axis=0)
    levels = np.random.default_rng(0).uniform(-1.0, 1.0, (ROWS // HOLD, 3)) @ shape.T
    limit = robot.motor.voltage_limit or max(float(np.nanmax(np.abs(p.record.voltage))) for p in problem.pieces)
    volts = np.repeat(np.clip(levels, -1.0, 1.0) * float(np.min(limit)), HOLD, axis=0)
    drive_inputs = (
        (piece.record.voltage[rows], np.diff(t), piece.start),
        (volts, np.full(len(volts), STEP), np.zeros(3)),
    )
    try:
        return tuple(side_by_side(lambda drive_input: _Drive.of(problem, values, *drive_input), drive_inputs))
    except OmnidynError:
        return ()


def _channels(
    problem: Problem, values: FloatArray, volts: FloatArray, dt: FloatArray, start: FloatArray
) -> dict[str, FloatArray]:
    robot: Robot = without_map(problem.robot_at(values))
    driver, _ = driver_of(problem, values)
    share = np.linspace(0.0, 1.0, len(volts))
    at_the_motors = at_motors(np.ascontiguousarray(volts), share, driver)[0]
    run = simulate(robot, at_the_motors, dt, twist=start)
    assert run.twist is not None
    assert run.pose is not None
    speed = wheel_speed(robot.wheels, run.twist)
    return {
        "twist": run.twist,
        "wheel_speed": speed,
        "wheel_angle": speed,
        "current": settled_currents(robot, run.twist[:-1], at_the_motors),
        "position": run.pose[:, :YAW],
        "heading": run.pose[:, YAW:],
    }


# What the logs do not tell: directions of the free numbers along which their outputs stay, by the SVD of the scaled
# Fisher matrix
#
# D I D = V diag(1/s^2) V',   I: what the rows tell, without priors;   D: what a change of 1 is for each number
#
# A direction is blind where s, how far it may go within a standard error, is LOST_DISTANCE or more. D is the number
# itself, so that 0.5 is half of it; of a friction it is at least a tenth of what the motors can push: one near 0 is not
# lost because it may as well be twice as large. Where several directions are blind, any mixture of them is: they are
# told apart so that each holds as few numbers as possible (row echelon form, the largest pivot first).

LOST_DISTANCE = 0.5  # how far a blind direction may go within a standard error, over the size of its numbers
EIGEN_TOLERANCE = 1e-13  # of the largest eigenvalue: below it there is only rounding
SMALL = 0.1  # of what the motors push with, that a friction counts as, at least
LATENCY_SIZE = 0.05  # [s] that a latency counts as
SHARE, VISIBLE_ERRORS = (
    0.05,
    3.0,
)  # of the largest; standard errors: less of both, and a number has no part in a direction


@dataclass(frozen=True)
class Way:
    """A blind direction. reach: how far it goes within a standard error. step (P,): in the numbers that the solver
    sees, 0 for what has no part in it; size (P,): what a change of 1 is there."""

    reach: float
    step: FloatArray
    size: FloatArray


def blind_ways(problem: FitProblem, values: FloatArray, information: FloatArray) -> tuple[Way, ...]:
    """The blind directions of a fit. values (P,); information (P, P): of the rows alone, states eliminated."""
    # What shows where sizes are the numbers themselves shows no less where they are larger; to find these takes time.
    if values.all() and not _lost(information, _own_sizes(problem, values))[1].any():
        return ()
    size, blind_list = sizes(problem, values), []
    scaled, lost, vectors = _lost(information, size)
    for way in _sparse(vectors[:, lost].T):
        way_information = float(way @ scaled @ way)
        named_numbers = (np.abs(way) > SHARE) | (way**2 * np.diag(scaled) > VISIBLE_ERRORS**2)
        reach = way_information**-0.5 if way_information > 0.0 else np.inf
        blind_list.append(Way(reach, np.where(named_numbers, way, 0.0) * size, size))
    return tuple(blind_list)


def _lost(information: FloatArray, size: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """(scaled information (P, P), which of its eigenvectors are blind (P,), these in columns)."""
    scaled = information * np.outer(size, size)
    eigen, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return scaled, eigen < max(LOST_DISTANCE**-2.0, EIGEN_TOLERANCE * float(eigen.max(initial=0.0))), vectors


def sizes(problem: FitProblem, values: FloatArray) -> FloatArray:
    """What a change of 1 is for each number, in the numbers that the solver sees. Shape (P,)."""
    # Of several groups there are as many robots: the one that their fit began from says how large things are.
    robot = problem.robot if isinstance(problem, Problem) else None
    if robot is None:
        return _own_sizes(problem, values)
    push, top = _pushes(problem, robot), top_speeds(robot)
    return np.array([_size(p, v, push, top) for p, v in zip(problem.parameters, values.tolist(), strict=True)])


def _own_sizes(problem: FitProblem, values: FloatArray) -> FloatArray:
    """The same by the numbers alone, whatever the motors can push. Shape (P,)."""
    push, top = np.zeros(3), np.ones(3)
    return np.array([_size(p, v, push, top) for p, v in zip(problem.parameters, values.tolist(), strict=True)])


def _size(p: Parameter, value: float, push: FloatArray, top: FloatArray) -> float:
    """push (3,) [N, N, N m], top (3,) [m/s, m/s, rad/s]."""
    if p.log:
        return 1.0
    key = find_key(p.name.partition("@")[0])
    if key is not None:
        axis = key.axis or 0
        limits_by_level = {COULOMB: push[axis], BREAKAWAY: push[axis], VISCOUS: push[axis] / top[axis]}.get(
            key.level or "", 0.0
        )
        return max(abs(value), SMALL * float(limits_by_level)) or 1.0
    if p.part == LATENCY:
        return LATENCY_SIZE
    if p.part == DEAD_BAND:
        return max(abs(value), 0.1)
    return max(SMALL * float(push.max()), 1e-9) if p.part in (TILT, PUSH) else 1.0


def _pushes(problem: FitProblem, robot: Robot) -> FloatArray:
    """The greatest wrench that the voltages of the logs give at rest [N, N, N m]. Shape (3,)."""
    push = np.zeros(3)
    for record in {id(piece.record): piece.record for piece in problem.pieces}.values():
        limit = np.eye(robot.wheels.count) * robot.motor.voltage_limit
        volts = record.voltage if record.set_point is None else limit
        push = np.fmax(push, np.nanmax(np.abs(drive_wrench(robot, np.zeros(3), volts)), axis=0, initial=0.0))
    return push


def _sparse(basis: FloatArray) -> list[FloatArray]:
    """Directions that span the same, each with as few numbers as may be, its largest entry 1. Shape (K, P)."""
    rows, pivot_rows = basis.copy(), []
    for k in range(len(rows)):
        open_entries = np.abs(rows[k:]).copy()
        open_entries[:, pivot_rows] = 0.0
        pivot_row, pivot = np.unravel_index(int(open_entries.argmax()), open_entries.shape)
        rows[[k, k + pivot_row]] = rows[[k + pivot_row, k]]
        rows[k] /= rows[k, pivot]
        other_rows = np.arange(len(rows)) != k
        rows[other_rows] -= np.outer(rows[other_rows, pivot], rows[k])
        pivot_rows.append(int(pivot))
    return [row / row[int(np.abs(row).argmax())] for row in rows]
