"""The numbers of a robot now, and whether that is enough."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from omnidyn.document import Document, Points, Table, interval_cell, plain, short
from omnidyn.identification.live.model import PredictedStretch
from omnidyn.model.keys import in_words
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict


@dataclass(frozen=True)
class LiveNumber:
    """value, std, low, high: of a number now; low and high its 95 % interval. within: half an interval, as a share of
    the value, that is enough; 0 for a number that need not be known. is_unknown: whether the rows leave it open."""

    value: float
    std: float
    low: float
    high: float
    within: float
    is_unknown: bool

    @property
    def half(self) -> float:
        """Half of the interval, as a share of the value; infinite for what is unknown."""
        if self.is_unknown or not math.isfinite(self.high - self.low):
            return math.inf
        return 0.5 * (self.high - self.low) / max(abs(self.value), 1e-300)

    @property
    def is_reached(self) -> bool:
        """Whether it is known as well as it must be."""
        return not self.within or self.half <= self.within


@dataclass(frozen=True)
class LiveStatus(Displayable):
    """What a robot's log tells so far.

    robot: its name. seconds [s], rows: how much came. numbers: key -> the number now. held_out: the last stretch that
    was predicted before it counted. enough_at [s]: when all numbers that must be were known and such a stretch was
    predicted, None before, and again once a stretch is not. misfit: what the residuals of the last whole fit follow,
    nothing where the model leaves nothing out. restarts: of the clock of the log. gap [s]: the longest between two
    rows. used_until [s]: what of it is used where a gap ends the log of a speed loop, else None. waiting: why there are
    no numbers yet. changes: what is no longer as in the fit before.
    """

    robot: str
    seconds: float = 0.0
    rows: int = 0
    numbers: Mapping[str, LiveNumber] = field(default_factory=dict)
    held_out: PredictedStretch | None = None
    enough_at: float | None = None
    unexplained: PredictedStretch | None = None
    misfit: tuple[str, ...] = ()
    restarts: int = 0
    gap: float = 0.0
    used_until: float | None = None
    waiting: str = ""
    changes: tuple[Statement, ...] = ()

    @property
    def is_enough(self) -> bool:
        """Whether the drive may end."""
        return self.enough_at is not None and not self.missing

    @property
    def unknown(self) -> tuple[str, ...]:
        """The numbers that the rows leave open."""
        return tuple(name for name, number in self.numbers.items() if number.is_unknown)

    @property
    def missing(self) -> tuple[str, ...]:
        """The numbers that are not known as well as they must be, the widest first."""
        missing = [name for name, number in self.numbers.items() if not number.is_reached]
        return tuple(sorted(missing, key=lambda name: -self.numbers[name].half / self.numbers[name].within))

    @property
    def verdict(self) -> Statement:
        """Whether it is enough, and what is missing."""
        numbers: dict[str, Any] = {"seconds": self.seconds}
        if not self.numbers:
            return Statement("live_waiting", NOTE, self.robot, numbers | {"rows": self.rows, "why": self.waiting})
        if self.is_enough:
            return Statement("live_enough", NOTE, self.robot, numbers | {"at": self.enough_at})
        wanted = sum(number.within > 0.0 for number in self.numbers.values())
        if self.missing:
            widest = self.missing[0]
            number = self.numbers[widest]
            numbers |= {"count": wanted, "known": wanted - len(self.missing), "widest": widest}
            numbers |= {"half": None if number.is_unknown else number.half, "within": number.within}
            return Statement("live_not_yet", NOTE, self.robot, numbers)
        if self.misfit:
            return Statement("live_not_this_model", WARNING, self.robot, numbers)
        odd = self.unexplained
        if odd is not None and not (self.held_out and self.held_out.missed):
            numbers |= {"missed": odd.missed, "start": odd.start, "end": odd.end}
            return Statement("live_not_explained", WARNING, self.robot, numbers)
        missed = () if self.held_out is None else self.held_out.missed
        return Statement("live_not_predicted", WARNING if missed else NOTE, self.robot, numbers | {"missed": missed})

    @property
    def doubts(self) -> tuple[Statement, ...]:
        """What is no longer as it was, and what the model leaves out."""
        misfit = [Statement("live_misfit", WARNING, numbers={"follows": self.misfit[:2]})] if self.misfit else []
        return (*self.changes, *misfit)

    def statements(self) -> list[Statement]:
        """What is wrong with the numbers, and what happened on the way."""
        said = [*self.doubts]
        if self.restarts:
            said.append(Statement("live_restarts", WARNING, numbers={"restarts": self.restarts}))
        if self.gap:
            said.append(Statement("live_gap", NOTE, numbers={"gap": self.gap}))
        if self.used_until is not None:
            said.append(Statement("live_used_until", WARNING, numbers={"at": self.used_until}))
        return said

    def document(self) -> Document:
        """What it says."""
        rows = [
            (
                in_words(name),
                name,
                "-" if number.is_unknown else f"{number.value:.4g}",
                "unknown" if number.is_unknown else interval_cell((number.low, number.high)),
                "-" if number.half > 1.0 or not number.within else short(100.0 * number.half),
                "" if not number.within else "yes" if number.is_reached else "no",
            )
            for name, number in self.numbers.items()
        ]
        table = Table(("number", "key", "now", "95 % interval", "+- %", "enough"), rows, "<<><><", name="numbers")
        parts = [table] if rows else []
        return Document(
            [*parts, Points(self.statements())], as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        held = self.held_out
        return plain(
            {
                "robot": self.robot,
                "seconds": self.seconds,
                "rows": self.rows,
                "enough": self.is_enough,
                "enough_at_s": self.enough_at,
                "numbers": {
                    name: vars(number) | {"reached": number.is_reached} for name, number in self.numbers.items()
                },
                "missing": list(self.missing),
                "unknown": list(self.unknown),
                "held_out": None
                if held is None
                else {"start_s": held.start, "end_s": held.end, "predicted": held.predicted, "ratio": dict(held.ratio)},
                "unexplained": None
                if self.unexplained is None
                else {"start_s": self.unexplained.start, "end_s": self.unexplained.end},
                "misfit": list(self.misfit),
                "restarts": self.restarts,
                "changes": [change.to_dict() for change in self.changes],
            }
        )
