"""Text with a row for every value, time, key, value, as AdvantageScope exports a list: each key is a topic."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence

import numpy as np

from omnidyn.errors import InputError
from omnidyn.files import too_large
from omnidyn.logs.readers.recording import Recording, Track, topic_of
from omnidyn.logs.table import dialect
from omnidyn.logs.table.header import MAX_COLUMNS
from omnidyn.logs.table.rows import Column
from omnidyn.logs.table.table import FileTable
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY

NAMES = ("timestamp", "key", "value")
TRUTH = {"true": 1.0, "false": 0.0}
LATEST = 2.0**62 / 1e9  # [s]


def is_listed(names: Sequence[str]) -> bool:
    """Whether the columns of a text are those of such a list."""
    return tuple(name.strip().lower() for name in names) == NAMES


def recording_of(tables: Iterable[FileTable], max_bytes: int) -> Recording:
    """The topics of a list; times are in seconds. Raises InputError for a time that is none, or for too many values."""
    stamps: dict[str, array] = {}
    values: dict[str, array] = {}
    table, words, held_bytes = None, set(), 0
    for table in tables:
        if not len(table):  # the last one, with the hash
            continue
        time, keys, cells = (table.columns[name] for name in table.names)
        seconds = table.numbers(table.names[0])
        beyond = np.flatnonzero(np.abs(seconds) > LATEST)
        if beyond.size:
            raise table.fault(int(beyond[0]), table.names[0], "a time beyond all clocks", float(seconds[beyond[0]]))
        held_bytes += 16 * len(time)
        if held_bytes > max_bytes:
            raise too_large(table.source, max_bytes, TOO_LARGE_REMEDY)
        for k, (key, stamp) in enumerate(zip(keys, np.rint(seconds * 1e9).astype(np.int64).tolist(), strict=True)):
            number = _number(cells, k)
            if number is None:
                words.add(str(key))
                continue
            if key not in stamps and len(stamps) >= MAX_COLUMNS:
                raise InputError(
                    "too many keys",
                    got=f"more than {MAX_COLUMNS}",
                    expected=f"at most {MAX_COLUMNS}",
                    remedy="export the fields of wheels and commands alone",
                    where=table.source,
                )
            stamps.setdefault(str(key), array("q")).append(stamp)
            values.setdefault(str(key), array("d")).append(number)
    assert table is not None
    tracks = [
        Track(key, np.array(stamps[key], dtype=np.int64), {key: np.array(numbers)}) for key, numbers in values.items()
    ]
    topics = [topic_of(track.topic, "numbers", track.stamps, True) for track in tracks]
    word_keys = sorted(words - set(stamps))
    notes = [*table.notes, "a row for every value: each key is a topic with times of its own"]
    notes += [f"words are not read: {', '.join(word_keys[:8])}"] if word_keys else []
    return Recording(tracks, topics, table.source, table.sha256, notes)


def _number(cells: Column, row: int) -> float | None:
    """The number in a cell; None where it holds words."""
    cell = cells[row]
    if not isinstance(cell, str):
        return float(cell)
    if cell.lower() in TRUTH:
        return TRUTH[cell.lower()]
    return dialect.to_float(cell) if dialect.NUMBER.fullmatch(cell) or dialect.MISSING_CELL.fullmatch(cell) else None
