"""Removed: what was removed last, which can be brought back until something else is removed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Removed:
    """What was removed last: its name, what brings it back, and what deletes its file."""

    name: str
    restore: Callable[[], None]
    discard: Callable[[], None]
