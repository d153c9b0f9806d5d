"""Robots of a batch that move in blocks, by the exact formula or by implicit steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.model.actuation import clip_voltage, reaching, voltage_of_duty
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.block_march import TOTALS, BlockRows, KeptSamples, march_twist
from omnidyn.simulation.batch.engine_kind import BOX, DUTY, EXACT, LIMITED
from omnidyn.simulation.batch.exact import exact_law
from omnidyn.simulation.batch.fast import fast_law, gauss_two, march_fast
from omnidyn.simulation.batch.implicit import implicit_law, march_implicit, stages, with_share
from omnidyn.simulation.batch.limited import alone, distinct_plants, limited_rows, march_limited
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters, in_blocks, out_of_blocks
from omnidyn.simulation.batch.pose import gauss_four, march_pose, pose_law
from omnidyn.simulation.batch.threads import Threads
from omnidyn.statement import Statement

FAST_POSE, EXACT_POSE = "fast", "exact"
SAME_TIME = 1e-9  # of a step: times that are nearer are one
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


def opens(robot: Robot, command: str) -> bool:
    """Whether such a command of 0 lets the motors of a robot coast."""
    return command == DUTY and robot.drive.coasts


def reaching_volts(robot: Robot, commands: BatchCommands) -> tuple[FloatArray, BoolArray]:
    """Volts at the motors, NaN of what coasts, shape as the rows; and which commands were beyond a limit."""
    asked, beyond = commands.rows, False
    if commands.kind == DUTY:
        duty = np.clip(commands.rows, -1.0, 1.0)
        battery = robot.drive.supply if commands.supply is None else commands.supply
        assert battery is not None
        asked, beyond = voltage_of_duty(duty, battery), duty != commands.rows
    limited = clip_voltage(robot.motor, asked)
    volts = reaching(robot, limited)
    if opens(robot, commands.kind):
        volts = np.where(asked == 0.0, np.nan, volts)
    return volts, (limited != asked) | beyond


def put_states(states: NDArray[Any], block: IntArray, lane: IntArray, twist: FloatArray, pose: FloatArray) -> None:
    """Put robots into states (blocks, 3 or 9, WIDTH), with poses where these have them."""
    states[block, :3, lane] = twist
    if states.shape[1] > 3:
        states[block, 3:6, lane] = pose
        states[block, 6, lane], states[block, 7, lane] = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        states[block, 8, lane] = 0.0


def shown(states: NDArray[Any], failed: BoolArray, rows: int, count: int) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Twist and pose, shape (n, 3) each, and whether a robot has failed, shape (n,)."""
    table, lost = out_of_blocks(states[:, :rows], count).astype(float), failed.reshape(-1)[:count]
    table[:, lost] = np.nan
    return table[:3].T, table[3:].T, lost.copy()


