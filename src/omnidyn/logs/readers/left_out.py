"""Records that are whole and cannot be used, one by one: each costs itself, not what follows."""

from __future__ import annotations


class LeftOut:
    """How many records were left out, and why the first was."""

    def __init__(self, count: int = 0, first: str = "") -> None:
        self.count, self.first = count, first

    def add(self, reason: str) -> None:
        """One more."""
        self.count += 1
        self.first = self.first or reason

    @property
    def notes(self) -> list[str]:
        """What is to be said, in words; nothing where all were used."""
        if not self.count:
            return []
        return [
            f"1 record was left out: {self.first}"
            if self.count == 1
            else f"{self.count} records were left out, the first: {self.first}"
        ]
