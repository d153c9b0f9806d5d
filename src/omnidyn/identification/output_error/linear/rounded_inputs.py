"""How far the numbers of a fit are off because the inputs of its log are rounded.

While an input is held the true one is off by u, even between -q/2 and q/2 of its step q; another one by another u.
To first order this shows z = sum over such stretches of dy/du u in the rows made white, and moves the numbers by

    d = (J'J)^-1 J' z

Draws of all u give the covariance of d. Of what is left of z beside J the residuals e have a share s^2 of that of
steps that lost something, and none where the motors take just these steps:

    E (e'z)^2 = E |z|^2 + s^2 E (z'z~)^2        z, z~: two draws

so that a log in which it would show by itself tells how much of it there is. Where it would not, all of it counts.

In the tests of a fit all u are random effects, as many as there are stretches (`with_rounding`), and so is what rows
that are missing hide: what they may explain is a known cause, and no lack of fit. Inputs that are held
for less than HOLD_TIME leave what the memory of the noise knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion, motions
from omnidyn.identification.output_error.linear.input_steps import as_logged, input_steps
from omnidyn.identification.output_error.linear.missing_inputs import losses, shown_by_losses
from omnidyn.identification.output_error.linear.random_effects import share
from omnidyn.identification.output_error.linear.rows import FitRows, lengths, solved_by, with_priors
from omnidyn.identification.output_error.linear.sensitivity import as_weighed, members_of
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.problem import FitProblem, Piece, Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.layout import N_AXES
from omnidyn.statement import WARNING, Statement

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
    for c, (name, i) in enumerate(motion.piece.record.columns):
        if OBSERVATIONS[name].has_volts:
            values[c] += OBSERVATIONS[name].of_volts(robot, volts, i)
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
