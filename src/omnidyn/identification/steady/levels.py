"""Levels of friction fitted to steady points, the paper's line or any other shape, and the Estimate that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.estimate import Correlation, Estimate, identified
from omnidyn.model.keys import with_priors
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior, Robot
from omnidyn.statistics import t_quantile


@dataclass(frozen=True, eq=False)
class FittedLevels:
    """Levels of friction, by their keys in a robot file.

    level: within level >= 0; free: without that bound. Shape (levels,). covariance: of `free`, shape (levels, levels).
    """

    keys: tuple[str, ...]
    level: FloatArray
    free: FloatArray
    covariance: FloatArray

    @property
    def degrees_of_freedom(self) -> int:
        """What was fitted to, minus levels."""
        raise NotImplementedError

    @property
    def quantile(self) -> float:
        """Standard errors in half a 95 % interval."""
        return t_quantile(self.degrees_of_freedom)

    @property
    def at_bound(self) -> BoolArray:
        """Which levels the bound holds at 0. Shape (levels,)."""
        return self.free < 0.0

    @property
    def std(self) -> FloatArray:
        """Standard error of each level without its bound: what the data alone say. Shape (levels,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> FloatArray:
        """Between the levels; 0 where nothing is uncertain. Shape (levels, levels)."""
        std = np.where(self.std > 0.0, self.std, 1.0)
        matrix = self.covariance / np.outer(std, std)
        np.fill_diagonal(matrix, 1.0)
        return matrix

    @property
    def ci95(self) -> FloatArray:
        """95 % intervals (low, high). Shape (levels, 2).

        free +- quantile * std. At a bound: from 0 to what the free fit would reach from 0, which covers every true
        value >= 0 that the interval of the free fit covers. Another level, moved by the bound, keeps the free interval,
        widened to hold its value.
        """
        half, bound = self.quantile * self.std, self.at_bound
        low, high = self.free - half, self.free + half
        low = np.where(bound, 0.0, np.minimum(low, self.level))
        return np.stack([low, np.where(bound, np.maximum(high, half), np.maximum(high, self.level))], axis=1)

    def intervals(self) -> dict[str, tuple[float, float]]:
        """The 95 % intervals by key."""
        return {key: (low, high) for key, (low, high) in zip(self.keys, self.ci95.tolist(), strict=True)}

    def by_key(self, values: FloatArray) -> dict[str, float]:
        """Numbers of the levels, shape (levels,), by key."""
        return dict(zip(self.keys, values.tolist(), strict=True))


def estimate_of(
    fits: Sequence[FittedLevels],
    robot: Robot,
    data: str,
    priors: Mapping[str, Prior] | None = None,
    **extra_fields: Any,
) -> Estimate:
    """The Estimate of levels that were fitted apart, which do not correlate.

    Args:
        fits: the levels.
        robot: with the friction that they make.
        data: what they were made from.
        priors: what else is known of the robot's numbers by these data.
        extra_fields: other fields of the Estimate.
    """
    keys = tuple(key for fit in fits for key in fit.keys)
    matrix, first = np.eye(len(keys)), 0
    for fit in fits:
        last = first + len(fit.keys)
        matrix[first:last, first:last] = fit.correlation
        first = last
    std = {key: value for fit in fits for key, value in fit.by_key(fit.std).items()}
    priors_by_key = {key: identified(value, f"steady state, {data}") for key, value in std.items()} | dict(priors or {})
    return Estimate(
        robot=with_correlation(with_priors(robot, priors_by_key), keys, matrix),
        value={key: value for fit in fits for key, value in fit.by_key(fit.level).items()},
        std=std,
        ci95={key: interval for fit in fits for key, interval in fit.intervals().items()},
        correlation=Correlation(keys, matrix),
        degrees_of_freedom={key: fit.degrees_of_freedom for fit in fits for key in fit.keys},
        at_bound=tuple(key for fit in fits for key, is_held in zip(fit.keys, fit.at_bound, strict=True) if is_held),
        data=data,
        **extra_fields,
    )
