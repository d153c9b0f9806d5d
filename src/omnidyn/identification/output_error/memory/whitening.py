"""A fit made anew for errors with a memory: its point, and how far it can be trusted.

The errors of each output are an autoregression (autoregression.py), fitted to the residuals in turn with the numbers of
the robot. With e = y - f the errors and J C J' what a fit with covariance C has taken out of the residuals r,

    E[e e' | r] = r r' + J C J'

so that the sums from which the memory is found are those of r and of the columns of J C^1/2 together. That settles
where the restricted likelihood is largest: its memory is not too short because the fit has swallowed slow errors
(D. A. Harville, J. Am. Stat. Assoc. 72, 320 (1977)).

Simulations are dear and memories are not: between two simulations memory and numbers settle in turn on rows that are
taken as straight, by the residuals and slopes of the last one. Far from the end, simulations are coarse: `near`.

The covariance is (J~' J~ / s^2)^-1, ~ the filtered rows, and as much wider or narrower as the change of the score
between the ends of the intervals says: of slow errors only what is fast counts, and there a robot that stops or sets
off a row earlier bends the likelihood. Observed information is the better one: B. Efron, D. V. Hinkley, Biometrika 65,
457 (1978).

How well a variance V is known follows from how well the memory is: by the derivatives of V with respect to phi and s,
whose own covariance is that of maximum likelihood, Student's t has 2 V^2/var V degrees of freedom (Satterthwaite's, as
in M. G. Kenward, J. H. Roger, Biometrics 53, 983 (1997)).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.compiled.parallel import side_by_side
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.memory.autoregression import AutoRegression, autoregression
from omnidyn.identification.output_error.memory.common_errors import widening
from omnidyn.identification.output_error.memory.innovations import without_gaps
from omnidyn.identification.output_error.memory.whitened import (
    known_rows,
    moving_rows,
    near,
    spacing,
    tangent_at,
    whitened_engine,
)
from omnidyn.identification.output_error.problem.problem import Column, Parts, Piece, Point, Problem
from omnidyn.identification.output_error.solve.normal_equations import of_states
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver
from omnidyn.identification.output_error.trust.uncertainty import AUTOREGRESSIVE, SANDWICH, WHITE, Trust, trust
from omnidyn.progress import Progress, Report, silent
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import t_quantile

ROUNDS, TURNS = 6, 20  # of simulations; of memory and numbers in turn between them
FEW_STEPS = 4  # of one: what the next memory moves is near
NEARBY_ERRORS = (
    10.0  # standard errors: after a round that has moved a number further, the next one is no last one either
)
# Squared distance to the best point, in standard errors, at which a round ends: far from the last one, and near it.
EARLY_PRECISION, LATE_PRECISION = 1.0, 1e-2
SETTLED_ERRORS = 0.1  # standard errors: a round that moves no number further is the last one
LARGEST = 20_000_000  # slopes that are held at once; a log with more keeps the sandwich
ONE_RATE = 1.1  # greatest over least time between the rows of a column, beyond which rows are no measure of memory
UNEVEN = 0.05  # share of rows off an even grid that is worth a word
BEND_SHARE = 0.25  # of the information expected: less, or four times as much, is a bend that no parabola tells
COARSE_TICK = 0.3  # of a tick: errors of a counted angle that pass what rounding has, 1/sqrt(12), spread it evenly
FEW_MEMORIES = 10.0  # memories in a log, below which the memory itself is hardly known


@dataclass(frozen=True, eq=False)
class Weighed:
    """A point and how far it can be trusted.

    solution: of filtered rows where errors are autocorrelated. plain_solution: the same point with residuals as they
    are. uncertainty: the trust in `solution`. models: the memory of each column, none where rows are not filtered.
    warnings: what a reader must know of that.
    """

    solution: Solution
    plain_solution: Solution
    uncertainty: Trust
    models: Mapping[Column, AutoRegression] = field(default_factory=dict)
    warnings: tuple[Statement, ...] = ()


def why_not(solution: Solution) -> str:
    """Why errors with a memory cannot be modelled here, in words; "" where they can."""
    solver, problem = solution.solver, solution.solver.problem
    if solver.nu:
        return "Student's t has no autoregression here"
    if (solution.state.variance < (COARSE_TICK * solver.tick) ** 2).any():
        return "counts whose rounding is the noise have no autoregression here"
    slopes = sum(
        (p.last - p.first + 1) * len(p.record.columns) * (len(problem.parameters) + len(p.free)) for p in problem.pieces
    )
    if slopes > LARGEST:
        return "the logs are too long for an autoregression"
    for column in problem.columns:
        least_time, greatest_time, _ = spacing(problem.pieces, column)
        if greatest_time > ONE_RATE * least_time:
            return f"the logs have {column[0]} at several rates"
    return ""


def whitened(solution: Solution, uncertainty_before: Trust, progress: Progress = silent) -> Weighed | None:
    """The fit anew with autocorrelated errors; None where they are white, or where no memory makes them white.

    solution, uncertainty_before: the fit by residuals as they are, and the trust in it.
    """
    if solution.solver.tick.any():
        solution = _as_readings(solution)
    solver, models = solution.solver, _memory(solution, None)
    if not any(model.order for model in models.values()):
        return None
    point, movement, blocked_parameters = solution.state.point, np.inf, None
    for iteration in range(ROUNDS):
        progress(Report(f"errors with a memory, round {iteration + 1}"))
        models, is_far = _straight(solver, point, models), movement > NEARBY_ERRORS
        engine = near(solver.engine.unfiltered, point) if is_far else solver.engine.unfiltered
        precision = LATE_PRECISION if engine is solver.engine.unfiltered else EARLY_PRECISION
        new_solution = _filtered(solver, engine, models, precision).minimise(
            point, FEW_STEPS, blocked_parameters=None if is_far else blocked_parameters
        )
        movement, point, blocked_parameters = (
            _moved(new_solution, point),
            new_solution.state.point,
            new_solution.blocked_parameters,
        )
        models = _memory(new_solution, _inverse(Normal(new_solution.solver, new_solution.state).information))
        if not is_far and movement <= SETTLED_ERRORS:
            break
    filtered_solver = _filtered(solver, solver.engine.unfiltered, models, solver.close)
    new_solution = replace(filtered_solver.minimise(point, blocked_parameters=blocked_parameters), notes=solution.notes)
    remaining_uncertainty = trust(filtered_solver, new_solution)
    if remaining_uncertainty.kind == SANDWICH and solver.counted:
        return None
    # Rounding of a slow wheel is never white, so counts may end here. Without a memory their errors, which are sums of
    # all that came before, would have intervals many times too narrow.
    uncertainty = (
        remaining_uncertainty
        if remaining_uncertainty.kind == SANDWICH
        else _trusted(new_solution, uncertainty_before, models)
    )
    plain_solution = replace(new_solution, state=solver.state(new_solution.state.point), solver=solver)
    return Weighed(
        new_solution, plain_solution, uncertainty, models, tuple(_statements(new_solution, models, uncertainty))
    )


def _straight(
    solver: Solver[Problem], start: Point, models: Mapping[Column, AutoRegression]
) -> Mapping[Column, AutoRegression]:
    """The memory that rows straight near a point settle at, memory and numbers in turn: nothing is simulated for it."""
    (tangent, moves), point = tangent_at(solver.engine.unfiltered, start), start
    for _ in range(TURNS):
        new_solution = _filtered(solver, tangent, models, solver.close, moves).minimise(point, FEW_STEPS)
        models = _memory(new_solution, _inverse(Normal(new_solution.solver, new_solution.state).information), moves)
        movement, point = _moved(new_solution, point), new_solution.state.point
        if movement <= SETTLED_ERRORS:
            break
    return models


def _filtered(
    solver: Solver[Problem],
    engine: FitEngine[Problem],
    models: Mapping[Column, AutoRegression],
    precision: float,
    moves: Sequence[BoolArray] | None = None,
) -> Solver[Problem]:
    """The solver for errors of these memories, which ends `precision` to the best point."""
    return Solver(solver.problem, whitened_engine(engine, models, moves), 0.0, precision, solver.counted)


def _moved(new_solution: Solution, point_before: Point) -> float:
    """How far a fit has moved the number that it has moved furthest, in standard errors."""
    std = np.sqrt(np.maximum(np.diag(_inverse(Normal(new_solution.solver, new_solution.state).information)), 0.0))
    movements = np.abs(
        new_solution.solver.inner(new_solution.state.point.values) - new_solution.solver.inner(point_before.values)
    )
    return float((movements[std > 0.0] / std[std > 0.0]).max(initial=0.0))


def _as_readings(solution: Solution) -> Solution:
    """The same point, its counts like any other output: rounding is a small part of autocorrelated errors."""
    solver = solution.solver
    solver = Solver(solver.problem, solver.engine.unfiltered, 0.0, solver.close, counts_ticks=False)
    return replace(solution, state=solver.state(solution.state.point), solver=solver)


def _memory(
    solution: Solution, covariance: FloatArray | None, moves: Sequence[BoolArray] | None = None
) -> dict[Column, AutoRegression]:
    """The memory of the residuals of each column, and of what the fit has taken out of them.

    covariance (P, P): of the parameters; None for a fit whose residuals are taken as they are. moves: of each piece
    (C, rows), where the rows do not tell themselves.
    """
    solver = solution.solver
    series: dict[Column, list[FloatArray]] = {column: [] for column in solver.problem.columns}
    moving: dict[Column, list[BoolArray]] = {column: [] for column in solver.problem.columns}
    roots_by_piece = None if covariance is None else _roots(_of_pieces(solution, covariance))
    for k, parts in enumerate(solver.engine.unfiltered.residuals(solution.state.point)):
        piece = solver.problem.pieces[k]
        masks = moving_rows(piece, parts[0]) if moves is None else moves[k]
        for column, rows, residual, slopes, steps in _columns(piece, parts):
            removed_list = [] if roots_by_piece is None else [slopes @ roots_by_piece[k][parts[2]]]
            series[column] += without_gaps(np.column_stack([residual, *removed_list]), steps)
            moving[column] += without_gaps(masks[piece.record.columns.index(column), rows], steps)
    return {
        column: autoregression(stretches, moves=moving[column]) for column, stretches in series.items() if stretches
    }


def _columns(piece: Piece, parts: Parts) -> Iterator[tuple[Column, IntArray, FloatArray, FloatArray, IntArray]]:
    """(column, rows (n,), residuals (n,), slopes (n, U), steps (n,)) of the known rows of every column of a piece."""
    residual, slopes, _ = parts
    for c, column in enumerate(piece.record.columns):
        rows, steps = known_rows(piece, residual[c], slopes[c])
        if rows.size:
            yield column, rows, residual[c, rows], slopes[c, rows], steps


def _of_pieces(solution: Solution, covariance: FloatArray) -> list[FloatArray]:
    """Covariance of the parameters and the states of every piece, in the units of its slopes. (P + S, P + S) each."""
    normal, count, arrays = Normal(solution.solver, solution.state), len(covariance), []
    for sums, (_, info) in zip(solution.state.sums, normal.pieces, strict=True):
        full = np.zeros((sums.grad.shape[1], sums.grad.shape[1]))
        full[:count, :count] = covariance
        if len(info) > count:
            lift = -of_states(info[count:, count:], info[count:, :count])
            full[count:, :count] = lift @ covariance
            full[:count, count:] = full[count:, :count].T
            full[count:, count:] = (
                of_states(info[count:, count:], np.eye(len(info) - count)) + lift @ covariance @ lift.T
            )
        size = np.concatenate([normal.scale, np.ones(len(full) - count)])
        arrays.append(full * np.outer(size, size))
    return arrays


def _inverse(information: FloatArray) -> FloatArray:
    """Inverse in balanced units, 0 for what is not seen. Shape (P, P)."""
    size = np.sqrt(np.maximum(information.diagonal(), 0.0))
    size[size == 0.0] = 1.0
    return np.linalg.pinv(information / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(size, size)


def _roots(covariances: Sequence[FloatArray]) -> list[FloatArray]:
    """The roots of several, of as many columns each: a piece whose start is seen has more that are open."""
    roots = [_root(covariance) for covariance in covariances]
    most_columns = max((root.shape[1] for root in roots), default=0)
    return [np.pad(root, ((0, 0), (0, most_columns - root.shape[1]))) for root in roots]


def _root(covariance: FloatArray) -> FloatArray:
    """R with R R' the covariance, without what is not open."""
    values, vectors = np.linalg.eigh(covariance)
    kept_values = values > 1e-14 * max(float(values.max(initial=0.0)), 1e-300)
    return vectors[:, kept_values] * np.sqrt(values[kept_values])


