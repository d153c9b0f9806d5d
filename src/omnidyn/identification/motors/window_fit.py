"""What a motor needs to turn: slope, dead band and inertia, from windows in integral form (windows.py)

mean u = k (mean w) + c (mean sgn w) + m (change of w / length)

A mean speed has an error too: the sum of r^2 / (s^2 + k^2 speed_std^2) is minimised over k, c, m, as
`steady/line.py` does, with s^2 such that the sum is the degrees of freedom (what the speeds cannot explain). Where
the speeds are sharp this is least squares of u; where they are noisy it is least squares of w, and the slope is not
flattened by the noise. Intervals are by moving-block bootstrap over the windows: H. R. Kuensch, Ann. Stat. 17, 1217
(1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import BAND, INERTIA, LAG, SLOPE, WINDOWS, MotorEstimate
from omnidyn.identification.motors.log import follows
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.statistics import (
    autocorrelation_time,
    central_interval,
    drawn_times,
    errors_in_variables,
    huber_weight,
    t_quantile,
)

DRAWS, SEED, BLOCK = 1000, 20121, 3
FOLDS = 10  # shares of the windows, in time, that are left out in turn
ITERATIONS, STEP_TOLERANCE = 200, 1e-8
HUBER = 2.5
MIDDLE = 0.6827  # of the draws: a few outliers, of a line that is hardly determined, do not count in a std
MIN_WINDOWS = 6
COLUMN_TOLERANCE = 1e-3  # share of a column that the others leave over: below it they say the same


def fit_line(windows: MotorWindows, motor: int | None, source: str) -> MotorEstimate:
    """The line of one motor (its number from 0), or of all. Raises InsufficientDataError below six windows."""
    input_values, speed, speed_std, side, change, block = windows.of(motor)
    block = block.astype(np.int64)
    count = len(np.unique(block))
    if count < MIN_WINDOWS:
        raise InsufficientDataError(
            "too few windows for a line with intervals",
            got=f"{count} windows of {windows.length:g} s",
            expected=f"{MIN_WINDOWS} or more in which the motor turns",
            remedy="record longer",
        )
    design = np.stack([speed, side, change], axis=1)
    used_columns = _columns(design, windows.settled)
    fit = _fit(design[:, used_columns], input_values, speed_std)
    draw_values = np.full((DRAWS + 1, 3), np.nan)  # the fit itself first
    draw_values[0, used_columns] = fit.parameters
    draw_values[1:, used_columns] = _bootstrap(
        design[:, used_columns], input_values, speed_std, fit, block, windows.settled
    )
    with np.errstate(invalid="ignore", divide="ignore"):  # a draw without a slope has no lag
        numbers = dict(zip((SLOPE, BAND, INERTIA), draw_values.T, strict=True)) | {
            LAG: draw_values[:, 2] / draw_values[:, 0]
        }
    comparison = (
        _of_held_out(design[:, used_columns], input_values, fit.weight, used_columns.index(1))
        if 1 in used_columns
        else None
    )
    is_needless = comparison is not None and not comparison.is_better
    residual = input_values - design[:, used_columns] @ fit.parameters
    slope, error = float(fit.parameters[0]), float(np.sqrt(np.mean(residual**2)))
    with np.errstate(invalid="ignore", divide="ignore"):  # of draws that are all alike there is none
        correlation = float(np.corrcoef(draw_values[1:, :2].T)[0, 1])
    return MotorEstimate(
        motor=motor,
        kind=windows.kind,
        unit=windows.unit,
        basis=WINDOWS,
        source=source,
        count=count,
        value={name: float(draws[0]) for name, draws in numbers.items()},
        std={name: 0.5 * float(np.diff(central_interval(draws[1:], MIDDLE))[0]) for name, draws in numbers.items()},
        ci95={name: central_interval(draws[1:]) for name, draws in numbers.items()},
        rejected={BAND: central_interval(numbers[BAND][1:])} if is_needless else {},
        comparisons={BAND: comparison} if comparison is not None and is_needless else {},
        correlation=correlation,
        rmse=error / abs(slope) if slope else math.inf,
        unidentifiable=tuple(name for name, draws in numbers.items() if np.isnan(draws[0])),
        one_way=bool(np.abs(side.sum()) > 0.98 * np.abs(side).sum()),
        answers=follows([(input_values, speed)]) is not False,
        travel=windows.travel,
        rest=float(np.fmax.reduce(windows.rest if motor is None else windows.rest[[motor]])),
        draws={name: draws[1:] for name, draws in numbers.items()},
    )


def _of_held_out(design: FloatArray, input_values: FloatArray, weight: FloatArray, column: int) -> BlockComparison:
    """How windows left out, a share in turn, are predicted with a column beside without."""
    errors = np.zeros((2, FOLDS))
    fold = np.arange(len(input_values)) * FOLDS // len(input_values)
    for k, table in enumerate((design, np.delete(design, column, axis=1))):
        root = np.sqrt(weight)
        for part in range(FOLDS):
            kept_rows, left_out_rows = fold != part, fold == part
            rows = root[kept_rows, None] * table[kept_rows]
            parameters = np.linalg.lstsq(rows, root[kept_rows] * input_values[kept_rows], rcond=None)[0]
            left_out = input_values[left_out_rows] - table[left_out_rows] @ parameters
            errors[k, part] = weight[left_out_rows] @ left_out**2 if left_out_rows.any() else np.nan
    return compare_blocks(errors[1], errors[0])


@dataclass(frozen=True, eq=False)
class _Fit:
    parameters: FloatArray
    extra: float  # variance of the input that the errors of the speeds do not explain
    weight: FloatArray


def _columns(design: FloatArray, is_settled: bool) -> list[int]:
    """The columns that can be told: no inertia where the speed never changes or start-ups were left out; no dead band
    where the others say as much as it, at one speed or under one input (then k w + m w' is constant).
    """
    size = np.abs(design).max(axis=0)
    other_columns = [0] if is_settled or size[2] <= 1e-9 * size[0] else [0, 2]
    side, other_design = design[:, 1], design[:, other_columns]
    side_residual = side - other_design @ np.linalg.lstsq(other_design, side, rcond=None)[0]
    is_told = float(side_residual @ side_residual) > COLUMN_TOLERANCE * float(side @ side)
    return sorted([*other_columns, 1]) if is_told else other_columns


def _fit(design: FloatArray, input_values: FloatArray, speed_std: FloatArray) -> _Fit:
    """The line, the extra variance (Mandel and Paule 1982), and Huber's weights, in turn until they settle."""
    weight, extra = np.ones(len(input_values)), float(np.var(input_values)) + 1e-30
    parameters = _york(design[None], input_values[None], speed_std[None], extra, weight[None])[0]
    for _ in range(20):
        residual = input_values - design @ parameters
        error = (parameters[0] * speed_std) ** 2
        extra = _extra_variance(residual, error, weight, design.shape[1])
        size = np.abs(residual) / np.sqrt(extra + error + 1e-300)
        weight = huber_weight(size, HUBER)
        new = _york(design[None], input_values[None], speed_std[None], extra, weight[None])[0]
        if np.abs(new - parameters).max() <= STEP_TOLERANCE * np.abs(new).max():
            break
        parameters = new
    return _Fit(parameters, extra, weight)


def _extra_variance(residual: FloatArray, error: FloatArray, weight: FloatArray, count: int) -> float:
    """s^2 >= 0 with sum w r^2 / (s^2 + error) = degrees of freedom; bisected."""
    freedom = max(float(weight.sum()) - count, 1.0)

    def excess(variance: float) -> float:
        return float(np.sum(weight * residual**2 / (variance + error + 1e-300))) - freedom

    if excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.sum(residual**2)) + 1e-30
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def _york(
    design: FloatArray, input_values: FloatArray, speed_std: FloatArray, extra: float, weight: FloatArray
) -> FloatArray:
    """Least sum of w r^2 / (s^2 + k^2 speed_std^2), for many draws at once. design: (draws, n, p). Returns (draws, p).

    A ridge keeps draws apart that determine no line.
    """
    scale = np.sqrt(np.mean(design**2, axis=1))
    scale[scale == 0.0] = 1.0

    def solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
        matrix = matrix / (scale[:, :, None] * scale[:, None, :])
        ridge = np.maximum(1e-12 * np.trace(matrix, axis1=1, axis2=2), 1e-300)
        matrix += ridge[:, None, None] * np.eye(matrix.shape[1])
        return np.linalg.solve(matrix, (right / scale)[:, :, None])[:, :, 0] / scale

    return errors_in_variables(
        design, input_values, extra, speed_std**2, solve, weight=weight, tolerance=STEP_TOLERANCE, most=ITERATIONS
    ).parameters


