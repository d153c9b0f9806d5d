"""Logs as the fit of one motor sees them: its input, its speed and angle, and the rows that can tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.motors.engine import AXIS, BAND, INNER, LAG, SLOPE
from omnidyn.identification.motors.input import SUB, refined
from omnidyn.identification.output_error.problem.nuisances import EARLIEST, LATENCY, LATEST
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import Piece, Point, Problem
from omnidyn.identification.output_error.problem.record import SHORTEST, Record
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.logs.segments import segments
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.statistics import stretches

FloatArray = NDArray[np.float64]

HOLD, MEAN, CURVE = "hold", "mean", "curve"  # what the input does from row to row
INPUTS = {"voltage": "V", "duty": "1"}


def motor_records(runs: Sequence[Run], motor: int, kind: str, between: str, angle: bool) -> tuple[list[Record], str]:
    """The runs with one input and the outputs of one motor, and the unit of the input."""
    found = []
    names = [name for name in INPUTS if name == kind or not kind]
    if kind and kind not in INPUTS:
        raise InputError("no such input", got=kind, expected=" or ".join(INPUTS), where="kind")
    if not runs:
        raise InputError("nothing to fit to", got="no runs", expected="one or more", where="runs")
    chosen = next((n for n in names if all(getattr(run, n) is not None for run in runs)), "")
    if not chosen:
        raise InputError("the logs have no input of this motor", got=", ".join(runs[0].channels),
                         expected=" or ".join(names), where=runs[0].source)  # fmt: skip
    for run in runs:
        found.append(_record(run.as_measured(), motor, getattr(run, chosen), between, angle))
    return found, INPUTS[chosen]


def _record(run: Run, motor: int, put_in: FloatArray, between: str, angle: bool) -> Record:
    if motor >= put_in.shape[1]:
        raise InputError("no such motor", got=motor + 1, expected=f"1 to {put_in.shape[1]}", where=run.source)
    outputs: dict[str, FloatArray] = {}
    if run.wheel_speed is not None and np.isfinite(run.wheel_speed[:, motor]).any():
        outputs["wheel_speed"] = run.wheel_speed[:, motor]
    if angle and run.wheel_angle is not None and np.isfinite(run.wheel_angle[:, motor]).any():
        outputs["heading"] = run.wheel_angle[:, motor]
    if not outputs:
        raise InputError("the log has no speed and no angle of this motor", got=", ".join(run.channels),
                         expected="wheel_speed or wheel_angle", where=run.source)  # fmt: skip
    u = put_in[:, motor]
    rough, t, known = unresolved_rows(u), run.t, np.isfinite(u)
    outputs = {name: np.where(rough, np.nan, column) for name, column in outputs.items()}
    if between == MEAN:
        u = np.append(0.5 * (u[1:] + u[:-1]), u[-1])
        known = np.isfinite(u)
    pieces = [
        (s.start + int(a), s.start + int(b) - 1) for s in segments(t) for a, b in stretches(known[s]).tolist()
        if b - a >= SHORTEST
    ]  # fmt: skip
    if not pieces:
        raise InsufficientDataError(
            "no stretch of the log has inputs throughout", got=f"{int(np.isfinite(u).sum())} rows",
            expected=f"{SHORTEST} rows in a row", where=run.source,
        )  # fmt: skip
    measured = np.stack([*outputs.values()], axis=1)
    if between == CURVE:
        t, u, measured = refined(t, u, measured, pieces)
        pieces = [(SUB * first, SUB * last) for first, last in pieces]
    return Record(
        t, np.ascontiguousarray(np.nan_to_num(u)[:, None]), measured,
        tuple((name, 0) for name in outputs), (0.0,) * len(outputs), tuple(pieces), run.source, False, (),
    )  # fmt: skip


def motor_problem(records: Sequence[Record], dead_band: bool, latency: bool) -> Problem:
    """Free numbers and pieces; each piece starts at a fitted speed, and its angle at a fitted one."""
    most = max(float(np.abs(r.voltage).max()) for r in records)
    if most == 0.0:
        raise InsufficientDataError("the motor was never driven", got="an input of 0 throughout", expected="an input")
    numbers = [Parameter(INNER + SLOPE, 1.0, 1e-9, 1e9, True), Parameter(INNER + LAG, 0.1, 1e-5, 1e3, True)]
    if dead_band:
        numbers.append(Parameter(INNER + BAND, 0.0, 0.0, 0.5 * most))
    columns = dict.fromkeys(name for r in records for name, _ in r.columns)
    late = [Parameter(f"{LATENCY}.{name}", 0.0, EARLIEST, LATEST) for name in columns] if latency else []
    pieces = [_piece(r, first, last, latency) for r in records for first, last in r.pieces]
    # The robot is not used: a problem has one.
    return Problem(load_robot("axebot"), (*numbers, *late), len(numbers), tuple(pieces))


def _piece(record: Record, first: int, last: int, latency: bool) -> Piece:
    names = [name for name, _ in record.columns]
    start, offset = np.zeros(3), np.zeros(len(names))
    for c, name in enumerate(names):
        column = record.outputs[first : last + 1, c]
        known = column[np.isfinite(column)]
        begin = float(known[0]) if known.size else 0.0
        if name == "heading":
            offset[c] = begin
        else:
            start[AXIS] = begin
    free = np.array([False, False, True, *(name == "heading" for name in names)])
    margin = min(LATEST, 0.1 * float(record.t[last] - record.t[first])) if latency else 0.0
    return Piece(record, first, last, start, offset, free, np.full(len(names), margin))


def begin(problem: Problem, records: Sequence[Record], lag: float) -> Point:
    """Slope by the regression of the input on the speed that it would bring about without a dead band."""
    point = problem.start()
    up = low = 0.0
    for r in records:
        names = [name for name, _ in r.columns]
        speed = (
            r.outputs[:, names.index("wheel_speed")] if "wheel_speed" in names else np.gradient(r.outputs[:, 0], r.t)
        )
        known = np.isfinite(speed)
        up += float(np.abs(r.voltage[known, 0]).sum())
        low += float(np.abs(speed[known]).sum())
    values = point.values.copy()
    values[0], values[1] = up / low if low > 0.0 else 1.0, lag
    return replace(point, values=values)
