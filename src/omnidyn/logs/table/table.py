"""One strict reader for every table of numbers in a text file (CSV): logs, voltage files, steady tables, runs.

It takes a byte order mark, any end of line, comment lines (# or %), a header that stands in comments, a row of units
under the header or a line of titles above it, separators comma, semicolon and tab, one at the end of every row too,
runs of spaces where nothing else separates, and a decimal comma where it is unmistakable. What it had to decide stands
in `Table.notes`.
It refuses, with file, line and column, what other readers swallow: ragged rows, a missing header, a quote that is
never closed, 1e400, 1_000, 0x10, #N/A, blank cells where a number is needed.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes, too_large
from omnidyn.logs.table import dialect
from omnidyn.logs.table.header import TABS_NOTE, Layout, find_layout
from omnidyn.logs.table.rows import Column, FloatArray, RowParser
from omnidyn.logs.table.spaced import NOTE, is_spaced, tabbed
from omnidyn.logs.table.text import TOO_LARGE_REMEDY, Piece, Progress, TextFile

ROWS = 500_000
MAX_CELLS = 2**24  # in one piece: 128 MiB of floats
HEAD_ROWS = 100  # the first rows are looked at together to tell how a file is written
MAX_HEAD_LINES = 100_000  # without a row, it is no table
MIN_HELD_BYTES = 64 * 2**20


@dataclass(frozen=True, eq=False)
class Table:
    """A table as it stands in a file.

    names: of the columns, in order. columns: name -> floats, shape (rows,), NaN where a cell is blank or nan; or a
    tuple of text where a cell is neither. Infinite numbers are never in it.
    lines: line of each row in the file, counted from 1; number of each row, in a Parquet file. Shape (rows,).
    units: name -> unit, where a row or the header gave them. titles: name -> long name, where a line gave them.
    source: the path. sha256: of the file's bytes. notes: what the reader had to decide, in words.
    """

    names: tuple[str, ...]
    columns: Mapping[str, Column]
    lines: NDArray[np.int64]
    units: Mapping[str, str]
    source: str
    sha256: str
    notes: tuple[str, ...] = ()
    titles: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for values in (self.lines, *self.columns.values()):
            if not isinstance(values, tuple):
                values.flags.writeable = False

    def __len__(self) -> int:
        return len(self.lines)

    def numbers(self, name: str, *, missing: bool = False) -> FloatArray:
        """A column of numbers, shape (rows,). With `missing`, a blank or nan cell is NaN; else it is refused.

        Raises InputError with file, line and column at the first cell that cannot be used.
        """
        column = self.columns[name]
        if isinstance(column, tuple):
            bad = (k for k, cell in enumerate(column) if not dialect.is_number_or_missing(cell))
            row = next(bad, 0)  # all are numbers in a later piece of a column that began with words
            raise self.fault(
                row, name, "not a number", column[row], "a number such as -1.5 or 2e-3", _hint(column[row])
            )
        bad = np.flatnonzero(np.isnan(column))
        if bad.size and not missing:
            raise self.fault(
                int(bad[0]),
                name,
                "a number is missing",
                "a blank cell or nan",
                "a number",
                f"fill it in, or remove the row ({bad.size} of {len(self)} are missing)",
            )
        return column

    def text(self, name: str, expected: str = "text") -> tuple[str, ...]:
        """A column of words. Raises InputError when the cells are numbers or blank."""
        column = self.columns[name]
        if not isinstance(column, tuple):
            raise self.fault(0, name, "not text", float(column[0]), expected)
        return column

    def fault(self, row: int, name: str, what: str, got: object, expected: str = "", remedy: str = "") -> InputError:
        """The error at one cell: file:line, column NAME."""
        where = f"{self.source}:{self.lines[row]}, column {name}"
        return InputError(what, got=got, expected=expected, remedy=remedy, where=where)

    def check_names(self, required: Sequence[str], optional: Sequence[str] = ()) -> None:
        """Raises InputError when a column is unknown (the nearest known name is given) or missing."""
        known = [*required, *optional]
        for name in self.names:
            if name not in known:
                close = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
                remedy = f"did you mean {close[0]}?" if close else "remove the column"
                raise InputError(
                    "unknown column", got=name, expected=", ".join(known), remedy=remedy, where=self.source
                )
        absent = [name for name in required if name not in self.names]
        if absent:
            raise InputError(
                "a column is missing",
                got=", ".join(self.names),
                expected=", ".join(known),
                remedy=f"add {', '.join(absent)}",
                where=self.source,
            )


def read_table(
    path: str | os.PathLike,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    max_bytes: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """Read a table of numbers (and words) from a text file. See the head of this file for what is taken and refused.

    header: False where the first row is a row already; the columns are then called c1, c2, ...
    skip_bad_rows: leave out rows with another number of cells, a broken quote, an infinite number, or text where the
    column holds numbers; they are counted in `notes`. max_bytes: refuse a larger file; a quarter of the memory where
    it is not given. progress(bytes_done, bytes_total) is called now and then.
    Raises InputError: `file:line, column NAME: what; got ...; expected ...; remedy`.
    """
    limit = default_max_bytes() if max_bytes is None else max_bytes
    file = TextFile(path, progress, limit)
    return join(_tables(file, ROWS, header, skip_bad_rows), limit)


def iter_text(
    path: str | os.PathLike,
    rows: int = ROWS,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    progress: Progress | None = None,
) -> Iterator[Table]:
    """The tables of a text file of any size, at most `rows` rows each; joined they are what `read_table` reads.

    The last of them has the sha256 of the file and all notes. A column that begins with numbers and goes on with words
    is numbers in the first tables. The rest as `read_table`.
    """
    return _tables(TextFile(path, progress), rows, header, skip_bad_rows)


def join(tables: Iterable[Table], max_bytes: int | None = None) -> Table:
    """One table from the pieces of a file. Raises InputError when their numbers take more than `max_bytes`."""
    parts: list[Table] = []
    held = 0
    for table in tables:
        parts.append(table)
        held += 8 * len(table) * (len(table.names) + 1)
        if max_bytes is not None and held > max(max_bytes, MIN_HELD_BYTES):
            raise too_large(table.source, max_bytes, TOO_LARGE_REMEDY)
    last = parts[-1]
    if len(parts) == 1:
        return last
    columns = {name: _joined([part.columns[name] for part in parts]) for name in last.names}
    return replace(last, columns=columns, lines=np.concatenate([part.lines for part in parts]))


def _joined(columns: Sequence[Column]) -> Column:
    """A column of words, where any piece of it holds words."""
    if not any(isinstance(column, tuple) for column in columns):
        return np.concatenate(columns)
    return tuple(chain.from_iterable(c if isinstance(c, tuple) else map(repr, c.tolist()) for c in columns))


def _tables(file: TextFile, rows: int, header: bool, skip: bool) -> Iterator[Table]:
    """The tables one after the other; the last one waits for the end of the file, to have its hash."""
    if rows < 1:
        raise InputError("no rows in a piece", got=rows, expected="1 or more")
    head, pieces = _head(file.pieces(rows))
    spaced = is_spaced(head)
    if spaced:
        head, pieces = [tabbed(line) for line in head], _tabbed(pieces)
    layout = find_layout(head, file.source, header)
    if spaced:
        notes = [NOTE if note == TABS_NOTE else note for note in layout.notes]
        layout = replace(layout, notes=tuple(notes))
    sample = _kept(Piece(1, head), layout.first)[0][: dialect.SAMPLE_ROWS]
    parser = RowParser(layout, file.source, skip, sample)
    waiting: Table | None = None
    for piece in _cut(pieces, max(1, min(rows, MAX_CELLS // len(layout.names)))):
        texts, lines = _kept(piece, layout.first)
        if not texts:
            continue
        columns, lines = parser.parse(
            texts, lines, partial(_texts_from, file, layout, piece.first + len(piece.lines), spaced)
        )
        if not len(lines):
            continue
        if waiting is not None:
            yield waiting
        notes = (*layout.notes, *file.notes, *parser.notes)
        waiting = Table(layout.names, columns, lines, layout.units, file.source, "", notes, layout.titles)
    if waiting is None:
        raise InputError("no rows", got="0 samples", expected="at least one row under the header", where=file.source)
    yield replace(waiting, sha256=file.sha256, notes=(*layout.notes, *file.notes, *parser.notes))


def _head(pieces: Iterator[Piece]) -> tuple[list[str], Iterator[Piece]]:
    """The first lines of a file, enough to tell how it is written, and all its pieces."""
    taken: list[Piece] = []
    lines: list[str] = []
    rows = 0
    for piece in pieces:
        taken.append(piece)
        for line in piece.lines:
            lines.append(line)
            rows += bool(line) and not _is_comment(line)
            if rows > HEAD_ROWS:
                return lines, chain(taken, pieces)
        if len(lines) > MAX_HEAD_LINES:
            break
    return lines, chain(taken, pieces)


def _cut(pieces: Iterable[Piece], rows: int) -> Iterator[Piece]:
    for first, lines in pieces:
        yield from (Piece(first + k, lines[k : k + rows]) for k in range(0, len(lines), rows))


def _tabbed(pieces: Iterable[Piece]) -> Iterator[Piece]:
    for first, lines in pieces:
        yield Piece(first, [tabbed(line) if line else line for line in lines])


def _kept(piece: Piece, first: int) -> tuple[list[str], NDArray[np.int64]]:
    """The rows in a piece, without blank lines, comments and what stands above line `first`; and their lines."""
    begin = max(0, first - piece.first)
    lines = piece.lines[begin:]
    kept = [k for k, line in enumerate(lines) if line and not line.isspace() and not _is_comment(line)]
    texts = lines if len(kept) == len(lines) else [lines[k] for k in kept]
    return texts, np.array(kept, dtype=np.int64) + (piece.first + begin)


def _is_comment(line: str) -> bool:
    return ("#" in line or "%" in line) and dialect.is_comment(line)


def _texts_from(file: TextFile, layout: Layout, line: int, spaced: bool) -> Iterator[str]:
    """The rows from a line on, read again from the file."""
    pieces = TextFile(file.path).pieces(ROWS)
    for piece in _tabbed(pieces) if spaced else pieces:
        yield from _kept(piece, max(line, layout.first))[0]


def _hint(cell: str) -> str:
    """What to do about a cell that is not a number."""
    if cell.startswith("#"):
        return "an error value of a spreadsheet: correct the formula there"
    if "_" in cell or cell.lower().startswith(("0x", "0b", "0o")):
        return "write plain decimal digits"
    if "," in cell:
        return "write a decimal point, and no separator of thousands"
    return "correct or remove the row; where a number is missing, leave the cell blank"