def _bootstrap(
    design: FloatArray, input_values: FloatArray, speed_std: FloatArray, fit: _Fit, block: IntArray, is_settled: bool
) -> FloatArray:
    """Parameters of fits to windows drawn anew, in blocks of neighbours. Shape (DRAWS, p).

    A block is twice as long as the residuals remember, and three windows at least, one where each is a step of its own.
    The draws are widened as Student's t is, for a bootstrap of few blocks is too narrow.
    """
    blocks, block_of_row = np.unique(block, return_inverse=True)
    residual = np.bincount(block_of_row, input_values - design @ fit.parameters) / np.bincount(block_of_row)
    memory = int(np.ceil(2.0 * autocorrelation_time(residual)))
    length = min(max(1 if is_settled else BLOCK, memory), max(1, len(blocks) // 2))
    times = drawn_times(len(blocks), length, DRAWS, np.random.default_rng(SEED))
    draw_list = []
    for part in np.array_split(times, max(1, DRAWS * len(input_values) // 100_000)):
        weight = fit.weight * part[:, block_of_row]
        shape = (len(part), *design.shape)
        draw_list.append(
            _york(
                np.broadcast_to(design, shape),
                np.broadcast_to(input_values, shape[:2]),
                np.broadcast_to(speed_std, shape[:2]),
                fit.extra,
                weight,
            )
        )
    draws = np.concatenate(draw_list)
    freedom = max(len(blocks) / length - design.shape[1], 1.0)
    widening = np.sqrt(1.0 + design.shape[1] / freedom) * t_quantile(int(max(freedom, 1))) / t_quantile(10**6)
    return fit.parameters + widening * (draws - fit.parameters)