class Keeping:
    """What a run of blocks keeps on its way, and which robots are lost from which row on."""

    def __init__(
        self, states: NDArray[Any], failed: BoolArray, rows: int, steps: int, every: int, statistics: bool
    ) -> None:
        blocks, self._steps = len(states), steps
        history = np.zeros((1 + steps // every if every else 0, rows, blocks * WIDTH), states.dtype)
        if every:
            history[0] = states[:, :rows].swapaxes(0, 1).reshape(rows, -1)
        totals = np.zeros((blocks if statistics else 0, TOTALS * rows, WIDTH))
        self.fails = np.where(failed, 0, np.iinfo(np.int64).max)
        self.record = KeptSamples(every, history, totals)

    def without_bad(self, rows: FloatArray, first: int, last: int) -> FloatArray:
        """Rows of commands of some robots, (robots, steps, wheels), zeros in place of what is not finite.

        A robot fails in the row of its first command that is not finite.
        """
        finite = np.isfinite(rows)
        if finite.all():
            return rows
        bad: BoolArray = ~np.asarray(finite.all(axis=2), dtype=bool)
        lost = np.where(bad.any(axis=1), bad.argmax(axis=1), np.iinfo(np.int64).max)
        flat = self.fails.reshape(-1)[first:last]
        np.minimum(flat, lost, out=flat)
        return np.where(bad[:, :, None], 0.0, rows)

    def end(self, states: NDArray[Any], count: int) -> tuple[BoolArray, GroupRun]:
        """(which robots have failed, (blocks, WIDTH); what the run gives)."""
        failed = (self.fails < self._steps) | ~np.isfinite(states).all(axis=1)
        sums = None
        if len(self.record.totals):
            sums = out_of_blocks(self.record.totals, count).T
            sums[failed.reshape(-1)[:count]] = np.nan
        history = self.record.history[:, :, :count].transpose(2, 0, 1) if self.record.every else None
        return failed, GroupRun(history, sums)


class Delays:
    """The latencies of n robots, and the volts under way to their motors.

    latency = k dt + part. Over a row of dt the volts act that were asked for k + 1 rows before, up to the part, and
    from there those of k rows before. drivers: see BlockGroup. lengths (1 or 3, n) [s]: of a whole step; where any is
    late, of the rest of a row, and of its part too.
    """

    def __init__(self, drivers: Sequence[tuple[Robot, Any]], count: int, dt: float) -> None:
        self.drivers, self._count, part = drivers, count, np.zeros(count)
        self.late = any(robot.drive.latency > 0.0 for robot, _ in drivers)
        self._rows = []
        for robot, index in drivers:
            share = robot.drive.latency / dt
            whole = int(np.floor(share + SAME_TIME))
            part[index] = dt * (share - whole) if share - whole > SAME_TIME else 0.0
            self._rows.append(whole)
        whole_row = np.full(count, dt)
        self.lengths = [whole_row, whole_row - part, part] if self.late else [whole_row]
        self._kept = max(self._rows) + 1 if self.late else 0
        self._past: FloatArray | None = None  # (1 or n, rows, wheels), the latest last; None: nothing acts
        self._idle = np.zeros(count)  # what nothing is: 0 V, or NaN of motors that coast
        self._next: FloatArray | None = None

    @property
    def alike(self) -> bool:
        """Whether the same volts are under way to all."""
        return self._past is None or len(self._past) == 1

    def forget(self, robots: IntArray) -> None:
        """Nothing is under way to some robots."""
        if self._past is None or len(robots) == self._count:
            self._past = None
        else:
            self._past = np.broadcast_to(self._past, (self._count, *self._past.shape[1:])).copy()
            self._past[robots] = self._idle[robots, None, None]

    def begin(self, shared: bool, command: str, wheels: int) -> None:
        """Before a run of such commands, under the same volts for all, or not."""
        if not self.late:
            return
        for robot, index in self.drivers:
            self._idle[index] = np.nan if opens(robot, command) else 0.0
        if self._past is None:
            same = len(self.drivers) == 1
            self._past = np.tile(self._idle[: 1 if same else None, None, None], (1, self._kept, wheels))
        self._next = np.empty((1 if shared else self._count, self._kept, wheels))

    def acting(self, volts: FloatArray, span: slice, places: Sequence[Any]) -> FloatArray:
        """What acts, of volts asked for, (robots, rows, wheels) of a span, or (1, ..) for all; places: of the robots of
        each driver among them. One row more where any is late: its first acts as the first row begins."""
        if not self.late:
            return volts
        assert self._past is not None
        assert self._next is not None
        count, steps, wheels = volts.shape
        past = self._past if len(self._past) == 1 else self._past[span]
        commands = np.concatenate([np.broadcast_to(past, (count, *past.shape[1:])), volts], axis=1)
        self._next[span] = commands[:, commands.shape[1] - self._kept :]
        out = np.empty((count, steps + 1, wheels))
        for rows, here in zip(self._rows, places, strict=True):
            first = self._kept - rows - 1
            out[here] = commands[here, first : first + steps + 1]
        return out

    def go_on(self) -> None:
        """After a run: what is under way is what it left."""
        if self._next is not None:
            first = np.broadcast_to(self._next[:1], self._next.shape)
            same = len(self._next) > 1 and np.array_equal(self._next, first, equal_nan=True)
            self._past, self._next = (self._next[:1] if same else self._next), None


class BlockGroup:
    """Robots in blocks. parameters: of its n robots; drivers: (robot, indices) whose driver and limits some share;
    robots: themselves, where their motors have limits or coast."""

    def __init__(
        self,
        kind: str,
        parameters: BatchParameters,
        drivers: Sequence[tuple[Robot, Any]],
        turning: BoolArray,
        dt: float,
        pose: str | None,
        dtype: Any,
        robots: Sequence[Robot] = (),
    ) -> None:
        self.count = parameters.count
        self.engines = {EXACT_NAME if kind == EXACT else IMPLICIT_NAME: self.count}
        self._dtype, self._pose = np.dtype(dtype), pose
        self.dt, self._delays = dt, Delays(drivers, self.count, dt)
        self._march: Callable[..., None] = march_implicit
        rule: tuple[Any, ...] = (stages(kind in (BOX, LIMITED[BOX]), dt, self._dtype),)
        law = implicit_law(parameters, turning) if kind != EXACT else np.empty(0)
        self._plants: Any = None
        if kind in LIMITED.values():
            self._march, self._plants = march_limited, distinct_plants(robots)
            law = np.concatenate([law, limited_rows(robots, parameters.damping)])

        def law_of(length: FloatArray) -> FloatArray:
            """The laws under steps of these lengths [s], (n,)."""
            if kind != EXACT:
                return with_share(law, length, dt)
            if pose is None:
                return exact_law(parameters, length)
            return (fast_law if pose == FAST_POSE else pose_law)(parameters, length, dt)

        if kind == EXACT and pose is None:
            self._march, rule = march_twist, ()
        elif kind == EXACT and pose == FAST_POSE:
            self._march, rule = march_fast, (gauss_two(dt, self._dtype),)
        elif kind == EXACT:
            self._march, rule = march_pose, (gauss_four(dt, self._dtype),)
        self._laws = np.stack([in_blocks(law_of(length), self._dtype) for length in self._delays.lengths])
        self._rule, blocks = rule, self._laws.shape[1]
        pieces = 2 if self._delays.late else 1
        self._states = np.zeros((pieces, blocks, 3 if pose is None else 9, WIDTH), self._dtype)
        self._failed, self._fresh = np.zeros((blocks, WIDTH), bool), np.ones((blocks, WIDTH), np.uint8)

    @property
    def rows(self) -> int:
        """3: twist alone; 6: twist and pose."""
        return 3 if self._pose is None else 6

    def reset(self, robots: IntArray, twist: FloatArray, pose: FloatArray) -> None:
        """Put some robots to a twist and a pose, shape (robots, 3) each."""
        block, lane = np.divmod(robots, WIDTH)
        for states in self._states:
            put_states(states, block, lane, twist, pose)
        self._fresh[block, lane] = 1
        self._delays.forget(robots)
        self._failed[block, lane] = ~(np.isfinite(twist).all(axis=1) & np.isfinite(pose).all(axis=1))

    def state(self) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Twist and pose, shape (n, 3) each, and whether a robot has failed, shape (n,)."""
        return shown(self._states[-1], self._failed, self.rows, self.count)

    def run(self, commands: BatchCommands, every: int, statistics: bool, threads: Threads) -> GroupRun:
        """Hold rows of commands, one after the other."""
        steps, blocks = commands.steps, self._laws.shape[1]
        keeping, clipped = Keeping(self._states[-1], self._failed, self.rows, steps, every, statistics), []
        shared = self._shared_volts(commands, clipped)

        def march(span: tuple[int, int]) -> None:
            volts = self._own_volts(commands, span, keeping, clipped) if shared is None else shared
            moving = BlockRows(volts, self._states, keeping.fails, self._fresh)
            room = () if self._plants is None else (alone(*self._plants),)
            self._march(*span, self._laws, moving, keeping.record, *self._rule, *room)

        size = WIDTH * commands.rows[0].size
        threads.map(march, threads.spans(blocks, blocks if shared is not None else max(1, VOLTS_AT_ONCE // size)))
        self._delays.go_on()
        self._failed, run = keeping.end(self._states[-1], self.count)
        count = sum(number for number, _ in clipped)
        return run._replace(clipped=(count, min((row for number, row in clipped if number), default=0)))

    def _shared_volts(self, commands: BatchCommands, clipped: list[tuple[int, int]]) -> NDArray[Any] | None:
        """The volts that all robots share, shape (1, steps, wheels, 1); None where each has its own."""
        drivers = self._delays.drivers
        shared = len(commands.rows) == 1 and len(drivers) == 1 and self._delays.alike
        self._delays.begin(shared, commands.kind, commands.rows.shape[2])
        if not shared:
            return None
        volts, beyond = reaching_volts(drivers[0][0], commands)
        clipped.append(_count(beyond))
        acting = self._delays.acting(volts, slice(0, 1), [slice(None)])
        return np.ascontiguousarray(acting[..., None], self._dtype)

    def _own_volts(
        self, commands: BatchCommands, span: tuple[int, int], keeping: Keeping, clipped: list[tuple[int, int]]
    ) -> NDArray[Any]:
        """The volts of the robots of some blocks, shape (blocks, steps, wheels, WIDTH).

        A robot fails in the row of its first command that is not finite.
        """
        first, last = span[0] * WIDTH, min(span[1] * WIDTH, self.count)
        rows = np.broadcast_to(commands.rows, (self.count, *commands.rows.shape[1:]))[first:last]
        rows = keeping.without_bad(rows, first, last)
        volts, places = np.zeros(rows.shape, self._dtype), []
        for robot, index in self._delays.drivers:
            here = index if isinstance(index, slice) else index[(index >= first) & (index < last)] - first
            part, beyond = reaching_volts(robot, commands._replace(rows=rows[here]))
            volts[here] = part
            clipped.append(_count(beyond))
            places.append(here)
        acting = self._delays.acting(volts, slice(first, last), places)
        whole = np.zeros(((span[1] - span[0]) * WIDTH, *acting.shape[1:]), self._dtype)
        whole[: last - first] = acting
        blocks = whole.reshape(span[1] - span[0], WIDTH, *acting.shape[1:])
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
