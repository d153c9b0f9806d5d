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
from omnidyn.identification.motors.estimate import (
    BAND,
    LAG,
    LATENCY,
    SLOPE,
)
from omnidyn.identification.motors.motor_engine import SPEED, MotorProblem
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solver, State
from omnidyn.model.layout import YAW
from omnidyn.statistics import t_quantile

BLOCKS, LEAST_BLOCK = 60, 8  # blocks of rows in all, rows of one at least
BEND_CONFIDENCE = 0.95
MOST_NUMBERS = 20_000_000  # what is longer is not looked at: every row has all its slopes in memory
BENDS, LOW = 3, 0.25  # how many; w0 over the highest speed


@dataclass(frozen=True, eq=False)
class BentLine:
    """The dead band with smooth bends fitted too: value, std, ci95 in units of the input; and whether bends are needed.

    left: root mean square of what is left, over that without the bends.
    """

    value: float
    std: float
    ci95: tuple[float, float]
    needs_bends: bool
    left: float


def bend(solver: Solver[MotorProblem], state: State) -> BentLine | None:
    """None without a dead band or a speed, or where there are too few rows, or too many."""
    problem, name = solver.problem, BAND
    rows = sum(piece.last - piece.first + 1 for piece in problem.pieces)
    column_count = len(problem.parameters) + len(problem.pieces) + BENDS
    if problem.where(name) < 0 or SPEED not in problem.columns or rows * column_count > MOST_NUMBERS:
        return None
    residual, slopes, number = _regression(solver, state.point)
    size = np.sqrt((slopes**2).sum(axis=0))
    used_columns = size > 0.0
    if (
        len(residual) < 3 * int(used_columns.sum()) + 2 * LEAST_BLOCK
        or not used_columns[[problem.where(name), *range(-BENDS, 0)]].all()
    ):
        return None
    variance = float(np.mean(residual**2))
    weight = (solver.nu + 1.0) / (solver.nu + residual**2 / variance) if solver.nu else np.ones(len(residual))
    scaled = slopes[:, used_columns] / size[used_columns]
    information = scaled.T @ (scaled * weight[:, None])
    inverse = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
    step = inverse @ (scaled.T @ (weight * residual))
    remaining = residual - scaled @ step
    covariance, blocks = _sandwich(scaled * (weight * remaining)[:, None], inverse, number)
    degrees = blocks - int(used_columns.sum())
    if degrees < LEAST_BLOCK:
        return None
    plain_covariance = inverse * float(np.mean(weight * remaining**2))
    largest_std = np.sqrt(np.maximum(np.diag(plain_covariance), 1e-300))
    grow = np.sqrt(np.maximum(np.diag(covariance), largest_std**2) / np.maximum(np.diag(covariance), 1e-300))
    covariance *= np.outer(grow, grow)
    last = slice(-BENDS, None)
    bends = step[last] @ np.linalg.pinv(covariance[last, last], hermitian=True) @ step[last] / BENDS
    band_column = int(used_columns[: problem.where(name)].sum())
    value = float(state.point.values[problem.where(name)] + step[band_column] / size[problem.where(name)])
    std = float(np.sqrt(covariance[band_column, band_column]) / size[problem.where(name)])
    half = t_quantile(degrees) * std
    share = float(np.sqrt(np.mean(weight * remaining**2) / np.mean(weight * residual**2)))
    return BentLine(
        max(value, 0.0),
        std,
        (max(value - half, 0.0), max(value + half, 0.0)),
        bool(bends > fdtri(BENDS, degrees, BEND_CONFIDENCE)),
        share,
    )


def _regression(solver: Solver[MotorProblem], point: Point) -> tuple[FloatArray, FloatArray, IntArray]:
    """(residual (N,), slopes (N, P + starts + BENDS), number of the piece (N,)) of the rows where a speed was measured.

    Slopes by the parameters, by the speed at which each piece starts, and by the bends.
    """
    problem = solver.problem
    count, pieces = len(problem.parameters), problem.pieces
    slope, lag = (float(point.values[problem.where(key)]) for key in (SLOPE, LAG))
    k = problem.where(f"{LATENCY}.{SPEED[0]}")
    latency = float(point.values[k]) if k >= 0 else 0.0
    residuals, slope_rows, numbers = [], [], []
    for n, (piece, (predicted, output_slopes)) in enumerate(zip(pieces, problem.engine.outputs(point), strict=True)):
        if SPEED not in piece.record.columns:
            continue
        c = piece.record.columns.index(SPEED)
        rows = slice(piece.first, piece.last + 1)
        t, outputs_here = piece.record.t[rows], predicted[rows, c]
        known_rows = np.isfinite(outputs_here) & np.isfinite(piece.record.outputs[rows, c])
        known_rows[: int(np.searchsorted(t, t[0] + piece.margin[c]))] = False
        starts = np.zeros((int(known_rows.sum()), len(pieces)))
        if piece.free[YAW]:
            starts[:, n] = output_slopes[rows, c, count + YAW][known_rows]  # by the speed at the start
        bend_columns = np.stack([np.interp(t - latency, t, b) for b in _bent(t, outputs_here, slope, lag)], axis=1)
        residuals.append((piece.record.outputs[rows, c] - outputs_here)[known_rows])
        slope_rows.append(
            np.concatenate(
                [np.nan_to_num(output_slopes[rows, c, :count][known_rows]), starts, bend_columns[known_rows]], axis=1
            )
        )
        numbers.append(np.full(int(known_rows.sum()), n))
    return np.concatenate(residuals), np.concatenate(slope_rows), np.concatenate(numbers)


def _bent(t: FloatArray, speed: FloatArray, slope: float, lag: float) -> list[FloatArray]:
    """What the inputs that bend the line would add to the speed, from rest: a first-order lag, shape (rows,) each."""
    decay = np.exp(-np.diff(t) / lag).tolist()
    w = np.nan_to_num(speed / (np.nanmax(np.abs(speed), initial=0.0) or 1.0))
    arrays = []
    for shape in (np.abs(w) * w, w**3, w * np.exp(-((w / LOW) ** 2))):
        target = (-0.5 / slope * (shape[1:] + shape[:-1])).tolist()
        value_now, values = 0.0, [0.0]
        for e, goal in zip(decay, target, strict=True):
            value_now = goal + (value_now - goal) * e
            values.append(value_now)
        arrays.append(np.array(values))
    return arrays


def _sandwich(scores: FloatArray, inverse: FloatArray, number: IntArray) -> tuple[FloatArray, int]:
    """(covariance, blocks): scores summed over blocks of rows, none of which reaches over the end of a piece."""
    length = max(LEAST_BLOCK, -(-len(scores) // BLOCKS))
    first = [
        block_start
        for n in np.unique(number)
        for block_start in range(int(np.searchsorted(number, n)), int(np.searchsorted(number, n, "right")), length)
    ]
    influence = np.add.reduceat(scores, first, axis=0) @ inverse
    return influence.T @ influence, len(first)
