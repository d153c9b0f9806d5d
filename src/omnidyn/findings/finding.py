"""What `check` says about a log: findings, each with its rows and a remedy, and the verdict they add up to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from omnidyn.arrays import BoolArray, IntArray
from omnidyn.document import Document, Words, plain, sentence, short
from omnidyn.findings.use import Use, good_for
from omnidyn.logs.log import Log
from omnidyn.shown import FIGURE, Shown, make
from omnidyn.statistics import stretches

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FATAL, WARN, NOTE = "fatal", "warn", "note"
LEVELS = (FATAL, WARN, NOTE)
LABELS = {FATAL: "FATAL", WARN: "warn", NOTE: "note"}
MAX_SPANS = 20  # spans of rows that a finding keeps; it counts all
SHOWN_SPANS = 4
LEAST_WIDTH, INDENT = 40, " " * 9  # of text
SECTORS = 12  # of directions of travel

Span = tuple[int, int]


@dataclass(frozen=True)
class Finding:
    """One thing that a log shows.

    code: what kind, such as "gap" or "swapped". level: "fatal" (the log cannot be used as it stands), "warn" (it can,
    with care) or "note". where: the components concerned, such as "w1 w2", or "". message: what is the case, in words.
    remedy: what to do. rows: (first line, last line) in the file, the first MAX_SPANS of them. count: of all rows
    concerned, 0 where the finding is about the log as a whole. numbers: what it was measured from. rests_on: keys of
    the robot file whose numbers it takes; of a verdict, those that are only guessed.
    """

    code: str
    level: str
    where: str
    message: str
    remedy: str = ""
    rows: tuple[Span, ...] = ()
    count: int = 0
    numbers: Mapping[str, float] = field(default_factory=dict)
    rests_on: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite is None."""
        return plain({
            "code": self.code, "level": self.level, "where": self.where, "message": self.message,
            "remedy": self.remedy, "rows": self.rows, "count": self.count,
            "numbers": {name: float(value) for name, value in self.numbers.items()}, "rests_on": self.rests_on,
        })  # fmt: skip


