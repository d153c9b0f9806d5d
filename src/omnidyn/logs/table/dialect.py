"""How a text table is written: comments, separator, cells, numbers, units. Nothing is guessed in silence.

A separator is taken when it is the only one under which header and rows have the same number of cells; a blank last
cell may be missing, since many loggers end every line with a separator. A decimal comma is taken when at least one
cell can be nothing else: 1,5 or 0,125, but not 1,500, which may be 1500.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence

from omnidyn.errors import InputError
from omnidyn.units import known_unit

MAX_NAME = 1000  # characters of the name of a column
SEPARATORS = (",", ";", "\t")
SEPARATOR_WORDS = {",": "a comma", ";": "a semicolon", "\t": "a tab"}
SAMPLE_ROWS = 50  # rows that vote on the separator; a later row that differs is refused as ragged

NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE | re.ASCII)
MISSING_CELL = re.compile(r"(?:[+-]?nan(?:\(\w*\))?)?", re.IGNORECASE | re.ASCII)  # C prints -nan and nan(ind) as well
COMMA_NUMBER = re.compile(r"[+-]?(?:\d+,\d*|,\d+)(?:[eE][+-]?\d+)?", re.ASCII)
GROUPED_NUMBER = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+", re.ASCII)  # 1,500: fifteen hundred or one and a half?
GROUPED_POINT = re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}", re.ASCII)  # 1.500: the same question where commas are decimal
WHOLE_NUMBER = re.compile(r"[+-]?\d{1,3}", re.ASCII)

# A spreadsheet's error values begin like a comment; to skip such a row would lose it in silence.
_SPREADSHEET_ERROR = re.compile(r"#(?:N/A|REF!|VALUE!|NAME\?|NUM!|NULL!|DIV/0!)", re.IGNORECASE)

_UNITS = frozenset(["-", "SI", "#", "pix", "pixel", "px"])  # words in the place of a unit that units.py has no size for
_NAME_AND_UNIT = re.compile(r"(.*[^\s\[(])\s*(?:\[\s*([^\[\]]+?)\s*\]|\(\s*([^()]+?)\s*\))")


def is_comment(line: str) -> bool:
    """Whether a line is a comment: it begins with # or %, and with no error value such as #N/A.

    A cell that is only % or # is a unit: `%,V` is no comment.
    """
    if "#" not in line and "%" not in line:
        return False
    start = line.lstrip()
    if not start.startswith(("#", "%")) or _SPREADSHEET_ERROR.match(start):
        return False
    return start[1:].lstrip(" ")[:1] not in SEPARATORS or not start[1:].strip()


def split_cells(line: str, separator: str, where: str) -> list[str]:
    """The cells of a line without the spaces around them; raises InputError for a broken quote."""
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        (cells,) = csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True)
    except (csv.Error, ValueError):
        raise InputError(
            "a quote is not closed on its line",
            got=line,
            expected='quotes in pairs, as in "t_s"',
            remedy="remove the quotes, a table of numbers needs none",
            where=where,
        ) from None
    return [cell.strip() for cell in cells]


def is_number_or_missing(cell: str) -> bool:
    """Whether a cell (without decimal comma) can stand in a column of numbers: a number, infinite, nan or blank."""
    return bool(NUMBER.fullmatch(cell) or MISSING_CELL.fullmatch(cell) or INFINITE.fullmatch(cell))


def to_float(cell: str) -> float:
    """The number in a cell for which `is_number_or_missing` holds; NaN where it is missing."""
    return math.nan if MISSING_CELL.fullmatch(cell) else float(cell)


def looks_like_number(cell: str) -> bool:
    """Whether a cell is a number in any notation, nan and inf included: such a cell is no column name."""
    return bool(cell) and (is_number_or_missing(cell) or bool(COMMA_NUMBER.fullmatch(cell)))


def looks_like_data(line: str) -> bool:
    """Whether a line holds numbers only, whatever separates them."""
    cells = [cell.strip(' "') for cell in re.split(r"[,;\t]", line)]
    return any(cells) and all(looks_like_number(cell) for cell in cells if cell)


def find_separator(header: str, rows: Sequence[str], where: str) -> str:
    """The one separator under which header and rows have equally many cells, two or more.

    Returns "," for a single column. Raises InputError when two separators would do, or none is in sight.
    """
    present = {separator: min(counts(header, separator)) for separator in SEPARATORS}
    possible = [separator for separator, count in present.items() if count > 1]
    sample = rows[:SAMPLE_ROWS]
    fitting = [s for s in possible if all(present[s] in counts(row, s) for row in sample)]
    choice = fitting if fitting else possible
    if len(choice) == 1:
        return choice[0]
    if choice:
        raise InputError(
            "cannot tell what separates the columns",
            got=header,
            expected="one of comma, semicolon or tab",
            remedy="write the table with one separator",
            where=where,
        )
    _check_single_column(sample, where)
    return ","


def _check_single_column(rows: Iterable[str], where: str) -> None:
    """A header without a separator is one column only if the rows have no separator either."""
    for row in rows:
        if any(separator in row for separator in SEPARATORS) or len(row.split()) > 1:
            raise InputError(
                "cannot tell what separates the columns",
                got=row,
                expected="comma, semicolon or tab in header and rows, or as many cells between spaces in all",
                remedy="write the table with commas and decimal points",
                where=where,
            )


def counts(line: str, separator: str) -> tuple[int, int]:
    """Number of cells under a separator, and without a blank last one; -1 when a quote is broken."""
    try:
        cells = split_cells(line, separator, "")
    except InputError:
        return -1, -1
    return len(cells), len(cells) - (len(cells) > 1 and not cells[-1])


def is_unit(text: str) -> bool:
    """Whether a text is a unit. A number in front, as in 8Hz or [0], makes it something else."""
    return text in _UNITS or (known_unit(text) is not None and (text == "1/min" or not text[:1].isdigit()))


def is_units_row(cells: Sequence[str]) -> bool:
    """Whether the row under the header holds units: no number, and every cell a known unit or blank.

    Where every cell stands in brackets, or where most of three or more are known, the others may be unknown.
    """
    plain = [strip_brackets(cell) for cell in cells if cell]
    if not plain or any(map(looks_like_number, plain)):
        return False
    unit_count = sum(map(is_unit, plain))
    bracketed = all(strip_brackets(cell) != cell for cell in cells if cell)
    return (
        unit_count == len(plain) or (unit_count > 0 and bracketed) or (unit_count > 2 and 2 * unit_count > len(plain))
    )


def strip_brackets(cell: str) -> str:
    """m/s from [m/s] or (m/s)."""
    return cell[1:-1].strip() if cell[:1] + cell[-1:] in ("[]", "()") else cell


def split_unit(name: str) -> tuple[str, str]:
    """("w1", "rad/s") from "w1 [rad/s]" or "w1 (rad/s)"; no unit where the brackets hold none, as in "joint[0]"."""
    match = _NAME_AND_UNIT.fullmatch(name) if len(name) <= MAX_NAME else None
    unit = (match[2] or match[3]) if match else ""
    return (match[1], unit) if match and is_unit(unit) else (name, "")


def is_comma_number(cell: str) -> bool:
    """Whether a cell is a number with commas, be they decimal or between thousands."""
    return "," in cell and bool(COMMA_NUMBER.fullmatch(cell) or GROUPED_NUMBER.fullmatch(cell))


def mixed(comma: str, point: str, where: str) -> InputError:
    """The error of a table with decimal commas and decimal points."""
    return InputError(
        "decimal commas and decimal points are mixed",
        got=f"{comma} and {point}",
        expected="decimal points",
        remedy="write the table with decimal points",
        where=where,
    )


def ambiguous(number: str, where: str) -> InputError:
    """The error of a table in which every comma could separate thousands."""
    return InputError(
        "a comma in a number is ambiguous",
        got=number,
        expected=f"{number.replace(',', '')} or a decimal point",
        remedy="write the table with decimal points",
        where=where,
    )


def ambiguous_point(number: str, where: str) -> InputError:
    """The error of a column of whole numbers in which points could only separate thousands, or be decimal by luck."""
    return InputError(
        "a point in a number is ambiguous",
        got=f"{number} among whole numbers",
        expected=f"{number.replace('.', '')} or {number.rstrip('0')}{'0' if number.endswith('000') else ''}",
        remedy="write thousands without a point, or decimal numbers with a point in every cell",
        where=where,
    )


def is_decimal_point(cell: str) -> bool:
    """Whether the point in a cell can only be decimal: 0.5, 1.25 or 0.125, but not 1.500, which may be 1500."""
    return "." in cell and bool(NUMBER.fullmatch(cell)) and not GROUPED_POINT.fullmatch(cell)


def is_decimal_comma_plain(rows: Sequence[str], separator: str) -> bool:
    """Whether a look in passing shows a decimal comma: no point anywhere, and one certain cell soon.

    False only means that every cell has to be looked at.
    """
    soon = (cell.strip() for row in rows[:SAMPLE_ROWS] for cell in row.split(separator))
    certain = any(COMMA_NUMBER.fullmatch(cell) and not GROUPED_NUMBER.fullmatch(cell) for cell in soon)
    return certain and not any("." in row for row in rows)
