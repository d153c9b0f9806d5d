"""Speeds that are means over a window of rows, as some motor controllers give them: late, and slow to show a change."""

from __future__ import annotations

from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.clocks import at_each_clock
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.logs.channels import place
from omnidyn.logs.window_means import rows_of_mean
from omnidyn.statement import WARNING

SPEEDS = ("wheel_speed", "twist")


def check_averaged(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on such speeds, those over one window together; nothing is masked. The work knows by how much they are
    late."""
    if not work.step > 0.0:
        return [], work
    findings, _ = at_each_clock(work, _at_its_clock)
    late = {place(finding.subject.split()[0])[0]: finding.numbers["late_s"] for finding in findings}  # type: ignore[index]
    return findings, work.knowing(late=late)


def _at_its_clock(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The same of the speeds that were sampled in these rows."""
    alike: dict[tuple[str, int], list[str]] = {}
    for channel in SPEEDS:
        if channel not in work.log.channels:  # differences of angles, made here
            continue
        for component, values in work.sampled_columns(channel):
            if rows := rows_of_mean(values):
                alike.setdefault((channel, rows), []).append(component)
    return [
        Finding(
            "averaged",
            WARNING,
            " ".join(names),
            {"rows": rows, "seconds": rows * work.step, "late_s": 0.5 * (rows - 1) * work.step},
        )
        for (_, rows), names in alike.items()
    ], work


def late_by(work: LogUnderCheck, channel: str) -> float:
    """By how many rows of the work a mean makes a channel late; 0 where it is none."""
    return work.facts.get("late", {}).get(channel, 0.0) / work.step
