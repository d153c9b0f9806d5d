"""Tables whose columns are separated by runs of spaces or tabs, as many loggers and `numpy.savetxt` write them.

A file is taken for one only where no other separator fits, so that a name or a word with a space in it stays whole.
Its lines then get one tab between two cells, and all else is as in a file separated by tabs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from omnidyn.logs.table.dialect import SAMPLE_ROWS, SEPARATORS, counts, is_comment, looks_like_number

NOTE = "columns are separated by spaces"
HEAD = 3  # lines above the first row that may hold titles, names and units
LEAST_NUMBERS = 2  # in a row: words alone may be one column of text

_CELL = re.compile(r'(?:"[^"]*"|[^ \t"]|")+')
_BRACKETS = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")


def is_spaced(lines: Sequence[str]) -> bool:
    """Whether the lines of a file (comments and blank lines among them) are cells between spaces.

    They are where no comma, semicolon or tab separates them all, the first line and most others have the same number
    of cells, two or more, and most rows hold two numbers or more.
    """
    content_lines = [line for line in lines if line.strip() and not is_comment(line)][: SAMPLE_ROWS + HEAD]
    if not content_lines or not _has_spaces(content_lines[0]) or _separated(content_lines):
        return False
    first, rows = cells(content_lines[0]), [cells(line) for line in content_lines[1:]] or [cells(content_lines[0])]
    width, often = Counter(map(len, rows)).most_common(1)[0]
    body = rows[HEAD:] or rows[-1:]
    numbers = sum(sum(map(looks_like_number, row)) >= LEAST_NUMBERS for row in body)
    return width > 1 and len(first) == width and 2 * often > len(rows) and 2 * numbers > len(body)


def _has_spaces(line: str) -> bool:
    return " " in line.strip() or "\t" in line.strip()


def _separated(content_lines: Sequence[str]) -> bool:
    """Whether a comma or semicolon separates the first line, or tabs separate it and most others."""
    for separator in SEPARATORS:
        count = min(counts(content_lines[0], separator))
        fits = sum(count in counts(row, separator) for row in content_lines[1:])
        if count > 1 and (
            separator != "\t" or (2 * fits >= len(content_lines) - 1 and not _numbers_between_tabs(content_lines[1:]))
        ):
            return True
    return False


def _numbers_between_tabs(rows: Sequence[str]) -> bool:
    """Whether a cell between tabs holds several numbers: then tabs are not all that separates."""
    parts = (cell.split() for row in rows for cell in row.split("\t"))
    return any(len(part) > 1 and all(map(looks_like_number, part)) for part in parts)


def cells(line: str) -> list[str]:
    """The cells of a line: a quoted one may hold spaces; a unit in brackets belongs to the name before it."""
    if '"' not in line and "[" not in line and "(" not in line:
        return [cell for cell in line.replace("\t", " ").split(" ") if cell]
    result: list[str] = []
    for cell in _CELL.findall(line):
        unit = bool(result) and _BRACKETS.fullmatch(cell) and not _BRACKETS.fullmatch(result[-1])
        if unit:
            result[-1] = f"{result[-1]} {cell}"
        else:
            result.append(cell)
    return result


def tabbed(line: str) -> str:
    """The line with one tab between two cells; in a comment, between those behind its sign."""
    if is_comment(line):
        start = line.lstrip()
        return f"{start[0]} " + "\t".join(cells(start[1:]))
    return "\t".join(cells(line))
