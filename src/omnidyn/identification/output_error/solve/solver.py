"""Levenberg-Marquardt on the likelihood of whole logs, the states at the start of each piece eliminated.

Gauss: the noise of each column is concentrated out, F = 1/2 sum n_c log(sum of r^2 / n_c), so that one minimisation
finds parameters and noise together. Student's t: F = sum of rho + n_c log s_c, steps in the parameters and in the
scales s_c in turn. Counts (kernel/counts.py) are held like that too, beside the others. A prior adds
((z - mean)/std)^2 / 2, z the number or its logarithm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.engine import FitEngine, P, Weighting
from omnidyn.identification.output_error.kernel.counts import LEAST_SHARE, information
from omnidyn.identification.output_error.problem.problem import FitProblem, PieceSums, Point, per_column
from omnidyn.identification.output_error.solve.curvature import Bend
from omnidyn.identification.output_error.solve.latency_edges import Edges
from omnidyn.identification.output_error.solve.normal_equations import (
    SPEED_LIMITS,
    damped,
    of_states,
    solve_balanced,
    weighted,
)
from omnidyn.identification.output_error.solve.steps import Order
from omnidyn.progress import Progress, Report
from omnidyn.statement import Statement

MAX_ITERATIONS = 60
END_PRECISION = 1e-5  # squared distance to the best point, in standard errors, at which it ends
KINK_PRECISION = 1e-3  # the same where a step has failed: F has kinks, and this close they are all that is left
NEAR_PRECISION = 10.0  # the same from where a descent goes on by another likelihood, or by shorter steps
LEAST_STEP = 0.3  # share of a step that is too long: what is less long goes another way
MOST_RISE = 16.0  # times the squared distance, that F rises by where half of a step may do
MOST_NEAR_DAMPING = 1e-7  # that holds what rounding made of a step
SCATTER = 1e-2  # of F by an engine that marches by steps: a difference below it says nothing, but a gradient does
CREEP, STEPS = 3.0, 2  # times `close`, that so many steps in a row each lower F by less than: they creep along a kink
BEND_DISTANCE = (
    100.0  # squared distance to the best point, in standard errors, beyond which a bend is not that of the end
)
DAMPING, LEAST_DAMPING = 1e-4, 1e-10
FIRM_DAMPING, SHORT_DAMPING = (
    1e-2,
    10.0,
)  # least damping after a step that failed; that of a step with what was blocked at an edge
PRECISION = 1e-7  # of an output, relative to its size: below it noise is not told from none
SCALE_CHANGE = 1e-3  # of a variance, relative, at which it counts as found


@dataclass(frozen=True, eq=False)
class State:
    """A point, its sums, F there and the variance of each column. problem: whose point it is, where that is known."""

    point: Point
    sums: list[PieceSums]
    objective: float
    variance: FloatArray
    problem: FitProblem | None = None


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the minimisation ended. held_parameters: parameters at a bound that they push against. converged: or cut
    short.

    solver: which found it. blocked_parameters: latencies that stand at an edge. notes: what is to be said of the way
    there.
    plain_solution: the fit without nuisances that it was chosen beside.
    """

    state: State
    held_parameters: BoolArray
    iterations: int
    converged: bool
    solver: Solver[Any]
    blocked_parameters: BoolArray | None = None
    notes: tuple[Statement, ...] = ()
    plain_solution: Solution | None = None

    @property
    def least_objective(self) -> float:
        """F at the best point, as far as it is seen from here."""
        return self.state.objective - 0.5 * Normal(self.solver, self.state).distance_without(self.held_parameters)

    def gone_on(self, progress: Progress | None = None) -> Solution:
        """The same with as many steps as it takes."""
        if self.converged:
            return self
        scales = self.state.variance if self.solver.scaled.any() else None
        return self.solver.minimise(self.state, MAX_ITERATIONS, progress, self.blocked_parameters, scales)


