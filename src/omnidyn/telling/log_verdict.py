"""The verdict on a log, and on several: documents for people."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence

from omnidyn.document import Document, Part, Table, Words, short
from omnidyn.findings.excitation import SECTORS
from omnidyn.findings.finding import Finding, Use, Verdict
from omnidyn.statement import SEVERITIES
from omnidyn.telling.findings.uses import severities, usable_for
from omnidyn.telling.small_words import by_number, counted

INDENT = " " * 11  # of text
SHOWN_SPANS = 4
LINES, LINES_OF_SEVERAL = 15, 24  # that a default text has behind its verdict
SHOWN_LOGS = 8  # rows of the table of logs


def document(verdict: Verdict) -> Document:
    """The verdict: what the log can be used for, then what is the case and what to do about it, gravest first."""
    parts: list[Part] = [Words(verdict.headline()), *map(_use, verdict.uses)]
    for finding in verdict.findings:
        parts += _paragraphs(finding)
    parts.append(_excited(verdict.excitation))
    return Document(parts, verdict.to_dict(), ascii=True, verdict=verdict.verdict)


def in_brief(verdict: Verdict, width: int) -> Document:
    """The verdict in about LINES lines of so many columns: the gravest findings, the others by their codes."""
    parts: list[Part] = [Words(verdict.headline()), *map(_use, verdict.uses)]
    blocks = [[*_paragraphs(finding)] for finding in verdict.findings]
    parts += _shown(blocks, verdict.findings, LINES - _height(parts, width), width)
    return Document(parts, verdict.to_dict(), ascii=True, verdict=verdict.verdict)


def _shown(blocks: Sequence[Sequence[Part]], findings: Sequence[Finding], lines: int, width: int) -> list[Part]:
    """As many blocks as fit into so many lines, one finding each, then what the others are."""
    count = _fitting(blocks, lines, width)
    count = count if count == len(blocks) else _fitting(blocks, lines - 1, width)
    return [part for block in blocks[:count] for part in block] + _rest(findings[count:])


def _fitting(blocks: Sequence[Sequence[Part]], lines: int, width: int) -> int:
    """How many blocks fit into so many lines; the first always does."""
    count = 0
    for block in blocks:
        lines -= _height(block, width)
        if lines < 0 and count:
            break
        count += 1
    return count


def _height(parts: Sequence[Part], width: int) -> int:
    return sum(1 if isinstance(part, str) else len([*part.lines(width, lambda word, _: word)]) for part in parts)


def _rest(findings: Sequence[Finding]) -> list[Part]:
    """What is not shown, by codes."""
    if not findings:
        return []
    counts = {severity: sum(finding.severity == severity for finding in findings) for severity in SEVERITIES}
    codes = ", ".join(dict.fromkeys(finding.code for finding in findings))
    return [Words(f"  {severities(counts)} more ({codes}): `full` shows all", rest="  ")]


def _use(use: Use) -> Words:
    head = f"  {use.name:12s}  {'yes' if use.good else 'no':3s}  "
    return Words(f"{head}{use.reason}", rest=" " * len(head))


def _paragraphs(finding: Finding, where: str = "") -> Iterator[Words]:
    """What is the case, and what to do."""
    place = f"{finding.code}{' ' + finding.subject if finding.subject else ''}"
    lines = f" [{_lines(finding)}]" if finding.rows and not where else ""
    yield Words(f"{place}{where}: {finding}{lines}", f"  {finding.severity:7s}  ", INDENT, finding.severity)
    if remedy := finding.remedy_text:
        yield Words("-> " + remedy, INDENT, INDENT + "   ")


def _lines(finding: Finding) -> str:
    shown = [f"{a}-{b}" if b > a else f"{a}" for a, b in finding.rows[:SHOWN_SPANS]]
    more = ", ..." if len(finding.rows) > SHOWN_SPANS else ""
    count = f"; {counted(finding.count, 'row')}" if finding.count else ""
    return f"line {', '.join(shown)}{more}{count}"


def _excited(excitation: Mapping[str, float]) -> Words:
    """What the log excites; no words where nothing was measured."""
    finite = {name: value for name, value in excitation.items() if math.isfinite(value)}
    parts = []
    if "moving" in finite:
        seconds = short(finite.get("time_s", math.nan), ".3g")
        parts.append(f"in motion for {100.0 * finite['moving']:.0f} % of {seconds} s")
    for axis, unit in (("x", "m/s"), ("y", "m/s"), ("yaw", "rad/s")):
        if axis in finite:
            parts.append(f"{axis} {finite[axis]:.3g} {unit} rms, up to {finite.get(f'{axis}_max', math.nan):.3g}")
    if "turning" in finite:
        parts.append(f"turning in {100.0 * finite['turning']:.0f} % of the motion")
    if "directions" in finite:
        parts.append(f"directions {finite['directions']:.0f} of {SECTORS}")
    if "speeds" in finite:
        parts.append(f"speeds a factor of {finite['speeds']:.2g} apart")
    return Words("motion     " + "; ".join(parts) if excitation else "", "  ", INDENT)


def of_several(verdicts: Mapping[str, Verdict | None], width: int, full: bool = False) -> Document:
    """Several logs: how many can be used for what, a table of them, then what was found in them, each once.

    Args:
        verdicts: path -> verdict; None for a log that could not be read.
        width: columns of the text.
        full: every finding, whatever the number of lines; else LINES_OF_SEVERAL.
    """
    read = {path: verdict for path, verdict in verdicts.items() if verdict is not None}
    labels = dict(zip(verdicts, _labels([*verdicts]), strict=True))
    ordered = sorted(verdicts, key=lambda path: _gravity(verdicts[path]))
    shown = ordered if full else ordered[:SHOWN_LOGS]
    rows = [_row(labels[path], verdicts[path]) for path in verdicts if path in shown]
    head = ("log", "rows", "duration", "errors", "warnings", "notes", "usable for")
    parts: list[Part] = [Table(head, rows, "<>>>>><", name="logs")]
    if len(shown) < len(verdicts):
        parts.append(f"and {counted(len(verdicts) - len(shown), 'log')} with fewer findings")
    parts.append("")
    groups = _groups(read)
    blocks = [[*_paragraphs(group[0][1], _where([labels[path] for path, _ in group]))] for group in groups]
    verdict = overall(verdicts)
    taken = len(Document((), verdict=verdict).verdict_lines(width)) + _height(parts, width)
    lines = 10**9 if full else LINES_OF_SEVERAL - 1 - taken
    parts += _shown(blocks, [found[0][1] for found in groups], lines, width)
    return Document(parts, ascii=True, verdict=verdict)


def overall(verdicts: Mapping[str, Verdict | None]) -> str:
    """All logs in a sentence: how many can be used for what, and how many cannot be used as they stand."""
    read = [verdict for verdict in verdicts.values() if verdict is not None]
    alike: dict[int, list[str]] = {}
    for use in read[0].uses if read else ():
        count = sum(other.good for verdict in read for other in verdict.uses if other.name == use.name)
        alike.setdefault(count, []).append(use.name)
    words = [
        f"{_are(count)} {usable_for(tuple(names))}" for count, names in sorted(alike.items(), reverse=True) if count
    ]
    errors = sum(verdict.has_errors and not verdict.useless for verdict in read)
    words += [f"{errors} {by_number(errors, 'has', 'have')} errors"] if errors else []
    bad = {"not usable": sum(verdict.useless for verdict in read), "not readable": len(verdicts) - len(read)}
    words += [f"{_are(count)} {what}" for what, count in bad.items() if count]
    return f"Of {len(verdicts)} logs {'; '.join(words)}."


def _are(count: int) -> str:
    return f"{count} {by_number(count, 'is', 'are')}"


def _gravity(verdict: Verdict | None) -> tuple[int, ...]:
    return (0,) if verdict is None else (1, *(-verdict.counts[severity] for severity in SEVERITIES))


def _labels(paths: Sequence[str]) -> list[str]:
    """The paths without the folder that all share; as they are where some are absolute and some are not."""
    if len({os.path.isabs(path) for path in paths}) != 1 or len({os.path.splitdrive(path)[0] for path in paths}) != 1:
        return [*paths]
    folder = os.path.commonpath([os.path.dirname(path) for path in paths])
    return [os.path.relpath(path, folder) if folder else path for path in paths]


def _row(label: str, verdict: Verdict | None) -> tuple[str, ...]:
    if verdict is None:
        return (label, "", "", "", "", "", "not readable")
    counts = (str(verdict.counts[severity] or "-") for severity in SEVERITIES)
    uses = ", ".join(use.name for use in verdict.uses if use.good) or "nothing"
    return (label, str(verdict.rows), f"{short(verdict.duration, '.4g')} s", *counts, uses)


def _groups(read: Mapping[str, Verdict]) -> list[list[tuple[str, Finding]]]:
    """(path, finding) of each code and subject, gravest first, then by the number of logs."""
    groups: dict[tuple[str, str, str], list[tuple[str, Finding]]] = {}
    for path, verdict in read.items():
        for finding in verdict.findings:
            groups.setdefault((finding.severity, finding.code, finding.subject), []).append((path, finding))
    return [groups[kind] for kind in sorted(groups, key=lambda kind: (SEVERITIES.index(kind[0]), -len(groups[kind])))]


def _where(labels: Sequence[str]) -> str:
    """ " (a.csv and 2 more logs)": where a finding stands first, and how many other logs have it."""
    others = len(set(labels)) - 1
    return f" ({labels[0]}{f' and {others} more' if others else ''})"
