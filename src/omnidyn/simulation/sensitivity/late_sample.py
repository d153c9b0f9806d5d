"""A run as a log shows it, each channel late in its own way, and how that changes along given directions.

A direction is a number of the robot file, what a driver does to the voltages, or where the run starts. All of them are
carried through one run of the implicit engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.frames import body_to_world
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.step_bound import MONOTONE
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.commands import Commands, current_bounds, loop_gains, on_ticks
from omnidyn.simulation.coulomb.door import Moved, moved, run_looped
from omnidyn.simulation.coulomb.door import run as run_coulomb
from omnidyn.simulation.engine import (
    as_tolerance,
)
from omnidyn.simulation.implicit.implicit_march import capped
from omnidyn.simulation.sensitivity.derivative_march import run_loop_with_derivatives, run_with_derivatives
from omnidyn.simulation.sensitivity.directions import (
    EPS,
    current_derivatives,
    difference,
    directions_of,
    refuse_band,
    refuse_rate,
    refuse_switched_off,
    width,
)
from omnidyn.simulation.sensitivity.sample import Samples, empty_samples
from omnidyn.simulation.speed_loop import loop_of
from omnidyn.simulation.travel import PATH, SAME_TIME, TURN

PIECES, ROUGH_TOLERANCE = 16, 1e-3  # steps in a row, at most; [m/s] the tolerance where they were more
PATH_AND_TURN = [1, 2, 0]  # of the travel, in the order of a twist


@dataclass(frozen=True, eq=False)
class Direction:
    """A way to change a run; derivatives are by a number that is 0 for the run itself.

    up, down: robots at +EPS and -EPS, None where the robot stays. voltage, of the shape of the voltages [V], start (3,)
    and push (rows, 3): derivatives of them, of the twist at the start and of the wrench from outside, None where they
    stay. name: for messages. plants: of up and down, where they are made already.
    """

    name: str
    up: Robot | None = None
    down: Robot | None = None
    voltage: FloatArray | None = None
    start: FloatArray | None = None
    push: FloatArray | None = None
    plants: tuple[Plant, Plant] | None = None


def direction_of(name: str, up: Robot, down: Robot) -> Direction:
    """The way from one robot to another, for any number of runs."""
    return Direction(name, up, down, plants=(plant(up), plant(down)))


class VoltageProgram(NamedTuple):
    """Under what a run goes. t [s]: (rows,); voltage [V]: (rows - 1, n), as it arrives at the motors, or (rows, n): see
    `held`; start: (3,) twist; push: a wrench from outside over each of these rows (., 3) [N, N, N m], or None."""

    t: FloatArray
    voltage: FloatArray
    start: FloatArray
    push: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class LateSample:
    """What a channel with one latency, `late` [s], shows at the rows of a log; NaN where that lies outside the run.

    twist (rows, 3), pace: its time derivative, travel (rows, W) since the start, voltage (rows, n) in force, current
    (rows, n) of dynamic electrics, else None. d...: derivatives, (rows, K, 3), (rows, K, W), (rows, K, n).
    """

    robot: Robot
    directions: tuple[Direction, ...]
    late: float
    twist: FloatArray
    pace: FloatArray
    travel: FloatArray
    voltage: FloatArray
    dtwist: FloatArray
    dtravel: FloatArray
    dvoltage: FloatArray
    current: FloatArray | None
    current_pace: FloatArray | None
    dcurrent: FloatArray | None

    def heading(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(heading since the start [rad], its time derivative, derivatives). Shapes (rows, 1), same, (rows, K, 1)."""
        return self.travel[:, :TURN], self.twist[:, 2:], self.dtravel[..., :TURN]

    def wheel_speeds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(wheel speeds [rad/s], their time derivative, their derivatives). Shapes (rows, n), same, (rows, K, n)."""
        value, by = self._at_wheels(self.twist, self.dtwist)
        return value, wheel_speed(self.robot.wheels, self.pace), by

    def wheel_angles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(angles that the wheels have turned by [rad], ...), as above: of the path what speeds are of the twist."""
        value, by = self._at_wheels(self.travel[:, PATH_AND_TURN], self.dtravel[..., PATH_AND_TURN])
        return value, wheel_speed(self.robot.wheels, self.twist), by

    def _at_wheels(self, motion: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What the wheels make of a motion of the body (rows, 3), and of its derivatives (rows, K, 3)."""
        wheels = self.robot.wheels
        wheel_derivatives = wheel_speed(wheels, by)
        for k, direction in enumerate(self.directions):
            if direction.up is not None and direction.down is not None and direction.up.wheels != direction.down.wheels:
                ends = (wheel_speed(end.wheels, motion) for end in (direction.up, direction.down))
                wheel_derivatives[:, k] += difference(np.array([*ends]))[0]
        return wheel_speed(wheels, motion), wheel_derivatives

    def position(self, facing: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(place since the start [m], its time derivative, its derivatives) of a robot that faced `facing` [rad] there.

        Shapes (rows, 2), same, (rows, K, 2).
        """
        turn = body_to_world(facing)[:2, :2].T
        pace = np.einsum("kij,kj->ki", body_to_world(facing + self.travel[:, 0])[:, :2, :2], self.twist[:, :2])
        return self.travel[:, PATH:] @ turn, pace, self.dtravel[..., PATH:] @ turn

    def currents(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(currents [A], their time derivative under held voltages, their derivatives), shapes as above."""
        if self.current is not None:
            assert self.current_pace is not None
            assert self.dcurrent is not None
            return self.current, self.current_pace, self.dcurrent
        by = np.empty((*self.dtwist.shape[:2], self.voltage.shape[1]))
        for k, direction in enumerate(self.directions):
            by[:, k] = self._change(direction.up, direction.down, self.dtwist[:, k], self.dvoltage[:, k])
        pace = self._change(None, None, self.pace, np.zeros_like(self.voltage))
        return settled_currents(self.robot, self.twist, self.voltage), pace, by

    def _change(self, up: Robot | None, down: Robot | None, twist: FloatArray, voltage: FloatArray) -> FloatArray:
        """Derivatives of settled currents."""
        return current_derivatives((up or self.robot, down or self.robot), self.twist, self.voltage, twist, voltage)


def late_samples(
    robot: Robot,
    program: VoltageProgram,
    directions: Sequence[Direction],
    late: Sequence[float],
    tol: float | None,
    travel: int = TURN,
) -> tuple[list[LateSample], int]:
    """Simulate under held voltages and sample the run at t - late, one LateSample for every latency.

    tol as for `simulate`, but ROUGH_TOLERANCE instead of None where friction falls so fast that a row took more than
    PIECES steps; travel: what is wanted of it, see sample.py. Also returns the number of rows in which the
    friction solver hit its cap. Raises InputError for a direction that changes friction or a gear loss which is off.
    """
    (numbers, plants), (t, voltage, start, _) = _plants(robot, directions), program
    order = sorted(range(len(directions)), key=lambda k: directions[k].up is None)  # first those that change the robot
    changed = [plants[2 * k + side] for k in order if directions[k].up is not None for side in range(2)]
    moved_robot = moved(numbers, changed, EPS)
    if moved_robot is not None:
        return _coulomb_samples(robot, moved_robot, program, directions, order, late, tol, travel), 0
    rates = np.zeros((len(directions), *voltage.shape))
    first, length = np.zeros((len(directions), width(numbers))), numbers.body.length
    stretch = _stretch(plants)
    for k, direction in enumerate(directions):
        rates[k] = 0.0 if direction.voltage is None else direction.voltage
        first[k, :N_AXES] = 0.0 if direction.start is None else direction.start * [1.0, 1.0, length]
    first[:, 2] += start[2] * stretch
    held_commands = Commands(held(t, len(voltage), late), np.ascontiguousarray(voltage))
    samples = _room(robot, t, late, len(directions), travel)
    outcome, _, _ = run_with_derivatives(
        numbers,
        directions_of(numbers, plants, rates, _pushes(program.push, directions, [*plants, numbers])),
        held_commands,
        current_bounds(robot, held_commands, len(held_commands.dt)),
        (np.asarray(start, dtype=float), np.zeros(3)),
        first,
        _within(tol, numbers, held_commands.dt),
        samples,
    )
    return _looks(robot, directions, samples, (length, stretch), (samples.t, voltage, rates)), capped(outcome)


def _coulomb_samples(
    robot: Robot,
    moved_robot: Moved,
    program: VoltageProgram,
    directions: Sequence[Direction],
    order: list[int],
    late: Sequence[float],
    tol: float | None,
    travel: int,
) -> list[LateSample]:
    """`late_samples` of a robot under Coulomb friction; order: of the directions, first those that change the robot."""
    t, voltage, start, push = program
    rates = [{"voltage": d.voltage, "push": d.push, "twist": d.start} for d in (directions[k] for k in order)]
    dt = held(t, len(voltage), late)
    seen = run_coulomb(
        moved_robot,
        t,
        dt,
        voltage,
        start,
        dt[:1].copy(),
        ROUGH_TOLERANCE if tol is None else as_tolerance(tol),
        np.asarray(late, dtype=float),
        np.zeros(travel),
        push,
        rates,
        order,
    )
    looks = []
    for c, delay in enumerate(seen.late):
        at = np.clip(np.searchsorted(seen.t, seen.t - delay + SAME_TIME, side="right") - 1, 0, len(voltage) - 1)
        dvoltage = np.zeros((len(t), len(directions), voltage.shape[1]))
        for k, direction in enumerate(directions):
            if direction.voltage is not None:
                dvoltage[:, k] = direction.voltage[at]
        motion = (seen.twist[c], seen.pace[c], seen.travel[c], voltage[at], seen.dtwist[c], seen.dtravel[c], dvoltage)
        looks.append(LateSample(robot, tuple(directions), float(delay), *motion, None, None, None))
    return looks


def _coulomb_looped(
    robot: Robot,
    moved_robot: Moved,
    t: FloatArray,
    set_point: FloatArray,
    directions: Sequence[Direction],
    late: Sequence[float],
    tol: float,
    travel: int,
) -> list[LateSample]:
    """`looped_samples` of a robot under Coulomb friction."""
    held_commands = Commands(held(t, len(set_point), late), None, set_point=np.ascontiguousarray(set_point))
    dt, command, tick, _ = on_ticks(robot, held_commands)
    n, ends = robot.wheels.count, [end or robot for d in directions for end in (d.up, d.down)]
    dgains = difference(np.array([loop_gains(end) for end in ends]).reshape(-1, 4, n))
    run_of_loop = run_looped(
        moved_robot,
        np.array(loop_gains(robot)),
        dgains,
        loop_of(robot, command, tick),
        np.zeros(n),
        t,
        dt,
        np.zeros(3),
        dt[:1].copy(),
        tol,
        np.asarray(late, dtype=float),
        np.zeros(travel),
    )
    seen, looks = run_of_loop.seen, []
    volts, dvolts = passed_on(run_of_loop.ask, run_of_loop.dask, robot.drive.dead_band)
    begins, voltage, rates = _in_force(volts, dvolts, np.concatenate([[0.0], np.cumsum(dt)]))
    for c, delay in enumerate(seen.late):
        rests = seen.t - delay < -SAME_TIME
        for array in (seen.twist, seen.pace, seen.travel, seen.dtwist, seen.dtravel):
            array[c, rests] = 0.0
        at = np.clip(np.searchsorted(begins, seen.t - delay + SAME_TIME, side="right") - 1, 0, len(voltage) - 1)
        motion = (seen.twist[c], seen.pace[c], seen.travel[c], voltage[at], seen.dtwist[c], seen.dtravel[c])
        looks.append(
            LateSample(
                robot, tuple(directions), float(delay), *motion, np.moveaxis(rates[:, at], 0, 1), None, None, None
            )
        )
    return looks


def passed_on(ask: FloatArray, dask: FloatArray, dead: float) -> tuple[FloatArray, FloatArray]:
    """What a driver with a dead band [V] passes on of the voltages of a loop (J, n), and its derivatives (K, J, n)."""
    if dead == 0.0:
        return ask, dask
    size = np.abs(ask) - dead
    return np.sign(ask) * np.maximum(size, 0.0), dask * (size > 0.0)


def _within(tol: float | None, numbers: Plant, dt: FloatArray) -> float:
    steep = float(np.median(dt)) * numbers.body.steep_sum > PIECES * MONOTONE
    return ROUGH_TOLERANCE if tol is None and steep else as_tolerance(tol)


def looped_samples(
    robot: Robot,
    t: FloatArray,
    set_point: FloatArray,
    directions: Sequence[Direction],
    late: Sequence[float],
    tol: float | None,
    travel: int = TURN,
    settled: float = 0.0,
) -> list[LateSample]:
    """The same through the speed loop of the robot, under set points [rad/s], (rows - 1, n) or (rows, n), from rest.

    Before the run it has rested. Directions change the robot only. settled: see `run_loop_with_derivatives`.
    """
    refuse_rate([direction.name for direction in directions])
    numbers, plants = _plants(robot, directions)
    moved_robot = None if tol is None else moved(numbers, plants, EPS)
    if moved_robot is not None:
        return _coulomb_looped(robot, moved_robot, t, set_point, directions, late, as_tolerance(tol), travel)
    robots = [moved_robot or robot for direction in directions for moved_robot in (direction.up, direction.down)]
    held_commands = Commands(held(t, len(set_point), late), None, set_point=np.ascontiguousarray(set_point))
    samples, count = _room(robot, t, late, len(directions), travel), len(directions)
    loop_run = run_loop_with_derivatives(
        robot,
        robots,
        numbers,
        directions_of(numbers, plants, np.zeros((count, *set_point.shape))),
        held_commands,
        (np.zeros(3), np.zeros(3)),
        np.zeros((count, width(numbers))),
        as_tolerance(tol),
        settled,
        samples,
    )
    for c, delay in enumerate(samples.late):
        rests = samples.t - delay < -SAME_TIME
        for part in (samples.state, samples.pace, samples.travel, samples.dstate, samples.dtravel):
            part[c, rests] = 0.0
    return _looks(
        robot,
        directions,
        samples,
        (numbers.body.length, _stretch(plants)),
        _in_force(loop_run.voltage, loop_run.dvoltage, loop_run.edges),
    )


def held(t: FloatArray, commands: int, late: Sequence[float]) -> FloatArray:
    """For how long each of the commands holds [s]. The last row may have one too, or none; t (rows,) [s].

    It then holds on for as long as any channel looks ahead. Otherwise these channels would show nothing in their last
    rows, and the likelihood would jump by those where a latency passes 0: no descent would get it across.
    """
    lengths = np.ascontiguousarray(np.diff(t))
    return lengths if commands < len(t) else np.append(lengths, max(-min(late, default=0.0), lengths[-1]))


def _in_force(volts: FloatArray, dvolts: FloatArray, edges: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """[s] when each voltage of a loop comes into force, the voltages, derivatives: 0 before, unknown at the end."""
    begins = np.concatenate([[-np.inf], edges])
    voltage = np.zeros((len(begins), volts.shape[1]))
    voltage[1:-1], voltage[-1] = volts, np.nan
    by = np.zeros((len(dvolts), *voltage.shape))
    by[:, 1:-1] = dvolts
    return begins, voltage, by


def _plants(robot: Robot, directions: Sequence[Direction]) -> tuple[Plant, list[Plant]]:
    """(the plant of the robot, those up and down each direction)."""
    refuse_band(robot)
    numbers = plant(robot)
    plants = [
        end
        for direction in directions
        for end in direction.plants
        or (numbers if robot is None else plant(robot) for robot in (direction.up, direction.down))
    ]
    for k, direction in enumerate(directions):
        refuse_switched_off(direction.name, numbers, plants[2 * k])
    return numbers, plants


def _pushes(push: FloatArray | None, directions: Sequence[Direction], plants: Sequence[Plant]) -> FloatArray | None:
    """The wrench from outside as each plant counts it, with yaw over its length: those up and down each direction, and
    the robot's own. Shape (2 K + 1, rows, 3)."""
    if push is None:
        return None
    pushes = np.tile(push, (len(plants), 1, 1))
    for k, direction in enumerate(directions):
        if direction.push is not None:
            pushes[2 * k] += EPS * direction.push
            pushes[2 * k + 1] -= EPS * direction.push
    pushes[..., 2] /= np.array([numbers.body.length for numbers in plants])[:, None]
    return pushes


def _stretch(plants: Sequence[Plant]) -> FloatArray:
    """Derivative of the length that omega is scaled by. Shape (K,)."""
    return difference(np.array([p.body.length for p in plants]))


def _room(robot: Robot, t: FloatArray, late: Sequence[float], keys: int, travel: int) -> Samples:
    size = N_AXES + (robot.wheels.count if robot.motor.electrical == DYNAMIC else 0)
    return empty_samples(t, np.asarray(late, dtype=float), size, keys, travel)


def _looks(
    robot: Robot,
    directions: Sequence[Direction],
    samples: Samples,
    lengths: tuple[float, FloatArray],
    applied: tuple[FloatArray, FloatArray, FloatArray],
) -> list[LateSample]:
    """A LateSample for every latency. lengths: what omega is scaled by, and its derivatives.

    applied: [s] when each voltage comes into force, and more; voltages (J, n); their derivatives (K, J, n).
    """
    (length, stretch), (begins, voltage, rates) = lengths, applied
    looks = []
    for c, delay in enumerate(samples.late):
        at = np.clip(np.searchsorted(begins, samples.t - delay + SAME_TIME, side="right") - 1, 0, len(voltage) - 1)
        twist, pace, dtwist = (
            samples.state[c, :, :N_AXES],
            samples.pace[c, :, :N_AXES],
            samples.dstate[c, :, :, :N_AXES],
        )
        twist[:, 2] /= length
        pace[:, 2] /= length
        dtwist[..., 2] = (dtwist[..., 2] - twist[:, 2, None] * stretch) / length
        looks.append(
            LateSample(
                robot,
                tuple(directions),
                float(delay),
                twist,
                pace,
                samples.travel[c],
                voltage[at],
                dtwist,
                samples.dtravel[c],
                np.moveaxis(rates[:, at], 0, 1),
                *_currents(samples, c),
            )
        )
    return looks


def _currents(samples: Samples, c: int) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Currents of windings with inductance: (value, time derivative, derivatives)."""
    if samples.state.shape[2] == N_AXES:
        return None, None, None
    return samples.state[c, :, N_AXES:], samples.pace[c, :, N_AXES:], samples.dstate[c, :, :, N_AXES:]
