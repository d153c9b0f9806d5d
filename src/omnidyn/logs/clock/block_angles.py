"""Angles of wheels that come in blocks: counters.py unrolls each block alone, here they go on from block to block."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray

FASTEST_CHANGE = 100.0  # [rad/s] no wheel changes its speed by from row to row, beside twice its largest so far

SMALLEST_JUMP = 1.0  # [rad]


class BlockAngle:
    """The angle of one wheel. periods [rad]: after which its reading may start over. resets: how often its counter
    was set to another value."""

    def __init__(self, periods: tuple[float, ...] = ()) -> None:
        self.periods, self.resets = periods, 0
        self._offset = self._rate = self._largest = self._usual = 0.0
        self._time = self._last = np.nan

    def going_on(self, t: FloatArray, angles: FloatArray) -> FloatArray:
        """The angles [rad] of the next rows, without a jump: by a whole period where one fits, else as the wheel moved
        before. t [s], angles: shape (rows,), NaN where missing. Over a time that jumps back they are taken as they are.
        """
        rows = np.flatnonzero(np.isfinite(angles))
        if not rows.size:
            return angles
        times, values = np.append(self._time, t[rows]), np.append(self._last, angles[rows] + self._offset)
        spans = np.diff(times)
        self._usual = self._usual or float(np.median(spans[spans > 0.0])) if (spans > 0.0).any() else self._usual
        spans = np.where(spans > 0.0, np.maximum(spans, self._usual), np.nan)  # rows may come at one time
        limits = np.maximum((FASTEST_CHANGE + 2.0 * self._largest) * spans, SMALLEST_JUMP)
        while True:
            rates = np.diff(values) / spans
            jumps = np.diff(values) - np.append(self._rate, np.nan_to_num(rates[:-1])) * spans
            far = np.flatnonzero(np.abs(jumps) > limits)
            if not far.size:
                break
            jump, limit = float(jumps[far[0]]), float(limits[far[0]])
            fits = [period for period in self.periods if abs(abs(jump) - period) < min(limit, 0.25 * period)]
            self.resets += not fits
            shift = np.copysign(fits[0], jump) if fits else jump
            values[far[0] + 1 :] -= shift
            self._offset -= shift
        known_rates = rates[np.isfinite(rates)]
        if known_rates.size:
            self._rate, self._largest = float(known_rates[-1]), max(self._largest, float(np.abs(known_rates).max()))
        self._time, self._last = float(times[-1]), float(values[-1])
        result = angles.copy()
        result[rows] = values[1:]
        return result