@dataclass(frozen=True, repr=False)
class Verdict(Shown):
    """All findings of one log, gravest first, and what the log excites.

    excitation: name of a measure -> value (see excitation.py). rows: of the log. duration [s]. rate [Hz].
    channels: that were recorded. source: the path. uses: what the log is good for, and why not for the rest. log: what
    was checked; None where it came in blocks, and was not kept.
    """

    findings: tuple[Finding, ...]
    excitation: Mapping[str, float] = field(default_factory=dict)
    rows: int = 0
    duration: float = 0.0
    rate: float = 0.0
    channels: tuple[str, ...] = ()
    source: str = ""
    uses: tuple[Use, ...] = ()
    log: Log | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<Verdict {self.headline()}>"

    def plot(self) -> Figure:
        """The channels of the log as recorded, with what was found above them, as a matplotlib Figure.

        Raises InputError where the log was checked in blocks, and was not kept.
        """
        return make(FIGURE, self)

    @property
    def fatal(self) -> bool:
        """Whether any finding is fatal."""
        return any(finding.level == FATAL for finding in self.findings)

    @property
    def useless(self) -> bool:
        """Whether nothing can be done with the log: no use of it is good, whatever its findings are."""
        return bool(self.uses) and not any(use.good for use in self.uses)

    @property
    def verdict(self) -> str:
        """What the log is good for, in a sentence."""
        if self.useless:
            return f"Nothing can be done with this log: {self.uses[0].words.rstrip('.')}."
        fatal = [each for each in self.findings if each.level == FATAL]
        if fatal:
            more = f" (and {len(fatal) - 1} more)" if fatal[1:] else ""
            rest = f"; once that is mended, {good_for(self.uses)}" if self.uses else ""
            return f"Not to be used as it stands: {fatal[0].message.rstrip('.')}{more}{rest}."
        heed = self.counts[WARN]
        words = good_for(self.uses) if self.uses else "no row to judge by"
        told = f"; {heed} thing{'s' * (heed > 1)} to heed" if heed else "; nothing to heed"
        return sentence(f"{words}{told}")

    def of(self, code: str) -> tuple[Finding, ...]:
        """The findings of one kind."""
        return tuple(finding for finding in self.findings if finding.code == code)

    @property
    def counts(self) -> dict[str, int]:
        """Level -> number of findings."""
        return {level: sum(finding.level == level for finding in self.findings) for level in LEVELS}

    def headline(self) -> str:
        """One line: what the log is, and how many findings of each level it has."""
        counts = self.counts
        parts = [f"{counts[FATAL]} fatal", f"{counts[WARN]} to heed", f"{counts[NOTE]} to know"]
        size = f"{self.rows} rows, {self.duration:.4g} s"
        rate = f" at {self.rate:.4g} Hz" if self.rate > 0.0 else ""
        parts += ["good for nothing"] if self.useless else []
        return f"{self.source or 'log'}: {size}{rate}: {', '.join(parts)}"

    def as_text(self, width: int = 110) -> str:
        """The verdict for people: a sentence, a headline, the uses, then a paragraph per finding. ASCII only."""
        return self.document().to_text(max(LEAST_WIDTH, width))

    def document(self) -> Document:
        """The verdict: what the log is good for, then what is the case and what to do about it, gravest first."""
        paragraphs = [words for finding in self.findings for words in _paragraphs(finding)]
        parts = [Words(self.headline()), *(use.told() for use in self.uses), *paragraphs, _excited(self.excitation)]
        return Document(parts, self.to_dict(), ascii=True, verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without NaN."""
        return plain({
            "source": self.source, "rows": self.rows, "duration_s": float(self.duration), "rate_Hz": float(self.rate),
            "channels": self.channels, "verdict": self.verdict, "fatal": self.fatal, "useless": self.useless,
            "counts": self.counts, "uses": [use.to_dict() for use in self.uses],
            "findings": [finding.to_dict() for finding in self.findings],
            "excitation": {name: float(value) for name, value in self.excitation.items()},
        })  # fmt: skip


def in_order(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Gravest first; otherwise as they were found."""
    return tuple(sorted(findings, key=lambda finding: LEVELS.index(finding.level)))


def spans_of(bad: BoolArray, lines: IntArray) -> tuple[Span, ...]:
    """The first stretches of rows where `bad` holds, as (first line, last line). Shapes (rows,)."""
    return tuple((int(lines[a]), int(lines[b - 1])) for a, b in stretches(bad)[:MAX_SPANS])


def merged(findings: Sequence[Finding], blocks: int) -> Finding:
    """Findings of one kind and place from several blocks of a log as one: rows joined, counts added.

    The words and numbers are those of the block where it weighs most: the gravest, then the one with most rows.
    """
    if len(findings) == 1:
        return findings[0]
    heaviest = max(findings, key=lambda finding: (-LEVELS.index(finding.level), finding.count))
    rows: list[Span] = []
    for span in sorted(span for finding in findings for span in finding.rows):
        if rows and span[0] <= rows[-1][1] + 1:
            rows[-1] = (rows[-1][0], max(rows[-1][1], span[1]))
        else:
            rows.append(span)
    words = f"{heaviest.message} (so in {len(findings)} of {blocks} blocks of the log)"
    total = sum(finding.count for finding in findings)
    return replace(heaviest, message=words, rows=tuple(rows[:MAX_SPANS]), count=total)


def _paragraphs(finding: Finding) -> Iterator[Words]:
    """What is the case, and what to do."""
    head = f"  {LABELS[finding.level]:5s}  {finding.code}{' ' + finding.where if finding.where else ''}: "
    yield Words(head + finding.message + (f" [{_lines(finding)}]" if finding.rows else ""), rest=INDENT)
    if finding.remedy:
        yield Words("-> " + finding.remedy, INDENT, INDENT + "   ")


def _lines(finding: Finding) -> str:
    shown = [f"{a}-{b}" if b > a else f"{a}" for a, b in finding.rows[:SHOWN_SPANS]]
    more = ", ..." if len(finding.rows) > SHOWN_SPANS else ""
    count = f"; {finding.count} rows" if finding.count else ""
    return f"line {', '.join(shown)}{more}{count}"


def _excited(excitation: Mapping[str, float]) -> Words:
    """What the log excites; no words where nothing was measured."""
    known = {name: value for name, value in excitation.items() if math.isfinite(value)}
    parts = []
    if "moving" in known:
        parts.append(
            f"in motion for {100.0 * known['moving']:.0f} % of {short(known.get('time_s', math.nan), '.3g')} s"
        )
    for axis, unit in (("x", "m/s"), ("y", "m/s"), ("yaw", "rad/s")):
        if axis in known:
            parts.append(f"{axis} {known[axis]:.3g} {unit} rms, up to {known.get(f'{axis}_max', math.nan):.3g}")
    if "turning" in known:
        parts.append(f"turning in {100.0 * known['turning']:.0f} % of the motion")
    if "directions" in known:
        parts.append(f"directions {known['directions']:.0f} of {SECTORS}")
    if "speeds" in known:
        parts.append(f"speeds a factor of {known['speeds']:.2g} apart")
    return Words("shows  " + "; ".join(parts) if excitation else "", "  ", INDENT)
