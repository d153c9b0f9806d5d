"""One strict reader for every table of numbers in a text file (CSV): voltage files, steady tables, runs.

It takes a byte order mark, any end of line, comment lines (#), a row of units under the header, separators comma,
semicolon and tab, and a decimal comma where it is unmistakable. What it had to decide stands in `Table.notes`.
It refuses, with file, line and column, what other readers swallow: ragged rows, a missing header, a quote that is
never closed, 1e400, 1_000, 0x10, #N/A, blank cells where a number is needed.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError
from omnidyn.files import read_bytes, read_text, sha256
from omnidyn.logs import dialect

FloatArray = NDArray[np.float64]
Column = FloatArray | tuple[str, ...]

MAX_TABLE_BYTES = 512 * 2**20
MAX_COLUMNS = 1000
COMMA_NOTE = "numbers have a decimal comma"


@dataclass(frozen=True, eq=False)
class Table:
    """A table as it stands in a file.

    names: of the columns, in order. columns: name -> floats, shape (rows,), NaN where a cell is blank or nan; or a
    tuple of text where a cell is neither. Infinite numbers are never in it.
    lines: line of each row in the file, counted from 1. Shape (rows,). units: name -> unit, where a row gave them.
    source: the path. sha256: of the file's bytes. notes: what the reader had to decide, in words.
    """

    names: tuple[str, ...]
    columns: Mapping[str, Column]
    lines: NDArray[np.int64]
    units: Mapping[str, str]
    source: str
    sha256: str
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.lines)

    def numbers(self, name: str, *, missing: bool = False) -> FloatArray:
        """A column of numbers, shape (rows,). With `missing`, a blank or nan cell is NaN; else it is refused.

        Raises InputError with file, line and column at the first cell that cannot be used.
        """
        column = self.columns[name]
        if isinstance(column, tuple):
            row = next(k for k, cell in enumerate(column) if not _is_number_or_missing(cell))
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


class _Rows(NamedTuple):
    """The lines of a file that hold cells: text and line number, header first."""

    header: str
    header_line: int
    texts: list[str]
    lines: NDArray[np.int64]
    notes: list[str]


def read_table(path: str | os.PathLike, max_bytes: int = MAX_TABLE_BYTES) -> Table:
    """Read a table of numbers (and words) with a header. See the head of this file for what is taken and refused.

    Raises InputError: `file:line, column NAME: what; got ...; expected ...; remedy`.
    """
    source = str(path)
    digest = sha256(read_bytes(path, max_bytes))
    rows = _header_and_rows(read_text(path, max_bytes), source)
    separator = dialect.find_separator(rows.header, rows.texts, f"{source}:{rows.header_line}")
    names = _names(rows, separator, source)
    notes, units = list(rows.notes), {}
    if separator != ",":
        notes.append(f"columns are separated by {'a tab' if separator == chr(9) else 'a semicolon'}")
    if rows.texts:
        cells = dialect.split_cells(rows.texts[0], separator, f"{source}:{rows.lines[0]}")
        if len(cells) == len(names) and dialect.is_units_row(cells):
            units = {name: dialect.strip_brackets(cell) for name, cell in zip(names, cells, strict=True) if cell}
            rows = rows._replace(texts=rows.texts[1:], lines=rows.lines[1:])
    if not rows.texts:
        raise InputError("no rows", got="0 samples", expected="at least one row under the header", where=source)
    columns, more = _fast_columns(rows, separator, names) or _careful_columns(rows, separator, names, source)
    table = Table(tuple(names), columns, rows.lines, units, source, digest, (*notes, *more))
    _refuse_infinite(table)
    return table


def _header_and_rows(text: str, source: str) -> _Rows:
    """Header and rows, without blank lines and comments; any end of line will do."""
    if "\0" in text:
        raise InputError("this is not a text file", got="zero bytes in it", expected="text", where=source)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    kept = [k for k, line in enumerate(lines) if line and not line.isspace() and not _hash(line)]
    if not kept:
        raise InputError(
            "no table in the file", got="only blank lines and comments", expected="a header and rows", where=source
        )
    first = kept[0]
    if not dialect.looks_like_data(lines[first]):
        body, notes, header, header_line = kept[1:], [], lines[first], first + 1
    else:
        header, header_line = _commented_header(lines, first, source), first
        body, notes = kept, [f"line {first}, a comment, was read as the header"]
    return _Rows(header, header_line, [lines[k] for k in body], np.array(body, dtype=np.int64) + 1, notes)


def _hash(line: str) -> bool:
    return "#" in line and dialect.is_comment(line)


def _commented_header(lines: list[str], first: int, source: str) -> str:
    """The names that `numpy.savetxt` writes as a comment right above the first row; without them there is no header."""
    above = lines[first - 1].lstrip()[1:].strip() if first else ""
    for separator in dialect.SEPARATORS:
        names = [name.strip() for name in above.split(separator)]
        usual = len(set(names)) == len(names) and all(names) and not any(map(dialect.looks_like_number, names))
        if usual and len(names) > 1 and len(names) == len(lines[first].split(separator)):
            return above
    raise InputError(
        "the table has no header: its first row is numbers",
        got=lines[first],
        expected="column names such as t_s,u1_V",
        remedy="add a first line with the column names",
        where=f"{source}:{first + 1}",
    )


def _names(rows: _Rows, separator: str, source: str) -> list[str]:
    """The column names: one each, none blank, none a number, none twice."""
    where = f"{source}:{rows.header_line}"
    if rows.header.count(separator) >= MAX_COLUMNS:
        raise InputError(
            "too many columns", got=rows.header.count(separator) + 1, expected=f"at most {MAX_COLUMNS}", where=where
        )
    names = dialect.split_cells(rows.header, separator, where)
    for k, name in enumerate(names):
        if not name:
            raise InputError(
                f"column {k + 1} has no name",
                got=rows.header,
                expected="a name for every column",
                remedy="name it or remove it",
                where=where,
            )
        if dialect.looks_like_number(name):
            raise InputError(
                "the table has no header: a number stands where a name should",
                got=name,
                expected="column names such as t_s,u1_V",
                remedy="add a first line with the column names",
                where=where,
            )
        if name in names[:k]:
            raise InputError("two columns have the same name", got=name, expected="different names", where=where)
    return names


def _fast_columns(rows: _Rows, separator: str, names: list[str]) -> tuple[dict[str, Column], list[str]] | None:
    """NumPy's own parser, for a table of plain numbers; None where it stumbles, to be looked at with care.

    It takes no underscore, no hexadecimal and no ragged row; what it takes too gladly (1e400) is checked later.
    """
    comma = separator != "," and dialect.is_decimal_comma_plain(rows.texts, separator)
    texts = [text.replace(",", ".") for text in rows.texts] if comma else rows.texts
    try:
        values = np.loadtxt(texts, delimiter=separator, comments=None, ndmin=2)
    except (ValueError, OverflowError):
        return None
    if values.shape != (len(texts), len(names)):
        return None
    columns: dict[str, Column] = {name: _frozen(values[:, k].copy()) for k, name in enumerate(names)}
    return columns, [COMMA_NOTE] if comma else []


def _careful_columns(rows: _Rows, separator: str, names: list[str], source: str) -> tuple[dict[str, Column], list[str]]:
    """Cell by cell: finds what is wrong and where, and reads words, blanks, quotes and decimal commas."""
    table: list[list[str]] = []
    for k, (line, text) in enumerate(zip(rows.lines, rows.texts, strict=True)):
        cells = dialect.split_cells(text, separator, f"{source}:{line}")
        if len(cells) != len(names):
            raise InputError(
                f"row {k + 1} has another number of cells than the header",
                got=f"{len(cells)}: {text}",
                expected=f"{len(names)} cells",
                remedy=_ragged_hint(separator),
                where=f"{source}:{line}",
            )
        table.append(cells)
    comma = separator != "," and dialect.has_decimal_comma(chain.from_iterable(table), source)
    columns = {name: _column([row[k] for row in table], comma) for k, name in enumerate(names)}
    return columns, [COMMA_NOTE] if comma else []


def _column(cells: list[str], decimal_comma: bool) -> Column:
    """Floats where every cell is a number or missing, the words as they are otherwise."""
    values = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if decimal_comma and dialect.COMMA_NUMBER.fullmatch(cell):
            cell = cell.replace(",", ".")
        if not _is_number_or_missing(cell):
            return tuple(cells)
        if cell:
            values[k] = float(cell)
    return _frozen(values)


def _is_number_or_missing(cell: str) -> bool:
    known = dialect.NUMBER.fullmatch(cell) or dialect.INFINITE.fullmatch(cell)
    return bool(known) or cell == "" or cell.lower() == "nan"


def _refuse_infinite(table: Table) -> None:
    for name, column in table.columns.items():
        if not isinstance(column, tuple) and np.isinf(column).any():
            row = int(np.flatnonzero(np.isinf(column))[0])
            raise table.fault(
                row,
                name,
                "not a finite number",
                "inf, or a number beyond 1.8e308",
                "a finite number",
                "correct or remove the row",
            )


def _frozen(values: FloatArray) -> FloatArray:
    values.flags.writeable = False
    return values


def _hint(cell: str) -> str:
    """What to do about a cell that is not a number."""
    if cell.startswith("#"):
        return "an error value of a spreadsheet: correct the formula there"
    if "_" in cell or cell.lower().startswith(("0x", "0b", "0o")):
        return "write plain decimal digits"
    if "," in cell:
        return "write a decimal point, and no separator of thousands"
    return "correct or remove the row"


def _ragged_hint(separator: str) -> str:
    if separator == ",":
        return "a decimal comma? then separate the columns by semicolons; else correct or remove the row"
    return "correct or remove the row"
