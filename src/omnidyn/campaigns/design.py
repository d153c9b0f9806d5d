"""Design: the numbers of each sample, from (seed, index of the sample) alone, so that shards may be cut anywhere.

Random draws are places of one stream (PCG64), Sobol points of one scrambled sequence (Owen; scipy.stats.qmc), a Latin
hypercube (McKay, Beckman, Conover, Technometrics 21 (1979)) is drawn whole, and a grid counts its last variable first.
[correlation] mixes points as normals. A number follows from its point u, 0 to 1: low + u (high - low),
low (high/low)^u, or mean + std Phi^-1(u).
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from omnidyn.arrays import FloatArray
from omnidyn.campaigns.spec import GRID, LATIN, LOG, RANDOM, Spec, Variable

INNERMOST = 2.0**-32  # how near to 0 and 1 a point of a normal may lie

Column = FloatArray | list[Any]


def sample_count(spec: Spec) -> int:
    """Samples of the campaign."""
    return math.prod(spec.levels) if spec.sampling == GRID else spec.samples or 0


def points(spec: Spec, start: int, stop: int) -> FloatArray:
    """Points of the samples start to stop, correlated as the spec says. Shape (stop - start, variables).

    u = Phi(L z), z = Phi^-1 of independent points, L L^T = the correlation (a Gaussian copula).
    """
    u = independent_points(spec, start, stop)
    if spec.correlation is None:
        return u
    values, vectors = np.linalg.eigh(spec.correlation.of(tuple(spec.vary)))
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T  # symmetric: no variable comes first
    z, mixed = ndtri(np.clip(u, INNERMOST, 1.0 - INNERMOST)), np.zeros_like(u)
    for column in range(u.shape[1]):  # summed in a fixed order: where shards are cut changes no bit
        mixed += z[:, column, None] * root[column]
    free = np.isclose(root.diagonal(), 1.0, atol=1e-12)  # what is correlated with nothing stays as it is
    return np.where(free, u, ndtr(mixed))


def independent_points(spec: Spec, start: int, stop: int) -> FloatArray:
    """Points of the samples start to stop in the unit cube, one column a variable. Shape (stop - start, variables)."""
    size = len(spec.vary)
    if not size:
        return np.empty((stop - start, 0))
    if spec.sampling == GRID:
        places = np.unravel_index(np.arange(start, stop), spec.levels)
        middles = [variable.values is not None for variable in spec.vary.values()]
        columns = zip(places, spec.levels, middles, strict=True)
        return np.stack([(k + 0.5) / n if middle else k / max(n - 1, 1) for k, n, middle in columns], axis=1)
    if spec.sampling == RANDOM:
        stream = np.random.PCG64(spec.seed).advance(start * size)
        return np.random.Generator(stream).random((stop - start, size))
    if spec.sampling == LATIN:
        return _latin(size, sample_count(spec), spec.seed)[start:stop]
    from scipy.stats import qmc  # imported lazily: slow to load

    sequence = qmc.Sobol(size, seed=np.random.default_rng(spec.seed))  # pyright: ignore[reportCallIssue]  rng from scipy 1.15 on
    with warnings.catch_warnings():  # of a count that is no power of two
        warnings.simplefilter("ignore", UserWarning)
        if start:
            sequence.fast_forward(start)
        return sequence.random(stop - start)


@lru_cache(maxsize=1)
def _latin(size: int, count: int, seed: int) -> FloatArray:
    from scipy.stats import qmc

    return qmc.LatinHypercube(size, seed=np.random.default_rng(seed)).random(count)  # pyright: ignore[reportCallIssue]


def numbers(variable: Variable, u: FloatArray, nominal: float = 0.0) -> Column:
    """What a variable is at points u, shape (n,). nominal: what the file says, for a std. Of a factor: the factor."""
    if variable.values is not None:
        last = len(variable.values) - 1
        chosen = [variable.values[min(int(place * (last + 1)), last)] for place in u.tolist()]
        plain = all(isinstance(value, int | float) and not isinstance(value, bool) for value in variable.values)
        return np.array(chosen) if plain else chosen
    if variable.std is not None:
        return nominal + variable.std * ndtri(np.clip(u, INNERMOST, 1.0 - INNERMOST))
    low, high = variable.ends or (0.0, 1.0)
    return low * (high / low) ** u if variable.scale == LOG else low + u * (high - low)


def seed_of(spec: Spec, index: int) -> int:
    """The seed of a sample: of the noise of its own."""
    return int(np.random.SeedSequence((spec.seed, index)).generate_state(1, np.uint64)[0] >> np.uint64(1))
