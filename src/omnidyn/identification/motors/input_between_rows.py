"""The input of a motor between the rows of its log: held, the mean of both rows, or a curve through the rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.plateaus import STEPWISE
from omnidyn.statistics import stretches

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Rows = Sequence[tuple[int, int]]  # first and last row of what has no gap and no row without an input

HOLD, MEAN, CURVE = "hold", "mean", "curve"
WORDS = {HOLD: "held from row to row", MEAN: "the mean of two rows", CURVE: "a curve through the rows"}
SUB = 4  # held inputs from one row to the next: what a sine of 6 rows a swing loses is 0.5 %
JUMP = 3.0  # times the larger change before and after: the input jumped. A smooth curve changes at most three times as
# much from one row to the next, and only on one side of a crest
CUBIC_ROWS = 4


def _curves(t: FloatArray, u: FloatArray, pieces: Rows) -> Iterator[tuple[int, int, CubicSpline]]:
    """(first row, row after the last, curve) of the stretches on which the input does not jump."""
    from scipy.interpolate import CubicSpline  # takes a second to import

    for first, last in pieces:
        step = np.abs(np.diff(u[first : last + 1]))
        neighbour_step = np.maximum(np.append(step[1:], 0.0), np.append(0.0, step[:-1]))
        edges = [first, *(first + 1 + np.flatnonzero(step > JUMP * neighbour_step)), last + 1]
        for first_row, end in pairwise(edges):
            if end - first_row >= CUBIC_ROWS:
                yield first_row, end, CubicSpline(t[first_row:end], u[first_row:end])


def refined(
    t: FloatArray, u: FloatArray, outputs: FloatArray, pieces: Rows
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(t, u, outputs) with SUB rows in place of each, u in the middle of each; outputs NaN where nothing was measured.

    t, u: shape (rows,); outputs (rows, C). The result has SUB (rows - 1) + 1 rows. A jump between two rows came nobody
    knows when: on a line, which is what the motor got on the average over all times when it may have come.
    """
    share = np.arange(SUB) / SUB
    fine_times = np.append((t[:-1, None] + share * np.diff(t)[:, None]).ravel(), t[-1])
    middle = np.append(0.5 * (fine_times[1:] + fine_times[:-1]), t[-1])
    known_rows = np.isfinite(u)
    fine_input = np.interp(middle, t[known_rows], u[known_rows])
    for first_row, end, curve in _curves(t, u, pieces):
        rows = slice(SUB * first_row, SUB * (end - 1))
        fine_input[rows] = curve(middle[rows])
    fine_outputs = np.full((len(fine_times), outputs.shape[1]), np.nan)
    fine_outputs[::SUB] = outputs
    return fine_times, fine_input, fine_outputs


def _integrals(t: FloatArray, u: FloatArray, pieces: Rows) -> tuple[FloatArray, FloatArray]:
    """The integral of an input up to each row, of held values and of the curve. Shapes (rows,)."""
    steps = np.diff(t)
    held_areas, curve_areas = u[:-1] * steps, 0.5 * (u[1:] + u[:-1]) * steps
    for first_row, end, curve in _curves(t, u, pieces):
        curve_areas[first_row : end - 1] = np.diff(curve.antiderivative()(t[first_row:end]))
    held_integral, curve_integral = (
        np.append(0.0, np.cumsum(np.nan_to_num(areas))) for areas in (held_areas, curve_areas)
    )
    return held_integral, curve_integral


def _integrals_at(t: FloatArray, stamps: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """As `_integrals`, up to each of the times t, of an input with stamps of its own."""
    new = np.append(True, (values[1:] != values[:-1]) & np.isfinite(values[:-1]))
    held_integral, _ = _integrals(stamps, values, ())
    finite_pieces = [(int(a), int(b) - 1) for a, b in stretches(np.isfinite(values[new]))]
    _, curve_integral = _integrals(stamps[new], values[new], finite_pieces)
    return np.interp(t, stamps, held_integral), np.interp(t, stamps[new], curve_integral)


class InputIntegral:
    """The integral of an input over any rows of a piece: of held values where it comes in steps, else of the curve.

    Straight lines from row to row would cut the crests of a sine of 20 rows by almost a percent.
    """

    def __init__(
        self,
        t: FloatArray,
        u: FloatArray,
        pieces: Rows,
        mean_rows: int = 1,
        stamped_input: tuple[FloatArray, FloatArray] | None = None,
    ):
        """mean_rows: of the integrals over the same rows and those up to so many rows before, their mean: what holds of
        a speed that is a mean over as many rows. NaN where there are not so many rows before.
        stamped_input: times and values of the input where it has stamps of its own; u is then what held in each row.
        """
        self._u = u
        integrals = _integrals(t, u, pieces) if stamped_input is None else _integrals_at(t, *stamped_input)
        self._held, self._curved = (_trailing_mean(integral, pieces, mean_rows) for integral in integrals)

    def over(self, window: slice) -> float:
        """From the first row of a window to its last, in units of the input times seconds."""
        window_input = self._u[window]
        in_steps = np.mean(np.diff(window_input) != 0.0) <= max(STEPWISE, 2.0 / len(window_input))
        total = self._held if in_steps else self._curved
        return float(total[window.stop - 1] - total[window.start])


def _trailing_mean(values: FloatArray, pieces: Rows, rows: int) -> FloatArray:
    """The mean of each row and the `rows` - 1 before it in its piece; NaN where there are fewer."""
    if rows == 1:
        return values
    mean = np.full(len(values), np.nan)
    for first, last in pieces:
        if last - first >= rows - 1:
            mean[first + rows - 1 : last + 1] = np.convolve(values[first : last + 1], np.ones(rows) / rows, "valid")
    return mean
