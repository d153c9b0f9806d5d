"""check: is this log fit for use? Never raises for what a log holds; says which rows, why, and what to do.

One file per family of checks; the contract of a family stands in signal/log_under_check.py. They run in an order in
which each finds the log without the faults that were found before it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.findings.averaged import check_averaged
from omnidyn.findings.energy import check_energy
from omnidyn.findings.excitation import check_excitation, joined, judge
from omnidyn.findings.filters import check_filters
from omnidyn.findings.finding import Finding, Use, Verdict, in_order, merged
from omnidyn.findings.finding import joined as joined_uses
from omnidyn.findings.fitness import USES, uses
from omnidyn.findings.guessed import with_guesses
from omnidyn.findings.limits import check_limits
from omnidyn.findings.motion import check_motion
from omnidyn.findings.oddities import check_oddities
from omnidyn.findings.scale.derivatives import check_derivatives
from omnidyn.findings.scale.lag import check_lag
from omnidyn.findings.scale.scale import check_dead_wheels, check_scale
from omnidyn.findings.scale.turn_rate import check_turn_rate
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.slip import check_axes, check_slip
from omnidyn.findings.time_base import begin, between
from omnidyn.findings.values.copies import check_copies
from omnidyn.findings.values.echoes import check_echo
from omnidyn.findings.values.values import check_values
from omnidyn.findings.wiring.against_drive import check_against_drive
from omnidyn.findings.wiring.twist_frame import check_twist_frame
from omnidyn.findings.wiring.wheels import check_wiring
from omnidyn.logs.channels import TIME
from omnidyn.logs.columns.guess import UnclearTimeError
from omnidyn.logs.log import Log
from omnidyn.model.robot import Robot
from omnidyn.run import Run, as_run
from omnidyn.statement import ERROR, NOTE, Statement

__all__ = ["check", "check_blocks", "check_log"]

Family = Callable[[LogUnderCheck], tuple[list[Finding], LogUnderCheck]]
FAMILIES: tuple[Family, ...] = (
    check_echo,
    check_copies,
    check_values,
    check_limits,
    check_twist_frame,
    check_derivatives,
    check_turn_rate,
    check_wiring,
    check_against_drive,
    check_dead_wheels,
    check_slip,
    check_axes,
    check_scale,
    check_averaged,
    check_lag,
    check_filters,
    check_energy,
    check_motion,
    check_oddities,
    check_excitation,
)

# What only a whole log can show: dropped unless every block shows it.
WHOLE_LOG_CODES = ("never_moved", "few_rows")
# What is said of the columns, once for all blocks of a log.
DOUBT, UNUSED, READING = "not_taken", "not_used", "reading"
OF_COLUMNS = (DOUBT, UNUSED, READING)
OF_EXCITATION = ("not_excited", "one_way", "one_speed")


def check(log: Log | Run, robot: Robot | None = None) -> Verdict:
    """Everything that a log shows about itself, and, with a robot, about how the two fit together.

    log: as `read_log(path, recorded=True)` reads it, or a Run in memory: then rows are its samples, counted from 0, and
    faults of its time base are gone, for a Run has none. The verdict has errors where the log gives wrong results as it
    stands; it says what the log can be used for, and keeps it, to be drawn by its `plot()`.
    Never raises for what the log holds; InputError for what is neither, or where log and robot are swapped.

    >>> import omnidyn
    >>> robot = omnidyn.load_robot("axebot")
    >>> run = omnidyn.simulate(robot, [[0.0, 3.0, -3.0]] * 100 + [[2.0, 2.0, 2.0]] * 100, dt=0.02)
    >>> omnidyn.check(run, robot).has_errors
    False
    """
    check_order("check(log) or check(log, robot)", (log, (Log, Run)), (robot, (Robot, type(None))))
    log = as_run(log)
    recorded = Log.of_run(log) if isinstance(log, Run) else log
    return replace(check_log(recorded, robot), log=recorded)


def check_log(log: Log, robot: Robot | None = None) -> Verdict:
    """The verdict on a log, which it does not keep: many logs need no more memory than one."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of means over nothing: NaN is the answer wanted
        findings, work = begin(log, robot)
        findings += _no_channel(log) + _other_count(log, robot) + _about_columns(log)
        for family in FAMILIES:
            new_findings, changed_work = family(work)
            judged_findings = with_guesses(new_findings, robot, findings)
            findings += judged_findings
            if not new_findings or any(
                not finding.rests_on for finding in judged_findings
            ):  # a guess puts nothing right
                work = changed_work
        log_uses = uses(log, robot, {finding.code for finding in findings})
    length = float(work.t[-1] - work.t[0]) if len(work) > 1 else 0.0
    return Verdict(
        in_order(findings),
        work.facts.get("excitation", {}),
        len(log),
        length,
        1.0 / work.step if work.step > 0.0 else 0.0,
        tuple(name for name in log.channels if work_has(log, name)),
        log.source,
        log_uses,
    )


