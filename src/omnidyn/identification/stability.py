"""Stability: which numbers of a fit are others in one part of its logs than in another; by structure/shifts.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from omnidyn.document import Part, Points, Table, chance_cell, interval_cell, plain
from omnidyn.model.keys import in_words, unit
from omnidyn.statement import WARNING, Statement

TIME, LOGS = "time", "logs"  # parts before and after a moment; parts that are logs


@dataclass(frozen=True)
class Level:
    """What a number is in a part of the logs: value, its standard error and 95 % interval."""

    part: str
    value: float
    std: float
    ci95: tuple[float, float]


@dataclass(frozen=True)
class Shift:
    """A number that differs between parts by more than it may. p: the chance of as much, all tests counted."""

    key: str
    levels: tuple[Level, ...]
    p: float


@dataclass(frozen=True)
class Split:
    """Parts of the logs whose numbers differ. by: TIME or LOGS. where: the log that was cut, "" for all of them.

    at: seconds from the start of the log to the cut, and from where to where that may be; NaN between logs, and where
    logs of unlike length were cut at the same share. share: of the log that had gone by. p: the chance of as much in
    all numbers together, all tests counted. shifts: the numbers that differ by themselves, may be
    none: one that would leave its bounds is no cause.
    """

    by: str
    where: str
    at: float
    between: tuple[float, float]
    share: float
    p: float
    shifts: tuple[Shift, ...]

    def statement(self) -> Statement:
        """What differs."""
        keys: dict[str, Any] = {"keys": tuple(shift.key for shift in self.shifts)}
        if self.by == LOGS:
            return Statement("differ_between_logs", WARNING, numbers=keys)
        moment = {"at": self.at if self.at == self.at else None, "between": self.between, "share": self.share}
        return Statement("differ_in_time", WARNING, self.where, keys | moment)


@dataclass(frozen=True)
class Stability:
    """Whether numbers differ between parts of the logs by more than they may. tested: what was compared -> the least
    chance of as much, of all tests of that kind. splits: those that differ, the clearest first. likely: the share of
    all logs at which a moment explains most, whether it is more than chance or not."""

    tested: Mapping[str, float]
    splits: tuple[Split, ...]
    likely: tuple[float, ...] = ()

    @property
    def found(self) -> bool:
        """Whether any number differs."""
        return bool(self.splits)

    def statements(self) -> list[Statement]:
        """What differs; nothing for a fit that is stable."""
        return [split.statement() for split in self.splits]

    def table(self) -> Table:
        """What each number that differs is in each part."""
        rows = [
            (
                in_words(shift.key),
                shift.key,
                level.part,
                f"{level.value:.4g}",
                interval_cell(level.ci95),
                unit(shift.key),
                chance_cell(shift.p),
            )
            for split in self.splits
            for shift in split.shifts
            for level in shift.levels
        ]
        return Table(("number", "key", "in", "value", "95 % interval", "unit", "chance"), rows, "<<<>><>")

    def parts(self) -> list[Part]:
        """As lines and a table; nothing for a fit that is stable."""
        if not self.found:
            return []
        return [Points(self.statements(), "not stable:"), *self.tables()]

    def tables(self) -> list[Table]:
        """The table, where any number differs by itself."""
        return [self.table()] if any(split.shifts for split in self.splits) else []

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return plain(
            {
                "found": self.found,
                "tested": self.tested,
                "splits": [asdict(split) for split in self.splits],
                "statements": self.statements(),
            }
        )
