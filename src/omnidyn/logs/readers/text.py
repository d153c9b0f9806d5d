"""Tables of numbers in a text file (CSV and its kin), strictly read: logs, voltage files, steady tables, runs.

It takes a byte order mark, any end of line, comment lines (# or %), a header that stands in comments, a row of units
under the header or a line of titles above it, separators comma, semicolon and tab, one at the end of every row too,
runs of spaces where nothing else separates, and a decimal comma where it is unmistakable. What it had to decide stands
in `Table.notes`.
It refuses, with file, line and column, what other readers swallow: ragged rows, a missing header, a quote that is
never closed, 1e400, 1_000, 0x10, #N/A, blank cells where a number is needed.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from omnidyn.arrays import IntArray
from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes, too_large
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.readers.recording import Recording, Track, topic_of
from omnidyn.logs.readers.spaced_text import NOTE, is_spaced, tabbed
from omnidyn.logs.table import dialect
from omnidyn.logs.table.header import MAX_COLUMNS, TABS_NOTE, FileLine, Layout, find_layout
from omnidyn.logs.table.rows import Column, RowParser
from omnidyn.logs.table.table import MAX_CELLS, ROWS, FileTable
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY, TextBlock, TextFile, cut_short

HEAD_ROWS = 100  # the first rows are looked at together to tell how a file is written
KEPT_COMMENTS = 2  # right above a row: names, and perhaps their units


def text_tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    """The tables of a text file; see the head of this file for what is taken and refused, and the contract.

    A list with a row for every value (listed) becomes a table of topics, and is held whole.
    """
    tables = _as_they_stand(path, rows, options)
    first = next(tables)
    if not is_listed(first.names):
        yield from chain([first], tables)
        return
    limit = default_max_bytes() if options.max_bytes is None else options.max_bytes
    yield from recording_of(chain([first], tables), limit).tables(rows)


def _as_they_stand(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    """The rows as they stand in the file."""
    file = TextFile(path, options.progress, options.max_bytes)
    head, blocks = _head(file.blocks(rows))
    spaced = is_spaced([line.text for line in head])
    if spaced:
        head, blocks = [FileLine(line.number, tabbed(line.text)) for line in head], _tabbed(blocks)
    layout = find_layout(head, file.source, options.header)
    if spaced:
        notes = [NOTE if note == TABS_NOTE else note for note in layout.notes]
        layout = replace(layout, notes=tuple(notes))
    rows_of_head = [text for number, text in head if number >= layout.first and not dialect.is_comment(text)]
    sample = rows_of_head[: dialect.SAMPLE_ROWS]
    parser = RowParser(layout, file.source, options.skip_bad_rows, sample)
    block_rows = max(1, min(rows, MAX_CELLS // len(layout.names)))

    def table(columns: dict[str, Column], lines: IntArray, sha256: str = "") -> FileTable:
        notes = (*layout.notes, *file.notes, *parser.notes)
        return FileTable(layout.names, columns, lines, layout.units, file.source, sha256, notes, layout.titles)

    pieces = (
        TextBlock(first + k, texts[k : k + block_rows])
        for first, texts in blocks
        for k in range(0, len(texts), block_rows)
    )
    for block in pieces:
        texts, lines = _kept(block, layout.first)
        if texts and file.ends_open and lines[-1] == file.last and _is_cut(texts[-1], layout):
            texts, lines = texts[:-1], lines[:-1]
            file.notes.append(
                cut_short(f"line {file.last}, the last one, ends in the middle of a row: it was left out")
            )
        if texts:
            later = partial(_texts_from, file, layout, block.first + len(block.lines), spaced)
            yield table(*parser.parse(texts, lines, later))
    yield table({}, np.zeros(0, dtype=np.int64), file.sha256)


TEXT = Reader("", "text", (), text_tables, "at least one row under the header")


def _head(blocks: Iterator[TextBlock]) -> tuple[list[FileLine], Iterator[TextBlock]]:
    """The first lines of a file, enough to tell how it is written, and all its blocks.

    Blank lines, all comments of a run but its last two, and blocks of nothing else are let go of: a file may begin
    with more of them than fit into memory.
    """
    head_blocks: list[TextBlock] = []
    lines: list[FileLine] = []
    rows = comments = 0
    for block in blocks:
        before = rows
        for number, text in enumerate(block.lines, block.first):
            if not text or text.isspace():
                continue
            comments = comments + 1 if dialect.is_comment(text) else 0
            rows += not comments
            lines.append(FileLine(number, text))
            if comments > KEPT_COMMENTS:
                del lines[-1 - KEPT_COMMENTS]
            if rows > HEAD_ROWS:
                return lines, chain([*head_blocks, block], blocks)
        if rows > before:
            head_blocks.append(block)
    return lines, iter(head_blocks)


def _tabbed(blocks: Iterable[TextBlock]) -> Iterator[TextBlock]:
    for first, lines in blocks:
        yield TextBlock(first, [tabbed(line) if line else line for line in lines])


def _kept(block: TextBlock, first: int) -> tuple[list[str], IntArray]:
    """The rows in a block, without blank lines, comments and what stands above line `first`; and their lines."""
    begin = max(0, first - block.first)
    lines = block.lines[begin:]
    indices = [k for k, line in enumerate(lines) if line and not line.isspace() and not dialect.is_comment(line)]
    texts = lines if len(indices) == len(lines) else [lines[k] for k in indices]
    return texts, np.array(indices, dtype=np.int64) + (block.first + begin)


def _is_cut(text: str, layout: Layout) -> bool:
    """Whether a row has fewer cells than the table: the file ends where the recorder was stopped."""
    try:
        return len(layout.cells(text, "")) < len(layout.names)
    except InputError:  # a quote that is never closed
        return True


def _texts_from(file: TextFile, layout: Layout, line: int, spaced: bool) -> Iterator[str]:
    """The rows from a line on, read again from the file."""
    blocks = TextFile(file.path).blocks(ROWS)
    for block in _tabbed(blocks) if spaced else blocks:
        yield from _kept(block, max(line, layout.first))[0]


# Text with a row for every value, time, key, value, as AdvantageScope exports a list: each key is a topic

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
