"""Small things that a reader of a log should know: bursts of a tracker, a last row that is not like the others."""

from __future__ import annotations

import numpy as np

from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import INPUTS, MIN_ROWS, LogUnderCheck
from omnidyn.statement import NOTE
from omnidyn.statistics import stretches

BURST, SHORT_TIME = 10.0, 0.25  # times what 90 % of the rows stay below; [s]


def check_oddities(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Notes; nothing is masked."""
    if len(work) < MIN_ROWS:
        return [], work
    return _bursts(work) + _last_row(work), work


def _bursts(work: LogUnderCheck) -> list[Finding]:
    """Speeds over the floor that shoot up for a moment, in a log without wheel speeds to hold them against."""
    if work.get("wheel_speed") is not None:
        return []
    findings = []
    for component, values in work.columns("twist"):
        size = np.abs(values)
        usual = float(np.nanquantile(size, 0.9))
        mask = np.zeros(len(work), dtype=bool)
        for a, b in stretches(size > BURST * usual):
            mask[a:b] = work.t[min(b, len(work) - 1)] - work.t[a] < SHORT_TIME
        if usual <= 0.0 or not mask.any():
            continue
        top = int(np.flatnonzero(mask)[np.argmax(size[mask])])
        findings.append(
            Finding(
                "burst",
                NOTE,
                component,
                {"farthest": float(values[top]), "usual": usual, "at_s": float(work.t[top]), "longest_s": SHORT_TIME},
                rows=work.lines(mask),
                count=int(mask.sum()),
            )
        )
    return findings


def _last_row(work: LogUnderCheck) -> list[Finding]:
    """Commands that are 0 in the last row only: the recorder stopped the robot, the row is no part of the run."""
    for channel in INPUTS:
        values = work.get(channel)
        if values is not None and not values[-1].any() and values[-2].any() and np.isfinite(values[-2:]).all():
            mask = np.arange(len(work)) == len(work) - 1
            return [Finding("last_row", NOTE, channel, rows=work.lines(mask), count=1)]
    return []
