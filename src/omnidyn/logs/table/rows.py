"""Lines of text into columns of numbers, block after block; a block more or less never changes a number.

Plain numbers go through NumPy's own parser. Where it stumbles, every cell is looked at: that finds what is wrong and
where, and reads words, quotes and odd blanks. Both give the same numbers (a test holds them against each other).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.logs.table import dialect
from omnidyn.logs.table.decimals import Column, PointMeaning
from omnidyn.logs.table.header import Layout

Lines = IntArray

RAGGED, NOT_A_NUMBER, INFINITE = "another number of cells", "no number where one is due", "an infinite number"
BROKEN_QUOTE = "a broken quote"
REASONS = (RAGGED, BROKEN_QUOTE, NOT_A_NUMBER, INFINITE)
SHOWN_LINES = 5
COMMA_NOTE = "numbers have a decimal comma"


class RowParser:
    """Reads the rows of one file in order, given to it in blocks.

    layout: of the file. skip: leave out bad rows instead of refusing the file; `skipped` counts them, by reason, with
    their lines. sample: the first rows, which then say what columns hold numbers.
    What a block shows holds for all later ones: whether numbers have a decimal comma, and which columns hold words.
    """

    def __init__(self, layout: Layout, source: str, skip: bool = False, sample: Sequence[str] = ()):
        self.layout, self.source, self.skip = layout, source, skip
        self.skipped: dict[str, list[int]] = {}
        self._rows = 0
        self._points = PointMeaning(layout.separator, layout.names, source)
        self._comma = self._point = ""  # the first number of each kind
        self._words: set[str] = set()
        count = len(layout.names)
        first = [cells for text in sample if len(cells := self._cells_or_none(text)) == count]
        self._numeric = tuple(_mostly_numbers([cells[k] for cells in first]) for k in range(count))
        wordy = [not self._numeric[k] if skip else _holds_words(cells[k] for cells in first) for k in range(count)]
        self._maybe_words = {name for name, is_wordy in zip(layout.names, wordy, strict=True) if is_wordy}

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided so far, in words."""
        comma = [COMMA_NOTE] if self._comma else []
        return (
            *comma,
            *self._points.notes,
            *(skip_note(reason, self.skipped[reason]) for reason in REASONS if reason in self.skipped),
        )

    def parse(
        self, texts: list[str], lines: Lines, later: Callable[[], Iterable[str]] = tuple
    ) -> tuple[dict[str, Column], Lines]:
        """The columns of some rows, and the lines of those that were kept.

        texts: without blank lines and comments; `later` gives the texts of all rows that follow, where a decimal comma
        is not certain yet. Raises InputError, at the first bad row of all.
        """
        columns, all_lines = self._plain(texts), lines
        if columns is None:
            columns, lines = self._careful(texts, lines, later)
        if not self._comma:
            self._points.look(texts, all_lines, columns, later)
        self._rows += len(texts)
        return columns, lines

    # ---- plain numbers -----------------------------------------------------------------------------------

    def _plain(self, texts: list[str]) -> dict[str, Column] | None:
        """The columns of rows in which nothing is odd; None where a closer look is needed."""
        separator, ending, comma, first = self.layout.separator, self.layout.ending, False, ""
        texts = [text.rstrip().removesuffix(ending) for text in texts] if ending else texts
        if any('"' in text for text in texts):
            texts = [_unquoted(text, separator) for text in texts]
        if separator != ",":
            point = any("." in text for text in texts)
            comma = any("," in text for text in texts)
            certain = self._comma or dialect.is_decimal_comma_plain(texts, separator)
            if (point and (comma or self._comma)) or (comma and (self._point or not certain or self._maybe_words)):
                return None
            first = _first_comma(texts, separator) if comma else _first_point(texts, separator)
            texts = [text.replace(",", ".") for text in texts] if comma else texts
        columns = self._columns(texts)
        if columns is not None and separator != ",":
            self._comma = self._comma or (first if comma else "")
            self._point = self._point or ("" if comma else first)
        return columns

    def _columns(self, texts: list[str]) -> dict[str, Column] | None:
        """Numbers by NumPy's parser; the cells of columns that are known to hold words as they are."""
        names, separator = self.layout.names, self.layout.separator
        words = self._words | self._maybe_words
        if words and any(text.count(separator) != len(names) - 1 or '"' in text for text in texts):
            return None
        split = {name: [text.split(separator)[names.index(name)].strip() for text in texts] for name in words}
        for name, cells in split.items():
            if name not in self._words and all(map(dialect.is_number_or_missing, cells)):
                return None
        numeric = [k for k, name in enumerate(names) if name not in words]
        if not numeric:
            return None
        use = numeric if words else None
        values = _loaded(texts, separator, use)
        if values is None:
            values = _loaded([_filled(text, separator) for text in texts], separator, use)
        if values is None or values.shape != (len(texts), len(numeric)) or np.isinf(values).any():
            return None
        self._words |= words
        floats = {names[k]: values[:, place].copy() for place, k in enumerate(numeric)}
        return {name: tuple(split[name]) if name in split else floats[name] for name in names}

    # ---- cell by cell ------------------------------------------------------------------------------------

    def _careful(
        self, texts: list[str], lines: Lines, later: Callable[[], Iterable[str]]
    ) -> tuple[dict[str, Column], Lines]:
        """Rows before a fault are judged first: the error is that of the first bad row."""
        table, fault = self._split(texts, lines)
        keep = np.array([cells is not None for cells in table], dtype=bool)
        rows, lines = [cells for cells in table if cells is not None], lines[: len(table)][keep]
        if self.layout.separator != ",":
            count, doubt = self._decide(rows, lines, lambda: chain(texts[len(table) :], later()))
            rows, lines, fault = rows[:count], lines[:count], doubt or fault
        if self._comma:
            rows = [[_pointed(cell) for cell in cells] for cells in rows]
        if self.skip:
            rows, lines = self._good(rows, lines)
        columns = {name: self._column(name, [row[k] for row in rows]) for k, name in enumerate(self.layout.names)}
        refuse_infinite(columns, lines, self.source)
        if fault is not None:
            raise fault
        return columns, lines

    def _split(self, texts: list[str], lines: Lines) -> tuple[list[list[str] | None], InputError | None]:
        """The cells of each row up to the first fault; None for a row to leave out."""
        table: list[list[str] | None] = []
        for text, line in zip(texts, lines, strict=True):
            try:
                cells = self.layout.cells(text, f"{self.source}:{line}")
                self._check_count(cells, text, line, self._rows + len(table) + 1)
            except InputError as fault:
                if not self.skip:
                    return table, fault
                self._leave_out(RAGGED if "cells" in fault.what else BROKEN_QUOTE, int(line))
                cells = None
            table.append(cells)
        return table, None

    def _check_count(self, cells: list[str], text: str, line: int, row: int) -> None:
        if len(cells) != len(self.layout.names):
            raise InputError(
                f"row {row} has another number of cells than the header",
                got=f"{len(cells)}: {text}",
                expected=f"{len(self.layout.names)} cells",
                remedy=_ragged_hint(self.layout.separator, len(cells) > len(self.layout.names)),
                where=f"{self.source}:{line}",
            )

    def _leave_out(self, reason: str, line: int) -> None:
        self.skipped.setdefault(reason, []).append(line)

    def _decide(
        self, rows: list[list[str]], lines: Lines, later: Callable[[], Iterable[str]]
    ) -> tuple[int, InputError | None]:
        """Settle whether the numbers have a decimal comma. How many rows may be read so, and why no more."""
        doubtful, first = "", 0
        for k, row in enumerate(rows):
            for cell in row:
                comma = dialect.is_comma_number(cell)
                if comma and not self._comma and dialect.GROUPED_NUMBER.fullmatch(cell):
                    doubtful, first = (doubtful, first) if doubtful else (cell, k)
                elif comma:
                    self._comma = self._comma or cell
                elif "." in cell and dialect.NUMBER.fullmatch(cell):
                    self._point = self._point or cell
                if (self._comma or doubtful) and self._point:
                    self._comma = self._comma or doubtful
                    return k, dialect.mixed(self._comma, self._point, f"{self.source}:{lines[k]}")
        if doubtful and not self._comma:
            self._comma = self._certain_later(doubtful, later)
            if not self._comma:
                return first, dialect.ambiguous(doubtful, self.source)
        return len(rows), None

    def _certain_later(self, doubtful: str, later: Callable[[], Iterable[str]]) -> str:
        """A later cell that shows what a comma means, "" where there is none.

        Where a point comes first, commas are decimal until it is reached, and refused there.
        """
        for text in later():
            for cell in self._cells_or_none(text):
                if dialect.is_comma_number(cell) and not dialect.GROUPED_NUMBER.fullmatch(cell):
                    return cell
                if "." in cell and dialect.NUMBER.fullmatch(cell):
                    return doubtful
        return ""

    def _cells_or_none(self, text: str) -> list[str]:
        try:
            return self.layout.cells(text, "")
        except InputError:
            return []

    def _good(self, rows: list[list[str]], lines: Lines) -> tuple[list[list[str]], Lines]:
        """The rows that have finite numbers in all columns of numbers."""
        keep = np.ones(len(rows), dtype=bool)
        for k, (row, line) in enumerate(zip(rows, lines, strict=True)):
            cells = [cell for cell, numeric in zip(row, self._numeric, strict=True) if numeric]
            reason = "" if all(map(dialect.is_number_or_missing, cells)) else NOT_A_NUMBER
            if not reason and any(cell and np.isinf(dialect.to_float(cell)) for cell in cells):
                reason = INFINITE
            if reason:
                self._leave_out(reason, int(line))
                keep[k] = False
        return [row for row, is_finite in zip(rows, keep, strict=True) if is_finite], lines[keep]

    def _column(self, name: str, cells: list[str]) -> Column:
        column = tuple(cells) if name in self._words else column_of(cells)
        if isinstance(column, tuple):
            self._words.add(name)
        return column


