"""Angles of wheels that come in blocks: counters.py unrolls each block alone, here they go on from block to block."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray

FASTEST_CHANGE = 100.0  # [rad/s] no wheel changes its speed by from row to row, beside twice its largest so far


class BlockAngle:
    """The angle of one wheel. periods [rad]: after which its reading may start over. resets: how often its counter
    was set to another value."""

    def __init__(self, periods: tuple[float, ...] = ()) -> None:
        self.periods, self.resets = periods, 0
        self._offset = self._rate = self._largest = 0.0
        self._time = self._last = np.nan

    def going_on(self, t: FloatArray, angles: FloatArray) -> FloatArray:
        """The angles [rad] of the next rows, without a jump: by a whole period where one fits, else as the wheel moved
        before. t [s], angles: shape (rows,), NaN where missing. Over a time that jumps back they are taken as they are.
        """
        rows = np.flatnonzero(np.isfinite(angles))
        if not rows.size:
            return angles
        first, result = rows[0], angles.copy()
        span = float(t[first]) - self._time
        if span > 0.0:
            limit = (FASTEST_CHANGE + 2.0 * self._largest) * span
            jump = float(angles[first]) + self._offset - self._last - self._rate * span
            if abs(jump) > limit:
                fits = [period for period in self.periods if abs(abs(jump) - period) < min(limit, 0.25 * period)]
                self.resets += not fits
                self._offset -= np.copysign(fits[0], jump) if fits else jump
        result += self._offset
        times, values = np.append(self._time, t[rows]), np.append(self._last, result[rows])
        with np.errstate(divide="ignore", invalid="ignore"):
            rates = np.diff(values) / np.diff(times)
        rates = rates[np.isfinite(rates) & (np.diff(times) > 0.0)]
        if rates.size:
            self._rate, self._largest = float(rates[-1]), max(self._largest, float(np.abs(rates).max()))
        self._time, self._last = float(times[-1]), float(values[-1])
        return result
