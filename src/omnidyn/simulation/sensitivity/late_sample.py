"""A run as a log shows it, each channel late in its own way, and how that changes along given directions.

A direction is a number of the robot file, what a driver does to the voltages, or where the run starts. All of them are
carried through one run of the implicit engine; see directions.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.model.dynamics import settled_currents
from omnidyn.model.layout import AXES, LENGTH
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.commands import Commands
from omnidyn.simulation.implicit.march import capped
from omnidyn.simulation.sensitivity.directions import difference, refuse_switched_off, run_tangent, ways_of
from omnidyn.simulation.sensitivity.sample import MEET, Looks, looks
from omnidyn.simulation.sensitivity.stage import EPS
from omnidyn.simulation.simulate import as_tolerance, current_bounds

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Direction:
    """A way to change a run; derivatives are by a number that is 0 for the run itself.

    up, down: robots at +EPS and -EPS, None where the robot stays. voltage (rows - 1, n), start (3,): derivatives of the
    voltages [V] and of the twist at the start, None where they stay. name: for messages.
    """

    name: str
    up: Robot | None = None
    down: Robot | None = None
    voltage: FloatArray | None = None
    start: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Sight:
    """What a channel with one latency shows at the rows of a log; NaN where that lies outside the run.

    twist (rows, 3), pace: its time derivative, heading (rows,), voltage (rows, n) in force, current (rows, n) of
    dynamic electrics, else None. ..._by: derivatives, (rows, K, 3), (rows, K), (rows, K, n).
    """

    robot: Robot
    directions: tuple[Direction, ...]
    twist: FloatArray
    pace: FloatArray
    heading: FloatArray
    voltage: FloatArray
    twist_by: FloatArray
    heading_by: FloatArray
    voltage_by: FloatArray
    current: FloatArray | None
    current_pace: FloatArray | None
    current_by: FloatArray | None

    def wheel_speeds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(wheel speeds [rad/s], their time derivative, their derivatives). Shapes (rows, n), same, (rows, K, n)."""
        wheels = self.robot.wheels
        by = np.empty((len(self.twist), len(self.directions), wheels.count))
        for k, way in enumerate(self.directions):
            by[:, k] = wheel_speed(wheels, self.twist_by[:, k])
            if way.up is not None and way.down is not None and way.up.wheels != way.down.wheels:
                ends = (wheel_speed(end.wheels, self.twist) for end in (way.up, way.down))
                by[:, k] += difference(np.array([*ends]))[0]
        return wheel_speed(wheels, self.twist), wheel_speed(wheels, self.pace), by

    def currents(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(currents [A], their time derivative under held voltages, their derivatives), shapes as above."""
        if self.current is not None:
            assert self.current_pace is not None
            assert self.current_by is not None
            return self.current, self.current_pace, self.current_by
        by = np.empty((*self.twist_by.shape[:2], self.voltage.shape[1]))
        for k, way in enumerate(self.directions):
            by[:, k] = self._change(way.up, way.down, self.twist_by[:, k], self.voltage_by[:, k])
        pace = self._change(None, None, self.pace, np.zeros_like(self.voltage))
        return settled_currents(self.robot, self.twist, self.voltage), pace, by

    def _change(self, up: Robot | None, down: Robot | None, twist: FloatArray, voltage: FloatArray) -> FloatArray:
        """Derivative of settled currents by central difference."""
        ends = [
            settled_currents(robot or self.robot, self.twist + eps * twist, self.voltage + eps * voltage)
            for robot, eps in ((up, EPS), (down, -EPS))
        ]
        return difference(np.array(ends))[0]


def sights(
    robot: Robot, t: FloatArray, voltage: FloatArray, directions: Sequence[Direction], start: FloatArray,
    late: Sequence[float], tol: float | None,
) -> tuple[list[Sight], int]:  # fmt: skip
    """Simulate under held voltages and look at the run at t - late, one Sight for every latency.

    t [s]: (rows,); voltage [V]: (rows - 1, n), as it arrives at the motors; start: (3,) twist; tol as for `simulate`.
    Also returns the number of rows in which the friction solver hit its cap.
    Raises InputError for a direction that changes friction or a gear loss which is off.
    """
    numbers = plant(robot)
    plants = [numbers if r is None else plant(r) for way in directions for r in (way.up, way.down)]
    for k, way in enumerate(directions):
        refuse_switched_off(way.name, numbers, plants[2 * k])
    rates = np.zeros((len(directions), *voltage.shape))
    first = np.zeros((len(directions), AXES + numbers.wheels))
    length, stretch = numbers.body[LENGTH], difference(np.array([p.body[LENGTH] for p in plants]))
    for k, way in enumerate(directions):
        rates[k] = 0.0 if way.voltage is None else way.voltage
        first[k, :AXES] = 0.0 if way.start is None else way.start * [1.0, 1.0, length]
    first[:, 2] += start[2] * stretch
    given = Commands(np.ascontiguousarray(np.diff(t)), np.ascontiguousarray(voltage))
    size = AXES + (numbers.wheels if robot.motor.electrical == DYNAMIC else 0)
    seen = looks(t, np.asarray(late, dtype=float), size, len(directions))
    outcome, _, _ = run_tangent(
        numbers, ways_of(numbers, plants, rates), given, current_bounds(robot, given, len(given.dt)),
        (np.asarray(start, dtype=float), np.zeros(3)), first, as_tolerance(tol), seen,
    )  # fmt: skip
    found = []
    for c, own in enumerate(seen.late):
        at = np.clip(np.searchsorted(t, t - own + MEET, side="right") - 1, 0, len(voltage) - 1)
        twist, pace, by = seen.state[c, :, :AXES], seen.pace[c, :, :AXES], seen.by[c, :, :, :AXES]
        twist[:, 2] /= length
        pace[:, 2] /= length
        by[..., 2] = (by[..., 2] - twist[:, 2, None] * stretch) / length
        found.append(
            Sight(
                robot, tuple(directions), twist, pace, seen.heading[c], voltage[at], by, seen.heading_by[c],
                np.moveaxis(rates[:, at], 0, 1), *_currents(seen, c, size),
            )
        )  # fmt: skip
    return found, capped(outcome)


def _currents(seen: Looks, c: int, size: int) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Currents of windings with inductance: (value, time derivative, derivatives)."""
    if size == AXES:
        return None, None, None
    return seen.state[c, :, AXES:], seen.pace[c, :, AXES:], seen.by[c, :, :, AXES:]
