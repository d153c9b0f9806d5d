"""Robots of a batch that move in blocks, by the exact formula or by implicit steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.model.actuation import clip_voltage, reaching, voltage_of_duty
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.choice import BOX, DUTY, EXACT
from omnidyn.simulation.batch.exact import exact_law
from omnidyn.simulation.batch.fast import gauss_two, march_fast
from omnidyn.simulation.batch.implicit import implicit_law, march_implicit, stages
from omnidyn.simulation.batch.march import TOTALS, Record, Rows, march_twist
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters, in_blocks, out_of_blocks
from omnidyn.simulation.batch.pose import gauss_four, march_pose
from omnidyn.simulation.batch.threads import Threads
from omnidyn.statement import Statement

FAST_POSE, EXACT_POSE = "fast", "exact"
VOLTS_AT_ONCE = 4_000_000  # brought into order at a time, where each robot has its own: what stays in the cache
EXACT_NAME = "exact engine, in blocks"
IMPLICIT_NAME = "implicit engine, fixed step, in blocks"


class BatchCommands(NamedTuple):
    """Rows of commands: kind, "voltage", "duty" or "wheel_speed_command"; rows (1 or n, steps, wheels)."""

    kind: str
    rows: FloatArray
    supply: float | None = None  # [V] behind a duty

    @property
    def steps(self) -> int:
        """Number of rows."""
        return self.rows.shape[1]

    def of(self, robots: Any) -> BatchCommands:
        """Those of some of the robots."""
        return self if len(self.rows) == 1 else self._replace(rows=self.rows[robots])


class GroupRun(NamedTuple):
    """What some robots did: samples (n, samples, 3 or 6), the start included, and totals (n, TOTALS x (3 or 6)); None
    where not asked for. clipped: commands beyond a limit, and the row of the first one. warnings: of the engine."""

    samples: NDArray[Any] | None
    totals: FloatArray | None
    clipped: tuple[int, int] = (0, 0)
    warnings: tuple[Statement, ...] = ()


def reaching_volts(robot: Robot, commands: BatchCommands) -> tuple[FloatArray, BoolArray]:
    """Volts at the motors, shape as the rows; and which commands were beyond a limit."""
    asked, beyond = commands.rows, False
    if commands.kind == DUTY:
        duty = np.clip(commands.rows, -1.0, 1.0)
        battery = robot.drive.supply if commands.supply is None else commands.supply
        assert battery is not None
        asked, beyond = voltage_of_duty(duty, battery), duty != commands.rows
    limited = clip_voltage(robot.motor, asked)
    return reaching(robot, limited), (limited != asked) | beyond


class BlockGroup:
    """Robots in blocks. parameters: of its n robots; drivers: (robot, indices) whose driver and limits some share."""

    def __init__(
        self,
        kind: str,
        parameters: BatchParameters,
        drivers: Sequence[tuple[Robot, Any]],
        turning: BoolArray,
        dt: float,
        pose: str | None,
        dtype: Any,
    ) -> None:
        self.count = parameters.count
        self.engines = {EXACT_NAME if kind == EXACT else IMPLICIT_NAME: self.count}
        self._drivers, self._dtype, self._pose = drivers, np.dtype(dtype), pose
        self._march: Callable[..., None] = march_implicit
        if kind == EXACT:
            law, rule = exact_law(parameters, dt), ()
            if pose is None:
                self._march = march_twist
            elif pose == FAST_POSE:
                self._march, rule = march_fast, (gauss_two(parameters, dt, self._dtype),)
            else:
                self._march, rule = march_pose, (gauss_four(parameters, dt, self._dtype),)
        else:
            law, rule = implicit_law(parameters, turning), (stages(kind == BOX, dt, self._dtype),)
        self._laws, self._rule = in_blocks(law, self._dtype), rule
        self._states = np.zeros((len(self._laws), 3 if pose is None else 9, WIDTH), self._dtype)
        self._failed = np.zeros((len(self._laws), WIDTH), bool)

    @property
    def rows(self) -> int:
        """3: twist alone; 6: twist and pose."""
        return 3 if self._pose is None else 6

    def reset(self, robots: IntArray, twist: FloatArray, pose: FloatArray) -> None:
        """Put some robots to a twist and a pose, shape (robots, 3) each."""
        block, lane = np.divmod(robots, WIDTH)
        self._states[block, :3, lane] = twist
        if self._pose is not None:
            self._states[block, 3:6, lane] = pose
            self._states[block, 6, lane], self._states[block, 7, lane] = np.cos(pose[:, 2]), np.sin(pose[:, 2])
            self._states[block, 8, lane] = 0.0
        self._failed[block, lane] = ~(np.isfinite(twist).all(axis=1) & np.isfinite(pose).all(axis=1))

    def state(self) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Twist and pose, shape (n, 3) each, and whether a robot has failed, shape (n,)."""
        rows = out_of_blocks(self._states[:, : self.rows], self.count).astype(float)
        failed = self._failed.reshape(-1)[: self.count]
        rows[:, failed] = np.nan
        return rows[:3].T, rows[3:].T, failed.copy()

    def run(self, commands: BatchCommands, every: int, statistics: bool, threads: Threads) -> GroupRun:
        """Hold rows of commands, one after the other."""
        steps, blocks = commands.steps, len(self._laws)
        samples = 1 + steps // every if every else 0
        history = np.zeros((samples, self.rows, blocks * WIDTH), self._dtype)
        if every:
            history[0] = self._states[:, : self.rows].swapaxes(0, 1).reshape(self.rows, -1)
        totals = np.zeros((blocks if statistics else 0, TOTALS * self.rows, WIDTH))
        fails = np.where(self._failed, 0, np.iinfo(np.int64).max)
        record, clipped = Record(every, history, totals), []
        shared = self._shared_volts(commands, clipped)

        def march(span: tuple[int, int]) -> None:
            volts = self._own_volts(commands, span, fails, clipped) if shared is None else shared
            self._march(*span, self._laws, Rows(volts, self._states, fails), record, *self._rule)

        size = WIDTH * commands.rows[0].size
        threads.map(march, threads.spans(blocks, blocks if shared is not None else max(1, VOLTS_AT_ONCE // size)))
        self._failed = (fails < steps) | ~np.isfinite(self._states).all(axis=1)
        lost = self._failed.reshape(-1)[: self.count]
        sums = None
        if statistics:
            sums = out_of_blocks(totals, self.count).T
            sums[lost] = np.nan
        count = sum(number for number, _ in clipped)
        return GroupRun(
            history[:, :, : self.count].transpose(2, 0, 1) if every else None,
            sums,
            (count, min((row for number, row in clipped if number), default=0)),
        )

    def _shared_volts(self, commands: BatchCommands, clipped: list[tuple[int, int]]) -> NDArray[Any] | None:
        """The volts that all robots share, shape (1, steps, wheels, 1); None where each has its own."""
        if len(commands.rows) > 1 or len(self._drivers) > 1:
            return None
        volts, beyond = reaching_volts(self._drivers[0][0], commands)
        clipped.append(_count(beyond))
        return np.ascontiguousarray(volts[..., None], self._dtype)

    def _own_volts(
        self, commands: BatchCommands, span: tuple[int, int], fails: IntArray, clipped: list[tuple[int, int]]
    ) -> NDArray[Any]:
        """The volts of the robots of some blocks, shape (blocks, steps, wheels, WIDTH).

        A robot fails in the row of its first command that is not finite.
        """
        first, last = span[0] * WIDTH, min(span[1] * WIDTH, self.count)
        rows = np.broadcast_to(commands.rows, (self.count, *commands.rows.shape[1:]))[first:last]
        finite = np.isfinite(rows)
        if not finite.all():
            bad: BoolArray = ~np.asarray(finite.all(axis=2), dtype=bool)
            lost = np.where(bad.any(axis=1), bad.argmax(axis=1), np.iinfo(np.int64).max)
            flat = fails.reshape(-1)[first:last]
            np.minimum(flat, lost, out=flat)
            rows = np.where(bad[:, :, None], 0.0, rows)
        volts = np.zeros(((span[1] - span[0]) * WIDTH, *rows.shape[1:]), self._dtype)
        for robot, index in self._drivers:
            here = index if isinstance(index, slice) else index[(index >= first) & (index < last)] - first
            part, beyond = reaching_volts(robot, commands._replace(rows=rows[here]))
            volts[: last - first][here] = part
            clipped.append(_count(beyond))
        blocks = volts.reshape(span[1] - span[0], WIDTH, *rows.shape[1:])
        return np.ascontiguousarray(blocks.transpose(0, 2, 3, 1))


def _count(beyond: BoolArray) -> tuple[int, int]:
    """(rows with a command beyond a limit, the first of them)."""
    if not beyond.any():
        return 0, 0
    rows = beyond.any(axis=2)
    return int(rows.sum()), int(rows.any(axis=0).argmax())


def drivers_of(robots: Sequence[Robot]) -> list[tuple[Robot, Any]]:
    """(a robot, indices of all that have its driver and its limits)."""
    drivers = {id(robot): (robot.drive, robot.motor.voltage_limit) for robot in robots}
    places: dict[Any, list[int]] = {}
    if len(set(drivers.values())) > 1:
        for k, robot in enumerate(robots):
            places.setdefault(drivers[id(robot)], []).append(k)
    if not places:
        return [(robots[0], slice(None))]
    return [(robots[index[0]], np.array(index)) for index in places.values()]
