"""The second engine of a fit: robots that the exact step cannot simulate, by the derivatives of the implicit engine.

The same interface as exact_engine.py, with arrays of the length of the log. It knows numbers of the robot file and the
latency of channels: a latency is exact, for the run is simulated on a grid that has a row at every t - latency.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import UnsupportedError
from omnidyn.identification.output_error.exact_engine import LATE, Weighting
from omnidyn.identification.output_error.kernel import FINAL
from omnidyn.identification.output_error.problem import Piece, PieceSums, Point, Problem
from omnidyn.model.dynamics import acceleration
from omnidyn.model.layout import AXES
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.tangent import Derivatives, derivatives

FloatArray = NDArray[np.float64]

KNOWN = ("twist", "wheel_speed", "heading")  # outputs that are linear in twist and pose, whatever is free
MEET = 1e-7  # [s] times that differ by less are one


class TangentEngine:
    """Residuals and sensitivities of a problem by the implicit engine. tol [m/s]: its tolerance, None a step a row.

    Raises UnsupportedError for nuisances and outputs that it does not know.
    """

    def __init__(self, problem: Problem, tol: float | None = None):
        self.problem, self.tol, self._columns = problem, tol, problem.columns
        other = [p.name for p in problem.parameters[problem.robot_count :] if not p.name.startswith(LATE)]
        other += sorted({name for name, _ in self._columns if name not in KNOWN})
        if other or any(piece.free.any() for piece in problem.pieces):
            raise UnsupportedError(
                "this robot is fitted by the implicit engine, which does not know all that is asked for",
                got=", ".join(other) or "a start that is not at rest", where=problem.robot.name,
                expected="nuisances: latency; outputs: twist and wheel_speed; start: rest",
            )  # fmt: skip

    def at_tolerance(self, tol: float | None) -> TangentEngine:
        """The same engine with another tolerance."""
        engine = copy.copy(self)
        engine.tol = tol
        return engine

    def on(self, problem: Problem) -> TangentEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        engine = copy.copy(self)
        engine.problem, engine._columns = problem, problem.columns
        return engine

    def robot_at(self, values: FloatArray) -> Robot:
        """The robot with these values, not checked."""
        robot = self.problem.robot
        for p, value in zip(self.problem.parameters[: self.problem.robot_count], values, strict=False):
            robot = p.on(robot, float(value))
        return robot

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What the residuals of every piece add up to; see kernel.py."""
        robot = self.robot_at(point.values)
        return [
            self._piece(robot, piece, state, point.values, weighting)
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def _piece(
        self, robot: Robot, piece: Piece, state: FloatArray, values: FloatArray, weighting: Weighting
    ) -> PieceSums:
        columns = piece.record.columns
        known = np.array([self._columns.index(column) for column in columns])
        outputs, slopes = self._outputs(robot, piece, state, values)
        residual = piece.record.outputs[piece.first : piece.last + 1] - outputs
        t = piece.record.t[piece.first : piece.last + 1]
        residual[(t - t[0])[:, None] < piece.margin] = np.nan
        return _added(residual, slopes, weighting.variance[known], weighting, known)

    def _outputs(
        self, robot: Robot, piece: Piece, state: FloatArray, values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Outputs (rows, C) and slopes (rows, C, P + 3 + C); NaN before the start."""
        columns, count = piece.record.columns, len(self.problem.parameters)
        t, rows = piece.record.t[piece.first : piece.last + 1], slice(piece.first, piece.last + 1)
        late = [self.problem.where(LATE + name) for name, _ in columns]
        seen = [t - (values[k] if k >= 0 else 0.0) for k in late]
        grid = _grid(t, seen)
        voltage = piece.record.voltage[rows][np.maximum(np.searchsorted(t, grid[:-1] + MEET, side="right") - 1, 0)]
        keys = [(p.name, *(key for key, _ in p.also)) for p in self.problem.parameters[: self.problem.robot_count]]
        flat = [key for group in keys for key in group]
        found = derivatives(robot, voltage, np.diff(grid), flat, twist=state[:AXES], tol=self.tol)
        outputs = np.full((len(t), len(columns)), np.nan)
        slopes = np.zeros((len(t), len(columns), count + AXES + len(columns)))
        held = np.concatenate([voltage, voltage[-1:]])
        for c, (name, i) in enumerate(columns):
            at = np.searchsorted(grid, seen[c] - MEET)
            used = (seen[c] >= t[0] - MEET) & (at < len(grid))
            at = at[used]
            outputs[used, c], by_key = _column(robot, found, name, i, at)
            slopes[used, c, : self.problem.robot_count] = self._chained(by_key)
            if late[c] >= 0:
                assert found.run.twist is not None
                pace = found.run.twist[at]
                if name != "heading":
                    pace = acceleration(robot, found.run.twist[at], held[at])
                slopes[used, c, late[c]] = -_of_twist(robot, pace, name, i)
        return outputs, slopes

    def _chained(self, by_key: FloatArray) -> FloatArray:
        """Derivatives by the parameters from those by all their keys. Shape (rows, robot_count)."""
        out, k = np.zeros((len(by_key), self.problem.robot_count)), 0
        for j, p in enumerate(self.problem.parameters[: self.problem.robot_count]):
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


def _column(robot: Robot, found: Derivatives, name: str, i: int, at: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """One output at rows `at` of the run, and its derivatives by key. Wheel radii and angles do not change."""
    assert found.run.twist is not None
    assert found.run.pose is not None
    if name == "heading":
        return found.run.pose[at, 2], found.pose[at, 2]
    turned = np.moveaxis(found.twist[at], 1, 2)
    return _of_twist(robot, found.run.twist[at], name, i), _of_twist(robot, turned.reshape(-1, AXES), name, i).reshape(
        len(at), -1
    )


def _added(
    residual: FloatArray, slopes: FloatArray, variance: FloatArray, weighting: Weighting, known: NDArray[np.int64]
) -> PieceSums:
    """The sums of kernel.py from arrays: residual (rows, C), slopes (rows, C, P)."""
    there = np.isfinite(residual) & np.isfinite(slopes).all(axis=2)  # at a kink a slope may not be a number
    r, z2 = np.where(there, residual, 0.0), np.where(there, residual, 0.0) ** 2 / variance
    nu, final = weighting.nu, bool(weighting.mode & FINAL)
    weight, curvature, rho = np.ones_like(r), np.ones_like(r), 0.5 * z2
    if nu:
        weight, rho = (nu + 1.0) / (nu + z2), 0.5 * (nu + 1.0) * np.log1p(z2 / nu)
        curvature = weight * ((nu - z2) / (nu + z2) if final else (nu + 1.0) / (nu + 3.0))
    pull, j = weight * r, np.where(there[:, :, None], slopes, 0.0)
    grad = np.einsum("kc,kcp->cp", pull, j)
    info = np.stack([(j[:, c] * curvature[:, c, None]).T @ j[:, c] for c in range(r.shape[1])])
    score, drift = np.zeros((0, j.shape[2])), np.zeros((0, r.shape[1]))
    if final:
        starts = np.arange(0, len(r), weighting.block)
        score = np.add.reduceat(np.einsum("kc,kcp->kp", pull / variance, j), starts, axis=0)
        drift = np.add.reduceat(pull, starts, axis=0)
    lag = (pull[1:] * pull[:-1]).sum(axis=0)
    return PieceSums(
        known, there.sum(axis=0).astype(float), (pull * r).sum(axis=0), np.where(there, rho, 0.0).sum(axis=0), lag,
        grad, info, score, drift,
    )  # fmt: skip
