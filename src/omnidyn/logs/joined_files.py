"""Several files of one experiment and one clock as one table: a bag of the robot and a table of motion capture, say."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes, sha256
from omnidyn.logs.channels import TIME
from omnidyn.logs.clock.clock import Clock
from omnidyn.logs.clock.stamps import with_joined_stamp
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.readers.read_table import read_table, reader_of
from omnidyn.logs.readers.reader import ReadOptions, completed
from omnidyn.logs.readers.recording import Recording, Track
from omnidyn.logs.table.table import ROWS, FileTable, join

Mapped = Callable[[FileTable], ColumnMap]


def joined_table(paths: Sequence[str | os.PathLike], options: ReadOptions, mapped: Mapped) -> FileTable:
    """The topics and columns of all files, a row for each stamp, blank where a file has nothing there.

    mapped(table): which column is what, for the time of a table. A name that two files have is told by the file.
    Raises InputError where a file has no time in common with the first: they are of two clocks, or of two runs.
    """
    limit = default_max_bytes() if options.max_bytes is None else options.max_bytes
    options = options._replace(max_bytes=limit)
    recordings = [_recording(path, options, mapped) for path in paths]
    spans = [_span(recording) for recording in recordings]
    for recording, (first, last) in zip(recordings[1:], spans[1:], strict=True):
        if first > spans[0][1] or last < spans[0][0]:
            raise InputError(
                "the files were not recorded at the same time",
                got=f"{_moments(first, last)}, {recording.source}",
                expected=f"times within {_moments(*spans[0])}, as in {recordings[0].source}",
                remedy="give stamps of one clock, such as seconds since 1970; logs of several runs need no joining",
                where=recording.source,
            )
    names: set[str] = set()
    tracks = [
        _renamed(track, Path(recording.source).stem, names) for recording in recordings for track in recording.tracks
    ]
    notes = [f"{len(recordings)} files are one experiment: {', '.join(recording.source for recording in recordings)}"]
    notes += [note for recording in recordings for note in recording.notes]
    digest = sha256("".join(recording.sha256 for recording in recordings))
    tables = Recording(tracks, [], recordings[0].source, digest, notes).tables(ROWS)
    return join(completed(tables, "one row"), limit)


def _recording(path: str | os.PathLike, options: ReadOptions, mapped: Mapped) -> Recording:
    """A file as topics with stamps; a table is one topic, by its own time."""
    reader = reader_of(path)
    if reader.recording is not None:
        recording = reader.recording(path, options)
        return replace(recording, tracks=[track for track in recording.tracks if len(track.stamps) and track.columns])
    table = with_joined_stamp(
        read_table(
            path,
            header=options.header,
            skip_bad_rows=options.skip_bad_rows,
            max_bytes=options.max_bytes,
            variables=options.variables,
        )
    )
    column, clock = mapped(table).columns[TIME], Clock()
    t = clock.times(table, column, [])
    finite = np.isfinite(t)
    stamps = np.rint(t[finite] * 1e9).astype(np.int64) + round(clock.start(column) * 1e9)
    numbers = {
        name: values[finite]
        for name, values in table.columns.items()
        if name != column.name and not isinstance(values, tuple)
    }
    units = {name: unit for name, unit in table.units.items() if name in numbers}
    track = Track(Path(path).name, stamps, numbers, units, dict(table.says))
    return Recording([track], [], table.source, table.sha256, list(table.notes))


def _span(recording: Recording) -> tuple[int, int]:
    """First and last stamp [ns]. Raises InputError where nothing is read."""
    stamps = [track.stamps for track in recording.tracks if len(track.stamps)]
    if not stamps:
        raise InputError("no numbers to join", got="no rows", expected="stamps and numbers", where=recording.source)
    return min(int(stamp.min()) for stamp in stamps), max(int(stamp.max()) for stamp in stamps)


def _moments(first: int, last: int) -> str:
    """A span in words: dates where it counts from 1970."""
    if first < 10**17:
        return f"{first / 1e9:.6g} to {last / 1e9:.6g} s"
    return " to ".join(
        datetime.fromtimestamp(stamp / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S") for stamp in (first, last)
    )


def _renamed(track: Track, stem: str, taken_names: set[str]) -> Track:
    """The track with the name of its file before columns whose names are taken."""
    names = {name: name if name not in taken_names else f"{stem}/{name}" for name in track.columns}
    taken_names |= set(names.values())
    return Track(
        track.topic,
        track.stamps,
        {names[name]: values for name, values in track.columns.items()},
        {names[name]: unit for name, unit in track.units.items()},
        {names[name]: declaration for name, declaration in track.says.items() if name in names},
    )
