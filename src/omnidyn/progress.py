"""Progress: what a long call tells its listener. One kind of listener serves all of them, and `print` is one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Report(NamedTuple):
    """How far a long call is.

    phase: what is done now, in words. done, total: how much of it, such as bytes; total 0 where it is not counted.
    state: a better state of a fit. urgent: whether a user must know it at once.
    """

    phase: str
    done: int = 0
    total: int = 0
    state: Any = None
    urgent: bool = False

    def __str__(self) -> str:
        return f"{self.phase}, {100 * self.done // self.total} %" if self.total else self.phase


Progress = Callable[[Report], object]


def silent(report: Report) -> None:
    """Discards the report: the listener of a call that was given none."""
