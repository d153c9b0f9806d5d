"""Counters and clocks that begin again, or start over: what the reader mended, and what stands in a Run."""

from __future__ import annotations

import numpy as np

from omnidyn.errors import InputError
from omnidyn.findings.finding import FATAL, NOTE, WARN, Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.logs.channels import place
from omnidyn.logs.clock.counters import unrolled
from omnidyn.logs.clock.restarts import COUNTER, EPISODE, FULL
from omnidyn.logs.log import Log


def restarts_of(log: Log) -> list[Finding]:
    """What the reader found to begin again or to start over."""
    found = []
    for each in (each for each in log.restarts if each.code != EPISODE):  # of these a note of the reader tells
        level = FATAL if not each.mended else NOTE if each.code == FULL else WARN
        rows = ((each.line, each.line),) if each.is_gap else ()
        found.append(Finding(each.code, level, each.where, each.words, each.remedy, rows, len(rows)))
    return found


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
        over = "" if period is None else f"{component} starts over after {period:.6g} rad"
        jumps = f"{component} jumps farther than a wheel turns" if rows else ""
        found.append(Finding(
            COUNTER if rows else FULL, FATAL, component, " and ".join(filter(None, (jumps, over))),
            "split the run there" if rows else "unwrap the angle", work.lines(bad), len(rows), {},
        ))  # fmt: skip
        angle = work.channels["wheel_angle"].copy()
        angle[:, place(component)[1]] = going_on  # type: ignore[index]
        work = work.replace(wheel_angle=angle)
    return found, work
