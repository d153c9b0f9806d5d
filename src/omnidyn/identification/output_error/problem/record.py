"""A Run as the kernels read it: voltages before the driver, outputs in columns, pieces without a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.clocks import usual_step
from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.findings.needs import LOOP_REMEDY, has_set_speeds
from omnidyn.identification.output_error.problem.differences import Differences
from omnidyn.identification.output_error.problem.outputs import LOG, outputs_of
from omnidyn.logs.segments import segments
from omnidyn.model.actuation import asked_voltage, clip_voltage, mapped
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import refuse_slope
from omnidyn.model.wheels import refuse_slip, wheel_speed
from omnidyn.run import Run
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import stretches

SHORTEST = 3  # rows of a piece that is used


@dataclass(frozen=True, eq=False)
class Record:
    """One run. t (rows,); voltage (rows, W); outputs (rows, C), columns named by (channel, index).

    ticks (C,): of columns that are counts [rad], 0 for the others. pieces: (first, last) rows of what has no gap.
    is_nominal_supply: whether the voltage is a duty times a supply that was not logged. notes: what was decided on the
    way.
    unused_notes: what the log holds and a fit does not use, and why.
    set_point (rows, W): set speeds of the wheels [rad/s] where the loop in the firmware makes the voltage, which is 0
    here then; else None. run: what it was read from.

    Its arrays are read-only and in C order, whoever made them: a kernel for others would be compiled beside.
    """

    t: FloatArray
    voltage: FloatArray
    outputs: FloatArray
    columns: tuple[tuple[str, int], ...]
    ticks: tuple[float, ...]
    pieces: tuple[tuple[int, int], ...]
    source: str
    is_nominal_supply: bool
    notes: tuple[Statement, ...]
    set_point: FloatArray | None = None
    unused_notes: tuple[Statement, ...] = ()
    run: Run | None = None

    def __post_init__(self) -> None:
        for name in ("t", "voltage", "outputs", "set_point"):
            field_value = getattr(self, name)
            if field_value is not None:
                object.__setattr__(self, name, _read_only(field_value))

    @property
    def staggered(self) -> bool:
        """Whether its outputs have clocks of their own: a row is then one of several sensors."""
        return self.run is not None and self.run.staggered

    def step_of(self, rows: slice) -> float:
        """Usual time between two of these rows [s]; of the fastest output where each has a clock of its own."""
        return self.run.step if self.run is not None and self.staggered else usual_step(self.t[rows])

    @property
    def span(self) -> float:
        return float(self.t[-1] - self.t[0]) or 1.0

    @property
    def share(self) -> FloatArray:
        """How much of the run has gone by, 0 to 1. Shape (rows,)."""
        return (self.t - self.t[0]) / self.span


def _read_only(values: FloatArray) -> FloatArray:
    read_only_view = np.ascontiguousarray(values).view()
    read_only_view.flags.writeable = False
    return read_only_view


def record(
    run: Run,
    robot: Robot,
    outputs: Sequence[str] | None = None,
    loop: bool = False,
    tick_rad: float | None = None,
    count_differences: Differences | None = None,
) -> Record:
    """Raises InputError for a run without inputs or outputs, InsufficientDataError where no piece is long enough.

    loop: take the set speeds even where a voltage was logged, for its gains are asked for. outputs, tick_rad,
    count_differences: as in outputs.py.
    """
    source = run.source or LOG
    refuse_slope(robot.floor, "a fit starts from")
    if run.wheels is not None and run.wheels != robot.wheels.count:
        raise InputError(
            "the log has another number of wheels",
            got=run.wheels,
            expected=f"{robot.wheels.count}, as {robot.name} has",
            where=run.source,
            remedy="give the robot that the log is of",
        )
    set_point = _set_point(run, robot, loop)
    if set_point is not None:
        refuse_slip(robot.wheels, "a fit through a speed loop knows")
    voltage, is_nominal_supply, notes = (
        _voltage(run, robot) if set_point is None else (np.zeros_like(set_point), False, [])
    )
    clipped_voltage = clip_voltage(robot.motor, voltage)
    beyond_limit = np.abs(clipped_voltage) < np.abs(voltage)
    if beyond_limit.any():
        rows = {"rows": int(beyond_limit.any(axis=1).sum())}
        notes.append(Statement("input_beyond_limit", WARNING, source, rows))
        voltage = clipped_voltage
    voltage = mapped(robot, voltage)
    log_outputs = outputs_of(run, robot, outputs, tick_rad, count_differences)
    inputs = voltage if set_point is None else set_point
    finite = np.isfinite(inputs)
    _refuse_wheels_without_input(run, robot, finite)
    known_rows = np.full(len(run), True) if finite.all() else np.asarray(finite.all(axis=1))
    parts = segments(run.t, usual=run.step)
    pieces = [piece for s in _cut(parts, log_outputs.lost) for piece in _whole(known_rows, s.start, s.stop)]
    if len(parts) > 1:
        lost = [float(run.t[b.start] - run.t[a.stop - 1]) for a, b in pairwise(parts)]
        notes.append(Statement("split_at_gaps", NOTE, source, {"gaps": len(lost), "longest": max(lost)}))
    if not pieces:
        raise InsufficientDataError(
            "no stretch of the log has inputs throughout",
            got=f"{int(known_rows.sum())} rows of {len(run)} with all inputs",
            expected=f"{SHORTEST} rows in a row",
            where=run.source,
            remedy="log the voltage or the duty of every wheel in every row",
        )
    if not known_rows.all():
        notes.append(Statement("split_at_missing_inputs", NOTE, source, {"rows": int((~known_rows).sum())}))
    if log_outputs.lost is not None and (lost_count := int(log_outputs.lost[1:].sum())):
        notes.append(Statement("split_at_missing_counts", NOTE, source, {"rows": lost_count}))
    return Record(
        run.t,
        voltage,
        log_outputs.values,
        log_outputs.columns,
        log_outputs.ticks,
        tuple(pieces),
        run.source,
        is_nominal_supply,
        (*notes, *log_outputs.notes),
        set_point,
        (*_unused_inputs(run, set_point is not None), *log_outputs.unused_notes),
        run,
    )


def _unused_inputs(run: Run, has_loop: bool) -> list[Statement]:
    """Inputs that drive nothing, and what does. has_loop: the speed loop of the robot file makes the voltage."""
    volts = "speed_loop" if has_loop else "voltage" if run.voltage is not None else ""
    reason_by_input = {
        "voltage": "speed_loop" if has_loop else "",
        "duty": volts,
        "supply": volts,
        "wheel_speed_command": "" if has_loop else "motor_voltage",
        "twist_command": "wheel_speed_command" if has_loop else "motor_voltage",
    }
    if has_loop and run.wheel_speed_command is None:
        reason_by_input["twist_command"] = ""
    return [
        Statement("input_not_used", NOTE, name, {"driver": driver})
        for name, driver in reason_by_input.items()
        if driver and getattr(run, name) is not None
    ]


def _refuse_wheels_without_input(run: Run, robot: Robot, finite: BoolArray) -> None:
    """A log of fewer wheels than the robot has leaves the others without a number. finite (rows, W): of the inputs."""
    if finite.all():
        return
    empty = np.flatnonzero(~finite.any(axis=0))
    if 0 < len(empty) < finite.shape[1]:
        raise InputError(
            "wheels without any input",
            got=", ".join(f"none for wheel {w + 1}" for w in empty),
            where=run.source,
            expected=f"one for each of the {robot.wheels.count} wheels of {robot.name}",
            remedy="take the robot of this log, or map its column to the wheel",
        )


def _voltage(run: Run, robot: Robot) -> tuple[FloatArray, bool, list[Statement]]:
    """(voltages, whether the supply is only nominal, notes)."""
    nominal = robot.drive.supply
    voltage = asked_voltage(run.voltage, run.duty, run.supply, nominal)
    if voltage is not None:
        is_nominal_supply = run.voltage is None and run.supply is None
        supply_note = Statement("supply_nominal", WARNING, run.source or LOG, {"supply": nominal})
        return voltage, is_nominal_supply, [supply_note] if is_nominal_supply else []
    if run.duty is not None:
        raise InputError(
            "a duty needs a supply",
            got="neither a supply column nor [drive] supply_V",
            where=run.source,
            remedy="add supply_V to the robot file",
        )
    if has_set_speeds(run):
        raise UnsupportedError(
            "only set speeds are logged, and the robot has no speed loop to follow them",
            got=", ".join(run.channels),
            expected="voltage or duty, or the speed loop of the firmware",
            where=run.source,
            remedy=LOOP_REMEDY,
        )
    raise InputError("the log has no input", got=", ".join(run.channels), expected="voltage or duty", where=run.source)


def _set_point(run: Run, robot: Robot, loop: bool) -> FloatArray | None:
    """Set speeds of the wheels [rad/s] where the loop of the robot file has to follow them. Shape (rows, W)."""
    if robot.drive.kind != SPEED or (not loop and (run.voltage is not None or run.duty is not None)):
        return None
    if run.wheel_speed_command is not None:
        return np.ascontiguousarray(run.wheel_speed_command)
    return None if run.twist_command is None else wheel_speed(robot.wheels, run.twist_command)


def _cut(parts: Sequence[slice], lost: BoolArray | None) -> list[slice]:
    """Parts of a log, cut before the rows of `lost`, where an angle begins anew."""
    if lost is None:
        return list(parts)
    cut_rows = [[s.start, *(s.start + 1 + np.flatnonzero(lost[s.start + 1 : s.stop])).tolist(), s.stop] for s in parts]
    return [slice(a, b) for edges in cut_rows for a, b in pairwise(edges)]


def _whole(known_rows: BoolArray, start: int, stop: int) -> list[tuple[int, int]]:
    """Stretches of rows with all inputs, (first, last). The last row needs none: nothing follows it."""
    if known_rows[start : stop - 1].all():
        return [(start, stop - 1)] if stop - start >= SHORTEST else []
    row_stretches = start + stretches(known_rows[start:stop])
    return [(int(a), int(b) - 1) for a, b in row_stretches if b - a >= SHORTEST]
