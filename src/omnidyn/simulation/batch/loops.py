"""Robots behind a speed loop of their firmware, in blocks: rows are cut at the ticks of the loop, as in `simulate`.

    e = set speed - speed,  u = clip(kp e + sum, +-limit),  sum += ki e period unless that pushes further into the limit

Robots that were reset at other times tick at other times: where one is cut and another is not, the other takes a step
of no length, which leaves it as it is. A command that is late acts from the first tick at or after that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.compiled.kernel import inlined, kernel
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.block_march import POSE, SPEED, TOTALS, first_failure, keep, load, spoil, store
from omnidyn.simulation.batch.blocks import (
    IMPLICIT_NAME,
    VOLTS_AT_ONCE,
    BatchCommands,
    GroupRun,
    Keeping,
    put_states,
    shown,
)
from omnidyn.simulation.batch.engine_kind import BOX
from omnidyn.simulation.batch.implicit import implicit_law, put_push, stages, step_all, with_share
from omnidyn.simulation.batch.parameters import WIDTH, batch_parameters, in_blocks
from omnidyn.simulation.batch.pose import ONE, SHARE
from omnidyn.simulation.batch.threads import Threads
from omnidyn.simulation.commands import SAME_TIME, Commands, loop_gains, on_ticks

KP, STEP_GAIN, LIMIT, DEAD, G = range(5)  # numbers of a wheel in a block of gains; 3 of G
GAINS = G + 3
SUM, VOLTS = 0, 1  # numbers of a wheel in the state of a loop


class Pieces(NamedTuple):
    """Steps of rows that ticks cut. steps: (1 or blocks, pieces, 2, WIDTH), the length of each as a share of dt, and
    whether the loop ticks as it begins; set_point [rad/s]: (1 or blocks, pieces, wheels, 1 or WIDTH); ends (rows,):
    the last piece of each row. mixed: whether robots tick at different times."""

    steps: NDArray[Any]
    set_point: NDArray[Any]
    ends: IntArray
    mixed: bool


class LoopRows(NamedTuple):
    """What moves. states: as of Rows, (blocks, 3 or 9, WIDTH); loops: (blocks, 2 wheels, WIDTH); fails: as of Rows."""

    states: NDArray[Any]
    loops: NDArray[Any]
    fails: IntArray


@inlined
def _tick(work, gains, loop, volts, set_point, ticks, k, zero):
    """Close the loop of all wheels of what ticks; volts (wheels, WIDTH) at the motors. `close_loop` of one robot."""
    vx, vy, w, one = work[SPEED], work[SPEED + 1], work[SPEED + 2], k[ONE]
    for wheel in range(len(volts)):
        first, kept, out, command = GAINS * wheel, 2 * wheel, volts[wheel], set_point[wheel]
        kp, gain, limit, dead = gains[first + KP], gains[first + STEP_GAIN], gains[first + LIMIT], gains[first + DEAD]
        g0, g1, g2 = gains[first + G], gains[first + G + 1], gains[first + G + 2]
        total, asked, own = loop[kept + SUM], loop[kept + VOLTS], len(command) > 1
        for n in range(WIDTH):
            error = (command[n] if own else command[0]) - (g0[n] * vx[n] + g1[n] * vy[n] + g2[n] * w[n])
            moved = total[n] + gain[n] * error
            wanted = kp[n] * error + moved
            takes = (abs(wanted) <= limit[n]) | (wanted * error < zero)
            moved = moved if takes else total[n]
            wanted = kp[n] * error + moved
            wanted = limit[n] if wanted > limit[n] else (-limit[n] if wanted < -limit[n] else wanted)
            now = ticks[n] == one
            total[n] = moved if now else total[n]
            asked[n] = wanted if now else asked[n]
            size = abs(asked[n]) - dead[n]
            size = size if size > zero else zero
            out[n] = size if asked[n] > zero else -size


@kernel
def march_loops(first, last, laws, gains, pieces, rows, record, rule):
    """Move blocks first..last through all pieces; with poses where the states have them."""
    states, loops, fails = rows
    kept, wheels = states.shape[1], loops.shape[1] // 2
    zero, k, after, count = laws.dtype.type(0), rule.numbers, SHARE + laws.shape[1], min(kept, 6)
    work, sums = np.zeros((after, WIDTH), laws.dtype), np.zeros((TOTALS * 6, WIDTH), laws.dtype)
    volts, loop = np.zeros((wheels, WIDTH), laws.dtype), np.zeros((2 * wheels, WIDTH), laws.dtype)
    gain, before = np.zeros((GAINS * wheels, WIDTH), laws.dtype), np.zeros((kept, WIDTH), laws.dtype)
    mixed = pieces.mixed
    for b in range(first, last):
        load(work, SHARE, laws[b], states[b])
        for i in range(2 * wheels):
            for n in range(WIDTH):
                loop[i, n] = loops[b, i, n]
        for i in range(GAINS * wheels):
            for n in range(WIDTH):
                gain[i, n] = gains[b, i, n]
        failure, row = first_failure(fails[b]), 0
        for piece in range(pieces.steps.shape[1]):
            share, ticks = pieces.steps[b - first if len(pieces.steps) > 1 else 0, piece]
            for n in range(WIDTH):
                work[SHARE, n] = share[n]
            point = pieces.set_point[b - first if len(pieces.set_point) > 1 else 0, piece]
            _tick(work, gain, loop, volts, point, ticks, k, zero)
            put_push(work, wheels, volts, False)
            if mixed:
                store(before, work)
            step_all(work, rule.box, count > 3, k, zero)
            if mixed:
                _hold(work, before, share, zero)
            if piece == pieces.ends[row]:
                if row >= failure:
                    spoil(work, count, fails[b], row)
                keep(work, row, len(pieces.ends), b, record, sums, count)
                row += 1
        store(states[b], work)
        for i in range(2 * wheels):
            for n in range(WIDTH):
                loops[b, i, n] = loop[i, n]


@inlined
def _hold(work, before, share, zero):
    """Leave as it was what took a step of no length."""
    for i in range(len(before)):
        row, old = work[i if i < 3 else POSE + i - 3], before[i]
        for n in range(WIDTH):
            row[n] = row[n] if share[n] > zero else old[n]


class LoopGroup:
    """Robots behind speed loops, as BlockGroup has those under voltages."""

    def __init__(self, kind: str, robots: Sequence[Robot], dt: float, pose: str | None, dtype: Any) -> None:
        self.count, self.engines = len(robots), {IMPLICIT_NAME: len(robots)}
        self.dt, self._dtype, self.rows = dt, np.dtype(dtype), 3 if pose is None else 6
        parameters, turning = batch_parameters(robots), np.array([robot.body.rotating_frame for robot in robots])
        law = with_share(implicit_law(parameters, turning), np.full(self.count, dt), dt)
        self._laws, self._rule = in_blocks(law, self._dtype), stages(kind == BOX, dt, self._dtype)
        self._gains = in_blocks(np.stack([_gains(robot) for robot in robots], axis=1), self._dtype)
        blocks, wheels = len(self._laws), parameters.wheels
        self._states = np.zeros((blocks, 3 if pose is None else 9, WIDTH), self._dtype)
        self._loops = np.zeros((blocks, 2 * wheels, WIDTH), self._dtype)
        self._failed = np.zeros((blocks, WIDTH), bool)
        clocks = [(robot.drive.rate, robot.drive.latency) for robot in robots]
        self._clocks = {clock: k for k, clock in enumerate(dict.fromkeys(clocks))}
        self._examples = {clock: robots[clocks.index(clock)] for clock in self._clocks}
        self._clock = np.array([self._clocks[clock] for clock in clocks])
        self._done = np.zeros(self.count, np.int64)  # rows since the first tick
        self._kept = 1 + max(int(np.ceil(latency / dt)) for _, latency in clocks)
        self._past = np.zeros((1, self._kept, wheels))

    def reset(self, robots: IntArray, twist: FloatArray, pose: FloatArray) -> None:
        """Put some robots to a twist and a pose, shape (robots, 3) each; their loops begin anew."""
        block, lane = np.divmod(robots, WIDTH)
        put_states(self._states, block, lane, twist, pose)
        self._loops[block, :, lane] = 0.0
        self._failed[block, lane] = ~(np.isfinite(twist).all(axis=1) & np.isfinite(pose).all(axis=1))
        self._done[robots] = 0
        if len(robots) == self.count:
            self._past = np.zeros((1, *self._past.shape[1:]))
        elif len(robots):
            self._past = np.broadcast_to(self._past, (self.count, *self._past.shape[1:])).copy()
            self._past[robots] = 0.0

    def state(self) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Twist and pose, shape (n, 3) each, and whether a robot has failed, shape (n,)."""
        return shown(self._states, self._failed, self.rows, self.count)

    def run(self, commands: BatchCommands, every: int, statistics: bool, threads: Threads) -> GroupRun:
        """Hold rows of commands, one after the other."""
        steps = commands.steps
        keeping = Keeping(self._states, self._failed, self.rows, steps, every, statistics)
        rows, past = commands.rows, self._past
        if len(rows) != len(past):
            rows = np.broadcast_to(rows, (self.count, *rows.shape[1:]))
            past = np.broadcast_to(past, (self.count, *past.shape[1:]))
        all_commands: FloatArray = np.concatenate([past, keeping.without_bad(rows, 0, self.count)], axis=1)
        grid, place = self._grid(steps)

        def march(span: tuple[int, int]) -> None:
            pieces = self._pieces(grid, place, all_commands, span)
            moving = LoopRows(self._states, self._loops, keeping.fails)
            march_loops(*span, self._laws, self._gains, pieces, moving, keeping.record, self._rule)

        blocks = len(self._laws)
        alone = len(all_commands) == 1 and len(grid.command) == 1
        size = WIDTH * grid.share.shape[1] * all_commands.shape[2]
        threads.map(march, threads.spans(blocks, blocks if alone else max(1, VOLTS_AT_ONCE // size)))
        past, self._done = all_commands[:, all_commands.shape[1] - self._kept :], self._done + steps
        self._past = (past[:1] if (past == past[:1]).all() else past).copy()
        self._failed, run = keeping.end(self._states, self.count)
        return run

    def _grid(self, steps: int) -> tuple[TickGrid, IntArray]:
        """The pieces of rows for all clocks and times of reset, and which of them each robot has."""
        both = np.stack([self._clock, self._done], axis=1)
        kinds, place = np.unique(both, axis=0, return_inverse=True)
        clocks = list(self._clocks)
        cuts = [self._cut(self._examples[clocks[clock]], int(done), steps) for clock, done in kinds.tolist()]
        most = np.max([np.diff(begins) for *_, begins in cuts], axis=0)
        first = np.concatenate([[0], np.cumsum(most)])
        share = np.zeros((len(cuts), first[-1]))
        ticks, index = np.zeros_like(share), np.zeros(share.shape, np.int64)
        for k, (lengths, tick, row, begins) in enumerate(cuts):
            here = np.arange(begins[-1]) + np.repeat(first[:-1] - begins[:-1], np.diff(begins))
            share[k, here], ticks[k, here], index[k, here] = lengths, tick, row
        return TickGrid(share, ticks, index, first[1:] - 1), place.reshape(-1)

    def _cut(self, robot: Robot, done: int, steps: int) -> tuple[FloatArray, BoolArray, IntArray, IntArray]:
        """(shares, ticks, which of the commands acts, counted in `all_commands`) of pieces, where rows begin."""
        dt = self.dt
        held = Commands(np.full(steps, dt), None, set_point=np.zeros((steps, 1)))
        lengths, _, tick, begins = on_ticks(robot, held, done * dt)
        start = np.concatenate([[0.0], np.cumsum(lengths)])[:-1]
        row = np.floor((start - robot.drive.latency) / dt + SAME_TIME).astype(np.int64)
        return np.round(lengths / dt, 12), tick, np.maximum(row + self._kept, 0), begins

    def _pieces(self, grid: TickGrid, place: IntArray, all_commands: FloatArray, span: tuple[int, int]) -> Pieces:
        """What the kernel takes, of some blocks."""
        lanes = np.minimum(np.arange(span[0] * WIDTH, span[1] * WIDTH), self.count - 1)
        mixed, blocks = len(grid.command) > 1, span[1] - span[0]
        both = np.stack([grid.share, grid.ticks], axis=2)  # (kinds, pieces, 2)
        chosen = both[place[lanes]] if mixed else np.repeat(both, WIDTH, axis=0)
        steps = chosen.reshape(blocks if mixed else 1, WIDTH, *both.shape[1:]).transpose(0, 2, 3, 1)
        if len(all_commands) == 1 and not mixed:
            points = all_commands[0, grid.command[0]][None, :, :, None]
        else:
            own = (
                all_commands
                if len(all_commands) > 1
                else np.broadcast_to(all_commands, (self.count, *all_commands.shape[1:]))
            )
            taken = np.take_along_axis(own[lanes], grid.command[place[lanes]][:, :, None], axis=1)
            points = taken.reshape(blocks, WIDTH, *taken.shape[1:]).transpose(0, 2, 3, 1)
        return Pieces(
            np.ascontiguousarray(steps, self._dtype), np.ascontiguousarray(points, self._dtype), grid.row_ends, mixed
        )


class TickGrid(NamedTuple):
    """Pieces of rows, shape (kinds of clocks, pieces): lengths as shares of dt, whether the loop ticks, and which
    command acts. row_ends (rows,): the last piece of each row."""

    share: FloatArray
    ticks: FloatArray
    command: IntArray
    row_ends: IntArray


def _gains(robot: Robot) -> FloatArray:
    """The numbers of a loop, GAINS of each wheel."""
    kp, ki, limit, radius = loop_gains(robot)
    period, dead = 1.0 / (robot.drive.rate or np.inf), np.full(len(kp), robot.drive.dead_band)
    return np.stack([kp, ki * period, limit, dead, *(robot.wheels.wrench_matrix / radius)], axis=1).reshape(-1)