class Solver(Generic[P]):
    """Minimises F over a problem. `floor` (columns,): least variance of each column.

    precision: squared distance to the best point, in standard errors, at which it ends. counts_ticks: whether counts
    have a likelihood of their own.
    """

    def __init__(
        self,
        problem: P,
        engine: FitEngine[P],
        nu: float = 0.0,
        precision: float = END_PRECISION,
        counts_ticks: bool = True,
    ):
        self.problem, self.engine, self.nu, self.close, self.counted = problem, engine, nu, precision, counts_ticks
        is_exact = precision <= END_PRECISION  # or a speed loop, which may creep for long, and yet find its way
        adds_up = problem.travels.any()  # what speeds are off by scatters F
        self._scatter = 0.0 if is_exact or not adds_up else SCATTER
        self.creep = 0.0 if is_exact else max(CREEP * precision, 2.0 * self._scatter)
        self._kink = max(KINK_PRECISION, precision, 2.0 * self._scatter)  # F would change by less than it scatters
        self.tick = problem.tick if counts_ticks else np.zeros(len(problem.columns))
        self.floor = np.maximum(_floor(problem), (LEAST_SHARE * self.tick) ** 2)
        self._edges, self.order = Edges(problem), Order(problem)
        self._low = np.array([p.inner(p.low) if not p.log or p.low > 0 else -np.inf for p in problem.parameters])
        self._high = np.array([p.inner(p.high) for p in problem.parameters])

    def state(self, point: Point, variance: FloatArray | None = None) -> State:
        """F and all sums at a point; at a fixed `variance` for Student's t and counts, which are none without."""
        given_variance = np.ones(len(self.problem.columns)) if variance is None else variance
        scaled = self.scaled & (bool(self.nu) or variance is not None)
        sums = self.engine.sums(
            point, Weighting(given_variance, self.nu, counts_ticks=bool(self.tick.any()) and variance is not None)
        )
        count = per_column(sums, len(given_variance), "number")
        mean = per_column(sums, len(given_variance), "square") / np.maximum(count, 1.0)
        variance_now = np.where(scaled, given_variance, np.maximum(mean, self.floor))
        objective = float(0.5 * count @ np.log(variance_now))
        if scaled.any():
            objective += float(per_column(sums, len(given_variance), "loss")[scaled].sum())
        return State(point, sums, objective + self._prior(point), variance_now, self.problem)

    @property
    def scaled(self) -> BoolArray:
        """Columns whose scale is a number of its own, not the mean square of their residuals. Shape (columns,)."""
        return np.full(len(self.tick), True) if self.nu else self.tick > 0.0

    def minimise(
        self,
        start: Point | State,
        limit: int = MAX_ITERATIONS,
        progress: Progress | None = None,
        blocked_parameters: BoolArray | None = None,
        scales: FloatArray | None = None,
    ) -> Solution:
        """The best point from `start`; `progress` sees every better one on the way.

        Where the start is a state that this engine found, the logs are not marched through for it again.
        blocked_parameters (P,): latencies that a solution near by has found to stand at an edge. scales (columns,):
        variances that it has found, of Student's t; without them least squares come first, which outliers lead far
        away.
        """
        if not self.scaled.any():
            return self._descend(self._begun(start), limit, progress, blocked_parameters)
        start = start.point if isinstance(start, State) else start
        if scales is not None:
            return self._descend(
                self._rescaled(self.state(self._inside(start), scales))[0], limit, progress, blocked_parameters
            )
        precision = max(self.close, NEAR_PRECISION) if self._scatter else self.close
        plain_solver = Solver(self.problem, self.engine, precision=precision, counts_ticks=False)
        plain_solution = plain_solver.minimise(start, limit, blocked_parameters=blocked_parameters)
        start_state = self.state(plain_solution.state.point, self.beside_rounding(plain_solution.state.variance))
        return self._descend(self._rescaled(start_state)[0], limit, progress, blocked_parameters)

    def beside_rounding(self, variance: FloatArray) -> FloatArray:
        """What of the variance of each column is not that of a count, which rounds evenly."""
        return np.maximum(variance - self.tick**2 / 12.0, self.floor)

    def _descend(
        self, state: State, limit: int, progress: Progress | None, blocked_parameters: BoolArray | None
    ) -> Solution:
        damping, change = DAMPING, 0.0
        held_parameters = np.zeros(len(self.problem.parameters), bool)
        blocked_parameters, bend = (
            held_parameters if blocked_parameters is None else blocked_parameters,
            Bend(len(held_parameters)),
        )
        is_released, slow_steps, share, near_damping = False, 0, 1.0, 0.0
        for iteration in range(limit):
            normal, objective_before = Normal(self, state), state.objective
            held_parameters, is_better, is_halved = normal.held, False, False
            if not self.scaled.any() and not self._scatter:  # a scale that is held meanwhile, or scatter, is no bend
                bend.learn(normal.inner, normal.gradient, normal.information)
            still_parameters, shift = held_parameters | blocked_parameters, np.zeros(len(held_parameters))
            is_near = normal.distance_without(still_parameters) < BEND_DISTANCE
            if self._scatter and self.engine.tol and damping < FIRM_DAMPING and is_near:
                damping = near_damping = 0.1 * near_damping  # much would hold what only priors tell apart
            while not is_better and (distance := normal.distance_without(still_parameters)) / (1.0 + damping) > (
                self.close if damping < FIRM_DAMPING else self._kink
            ):
                if distance > BEND_DISTANCE:
                    bend.forget()
                moved_point = normal.moved(
                    damping, still_parameters, bend.beside(normal.information, still_parameters), shift, share
                )
                trial = self.state(moved_point, state.variance if self.scaled.any() else None)
                is_better = trial.objective < state.objective or self._is_nearer(
                    trial, state, distance, still_parameters
                )
                if not is_better and damping == near_damping and share * distance > self._kink:
                    is_wild = trial.objective - state.objective >= MOST_RISE * distance  # a way that rounding made
                    if (is_wild or damping) and damping < MOST_NEAR_DAMPING:
                        damping = near_damping = max(100.0 * damping, LEAST_DAMPING)
                        continue
                    if share > LEAST_STEP:  # a valley: shorter, but the same way
                        share, is_halved = 0.5 * share, True
                        continue
                edge = None if is_better else self._edges.not_yet(still_parameters)
                if edge is not None:  # once more, and from here on, without what may stand at a jump or a kink
                    shift = self._edges.onto(normal.inner, self.inner(moved_point.values), still_parameters | ~edge)
                    blocked_parameters = blocked_parameters | edge
                    still_parameters, share = still_parameters | blocked_parameters, 1.0
                    continue
                if not is_better and shift.any():  # what was a guess is dropped before steps get shorter
                    shift = np.zeros(len(held_parameters))
                    continue
                if not is_better and bend.has_curvature:
                    bend.forget()
                    continue
                share = 1.0 if not is_better else share if is_halved else min(2.0 * share, 1.0)
                change_of_damping = 100.0 if self._scatter and (damping >= FIRM_DAMPING or not is_better) else 10.0
                damping = (
                    max(damping / change_of_damping, LEAST_DAMPING)
                    if is_better
                    else max(damping * change_of_damping, FIRM_DAMPING)
                )
                state = trial if is_better else state
            slow_steps = slow_steps + 1 if is_better and objective_before - state.objective < self.creep else 0
            if self.scaled.any():
                state, change = self._rescaled(state)
            if is_better and progress:
                progress(Report("fitting", state=state))
            if slow_steps >= STEPS and change < SCALE_CHANGE:
                return Solution(state, held_parameters, iteration + 1, True, self, blocked_parameters)
            if (
                not is_better and blocked_parameters.any() and not is_released
            ):  # a shorter step may stay this side of the edge
                blocked_parameters, is_released, damping = np.zeros_like(blocked_parameters), True, SHORT_DAMPING
            elif not is_better and change < SCALE_CHANGE:  # close enough, or no way down: a kink
                return Solution(state, held_parameters, iteration + 1, True, self, blocked_parameters)
        return Solution(state, held_parameters, limit, False, self, blocked_parameters)

    def _is_nearer(self, trial: State, state: State, distance: float, still_parameters: BoolArray) -> bool:
        """Whether a trial is nearer to the best point by its gradient, where F changes by less than it scatters.

        distance: that of `state`, squared, in standard errors.
        """
        if not max(0.5 * distance, trial.objective - state.objective) < self._scatter:
            return False
        return Normal(self, trial).distance_without(still_parameters) < 0.25 * distance

    def _rescaled(self, state: State) -> tuple[State, float]:
        """The same point at better scales of Student's t and counts, and the largest relative change.

        With m = mean w z^2, which is 1 at the right scale, one Newton step per column: log s += (m - 1)/information,
        that of log s being 2 nu/(nu + 3) a row for Student's t, and as in kernel/counts.py for counts.
        """
        number = np.maximum(per_column(state.sums, len(state.variance), "number"), 1.0)
        mean = per_column(state.sums, len(state.variance), "square") / number / state.variance
        tick_information = information(state.variance, self.tick)[1]
        if self.nu:
            tick_information = np.where(self.tick > 0.0, tick_information, 2.0 * self.nu / (self.nu + 3.0))
        step = np.where(self.scaled, np.clip(2.0 * (mean - 1.0) / tick_information, -1.0, 1.0), 0.0)
        variance = np.where(self.scaled, np.maximum(state.variance * np.exp(step), self.floor), state.variance)
        change = float(np.abs(np.log(variance / state.variance)).max())
        return (self.state(state.point, variance), change) if change >= SCALE_CHANGE else (state, change)

    def inner(self, values: FloatArray) -> FloatArray:
        return np.array([p.inner(float(v)) for p, v in zip(self.problem.parameters, values, strict=True)])

    def outer(self, inner_values: FloatArray) -> FloatArray:
        return np.array([p.outer(float(z)) for p, z in zip(self.problem.parameters, inner_values, strict=True)])

    def clipped(self, inner_values: FloatArray) -> FloatArray:
        return self.order.kept(np.clip(inner_values, self._low, self._high))

    def at_bound(self, inner_values: FloatArray, gradient: FloatArray) -> BoolArray:
        """Which parameters stand at a bound and are pushed against it by `gradient` (downhill direction)."""
        ends = ((inner_values <= self._low) & (gradient < 0.0)) | ((inner_values >= self._high) & (gradient > 0.0))
        return ends | self.order.at_bound(inner_values, gradient)

    def _begun(self, start: Point | State) -> State:
        """The state to start from, within the bounds; one of this very problem is not marched through again."""
        if not isinstance(start, State):
            return self.state(self._inside(start))
        inner_point = self._inside(start.point)
        is_start = start.problem is self.problem and np.array_equal(inner_point.values, start.point.values)
        return start if is_start else self.state(inner_point)

    def _inside(self, point: Point) -> Point:
        return Point(self.outer(self.clipped(self.inner(point.values))), point.states)

    def _prior(self, point: Point) -> float:
        total = 0.0
        for p, value in zip(self.problem.parameters, point.values, strict=True):
            if p.inner_prior is not None:
                mean, std = p.inner_prior
                total += 0.5 * ((p.inner(float(value)) - mean) / std) ** 2
        for piece, state in zip(self.problem.pieces, point.states, strict=True):
            pull, start_information = piece.start_prior(state)
            total += 0.5 * float(
                pull[start_information > 0.0] ** 2 @ (1.0 / start_information[start_information > 0.0])
            )
        return total


