"""Counters and clocks that begin again, or start over: what the reader mended, and what stands in a Run."""

from __future__ import annotations

import numpy as np

from omnidyn.errors import InputError
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.logs.channels import place
from omnidyn.logs.clock.counters import unrolled
from omnidyn.logs.clock.restarts import COUNTER, EPISODE, FULL
from omnidyn.logs.log import Log
from omnidyn.statement import ERROR


def restarts_of(log: Log) -> list[Finding]:
    """What the reader found to begin again or to start over."""
    restarts = [restart for restart in log.restarts if restart.code != EPISODE]  # of these a note of the reader tells
    return [
        Finding(**vars(restart.statement), rows=((restart.line, restart.line),) * restart.is_gap, count=+restart.is_gap)
        for restart in restarts
    ]


def check_counters(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Jumps of angles that no reader saw, as those of a Run made in memory; they are taken out."""
    found: list[Finding] = []
    if work.log.columns.columns:
        return found, work
    for component, values in work.sampled_columns("wheel_angle"):
        try:
            going_on, period, rows = unrolled(values, "rad", component, work.t)
        except InputError:  # too fast to be followed: no jump can be told from motion
            continue
        if period is None and not rows:
            continue
        bad = np.zeros(len(work), dtype=bool)
        bad[list(rows)] = True
        found.append(Finding(
            COUNTER if rows else FULL, ERROR, component, {} if period is None else {"period_rad": period},
            "of_run", rows=work.lines(bad), count=len(rows),
        ))  # fmt: skip
        angle = work.channels["wheel_angle"].copy()
        angle[:, place(component)[1]] = going_on  # type: ignore[index]
        work = work.replace(wheel_angle=angle)
    return found, work
