"""What follows a fit (its diagnosis, a comparison, a page): each part may fail or be interrupted, and the fit stays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from omnidyn.errors import INTERRUPTS, OmnidynError, Terminated, told_by
from omnidyn.statement import WARNING, Statement

Made = TypeVar("Made")

LADDER, DIAGNOSIS, COMPARISON, PAGE = "ladder", "diagnosis", "comparison with the logs", "page"
JUDGEMENT = "check of the logs by the fitted robot"
BY_QUICK = "left out by `quick`"


@dataclass(frozen=True)
class Missing:
    """A part of a result that was not made, and the reason in words."""

    part: str
    reason: str


@dataclass(eq=False)
class Attempts:
    """Makes the parts of a result, one after the other.

    missing: the parts that were not made. interrupt: the interrupt after which no more parts are begun; None without
    one. keep: whether an interrupt is kept here; otherwise it is raised.
    """

    missing: list[Missing] = field(default_factory=list)
    interrupt: BaseException | None = None
    keep: bool = True

    def make(self, part: str, making: Callable[[], Made]) -> Made | None:
        """The part that `making` makes; None where it fails or is interrupted."""
        if self.interrupt is not None:
            return self.leave_out(part, self.interrupt)
        try:
            return making()
        except (*INTERRUPTS, Exception) as raised:
            error = told_by(raised)
            if not self.keep and isinstance(error, INTERRUPTS):
                raise error from None
            return self.give_up(part, error)

    def give_up(self, part: str, error: BaseException) -> None:
        """Note a part that failed; after an interrupt no other is begun."""
        if isinstance(error, INTERRUPTS):
            self.interrupt = error
        self.leave_out(part, error)

    def leave_out(self, part: str, cause: BaseException | str) -> None:
        """Note a part that is not made."""
        self.missing.append(Missing(part, cause if isinstance(cause, str) else _reason(cause)))


def not_made(missing: Sequence[Missing]) -> Iterator[Statement]:
    """A statement for each reason: "not made: the diagnosis and the page (interrupted)"."""
    for reason in dict.fromkeys(part.reason for part in missing):
        parts = tuple(f"the {part.part}" for part in missing if part.reason == reason)
        yield Statement("not_made", WARNING, numbers={"parts": parts, "reason": reason})


def _reason(error: BaseException) -> str:
    if isinstance(error, INTERRUPTS):
        return "terminated" if isinstance(error, Terminated) else "interrupted"
    if isinstance(error, OmnidynError):
        return str(error)
    if isinstance(error, MemoryError):
        return "not enough memory"
    words = " ".join(str(error).split())
    return f"{'the system refuses' if isinstance(error, OSError) else 'bug'}: {type(error).__name__}: {words}"