class Normal:
    """The normal equations at a state, in the numbers that the solver sees, states of the pieces eliminated.

    gradient (P,): downhill. information (P, P): of all parameters, free of the states. held: at a bound.
    """

    def __init__(self, solver: Solver, state: State):
        problem = solver.problem
        self.solver, self.state, count = solver, state, len(problem.parameters)
        self.scale = np.array([p.slope(float(v)) for p, v in zip(problem.parameters, state.point.values, strict=True)])
        self.pieces = [
            weighted(sums, 1.0 / state.variance[sums.columns], self.scale, states, piece.start_prior(states))
            for sums, states, piece in zip(state.sums, state.point.states, problem.pieces, strict=True)
        ]
        self._count = count
        self.inner = solver.inner(state.point.values)
        self._add_priors()
        self.gradient, self.information = self._reduced(0.0)
        self.held = solver.at_bound(self.inner, self.gradient)

    def _add_priors(self) -> None:
        self.prior_gradient, self.prior_information = np.zeros(self._count), np.zeros(self._count)
        for j, p in enumerate(self.solver.problem.parameters):
            if p.inner_prior is not None:
                mean, std = p.inner_prior
                self.prior_information[j] = std**-2
                self.prior_gradient[j] = (mean - self.inner[j]) / std**2

    def _reduced(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Gradient and information of the parameters, the states of each piece eliminated."""
        gradient, information = self.prior_gradient.copy(), np.diag(self.prior_information)
        for grad, info in self.pieces:
            k = self._count
            damped_information = damped(info, damping)
            gradient += grad[:k]
            information = information + damped_information[:k, :k]
            if grad.shape[0] > k:
                lift = of_states(damped_information[k:, k:], damped_information[k:, :k])
                gradient -= lift.T @ grad[k:]
                information -= damped_information[:k, k:] @ lift
        return gradient, information

    def distance_without(self, still_parameters: BoolArray) -> float:
        """Squared length of the Gauss-Newton step in standard errors, over the parameters that are not
        `still_parameters`."""
        free, fold = ~still_parameters, self.solver.order.together(self.inner, still_parameters)
        gradient = fold.T @ self.gradient
        step = solve_balanced((fold.T @ self.information @ fold)[np.ix_(free, free)], gradient[free])
        total = float(step @ gradient[free])
        for grad, info in self.pieces:  # what the states alone would gain
            if grad.shape[0] > self._count:
                k = self._count
                total += float(grad[k:] @ of_states(info[k:, k:], grad[k:]))
        return total

    def scores(self) -> FloatArray:
        """Score of each block of rows, the states eliminated. Shape (blocks, P). Needs sums of a final march."""
        k, block_scores = self._count, []
        for sums, (_, info) in zip(self.state.sums, self.pieces, strict=True):
            score = sums.score * np.concatenate([self.scale, np.ones(sums.score.shape[1] - k)])
            block_score = score[:, :k]
            if info.shape[0] > k:
                block_score = block_score - score[:, k:] @ of_states(info[k:, k:], info[k:, :k])
            block_scores.append(block_score)
        return np.concatenate(block_scores)

    def moved(
        self, damping: float, still_parameters: BoolArray, bend: FloatArray, onto: FloatArray, share: float = 1.0
    ) -> Point:
        """The point of the damped step, within the bounds, without the parameters that are `still_parameters`.

        bend (P, P): what the information lacks, see `Bend`. onto (P,): the step of these, see `Edges`. share: of the
        whole step that is taken.
        """
        gradient, information = self._reduced(damping)
        free, fold = ~still_parameters, self.solver.order.together(self.inner, still_parameters)
        gradient, information = fold.T @ gradient, fold.T @ (information + bend) @ fold
        step = np.where(still_parameters, onto, 0.0)
        step[free] = solve_balanced(information[np.ix_(free, free)], (gradient - information @ step)[free])
        inner_values = self.solver.clipped(self.inner + self.solver.engine.bent(self.inner, share * (fold @ step)))
        step = inner_values - self.inner
        k, states = self._count, []
        for (grad, info), old in zip(self.pieces, self.state.point.states, strict=True):
            new = old.copy()
            if grad.shape[0] > k:
                damped_information = damped(info, damping)
                new += of_states(damped_information[k:, k:], share * grad[k:] - damped_information[k:, :k] @ step)
                new[: len(SPEED_LIMITS)] = np.clip(new[: len(SPEED_LIMITS)], -SPEED_LIMITS, SPEED_LIMITS)
            states.append(new)
        return Point(self.solver.outer(inner_values), tuple(states))


def _floor(problem: FitProblem) -> FloatArray:
    """Least variance of each column: (PRECISION times its root mean square)^2."""
    columns = problem.columns
    size, count = np.zeros(len(columns)), np.zeros(len(columns))
    for rec in {id(piece.record): piece.record for piece in problem.pieces}.values():
        for c, column in enumerate(rec.columns):
            values = rec.outputs[:, c]
            k = columns.index(column)
            size[k] += float(np.nansum(values * values))
            count[k] += float(np.isfinite(values).sum())
    return PRECISION**2 * np.maximum(size / np.maximum(count, 1.0), 1e-12)
