"""The engine of a fit for logs of set speeds: derivatives through the firmware's loop, any robot.

The same interface as exact.py. It knows numbers of the robot file, gains of the loop included, and the latency
of channels, which is exact: the run is cut at every t - latency. Before the first row the robot is at rest.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.identification.output_error.engines.exact import LATE, Weighting
from omnidyn.identification.output_error.engines.sums import added
from omnidyn.identification.output_error.problem.outputs import refuse_exact_only
from omnidyn.identification.output_error.problem.problem import Piece, PieceSums, Point, Problem
from omnidyn.model.dynamics import acceleration
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.simulation.commands import Commands
from omnidyn.simulation.sensitivity.derivatives import Derivatives, differentiate
from omnidyn.simulation.sensitivity.directions import Prepared, current_derivatives, prepared

MEET = 1e-7  # [s] times that differ by less are one
SETTLED = 1e-10  # [m/s, A, V] a run that changes less from tick to tick stays as it is until the next command
SLOW_LOOP = 0.5  # periods in a row, beyond which a current is seen between its ticks
NEAR_LIMIT = 0.9  # of the voltage limit
STEEPEST = 1e8  # a loop that swings has derivatives that grow without bound: they are cut, for they mean nothing


class LoopEngine:
    """Residuals and sensitivities of a problem through the speed loop. tol [m/s]: None is a step a tick.

    Raises UnsupportedError for nuisances other than latencies, and for outputs that only the exact engine knows.
    """

    def __init__(self, problem: Problem, tol: float | None = None):
        self.problem, self.tol, self._columns = problem, tol, problem.columns
        other = [p.name for p in problem.parameters[problem.robot_count :] if not p.name.startswith(LATE)]
        if other:
            raise UnsupportedError(
                "a log of set speeds has no voltage that could be changed on its way", got=", ".join(other),
                expected="latency", where="nuisances",
            )  # fmt: skip
        refuse_exact_only(problem.columns, problem.robot.name)

    def on(self, problem: Problem) -> LoopEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        engine = copy.copy(self)
        engine.problem = problem
        return engine

    def ready_at(self, values: FloatArray) -> Prepared:
        """The robot with these values and its neighbours, for all pieces."""
        keys = [key for p in self.problem.robot_parameters for key in _keys(p.name, p.also)]
        return prepared(self.problem.robot_at(values), keys)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What the residuals of every piece add up to; see kernel/march.py."""
        ready, found = self.ready_at(point.values), []
        for piece, state in zip(self.problem.pieces, point.states, strict=True):
            known = np.array([self._columns.index(column) for column in piece.record.columns])
            outputs, slopes = self.outputs(ready, piece, state, point.values)
            residual = piece.record.outputs[piece.first : piece.last + 1] - outputs
            width = slopes.shape[2]
            turned = np.ascontiguousarray(residual.T), np.ascontiguousarray(np.swapaxes(slopes, 0, 1))
            found.append(added(*turned, np.arange(width), weighting, known, width))
        return found

    def meets_limit(self, point: Point) -> bool:
        """Whether a run comes near the voltage limit, where the integral of the loop stands still, at any row."""
        ready = self.ready_at(point.values)
        for piece in self.problem.pieces:
            t = piece.record.t[piece.first : piece.last + 1]
            voltage = self._run(ready, piece, t, t).run.voltage
            assert voltage is not None
            if (np.abs(voltage) > NEAR_LIMIT * per_wheel(ready.robot.motor.voltage_limit, voltage.shape[1])).any():
                return True
        return False

    def outputs(
        self, ready: Prepared, piece: Piece, state: FloatArray, values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Outputs (rows, C) of a piece and slopes (rows, C, P + 3 + C); NaN after the end of the run."""
        problem, columns, robot = self.problem, piece.record.columns, ready.robot
        t = piece.record.t[piece.first : piece.last + 1]
        late = [problem.where(LATE + name) for name, _ in columns]
        seen = {k: t - (values[k] if k >= 0 else 0.0) for k in dict.fromkeys(late)}
        period = 1.0 / (robot.drive.rate or np.inf)
        jumps = period < SLOW_LOOP * float(np.median(np.diff(t))) or robot.motor.electrical == DYNAMIC
        after = [
            seen[k] + period
            for k, (name, _) in zip(late, columns, strict=True)
            if jumps and k >= 0 and name == "current"
        ]
        grid = _grid(t, [*seen.values(), *after[:1]])
        found = self._run(ready, piece, t, grid)
        outputs = np.zeros((len(t), len(columns)))
        slopes = np.zeros((len(t), len(columns), len(problem.parameters) + N_AXES + len(columns)))
        for k, times in seen.items():
            own = [c for c in range(len(columns)) if late[c] == k]
            begun, there = times >= t[0] - MEET, times <= grid[-1] + MEET
            outputs[np.ix_(~there, own)] = np.nan
            used = begun & there
            if not used.any():  # it ends before it is seen
                continue
            at = np.searchsorted(grid, times[used] - MEET)
            pace = _pace(robot, found, at) if k >= 0 else None
            for c in own:
                name, i = columns[c]
                outputs[used, c], by_key = _column(robot, found, name, i, at)
                if name == "current":  # at the very end the loop has not answered yet
                    outputs[used, c] = np.where(at == len(grid) - 1, np.nan, outputs[used, c])
                slopes[used, c, : problem.robot_count] = self._chained(by_key)
                if pace is not None:
                    slopes[used, c, k] = -_rate(robot, found, pace, name, i, at, grid, period * jumps)
        for c, (name, _) in enumerate(columns):
            if name == "heading":
                outputs[:, c] += state[N_AXES + c]
                slopes[:, c, len(problem.parameters) + N_AXES + c] = 1.0
        return outputs, np.clip(np.nan_to_num(slopes), -STEEPEST, STEEPEST)

    def _run(self, ready: Prepared, piece: Piece, t: FloatArray, grid: FloatArray) -> Derivatives:
        assert piece.record.set_point is not None
        rows = np.maximum(np.searchsorted(t, grid[:-1] + MEET, side="right") - 1, 0)
        set_point = piece.record.set_point[piece.first : piece.last + 1][rows]
        given = Commands(np.diff(grid), None, set_point=set_point)
        travels = any(name == "heading" for name, _ in piece.record.columns)
        rates = np.zeros((len(ready.keys), *set_point.shape))  # as commanded, whatever the robot
        return differentiate(ready, given, rates, (np.zeros(3), np.zeros(3)), self.tol or 0.0, SETTLED, travels)

    def _chained(self, by_key: FloatArray) -> FloatArray:
        """Derivatives by the parameters from those by all their keys. Shape (rows, robot_count)."""
        out, k = np.zeros((len(by_key), self.problem.robot_count)), 0
        for j, p in enumerate(self.problem.robot_parameters):
            for factor in (1.0, *(factor for _, factor in p.also)):
                out[:, j] += factor * by_key[:, k]
                k += 1
        return out


def _grid(t: FloatArray, seen: Sequence[FloatArray]) -> FloatArray:
    """All times of rows and of what is seen, after the start, each once."""
    times = np.unique(np.concatenate([t, *(row[(row > t[0]) & (row < t[-1])] for row in seen)]))
    return times[np.concatenate([[True], np.diff(times) > MEET])]


def _of_twist(robot: Robot, twist: FloatArray, name: str, i: int) -> FloatArray:
    """What an output takes linearly from a twist; the heading takes its rate. Shape (rows,)."""
    if name == "wheel_speed":
        return wheel_speed(robot.wheels, twist)[:, i]
    return twist[:, 2 if name == "heading" else i]


def _keys(name: str, also: Sequence[tuple[str, float]]) -> list[str]:
    return [name, *(key for key, _ in also)]


def _column(robot: Robot, found: Derivatives, name: str, i: int, at: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """One output at rows `at` of the run, and its derivatives by key. Wheel radii and angles do not change."""
    run = found.run
    assert run.twist is not None
    assert run.pose is not None
    assert run.current is not None
    if name == "current":
        return run.current[at, i], found.current[at, i]
    if name == "heading":
        return run.pose[at, 2], found.pose[at, 2]
    turned = np.moveaxis(found.twist[at], 1, 2).reshape(-1, N_AXES)
    return _of_twist(robot, run.twist[at], name, i), _of_twist(robot, turned, name, i).reshape(len(at), -1)


def _pace(robot: Robot, found: Derivatives, at: NDArray[np.intp]) -> FloatArray:
    """Acceleration at rows `at` under the voltages held there."""
    assert found.run.twist is not None
    assert found.run.voltage is not None
    return acceleration(robot, found.run.twist[at], found.run.voltage[at])


def _rate(
    robot: Robot, found: Derivatives, pace: FloatArray, name: str, i: int, at: NDArray[np.intp], grid: FloatArray,
    period: float,
) -> FloatArray:  # fmt: skip
    """How fast an output changes. A current jumps at every tick: its change over a period; 0: between ticks."""
    run = found.run
    assert run.twist is not None
    assert run.current is not None
    if name == "current" and not period:
        assert run.voltage is not None
        return current_derivatives((robot, robot), run.twist[at], run.voltage[at], pace, 0.0)[:, i]
    if name == "current":
        later = np.minimum(np.searchsorted(grid, grid[at] + period - MEET), len(grid) - 1)
        return (run.current[later, i] - run.current[at, i]) / period
    return _of_twist(robot, run.twist[at] if name == "heading" else pace, name, i)
