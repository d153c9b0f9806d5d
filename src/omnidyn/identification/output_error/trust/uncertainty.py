"""How far a fit can be trusted: information, sandwich for coloured residuals, intervals, blind directions.

    white residuals      cov = (J' W J)^-1
    coloured residuals   cov = (J' W J)^-1 (sum over blocks of s s') (J' W J)^-1,   s the score of a block of rows

The blocks are longer than the residuals remember, so that the sandwich needs no model of their colour: it is consistent
under heteroskedasticity and autocorrelation, and its intervals take the quantile of Student's t for the number of
blocks that carry the information. Which of the two is used is decided by the residuals. Where there are many runs,
each is one block: a floor or a battery that differs from run to run is then in the intervals too (Liang, Zeger,
Biometrika 73 (1986); n/(n - 1) for n runs).

Counts without noise are neither: their covariance is that of rounding, and more only where the sandwich says so
beyond chance. No variance is below the plain one, of a number or of what several do together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.kernel.march_sums import FINAL
from omnidyn.identification.output_error.problem.problem import PieceSums, Problem, per_column
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.trust.blind_directions import Way, blind_ways
from omnidyn.identification.output_error.trust.rounding_scatter import rounding_scatter, silent
from omnidyn.statistics import t_quantile

BLOCKS, LEAST_BLOCK = 100, 8  # blocks in all; rows of one, at least
MANY_RUNS = 20  # from so many on each run is a block
COLOUR_ERRORS = 4.0  # standard errors of a correlation of neighbours, and of a variance ratio
BLIND_EIGENVALUE = 1e-9  # eigenvalue of the information, its diagonal scaled to 1, below which a direction is not seen
LOST_STD = 3.0  # std of a logarithm beyond which a number is not told: 95 % of it lie between 1/360 and 360 times
WEAK_EIGENVALUE = 1e-4  # below it, is hardly seen
SHARE = 0.05  # of a blind direction that a parameter must have to be named
WIDENING_RATIO = 1.05  # times as wide, below which it is not worth a word
WHITE, SANDWICH, AUTOREGRESSIVE = "white", "sandwich", "autoregressive"
# Std over that of the prior from which on the logs say too little of a number. Of two guesses of which only the product
# shows each keeps 0.71 of its own, of three 0.82, however long the log.
PRIOR_SHARE = 0.5
# The same where more than half of the variance is what priors, of any number, leave open: the logs must then have said
# most of it. Viscous friction beside the back-EMF of motors that are guesses keeps 0.3 to 0.7; Coulomb friction beside
# rotors that may weigh 0.1 of the robot keeps 0.08 to 0.15, which its interval tells.
OTHERS_SHARE, MOST_SHARE = 0.25, 0.5
PRECISION = 1e-14  # of the largest eigenvalue of a matrix whose diagonal is 1: below it there is only rounding
RISE = float(chdtri(1, 0.05))  # of 2 F at the ends of a 95 % interval: 3.84


@dataclass(frozen=True, eq=False)
class Trust:
    """Covariance of the parameters in the numbers that the solver sees, and what is behind it.

    covariance (P, P): infinite variances where the data are blind. held_parameters: at a bound. blind_parameters: not
    determined by the data, alone or only together with others, and no prior holds it; unseen: not even together, prior
    or none. guessed_parameters: what a prior holds more than the data do, see PRIOR_SHARE; its covariance is the
    posterior's. free_step (P,): from a bound to where the fit would go without it. kind: white, sandwich or
    autoregressive (memory/whitening.py). widening: largest ratio of the std to that for white residuals. quantile:
    standard errors in half a 95 % interval. degrees: of freedom behind it. neighbours (columns,): correlation of
    successive residuals. directions: blind or weak ones no prior
    holds: (eigenvalue, relative change of each parameter). runs: that were the blocks, 0 where these were shorter than
    a run. plain_covariance (P, P): inverse of the information, which is what the likelihood itself curves by; the
    covariance where the noise is white. ways: what the rows do not tell, priors or none (cures.py).
    """

    covariance: FloatArray
    held_parameters: BoolArray
    blind_parameters: BoolArray
    unseen: BoolArray
    free_step: FloatArray
    kind: str
    widening: float
    quantile: float
    degrees: int
    neighbours: FloatArray
    directions: tuple[tuple[float, FloatArray], ...]
    runs: int
    plain_covariance: FloatArray
    guessed_parameters: BoolArray
    ways: tuple[Way, ...] = ()

    @property
    def open(self) -> BoolArray:
        """What the data do not determine, whether a prior holds it or not."""
        return self.blind_parameters | self.guessed_parameters

    @cached_property
    def std(self) -> FloatArray:
        return np.sqrt(np.diag(self.covariance))

    def beside(self, shifts: FloatArray) -> Trust:
        """The same beside numbers that are only known so far: what a std of each moves the parameters by, (P, K)."""
        return replace(self, covariance=self.covariance + shifts @ shifts.T)

    def rise(self, direction: FloatArray) -> float:
        """2 (F - least F) at the ends of a 95 % interval of the sum of way (P,) times the parameters.

        3.84 where noise is white. Elsewhere the likelihood is too steep, and as much more of it as the variance is
        larger than its curvature tells: Kent, Biometrika 69 (1982); Royall, Tsou, J. R. Stat. Soc. B 65 (2003).
        """
        slope_square = float(direction @ self.plain_covariance @ direction)
        if self.kind == WHITE or slope_square <= 0.0:
            return RISE
        finite_covariance = np.where(np.isfinite(self.covariance), self.covariance, 0.0)
        return self.quantile**2 * float(direction @ finite_covariance @ direction) / slope_square


def trust(solver: Solver, solution: Solution, kind: str = "auto") -> Trust:
    """The covariance at a solution; `kind`: "white", "sandwich" or "auto"."""
    has_ticks = bool(solver.tick.any())
    sums = solver.engine.sums(solution.state.point, final_weighting(solver, solution.state.variance))
    normal = Normal(solver, State(solution.state.point, sums, solution.state.objective, solution.state.variance))
    relative = relative_changes(solver, solution)
    seen_numbers, directions, lost = _seen(normal.information, relative, normal.prior_information)
    root = _root_of_inverse(normal.information, lost)
    plain_covariance = root @ root.T
    runs = _runs(solver, sums)
    count = len(runs) if len(runs) >= MANY_RUNS else 0
    scores = normal.scores()
    if count:
        scores = np.array([scores[run].sum(axis=0) for run in runs]) * np.sqrt(count / (count - 1.0))
    influence = scores @ plain_covariance  # what each block moves each parameter by
    is_coloured, neighbours = _coloured(solver, sums, runs if count else None)
    if kind == "auto":  # a loss that is not the likelihood of the noise says nothing by its curvature alone
        kind = (
            SANDWICH if is_coloured or solver.nu or has_ticks else WHITE
        )  # nor does an encoder at rest, which repeats
    guessed_numbers = seen_numbers & _guessed(plain_covariance, normal.prior_information)
    told_numbers = seen_numbers & ~guessed_numbers
    independent = _degrees(influence, told_numbers)
    degrees = independent if kind == SANDWICH else _rows(solver, sums) - int(seen_numbers.sum())
    if len(influence) <= len(plain_covariance):
        kind, degrees = WHITE, _rows(solver, sums) - int(seen_numbers.sum())
    least_covariance, score_columns = _least(solver, solution, root), scores @ root
    exact = not solver.nu and silent(solver, solution).any()  # what is more, and no chance, is an error of the model
    scatter_limit = (1.0 + np.sqrt(len(least_covariance) / independent)) ** 2 if exact else 1.0
    wide_covariance = _at_least(
        score_columns.T @ score_columns + (root.T * normal.prior_information) @ root,
        least_covariance,
        float(scatter_limit),
    )
    covariance, wide_covariance = (
        root @ middle @ root.T
        for middle in (wide_covariance if kind == SANDWICH else least_covariance, wide_covariance)
    )
    widening = float(np.sqrt(_ratio(np.diag(wide_covariance), np.diag(plain_covariance), told_numbers)))
    logs = np.array([p.log for p in solver.problem.parameters], bool)
    seen_numbers = seen_numbers & ~(logs & (np.sqrt(np.diag(covariance)) > LOST_STD))
    covariance[~seen_numbers, ~seen_numbers] = np.inf
    return Trust(
        covariance,
        normal.held,
        ~seen_numbers,
        _unseen(normal),
        _free_step(plain_covariance, normal),
        kind,
        widening,
        t_quantile(degrees if degrees > 0 else np.inf),
        max(int(degrees), 0),
        neighbours,
        directions,
        count if kind == SANDWICH else 0,
        plain_covariance,
        guessed_numbers,
        blind_ways(solver.problem, solution.state.point.values, normal.information - np.diag(normal.prior_information)),
    )


def _unseen(normal: Normal) -> BoolArray:
    """What the outputs do not change with at all."""
    return np.diag(normal.information) - normal.prior_information <= 0.0


def _guessed(plain_covariance: FloatArray, prior: FloatArray) -> BoolArray:
    """Which numbers priors hold more than the data do. plain_covariance (P, P): of the posterior; prior (P,):
    information.

    The posterior C = (D + P)^-1 of data D and priors P is C D C + C P C: what noise and what priors leave open.
    """
    variance = np.diag(plain_covariance)
    prior_shares = np.sqrt(variance * prior)  # std over that of its own prior, 0 without one
    by_priors = np.einsum("ij,j,ij->i", plain_covariance, prior, plain_covariance) > MOST_SHARE * variance
    return (prior_shares > PRIOR_SHARE) | ((prior_shares > OTHERS_SHARE) & by_priors)


def final_weighting(solver: Solver, variance: FloatArray) -> Weighting:
    """A march that keeps the score of each block of rows. variance (columns,)."""
    rows = sum(piece.last - piece.first + 1 for piece in solver.problem.pieces)
    block = max(LEAST_BLOCK, -(-rows // BLOCKS))
    return Weighting(variance, solver.nu, FINAL, block, bool(solver.tick.any()))


def _rows(solver: Solver, sums: list[PieceSums]) -> int:
    return int(per_column(sums, len(solver.problem.columns), "number").sum())


def _runs(solver: Solver, sums: list[PieceSums]) -> list[NDArray[np.intp]]:
    """The blocks of each run."""
    record_of_block = [
        id(piece.record)
        for piece, piece_sums in zip(solver.problem.pieces, sums, strict=True)
        for _ in piece_sums.score
    ]
    names = np.array(record_of_block)
    return [np.flatnonzero(names == run) for run in dict.fromkeys(record_of_block)]


def _coloured(
    solver: Solver, sums: list[PieceSums], runs: list[NDArray[np.intp]] | None = None
) -> tuple[bool, FloatArray]:
    """Whether the residuals of any column remember: (verdict, correlation of neighbours of each column).

    runs: the blocks of each, where runs are the blocks.

    For white noise the correlation of neighbours is 0 +- 1/sqrt(n), and the squared sums over blocks add up to the sum
    of squares, +- sqrt(2/blocks) of it: the first sees fast colours, the second slow ones.
    """
    columns = len(solver.problem.columns)
    square = np.maximum(per_column(sums, columns, "square"), 1e-300)
    neighbours = per_column(sums, columns, "lag") / square
    drift = np.zeros((sum(len(piece.drift) for piece in sums), columns))
    first = 0
    for piece in sums:
        drift[first : first + len(piece.drift), piece.columns] = piece.drift
        first += len(piece.drift)
    if runs is not None:
        drift = np.array([drift[run].sum(axis=0) for run in runs])
    slow, blocks = (drift**2).sum(axis=0), (drift != 0.0).sum(axis=0)
    fast = np.abs(neighbours) * np.sqrt(np.maximum(per_column(sums, columns, "number"), 1.0)) > COLOUR_ERRORS
    return bool(
        (fast | (slow / square > 1.0 + COLOUR_ERRORS * np.sqrt(2.0 / np.maximum(blocks, 1.0)))).any()
    ), neighbours


def _degrees(influence: FloatArray, seen_numbers: BoolArray) -> float:
    """Degrees of freedom of a sum of squares over blocks of unlike weight (Satterthwaite), the least of all parameters.

    (sum of variances)^2 / (sum of their squares), the latter from fourth powers, which are 3 times as large.
    """
    seen_influence = influence[:, seen_numbers]
    second, fourth = (seen_influence**2).sum(axis=0), (seen_influence**4).sum(axis=0)
    if not seen_influence.size or not fourth.all():
        return float(len(influence))
    return float(np.clip((3.0 * second**2 / fourth).min(), 3.0, len(influence) - 1))


def relative_changes(solver: Solver, solution: Solution) -> FloatArray:
    """What a relative change of 1 is in the numbers that the solver sees. Shape (P,)."""
    pairs = zip(solver.problem.parameters, solution.state.point.values, strict=True)
    return np.array([1.0 if p.log else abs(float(value)) or 1.0 for p, value in pairs])


def _seen(
    information: FloatArray, relative: FloatArray, prior: FloatArray
) -> tuple[BoolArray, tuple[tuple[float, FloatArray], ...], FloatArray]:
    """Which parameters the data determine; the directions that they hardly do, in relative changes, largest 1; and
    those that they do not at all, with the diagonal of the information scaled to 1, shape (P, directions).

    A parameter is lost with a direction that moves it further than all that the data see leaves open. That its share
    of the direction is small says nothing: of a resistance, a torque constant and friction that only show together,
    1 % of the first two goes with 30 % of the third. What a prior holds, `prior` (P,) of the information, is not lost.
    """
    diagonal = np.diag(information)
    seen_numbers = diagonal > 0.0
    seen_indices = np.flatnonzero(
        seen_numbers
    )  # those at a bound too: what is lost with them is lost on the other side
    directions, lost = [], []
    if seen_indices.size:
        size = np.sqrt(diagonal[seen_indices])
        values, vectors = np.linalg.eigh(information[np.ix_(seen_indices, seen_indices)] / np.outer(size, size))
        open_variance = (vectors[:, values >= BLIND_EIGENVALUE] ** 2 / values[values >= BLIND_EIGENVALUE]).sum(axis=1)
        for value, vector in zip(values, vectors.T, strict=True):
            held_share = float(vector**2 @ (prior[seen_indices] / size**2))
            if value < WEAK_EIGENVALUE and not (held_share > 0.0 and held_share > 0.5 * value):
                direction = np.zeros(len(diagonal))
                direction[seen_indices] = vector / size / relative[seen_indices]
                direction /= np.abs(direction).max()
                directions.append((float(value), direction))
                if value < BLIND_EIGENVALUE:
                    lost.append(np.zeros(len(diagonal)))
                    lost[-1][seen_indices] = vector
                    seen_numbers[seen_indices[vector**2 / BLIND_EIGENVALUE > open_variance]] = False
    return seen_numbers, tuple(directions), np.array(lost).reshape(-1, len(diagonal)).T


def _root_of_inverse(information: FloatArray, lost: FloatArray) -> FloatArray:
    """R, shape (P, K): R R' is the inverse without the directions that are lost, (P, directions), the diagonal scaled
    to 1; rows are 0 where that is 0.

    What a lost direction does not move keeps the variance that it has beside all others, not the one that it would have
    if these were known. Covariances are compared as C of R C R': of numbers that are guesses and of which only the
    product shows the std of the product is a thousandth of theirs, and differences of such matrices say nothing of it.
    """
    seen_rows = np.diag(information) > 0.0
    size = np.sqrt(np.diag(information)[seen_rows])
    projector = np.eye(len(size)) - lost[seen_rows] @ lost[seen_rows].T
    values, vectors = np.linalg.eigh(
        projector @ (information[np.ix_(seen_rows, seen_rows)] / np.outer(size, size)) @ projector
    )
    kept_values = values > PRECISION * values.max(initial=0.0)
    root = np.zeros((len(information), int(kept_values.sum())))
    root[seen_rows] = projector @ (vectors[:, kept_values] / np.sqrt(values[kept_values])) / size[:, None]
    return root


def _ratio(wide_covariance: FloatArray, plain_covariance: FloatArray, seen_numbers: BoolArray) -> float:
    """The largest ratio of two variances among what is seen. Shapes (P,)."""
    if not seen_numbers.any():
        return 1.0
    return float((wide_covariance[seen_numbers] / np.maximum(plain_covariance[seen_numbers], 1e-300)).max())


def _least(solver: Solver, solution: Solution, root: FloatArray) -> FloatArray:
    """C of the least covariance R C R', (K, K): the plain one, or what rounding alone makes of counts without noise.

    root: R, (P, K).
    """
    if not silent(solver, solution).any():
        return np.eye(root.shape[1])
    information, scatter = (root.T @ scatter_matrix @ root for scatter_matrix in rounding_scatter(solver, solution))
    inverse = np.linalg.inv(information)
    variances, axes = _principal(inverse @ scatter @ inverse)
    return axes * variances @ axes.T


def _principal(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(variances (K,), axes (K, K)) of a covariance; a second of counts scatters one way alone, and rounding makes the
    others no less than 0."""
    variances, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.maximum(variances, PRECISION * variances.max(initial=0.0)), axes


