"""How far the numbers of a fit move where a number that it took as it stands is another one, to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion, motions
from omnidyn.identification.output_error.linear.random_effects import share
from omnidyn.identification.output_error.linear.rows import FitRows, Linear, lengths, solved, solved_by, with_priors
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.differences import COUNT_SHARE, GAP_ROWS, JUMP, UNEVEN
from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.problem.problem import FitProblem, Piece, Point, Problem, bounded
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import per_wheel
from omnidyn.statement import WARNING, Statement

TRIAL_CHANGE = 0.01  # relative change of a fixed number, either way is alike


def moved_by_the_file(weighed_fit: Weighed, stds_by_key: Mapping[str, float]) -> FloatArray:
    """What one std of each number that the fit took as it stands moves its parameters by, in the numbers that the
    solver sees. Shape (P, K). stds_by_key: key -> std, as the robot file has it; with groups it is the same number in
    all.

    To first order, as in `rests_on`; 0 for what shows in no row, or cannot be simulated. The covariance of what is
    fitted beside numbers that are taken as they stand: S. F. Schmidt, Adv. Control Syst. 3, 293 (1966).
    """
    linear, engine, point = as_weighed(weighed_fit)
    benches = [
        (Workbench(problem, member_point, type(member_engine), ()), places)
        for problem, member_point, member_engine, places in members_of(engine, linear.rows.problem, point)
    ]
    _, j = linear.whole()
    shifts = np.zeros((j.shape[1], len(stds_by_key)))
    for k, (key, std) in enumerate(stds_by_key.items()):
        columns_by_piece = [np.zeros((*residual.shape, 1)) for residual in linear.rows.residual]
        try:
            for bench, places in benches:
                number = robot_parameter(bench.robot, key, None, tuple(stds_by_key))
                step = TRIAL_CHANGE * (abs(number.value) or std)
                changes = bench.change(number.on(bench.robot, number.value + step))
                for place, change in zip(places, changes, strict=True):
                    columns_by_piece[place] = change / step
        except OmnidynError:
            continue
        shifts[:, k] = solved(j, -linear.white(columns_by_piece)[:, 0]) * std
    return shifts


def as_weighed(weighed_fit: Weighed) -> tuple[Linear, FitEngine, Point]:
    """(the rows of a fit made white by the memory that it was weighed with, what simulates them, its best point)."""
    solver, point = weighed_fit.plain_solution.solver, weighed_fit.plain_solution.state.point
    assert isinstance(solver.problem, Problem)
    problem, variance = bounded(solver.problem, 1), weighed_fit.plain_solution.state.variance
    engine = solver.engine.on(problem)
    rows = FitRows.of(problem, point, engine.residuals(point))
    memory = [
        weighed_fit.models.get(column, AutoRegression(np.zeros(0), float(variance[c]), 0))
        for c, column in enumerate(problem.columns)
    ]
    return Linear(rows, memory), engine, point


def members_of(engine: FitEngine, problem: Problem, point: Point) -> list[tuple[Problem, Point, FitEngine, IntArray]]:
    """(problem, point, engine, which pieces of all are its own) of each group; of one where there are none."""
    if not engine.members:
        return [(problem, point, engine, np.arange(len(problem.pieces)))]
    return [(member.problem, member.point(point), member.engine, member.places) for member in engine.members]


# How far the numbers of a fit are off because the inputs of its log are rounded
#
# While an input is held the true one is off by u, even between -q/2 and q/2 of its step q; another one by another u.
# To first order this shows z = sum over such stretches of dy/du u in the rows made white, and moves the numbers by
#
#     d = (J'J)^-1 J' z
#
# Draws of all u give the covariance of d. Of what is left of z beside J the residuals e have a share s^2 of that of
# steps that lost something, and none where the motors take just these steps:
#
#     E (e'z)^2 = E |z|^2 + s^2 E (z'z~)^2        z, z~: two draws
#
# so that a log in which it would show by itself tells how much of it there is. Where it would not, all of it counts.
#
# In the tests of a fit all u are random effects, as many as there are stretches (`with_rounding`), and so is what rows
# that are missing hide: what they may explain is a known cause, and no lack of fit. Inputs that are held
# for less than HOLD_TIME leave what the memory of the noise knows.

HOLD_TIME = 0.1  # [s]
WIDENING_RATIO = 1.1  # times an interval, from which on what widens it is said
DRAWS = 60  # a variance within a fifth; always the same ones
SEED = 20_12


def beside_rounding(weighed_fit: Weighed, records: Sequence[Record]) -> tuple[Trust, list[Statement]]:
    """(the trust in a fit, with what inputs in steps may have been rounded by; what is to be said of that)."""
    steps = max(float(input_steps(record).max()) for record in records)
    if not steps:
        return weighed_fit.uncertainty, []
    uncertainty = weighed_fit.uncertainty.beside(moved_by_rounding(weighed_fit))
    with np.errstate(divide="ignore", invalid="ignore"):
        largest_ratio = float(np.nanmax(uncertainty.std / weighed_fit.uncertainty.std, initial=1.0))
    rounded = Statement("rounded_inputs", WARNING, numbers={"step": steps, "wider": largest_ratio})
    return uncertainty, [rounded] if largest_ratio > WIDENING_RATIO else []


def moved_by_rounding(weighed_fit: Weighed) -> FloatArray:
    """What the rounding of its inputs moves the parameters of a fit by, in the numbers that the solver sees: their
    covariance is that times its transpose. Shape (P, DRAWS).

    One piece after the other. Of logs that are longer than what is looked at as much less as there are more rows.
    """
    linear, engine, point = as_weighed(weighed_fit)
    products, random = with_priors(linear, DRAWS), np.random.default_rng(SEED)
    for problem, own_point, _, places in members_of(engine, linear.rows.problem, point):
        for place, motion in zip(places, motions(problem, own_point), strict=True):
            white_columns = linear.beside(place, [_shown(motion, _drawn(motion, random))])
            products += white_columns.T @ white_columns
    size = lengths(products)
    gram = products / np.outer(size, size)
    j, other_indices = np.arange(1, len(gram) - DRAWS), np.r_[0, len(gram) - DRAWS : len(gram)]
    coefficients = solved_by(gram[np.ix_(j, j)], gram[np.ix_(j, other_indices)])
    remaining = (
        gram[np.ix_(other_indices, other_indices)] - coefficients.T @ gram[np.ix_(j, other_indices)]
    ) * np.outer(size[other_indices], size[other_indices])
    rows, white_columns = (
        _rows(row_problem) for row_problem in (linear.rows.problem, weighed_fit.plain_solution.solver.problem)
    )
    return (coefficients * size[other_indices] / size[j, None])[:, 1:] * np.sqrt(
        _share(remaining) / DRAWS * rows / white_columns
    )


def with_rounding(rows: FitRows, piece_motions: Sequence[DrivenMotion]) -> FitRows:
    """The rows of a fit with what the rounding of inputs shows in them, where they are rounded; and what an input does
    that changed while rows are missing."""
    stretches_by_piece = [_stretches(motion.piece) for motion in piece_motions]
    if not any(stretches_by_piece) and not any(losses(motion.piece).size for motion in piece_motions):
        return rows
    columns_by_piece, losses_by_piece = list[FloatArray](), [shown_by_losses(motion) for motion in piece_motions]
    for motion, stretches, loss_columns in zip(piece_motions, stretches_by_piece, losses_by_piece, strict=True):
        volts = np.zeros((len(motion.t), len(stretches), motion.voltage.shape[1]))
        for k, (w, first, last, step) in enumerate(stretches):
            volts[first:last, k, w] = step / np.sqrt(12.0)
        columns_by_piece.append(np.nan_to_num(np.concatenate([_shown(motion, volts), loss_columns], axis=2)))
    return replace(rows, rounding=columns_by_piece, losses=[lost_columns.shape[2] for lost_columns in losses_by_piece])


def effects(problem: Problem) -> list[int]:
    """How many columns `with_rounding` shows of each piece."""
    return [len(_stretches(piece)) + 2 * len(losses(piece)) for piece in problem.pieces]


def _stretches(piece: Piece) -> list[tuple[int, int, int, float]]:
    """(wheel, first row, row behind the last, step [V]) of each stretch in which an input is held and may be off."""
    record, rows = piece.record, slice(piece.first, piece.last + 1)
    inputs, steps, t = as_logged(record)[rows], input_steps(record), record.t[rows]
    stretches = []
    for w in np.flatnonzero(steps).tolist():
        edges = [*np.flatnonzero(_changed(inputs, w)).tolist(), len(t)]
        stretches += [
            (w, a, b, float(steps[w]))
            for a, b in pairwise(edges)
            if inputs[a].any() and t[b - 1] - t[a] >= HOLD_TIME  # what is off is off
        ]
    return stretches


def _changed(inputs: FloatArray, w: int) -> BoolArray:
    """The rows from which on an input may have been rounded by something else: the first, those in which it changes,
    and those in which all others do, for then it is another command that came to the same step. (rows,)."""
    changes = np.ones(inputs.shape, dtype=bool)
    changes[1:] = np.diff(inputs, axis=0) != 0.0
    other_changes = np.delete(changes, w, axis=1)
    return changes[:, w] | (other_changes.all(axis=1) & other_changes.any(axis=1))


def _drawn(motion: DrivenMotion, random: np.random.Generator) -> FloatArray:
    """Draws of what was rounded off [V], another one at each change of an input. Shape (rows, DRAWS, W)."""
    record, rows = motion.piece.record, slice(motion.piece.first, motion.piece.last + 1)
    inputs, steps = as_logged(record)[rows], input_steps(record)
    draws = np.zeros((len(inputs), DRAWS, len(steps)))
    for w in np.flatnonzero(steps).tolist():
        stretch = np.cumsum(_changed(inputs, w)) - 1
        draws[:, :, w] = steps[w] * random.uniform(-0.5, 0.5, (int(stretch[-1]) + 1, DRAWS))[stretch]
    return draws * np.any(inputs, axis=1, keepdims=True)[:, :, None]  # what is off is off


def _shown(motion: DrivenMotion, volts: FloatArray) -> FloatArray:
    """What the columns show of other voltages (rows, K, W). Shape (C, rows, K)."""
    robot = linear_part(motion.robot)
    per_volt = drive_wrench(robot, np.zeros(N_AXES), np.eye(robot.wheels.count))
    values = motion.shown_by(volts @ per_volt)
    ohm = per_wheel(robot.motor.resistance, robot.wheels.count)
    for c, (name, i) in enumerate(motion.piece.record.columns):
        if name == "current":
            values[c] += volts[..., i] / ohm[i]
    return values


def _rows(problem: FitProblem) -> int:
    return sum(piece.last - piece.first + 1 for piece in problem.pieces)


def _share(products: FloatArray) -> float:
    """How much of the variance of what may have been rounded off there is. products: scalar products (1 + DRAWS, 1 +
    DRAWS) of residuals and draws without what the parameters make of them."""
    squares = products[1:, 1:] ** 2
    pair_square = float(squares.sum() - np.trace(squares)) / (DRAWS * (DRAWS - 1))
    observed, noise = float(np.mean(products[0, 1:] ** 2)), float(np.mean(np.diag(products)[1:]))
    return share(observed, noise, pair_square, float(np.sqrt(2.0 * squares.mean())))


# What a log does not tell of its inputs where rows are missing: since when the next one has been applied
#
# The model holds the last input that was logged. Had the next one come at once, or halfway, the motion would show z
# beside that, by simulation. Of z there is a share u, even between 0 and 1 and another one at each loss: random effects
# in the tests of a fit, as inputs that are rounded are, but all of their variance is there.

LOSS_TIME = 3.0  # [s] that a change of speed may be seen


def losses(piece: Piece) -> IntArray:
    """The rows of a piece behind which others are missing and an input is clearly another one. (K,).

    Rows of clocks of their own lack none, and every change has its time. A speed loop is not looked into.
    """
    record, rows = piece.record, slice(piece.first, piece.last + 1)
    row = np.diff(record.t[rows]) / usual_step(record.t[rows])
    if record.staggered or record.set_point is not None or np.mean(np.abs(row - np.round(row)) <= UNEVEN) < COUNT_SHARE:
        return np.zeros(0, dtype=int)
    voltage = np.nan_to_num(record.voltage[rows])
    jumps = (np.abs(np.diff(voltage, axis=0)) > JUMP * np.ptp(voltage, axis=0).max()).any(axis=1)
    return np.flatnonzero(jumps & (row > GAP_ROWS))


def shown_by_losses(motion: DrivenMotion) -> FloatArray:
    """What the columns show of each input that changed at once, and of one that did halfway, times the root of the mean
    square of u. (C, rows, 2 K)."""
    loss_rows, voltage = losses(motion.piece), motion.voltage.copy()
    voltage_before, end = motion.piece.record.voltage[motion.piece.last - 1 : motion.piece.last + 1]
    voltage[-1] += np.nan_to_num(end - voltage_before)  # it drives no row
    change = np.zeros((len(motion.t), 2 * len(loss_rows), N_AXES))
    for k, row in enumerate(loss_rows.tolist()):
        last = int(np.searchsorted(motion.t[:-1], motion.t[row + 1] + LOSS_TIME))
        dt = np.diff(motion.t[row : last + 1])
        dt = np.concatenate([[0.5 * dt[0]] * 2, dt[1:]])
        ways = [
            np.delete(motion.under(voltage[[*first, *range(row + 1, last)]], dt, row), 1, axis=0)
            for first in ((row, row), (row + 1, row + 1), (row, row + 1))
        ]
        change[row : last + 1, 2 * k] = ways[1] - ways[0]
        change[row : last + 1, 2 * k + 1] = ways[2] - ways[0]
    return motion.shown(change) / np.sqrt(3.0)


# In which steps the inputs of a log are written: what was applied may lie half a step beside what stands there

LEVELS = 12  # of different size, from which on it is no chance that all are whole steps
PARTS = 4  # of the least difference of two levels, of which the step may be one
STEP_TOLERANCE = 0.02  # of a step, by which a level may be beside it: the text of a log is rounded, too
LEAST_STEP = 1e-3  # of the largest input, below which a step does not matter
LEVEL_TOLERANCE = 1e-6  # of the largest input: what is nearer is the same, written otherwise
SAMPLE_INPUTS = 200  # inputs, which tell soon of most logs that theirs are in no steps


def as_logged(record: Record) -> FloatArray:
    """The inputs as they were written: voltages [V], or else duties. Shape (rows, W).

    A limit would make a level of its own of them, and a supply that is logged a change of every row.
    """
    run = record.run
    if run is None or record.set_point is not None:
        return record.voltage
    return next(
        (input_columns for input_columns in (run.voltage, run.duty) if input_columns is not None), record.voltage
    )


def input_steps(record: Record) -> FloatArray:
    """The step of the voltage of each wheel [V], that of a duty times the supply; 0 where there is none. (W,)."""
    run = record.run
    if run is None or record.set_point is not None:
        return np.zeros(record.voltage.shape[1])
    inputs = as_logged(record)
    steps = np.array([_step(column) for column in inputs.T])
    if run.voltage is not None or run.duty is None or not steps.any():
        return steps
    driven_rows = np.abs(inputs) > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        supply = np.median(np.abs(record.voltage / inputs)[driven_rows & np.isfinite(record.voltage)])
    return steps * float(supply)


def _step(column: FloatArray) -> float:
    """The step of one input, by the levels that it holds: all are whole steps."""
    change_rows = np.flatnonzero(np.diff(column) != 0.0) + 1
    if len(change_rows) < LEVELS:
        return 0.0
    held_levels = np.abs(column[change_rows])
    held_levels = held_levels[np.isfinite(held_levels)]
    largest = float(held_levels.max(initial=0.0))
    if (
        _apart(held_levels[:SAMPLE_INPUTS], largest).min(initial=largest) < LEAST_STEP * largest
    ):  # nor are those of all of them further apart
        return 0.0
    levels, level_steps = np.unique(np.concatenate([[0.0], held_levels])), _apart(held_levels, largest)
    if len(level_steps) < LEVELS:
        return 0.0
    for parts in range(1, PARTS + 1):
        step = float(level_steps.min()) / parts
        if step < LEAST_STEP * largest:
            return 0.0
        distance = np.abs(levels / step - np.round(levels / step))
        if distance.max() <= STEP_TOLERANCE:
            return step
    return 0.0


def _apart(held_levels: FloatArray, largest: float) -> FloatArray:
    """The differences of levels, 0 among them."""
    level_steps = np.diff(np.sort(np.concatenate([[0.0], held_levels])))
    return level_steps[level_steps > LEVEL_TOLERANCE * largest]
