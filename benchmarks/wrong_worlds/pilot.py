"""python -m benchmarks.wrong_worlds.pilot [KIND...]: sizes that bias a number by 5.5 and by 20 standard errors.

Run once, on seeds of its own; what it prints stands in sizes.py. Bias: the largest, over the friction numbers, of the
difference that the wrong world makes to a fit of the same noise, over the standard error in the right world; its mean
over the seeds. Of a number known better than FLOOR that share of it counts as its standard error: 5.5 of those are more
than 3 %, which is what the benchmark minds.
"""

from __future__ import annotations

import sys
from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.wrong_worlds.kinds import KINDS, Kind, by_name
from benchmarks.wrong_worlds.log import Case, clean, logged, right_case, robot_of
from omnidyn.errors import OmnidynError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError

SEEDS = (10_000, 10_001, 10_002)
SMALL, LARGE = 5.5, 20.0
TRIES, CLOSE = 7, 0.15
FLOOR = 0.006


def fit(case: Case, seed: int, kind: Kind) -> Estimate:
    """What is asked of a wrong log: the friction, nuisances as by default."""
    options: dict[str, Any] = {"nuisances": ()} if kind.known else {}
    return identify(logged(case, seed), robot_of(case.told), OutputError(free=("friction",), **options)).estimate


@lru_cache(maxsize=64)
def _right(case: Case, seed: int, kind: Kind) -> Estimate:
    return fit(case, seed, kind)


def bias(kind: Kind, size: float) -> float:
    """In standard errors."""
    found = []
    for seed in SEEDS:
        case = kind.make(right_case(seed), size)
        right = _right(clean(case), seed, kind)
        try:
            wrong = fit(case, seed, kind)
        except OmnidynError:
            continue
        names = [name for name in right.value if np.isfinite(right.std[name]) and right.std[name] > 0.0]
        off = {name: abs(wrong.value[name] - right.value[name]) for name in names}
        found.append(max(off[name] / max(right.std[name], FLOOR * abs(right.value[name])) for name in names))
    return float(np.mean(found)) if found else float("inf")


def sized(kind: Kind, target: float, tried: list[tuple[float, float]]) -> tuple[float, float]:
    """(size, its bias) next to a target, between sizes tried, in powers of one another."""
    for _ in range(TRIES):
        best = min(tried, key=lambda each: abs(np.log(max(each[1], 0.1) / target)))
        if abs(np.log(max(best[1], 0.1) / target)) < CLOSE:
            break
        below = [each for each in tried if each[1] < target]
        above = [each for each in tried if each[1] >= target]
        if below and above:
            low, high = max(below), min(above)
            share = np.log(target / max(low[1], 0.1)) / np.log(min(high[1], 1e3) / max(low[1], 0.1))
            size = float(low[0] * (high[0] / low[0]) ** min(max(share, 0.1), 0.9))
        else:
            size = best[0] * min(max(target / max(best[1], 0.3), 0.1), 6.0)
        size = min(size, kind.most)
        if any(abs(size / each[0] - 1.0) < 1e-3 for each in tried):
            break
        tried.append((size, bias(kind, size)))
    return min(tried, key=lambda each: abs(np.log(max(each[1], 0.1) / target)))


def main() -> None:
    """As the command line says."""
    for kind in [by_name(name) for name in sys.argv[1:]] or KINDS:
        first = 0.1 * kind.most
        tried = [(first, bias(kind, first))]
        (small, at_small), (large, at_large) = sized(kind, SMALL, tried), sized(kind, LARGE, tried)
        print(f'    "{kind.name}": ({small:.3g}, {large:.3g}),  # {at_small:.1f}, {at_large:.1f}', flush=True)


if __name__ == "__main__":
    main()
