"""Time: order, repeated stamps, gaps, jitter, padding, and whether it is in seconds at all."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, IntArray
from omnidyn.errors import InputError
from omnidyn.findings.finding import Finding, spans_of
from omnidyn.findings.signal.clocks import at_each_clock, leading, with_speed
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.logs.channels import place
from omnidyn.logs.clock.counters import unrolled
from omnidyn.logs.clock.restarts import COUNTER, EPISODE, FULL
from omnidyn.logs.log import MAX_MISSING, Log, goes_back_often
from omnidyn.logs.segments import GAP
from omnidyn.model.robot import Robot
from omnidyn.statement import ERROR, NOTE, WARNING
from omnidyn.statistics import robust_std

JITTER_WARN, JITTER_NOTE = 0.5, 0.1  # spread of the steps, of the usual step
LONGEST_STEP, SHORTEST_STEP = 2.0, 2e-5  # [s] outside of which no robot is logged


def begin(log: Log, robot: Robot | None) -> tuple[list[Finding], LogUnderCheck]:
    """The findings on time, and the log under check: the rows that have a time, sorted, each time once."""
    findings: list[Finding] = []
    rows = np.arange(len(log))
    empty = log.empty_rows() if len(log) else np.zeros(0, dtype=bool)
    findings += _empty_rows(log, empty)
    rows = rows[~empty]
    padding = log.rows(rows).padding_rows() if rows.size else np.zeros(0, dtype=bool)
    findings += _padded(log, rows[padding])
    rows = rows[~padding]
    findings += _backward(log, rows)
    rows = rows[np.argsort(log.t[rows], kind="stable")]
    again = np.concatenate([[False], np.diff(log.t[rows]) == 0.0]) if rows.size else np.zeros(0, dtype=bool)
    findings += _repeated(log, rows, again) + restarts_of(log)
    rows = rows[~again]
    new_findings, work = at_each_clock(leading(log, robot, rows), check_counters)
    findings, work = findings + new_findings, with_speed(work)
    if work.get("wheel_speed") is not None and work.derived_speed:
        findings.append(Finding("speed_from_angle", NOTE))
    return findings + _gaps(work) + _jitter(work) + _unit(work) + _few(work), work


def _empty_rows(log: Log, empty: BoolArray) -> list[Finding]:
    count = int(empty.sum())
    if not count:
        return []
    share = count / len(log)
    return [
        Finding(
            "empty_rows",
            ERROR if share > MAX_MISSING else WARNING,
            "",
            {"share": share, "of_rows": len(log)},
            rows=spans_of(empty, log.lines),
            count=count,
        )
    ]


def _padded(log: Log, rows: IntArray) -> list[Finding]:
    if not rows.size:
        return []
    mask = np.zeros(len(log), dtype=bool)
    mask[rows] = True
    return [Finding("padding", WARNING, "t", rows=spans_of(mask, log.lines), count=int(rows.size))]


def _backward(log: Log, rows: IntArray) -> list[Finding]:
    back = np.diff(log.t[rows]) < 0.0
    count = int(back.sum())
    if not count:
        return []
    mask = np.concatenate([[False], back])
    farthest = float(-np.diff(log.t[rows]).min())
    return [
        Finding(
            "time_back",
            ERROR,
            "t",
            {"farthest_s": farthest},
            "often" if goes_back_often(count, len(rows)) else "",
            rows=spans_of(mask, log.lines[rows]),
            count=count,
        )
    ]


def _repeated(log: Log, rows: IntArray, again: BoolArray) -> list[Finding]:
    count = int(again.sum())
    if not count:
        return []
    share = count / len(rows)
    order = np.argsort(rows[again], kind="stable")
    mask = np.zeros(len(log), dtype=bool)
    mask[rows[again][order]] = True
    return [
        Finding(
            "time_repeats",
            ERROR if share > MAX_MISSING else WARNING,
            "t",
            {"share": share},
            "often" if share > 0.01 else "",
            rows=spans_of(mask, log.lines),
            count=count,
        )
    ]


def _gaps(work: LogUnderCheck) -> list[Finding]:
    lines = work.log.lines[work.rows]
    restart_lines = [restart.line for restart in work.log.restarts if restart.is_gap]  # a gap of their own
    cuts = [segment.start for segment in work.segments[1:]]
    cuts = [k for k in cuts if not any(lines[k - 1] < line <= lines[k] for line in restart_lines)]
    if not cuts:
        return []
    lengths = np.array([work.t[k] - work.t[k - 1] for k in cuts])
    lost_rows = int(min(np.round(lengths / work.step - 1.0).sum(), 1e15))
    return [
        Finding(
            "gap",
            WARNING,
            "t",
            {
                "longest_s": float(lengths.max()),
                "lost_rows": float(lost_rows),
                "at_s": float(work.t[cuts[int(lengths.argmax())] - 1]),
            },
            rows=tuple((int(lines[k - 1]), int(lines[k])) for k in cuts[:20]),
            count=len(cuts),
        )
    ]


def _jitter(work: LogUnderCheck) -> list[Finding]:
    steps = np.diff(work.t)
    if len(steps) < MIN_ROWS or work.step <= 0.0:
        return []
    relative = float(robust_std(steps, work.step) / work.step)
    low, high = np.quantile(steps, [0.05, 0.95])
    if relative < JITTER_NOTE and (high - low) < 4.0 * JITTER_NOTE * work.step:
        return []
    return [
        Finding(
            "jitter",
            WARNING if relative > JITTER_WARN else NOTE,
            "t",
            {"relative": relative, "step_s": work.step, "low_s": float(low), "high_s": float(high)},
        )
    ]


def _unit(work: LogUnderCheck) -> list[Finding]:
    if len(work) < MIN_ROWS or SHORTEST_STEP <= work.step <= LONGEST_STEP:
        return []
    return [Finding("time_unit", ERROR, "t", {"step_s": work.step})]


def _few(work: LogUnderCheck) -> list[Finding]:
    if len(work) >= MIN_ROWS:
        return []
    return [Finding("few_rows", ERROR if len(work) < 2 else NOTE, "", {"rows": float(len(work))})]


def between(last: tuple[float, int] | None, block: Log, rate: float) -> tuple[list[Finding], tuple[float, int] | None]:
    """(findings on time where two blocks of a log meet, (time, line) of the last row of this one)."""
    timed = np.flatnonzero(np.isfinite(block.t))
    if not timed.size:
        return [], last
    row_end = float(block.t[timed[-1]]), int(block.lines[timed[-1]])
    if last is None or rate <= 0.0:
        return [], row_end
    first, line = float(block.t[timed[0]]), int(block.lines[timed[0]])
    step = first - last[0]
    pair = Log(np.array([last[0], first]), {}, np.array([last[1], line]), source=block.source, restarts=block.restarts)
    if step < 0.0:
        return _backward(pair, np.arange(2)), row_end
    if step == 0.0:
        return _repeated(pair, np.arange(2), np.array([False, True])), row_end
    if step * rate <= GAP:
        return [], row_end
    apart = (slice(0, 1), slice(1, 2))
    return _gaps(LogUnderCheck(pair, None, np.arange(2), pair.t, 1.0 / rate, apart, {})), row_end


# Counters and clocks that begin again, or start over: what the reader mended, and what stands in a Run


def restarts_of(log: Log) -> list[Finding]:
    """What the reader found to begin again or to start over."""
    restarts = [restart for restart in log.restarts if restart.code != EPISODE]  # of these a note of the reader tells
    return [
        Finding(**vars(restart.statement), rows=((restart.line, restart.line),) * restart.is_gap, count=+restart.is_gap)
        for restart in restarts
    ]


def check_counters(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Jumps of angles that no reader saw, as those of a Run made in memory; they are taken out."""
    findings: list[Finding] = []
    if work.log.columns.columns:
        return findings, work
    for component, values in work.sampled_columns("wheel_angle"):
        try:
            going_on, period, rows = unrolled(values, "rad", component, work.t)
        except InputError:  # too fast to be followed: no jump can be told from motion
            continue
        if period is None and not rows:
            continue
        mask = np.zeros(len(work), dtype=bool)
        mask[list(rows)] = True
        findings.append(
            Finding(
                COUNTER if rows else FULL,
                ERROR,
                component,
                {} if period is None else {"period_rad": period},
                "of_run",
                rows=work.lines(mask),
                count=len(rows),
            )
        )
        angle = work.channels["wheel_angle"].copy()
        angle[:, place(component)[1]] = going_on  # type: ignore[index]
        work = work.replace(wheel_angle=angle)
    return findings, work
