"""What the columns of a text table are called: names, units and titles, wherever a program put them.

The names stand in the first line; or in comments right above the first row; or under a line of titles, when a row of
units stands among them; or under a preamble (see preamble.py). Units stand in a row of their own, or in brackets behind
a name: `w1 [rad/s]`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.logs.table import dialect
from omnidyn.logs.table.dialect import MAX_NAME, SAMPLE_ROWS, SEPARATOR_WORDS, SEPARATORS
from omnidyn.logs.table.preamble import preamble

MAX_COLUMNS = 1000
INDEX = "index"  # what a column of row numbers without a name is called
TABS_NOTE = "columns are separated by " + SEPARATOR_WORDS["\t"]
HEAD_ROWS = 3  # at most so many lines above the first row: titles, units, names

_SEPARATOR_LINE = re.compile(r"sep=([,;\t])")  # Excel's own first line


class FileLine(NamedTuple):
    """A line of the file, counted from 1."""

    number: int
    text: str


@dataclass(frozen=True)
class Layout:
    """How the rows of a file are to be read.

    separator: of the cells. ending: what stands behind the last cell of every row and means nothing, "" or a
    separator. names, units, titles: as in Table. first: line of the first row. notes: what was decided, in words.
    """

    separator: str
    names: tuple[str, ...]
    first: int
    ending: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def cells(self, text: str, where: str) -> list[str]:
        """The cells of a row. Raises InputError for a broken quote."""
        if self.ending and self.ending != self.separator:
            text = text.rstrip().removesuffix(self.ending)
        cells = dialect.split_cells(text, self.separator, where)
        if self.ending == self.separator and len(cells) == len(self.names) + 1 and not cells[-1]:
            cells.pop()
        return cells


def find_layout(lines: Sequence[FileLine], source: str, header: bool = True) -> Layout:
    """The layout of a file from its first lines, more than SAMPLE_ROWS rows of them where the file has as many.

    lines: without blank ones; of comments that follow each other the last two are enough.
    `header` False: there are no names, the columns are called c1, c2, ...
    Raises InputError when there is no header, or one that cannot be used.
    """
    content_lines = [line for line in lines if line.text.strip() and not dialect.is_comment(line.text)]
    separator_line = _SEPARATOR_LINE.fullmatch(content_lines[0].text.strip()) if content_lines else None
    content_lines = content_lines[1:] if separator_line else content_lines
    above = preamble([line.text for line in content_lines]) if header else 0
    if above:
        layout = find_layout([line for line in lines if line.number >= content_lines[above].number], source)
        note = f"line {content_lines[above].number} gives the names: what stands above it was left out"
        return replace(layout, notes=(note, *layout.notes))
    if not content_lines:
        raise InputError(
            "no table in the file", got="only blank lines and comments", expected="a header and rows", where=source
        )
    separator = separator_line[1] if separator_line else ""
    if not header:
        return _without_header(content_lines, separator, source)
    above = _commented_header(lines, content_lines[0]) if _has_number(content_lines[0].text) else []
    if above:
        return _layout([*above, *content_lines], len(above), separator, source)
    if dialect.looks_like_data(content_lines[0].text):
        raise InputError(
            "the table has no header: its first row is numbers",
            got=content_lines[0].text,
            expected="column names such as t_s,u1_V",
            remedy="add a first line with the column names, or use `no_header`",
            where=f"{source}:{content_lines[0].number}",
        )
    return _layout(content_lines, 0, separator, source)


def _has_number(line: str) -> bool:
    return any(dialect.looks_like_number(cell.strip(' "')) for cell in re.split(r"[,;\t]", line))


def _without_header(content_lines: list[FileLine], separator: str, source: str) -> Layout:
    texts = [line.text for line in content_lines]
    separator = separator or dialect.find_separator(texts[0], texts, f"{source}:{content_lines[0].number}")
    ending = _other_ending(texts[:SAMPLE_ROWS], separator)
    counts = [dialect.counts(text, separator) for text in texts[:SAMPLE_ROWS]]
    count = max(1, min(counts[0]) if all(trimmed < full for full, trimmed in counts) else counts[0][0])
    _refuse_width(count, f"{source}:{content_lines[0].number}")
    layout = _with_ending(
        Layout(separator, _numbered(count), content_lines[0].number), content_lines[:SAMPLE_ROWS], ending
    )
    names = f"no header: the columns are called c1 to c{count}"
    return replace(layout, notes=(names, *_separator_notes(separator), *layout.notes))


def _numbered(count: int) -> tuple[str, ...]:
    return tuple(f"c{k + 1}" for k in range(count))


def _commented_header(lines: Sequence[FileLine], row: FileLine) -> list[FileLine]:
    """Names, or names and units, that stand as comments right above the first row (`numpy.savetxt` puts them there)."""
    above = [line for line in lines if line.number < row.number and line.text.strip()][-2:]
    comments = [
        FileLine(line.number, line.text.lstrip()[1:].strip()) for line in above if dialect.is_comment(line.text)
    ]
    if not comments or comments[-1].number != above[-1].number:
        return []
    for separator in SEPARATORS:
        counts = set(dialect.counts(row.text, separator)) - {1}
        cells = [[cell.strip() for cell in line.text.split(separator)] for line in comments]
        fit = [len(cell) in counts for cell in cells]
        if len(cells) == 2 and all(fit) and _are_names(cells[0]) and dialect.is_units_row(cells[1]):
            return comments
        if fit[-1] and _are_names(cells[-1]):
            return comments[-1:]
    return []


def _are_names(cells: Sequence[str]) -> bool:
    return all(cells) and len(set(cells)) == len(cells) and not any(map(dialect.looks_like_number, cells))


def _layout(content_lines: list[FileLine], commented: int, separator: str, source: str) -> Layout:
    """The layout of a file whose first line that counts is a header; the first `commented` of them were comments."""
    where = f"{source}:{content_lines[0].number}"
    rows = [line.text for line in content_lines[max(1, commented) :]]
    separator = separator or dialect.find_separator(content_lines[0].text, rows, where)
    ending = _other_ending(rows[HEAD_ROWS if len(rows) > 2 * HEAD_ROWS else 0 :][:SAMPLE_ROWS], separator)
    if ending:
        content_lines = [FileLine(line.number, line.text.rstrip().removesuffix(ending)) for line in content_lines]
    head = _head(content_lines[: commented or HEAD_ROWS + 1], separator, source)
    body = content_lines[len(head.lines) :]
    if not body:
        raise InputError("no rows", got="0 samples", expected="at least one row under the header", where=source)
    names, renamed = _told_apart(_names(head, separator, body, source))
    layout = _with_ending(Layout(separator, tuple(names), body[0].number), body[:SAMPLE_ROWS], ending)
    names, units = _units(names, head, f"{source}:{head.lines[head.names].number}")
    titles = {name: cell for name, cell in zip(names, head.cells_of(head.titles), strict=False) if cell}
    notes = [*_head_notes(head, commented), *renamed, *_separator_notes(separator), *layout.notes]
    return replace(layout, names=tuple(names), units=units, titles=titles, notes=tuple(notes))


class _Head(NamedTuple):
    """The lines above the first row, their cells, and which of them are the names, the units and the titles."""

    lines: list[FileLine]
    cells: list[list[str]]
    names: int = 0
    units: int | None = None
    titles: int | None = None

    def cells_of(self, index: int | None) -> list[str]:
        return [] if index is None else self.cells[index]


def _head(first: list[FileLine], separator: str, source: str) -> _Head:
    """Which of the first lines are the head: a line of names, one of units, and with both, one of titles."""
    cells = [dialect.split_cells(first[0].text, separator, f"{source}:{first[0].number}")]
    cells += [_cells_or_row(line.text, separator) for line in first[1:]]
    words = [not any(map(dialect.looks_like_number, row)) for row in cells]
    usual = _Head(first, cells)
    if len(cells) > 1 and words[1] and dialect.is_units_row(cells[1]):
        if len(cells) > 3 and words[2] and not words[3] and _are_names(_trimmed(cells[2])):
            return _Head(first[:3], cells[:3], names=2, units=1, titles=0)
        return _Head(first[:2], cells[:2], units=1)
    names_first = len(cells) > 3 and words[1] and not words[3] and _are_names(_trimmed(cells[1]))
    if names_first and dialect.is_units_row(cells[2]):
        return _Head(first[:3], cells[:3], names=1, units=2, titles=0)
    return usual._replace(lines=first[:1], cells=cells[:1])


def _cells_or_row(text: str, separator: str) -> list[str]:
    """The cells of a line that may be a row; one with a broken quote is no part of the head, and judged later."""
    try:
        return dialect.split_cells(text, separator, "")
    except InputError:
        return ["0"]


def _trimmed(cells: list[str]) -> list[str]:
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _names(head: _Head, separator: str, body: list[FileLine], source: str) -> list[str]:
    """The column names: one each, none blank, none twice, none a number but over a row of units.

    A blank last one has no column below it.
    """
    line, names = head.lines[head.names], head.cells[head.names]
    where = f"{source}:{line.number}"
    _refuse_width(len(names), where)
    if len(names) > 1 and not names[-1]:
        rows = (dialect.counts(row.text, separator) for row in body[:SAMPLE_ROWS])
        if all(len(names) - 1 in counts for counts in rows):
            names = names[:-1]
    if len(names) > 1 and not names[0] and _counts_rows([row.text for row in body], separator):
        names = [INDEX, *names[1:]]
    for k, name in enumerate(names):
        check_name(0, names[k:], where, got=line.text, number=k + 1)
        if dialect.looks_like_number(name) and head.units is None:  # an oscilloscope numbers its channels
            raise InputError(
                "the table has no header: a number stands where a name should",
                got=name,
                expected="column names such as t_s,u1_V",
                remedy="add a first line with the column names, or use `no_header`",
                where=where,
            )
    return names


def _counts_rows(rows: Sequence[str], separator: str) -> bool:
    """Whether the first cells are 0, 1, 2, ..: the index of a data frame, which pandas writes without a name."""
    cells = [row.split(separator)[0].strip(' "') for row in rows[:SAMPLE_ROWS]]
    return cells == [str(k) for k in range(len(cells))]


def _told_apart(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of which no two are alike: the second column called w is w~2; and what was done, in words."""
    apart, notes = list(names), []
    for k, name in enumerate(names):
        count = names[:k].count(name)
        if count:
            apart[k] = f"{name}~{count + 1}"
            notes.append(f"{name} is the name of two columns: the later one is called {apart[k]}")
    return apart, notes


