"""One use of a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from omnidyn.statement import Statement


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
