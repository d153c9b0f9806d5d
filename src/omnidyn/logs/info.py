"""What a file holds before anything is made of it: topics or columns, rates, gaps, and what they are taken for."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Points
from omnidyn.document import Table as Cells
from omnidyn.errors import InputError, printable
from omnidyn.files import default_max_bytes
from omnidyn.logs.channels import TIME
from omnidyn.logs.clock.clock import Clock
from omnidyn.logs.clock.row_rate import timed
from omnidyn.logs.clock.stamps import with_joined_stamp
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.read_log import LogOptions, map_columns
from omnidyn.logs.readers.read_table import iter_tables, reader_of
from omnidyn.logs.readers.reader import ReadOptions, completed
from omnidyn.logs.readers.recording import Topic
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, silent
from omnidyn.statement import Statement, statements

NAMES = {"": "text", "sqlite": "db3"}  # of formats, where the name of the reader is another
PIECE = 200_000  # rows looked at together


@dataclass(frozen=True)
class LogInfo:
    """What a file holds. format: mcap, db3, bag, wpilog, mat, hdf5, parquet or text. topics: or columns. mapping: what
    would be taken, None where nothing tells the time, and why. span [s]. salvaged: messages, where it is cut short.
    """

    source: str
    format: str
    topics: tuple[Topic, ...]
    mapping: ColumnMap | None
    span: float = 0.0
    salvaged: int | None = None
    notes: tuple[Statement, ...] = ()
    why: str = ""
    sha256: str = ""

    def document(self) -> Document:
        """Its topics in a table, the columns that would be taken, and what is to be known."""
        head = f"{self.source}: {self.format}, {len(self.topics)} topics or columns, {self.span:.6g} s"
        if self.salvaged is not None:
            head += f"; cut short, {self.salvaged} messages salvaged"
        rows = [
            (
                topic.name,
                topic.type,
                str(topic.count),
                f"{topic.rate:.4g}" if topic.rate else "",
                f"{topic.longest_gap:.4g}" if topic.longest_gap else "",
                topic.why,
            )
            for topic in self.topics
        ]
        table = Cells(("topic", "type", "count", "rate [Hz]", "longest gap [s]", ""), rows, "<<>>><", name="topics")
        lines = self.mapping.lines() if self.mapping is not None else [f"nothing: {self.why}"]
        doubts = self.mapping.doubts if self.mapping is not None else ()
        mapping_lines = Points(lines, "taken:", "mapping")
        open_questions = [doubt.with_remedy for doubt in doubts]
        return Document(
            [
                head,
                "",
                table,
                "",
                mapping_lines,
                Points(open_questions, "doubt:", "doubts"),
                Points(self.notes, "note:", "notes"),
            ],
            self.to_dict(),
            doubts,
            ascii=True,
        )

    def to_dict(self) -> dict[str, Any]:
        """For machines."""
        columns = self.mapping.columns if self.mapping is not None else {}
        return {
            "source": self.source,
            "format": self.format,
            "span_s": self.span,
            "salvaged": self.salvaged,
            "topics": [
                {
                    "name": topic.name,
                    "type": topic.type,
                    "count": topic.count,
                    "rate_hz": topic.rate,
                    "longest_gap_s": topic.longest_gap,
                    "read": topic.read,
                    "why": topic.why,
                }
                for topic in self.topics
            ],
            "mapping": {key: {"column": column.name, "unit": column.unit} for key, column in columns.items()},
            "doubts": [doubt.to_dict() for doubt in self.mapping.doubts] if self.mapping is not None else [self.why],
            "notes": [note.to_dict() for note in self.notes],
        }


def read_info(
    path: str | os.PathLike,
    robot: Robot | None = None,
    options: LogOptions | None = None,
    *,
    progress: Progress = silent,
) -> LogInfo:
    """What a file holds. robot, options: as for a log. Raises InputError where nothing can be read.

    progress: hears now and then how many bytes are done, of how many.
    """
    options, reader = options or LogOptions(), reader_of(path)
    kind = NAMES.get(reader.kind, reader.kind)
    if reader.recording is None:
        return _of_columns(path, kind, robot, options, progress)
    limit = default_max_bytes() if options.max_bytes is None else options.max_bytes
    recording = reader.recording(path, ReadOptions(max_bytes=limit, progress=progress))
    if not any(topic.count for topic in recording.topics):
        raise InputError("no messages", got="0 messages", expected=reader.least, where=str(path))
    topics, span, mapping, reason = tuple(recording.topics), 0.0, None, ""
    try:
        table = next(completed(recording.tables(PIECE), reader.least))
        mapping = map_columns(table, robot, options)
    except InputError as error:
        reason = str(error)
    if recording.tracks:
        first = min(int(track.stamps.min()) for track in recording.tracks if len(track.stamps))
        last = max(int(track.stamps.max()) for track in recording.tracks if len(track.stamps))
        span = (last - first) / 1e9
    notes = statements((*recording.notes, *(mapping.notes if mapping is not None else ())))
    return LogInfo(
        printable(str(path)), kind, topics, mapping, span, recording.salvaged, notes, reason, recording.sha256
    )


@dataclass
class _Seen:
    """A column so far. gaps: between cells that are not blank [s]."""

    numbers: bool = True
    count: int = 0
    last: float = np.nan
    longest: float = 0.0
    steps: FloatArray = field(default_factory=lambda: np.zeros(0))

    def add(self, cells: Any, t: FloatArray | None) -> None:
        """Count the cells of a block, (rows,), and the times t (rows,) [s] between them."""
        words = isinstance(cells, tuple)
        present = np.array([bool(cell) for cell in cells]) if words else np.isfinite(cells)
        self.numbers &= not words
        self.count += int(present.sum())
        if t is None:
            return
        times = t[present & np.isfinite(t)]
        steps = np.diff(times, prepend=self.last) if np.isfinite(self.last) else np.diff(times)
        if times.size:
            self.last = float(times[-1])
        self.longest = max(self.longest, float(steps.max(initial=0.0)))
        if not self.steps.size:
            self.steps = steps


def _of_columns(
    path: str | os.PathLike, kind: str, robot: Robot | None, options: LogOptions, progress: Progress
) -> LogInfo:
    """A table: a topic for each column. It is read in pieces, whatever its length."""
    statistics: dict[str, _Seen] = {}
    mapping, reason, clock, table = None, "", Clock(), None
    first, last = np.inf, -np.inf
    for table in _tables(path, options, progress):
        if not statistics:
            try:
                mapping = map_columns(table, robot, options)
            except InputError as error:
                reason = str(error)
        t = clock.times(table, mapping.columns[TIME], []) if mapping is not None else None
        for name, cells in table.columns.items():
            statistics.setdefault(name, _Seen()).add(cells, t)
        if t is not None and np.isfinite(t).any():
            first, last = min(first, float(np.nanmin(t))), max(last, float(np.nanmax(t)))
    assert table is not None
    taken_names = {column.name for column in mapping.columns.values()} if mapping is not None else set()
    topics = tuple(_topic(name, values, table, name in taken_names) for name, values in statistics.items())
    notes = statements((*table.notes, *(mapping.notes if mapping is not None else ())))
    return LogInfo(
        printable(str(path)), kind, topics, mapping, max(0.0, last - first), None, notes, reason, table.sha256
    )


def _tables(path: str | os.PathLike, options: LogOptions, progress: Progress) -> Iterator[FileTable]:
    tables = map(with_joined_stamp, iter_tables(path, PIECE, progress=progress, **options.of_tables))
    return timed(tables, options.rate, options.skip_bad_rows)


def _topic(name: str, statistics: _Seen, table: FileTable, is_taken: bool) -> Topic:
    steps = statistics.steps[statistics.steps > 0.0]
    rate = 1.0 / float(np.median(steps)) if steps.size else 0.0
    unit = table.units.get(name, "")
    kind = f"numbers{f' [{unit}]' * bool(unit)}" if statistics.numbers else "words"
    return Topic(name, kind, statistics.count, rate, statistics.longest, is_taken)