def undecided(error: UnclearTimeError) -> Verdict:
    """The verdict on a log whose time may be in two units, or in one that nobody knows: that is asked, first of all."""
    reason = Statement("refused", ERROR, "", {"what": error.what, "remedy": ""})
    finding = Finding(DOUBT, ERROR, TIME, {"doubt": error.doubt})
    return Verdict(
        (finding,), rows=error.rows, source=error.where, uses=tuple(Use(name, False, reason) for name in USES)
    )


def work_has(log: Log, channel: str) -> bool:
    """Whether a channel of the log holds any number."""
    return bool(np.isfinite(log.channels[channel]).any())


def _no_channel(log: Log) -> list[Finding]:
    if any(work_has(log, name) for name in log.channels) or not len(log):
        return []
    return [Finding("no_channel", ERROR, "", {"unused": log.columns.unused})]


def _about_columns(log: Log) -> list[Finding]:
    """What reading the log left open: columns that look like something and were not taken, and those nobody took.

    Of a Run, what its reader said.
    """
    columns = log.columns
    findings = [Finding(DOUBT, NOTE, "", {"doubt": doubt}) for doubt in columns.doubts]
    if columns.passed_over:
        findings.append(Finding(UNUSED, NOTE, "", {"columns": columns.passed_over}))
    notes = () if columns.columns else log.notes
    return findings + [Finding(READING, NOTE, "", {"note": note}) for note in notes]


def _other_count(log: Log, robot: Robot | None) -> list[Finding]:
    if robot is None or log.wheels is None or log.wheels == robot.wheels.count:
        return []
    numbers = {"wheels": log.wheels, "of_robot": robot.wheels.count}
    return [Finding("wheel_count", NOTE if log.wheels == 1 else ERROR, "", numbers)]


def check_blocks(blocks: Iterable[Log], robot: Robot | None = None) -> Verdict:
    """The verdict on a log that comes block by block, in order, so that memory is bounded by one block.

    Findings of one kind and place are joined; what only a whole log can show has to hold in every block.
    """
    by_code: dict[tuple[str, str], list[Finding]] = {}
    once: list[Finding] = []
    parts, block_uses, rows, duration, rates, channels, source = [], [], 0, 0.0, [], (), ""
    last: tuple[float, int] | None = None
    count = 0
    for block in blocks:
        count += 1
        verdict = check_log(block, robot)
        block_uses.append(verdict.uses)
        new_findings, last = between(last, block, verdict.rate)
        for finding in (*new_findings, *verdict.findings):
            if finding.code in OF_COLUMNS:
                once += [finding] if count == 1 else []
            elif finding.code not in OF_EXCITATION:
                by_code.setdefault((finding.code, finding.subject), []).append(finding)
        parts.append(verdict.excitation)
        rows, duration = rows + verdict.rows, duration + verdict.duration
        rates.append(verdict.rate)
        channels, source = tuple(dict.fromkeys((*channels, *verdict.channels))), verdict.source
    together = [
        merged(group, count)
        for (code, _), group in by_code.items()
        if code not in WHOLE_LOG_CODES or len(group) == count
    ]
    measures = joined(parts)
    length = float(np.mean(robot.wheels.robot_radius)) if robot is not None else 0.15
    rate = float(np.median(rates)) if rates else 0.0
    findings = in_order([*once, *together, *judge(measures, length)])
    return Verdict(findings, measures, rows, duration, rate, channels, source, joined_uses(block_uses))
