"""Whether a nuisance that is on by default earns its place: blocks of the log that were not fitted tell.

A likelihood takes what is left over for noise. Where the model misses a stretch of the log (clocks apart for a while, a
wheel that was held), a latency or a dead band soaks some of that up, the likelihood is sure of it, and the friction of
all the rest goes with it. What is true of the log shows in blocks that were left out of the fit, too; what soaks up a
stretch makes them worse. So each of which the likelihood is sure is asked for there, worst first: in rows made white,
one linear step from the fit to all, as in ladder/held_out.py.

In doubt a nuisance stays: one that is there and not fitted moves friction by 10 to 40 %, past every interval, and one
that is fitted and not there costs what the intervals say. It must go where leaving it out lowers the error of those
blocks by more than its standard error. A gain always stays: a supply that is only nominal is in the intervals by it.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.linear.rows import SAME, Linear, Rows, lengths, noise_models, with_priors
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Problem, bounded
from omnidyn.identification.output_error.solve.solver import Normal, Solution
from omnidyn.model.actuation import DEAD_BAND

BLOCKS = 10  # of the log, each held out once
SURE = 10.8  # what a likelihood that is sure of a nuisance gains by it: 2 F, by chance once in a thousand logs


class Blocks:
    """Scalar products of [e, J, Z] in blocks of rows. matrix (B, n, n); shows (n,): which columns are not all 0."""

    def __init__(self, linear: Linear, *shown: Sequence[FloatArray]):
        number = self.numbers(linear)
        self.count, self.rows = len(linear.rows.problem.parameters), len(number)
        self.block = [np.flatnonzero(number == b) for b in range(BLOCKS)]
        # Priors are held out of no block.
        self.total: FloatArray = with_priors(linear, sum(each[0].shape[2] for each in shown))
        self.matrix: FloatArray = np.zeros((BLOCKS, *self.total.shape))
        first = 0
        for k in range(len(linear.rows.pieces)):
            every = linear.beside(k, [each[k] for each in shown])
            block = number[first : (first := first + len(every))]
            for b in np.unique(block).tolist():
                own = every[block == b]
                self.matrix[b] += own.T @ own
        self.total += self.matrix.sum(axis=0)
        self.shows, self.size = np.diag(self.total) > 0.0, lengths(self.total)
        self.matrix /= np.outer(self.size, self.size)
        self.total /= np.outer(self.size, self.size)

    def of(self, matrix: FloatArray, total: FloatArray) -> Blocks:
        """Blocks with other scalar products, of the same rows."""
        other = copy.copy(self)
        other.matrix, other.total = matrix, total
        return other

    @staticmethod
    def numbers(linear: Linear) -> IntArray:
        """The block of each row, by its time: blocks are whole stretches of time. -1 of priors, which are in all."""
        when, pieces = [], linear.rows
        whole = sum(r.shape[1] for r in pieces.residual)
        seen = 0
        for k, there in enumerate(pieces.there):
            parts = [seen + np.flatnonzero(own) for own in there]
            own = np.concatenate(parts) if parts else np.zeros(0, int)
            when.append(np.concatenate([own, np.full(linear.length(k) - len(own), seen)]))
            seen += there.shape[1]
        at = np.concatenate(when)
        number = np.minimum(at * BLOCKS // max(whole, 1), BLOCKS - 1)
        return np.concatenate([number, np.full(len(pieces.problem.parameters), -1)])

    def fitted(self, matrix: FloatArray, at: IntArray) -> FloatArray:
        """What the columns `at` are fitted by."""
        values, vectors = np.linalg.eigh(matrix[np.ix_(at, at)])
        kept = values > SAME * values[-1]
        return vectors[:, kept] @ ((vectors[:, kept].T @ matrix[at, 0]) / values[kept])

    def left(self, at: IntArray) -> float:
        """The sum of squares that is left with these columns."""
        by = self.fitted(self.total, at)
        return float(self.total[0, 0] - by @ self.total[at, 0])

    def held_out(self, at: IntArray) -> FloatArray:
        """The squared error of each block by a fit to all others. Shape (B,)."""
        found = []
        for own in self.matrix:
            by = self.fitted(self.total - own, at)
            found.append(own[0, 0] - 2.0 * by @ own[at, 0] + by @ own[np.ix_(at, at)] @ by)
        return np.array(found)

    def predicted(self, at: IntArray) -> FloatArray:
        """The same, by whatever is known of it beyond a linear step."""
        return self.held_out(at)


def rejected_nuisances(solution: Solution) -> tuple[str, ...]:
    """The names of the latencies and the dead band that a fit is sure of, and blocks beside it are better without."""
    steps = _steps(solution)
    if not steps:
        return ()
    blocks, problem = _blocks(solution), solution.solver.problem
    at = 1 + np.flatnonzero(~solution.held)
    lost: list[int] = []
    while steps:
        found = {j: _harm(blocks, at, j, step) for j, step in steps.items()}
        worst = max(found, key=lambda j: found[j])
        if found[worst] <= 1.0:
            break
        blocks, at = _without(blocks, worst, steps.pop(worst)), at[at != 1 + worst]
        lost.append(worst)
    return tuple(problem.parameters[j].name for j in lost)


def _steps(solution: Solution) -> dict[int, float]:
    """Which nuisances the likelihood is sure of, by their place, and the step to where they are not fitted."""
    normal, problem = Normal(solution.solver, solution.state), solution.solver.problem
    variance = np.diag(np.linalg.pinv(normal.information, hermitian=True))
    found = {}
    for j, p in enumerate(problem.parameters):
        step = p.inner(p.value) - float(normal.inner[j])
        if p.part in (LATENCY, DEAD_BAND) and not solution.held[j] and step**2 > SURE * variance[j] > 0.0:
            found[j] = step
    return found


def _blocks(solution: Solution) -> Blocks:
    """The fit in blocks of white rows."""
    whole = solution.solver.problem
    assert isinstance(whole, Problem)
    problem = bounded(whole)
    engine = solution.solver.engine.on(problem)
    rows = Rows.of(problem, solution.state.point, engine.residuals(solution.state.point))
    slopes = [np.where(solution.held, 0.0, slope) for slope in rows.slopes]  # what a bound holds, holds in every block
    linear = Linear(replace(rows, slopes=slopes), noise_models(rows, rows.residual))
    return Blocks(linear, [np.zeros((*residual.shape, 0)) for residual in rows.residual])


def _harm(blocks: Blocks, at: IntArray, j: int, step: float) -> float:
    """By how many standard errors the error of blocks that are left out is lower without number j."""
    change = blocks.held_out(at) - _without(blocks, j, step).held_out(at[at != 1 + j])
    return float(change.sum() / max(change.std(ddof=1) * np.sqrt(len(change)), 1e-300))


def _without(blocks: Blocks, j: int, step: float) -> Blocks:
    """The same blocks where number j has taken this step."""
    turn = np.eye(len(blocks.size))
    turn[1 + j, 0] = -step * blocks.size[1 + j]

    def moved(matrix: FloatArray) -> FloatArray:
        return turn.T @ matrix @ turn

    return blocks.of(np.array([moved(own) for own in blocks.matrix]), moved(blocks.total))
