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
from omnidyn.identification.output_error.engines.driver import driver_of
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.blind_directions import Way
from omnidyn.model.actuation import at_motors, without_map
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.frames import AXES
from omnidyn.model.keys import CENTRE, EMF, ROTOR, TORQUE, WHEEL, Key, find_key
from omnidyn.model.layout import YAW
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.sensors import OF_WHEELS
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
    "wheel_speed": OF_WHEELS,
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
    return tuple(side_by_side(lambda direction: _direction(problem, values, direction, moving_axes, drives), ways))


def _direction(
    problem: Problem, values: FloatArray, direction: Way, moving_axes: BoolArray, drives: Sequence[_Drive]
) -> Blind:
    indices = np.flatnonzero(direction.step)
    names = [problem.names[j].partition("@")[0] for j in indices]
    changes = {
        name: 0.01 * _relative(problem, values, direction, int(j)) for name, j in zip(names, indices, strict=True)
    }
    cures = tuple(dict.fromkeys(_cures(problem, values, direction, names, moving_axes, drives)))[:MOST_CURES]
    return Blind(changes, direction.reach > EXACT, cures)


def _relative(problem: Problem, values: FloatArray, direction: Way, j: int) -> float:
    """The change of a number along the direction, over the number, or over what it counts as where it is near 0."""
    p, value = problem.parameters[j], float(values[j])
    return (
        float(direction.step[j])
        if p.log
        else float(direction.step[j]) / max(abs(value), 0.1 * float(direction.size[j]))
    )


def _cures(
    problem: Problem,
    values: FloatArray,
    direction: Way,
    names: list[str],
    moving_axes: BoolArray,
    drives: Sequence[_Drive],
) -> Iterator[str]:
    yield from (measurable for measurable in MEASURABLE_KEYS if any(_is(name, measurable) for name in names))
    if not drives:
        return
    of_the_log, of_all_axes = drives
    try:
        yield from _by_channels(problem, of_the_log.differs(problem, values, direction))
        seen_channels = of_all_axes.differs(problem, values, direction)
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

    def differs(self, problem: Problem, values: FloatArray, direction: Way) -> dict[str, bool]:
        """Channel -> whether a change along the direction shows in it."""
        other_values = values.copy()
        for j in np.flatnonzero(direction.step):
            p = problem.parameters[j]
            other_values[j] = p.outer(p.inner(float(values[j])) + TRIAL_CHANGE * float(direction.step[j]))
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
        **dict.fromkeys(OF_WHEELS, speed),
        "current": settled_currents(robot, run.twist[:-1], at_the_motors),
        "position": run.pose[:, :YAW],
        "heading": run.pose[:, YAW:],
    }
