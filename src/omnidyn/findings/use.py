"""One use of a log, and several in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from omnidyn.document import Words, all_of, plain


@dataclass(frozen=True)
class Use:
    """One use of a log. good: whether it serves. words: what is there for it, or what is lacking and what to do."""

    name: str
    good: bool
    words: str

    def told(self) -> Words:
        """The use as a line of text."""
        head = f"  {self.name:12s}  {'yes' if self.good else 'no':3s}  "
        return Words(f"{head}{self.words}", rest=" " * len(head))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return plain(asdict(self))


def joined(parts: Sequence[Sequence[Use]]) -> tuple[Use, ...]:
    """The uses of all blocks of one log: good where one block is."""
    found = []
    for each in zip(*parts, strict=True):
        found.append(next((use for use in each if use.good), each[0]))
    return tuple(found)


def good_for(found: Sequence[Use]) -> str:
    """ "good for whole logs and motors, not for steady state and geometry"; "good for nothing"."""
    good, bad = ([use.name for use in found if use.good is wanted] for wanted in (True, False))
    if not good:
        return "good for nothing"
    return f"good for {all_of(good)}{f', not for {all_of(bad)}' if bad else ''}"
