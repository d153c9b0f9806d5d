"""Table: columns of numbers and words as they stand in a file, whatever its format."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, did_you_mean, printable
from omnidyn.files import too_large
from omnidyn.logs.table import dialect
from omnidyn.logs.table.rows import Column
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY
from omnidyn.run import LARGEST_SIZE
from omnidyn.statement import Statement

ROWS = 500_000
MAX_CELLS = 2**24  # in one block: 128 MiB of floats
MIN_HELD_BYTES = 64 * 2**20
LEAST_SIZE = 1e-100  # of a number of a log, beside 0


class Declaration(NamedTuple):
    """What a format itself says of a column: a message of ROS names what its fields are.

    component: such as "vx", "t"; "" for a column that is nothing by itself and is taken only by `column`.
    why: why it is not taken though it looks like the component; None where it is taken.
    """

    component: str = ""
    why: Statement | None = None


@dataclass(frozen=True, eq=False)
class FileTable:
    """A table as it stands in a file.

    names: of the columns, in order. columns: name -> floats, shape (rows,), NaN where a cell is blank or nan; or a
    tuple of text where a cell is neither. Infinite numbers are never in it.
    lines: line of each row in the file, counted from 1; number of each row, in a Parquet file. Shape (rows,).
    units: name -> unit, where a row or the header gave them. titles: name -> long name, where a line gave them.
    source: the path. sha256: of the file's bytes. notes: what the reader had to decide, in words.
    says: name -> what the format says it is; no other column of these is guessed by its name. own_clocks: topics with
    clocks of their own, a row per stamp: a blank cell is no missing value. begins: lines of the rows in which another
    recording of the same file begins.
    """

    names: tuple[str, ...]
    columns: Mapping[str, Column]
    lines: IntArray
    units: Mapping[str, str]
    source: str
    sha256: str
    notes: tuple[Statement | str, ...] = ()
    titles: Mapping[str, str] = field(default_factory=dict)
    says: Mapping[str, Declaration] = field(default_factory=dict)
    own_clocks: bool = False
    begins: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        printable_names = {name: printable(name) for name in self.names if not name.isprintable()}
        if (
            any(name != printable_name for name, printable_name in printable_names.items())
            or not self.source.isprintable()
        ):
            self._rename(printable_names)
        for values in (self.lines, *self.columns.values()):
            if not isinstance(values, tuple):
                values.flags.writeable = False

    def _rename(self, printable_names: Mapping[str, str]) -> None:
        """Call columns and file by names that can be shown; two that look alike then are told apart by a number."""
        new_names: dict[str, str] = {}
        for name in self.names:
            printable_name = printable_names.get(name, name)
            new_names[name] = (
                printable_name
                if printable_name not in new_names.values()
                else f"{printable_name} ({len(new_names) + 1})"
            )
        object.__setattr__(self, "names", tuple(new_names.values()))
        object.__setattr__(self, "source", printable(self.source))
        for field_name in ("columns", "units", "titles", "says"):
            old = getattr(self, field_name)
            object.__setattr__(self, field_name, {new_names.get(name, name): value for name, value in old.items()})

    def __len__(self) -> int:
        return len(self.lines)

    def numbers(self, name: str, *, missing: bool = False) -> FloatArray:
        """A column of numbers, shape (rows,). With `missing`, a blank or nan cell is NaN; else it is refused.

        Raises InputError with file, line and column at the first cell that cannot be used.
        """
        column = self.columns[name]
        if isinstance(column, tuple):
            faults = (k for k, cell in enumerate(column) if not dialect.is_number_or_missing(cell))
            row = next(faults, 0)  # all are numbers in a later block of a column that began with words
            raise self.fault(
                row, name, "not a number", column[row], "a number such as -1.5 or 2e-3", _hint(column[row])
            )
        faults = np.flatnonzero(np.isnan(column))
        if faults.size and not missing:
            raise self.fault(
                int(faults[0]),
                name,
                "a number is missing",
                "a blank cell or nan",
                "a number",
                f"fill it in, or remove the row ({faults.size} of {len(self)} are missing)",
            )
        return column

    def measured(self, name: str, *, missing: bool = False, skip: bool = False) -> FloatArray:
        """A column of numbers of a size that a sensor may give: one below LEAST_SIZE is 0; see `numbers`.

        skip: whether one beyond LARGEST_SIZE is NaN; otherwise it raises InputError.
        """
        column = self.numbers(name, missing=missing)
        size = np.abs(column)
        large, small = (size > LARGEST_SIZE) & np.isfinite(size), (size < LEAST_SIZE) & (size > 0.0)
        if large.any() and not skip:
            row = int(np.argmax(large))
            remedy = "leave the cell blank, or use `skip_bad_rows`" if missing else "correct it, or remove the row"
            many = f" ({large.sum()} of {len(self)} are as large)" if large.sum() > 1 else ""
            raise self.fault(
                row,
                name,
                "no sensor gives such a number",
                float(column[row]),
                f"at most {LARGEST_SIZE:g} in size{many}",
                remedy,
            )
        if large.any() or small.any():
            column = np.where(large, np.nan, np.where(small, 0.0, column))
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
        allowed = [*required, *optional]
        for name in self.names:
            if name not in allowed:
                remedy = did_you_mean(name, allowed, "remove the column")
                raise InputError(
                    "unknown column", got=name, expected=", ".join(allowed), remedy=remedy, where=self.source
                )
        self.require(required, allowed)

    def require(self, required: Sequence[str], allowed: Sequence[str] = (), what: str = "a column is missing") -> None:
        """Raises InputError where one of these columns is missing. allowed: what the error names; those by default."""
        absent = [name for name in required if name not in self.names]
        if absent:
            raise InputError(
                what,
                got=", ".join(self.names),
                expected=", ".join(allowed or required),
                remedy=f"add {', '.join(absent)}",
                where=self.source,
            )


def join(tables: Iterable[FileTable], max_bytes: int | None = None) -> FileTable:
    """One table from the blocks of a file. Raises InputError when their numbers take more than `max_bytes`."""
    parts: list[FileTable] = []
    held_bytes = 0
    for table in tables:
        parts.append(table)
        held_bytes += 8 * len(table) * (len(table.names) + 1)
        if max_bytes is not None and held_bytes > max(max_bytes, MIN_HELD_BYTES):
            raise too_large(table.source, max_bytes, TOO_LARGE_REMEDY)
    last = parts[-1]
    if len(parts) == 1:
        return last
    columns = {name: _joined([part.columns[name] for part in parts]) for name in last.names}
    lines, begins = np.concatenate([part.lines for part in parts]), chain.from_iterable(part.begins for part in parts)
    return replace(last, columns=columns, lines=lines, begins=tuple(begins))


def _joined(columns: Sequence[Column]) -> Column:
    """A column of words, where any block of it holds words."""
    if not any(isinstance(column, tuple) for column in columns):
        return np.concatenate(columns)
    return tuple(chain.from_iterable(c if isinstance(c, tuple) else map(repr, c.tolist()) for c in columns))


def _hint(cell: str) -> str:
    """What to do about a cell that is not a number."""
    if cell.startswith("#"):
        return "an error value of a spreadsheet: correct the formula there"
    if "_" in cell or cell.lower().startswith(("0x", "0b", "0o")):
        return "write plain decimal digits"
    if "," in cell:
        return "write a decimal point, and no separator of thousands"
    return (
        "correct or remove the row, or leave such rows out with `skip_bad_rows`; where a number is missing, leave the "
        "cell blank"
    )
