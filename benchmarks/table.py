"""A table of results: aligned markdown for people, a dictionary for machines; and how to measure a time."""

from __future__ import annotations

import contextlib
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Table:
    """Rows of numbers; the last two columns are the goal, in words, and whether it is met (None: no goal).

    pictures: name of a file in docs/images -> what draws it as PNG, called where the table is published.
    """

    title: str
    columns: list[str]
    rows: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    pictures: dict[str, Callable[[], bytes]] = field(default_factory=dict)

    def add(self, goal: str = "", met: bool | None = None, **cells: Any) -> None:
        """One row; `cells` by the names of the columns."""
        unknown = set(cells) - set(self.columns)
        assert not unknown, f"no such column: {unknown}"
        self.rows.append(cells | {"goal": goal, "met": None if met is None else bool(met)})

    @property
    def missed(self) -> bool:
        """Whether any goal is missed."""
        return any(row["met"] is False for row in self.rows)

    def as_text(self) -> str:
        """Aligned markdown."""
        heads = [*self.columns, "goal", ""]
        verdicts = {True: "pass", False: "MISS", None: ""}
        lines = [
            [*(_cell(row.get(name)) for name in self.columns), row["goal"], verdicts[row["met"]]] for row in self.rows
        ]
        widths = [max(len(line[i]) for line in [heads, *lines]) for i in range(len(heads))]
        numeric = [i for i in range(len(heads)) if lines and all(_is_number(line[i]) for line in lines)]

        def row_text(cells: list[str]) -> str:
            padded = (
                c.rjust(w) if i in numeric else c.ljust(w) for i, (c, w) in enumerate(zip(cells, widths, strict=True))
            )
            return "| " + " | ".join(padded) + " |"

        rule = ["-" * (w - 1) + (":" if i in numeric else "-") for i, w in enumerate(widths)]
        table = "\n".join(map(row_text, [heads, rule, *lines]))
        return "\n".join([f"## {self.title}", "", table, "", *(f"- {note}" for note in self.notes), ""])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"title": self.title, "rows": self.rows, "notes": self.notes}


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3g}"
    return str(value)


def _is_number(text: str) -> bool:
    try:
        float(text or 0)
    except ValueError:
        return False
    return True


@dataclass
class Times:
    """Times of repeated calls [ms]: on the wall, and of the processor, which other programs hardly touch."""

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)

    def measure(self, call: Callable[[], Any], repeats: int) -> Any:
        """Call once to warm up, then `repeats` times; returns what the last call returned."""
        result = call()
        for _ in range(repeats):
            wall, cpu = time.perf_counter(), time.process_time()
            result = call()
            self.wall.append((time.perf_counter() - wall) * 1e3)
            self.cpu.append((time.process_time() - cpu) * 1e3)
        return result

    @property
    def cells(self) -> dict[str, float]:
        """The columns of a time."""
        return {"min ms": min(self.wall), "median ms": statistics.median(self.wall), "min cpu ms": min(self.cpu)}


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Pin this process to one core, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def machine() -> str:
    """Where it was measured, and how busy that was."""
    load = f", load {os.getloadavg()[0]:.2f} before" if hasattr(os, "getloadavg") else ""
    return f"{platform.machine()} {sys.platform}, Python {platform.python_version()}, one thread{load}"
