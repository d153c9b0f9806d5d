"""Batch: many robots in the middle of their motion; `simulate_batch`: from rest to the end of rows of commands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import is_number, is_whole
from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.blocks import EXACT_POSE, FAST_POSE, BatchCommands, BlockGroup, GroupRun, drivers_of
from omnidyn.simulation.batch.engine_kind import BOX, DIRECTION, DUTY, EXACT, GENERAL, VOLTAGE, WHEEL_SPEED, engine_kind
from omnidyn.simulation.batch.loops import LoopGroup
from omnidyn.simulation.batch.parameters import batch_parameters, wheels_of
from omnidyn.simulation.batch.result import BatchRun, BatchState, Statistics
from omnidyn.simulation.batch.singles import SingleGroup
from omnidyn.simulation.batch.threads import Threads
from omnidyn.simulation.commands import MAX_DT, MIN_DT, as_floats, only_command
from omnidyn.simulation.engine import LARGEST_START, as_start, as_tolerance
from omnidyn.statement import WARNING, Statement

if TYPE_CHECKING:
    from omnidyn.simulation.batch.sample import Sample  # slow to load, for it needs SciPy

MOST_SUBSTEPS = 10_000
POSES = (None, FAST_POSE, EXACT_POSE)


def simulate_batch(
    robots: Sequence[Robot] | Sample,
    voltage: ArrayLike | None = None,
    dt: float | None = None,
    *,
    duty: ArrayLike | None = None,
    wheel_speed_command: ArrayLike | None = None,
    supply: float | None = None,
    start_twist: ArrayLike = (0.0, 0.0, 0.0),
    start_pose: ArrayLike = (0.0, 0.0, 0.0),
    pose: str | None = EXACT_POSE,
    every: int | None = None,
    statistics: bool = False,
    dtype: Any = float,
    threads: int | None = None,
    tol: float | None = None,
    substeps: int = 1,
) -> BatchRun:
    """Simulate many robots under commands held from row to row, as `simulate` does one.

    Returns a BatchRun: the end of each, and what else is asked for. Each robot has the same bits in any batch and with
    any number of threads. One that cannot go on, such as by a command that is not finite, is NaN and marked as failed.

    Args:
        robots: Robots of as many wheels each, or `sample`.
        voltage: [V], shape (rows, wheels) for all, or (robots, rows, wheels).
        dt: Length of each row [s].
        duty: In place of a voltage, -1..1 of the supply.
        wheel_speed_command: In place of a voltage, for drives with a speed loop [rad/s].
        supply: Voltage of the battery behind a duty [V]; None takes that of the robot.
        start_twist: [m/s, m/s, rad/s], shape (3,) or (robots, 3).
        start_pose: [m, m, rad], shape (3,) or (robots, 3).
        pose: "exact", as `simulate`; "fast", 2 Gauss nodes a step, within 2e-6 m and rad over 10 s at 1 kHz; None.
        every: Keep samples of every so many rows, the start included.
        statistics: Keep mean, root mean square, least and largest over the ends of all rows.
        dtype: float, or numpy.float32 in half the time, for what moves in blocks.
        threads: How many work; None takes one for each processor.
        tol: Of engines that are not exact [m/s], robot by robot; None takes `substeps` fixed steps a row.
        substeps: Fixed steps in a row, of engines that are not exact. Steps of 1 ms are off by up to 2e-3 m/s,
            7e-3 rad/s and, over 5 s, 2e-3 m; the error goes with the step: docs/how-to/batches.md has the table.

    Raises InputError for wrong shapes, values that are not finite in what all robots share, a dt outside 1e-9..3600 s.
    """
    given = {VOLTAGE: voltage, DUTY: duty, WHEEL_SPEED: wheel_speed_command}
    name = only_command(given, dt)
    assert dt is not None
    batch = Batch(
        robots,
        dt,
        command=name,
        supply=supply,
        start_twist=start_twist,
        start_pose=start_pose,
        pose=pose,
        dtype=dtype,
        threads=threads,
        tol=tol,
        substeps=substeps,
    )
    return batch.run(as_floats(name, given[name]), every=every, statistics=statistics)


class Batch:
    """Many robots in the middle of their motion; the arguments are those of `simulate_batch`.

    command: what `step` and `run` take, "voltage" [V], "duty" or "wheel_speed_command" [rad/s].
    """

    def __init__(
        self,
        robots: Sequence[Robot] | Sample,
        dt: float,
        *,
        command: str = VOLTAGE,
        supply: float | None = None,
        start_twist: ArrayLike = (0.0, 0.0, 0.0),
        start_pose: ArrayLike = (0.0, 0.0, 0.0),
        pose: str | None = EXACT_POSE,
        dtype: Any = float,
        threads: int | None = None,
        tol: float | None = None,
        substeps: int = 1,
    ) -> None:
        self.dt, self.command, self.pose, self._supply = _as_dt(dt), command, pose, supply
        _check_word("pose", pose, POSES)
        _check_word("command", command, (VOLTAGE, DUTY, WHEEL_SPEED))
        _check_word("dtype", _dtype_name(dtype), ("float64", "float32"))
        if supply is not None and not is_number(supply):
            raise InputError("not a supply", got=supply, expected="one number of volts, or None", where="supply")
        if not is_whole(substeps) or not 1 <= substeps <= MOST_SUBSTEPS:
            raise InputError(
                "cannot cut a row into so many steps",
                got=substeps,
                expected=f"1 to {MOST_SUBSTEPS}",
                where="substeps",
            )
        self._substeps = 1 if as_tolerance(tol) else int(substeps)
        self._threads = Threads(threads)
        self._groups = self._group(robots, np.dtype(dtype), tol)
        self.count = sum(group.count for _, group in self._groups)
        self._start = start_twist, start_pose
        self.reset()

    def _group(self, robots: Sequence[Robot] | Sample, dtype: Any, tol: float | None) -> list[tuple[IntArray, Any]]:
        """(indices, the group that moves those robots), one for each engine."""
        parameters = getattr(robots, "parameters", None)
        if parameters is not None and self.command != WHEEL_SPEED:  # what has a limit or a loop needs its robots
            center: Robot = robots.center  # pyright: ignore[reportAttributeAccessIssue]
            kind = engine_kind(center, self.command, tol)
            if kind == EXACT or (kind in (BOX, DIRECTION) and np.array_equal(parameters.coulomb, parameters.breakaway)):
                _check_drive(center, self.command, self._supply)
                self.wheels = center.wheels.count
                turning, drivers = np.full(parameters.count, center.body.rotating_frame), [(center, slice(None))]
                group = BlockGroup(kind, parameters, drivers, turning, self._length(kind), self.pose, dtype)
                return [(np.arange(parameters.count), group)]
        fleet: Any = robots
        if isinstance(robots, Iterable) and not isinstance(robots, str | Robot):
            fleet = list(robots)  # what can be walked once, too
        self.wheels = wheels_of(fleet)
        kinds: dict[int, str] = {}
        for robot in fleet:
            if id(robot) not in kinds:
                _check_drive(robot, self.command, self._supply)
                kinds[id(robot)] = engine_kind(robot, self.command, tol)
        places: dict[str, list[int]] = {}
        for k, robot in enumerate(fleet):
            places.setdefault(kinds[id(robot)], []).append(k)
        groups = []
        for kind, index in places.items():
            members, length = [fleet[k] for k in index], self._length(kind)
            if kind == GENERAL:
                group: Any = SingleGroup(members, self.command, self._supply, length, self.pose, tol)
            elif self.command == WHEEL_SPEED:
                group = LoopGroup(kind, members, length, self.pose, dtype)
            else:
                turning = np.array([robot.body.rotating_frame for robot in members])
                parameters = batch_parameters(members)
                drivers = drivers_of(members)
                group = BlockGroup(kind, parameters, drivers, turning, length, self.pose, dtype, members)
            groups.append((np.array(index), group))
        return groups

    def _length(self, kind: str) -> float:
        """Of a step of an engine [s]; the exact one takes a row as a whole."""
        return self.dt if kind == EXACT else self.dt / self._substeps

    @property
    def engines(self) -> dict[str, int]:
        """Name of an engine -> number of robots that it moves."""
        engines: dict[str, int] = {}
        for _, group in self._groups:
            for name, count in group.engines.items():
                engines[name] = engines.get(name, 0) + count
        return engines

    @property
    def state(self) -> BatchState:
        """Where all robots are."""
        twist, pose = np.empty((self.count, 3)), np.empty((self.count, 3))
        failed = np.empty(self.count, bool)
        for index, group in self._groups:
            twist[index], pose_rows, failed[index] = group.state()
            if self.pose is not None:
                pose[index] = pose_rows
        return BatchState(twist, None if self.pose is None else pose, failed)

    def reset(
        self, mask: ArrayLike | None = None, *, twist: ArrayLike | None = None, pose: ArrayLike | None = None
    ) -> BatchState:
        """Put the robots of a mask (n,), or all, to a twist and a pose, shape (3,) or (n, 3), else to their start."""
        chosen = np.ones(self.count, bool) if mask is None else np.asarray(mask)
        if chosen.dtype != bool or chosen.shape != (self.count,):
            raise InputError(
                "not a mask of robots",
                got=f"{chosen.dtype}, shape {chosen.shape}",
                expected=f"bool, shape ({self.count},)",
                where="mask",
            )
        twists = self._rows("twist", self._start[0] if twist is None else twist)
        poses = self._rows("pose", self._start[1] if pose is None else pose)
        for index, group in self._groups:
            here = np.flatnonzero(chosen[index])
            group.reset(here, twists[index[here]], poses[index[here]])
        return self.state

    def _rows(self, name: str, value: ArrayLike) -> FloatArray:
        array = as_floats(name, value)
        if array.shape not in ((3,), (self.count, 3)):
            raise InputError("wrong shape", got=array.shape, expected=f"(3,) or ({self.count}, 3)", where=name)
        if array.ndim == 1:
            as_start(name, array, 3)
        else:  # a robot that starts nowhere is marked as failed
            for row in array[np.abs(array).max(axis=1) > LARGEST_START[name]][:1]:
                as_start(name, row, 3)
        return np.broadcast_to(array, (self.count, 3))

    def step(self, command: ArrayLike) -> BatchState:
        """Hold a command for dt, shape (wheels,) for all or (n, wheels). Returns where all robots are then."""
        rows = as_floats(self.command, command)
        if rows.ndim not in (1, 2):
            self._refuse(rows, f"({self.wheels},) or ({self.count}, {self.wheels})")
        self._run(self._commands(rows[None] if rows.ndim == 1 else rows[:, None]), 0, False)
        return self.state

    def run(self, command: ArrayLike, *, every: int | None = None, statistics: bool = False) -> BatchRun:
        """Hold rows of commands, shape (rows, wheels) for all or (n, rows, wheels); see `simulate_batch`."""
        if every is not None and (not is_whole(every) or every < 1):
            raise InputError(
                "cannot keep every so many samples", got=every, expected="1 or more, or None", where="every"
            )
        commands = self._commands(as_floats(self.command, command))
        return self._merged(commands, self._run(commands, every or 0, statistics), every or 0)

    def _commands(self, rows: FloatArray) -> BatchCommands:
        shapes = f"(rows, {self.wheels}) or ({self.count}, rows, {self.wheels})"
        if rows.ndim not in (2, 3) or rows.shape[-1] != self.wheels or not rows.shape[-2]:
            self._refuse(rows, shapes)
        if rows.ndim == 3 and len(rows) != self.count:
            self._refuse(rows, shapes)
        if rows.ndim == 2:
            bad_rows = np.flatnonzero(~np.isfinite(rows).all(axis=1))
            if bad_rows.size:
                raise InputError(
                    "not a finite number",
                    got=rows[bad_rows[0]].tolist(),
                    expected="numbers",
                    where=f"{self.command} row {bad_rows[0]}",
                )
        return BatchCommands(self.command, rows[None] if rows.ndim == 2 else rows, self._supply)

    def _refuse(self, rows: FloatArray, expected: str) -> None:
        raise InputError("wrong shape", got=rows.shape, expected=expected, where=self.command)

    def _run(self, commands: BatchCommands, every: int, statistics: bool) -> list[GroupRun]:
        runs = []
        for index, group in self._groups:
            own = commands if len(self._groups) == 1 else commands.of(index)
            cuts = round(self.dt / group.dt)
            if cuts > 1:
                own = own._replace(rows=np.repeat(own.rows, cuts, axis=1))
            run = group.run(own, cuts * every, statistics, self._threads)
            if run.totals is not None:
                sums = run.totals.shape[1] // 2  # of values and of their squares, before least and largest
                run.totals[:, :sums] /= own.steps
            runs.append(run._replace(clipped=(run.clipped[0] // cuts, run.clipped[1] // cuts)))
        return runs

    def _merged(self, commands: BatchCommands, runs: list[GroupRun], every: int) -> BatchRun:
        """One run of those of the groups."""
        samples = _together([run.samples for run in runs], self._groups, self.count)
        totals = _together([run.totals for run in runs], self._groups, self.count)
        has_pose, steps = self.pose is not None, commands.steps
        return BatchRun(
            end=self.state,
            engines=self.engines,
            t=np.arange(samples.shape[1]) * (every * self.dt) if samples is not None else None,
            twists=None if samples is None else samples[..., :3],
            poses=None if samples is None or not has_pose else samples[..., 3:],
            twist_statistics=None if totals is None else _statistics(totals, 0),
            pose_statistics=None if totals is None or not has_pose else _statistics(totals, 3),
            warnings=_warnings(runs, self.command, steps * len(commands.rows)),
        )


def _together(parts: list[Any], groups: list[tuple[IntArray, Any]], count: int) -> Any:
    """What the groups give, robot by robot; None where they give nothing."""
    if parts[0] is None or len(parts) == 1:
        return parts[0]
    whole = np.empty((count, *parts[0].shape[1:]))
    for (index, _), part in zip(groups, parts, strict=True):
        whole[index] = part
    return whole


def _statistics(totals: FloatArray, first: int) -> Statistics:
    """Of the three rows from `first` on; totals (n, means, means of squares, least, largest)."""
    mean, squares, least, largest = (part[:, first : first + 3] for part in np.split(totals, 4, axis=1))
    return Statistics(mean, np.sqrt(squares), least, largest)


def _warnings(runs: list[GroupRun], command: str, rows: int) -> tuple[Statement, ...]:
    clipped = [run.clipped for run in runs if run.clipped[0]]
    statements = []
    if clipped:
        numbers = {"clipped": sum(count for count, _ in clipped), "rows": rows, "first": min(row for _, row in clipped)}
        statements.append(Statement("clipped", WARNING, command, numbers))
    return (*statements, *(statement for run in runs for statement in run.warnings))


def _as_dt(dt: float) -> float:
    if not is_number(dt) or not MIN_DT <= dt <= MAX_DT:
        raise InputError("step out of range", got=dt, expected=f"one number, {MIN_DT:g} to {MAX_DT:g} s", where="dt")
    return float(dt)


def _dtype_name(dtype: Any) -> str:
    """The name of a dtype, or what was given in its place."""
    try:
        return np.dtype(dtype).name
    except TypeError:
        return str(dtype)


def _check_word(name: str, word: Any, words: tuple[Any, ...]) -> None:
    if not isinstance(word, str | type(None)) or word not in words:
        expected = ", ".join(str(choice) for choice in words)
        raise InputError(f"no such {name}", got=word, expected=f"one of {expected}", where=name)


def _check_drive(robot: Robot, command: str, supply: float | None) -> None:
    """Raises InputError for a command that the drive of a robot cannot take."""
    if command == WHEEL_SPEED and robot.drive.kind != SPEED:
        raise InputError(
            f"the drive of {robot.name} takes no {command}",
            got=f'[drive] kind = "{robot.drive.kind}"',
            expected='kind = "speed"',
            remedy="add the gains and the rate of its speed loop to the robot file",
        )
    battery = robot.drive.supply if supply is None else supply
    if command == DUTY and not (battery is not None and np.isfinite(battery) and battery > 0.0):
        raise InputError(
            "a duty needs a supply",
            got=battery or "no supply",
            expected="positive volts, supply= or [drive] supply_V",
            remedy='add [drive] kind = "duty" and supply_V to the robot file',
        )