def column_of(cells: list[str]) -> Column:
    """Floats where every cell is a number or missing, the words as they are otherwise."""
    if not all(map(dialect.is_number_or_missing, cells)):
        return tuple(cells)
    return np.array([dialect.to_float(cell) for cell in cells], dtype=float)


def refuse_infinite(columns: Mapping[str, Column], lines: Lines, source: str) -> None:
    """Raises InputError at the first row that holds an infinite number."""
    first: tuple[int, str] | None = None
    for name, column in columns.items():
        infinite_rows = [] if isinstance(column, tuple) else np.flatnonzero(np.isinf(column))
        if len(infinite_rows) and (first is None or infinite_rows[0] < first[0]):
            first = int(infinite_rows[0]), name
    if first is not None:
        raise InputError(
            "not a finite number",
            got="inf, or a number beyond 1.8e308",
            expected="a finite number",
            remedy="correct or remove the row",
            where=f"{source}:{lines[first[0]]}, column {first[1]}",
        )


def _loaded(texts: list[str], separator: str, columns: list[int] | None) -> FloatArray | None:
    """NumPy's parser takes no underscore, no hexadecimal and, where it reads all columns, no ragged row.

    None where it stumbles.
    """
    try:
        return np.loadtxt(texts, delimiter=separator, comments=None, ndmin=2, usecols=columns)
    except (ValueError, OverflowError):
        return None


