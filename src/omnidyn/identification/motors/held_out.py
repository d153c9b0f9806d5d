"""Which numbers a free run of a motor needs beside slope and lag: those without which it predicts held-out rows worse.

The rows are cut into blocks of equal length. A fifth of them at a time has no outputs for a fit, and is predicted by
its free run, which goes on through them under the input of the log. Of dead band, offset and latency the one is left
out that held-out rows need least, as long as the blocks do not need it by more than chance (`compare_blocks`). One
whose interval reaches 0 is left out as well: the likelihood stands beside the blocks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.identification.estimate import HeldOut
from omnidyn.identification.methods import AUTO, MotorFit
from omnidyn.identification.methods import degrees as degrees_of
from omnidyn.identification.motors.estimate import BAND, LATENCY, OFFSET, MotorEstimate
from omnidyn.identification.motors.fit import fit_motor, solved
from omnidyn.identification.motors.input_between_rows import WORDS
from omnidyn.identification.motors.log import MotorLog
from omnidyn.identification.motors.motor_engine import MotorProblem
from omnidyn.identification.motors.problem import MotorRecord, motor_problem, motor_record
from omnidyn.identification.motors.rest import turns_both_ways
from omnidyn.identification.motors.windows import line_numbers
from omnidyn.identification.output_error.problem.nuisances import earliest
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.statement import WARNING, Statement

NUMBERS = (BAND, OFFSET, LATENCY)
FOLDS, BLOCKS, LEAST_BLOCK = 5, 20, 8  # rows of a block at least
BLOCK_ITERATIONS = 12  # iterations of a fit without some blocks, which begins at that to all
ANSWERS = 0.5  # of the spread of held-out rows: a free run that misses less follows its input
ERROR_LIMIT = 5.0  # scales of the noise that an error counts at most, where it is that of Student's t


@dataclass(frozen=True, eq=False)
class MotorModel:
    """names: of NUMBERS, fitted beside slope and lag. between: how the input goes from row to row. values: of its fit.

    errors (BLOCKS,): squared error of each block over the variance of the output, by fits without the block. size:
    root mean square of each output over its spread, geometric mean.
    """

    names: tuple[str, ...]
    between: str
    values: Mapping[str, float]
    errors: FloatArray
    size: float

    def beside(self, smaller_model: MotorModel) -> BlockComparison:
        """How it predicts the held-out blocks beside a model with fewer numbers."""
        return compare_blocks(smaller_model.errors, self.errors)


@dataclass(frozen=True, eq=False)
class ModelChoice:
    """model: with the numbers that pay; plain_model: with none of NUMBERS; rejected: those that do not pay.

    comparisons: of those of `rejected` that were plausible, how the model with it did beside that without. needed: of
    those of the model that blocks need clearly.
    """

    model: MotorModel
    plain_model: MotorModel
    rejected: tuple[str, ...]
    comparisons: Mapping[str, BlockComparison]
    needed: tuple[str, ...] = ()


def choose_model(
    logs: Sequence[MotorLog],
    motor: int,
    between: str,
    loss: str,
    wanted_names: Sequence[str] | None = None,
    unseen: Sequence[str] = (),
) -> ModelChoice | None:
    """What a motor needs; None where the logs are too short to hold any block out.

    wanted_names: of NUMBERS, all of which are taken; None: those that pay. between, loss: as `fit_motor` has them.
    unseen: those that are not taken, for their intervals reach 0.
    """
    candidate_names = tuple(
        name for name in NUMBERS if (wanted_names is None or name in wanted_names) and name not in unseen
    )
    if not turns_both_ways(logs, motor):
        candidate_names = tuple(name for name in candidate_names if name != OFFSET)
    held_out = _HeldOut(logs, motor, degrees_of(loss))
    if not held_out.long_enough:
        return None
    ways = [between] if between != AUTO else list(WORDS)
    plain_model = min((held_out.model(reading, ()) for reading in ways), key=lambda model: model.size)
    model = (
        min((held_out.model(reading, candidate_names) for reading in ways), key=lambda model: model.size)
        if candidate_names
        else plain_model
    )
    comparisons: dict[str, BlockComparison] = {}
    needed: tuple[str, ...] = ()
    while wanted_names is None and model.names:
        if implausible_names := [name for name in model.names if not held_out.is_plausible(model, name)]:
            model = held_out.model(model.between, _without(model.names, *implausible_names), model.values)
            continue
        smaller_models = [
            held_out.model(reading, _without(model.names, name), model.values)
            for name in model.names
            for reading in (ways if name == LATENCY else [model.between])  # another reading may be as late
        ]
        best_model = min(smaller_models, key=lambda smaller_model: smaller_model.size)
        comparison = model.beside(best_model)
        if comparison.is_better:
            needed = tuple(
                name
                for name in model.names
                if all(model.beside(smaller).is_clear for smaller in smaller_models if name not in smaller.names)
            )
            break
        comparisons |= dict.fromkeys(_without(model.names, *best_model.names), comparison)
        model = best_model
    if wanted_names is None and not (comparison := model.beside(plain_model)).is_better:
        comparisons |= dict.fromkeys(model.names, comparison)
        model = plain_model
    return ModelChoice(model, plain_model, _without(candidate_names, *model.names), comparisons, needed)


def _without(names: Sequence[str], *removed_name: str) -> tuple[str, ...]:
    return tuple(name for name in names if name not in removed_name)


class _HeldOut:
    """One motor of some logs, in blocks."""

    def __init__(self, logs: Sequence[MotorLog], motor: int, degrees: float):
        self.degrees, self.line = degrees, line_numbers(logs, motor)
        self._records = {reading: [motor_record(log, motor, reading, False) for log in logs] for reading in WORDS}
        first = next(iter(self._records.values()))
        self.earliest = earliest(first)
        self.long_enough = sum(_measured(record).sum() for record in first) >= BLOCKS * LEAST_BLOCK

    def is_plausible(self, model: MotorModel, name: str) -> bool:
        """Whether a number of NUMBERS is one: no dead band of 0, and no latency before any that a filter explains."""
        values = [value for key, value in model.values.items() if key.partition(".")[0] == name]
        return all(value > 0.0 if name == BAND else value > self.earliest or name == OFFSET for value in values)

    def model(self, reading: str, names: Sequence[str], near_values: Mapping[str, float] | None = None) -> MotorModel:
        """The model with these numbers, and how well it predicts what it was not fitted to. near_values: where its fit
        begins, None: where every fit does.
        """
        records = self._records[reading]
        problem = _problem(records, names)
        full_fit = solved(problem, self.degrees, near_values or self.line, near_values is None)
        block, error_limit = (
            _blocks(records),
            ERROR_LIMIT * np.sqrt(full_fit.state.variance) if self.degrees else np.inf,
        )
        squares, rows = np.zeros((2, BLOCKS, len(problem.columns)))
        for fold in range(FOLDS):
            point = self._without(records, [record_blocks % FOLDS == fold for record_blocks in block], names, full_fit)
            outputs = problem.engine.outputs(point)
            for piece, (predicted, _) in zip(problem.pieces, outputs, strict=True):
                column_indices = [problem.columns.index(column) for column in piece.record.columns]
                piece_blocks = block[next(k for k, record in enumerate(records) if record is piece.record)]
                error = np.clip(
                    piece.record.outputs - predicted, -np.broadcast_to(error_limit, len(column_indices)), error_limit
                )
                counted_rows = np.isfinite(error) & (piece_blocks % FOLDS == fold)[:, None]
                counted_rows[: piece.first] = counted_rows[piece.last + 1 :] = False
                for c, column in enumerate(column_indices):
                    counted_column = counted_rows[:, c]
                    squares[:, column] += np.bincount(
                        piece_blocks[counted_column], error[counted_column, c] ** 2, BLOCKS
                    )
                    rows[:, column] += np.bincount(piece_blocks[counted_column], minlength=BLOCKS)
        spread = _spread(records, problem)
        mean = squares.sum(axis=0) / np.maximum(rows.sum(axis=0), 1.0) / spread
        return MotorModel(
            tuple(names),
            reading,
            dict(zip(problem.names, full_fit.state.point.values.tolist(), strict=True)),
            (squares / np.maximum(rows, 1.0) / spread).mean(axis=1),
            float(np.exp(0.5 * np.log(np.maximum(mean, 1e-300)).mean())),
        )

    def _without(
        self,
        records: Sequence[MotorRecord],
        held_out_rows: Sequence[FloatArray],
        names: Sequence[str],
        full_fit: Solution,
    ) -> Point:
        """The fit without the outputs of the rows `held_out_rows` of each record, near that to all."""
        kept_records = [
            replace(record, outputs=np.where(record_mask[:, None], np.nan, record.outputs))
            for record, record_mask in zip(records, held_out_rows, strict=True)
        ]
        problem = _problem(kept_records, names)
        solver = Solver(problem, problem.engine, self.degrees)
        scales = full_fit.state.variance if self.degrees else None
        return solver.minimise(full_fit.state.point, BLOCK_ITERATIONS, scales=scales).state.point


def _problem(records: Sequence[MotorRecord], names: Sequence[str]) -> MotorProblem:
    return motor_problem(records, BAND in names, LATENCY in names, OFFSET in names, margin=True)


def _measured(record: MotorRecord) -> IntArray:
    """1 for each row in which something was measured. Shape (rows,)."""
    return np.where(np.isfinite(record.outputs).any(axis=1), 1, 0)


def _blocks(records: Sequence[MotorRecord]) -> list[IntArray]:
    """The number of the block of each row of each record, by the rows in which something was measured."""
    rows = np.concatenate([_measured(record) for record in records])
    count = np.cumsum(rows) - 1
    block = np.maximum(count, 0) * BLOCKS // (int(count[-1]) + 1)
    return np.split(block, np.cumsum([len(record.t) for record in records])[:-1])


def _spread(records: Sequence[MotorRecord], problem: MotorProblem) -> FloatArray:
    """Variance of each output over all records. Shape (columns,)."""
    squares = []
    for column in problem.columns:
        parts = [r.outputs[:, r.columns.index(column)] for r in records if column in r.columns]
        squares.append(float(np.nanvar(np.concatenate(parts))) or 1.0)
    return np.array(squares)


def written_and_plain(logs: Sequence[MotorLog], motor: int, method: MotorFit) -> tuple[MotorEstimate, MotorEstimate]:
    """(a motor by the numbers that improve held-out blocks, or those that are asked for; by slope and lag alone).

    Raises InputError for a nuisance that motors do not have, and what `fit_motor` raises.
    """
    wanted_names = None if method.nuisances is None else _wanted(method.nuisances)
    choice = choose_model(logs, motor, method.between, method.loss, wanted_names)
    runs = [log.run for log in logs]

    def fit(names: Sequence[str], model: MotorModel | None) -> MotorEstimate:
        return fit_motor(
            runs,
            motor,
            dead_band=BAND in names,
            offset=OFFSET in names,
            latency=LATENCY in names,
            kind=logs[0].kind,
            between=model.between if model else method.between,
            loss=method.loss,
            start=model.values if model else None,
        )

    if choice is None:
        return fit(wanted_names or (BAND,), None), fit((), None)
    written_fit = fit(choice.model.names, choice.model)
    unseen: dict[str, tuple[float, float]] = {}
    while wanted_names is None and (
        reaching := _reaching_zero(written_fit, _without(choice.model.names, *choice.needed))
    ):
        unseen |= reaching
        choice = choose_model(logs, motor, method.between, method.loss, unseen=tuple(unseen)) or choice
        written_fit = fit(choice.model.names, choice.model)
    model, plain_model = choice.model, choice.plain_model
    intervals = unseen | {name: _interval(fit((*model.names, name), model), name) for name in choice.rejected}
    blocks = HeldOut(model.size, plain_model.size, comparison=model.beside(plain_model) if model.names else None)
    notes = tuple(written_fit.late_statements(min(log.step for log in logs)))
    follows_input = blocks.written < ANSWERS
    if follows_input and not written_fit.answers:
        notes += (Statement("answers_by_free_run", WARNING),)
    return replace(
        written_fit,
        blocks=blocks,
        rejected=intervals,
        comparisons=choice.comparisons,
        answers=written_fit.answers or follows_input,
        warnings=(*written_fit.warnings, *notes),
    ), fit((), plain_model)


def _reaching_zero(fit: MotorEstimate, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """The numbers of NUMBERS that a fit does not tell from 0, with their intervals: the first of them."""
    ends = {name: _interval(fit, name) for name in reversed(NUMBERS) if name in names}
    return dict([item for item in ends.items() if item[1][0] <= 0.0 <= item[1][1]][:1])


def _interval(fit: MotorEstimate, name: str) -> tuple[float, float]:
    """The interval of one of NUMBERS; of latencies that of the first."""
    return next(ends for key, ends in fit.ci95.items() if key.partition(".")[0] == name)


def _wanted(nuisances: Sequence[str]) -> tuple[str, ...]:
    """The numbers beside slope and lag that are asked for: a dead band with whatever nuisances."""
    kinds = [name.partition(".")[0] for name in nuisances]
    for name, kind in zip(nuisances, kinds, strict=True):
        if kind not in NUMBERS:
            raise InputError("no such nuisance of motors", got=name, expected=", ".join(NUMBERS), where="nuisances")
    return tuple(name for name in NUMBERS if name in (BAND, *kinds))
