"""A measurement that is the command of rows before: software that logs what it sent, in the place of a sensor."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.logs.channels import components
from omnidyn.statement import ERROR

PAIRS = (("twist", "twist_command"), ("wheel_speed", "wheel_speed_command"))
LATEST_ROWS = 3  # rows by which the command may have been written late
ECHO_TOLERANCE = 2e-6  # of the largest command: a number in single precision, written with its digits
SAME_SHARE = 0.99  # share of the rows in which both are the same
CHANGES = 5  # of the commands: a robot that rests, or that a simulator moves at one speed, says nothing


def check_echo(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """An error where a channel is no measurement; it is masked."""
    findings: list[Finding] = []
    for measured, commanded in PAIRS:
        values, command = work.get(measured), work.get(commanded)
        if values is None or command is None or len(work) < MIN_ROWS:
            continue
        rows = next((k for k in range(LATEST_ROWS + 1) if _is_command(work, values, command, k)), None)
        if rows is None:
            continue
        measured_rows = np.asarray(np.isfinite(values).any(axis=1))
        findings.append(
            Finding(
                "echo",
                ERROR,
                " ".join(components(measured, values.shape[1])),
                {"rows": float(rows), "channel": measured},
                rows=work.lines(measured_rows),
                count=len(work),
            )
        )
        work = work.replace(**{measured: None})
    return findings, work


def _is_command(work: LogUnderCheck, values: FloatArray, command: FloatArray, rows: int) -> bool:
    """Whether all of a measurement is the command of so many rows before, and that changes often enough to tell.

    Rows on either side of a gap say nothing.
    """
    later, before = values[rows:], command[: len(command) - rows].copy()
    for segment in work.segments[1:]:
        before[max(0, segment.start - rows) : segment.start] = np.nan
    finite = np.isfinite(later) & np.isfinite(before) & ((later != 0.0) | (before != 0.0))
    size = np.nanmax(np.abs(command), axis=0, initial=0.0)
    equal = np.abs(later - before) <= ECHO_TOLERANCE * np.maximum(size, 1e-9)
    changes = [int(np.count_nonzero(np.diff(column[np.isfinite(column)]))) for column in command.T]
    return sum(changes) >= CHANGES and bool(finite.any()) and float(equal[finite].mean()) >= SAME_SHARE
