"""Heavy tails: a few wild samples that hold much of the squares of residuals, which normal noise does not."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.lack_of_fit import Wild
from omnidyn.identification.structure.misfit import Misfit
from omnidyn.statistics import robust_std

BEYOND = 5.0  # robust standard deviations: of normal noise one sample in two million is so far out
LEAST, HELD = 3, 0.1  # samples, and their share of the squares, from which they are worth a word


def wild_samples(seen: Misfit) -> dict[str, Wild]:
    """Output -> its wild samples, where there are some: in what is left beside all that residuals follow, made white.

    F. R. Hampel's rule with the median absolute deviation, J. Am. Stat. Assoc. 69, 383 (1974).
    """
    linear, rows = seen.linear, seen.linear.rows
    series: dict[int, list[np.ndarray]] = {}
    for k, columns in enumerate(rows.column):
        left = rows.residual[k] - seen.explained[k]
        for j, c in enumerate(columns):
            series.setdefault(c, []).append(linear.of_column(k, j, left[j][:, None])[:, 0])
    found = {}
    for c, pieces in series.items():
        new = np.concatenate(pieces)
        scale = float(robust_std(new, 0.0)) if new.size else 0.0
        out = np.abs(new) > BEYOND * scale
        held = float((new[out] ** 2).sum() / max((new**2).sum(), 1e-300))
        if scale > 0.0 and out.sum() >= LEAST and held > HELD:
            name, i = rows.problem.columns[c]
            found[f"{name}[{i}]"] = Wild(float(out.mean()), held)
    return found
