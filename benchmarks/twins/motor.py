"""One motor by plain means: its free run, and the least squares of it. Nothing of omnidyn in it.

inertia w' = u(t - latency) - offset - slope w - dead_band sgn w,   inertia = slope lag
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from benchmarks.twins.worlds import Array, axis_run

STEP = 5e-4  # [s] of the integrator
HOLD, MEAN = "hold", "mean"
TRIM = 0.15  # of the rows of a window at each end, where a sensor has spikes
LAGS, BANDS = (0.05, 0.4), (0.01, 0.1)  # starts of a plain fit: [s], and shares of the input


@dataclass(frozen=True)
class Drive:
    """One motor in one log: t [s], u [V, % of duty or A], and its speed [rad/s] or angle [rad], shape (rows,) each.

    window: rows whose mean speed is compared. spiky: its sensor has spikes, so that the mean is a trimmed one.
    """

    t: Array
    u: Array
    speed: Array | None = None
    angle: Array | None = None
    window: int = 1
    spiky: bool = False

    def behind(self, points: Sequence[tuple[float, float]], slope: float) -> Drive:
        """The same behind a driver that is no line: points (input, steady speed [rad/s]) of rising size."""
        x, speed = np.array(points).T
        return replace(self, u=np.sign(self.u) * np.interp(np.abs(self.u), x, slope * speed))

    @property
    def measured(self) -> Array:
        """Speed of each window [rad/s]; NaN where nothing was measured."""
        if self.angle is not None:
            edges = np.arange(0, len(self.t), self.window)
            return np.diff(self.angle[edges]) / np.diff(self.t[edges])
        assert self.speed is not None
        return self._means(self.speed, TRIM if self.spiky else 0.0)

    def error(self, numbers: Mapping[str, float], between: str = HOLD) -> Array:
        """Free run less measured speed, of each window that was measured [rad/s].

        between: what the input is between two rows, that of the first or the mean of both.
        """
        u = self.u if between == HOLD else np.append(0.5 * (self.u[1:] + self.u[:-1]), self.u[-1])
        model, measured = self._means(free_run(numbers, self.t, u)), self.measured
        count = min(len(model), len(measured))
        left = model[:count] - measured[:count]
        return left[np.isfinite(left)]

    def _means(self, speed: Array, trim: float = 0.0) -> Array:
        count = len(speed) // self.window
        rows = np.sort(speed[: count * self.window].reshape(count, self.window), axis=1)
        cut = int(trim * self.window)
        rows = rows[:, cut : self.window - cut]
        seen = np.isfinite(rows)
        total = np.where(seen, rows, 0.0).sum(axis=1)
        return np.where(seen.any(axis=1), total / np.maximum(seen.sum(axis=1), 1), np.nan)


def free_run(numbers: Mapping[str, float], t: Array, u: Array) -> Array:
    """Speed at each row [rad/s], from rest; the input of a row holds until the next."""
    slope, inertia = numbers["slope"], numbers["slope"] * numbers["lag"]
    known, grid = np.isfinite(u), np.arange(t[0], t[-1] + STEP, STEP)
    acting = grid - numbers.get("latency", 0.0)
    row = np.searchsorted(t[known], acting + 1e-9, side="right") - 1
    fine = np.where(row < 0, 0.0, u[known][np.maximum(row, 0)]) - numbers.get("offset", 0.0)
    band = max(numbers.get("dead_band", 0.0), 0.0)
    return np.interp(t, grid, axis_run(fine, STEP, 1.0 / inertia, slope, band, band)[1])


def plain_fit(drives: Sequence[Drive]) -> tuple[dict[str, float], str]:
    """(slope, dead band and lag by least squares of free runs; what the input is between rows, the better of both)."""
    size = float(np.nanpercentile(np.abs(np.concatenate([drive.u for drive in drives])), 90))
    slope = size / float(np.nanpercentile(np.abs(np.concatenate([drive.measured for drive in drives])), 90))

    def numbers(x: Array) -> dict[str, float]:
        return {"slope": slope * np.exp(x[0]), "dead_band": size * x[1], "lag": np.exp(x[2])}

    def left(x: Array, between: str) -> Array:
        return np.concatenate([drive.error(numbers(x), between) for drive in drives])

    bounds = [-3.0, 0.0, np.log(1e-3)], [3.0, 1.0, np.log(20.0)]
    found = [
        (least_squares(left, [0.0, band, np.log(lag)], bounds=bounds, x_scale=0.1, args=(between,)), between)
        for between in (HOLD, MEAN)
        for band in BANDS
        for lag in LAGS
    ]
    best, between = min(found, key=lambda pair: pair[0].cost)
    return numbers(best.x), between