def check_name(k: int, names: Sequence[str], where: str, got: str | None = None, number: int = 0) -> None:
    """Raises InputError where the name of column k is blank, too long, or that of an earlier one.

    got: the header. number: of the column in the file, where it is not k + 1.
    """
    name, number = names[k], number or k + 1
    if not name:
        raise InputError(
            f"column {number} has no name",
            got=got,
            expected="a name for every column",
            remedy="name it or remove it",
            where=where,
        )
    if len(name) > MAX_NAME:
        raise InputError(
            f"the name of column {number} is too long",
            got=f"{len(name)} characters, {name[:40]}...",
            expected=f"at most {MAX_NAME}",
            remedy="give it a short name, or see whether this line is the header",
            where=where,
        )
    if name in names[:k]:
        raise InputError(
            "two columns have the same name",
            got=name,
            expected="different names",
            remedy="give the second one another name in this line",
            where=where,
        )


def _refuse_width(columns: int, where: str) -> None:
    if columns > MAX_COLUMNS:
        raise InputError("too many columns", got=columns, expected=f"at most {MAX_COLUMNS}", where=where)


def split_units(names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Names without the units in their brackets, and the units. Names stay whole where two would become one."""
    parts = [dialect.split_unit(name) for name in names]
    short = [name for name, _ in parts]
    plain = [name if short.count(name) == 1 else names[k] for k, name in enumerate(short)]
    return plain, {name: unit for name, (_, unit) in zip(plain, parts, strict=True) if unit}


def _units(names: list[str], head: _Head, where: str) -> tuple[list[str], dict[str, str]]:
    """The same with the row of units. Raises InputError where the two contradict each other."""
    plain, units = split_units(names)
    for name, cell in zip(plain, head.cells_of(head.units), strict=False):
        unit = dialect.strip_brackets(cell)
        if unit and units.get(name, unit) != unit:
            raise InputError(
                "name and row of units give two units",
                got=f"{units[name]} and {unit}",
                expected="one unit",
                remedy="correct one of them",
                where=f"{where}, column {name}",
            )
        if unit:
            units[name] = unit
    return plain, units


def _with_ending(layout: Layout, rows: list[FileLine], ending: str) -> Layout:
    """The layout with what stands at the end of its rows and means nothing: its own separator, or another."""
    count = len(layout.names)
    counts = [dialect.counts(row.text, layout.separator) for row in rows]
    if any(full == count + 1 == trimmed + 1 for full, trimmed in counts):
        note = f"every row ends with {SEPARATOR_WORDS[layout.separator]}: the blank last column was left out"
        return replace(layout, ending=layout.separator, notes=(note,))
    if ending:
        return replace(
            layout, ending=ending, notes=(f"every row ends with {SEPARATOR_WORDS[ending]}: it was left out",)
        )
    return layout


def _other_ending(rows: Sequence[str], separator: str) -> str:
    """A separator that stands at the end of every row, the last one perhaps excepted, and nowhere else in it."""
    for sign in SEPARATORS:
        ends = [row.rstrip().endswith(sign) and row.count(sign) == 1 for row in rows]
        complete = ends and (ends[-1] or sign not in rows[-1])
        if sign != separator and complete and all(ends[:-1] or ends):
            return sign
    return ""


def _head_notes(head: _Head, commented: int) -> list[str]:
    name_line, unit_line = head.lines[head.names].number, head.units is not None and head.lines[head.units].number
    if commented:
        units = f", line {unit_line} as the units" if unit_line else ""
        return [f"line {name_line}, a comment, was read as the header{units}"]
    if head.titles is not None:
        title_line = head.lines[head.titles].number
        return [f"line {name_line} gives the names, line {unit_line} the units, line {title_line} the titles"]
    return []


def _separator_notes(separator: str) -> list[str]:
    return [] if separator == "," else [f"columns are separated by {SEPARATOR_WORDS[separator]}"]