def _trusted(new_solution: Solution, uncertainty_before: Trust, models: Mapping[Column, AutoRegression]) -> Trust:
    """The trust in a fit by filtered rows. uncertainty_before: in the one by residuals as they are."""
    solver = new_solution.solver
    uncertainty = trust(solver, new_solution, WHITE)
    degrees = _degrees(new_solution, uncertainty, models)
    filtered_parts = whitened_engine(solver.engine.unfiltered, models).residuals(new_solution.state.point)
    widening_factors = widening(
        solver.problem,
        filtered_parts,
        new_solution.state.variance,
        _of_pieces(new_solution, uncertainty.plain_covariance),
    )
    uncertainty = replace(
        uncertainty, covariance=_observed(new_solution, uncertainty) * np.outer(widening_factors, widening_factors)
    )
    compared_numbers = ~uncertainty.open & ~uncertainty_before.open
    plain_std = np.sqrt(np.diag(uncertainty_before.plain_covariance))
    ratio = uncertainty.std[compared_numbers] / np.where(
        plain_std[compared_numbers] > 0.0, plain_std[compared_numbers], 1.0
    )
    return replace(
        uncertainty,
        kind=AUTOREGRESSIVE,
        degrees=int(degrees),
        quantile=t_quantile(degrees),
        neighbours=uncertainty_before.neighbours,
        widening=float(ratio.max(initial=0.0)) or 1.0,
    )