def _at_least(wide_covariance: FloatArray, least_covariance: FloatArray, scatter_limit: float) -> FloatArray:
    """The sandwich, with no variance below `least_covariance`, of any sum of parameters: few blocks may also err to the
    good side.

    With least_covariance = L L' and wide_covariance = L (V diag(l) V') L': L (V diag(max(l, 1)) V') L', where l up to
    `scatter_limit` count as 1. To stretch the std of each parameter alone would not do: that of a product is all in
    their correlation.
    scatter_limit: where `least_covariance` is what the noise makes, the edge of the ratios that K numbers and n blocks
    show by chance, which is (1 + sqrt(K/n))^2 (Marchenko, Pastur, Math. USSR Sb. 1 (1967)); else 1. Shapes (K, K), see
    `_root_of_inverse`.
    """
    variances, axes = _principal(least_covariance)
    lower, inverse = axes * np.sqrt(variances), (axes / np.sqrt(variances)).T
    ratio, ways = np.linalg.eigh(inverse @ wide_covariance @ inverse.T)
    correction = lower @ ways * np.sqrt(np.where(ratio > scatter_limit, ratio - 1.0, 0.0).clip(0.0))
    return least_covariance + correction @ correction.T


def _free_step(plain_covariance: FloatArray, normal: Normal) -> FloatArray:
    """From where a bound holds a parameter to where the fit would be without the bound, to first order."""
    return np.where(normal.held, plain_covariance @ normal.gradient, 0.0)


