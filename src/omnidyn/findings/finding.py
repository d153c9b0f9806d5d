"""What `check` says about a log: findings, each with its rows, and the verdict they add up to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from omnidyn.arrays import BoolArray, IntArray
from omnidyn.document import Document, plain, sentence
from omnidyn.logs.log import Log
from omnidyn.shown import DOCUMENT, FIGURE, Displayable, make
from omnidyn.statement import ERROR, NOTE, SEVERITIES, WARNING, Statement
from omnidyn.statistics import stretches

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MAX_SPANS = 20  # spans of rows that a finding keeps; it counts all
LEAST_WIDTH = 40  # of text

Span = tuple[int, int]


@dataclass(frozen=True)
class Finding(Statement):
    """One thing that a log shows.

    rows: (first line, last line) in the file, the first MAX_SPANS of them. count: of all rows concerned, 0 where the
    finding is about the log as a whole. rests_on: keys of the robot file whose numbers it takes; of a verdict, those
    that are only guessed.
    """

    rows: tuple[Span, ...] = ()
    count: int = 0
    rests_on: tuple[str, ...] = ()

    __hash__ = Statement.__hash__

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite is None."""
        return super().to_dict() | plain({"rows": self.rows, "count": self.count, "rests_on": self.rests_on})


@dataclass(frozen=True, repr=False)
class Verdict(Displayable):
    """All findings of one log, gravest first, and what the log excites.

    excitation: name of a measure -> value (see excitation.py). rows: of the log. duration [s]. rate [Hz].
    channels: that were recorded. source: the path. uses: what the log can be used for, and why not for the rest. log:
    what was checked; None where it came in blocks, and was not kept.
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
    def has_errors(self) -> bool:
        """Whether any finding is an error."""
        return bool(self.counts[ERROR])

    @property
    def useless(self) -> bool:
        """Whether nothing can be done with the log: no use of it is good, whatever its findings are."""
        return bool(self.uses) and not any(use.good for use in self.uses)

    @property
    def conclusion(self) -> Statement:
        """What the log can be used for: the code `not_usable`, `faulty` or `usable`."""
        uses = {
            "uses": [use.name for use in self.uses if use.good],
            "not": [use.name for use in self.uses if not use.good],
        }
        if self.useless:
            return Statement("not_usable", ERROR, "", {"reason": self.uses[0].reason})
        if self.has_errors:
            return Statement("faulty", ERROR, "", {**uses, "errors": self.counts[ERROR], "first": self.findings[0]})
        warnings = self.counts[WARNING]
        return Statement("usable", WARNING if warnings else NOTE, "", {**uses, "warnings": warnings})

    @property
    def verdict(self) -> str:
        """What the log can be used for, in a sentence."""
        return sentence(str(self.conclusion))

    def of(self, code: str) -> tuple[Finding, ...]:
        """The findings of one kind."""
        return tuple(finding for finding in self.findings if finding.code == code)

    @property
    def counts(self) -> dict[str, int]:
        """Severity -> number of findings."""
        return {severity: sum(finding.severity == severity for finding in self.findings) for severity in SEVERITIES}

    def headline(self) -> str:
        """One line: what the log is, and how many findings of each severity it has."""
        size = {"rows": self.rows, "duration_s": self.duration, "rate_Hz": self.rate}
        return str(Statement("log_summary", NOTE, self.source, {**size, **self.counts}))

    def as_text(self, width: int = 110) -> str:
        """The verdict for people: a sentence, a headline, the uses, then a paragraph per finding. ASCII only."""
        return self.document().to_text(max(LEAST_WIDTH, width))

    def document(self) -> Document:
        """The verdict: what the log can be used for, then what is the case and what to do about it, gravest first."""
        return make(DOCUMENT, self)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without NaN."""
        return plain(
            {
                "source": self.source,
                "rows": self.rows,
                "duration_s": float(self.duration),
                "rate_Hz": float(self.rate),
                "channels": self.channels,
                "verdict": self.verdict,
                "code": self.conclusion.code,
                "has_errors": self.has_errors,
                "useless": self.useless,
                "counts": self.counts,
                "uses": [use.to_dict() for use in self.uses],
                "findings": [finding.to_dict() for finding in self.findings],
                "excitation": {name: float(value) for name, value in self.excitation.items()},
            }
        )


def in_order(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Gravest first; otherwise as they were found."""
    return tuple(sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity)))


def spans_of(mask: BoolArray, lines: IntArray) -> tuple[Span, ...]:
    """The first stretches of rows where `mask` holds, as (first line, last line). Shapes (rows,)."""
    return tuple((int(lines[a]), int(lines[b - 1])) for a, b in stretches(mask)[:MAX_SPANS])


def merged(findings: Sequence[Finding], blocks: int) -> Finding:
    """Findings of one kind and place from several blocks of a log as one: rows joined, counts added.

    The numbers are those of the block where it weighs most: the gravest, then the one with most rows.
    """
    if len(findings) == 1:
        return findings[0]
    heaviest = max(findings, key=lambda finding: (-SEVERITIES.index(finding.severity), finding.count))
    rows: list[Span] = []
    for span in sorted(span for finding in findings for span in finding.rows):
        if rows and span[0] <= rows[-1][1] + 1:
            rows[-1] = (rows[-1][0], max(rows[-1][1], span[1]))
        else:
            rows.append(span)
    numbers = {**heaviest.numbers, "blocks": blocks, "in_blocks": len(findings)}
    total = sum(finding.count for finding in findings)
    return replace(heaviest, numbers=numbers, rows=tuple(rows[:MAX_SPANS]), count=total)


@dataclass(frozen=True)
class Use:
    """One use of a log. good: whether it serves. reason: what is there for it, or what is missing and what to do."""

    name: str
    good: bool
    reason: Statement

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"name": self.name, "good": self.good, **self.reason.to_dict()}


def joined(parts: Sequence[Sequence[Use]]) -> tuple[Use, ...]:
    """The uses of all blocks of one log: good where one block is."""
    return tuple(next((use for use in uses if use.good), uses[0]) for uses in zip(*parts, strict=True))