def _unquoted(text: str, separator: str) -> str:
    """The row without the quotes around its cells, where that is all there is about them."""
    if '"' not in text:
        return text
    cells = text.strip().split(f'"{separator}"')
    if len(cells) == text.count(separator) + 1 and 2 * len(cells) == text.count('"') and text[0] + text[-1] == '""':
        return text.replace('"', "")
    return re.sub(rf'(?<![^{separator}])"([^"{separator}]*)"(?![^{separator}])', r"\1", text)


def _first_point(texts: list[str], separator: str) -> str:
    row = next((text for text in texts if "." in text), "")
    return next((cell.strip() for cell in row.split(separator) if "." in cell), "")


def _first_comma(texts: list[str], separator: str) -> str:
    """The first cell whose comma can only be decimal."""
    cells = (cell.strip() for text in texts for cell in text.split(separator) if "," in cell)
    return next((cell for cell in cells if not dialect.GROUPED_NUMBER.fullmatch(cell)), "")


def _filled(text: str, separator: str) -> str:
    """The row with nan in its blank cells."""
    double, nan = separator * 2, f"{separator}nan{separator}"
    if double in text:
        text = text.replace(double, nan).replace(double, nan)
    text = f"nan{text}" if text.startswith(separator) else text
    return f"{text}nan" if text.endswith(separator) else text


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if "," in cell and dialect.COMMA_NUMBER.fullmatch(cell) else cell


def _holds_words(cells: Iterable[str]) -> bool:
    return not all(dialect.looks_like_number(cell) or dialect.is_number_or_missing(cell) for cell in cells)


def _mostly_numbers(cells: Sequence[str]) -> bool:
    filled_cells = [cell for cell in cells if cell]
    return 2 * sum(map(dialect.looks_like_number, filled_cells)) >= len(filled_cells)


def _ragged_hint(separator: str, has_more: bool) -> str:
    """What to do about a row with more cells than the header, or with fewer."""
    commas = "a decimal comma? then separate the columns by semicolons; else " if has_more and separator == "," else ""
    return f"{commas}correct or remove the row, or leave such rows out with `skip_bad_rows`"


def skip_note(reason: str, lines: list[int]) -> str:
    """How many rows were left out, why, and where the first of them stand."""
    line_words = ", ".join(map(str, lines[:SHOWN_LINES])) + (", ..." if len(lines) > SHOWN_LINES else "")
    rows = "1 row was" if len(lines) == 1 else f"{len(lines)} rows were"
    return f"{rows} left out for {reason} (line{'s' if len(lines) > 1 else ''} {line_words})"