# What the log alone leaves open, and what numbers of the file that are only known so far add to it
#
# A number that the file gives with a std is free in a fit, and its std a prior: the intervals of all others have in
# them
# what it may be off by. Were it exact, the covariance of the others would be
#
#     C_alone = C_aa - C_ab C_bb^-1 C_ba        b: what the file knows, a: the others


def given(problem: Problem) -> BoolArray:
    """Which parameters have a prior. Shape (P,)."""
    return np.array([p.prior is not None for p in problem.parameters], dtype=bool)


def from_the_log_alone(problem: Problem, uncertainty: Trust) -> Trust | None:
    """The trust in the others were all that the file knows exact; None where it knows nothing with a std."""
    finite = np.isfinite(np.diag(uncertainty.covariance))
    of_file = given(problem) & finite
    if not of_file.any():
        return None
    log_numbers = finite & ~of_file
    covariance = uncertainty.covariance.copy()
    cross_covariance = covariance[np.ix_(log_numbers, of_file)]
    file_information = np.linalg.pinv(covariance[np.ix_(of_file, of_file)], hermitian=True)
    log_covariance = (
        covariance[np.ix_(log_numbers, log_numbers)] - cross_covariance @ file_information @ cross_covariance.T
    )
    covariance[np.ix_(log_numbers, log_numbers)] = 0.5 * (log_covariance + log_covariance.T)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), 0.0))
    return replace(uncertainty, covariance=covariance)
