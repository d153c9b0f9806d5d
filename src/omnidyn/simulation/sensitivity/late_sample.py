"""A run as a log shows it, each channel late in its own way, and how that changes along given directions.

A direction is a number of the robot file, what a driver does to the voltages, or where the run starts. All of them are
carried through one run of the implicit engine; see derivatives.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.layout import LENGTH, N_AXES
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.commands import Commands
from omnidyn.simulation.implicit.march import capped
from omnidyn.simulation.sensitivity.derivatives import run_with_derivatives
from omnidyn.simulation.sensitivity.directions import (
    current_derivatives,
    difference,
    directions_of,
    refuse_switched_off,
)
from omnidyn.simulation.sensitivity.sample import MEET, Samples, empty_samples
from omnidyn.simulation.simulate import as_tolerance, current_bounds


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
class LateSample:
    """What a channel with one latency shows at the rows of a log; NaN where that lies outside the run.

    twist (rows, 3), pace: its time derivative, heading (rows,), voltage (rows, n) in force, current (rows, n) of
    dynamic electrics, else None. d...: derivatives, (rows, K, 3), (rows, K), (rows, K, n).
    """

    robot: Robot
    directions: tuple[Direction, ...]
    twist: FloatArray
    pace: FloatArray
    heading: FloatArray
    voltage: FloatArray
    dtwist: FloatArray
    dheading: FloatArray
    dvoltage: FloatArray
    current: FloatArray | None
    current_pace: FloatArray | None
    dcurrent: FloatArray | None

    def wheel_speeds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(wheel speeds [rad/s], their time derivative, their derivatives). Shapes (rows, n), same, (rows, K, n)."""
        wheels = self.robot.wheels
        by = np.empty((len(self.twist), len(self.directions), wheels.count))
        for k, one in enumerate(self.directions):
            by[:, k] = wheel_speed(wheels, self.dtwist[:, k])
            if one.up is not None and one.down is not None and one.up.wheels != one.down.wheels:
                ends = (wheel_speed(end.wheels, self.twist) for end in (one.up, one.down))
                by[:, k] += difference(np.array([*ends]))[0]
        return wheel_speed(wheels, self.twist), wheel_speed(wheels, self.pace), by

    def currents(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(currents [A], their time derivative under held voltages, their derivatives), shapes as above."""
        if self.current is not None:
            assert self.current_pace is not None
            assert self.dcurrent is not None
            return self.current, self.current_pace, self.dcurrent
        by = np.empty((*self.dtwist.shape[:2], self.voltage.shape[1]))
        for k, one in enumerate(self.directions):
            by[:, k] = self._change(one.up, one.down, self.dtwist[:, k], self.dvoltage[:, k])
        pace = self._change(None, None, self.pace, np.zeros_like(self.voltage))
        return settled_currents(self.robot, self.twist, self.voltage), pace, by

    def _change(self, up: Robot | None, down: Robot | None, twist: FloatArray, voltage: FloatArray) -> FloatArray:
        """Derivatives of settled currents."""
        return current_derivatives((up or self.robot, down or self.robot), self.twist, self.voltage, twist, voltage)


def late_samples(
    robot: Robot, t: FloatArray, voltage: FloatArray, directions: Sequence[Direction], start: FloatArray,
    late: Sequence[float], tol: float | None,
) -> tuple[list[LateSample], int]:  # fmt: skip
    """Simulate under held voltages and sample the run at t - late, one LateSample for every latency.

    t [s]: (rows,); voltage [V]: (rows - 1, n), as it arrives at the motors; start: (3,) twist; tol as for `simulate`.
    Also returns the number of rows in which the friction solver hit its cap.
    Raises InputError for a direction that changes friction or a gear loss which is off.
    """
    numbers = plant(robot)
    plants = [numbers if r is None else plant(r) for one in directions for r in (one.up, one.down)]
    for k, one in enumerate(directions):
        refuse_switched_off(one.name, numbers, plants[2 * k])
    rates = np.zeros((len(directions), *voltage.shape))
    first = np.zeros((len(directions), N_AXES + numbers.wheels))
    length, stretch = numbers.body[LENGTH], difference(np.array([p.body[LENGTH] for p in plants]))
    for k, one in enumerate(directions):
        rates[k] = 0.0 if one.voltage is None else one.voltage
        first[k, :N_AXES] = 0.0 if one.start is None else one.start * [1.0, 1.0, length]
    first[:, 2] += start[2] * stretch
    given = Commands(np.ascontiguousarray(np.diff(t)), np.ascontiguousarray(voltage))
    size = N_AXES + (numbers.wheels if robot.motor.electrical == DYNAMIC else 0)
    seen = empty_samples(t, np.asarray(late, dtype=float), size, len(directions))
    outcome, _, _ = run_with_derivatives(
        numbers, directions_of(numbers, plants, rates), given, current_bounds(robot, given, len(given.dt)),
        (np.asarray(start, dtype=float), np.zeros(3)), first, as_tolerance(tol), seen,
    )  # fmt: skip
    found = []
    for c, own in enumerate(seen.late):
        at = np.clip(np.searchsorted(t, t - own + MEET, side="right") - 1, 0, len(voltage) - 1)
        twist, pace, dtwist = seen.state[c, :, :N_AXES], seen.pace[c, :, :N_AXES], seen.dstate[c, :, :, :N_AXES]
        twist[:, 2] /= length
        pace[:, 2] /= length
        dtwist[..., 2] = (dtwist[..., 2] - twist[:, 2, None] * stretch) / length
        found.append(
            LateSample(
                robot, tuple(directions), twist, pace, seen.heading[c], voltage[at], dtwist, seen.dheading[c],
                np.moveaxis(rates[:, at], 0, 1), *_currents(seen, c, size),
            )
        )  # fmt: skip
    return found, capped(outcome)


def _currents(seen: Samples, c: int, size: int) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Currents of windings with inductance: (value, time derivative, derivatives)."""
    if size == N_AXES:
        return None, None, None
    return seen.state[c, :, N_AXES:], seen.pace[c, :, N_AXES:], seen.dstate[c, :, :, N_AXES:]