def _observed(new_solution: Solution, uncertainty: Trust) -> FloatArray:
    """The covariance by the information that is observed: how much the score changes between the ends of intervals.

    Shape (P, P). Where a number is not told or stands at a bound, nothing leads to the ends: it stays as expected.
    """
    solver, point = new_solution.solver, new_solution.state.point
    if (uncertainty.open | uncertainty.held_parameters | ~(uncertainty.std > 0.0)).any():
        return uncertainty.covariance
    axes = _root(uncertainty.covariance / np.outer(uncertainty.std, uncertainty.std)) * uncertainty.std[:, None]
    inner_values = solver.inner(point.values)

    def gradient(end: FloatArray) -> FloatArray:
        return Normal(solver, solver.state(Point(solver.outer(end), point.states))).gradient

    ends = [
        solver.clipped(inner_values + side * uncertainty.quantile * half_axis)
        for half_axis in axes.T
        for side in (1.0, -1.0)
    ]
    gradients = np.array(side_by_side(gradient, ends))
    end_distances = np.linalg.norm(np.array(ends[0::2]) - np.array(ends[1::2]), axis=1) / np.linalg.norm(axes, axis=0)
    curvature = (gradients[1::2] - gradients[0::2]) @ axes / end_distances[:, None]
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    scaled_axes = (axes @ vectors) / np.sqrt(np.clip(values, BEND_SHARE, 1.0 / BEND_SHARE))
    return scaled_axes @ scaled_axes.T


