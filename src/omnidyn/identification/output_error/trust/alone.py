"""What the log alone leaves open, and what numbers of the file that are only known so far add to it.

A number that the file gives with a std is free in a fit, and its std a prior: the intervals of all others have in them
what it may be off by. Were it exact, the covariance of the others would be

    C_alone = C_aa - C_ab C_bb^-1 C_ba        b: what the file knows, a: the others
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omnidyn.arrays import BoolArray
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.uncertainty import Trust


def given(problem: Problem) -> BoolArray:
    """Which parameters have a prior. Shape (P,)."""
    return np.array([p.prior is not None for p in problem.parameters], dtype=bool)


def from_the_log_alone(problem: Problem, known: Trust) -> Trust | None:
    """The trust in the others were all that the file knows exact; None where it knows nothing with a std."""
    finite = np.isfinite(np.diag(known.covariance))
    of_file = given(problem) & finite
    if not of_file.any():
        return None
    own = finite & ~of_file
    covariance = known.covariance.copy()
    across = covariance[np.ix_(own, of_file)]
    told = np.linalg.pinv(covariance[np.ix_(of_file, of_file)], hermitian=True)
    left = covariance[np.ix_(own, own)] - across @ told @ across.T
    covariance[np.ix_(own, own)] = 0.5 * (left + left.T)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), 0.0))
    return replace(known, covariance=covariance)
