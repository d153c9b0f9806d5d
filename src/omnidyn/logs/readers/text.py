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
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from omnidyn.arrays import IntArray
from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes
from omnidyn.logs.readers.listed import is_listed, recording_of
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.readers.spaced_text import NOTE, is_spaced, tabbed
from omnidyn.logs.table import dialect
from omnidyn.logs.table.header import TABS_NOTE, FileLine, Layout, find_layout
from omnidyn.logs.table.rows import Column, RowParser
from omnidyn.logs.table.table import MAX_CELLS, ROWS, FileTable
from omnidyn.logs.table.text_file import TextBlock, TextFile, cut_short

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
