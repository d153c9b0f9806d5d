"""One motor of some logs as a problem of output error: the outputs that count, pieces, free numbers, where to begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.motors.between import CURVE, MEAN, SUB, refined
from omnidyn.identification.motors.engine import ANGLE, SPEED, MotorProblem
from omnidyn.identification.motors.estimate import BAND, LAG, LATENCY, SLOPE
from omnidyn.identification.motors.log import MotorLog, rows_with
from omnidyn.identification.output_error.problem.nuisances import EARLIEST, LATEST
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import Piece, Point
from omnidyn.identification.output_error.problem.record import SHORTEST, Record
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.model.layout import N_AXES, YAW


def motor_record(log: MotorLog, motor: int, between: str, angle: bool) -> Record:
    """One motor of a log; rows whose input the log does not resolve have no outputs. angle: is an output too.

    Raises InputError for a motor that the log does not have, InsufficientDataError where no piece is long enough.
    """
    if motor >= log.put_in.shape[1]:
        raise InputError("no such motor", got=motor + 1, expected=f"1 to {log.put_in.shape[1]}", where=log.run.source)
    measured = {SPEED: log.speed, ANGLE: log.angle if angle or log.speed is None else None}
    outputs = {
        name: column[:, motor] for name, column in measured.items()
        if column is not None and np.isfinite(column[:, motor]).any()
    }  # fmt: skip
    if not outputs:
        raise InputError("the log has no speed and no angle of this motor", got=", ".join(log.run.channels),
                         expected="wheel_speed or wheel_angle", where=log.run.source)  # fmt: skip
    t, u = log.t, log.put_in[:, motor]
    values = np.stack([*outputs.values()], axis=1)
    values[unresolved_rows(u)] = np.nan
    if between == MEAN:
        u = np.append(0.5 * (u[1:] + u[:-1]), u[-1])
    pieces = [rows for rows in rows_with(np.isfinite(u), log.pieces) if rows[1] - rows[0] + 1 >= SHORTEST]
    if not pieces:
        raise InsufficientDataError(
            "no stretch of the log has inputs throughout", got=f"{int(np.isfinite(u).sum())} rows",
            expected=f"{SHORTEST} rows in a row", where=log.run.source,
        )  # fmt: skip
    if between == CURVE:
        t, u, values = refined(t, u, values, pieces)
        pieces = [(SUB * first, SUB * last) for first, last in pieces]
    return Record(
        t, np.nan_to_num(u)[:, None], values, tuple(outputs), (0.0,) * len(outputs),
        tuple(pieces), log.run.source, False, (),
    )  # fmt: skip


def motor_problem(records: Sequence[Record], dead_band: bool, latency: bool) -> MotorProblem:
    """Free numbers and pieces; each piece starts at a fitted speed, and its angle at a fitted one."""
    most = max(float(np.abs(r.voltage).max()) for r in records)
    if most == 0.0:
        raise InsufficientDataError("the motor was never driven", got="an input of 0 throughout", expected="an input")
    numbers = [Parameter(SLOPE, 1.0, 1e-9, 1e9, True), Parameter(LAG, 0.1, 1e-5, 1e3, True)]
    if dead_band:
        numbers.append(Parameter(BAND, 0.0, 0.0, 0.5 * most))
    columns = dict.fromkeys(name for r in records for name, _ in r.columns) if latency else ()
    late = [Parameter(f"{LATENCY}.{name}", 0.0, EARLIEST, LATEST) for name in columns]
    return MotorProblem(
        (*numbers, *late), tuple(_piece(r, first, last, latency) for r in records for first, last in r.pieces)
    )


def _piece(record: Record, first: int, last: int, latency: bool) -> Piece:
    start, offset = np.zeros(N_AXES), np.zeros(len(record.columns))
    for c, name in enumerate(record.columns):
        column = record.outputs[first : last + 1, c]
        known = column[np.isfinite(column)]
        begin = float(known[0]) if known.size else 0.0
        if name == ANGLE:
            offset[c] = begin
        else:
            start[YAW] = begin
    free = np.array([False, False, True, *(name == ANGLE for name in record.columns)])
    margin = min(LATEST, 0.1 * float(record.t[last] - record.t[first])) if latency else 0.0
    return Piece(record, first, last, start, offset, free, np.full(len(record.columns), margin))


def begin(problem: MotorProblem, lag: float) -> Point:
    """Slope by the regression of the input on the speed that it would bring about without a dead band."""
    point = problem.start()
    up = low = 0.0
    for r in {id(piece.record): piece.record for piece in problem.pieces}.values():
        known = np.isfinite(r.outputs[:, 0])
        speed = r.outputs[known, 0]
        if SPEED not in r.columns:
            speed = np.gradient(speed, r.t[known]) if len(speed) > 1 else np.zeros_like(speed)
        up += float(np.abs(r.voltage[known, 0]).sum())
        low += float(np.abs(speed).sum())
    values = point.values.copy()
    values[0], values[1] = up / low if low > 0.0 else 1.0, lag
    return replace(point, values=values)
