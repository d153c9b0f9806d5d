"""Statement: one thing that a result says, as a value. Its words are made in `telling/`, above every result.

A statement is made where its numbers are known. No code reads its sentence back: what depends on it asks its code.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from omnidyn.document import Points, plain, sentence
from omnidyn.shown import REMEDY, SENTENCE, make

ERROR, WARNING, NOTE = "error", "warning", "note"
SEVERITIES = (ERROR, WARNING, NOTE)  # gravest first

PLACES = "places"  # key of `numbers`: which of several logs, groups or motors a statement is about
QUOTED = "quoted"  # a sentence that was made elsewhere: by a user, another tool, an older file


@dataclass(frozen=True)
class Statement:
    """One thing that a result says.

    Args:
        code: what is the case, such as "gap"; `docs/statements.md` lists all.
        severity: "error" (the result is wrong as it stands), "warning" (usable with care) or "note".
        subject: what it is about, such as "w1 w2" or "motor.resistance_ohm"; "" for the whole.
        numbers: what was measured: name -> number, name, statement, or a tuple of these; SI units.
        remedy: which remedy of this code applies, where it has several.
    """

    code: str
    severity: str = WARNING
    subject: str = ""
    numbers: Mapping[str, Any] = field(default_factory=dict)
    remedy: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", {name: _bare(value) for name, value in self.numbers.items()})

    def __hash__(self) -> int:
        return hash((self.code, self.severity, self.subject, self.remedy))

    def __str__(self) -> str:
        """The sentence, without a capital and a full stop, so that it can stand behind a label."""
        return make(SENTENCE, self)

    @property
    def remedy_text(self) -> str:
        """What to do about it; "" where there is nothing to do."""
        return make(REMEDY, self)

    def of(self, *places: str) -> Statement:
        """The statement about some of several logs, groups or motors; its sentence begins with their names."""
        before = self.numbers.get(PLACES, ())
        return replace(self, numbers={**self.numbers, PLACES: (places, *before)})

    @property
    def with_remedy(self) -> str:
        """The sentence and the remedy in one line."""
        return "; ".join(filter(None, (str(self), self.remedy_text)))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite is None."""
        return {
            "code": self.code,
            "severity": self.severity,
            "subject": self.subject,
            "text": str(self),
            "remedy": self.remedy_text,
            "numbers": plain({name: _as_plain(value) for name, value in self.numbers.items()}),
        }


def quoted(text: str, severity: str = WARNING) -> Statement:
    """A sentence that was made elsewhere, as a statement."""
    return Statement(QUOTED, severity, numbers={"text": text})


def statements(values: Iterable[Statement | str]) -> tuple[Statement, ...]:
    """Statements as they are, text of a user or another tool as quoted."""
    return tuple(value if isinstance(value, Statement) else quoted(value) for value in values)


def as_verdict(verdict: Statement) -> dict[str, str]:
    """The verdict of a result in its JSON: the sentence, with a capital and a full stop, and its code."""
    return {"verdict": sentence(str(verdict)), "verdict_code": verdict.code}


def by_severity(items: Iterable[Statement], name: str = "") -> Points:
    """Statements as points of a document, the gravest first, each behind its severity."""
    ordered = sorted(items, key=lambda statement: SEVERITIES.index(statement.severity))
    return Points(ordered, "", name)


def _bare(value: Any) -> Any:
    """A value without NumPy: two statements can be compared, and hold no array."""
    if isinstance(value, list | tuple):
        return tuple(_bare(item) for item in value)
    return _bare(value.tolist()) if hasattr(value, "tolist") else value


def _as_plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_as_plain(item) for item in value]
    return value.to_dict() if isinstance(value, Statement) else value
