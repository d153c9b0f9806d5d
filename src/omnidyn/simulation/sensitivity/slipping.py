"""A run of wheels that slip as a log shows it, each channel late in its own way, and how that changes.

Derivatives are central differences of whole runs in fixed steps: steps that solve an inclusion are continuous in every
number, and smooth but where a wheel grips or stops a step sooner. The run itself may be as exact as is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import side_by_side
from omnidyn.model.frames import body_to_world
from omnidyn.model.motor import DYNAMIC, settled_current
from omnidyn.model.robot import Robot
from omnidyn.simulation.commands import Commands, current_bounds
from omnidyn.simulation.sensitivity.directions import EPS, difference
from omnidyn.simulation.sensitivity.late_sample import Direction, VoltageProgram, held
from omnidyn.simulation.slip.plant import slip_plant
from omnidyn.simulation.slip.slip_march import rolling, run_slipping
from omnidyn.simulation.speed_loop import no_loop

A_MOMENT = 1e-4  # [s]
Values = tuple[FloatArray, FloatArray, FloatArray]  # (rows, m), time derivative (rows, m), derivatives (rows, K, m)


class SampledRun(NamedTuple):
    """What one run shows at some rows: twist (rows, 3), pose (rows, 3) from the start, turning [rad/s], turned [rad]
    and current [A] of the wheels (rows, n)."""

    twist: FloatArray
    pose: FloatArray
    turning: FloatArray
    turned: FloatArray
    current: FloatArray


@dataclass(frozen=True, eq=False)
class SlipSample:
    """The counterpart of late_sample.py: what channels with one latency show at the rows of a log.

    seen: the run itself; soon: how it goes on, A_MOMENT before and after; by: the runs up and down each direction, in
    turn.
    """

    seen: SampledRun
    soon: tuple[SampledRun, SampledRun]
    by: Sequence[SampledRun]

    @property
    def twist(self) -> FloatArray:
        """Shape (rows, 3)."""
        return self.seen.twist

    @property
    def pace(self) -> FloatArray:
        """Time derivative of the twist, (rows, 3)."""
        return self._pace("twist")

    @property
    def dtwist(self) -> FloatArray:
        """Shape (rows, K, 3)."""
        return self._changes(lambda look: look.twist)

    def heading(self) -> Values:
        """Heading since the start [rad]."""
        return self.seen.pose[:, 2:], self.seen.twist[:, 2:], self._changes(lambda look: look.pose[:, 2:])

    def wheel_speeds(self) -> Values:
        """Speeds of the wheels themselves [rad/s]."""
        turning = self.seen.turning
        return turning, self._pace("turning"), self._changes(lambda look: look.turning)

    def wheel_angles(self) -> Values:
        """What the wheels have turned by [rad]."""
        return self.seen.turned, self.seen.turning, self._changes(lambda look: look.turned)

    def position(self, facing: float) -> Values:
        """Place since the start [m] of a robot that faced `facing` [rad] there."""
        turn = body_to_world(facing)[:2, :2].T
        pace = np.einsum("kij,kj->ki", body_to_world(facing + self.seen.pose[:, 2])[:, :2, :2], self.seen.twist[:, :2])
        return self.seen.pose[:, :2] @ turn, pace, self._changes(lambda look: look.pose[:, :2] @ turn)

    def currents(self) -> Values:
        """Currents of the motors [A]."""
        current = self.seen.current
        return current, self._pace("current"), self._changes(lambda look: look.current)

    def _pace(self, name: str) -> FloatArray:
        before, after = (getattr(look, name) for look in self.soon)
        return (after - before) / (2.0 * A_MOMENT)

    def _changes(self, values: Callable[[SampledRun], FloatArray]) -> FloatArray:
        """Derivatives (rows, K, m) of `values` (rows, m) along each direction; K may be 0."""
        shape = values(self.seen).shape
        if not self.by:
            return np.zeros((shape[0], 0, shape[1]))
        return np.moveaxis(difference(np.array([values(look) for look in self.by])), 0, 1)


def slipping_samples(
    robot: Robot,
    program: VoltageProgram,
    directions: Sequence[Direction],
    late: Sequence[float],
    steps: int,
    tol: float,
) -> list[SlipSample]:
    """Simulate under held voltages, and sample at t - late: one SlipSample for every latency.

    steps: of a row, for derivatives, and for all where tol is 0; else tol [m/s] is of the run. Others as of
    `late_samples`. Raises UnsupportedError for a robot that the engine does not know.
    """
    t, voltage, start, _ = program
    ends = [(robot, voltage, start)]
    for direction in directions:
        for end, side in ((direction.up, EPS), (direction.down, -EPS)):
            shifted_voltage = voltage if direction.voltage is None else voltage + side * direction.voltage
            ends.append(
                (end or robot, shifted_voltage, start if direction.start is None else start + side * direction.start)
            )
    around = [delay + side for delay in late for side in (0.0, A_MOMENT, -A_MOMENT)]
    first = partial(_looks, t=t, late=around, steps=1 if tol else steps, tol=tol)
    fixed_steps = partial(_looks, t=t, late=late, steps=steps, tol=0.0)
    looks, *shifted_looks = side_by_side(lambda k: (fixed_steps if k else first)(*ends[k]), range(len(ends)))
    return [
        SlipSample(looks[3 * c], (looks[3 * c + 1], looks[3 * c + 2]), [run_looks[c] for run_looks in shifted_looks])
        for c in range(len(late))
    ]


def _looks(
    robot: Robot,
    voltage: FloatArray,
    start: FloatArray,
    t: FloatArray,
    late: Sequence[float],
    steps: int,
    tol: float,
) -> list[SampledRun]:
    """One run, seen with each latency."""
    plant, n = slip_plant(robot), robot.wheels.count
    ends = np.append(t[0], t[0] + np.cumsum(held(t, len(voltage), late)))
    sample_times = [t - delay for delay in late]
    all_times = np.unique(
        np.concatenate([ends, *(moments[(moments > ends[0]) & (moments < ends[-1])] for moments in sample_times)])
    )
    parts = np.arange(steps) / steps
    grid = np.append((all_times[:-1, None] + np.diff(all_times)[:, None] * parts).ravel(), all_times[-1])
    at = np.clip(np.searchsorted(ends, grid[:-1], side="right") - 1, 0, len(voltage) - 1)
    held_commands = Commands(np.diff(grid), np.ascontiguousarray(voltage[at]))
    assert held_commands.voltage is not None
    out = run_slipping(
        plant,
        held_commands.voltage,
        current_bounds(robot, held_commands, len(held_commands.dt)),
        held_commands.dt,
        rolling(plant, start),
        np.zeros(3),
        no_loop(n),
        tol,
    )
    turning = out.rims / robot.wheels.radii
    with np.errstate(invalid="ignore"):  # a robot far from any that fits may run away: its residuals say so
        middle = 0.5 * (turning[1:] + turning[:-1]) * held_commands.dt[:, None]
        turned = np.concatenate([np.zeros((1, n)), np.cumsum(middle, axis=0)])
    held_on = np.concatenate([held_commands.voltage, held_commands.voltage[-1:]])
    looks = []
    for moments in sample_times:
        rows = np.clip(np.searchsorted(grid, moments), 0, len(grid) - 1)
        outside = (moments < grid[0]) | (moments > grid[-1])
        rim_speed, current = turning[rows], out.current[rows]
        if robot.motor.electrical != DYNAMIC:
            current = settled_current(robot.motor, held_on[rows], rim_speed)
        parts_of = (out.twist[rows], out.pose[rows], rim_speed, turned[rows], current)
        looks.append(SampledRun(*(np.where(outside[:, None], np.nan, part) for part in parts_of)))
    return looks
