"""The numbers between two fits: sums of the last whole fit, and those of the rows since, about one point.

No formula stands here: rows are those of the fit's own problem, by its own engine, whitened as there; step and interval
are the solver's own. What a whole fit knows beyond its sums, such as how well the memory of errors is known, widens the
intervals until the next one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.live.quadratic import Quadratic, put, summing_solver
from omnidyn.identification.live.rows import Rows
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.conclusion import intervals
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.prepare import START_STD
from omnidyn.identification.output_error.problem.differences import differences
from omnidyn.identification.output_error.problem.nuisances import LATENCY, pieces
from omnidyn.identification.output_error.problem.parameters import MOST_LATENCY
from omnidyn.identification.output_error.problem.problem import Piece, Point, Problem
from omnidyn.identification.output_error.problem.record import Record, record
from omnidyn.identification.output_error.solve.loop import loop_pieces
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.trust.uncertainty import WHITE, Trust, trust
from omnidyn.identification.structure.diagnosis import followed_themes
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statistics import difference_noise

ROUNDS, START_ROUNDS = 3, 3  # of numbers and noise in turn; until it is known where a stretch begins
LINEAR_STEPS = 4  # of the fit's solver, when all rows that are kept are taken anew
RECENT = 3  # stretches that are compared with a fit before
SIGNAL = 3.0  # times its noise, that an output must vary by in a stretch that judges
UNEXPLAINED = 2.0  # times the noise: the mean square that the numbers of all rows leave of a stretch that they miss
CHANCE = 5.0  # standard errors of a mean square that noise alone does not reach


@dataclass(frozen=True)
class PredictedStretch:
    """A stretch of rows that had no say in the numbers that predicted it. start, end [s]. ratio: channel -> mean square
    of what was not predicted over what noise, and what is open of the numbers, lead one to expect. limit: of each,
    which chance does not pass. has_signal: whether anything moved."""

    start: float
    end: float
    ratio: Mapping[str, float]
    limit: Mapping[str, float]
    has_signal: bool

    @property
    def predicted(self) -> bool:
        """Whether it was, and says anything."""
        return self.has_signal and not self.missed

    @property
    def missed(self) -> tuple[str, ...]:
        """The channels that were not predicted."""
        return tuple(name for name, ratio in self.ratio.items() if ratio > self.limit[name])


class LiveModel:
    """What the rows so far say. values (P,): of the numbers, uncertainty: of them; both as of the last `settle`.

    misfit: what the residuals of the whole fit follow, nothing where the model leaves nothing out.
    fitted_at [s]: of the last row in the whole fit. start [s]: of the stretch that is not closed yet.
    used_until [s]: of the row before the first gap in a log of set speeds, after which nothing is used; else None.
    """

    def __init__(self, run: Run, robot: Robot, question: OutputError) -> None:
        """A whole fit of a run. Raises as a fit does."""
        fit = Fit.of([run], robot, question)
        weighed = fit.weighed(fit.solve())
        solver, state = weighed.solution.solver, weighed.solution.state
        self.group, self.question = fit.groups[0], question
        self.misfit = followed_themes(weighed.solution)
        self.differences = None if question.tick_rad == 0.0 else differences([run])
        self.problem: Problem = solver.problem
        self.counted = solver.tick > 0.0
        self.past: Quadratic | None = None
        self.fitted_at = self.start = float(run.t[-1])
        self.values, self.linear_at, self.variance = state.point.values, state.point.values, state.variance
        self.sums = Quadratic.of(solver, state, self.problem.columns)
        self.open = self._empty()
        self.recent: deque[Quadratic] = deque(maxlen=RECENT)
        self._engine = solver.engine
        self.used_until = self._before_a_gap(self.group.records[0])
        self._solver = summing_solver(self.problem, self.sums)
        self._factor, self._quantile = np.ones(len(self.values)), weighed.uncertainty.quantile
        plain, whole = self._trust().std, weighed.uncertainty.std
        is_seen = np.isfinite(plain) & np.isfinite(whole) & (plain > 0.0)
        self._factor = np.where(is_seen, whole / np.where(is_seen, plain, 1.0), 1.0)
        self.uncertainty = self._trust()
        self._starts: tuple[FloatArray, ...]
        self._open, self._starts = self.uncertainty.open, ()
        self._begin()

    @property
    def has_loop(self) -> bool:
        """Whether a speed loop makes the voltage: what it remembers is known from the start of the log on only."""
        return self._engine.has_loop

    def take(self, rows: Rows, end: float) -> None:
        """Take the rows from the start of the open stretch to a time [s], and settle.

        Through a speed loop they only judge: a current jumps at each tick, so that the slope of a latency leads
        nowhere, and the numbers move by steps that simulate the whole log.
        """
        self.open = self.told_by(rows, self.start, end)
        if not self.has_loop:
            self._settle()

    def judge(self, end: float) -> PredictedStretch:
        """How well the open stretch was predicted by the numbers at its start."""
        predicted = self.open.at(self._before)
        number = np.maximum(predicted.number, 1.0)
        scale, shown = self._scale(self._before), predicted.number > 0.0
        covariance = np.where(np.isfinite(self._trusted.covariance), self._trusted.covariance, 0.0)
        open_share = np.einsum("cij,ij->c", predicted.information, covariance * np.outer(scale, scale))
        expected = self._noise * (1.0 + open_share / number / np.maximum(self._noise, 1e-300))
        ratio = predicted.square / number / np.maximum(expected, 1e-300)
        limit = 1.0 + CHANCE * np.sqrt(2.0 / number)
        names = [f"{name}[{index}]" for name, index in predicted.columns]
        kept = [(name, k) for k, name in enumerate(names) if shown[k]]
        return PredictedStretch(
            self.start,
            end,
            {name: float(ratio[k]) for name, k in kept},
            {name: float(limit[k]) for name, k in kept},
            self._has_signal,
        )

    def unexplained(self, rows: Rows, start: float, end: float) -> PredictedStretch | None:
        """A stretch that is closed, if the numbers as they are now leave more of it than noise: what happened in it is
        not in the model, and yet counts in the numbers. None where all is well, or its rows are gone."""
        kept, self._starts = (self._starts, self._has_signal), ()
        sums = self.told_by(rows, start, end)
        self._starts, self._has_signal = kept
        ratio = {
            f"{name}[{index}]": float(sums.square[c] / sums.number[c] / max(self.variance[c], 1e-300))
            for c, (name, index) in enumerate(sums.columns)
            if sums.number[c] > 0.0
        }
        stretch = PredictedStretch(start, end, ratio, dict.fromkeys(ratio, UNEXPLAINED), True)
        return stretch if stretch.missed else None

    def close(self, end: float) -> None:
        """The open stretch is done: it counts like all before, and the next one begins."""
        self.recent.append(self.open)
        self.sums, self.open, self.start = self.sums.plus(self.open), self._empty(), end
        self._begin()

    def go_on(self, before: LiveModel) -> None:
        """Take over what a model of earlier rows keeps: its last stretches, and what rows said that are gone."""
        self.past = None if before.past is None else self._renamed(before.past, before)
        if before.problem.columns == self.problem.columns and before.problem.names == self.problem.names:
            self.recent.extend(before.recent)

    def linearise(self, rows: Rows, end: float) -> None:
        """All rows that are kept, up to a time [s], anew about the numbers as they are, and those that follow."""
        run = rows.between(-np.inf, end)
        made = None if run is None else self._problem_of(run, -np.inf)
        if made is None:
            return
        solver = self._solver_of(made)
        start = self._state_at(solver, Point(self.values, made.start().states))
        if self.past is None:  # else the rows alone say less than all that was
            scales = start.variance if solver.scaled.any() else None
            found = solver.minimise(start.point, LINEAR_STEPS, scales=scales).state
            self.values = found.point.values
            start = self._state_at(solver, found.point, 1)
        self.sums, self.open = Quadratic.of(solver, start, self.problem.columns), self._empty()
        self._settle()
        self.fitted_at, self.linear_at, self.start, self._open = end, self.values, end, self.uncertainty.open
        self._begin()

    @property
    def latest(self) -> Quadratic | None:
        """What the last stretches tell, without all before; None until there are enough of them."""
        if len(self.recent) < RECENT:
            return None
        sums = self.recent[0]
        for quadratic in [*self.recent][1:]:
            sums = sums.plus(quadratic)
        return sums

    def freeze(self) -> None:
        """The rows before the open stretch are gone: what they said stays as it is."""
        self.past = self.sums if self.past is None else self.past.plus(self.sums)
        self.sums, self.fitted_at = self._empty(), self.start

    def told_by(self, rows: Rows, start: float, end: float) -> Quadratic:
        """What the rows after one time up to another [s] tell near the numbers as they are."""
        run = rows.between(-np.inf if self.has_loop else start - MOST_LATENCY, end)
        made = None if run is None else self._problem_of(run, start)
        if made is None:
            return self._empty()
        solver = self._solver_of(made)
        point, rounds = Point(self.values, made.start().states), START_ROUNDS
        if len(self._starts) == len(point.states):  # the same stretch a second ago
            point, rounds = Point(self.values, self._starts), 1
        state = self._state_at(solver, point, rounds)
        self._starts = state.point.states
        return Quadratic.of(solver, state, self.problem.columns)

    def _problem_of(self, run: Run, start: float) -> Problem | None:
        """The fit's problem with these rows, those up to a time [s] only as what went before; None without any."""
        question = self.question
        try:
            read = record(run, self.group.robot, question.outputs, self.has_loop, question.tick_rad, self.differences)
        except (InputError, InsufficientDataError):  # no inputs, or no measurement, in these rows
            return None
        has_latency = any(p.part == LATENCY for p in self.problem.parameters)
        begun = (
            loop_pieces([read], self.group.robot, question.start)
            if self.has_loop
            else pieces([read], self.group.robot, question.start, has_latency, START_STD)
        )
        self.used_until = self._before_a_gap(read)
        used = [cut for piece in begun if (cut := _after(piece, start)) is not None]
        fresh = read.outputs[read.t > start]
        self._has_signal = any(_varies(column) for column in fresh.T)
        return replace(self.problem, pieces=tuple(used)) if used else None

    def _before_a_gap(self, read: Record) -> float | None:
        """When the first piece of a log of set speeds ends; None where that is all, or where voltages are logged."""
        return float(read.t[read.pieces[0][1]]) if self.has_loop and len(read.pieces) > 1 else None

    def _solver_of(self, problem: Problem) -> Solver[Problem]:
        return Solver(problem, self._engine.on(problem), counts_ticks=bool(self.counted.any()))

    def _state_at(self, solver: Solver[Problem], point: Point, rounds: int = START_ROUNDS) -> State:
        """The state at the numbers of a point, where the pieces begin found in some rounds."""
        noise = dict(zip(self.problem.columns, self.variance, strict=True))
        variance = np.array([noise.get(column, 1.0) for column in solver.problem.columns])
        still, none = np.ones(len(point.values), bool), np.zeros(len(point.values))

        def at(point: Point) -> State:
            sums = solver.engine.sums(point, Weighting(variance, counts_ticks=bool(self.counted.any())))
            return State(point, sums, 0.0, variance, solver.problem)

        state = at(point)
        for _ in range(rounds - 1):
            state = at(Point(point.values, Normal(solver, state).moved(0.0, still, np.diag(none), none).states))
        return state

    def _renamed(self, quadratic: Quadratic, before: LiveModel) -> Quadratic:
        """A quadratic of another model in the numbers of this one; one that is new has not shown there."""
        names = before.problem.names
        at = [names.index(name) if name in names else -1 for name in self.problem.names]
        is_old = np.array(at) >= 0
        values = np.where(is_old, quadratic.values[at], self.values)
        made = Quadratic.empty(self.problem.columns, values)
        for c, column in enumerate(self.problem.columns):
            if column in quadratic.columns:
                k = quadratic.columns.index(column)
                made.number[c], made.square[c] = quadratic.number[k], quadratic.square[k]
                made.gradient[c] = np.where(is_old, quadratic.gradient[k][at], 0.0)
                made.information[c] = quadratic.information[k][np.ix_(at, at)] * np.outer(is_old, is_old)
        return made

    def of_sums(self, sums: Quadratic) -> tuple[FloatArray, FloatArray]:
        """(inner values, their covariance) that sums alone say; infinite where they do not tell."""
        put(self._solver, sums)
        state = self._state(self.values)
        normal = Normal(self._solver, state)
        found = trust(self._solver, Solution(state, normal.held, 0, True, self._solver), WHITE)
        finite = np.where(np.isfinite(found.covariance), found.covariance, 0.0)
        covariance = found.covariance * np.outer(self._factor, self._factor)
        return normal.inner + finite @ normal.gradient, covariance

    @property
    def inner(self) -> FloatArray:
        """The numbers as the solver sees them."""
        return self._solver.inner(self.values)

    @property
    def moved(self) -> float:
        """How far the numbers have moved since all was fitted, in standard errors: that of the one that has most."""
        std = self.uncertainty.std
        change = np.abs(self.inner - self._solver.inner(self.linear_at))
        is_seen = np.isfinite(std) & (std > 0.0)
        return float((change[is_seen] / std[is_seen]).max(initial=0.0))

    def intervals(self) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
        """Standard errors and 95 % intervals of all numbers, by name."""
        return intervals(self.problem, self.values, self.uncertainty)

    @property
    def unknown(self) -> BoolArray:
        """Which numbers the rows leave open, shape (P,).

        One that rows about one point leave open stays so: sums of slopes at two points seem to tell it.
        """
        return self.uncertainty.open | self._open

    def _settle(self) -> None:
        total = self.sums.plus(self.open)
        put(self._solver, total if self.past is None else total.plus(self.past))
        count = len(self.values)
        for _ in range(ROUNDS):
            state = self._state(self.values)
            normal = Normal(self._solver, state)
            self.values = normal.moved(0.0, normal.held, np.zeros((count, count)), np.zeros(count)).values
        self.variance = self._state(self.values).variance
        self.uncertainty = self._trust()

    def _state(self, values: FloatArray) -> State:
        """The sums as a state of the fit; the noise of counts stays what the last fit found."""
        point = Point(values, (np.zeros(N_AXES + len(self.problem.columns)),))
        state = self._solver.state(point)
        return replace(state, variance=np.where(self.counted, self.variance, state.variance))

    def _trust(self) -> Trust:
        state = self._state(self.values)
        held = Normal(self._solver, state).held
        found = trust(self._solver, Solution(state, held, 0, True, self._solver), WHITE)
        covariance = found.covariance * np.outer(self._factor, self._factor)
        return replace(found, covariance=covariance, quantile=self._quantile)

    def _begin(self) -> None:
        """What a stretch is judged by: all of it from before its first row."""
        self._before, self._noise, self._trusted = self.values, self.variance, self.uncertainty
        self._has_signal, self._starts = False, self._starts if self.has_loop else ()

    def _scale(self, values: FloatArray) -> FloatArray:
        return np.array([p.slope(float(v)) for p, v in zip(self.problem.parameters, values, strict=True)])

    def _empty(self) -> Quadratic:
        return Quadratic.empty(self.problem.columns, self.values)


def _after(piece: Piece, start: float) -> Piece | None:
    """The piece without outputs up to a time [s], which count elsewhere; None where nothing is left."""
    t = piece.record.t
    if t[piece.last] <= start:
        return None
    lead = start - float(t[piece.first])
    if lead < 0.0:
        return piece
    return replace(piece, margin=np.full(len(piece.margin), lead + 1e-9))


def _varies(values: FloatArray) -> bool:
    """Whether a column shows more than its noise."""
    finite = values[np.isfinite(values)]
    return len(finite) > 10 and bool(np.std(finite) > SIGNAL * difference_noise(finite))
