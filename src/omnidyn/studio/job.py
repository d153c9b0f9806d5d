"""What jobs share: how they tell the page of their progress, and what a request names."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.comparison.result import Comparison
from omnidyn.comparison.traces import unit as unit_of
from omnidyn.compiled.listeners import COMPILING, heard
from omnidyn.document import Document, Points, Table
from omnidyn.logs.columns.mapping import load_map
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.model.robot import Robot
from omnidyn.progress import Report
from omnidyn.statement import NOTE
from omnidyn.studio.series import write_series

Tell = Callable[[str, Any], None]
INTERVAL = 0.1  # [s] between two reports of progress
BEAT = 0.2  # [s] between two of a job that is silent, such as one that waits for the compiler


def listener(tell: Tell) -> Callable[[Report], None]:
    """A listener of the library that tells the page."""
    last = [0.0]

    def listen(report: Report) -> None:
        now = time.monotonic()
        if report.urgent or now - last[0] > INTERVAL:
            last[0] = now
            share = report.done / report.total if report.total else None
            tell("progress", {"text": str(report), "share": share})

    return listen


@contextlib.contextmanager
def timed(tell: Tell, parts: Sequence[str] = ()) -> Iterator[Callable[[Report], None]]:
    """A listener of the library that tells the page, beside what is done, the time spent and left, also in silence.

    Time left: of a phase that counts, as it went so far. The page hears of a kernel that is being compiled.
    parts: how the phases of each part of the job begin; the page hears which of them it is.
    """
    begun, phase, latest, finished = time.monotonic(), [time.monotonic()], [Report("")], threading.Event()
    part = [0]

    def listen(report: Report) -> None:
        if report.phase != latest[0].phase:
            phase[0] = time.monotonic()
        part[0] = max(part[0], part_of(report.phase, parts))
        latest[0] = report

    with heard() as compiling:

        def beat() -> None:
            while not finished.wait(BEAT):
                report, now = latest[0], time.monotonic()
                share = report.done / report.total if report.total else None
                left = (now - phase[0]) * (1.0 - share) / share if share else None
                place = f"part {part[0]} of {len(parts)}: " if part[0] else ""
                words = f"{place}{report}{COMPILING * bool(compiling.under_way)}"
                tell("progress", {"text": words, "share": share, "spent": now - begun, "left": left})

        teller = threading.Thread(target=beat, daemon=True)
        teller.start()
        try:
            yield listen
        finally:
            finished.set()
            teller.join()


def part_of(phase: str, parts: Sequence[str]) -> int:
    """The number of the part that a phase belongs to, from 1; 0 for none."""
    return next((k for k, begin in enumerate(parts, 1) if phase.startswith(begin)), 0)


def robot_of(request: Mapping[str, Any]) -> Robot | None:
    """The robot that a request names."""
    return omnidyn.load_robot(request["robot"]) if request.get("robot") else None


def options_of(log: Mapping[str, Any]) -> LogOptions:
    """How a log is read."""
    columns = load_map(log["map"]) if log.get("map") else None
    return LogOptions(columns=columns, current_unsigned=bool(log.get("unsigned")))


def read(log: Mapping[str, Any], robot: Robot | None) -> Log:
    """A log of a request, as recorded; its name stands in all that is said and written of it, and no path."""
    return replace(recorded_log(log["path"], robot, options_of(log)), source=log["name"])


def write_free_runs(comparison: Comparison, log: int, folder: Path, *, residuals: bool = False, **more: Any) -> bool:
    """A panel for each component of a log: measured, and the free run of each robot; whether there is one.

    residuals: measured minus each free run instead. more: what a page needs beside them.
    """
    segments = [segment for segment in comparison.segments if segment.log == log]
    panels, columns = [], []
    for name in comparison.channels if segments else ():
        traces = {
            robot: [comparison.trace(robot, name, segment) for segment in segments] for robot in comparison.robots
        }
        measured = np.concatenate([trace.measured for trace in traces[comparison.robots[0]]])
        models = [np.concatenate([trace.model for trace in parts]) for parts in traces.values()]
        columns += [measured - model for model in models] if residuals else [measured, *models]
        title = f"{name}: measured minus model" if residuals else name
        panels.append({"title": title, "unit": unit_of(name), "signals": ["measured"] * (not residuals) + [*traces]})
    if panels:
        t = np.concatenate([comparison.measured[log].t[segment.rows] for segment in segments])
        write_series(folder, t, panels, np.array(columns), **more)
    return bool(panels)


def shown(document: Document) -> dict[str, Any]:
    """A result as the command prints it: its verdict, then text, points and tables in their order."""
    parts: list[dict[str, Any]] = []
    for part in document.parts:
        if isinstance(part, Table):
            parts.append({"head": list(part.head), "rows": [list(row) for row in part.rows], "name": part.name})
        elif isinstance(part, Points):
            points = ((getattr(words, "severity", ""), str(words)) for words in part.words)
            parts.append({"points": [[severity * (not part.mark), text] for severity, text in points]})
        elif text := part if isinstance(part, str) else part.text:
            parts.append({"text": text})
    parts += [{"text": line} for line in document.legend()]
    severity = getattr(document.verdict, "severity", NOTE)
    return {"verdict": document.verdict_text, "severity": severity, "parts": parts}
