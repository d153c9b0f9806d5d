"""One motor of some logs as a problem of output error: the outputs that count, pieces, free numbers, where to begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.motors.estimate import BAND, LAG, LATENCY, OFFSET, SLOPE
from omnidyn.identification.motors.input_between_rows import CURVE, MEAN, SUB, refined
from omnidyn.identification.motors.log import MotorLog, rows_with
from omnidyn.identification.motors.motor_engine import ANGLE, SPEED, MotorProblem
from omnidyn.identification.output_error.problem.nuisances import (
    MOTION_ERRORS,
    SILENT_ROWS,
    errors_from_rest,
)
from omnidyn.identification.output_error.problem.parameters import LEAST_LATENCY, MOST_LATENCY, Parameter
from omnidyn.identification.output_error.problem.problem import Piece, Point
from omnidyn.identification.output_error.problem.record import SHORTEST, Record
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.model.layout import N_AXES, YAW


@dataclass(frozen=True, eq=False)
class MotorRecord(Record):
    """begins_at_rest: whether the log begins at rest under an input that is held. It then has one row more,
    MOST_LATENCY before the
    others: a latency shows what was before the log, and that is known."""

    begins_at_rest: bool = False


def motor_record(log: MotorLog, motor: int, between: str, angle: bool) -> MotorRecord:
    """One motor of a log; rows whose input the log does not resolve have no outputs. angle: is an output too.

    Raises InputError for a motor that the log does not have, InsufficientDataError where no piece is long enough.
    """
    if motor >= log.input_values.shape[1]:
        raise InputError(
            "no such motor", got=motor + 1, expected=f"1 to {log.input_values.shape[1]}", where=log.run.source
        )
    measured = {SPEED: log.speed, ANGLE: log.angle if angle or log.speed is None else None}
    outputs = {
        name: column[:, motor]
        for name, column in measured.items()
        if column is not None and np.isfinite(column[:, motor]).any()
    }
    if not outputs:
        raise InputError(
            "the log has no speed and no angle of this motor",
            got=", ".join(log.run.channels),
            expected="wheel_speed or wheel_angle",
            where=log.run.source,
        )
    t, u = log.t, log.input_values[:, motor]
    values = np.stack([*outputs.values()], axis=1)
    values[unresolved_rows(u)] = np.nan
    if between == MEAN:
        u = np.append(0.5 * (u[1:] + u[:-1]), u[-1])
    pieces = [rows for rows in rows_with(np.isfinite(u), log.pieces) if rows[1] - rows[0] + 1 >= SHORTEST]
    if not pieces:
        raise InsufficientDataError(
            "no stretch of the log has inputs throughout",
            got=f"{int(np.isfinite(u).sum())} rows",
            expected=f"{SHORTEST} rows in a row",
            where=log.run.source,
        )
    begins_at_rest = pieces[0][0] == 0 and _begins_at_rest(
        log.input_values[:, motor], values[:, 0], SPEED not in outputs
    )
    if between == CURVE:
        t, u, values = refined(t, u, values, pieces)
        pieces = [(SUB * first, SUB * last) for first, last in pieces]
    if begins_at_rest:
        t, u = np.append(t[0] - MOST_LATENCY, t), np.append(log.input_values[0, motor], u)
        values = np.concatenate([np.full((1, len(outputs)), np.nan), values])
        pieces = [(first + (first > 0), last + 1) for first, last in pieces]
    return MotorRecord(
        t,
        np.nan_to_num(u)[:, None],
        values,
        tuple(outputs),
        (0.0,) * len(outputs),
        tuple(pieces),
        log.run.source,
        False,
        (),
        begins_at_rest=begins_at_rest,
    )


def _begins_at_rest(u: FloatArray, measured: FloatArray, travels: bool) -> bool:
    """Whether an input is held in the first rows, and nothing visibly moves in them.

    An input that is not 0 may also turn a motor round: that takes more rows. travels: an angle is measured.
    """
    change_rows = np.flatnonzero(u[: 10 * SILENT_ROWS] != u[0])
    rows = int(change_rows[0]) if change_rows.size else min(10 * SILENT_ROWS, len(u))
    first_speeds = np.diff(measured[:rows]) if travels else measured[:rows]
    first_speeds = first_speeds[np.isfinite(first_speeds)]
    if rows < (4 * SILENT_ROWS if u[0] else SILENT_ROWS) or len(first_speeds) < 2:
        return False
    return errors_from_rest(first_speeds, bool(u[0])) <= MOTION_ERRORS


def motor_problem(
    records: Sequence[MotorRecord], dead_band: bool, latency: bool, offset: bool = False, margin: bool = False
) -> MotorProblem:
    """Free numbers and pieces; each piece starts at a fitted speed, and its angle at a fitted one; a log that begins at
    rest starts there. margin: leave out the rows that a latency would leave out, whether one is free or not.
    """
    largest_input = max(float(np.abs(r.voltage).max()) for r in records)
    if largest_input == 0.0:
        raise InsufficientDataError("the motor was never driven", got="an input of 0 throughout", expected="an input")
    numbers = [Parameter(SLOPE, 1.0, 1e-9, 1e9, True), Parameter(LAG, 0.1, 1e-5, 1e3, True)]
    if dead_band:
        numbers.append(Parameter(BAND, 0.0, 0.0, 0.5 * largest_input))
    if offset:
        numbers.append(Parameter(OFFSET, 0.0, -0.5 * largest_input, 0.5 * largest_input))
    columns = dict.fromkeys(name for r in records for name, _ in r.columns) if latency else ()
    latencies = [Parameter(f"{LATENCY}.{name}", 0.0, LEAST_LATENCY, MOST_LATENCY) for name in columns]
    return MotorProblem(
        (*numbers, *latencies),
        tuple(_piece(r, first, last, latency or margin) for r in records for first, last in r.pieces),
    )


def _piece(record: MotorRecord, first: int, last: int, has_latency: bool) -> Piece:
    is_at_rest = record.begins_at_rest and first == 0
    start, offset = np.zeros(N_AXES), np.zeros(len(record.columns))
    for c, name in enumerate(record.columns):
        column = record.outputs[first : last + 1, c]
        known_values = column[np.isfinite(column)]
        first_value = float(known_values[0]) if known_values.size else 0.0
        if name == ANGLE:
            offset[c] = first_value
        elif not is_at_rest:
            start[YAW] = first_value
    free = np.array([False, False, not is_at_rest, *(name == ANGLE for name in record.columns)])
    margin = min(MOST_LATENCY, 0.1 * float(record.t[last] - record.t[first])) if has_latency and not is_at_rest else 0.0
    return Piece(record, first, last, start, offset, free, np.full(len(record.columns), margin))


def begin(problem: MotorProblem, lag: float) -> Point:
    """Slope by the regression of the input on the speed that it would bring about without a dead band."""
    input_sum = low = 0.0
    for r in {id(piece.record): piece.record for piece in problem.pieces}.values():
        known_rows = np.isfinite(r.outputs[:, 0])
        speed = r.outputs[known_rows, 0]
        if SPEED not in r.columns:
            speed = np.gradient(speed, r.t[known_rows]) if len(speed) > 1 else np.zeros_like(speed)
        input_sum += float(np.abs(r.voltage[known_rows, 0]).sum())
        low += float(np.abs(speed).sum())
    return begin_at(problem, {SLOPE: input_sum / low if low > 0.0 else 1.0, LAG: lag})


def begin_at(problem: MotorProblem, values: Mapping[str, float]) -> Point:
    """The start of a problem with these values of its numbers by name."""
    point = problem.start()
    known_values = [values.get(p.name, p.value) for p in problem.parameters]
    return replace(point, values=np.array(known_values))