def _degrees(new_solution: Solution, uncertainty: Trust, models: Mapping[Column, AutoRegression]) -> float:
    """Degrees of freedom of the least known variance among those that the logs tell."""
    open_numbers = ~uncertainty.open
    if not open_numbers.any():
        return float(max(uncertainty.degrees, 1))
    solver = new_solution.solver
    memory_slopes = {column: np.zeros((1 + model.order, int(open_numbers.sum()))) for column, model in models.items()}
    of_pieces = _of_pieces(new_solution, uncertainty.plain_covariance)
    scale = Normal(solver, new_solution.state).scale[open_numbers]
    pieces = zip(
        solver.problem.pieces, solver.engine.unfiltered.residuals(new_solution.state.point), of_pieces, strict=True
    )
    for piece, parts, covariance in pieces:
        ways = covariance[:, : len(open_numbers)][:, open_numbers] / scale
        moves = moving_rows(piece, parts[0])
        for column, rows, _, slopes, steps in _columns(piece, parts):
            if column not in models:
                continue
            column_ways = slopes @ ways[parts[2]]
            new = models[column].new(column_ways, steps, moves[piece.record.columns.index(column), rows])
            memory_slopes[column] += models[column].leaning(column_ways, new, steps)
    variance, scatter = np.diag(uncertainty.plain_covariance)[open_numbers], np.zeros(int(open_numbers.sum()))
    for column, model in models.items():
        scatter += model.scatter(
            memory_slopes[column] / new_solution.state.variance[solver.problem.columns.index(column)]
        )
    degrees = 2.0 * variance**2 / np.maximum(scatter, np.maximum(1e-12 * variance**2, 1e-300))
    return float(np.clip(degrees.min(), 3.0, max(uncertainty.degrees, 3)))


def _statements(
    new_solution: Solution, models: Mapping[Column, AutoRegression], uncertainty: Trust
) -> Iterator[Statement]:
    """What a reader should know of the memory: what it is, logs too short for it, stamps that are not even."""
    pieces = new_solution.solver.problem.pieces
    orders = sorted({model.order for model in models.values() if model.slopes is None})
    is_moving = {model.moving is not None for model in models.values() if model.slopes is not None}
    longest = max(models, key=lambda column: models[column].memory)
    model, lasts = models[longest], models[longest].memory * spacing(pieces, longest)[0]
    numbers = {
        "neighbours": np.abs(uncertainty.neighbours).max(),
        "orders": (orders[0], orders[-1]) if orders else None,
        "beside_white": ("moving" if is_moving == {True} else "all") if is_moving else "",
        "memory": lasts,
        "widening": uncertainty.widening,
    }
    yield Statement("autocorrelated_noise", NOTE, numbers=numbers)
    if model.rows < FEW_MEMORIES * model.memory:
        numbers = {"memory": lasts, "times": model.rows / model.memory, "enough": FEW_MEMORIES * lasts}
        yield Statement("short_for_memory", WARNING, f"{longest[0]}[{longest[1]}]", numbers)
    uneven = max(spacing(pieces, column)[2] for column in models)
    if uneven > UNEVEN:
        yield Statement("uneven_rows", NOTE, numbers={"share": uneven})
