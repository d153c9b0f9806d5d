"""Environments: many robots with one task each; `reset` and `step` in NumPy, without any other package.

The physics are those of `simulate`: robots of the paper's law by the same `exact_step`, those in a turning frame or
under friction along the direction of travel by the same implicit steps; latency, dead band and sensors as the robot
file says. The bits of a robot do not depend on how many there are, nor on threads, nor on resets of
others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.implicit import stages
from omnidyn.simulation.batch.parameters import BatchParameters
from omnidyn.simulation.commands import as_floats
from omnidyn.simulation.engine import LARGEST_START
from omnidyn.simulation.environments.layout import (
    BOX_LAW,
    DISABLED,
    EXACT_LAW,
    NEXT_STEP,
    PATH,
    PER_MASS,
    POSE,
    PREVIEW,
    SAME_STEP,
    VELOCITY,
    Buffers,
    EnvironmentState,
    FixedNumbers,
    W,
    columns_of,
    new_state,
)
from omnidyn.simulation.environments.pool import (
    Pool,
    Range,
    check_robots,
    drawn_pool,
    largest_speed,
    largest_voltage,
    law_of,
    loop_rows,
    rows_of,
)
from omnidyn.simulation.environments.step import follow_up, reset_blocks, step_blocks

TASKS = {"velocity": VELOCITY, "pose": POSE, "path": PATH}
AUTORESET = {"next_step": NEXT_STEP, "same_step": SAME_STEP, "disabled": DISABLED}
# Half the width of goals: twists [m/s, m/s, rad/s], poses [m, m, rad]; of where the path task begins beside its path
SPREAD = {"velocity": (0.6, 0.6, 2.0), "pose": (1.0, 1.0, math.pi), "path": (0.05, 0.05, 0.1)}
DURATION = {"velocity": 4.0, "pose": 6.0, "path": 6.0}  # [s] of an episode
PLACE_TERMS = ("reward_position", "reward_heading")
MOST_ROBOTS, MOST_LAG, EDGE = 2**24, 1000, 1e-9


@dataclass(frozen=True)
class Setting:
    """What a task is made of, apart from the robots.

    task: "velocity", to drive at a twist; "pose", to stop at a pose; "path", to follow one. dt [s]: of a step;
    substeps: of the simulation in it. duration [s]: of an episode, None: that of the task. spread: half the width of
    goals, or of starts beside a path, (3,). push: largest wrench [N, N, N m], (3,), drawn evenly, anew each interval
    [s], None: for an episode. latency [s]: until an action acts, beside that of the robot's drive.
    uncertainty: when numbers are drawn as far off as the std and correlations of the robot file say: "startup",
    "reset", "interval", or "" for never. randomise: ranges of numbers by their keys in the robot file.
    """

    task: Literal["velocity", "pose", "path"] = "velocity"
    dt: float = 0.02
    substeps: int = 1
    duration: float | None = None
    spread: tuple[float, float, float] | None = None
    push: tuple[float, float, float] = (0.0, 0.0, 0.0)
    interval: float | None = None
    latency: float = 0.0
    uncertainty: Literal["", "startup", "reset", "interval"] = ""
    randomise: Mapping[str, Range] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise InputError("unknown task", got=self.task, expected=", ".join(TASKS), where="task")
        for name, low, high in (("dt", 1e-6, 10.0), ("substeps", 1, 10_000), ("latency", 0.0, MOST_LAG * self.dt)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError("out of range", got=value, expected=f"{low:g} to {high:g}", where=name)
        for name in ("duration", "interval"):
            value = getattr(self, name)
            if value is not None and not self.dt <= value <= 1e6 * self.dt:
                expected = f"one step, {self.dt:g} s, to a million of them"
                raise InputError("out of range", got=value, expected=expected, where=name)
        for name in ("spread", "push"):
            value = getattr(self, name)
            if value is not None and not (np.shape(value) == (3,) and (np.asarray(value) >= 0.0).all()):
                raise InputError("not three sizes", got=value, expected="three numbers of at least 0", where=name)

    @property
    def steps(self) -> int:
        """Of an episode."""
        duration = DURATION[self.task] if self.duration is None else self.duration
        return max(1, round(duration / self.dt))


class Step(NamedTuple):
    """What a step gives: views of buffers that the next step writes into. Shapes (robots, columns) and (robots,)."""

    observation: FloatArray
    reward: FloatArray
    terminated: Any
    truncated: Any


def _checked(parameters: BatchParameters, robot: Robot, setting: Setting) -> BatchParameters:
    """The parameters. Raises InputError for those of another drive, or together with other draws."""
    if parameters.wheels != robot.wheels.count or parameters.count < 1:
        got = f"{parameters.count} robots of {parameters.wheels} wheels"
        raise InputError("not of this robot", got=got, expected=f"{robot.wheels.count} wheels", where="parameters")
    if setting.randomise or setting.uncertainty:
        got = "`parameters` beside `randomise` or `uncertainty`"
        raise InputError("drawn twice", got=got, expected="one of them", where="parameters")
    if robot.drive.kind == SPEED:
        got, expected = "parameters of a drive with a speed loop", "the robots themselves"
        raise InputError("they leave out the loop", got=got, expected=expected, where="parameters")
    return parameters


class Environments:
    """Robots with one task each.

    Args:
        robots: One robot for all, or several for life: environment k has the robot k modulo their number. Their drive,
            sensors and limits are those of the first.
        count: Number of environments.
        setting: What their task is made of.
        parameters: Numbers of robots for life, as `omnidyn.sample` draws them, in place of those of `robots`.
        path: Poses and velocities in the world, step by step, for the task "path". Shape (steps, 6).
        autoreset: When an episode that ended begins anew: with the next step, in the same one, or never.
        dtype: Of all numbers, float32 or float64.
        threads: That share a step.
        seed: Of the pool that ranges draw from.
        poses: Whether poses are kept in the task "velocity" too, which asks for none.

    was_reset: whether any reset has been.
    """

    def __init__(
        self,
        robots: Robot | Sequence[Robot],
        count: int = 1,
        setting: Setting | None = None,
        *,
        parameters: BatchParameters | None = None,
        path: FloatArray | None = None,
        autoreset: str = "next_step",
        dtype: Any = np.float32,
        threads: int = 1,
        seed: int = 0,
        poses: bool = False,
    ) -> None:
        setting = setting or Setting()
        given = [robots] if isinstance(robots, Robot) else list(robots)
        if not given:
            raise InputError("no robot", got="an empty list", expected="a robot, or some", where="robots")
        for name, value, high in (("count", count, MOST_ROBOTS), ("threads", threads, 1024)):
            if not isinstance(value, int | np.integer) or not 1 <= value <= high:
                raise InputError("out of range", got=value, expected=f"a whole number from 1 to {high}", where=name)
        if autoreset not in AUTORESET:
            raise InputError("unknown autoreset", got=autoreset, expected=", ".join(AUTORESET), where="autoreset")
        check_robots(given)
        self.robot = given[0]
        self.setting, self.count, self.autoreset, self.dtype = setting, count, autoreset, np.dtype(dtype)
        if self.dtype not in (np.float32, np.float64):
            raise InputError("no such numbers", got=self.dtype.name, expected="float32 or float64", where="dtype")
        if parameters is not None:
            self.pool = Pool(_checked(parameters, given[0], setting), (parameters.count, 1, 1))
        else:
            self.pool = drawn_pool(given, setting.randomise, setting.uncertainty, seed)
            check_robots(self.pool.robots)
        self.wheels, self._poses = given[0].wheels.count, poses
        self.columns = columns_of(TASKS[setting.task], self.wheels)
        self.numbers = self._numbers(given[0], path)
        self.state = new_state(self.numbers, count, self.wheels)
        self.buffers = self._buffers()
        blocks = len(self.state.twist)
        share = -(-blocks // threads)
        self._parts = [(first, min(blocks, first + share)) for first in range(0, blocks, share)]
        self._threads = self._new_threads()
        self._now, self.was_reset = 0, False

    def _new_threads(self) -> ThreadPoolExecutor | None:
        return ThreadPoolExecutor(len(self._parts) - 1) if len(self._parts) > 1 else None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_threads": None}  # threads are of a process

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._threads = self._new_threads()

    def _numbers(self, robot: Robot, path: FloatArray | None) -> FixedNumbers:
        """What a step needs to know."""
        setting, kind = self.setting, self.dtype.type
        sensors = robot.sensor_model.in_steps(setting.dt)
        task = TASKS[setting.task]
        lags, shares, ticks = self._pieces(robot)
        looped = robot.drive.kind == SPEED
        substeps = np.array([count * -(-setting.substeps // sum(ticks)) for count in ticks])
        if not looped:
            substeps = np.full(len(shares), setting.substeps)
        travels = task != VELOCITY or sensors.averaged or self._poses
        voltage = np.ones(robot.wheels.count) if looped else largest_voltage(robot)
        law = law_of(robot) or EXACT_LAW
        halves = np.full(len(shares), 2 if travels else 1)
        if len(shares) > 1 and law != EXACT_LAW and not looped:
            halves[np.argmin(shares)] = 1
        lengths = np.array(shares) * setting.dt / substeps / halves
        members = self.pool.robots or (robot,)
        turning = [member.body.rotating_frame for member in self.pool.robots] or robot.body.rotating_frame
        loops = loop_rows(members) if looped else None
        rows = rows_of(self.pool.parameters, law, turning, voltage, lengths, kind, loops)
        rule = np.array([stages(law == BOX_LAW, length, kind).numbers for length in lengths])
        interval = 0 if setting.interval is None else max(1, round(setting.interval / setting.dt))
        if interval == 0 and self.pool.sizes[2] > 1:
            raise InputError("no interval for a range", got="interval=None", expected="seconds", where="interval")
        spread = SPREAD[setting.task] if setting.spread is None else setting.spread
        return FixedNumbers(
            task,
            AUTORESET[self.autoreset],
            substeps,
            np.array(ticks if looped else [0] * len(ticks), dtype=np.int64),
            largest_speed(robot).astype(kind),
            setting.steps,
            halves,
            np.array(lags, dtype=np.int64),
            np.array(shares),
            sensors.averaged,
            math.exp(-setting.dt / sensors.twist_filter) if sensors.twist_filter else 0.0,
            travels,
            any(setting.push),
            round(sensors.pose_delay / setting.dt),
            1 if sensors.pose_rate is None else max(1, round(1.0 / (sensors.pose_rate * setting.dt))),
            (robot.drive.dead_band / voltage).astype(kind),
            np.array(setting.push, dtype=kind),
            interval,
            np.array(spread, dtype=kind),
            np.array(self.pool.sizes, dtype=np.int64),
            rows,
            law,
            rule,
            self._path(task, path),
            setting.dt,
        )

    def _pieces(self, robot: Robot) -> tuple[list[int], list[float], list[int]]:
        """(steps by which each piece of a step is late; its share of the step; ticks of a speed loop in it)."""
        dt, latency = self.setting.dt, self.setting.latency + robot.drive.latency
        count = 1
        if robot.drive.kind == SPEED:
            per_step = dt * float(robot.drive.rate or 0.0)
            count = round(per_step)
            if count < 1 or abs(per_step - count) > EDGE * per_step:
                raise InputError(
                    "a step is not a whole number of ticks of the speed loop",
                    got=f"{dt:g} s, {robot.drive.rate:g} Hz",
                    expected="dt times rate_Hz a whole number",
                    where="dt",
                )
            latency = math.ceil(latency / dt * count - EDGE) * dt / count  # it acts from the next tick on
        late = latency / dt
        whole = math.floor(late + EDGE)
        part = late - whole if late - whole > EDGE else 0.0
        if not part:
            return [whole], [1.0], [count]
        first = round(part * count)
        return [whole + 1, whole], [part, 1.0 - part], [first, count - first]

    def _path(self, task: int, path: FloatArray | None) -> FloatArray:
        """The path as the kernels take it; one row where there is none."""
        if task != PATH:
            return np.zeros((1, 6), self.dtype)
        least = self.setting.steps + PREVIEW[-1] + 1
        rows = np.zeros((0, 6)) if path is None else np.asarray(path)
        if rows.ndim != 2 or rows.shape[1] != 6 or len(rows) < least or not np.isfinite(rows).all():
            raise InputError(
                "no path to follow for an episode",
                got=f"shape {rows.shape}",
                expected=f"finite poses and velocities, shape (steps, 6), {least} steps or more",
                where="path",
            )
        return np.ascontiguousarray(rows, dtype=self.dtype)

    def _buffers(self) -> Buffers:
        whole = W * len(self.state.twist)
        observation, reward = np.zeros((self.columns, whole), self.dtype), np.zeros(whole, self.dtype)
        terminated, truncated = np.zeros((2, whole), np.uint8)
        travel, turn, success = np.zeros(whole, self.dtype), np.zeros(whole, self.dtype), np.zeros(whole, np.uint8)
        return Buffers(observation, reward, terminated, truncated, np.zeros_like(observation), travel, turn, success)

    def reset(
        self,
        mask: Any = None,
        seed: int | None = None,
        *,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        twist: ArrayLike | None = None,
    ) -> FloatArray:
        """Begin an episode of all environments, or of those in a mask, (count,). Returns observations, a view.

        Args:
            mask: Which begin, (count,).
            seed: Of their random numbers from here on; without one, each goes on with its own.
            goal: In place of a drawn one: twist or pose by the task; shape (3,) or (count, 3).
            start: Pose to begin at [m, m, rad], of the tasks "pose" and "path"; shape as of `goal`.
            twist: To begin with [m/s, m/s, rad/s]; shape as of `goal`.
        """
        task, given = self.setting.task, {"goal": goal, "start": start, "twist": twist}
        for name, without in (("goal", "path"), ("start", "velocity")):
            if given[name] is not None and task == without:
                raise InputError(f"the task {task} has no {name}", got=name, expected="none", where=name)
        chosen_rows = {name: self._rows(name, value) for name, value in given.items() if value is not None}
        if seed is None and not self.was_reset:
            seed = int(np.random.SeedSequence().entropy)  # pyright: ignore[reportArgumentType]
        base = -1 if seed is None else int(np.random.SeedSequence(seed).generate_state(1)[0])
        chosen = np.ones(self.count, np.bool_) if mask is None else np.asarray(mask)
        if chosen.shape != (self.count,) or chosen.dtype != np.bool_:
            got = f"{chosen.dtype} of shape {chosen.shape}"
            raise InputError("not a mask", got=got, expected=f"bool of shape ({self.count},)", where="mask")
        if not self.was_reset and not chosen.all():
            raise InputError("not begun yet", got="a mask", expected="a reset of all first", where="mask")
        self.was_reset = True
        reset_blocks(self.numbers, self.state, chosen, base, self.buffers.observation)
        if chosen_rows:
            self._place(np.flatnonzero(chosen), chosen_rows)
        return self.buffers.observation[:, : self.count].T

    def _rows(self, name: str, value: ArrayLike) -> FloatArray:
        """A number of three for each environment. Shape (count, 3)."""
        array = as_floats(name, value)
        if array.shape not in ((3,), (self.count, 3)):
            raise InputError("wrong shape", got=array.shape, expected=f"(3,) or ({self.count}, 3)", where=name)
        rows = np.broadcast_to(array, (self.count, 3))
        for row in rows[~(np.abs(rows).max(axis=1) <= LARGEST_START["twist"])][:1]:  # NaN is among them
            raise InputError("no robot gets there", got=row.tolist(), expected="numbers within 1000", where=name)
        return rows

    def _place(self, index: Any, rows: Mapping[str, FloatArray]) -> None:
        """Put robots, which have just begun, to a goal, a pose and a twist, and observe all again."""
        block, lane = np.divmod(index, W)
        state = self.state
        for name, value in rows.items():
            place = {"goal": state.goal, "start": state.pose, "twist": state.twist}[name]
            place[block, :, lane] = value[index]
            if name == "start":
                state.places[block, 0, :, lane] = value[index]
            if name == "twist":
                state.mean[block, :, lane] = value[index]
        reset_blocks(self.numbers, state, np.zeros(self.count, np.bool_), -1, self.buffers.observation)

    def end(self, mask: ArrayLike) -> None:
        """End the episodes of a mask, (count,), after a step: they begin anew with the next one, or by a reset."""
        chosen = np.asarray(mask, bool)
        if self.autoreset == "same_step" and chosen.any():
            got, expected = "an end after the step", "next_step or disabled"
            raise InputError("the next episode would have begun already", got=got, expected=expected, where="autoreset")
        self.state.ended.reshape(-1)[: self.count] |= chosen
        self.buffers.terminated[: self.count] |= chosen

    def step(self, action: ArrayLike) -> Step:
        """Hold actions for dt: shares of the largest voltage or wheel speed, -1 to 1. Shape (count, wheels).

        The fastest are of `dtype` and lie by columns, as `observation` does: those are taken as they are.
        """
        columns = np.asarray(action, dtype=self.dtype).T
        if columns.shape != (self.wheels, self.count):
            got, expected = np.shape(action), f"({self.count}, {self.wheels})"
            raise InputError("wrong shape", got=got, expected=expected, where="action")
        if not self.was_reset:
            raise InputError("not begun yet", got="a step", expected="a reset first", where="step")
        if self.autoreset == "disabled" and self.over.any():
            got = f"{int(self.over.sum())} episodes that are over"
            raise InputError("nobody resets them", got=got, expected="a reset of these first", where="step")
        if not columns.flags.c_contiguous:
            columns = np.ascontiguousarray(columns)
        jobs = [self._threads.submit(self._run, part, columns) for part in self._parts[1:]] if self._threads else []
        self._run(self._parts[0], columns)
        for job in jobs:
            job.result()
        self._now += 1
        out = self.buffers
        terminated, truncated = (flags[: self.count].view(np.bool_) for flags in (out.terminated, out.truncated))
        return Step(out.observation[:, : self.count].T, out.reward[: self.count], terminated, truncated)

    def _run(self, part: tuple[int, int], action: FloatArray) -> None:
        """A step of some blocks."""
        over = step_blocks(*part, self._now, self.numbers, self.state, action, self.buffers)
        if over or self.numbers.interval:
            follow_up(*part, self.numbers, self.state, self.buffers)

    @property
    def over(self) -> Any:
        """Which episodes ended and have not begun anew. Shape (count,)."""
        return self.state.ended.reshape(-1)[: self.count].view(np.bool_)

    @property
    def terms(self) -> dict[str, FloatArray]:
        """The two terms of the last reward, and whether a robot is where it should be: views, (count,) each."""
        names = ("reward_velocity", "reward_yaw_rate") if self.setting.task == "velocity" else PLACE_TERMS
        out = self.buffers
        terms = dict(zip(names, (out.travel[: self.count], out.turn[: self.count]), strict=True))
        return {**terms, "success": out.success[: self.count].view(np.bool_)}

    @property
    def final(self) -> FloatArray:
        """The last observation of episodes that ended in this step, where the next has begun. (count, columns)."""
        return self.buffers.final[:, : self.count].T

    def _by_robot(self, rows: FloatArray) -> FloatArray:
        """A copy of rows of blocks, (blocks, rows, W), as (count, rows)."""
        return rows.swapaxes(1, 2).reshape(-1, rows.shape[1])[: self.count].copy()

    @property
    def twist(self) -> FloatArray:
        """The true twists. Shape (count, 3)."""
        return self._by_robot(self.state.twist)

    @property
    def pose(self) -> FloatArray:
        """The true poses; zeros in the task "velocity" without `poses`. Shape (count, 3)."""
        return self._by_robot(self.state.pose)

    @property
    def goal(self) -> FloatArray:
        """The goals: twists or poses; of a path how far beside it robots began. Shape (count, 3)."""
        return self._by_robot(self.state.goal)

    @property
    def steps_done(self) -> Any:
        """Steps of the episodes so far; may be set, to spread their ends. Shape (count,)."""
        return self.state.count.reshape(-1)[: self.count].copy()

    @steps_done.setter
    def steps_done(self, steps: ArrayLike) -> None:
        self.state.count.reshape(-1)[: self.count] = np.clip(steps, 0, self.setting.steps - 1)

    @property
    def privileged(self) -> FloatArray:
        """What no sensor shows: twist, pose, push [N, N, N m], and numbers of the robot. Shape (count, columns).

        The numbers are those of `pool.rows_of` without phi: C/M, S/M, a, 1/M per axis, and gains; of robots that take
        implicit steps C, damping, M, ones, and forces.
        """
        state, phi = self.state, 3 * len(self.numbers.lags)
        robots = np.delete(state.robots, slice(PER_MASS + 3, PER_MASS + 3 + phi), axis=1)
        return self._by_robot(np.concatenate([state.twist, state.pose, state.push, robots], axis=1))

    def close(self) -> None:
        """Let go of threads."""
        if self._threads is not None:
            self._threads.shutdown()


__all__ = ["W", "EnvironmentState", "Environments", "Setting", "Step"]
