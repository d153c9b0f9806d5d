"""Does what looks like a dead band of a motor hold where the line of speed over input may bend as well?

    w' = g (u - q |w| w - r w^3 - s w exp(-(w/w0)^2)) - a w - c sgn w,   w0 a quarter of the highest speed

A motor that passes zero without stopping shows its dead band only as a bend of that line. With the smooth bends q, r
and s fitted too, to first order about the fit, the dead band is what no smooth bend explains. Where they are needed,
the interval of a fit without them is not about what it says. The last one is a drag at low speed, with no step at 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.motors.engine import SPEED, MotorEngine, MotorProblem
from omnidyn.identification.motors.estimate import BAND, LAG, LATENCY, SLOPE
from omnidyn.identification.output_error.problem.problem import Piece, Point
from omnidyn.identification.output_error.solve.solver import Solver, State
from omnidyn.statistics import t_quantile

BLOCKS, LEAST_BLOCK = 60, 8  # blocks of rows in all, rows of one at least
SURE = 0.95
MOST_NUMBERS = 20_000_000  # what is longer is not looked at: every row has all its slopes in memory
BENDS, LOW = 3, 0.25  # how many; w0 over the highest speed


@dataclass(frozen=True, eq=False)
class Bend:
    """The dead band with smooth bends fitted too: value, std, ci95 in units of the input; and whether bends are needed.

    left: root mean square of what is left, over that without the bends.
    """

    value: float
    std: float
    ci95: tuple[float, float]
    needed: bool
    left: float


def bend(solver: Solver[MotorProblem], state: State) -> Bend | None:
    """None without a dead band or a speed, or where there are too few rows, or too many."""
    problem, name = solver.problem, BAND
    rows = sum(piece.last - piece.first + 1 for piece in problem.pieces)
    wide = len(problem.parameters) + len(problem.pieces) + BENDS
    if problem.where(name) < 0 or SPEED not in problem.columns or rows * wide > MOST_NUMBERS:
        return None
    residual, slopes, number = _regression(solver, state.point)
    size = np.sqrt((slopes**2).sum(axis=0))
    used = size > 0.0
    if (
        len(residual) < 3 * int(used.sum()) + 2 * LEAST_BLOCK
        or not used[[problem.where(name), *range(-BENDS, 0)]].all()
    ):
        return None
    variance = float(np.mean(residual**2))
    weight = (solver.nu + 1.0) / (solver.nu + residual**2 / variance) if solver.nu else np.ones(len(residual))
    scaled = slopes[:, used] / size[used]
    information = scaled.T @ (scaled * weight[:, None])
    inverse = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
    step = inverse @ (scaled.T @ (weight * residual))
    left = residual - scaled @ step
    covariance, blocks = _sandwich(scaled * (weight * left)[:, None], inverse, number)
    degrees = blocks - int(used.sum())
    if degrees < LEAST_BLOCK:
        return None
    plain = inverse * float(np.mean(weight * left**2))
    widest = np.sqrt(np.maximum(np.diag(plain), 1e-300))
    grow = np.sqrt(np.maximum(np.diag(covariance), widest**2) / np.maximum(np.diag(covariance), 1e-300))
    covariance *= np.outer(grow, grow)
    last = slice(-BENDS, None)
    bends = step[last] @ np.linalg.pinv(covariance[last, last], hermitian=True) @ step[last] / BENDS
    at = int(used[: problem.where(name)].sum())
    value = float(state.point.values[problem.where(name)] + step[at] / size[problem.where(name)])
    std = float(np.sqrt(covariance[at, at]) / size[problem.where(name)])
    half = t_quantile(degrees) * std
    share = float(np.sqrt(np.mean(weight * left**2) / np.mean(weight * residual**2)))
    return Bend(
        max(value, 0.0), std, (max(value - half, 0.0), max(value + half, 0.0)),
        bool(bends > fdtri(BENDS, degrees, SURE)), share,
    )  # fmt: skip


def _regression(solver: Solver[MotorProblem], point: Point) -> tuple[FloatArray, FloatArray, IntArray]:
    """(residual (N,), slopes (N, P + starts + BENDS), number of the piece (N,)) of the rows where a speed was measured.

    Slopes by the parameters, by the speed at which each piece starts, and by the bends.
    """
    problem, engine = solver.problem, solver.engine
    assert isinstance(engine, MotorEngine)
    count, pieces = len(problem.parameters), problem.pieces
    slope, lag = (float(point.values[problem.where(key)]) for key in (SLOPE, LAG))
    k = problem.where(f"{LATENCY}.{SPEED[0]}")
    late = float(point.values[k]) if k >= 0 else 0.0
    residuals, found, numbers = [], [], []
    for n, (piece, (predicted, by)) in enumerate(zip(pieces, engine.outputs(point), strict=True)):
        if SPEED not in piece.record.columns:
            continue
        c = piece.record.columns.index(SPEED)
        rows = slice(piece.first, piece.last + 1)
        t, own = piece.record.t[rows], predicted[rows, c]
        known = np.isfinite(own) & np.isfinite(piece.record.outputs[rows, c])
        known[: int(np.searchsorted(t, t[0] + piece.margin[c]))] = False
        starts = np.zeros((int(known.sum()), len(pieces)))
        starts[:, n] = by[rows, c, _start_of(piece, count)][known]
        bent = np.stack([np.interp(t - late, t, b) for b in _bent(t, own, slope, lag)], axis=1)
        residuals.append((piece.record.outputs[rows, c] - own)[known])
        found.append(np.concatenate([np.nan_to_num(by[rows, c, :count][known]), starts, bent[known]], axis=1))
        numbers.append(np.full(int(known.sum()), n))
    return np.concatenate(residuals), np.concatenate(found), np.concatenate(numbers)


def _start_of(piece: Piece, count: int) -> int:
    """Where the slope by the speed at the start stands."""
    return count + int(np.flatnonzero(piece.free)[0])


def _bent(t: FloatArray, speed: FloatArray, slope: float, lag: float) -> list[FloatArray]:
    """What the inputs that bend the line would add to the speed, from rest: a first-order lag, shape (rows,) each."""
    decay = np.exp(-np.diff(t) / lag).tolist()
    w = np.nan_to_num(speed / (np.nanmax(np.abs(speed), initial=0.0) or 1.0))
    found = []
    for shape in (np.abs(w) * w, w**3, w * np.exp(-((w / LOW) ** 2))):
        target = (-0.5 / slope * (shape[1:] + shape[:-1])).tolist()
        now, values = 0.0, [0.0]
        for e, goal in zip(decay, target, strict=True):
            now = goal + (now - goal) * e
            values.append(now)
        found.append(np.array(values))
    return found


def _sandwich(scores: FloatArray, inverse: FloatArray, number: IntArray) -> tuple[FloatArray, int]:
    """(covariance, blocks): scores summed over blocks of rows, none of which reaches over the end of a piece."""
    length = max(LEAST_BLOCK, -(-len(scores) // BLOCKS))
    first = [
        begin for n in np.unique(number)
        for begin in range(int(np.searchsorted(number, n)), int(np.searchsorted(number, n, "right")), length)
    ]  # fmt: skip
    influence = np.add.reduceat(scores, first, axis=0) @ inverse
    return influence.T @ influence, len(first)
