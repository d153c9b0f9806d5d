"""How a text table is written: separator, decimal sign, header, units. Nothing is guessed in silence.

A separator is taken when it is the only one under which header and rows have the same number of cells. A decimal
comma is taken when at least one cell can be nothing else: 1,5 or 0,125, but not 1,500, which may be 1500.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence

from omnidyn.errors import InputError

SEPARATORS = (",", ";", "\t")
SAMPLE_ROWS = 50  # rows that vote on the separator; a later row that differs is refused as ragged

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE | re.ASCII)
COMMA_NUMBER = re.compile(r"[+-]?(?:\d+,\d*|,\d+)(?:[eE][+-]?\d+)?", re.ASCII)
GROUPED_NUMBER = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+", re.ASCII)  # 1,500: fifteen hundred or one and a half?

# A spreadsheet's error values begin like a comment; to skip such a row would lose it in silence.
_SPREADSHEET_ERROR = re.compile(r"#(?:N/A|REF!|VALUE!|NAME\?|NUM!|NULL!|DIV/0!)", re.IGNORECASE)

_UNIT_WORDS = (
    "s ms us µs μs ns min V mV A mA m mm cm km m/s mm/s cm/s km/h rad deg ° rad/s deg/s °/s rpm 1/min rev/s rot/s "
    "N mN kN N·m N⋅m N*m Nm mNm N.m W kg Hz ticks counts % - SI"
)
UNITS = frozenset([*_UNIT_WORDS.split(), "N m"])


def is_comment(line: str) -> bool:
    """Whether a line is a comment: its first visible character is #, and it is no error value such as #N/A."""
    start = line.lstrip()
    return start.startswith("#") and not _SPREADSHEET_ERROR.match(start)


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


def looks_like_number(cell: str) -> bool:
    """Whether a cell is a number in any notation, nan and inf included: such a cell is no column name."""
    return bool(NUMBER.fullmatch(cell) or INFINITE.fullmatch(cell) or COMMA_NUMBER.fullmatch(cell)) or (
        cell.lower() == "nan"
    )


def looks_like_data(line: str) -> bool:
    """Whether a line holds numbers only, whatever separates them."""
    cells = [cell.strip(' "') for cell in re.split(r"[,;\t]", line)]
    return any(cells) and all(looks_like_number(cell) for cell in cells if cell)


def find_separator(header: str, rows: Sequence[str], where: str) -> str:
    """The one separator under which header and rows have equally many cells, two or more.

    Returns "," for a single column. Raises InputError when two separators would do, or none is in sight.
    """
    present = {separator: _count(header, separator) for separator in SEPARATORS}
    possible = [separator for separator, count in present.items() if count > 1]
    sample = rows[:SAMPLE_ROWS]
    fitting = [s for s in possible if all(_count(row, s) == present[s] for row in sample)]
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
                expected="comma, semicolon or tab in the header and in every row (spaces do not separate)",
                remedy="write the table with commas and decimal points",
                where=where,
            )


def _count(line: str, separator: str) -> int:
    """Number of cells under a separator; -1 when a quote is broken."""
    try:
        return len(split_cells(line, separator, ""))
    except InputError:
        return -1


def is_units_row(cells: Sequence[str]) -> bool:
    """Whether every cell of the row under the header is a known unit, in brackets or not, or blank."""
    plain = [strip_brackets(cell) for cell in cells]
    return any(plain) and all(cell in UNITS for cell in plain if cell)


def strip_brackets(cell: str) -> str:
    """m/s from [m/s] or (m/s)."""
    return cell[1:-1].strip() if cell[:1] + cell[-1:] in ("[]", "()") else cell


def has_decimal_comma(cells: Iterable[str], where: str) -> bool:
    """Whether the numbers have a decimal comma, unmistakably. `cells` must not come from a comma-separated table.

    Raises InputError when points and commas are mixed, or when every comma could separate thousands.
    """
    commas, points = "", ""
    certain = False
    for cell in cells:
        if "," in cell and (COMMA_NUMBER.fullmatch(cell) or GROUPED_NUMBER.fullmatch(cell)):
            commas = cell
            certain = certain or not GROUPED_NUMBER.fullmatch(cell)
        elif "." in cell and NUMBER.fullmatch(cell):
            points = cell
    if commas and points:
        raise InputError(
            "decimal commas and decimal points are mixed",
            got=f"{commas} and {points}",
            expected="decimal points",
            remedy="write the table with decimal points",
            where=where,
        )
    if commas and not certain:
        number = commas.replace(",", "")
        raise InputError(
            "a comma in a number is ambiguous",
            got=commas,
            expected=f"{number} or a decimal point",
            remedy="write the table with decimal points",
            where=where,
        )
    return bool(commas)


def is_decimal_comma_plain(rows: Sequence[str], separator: str) -> bool:
    """Whether a look in passing shows a decimal comma: no point anywhere, and one certain cell soon.

    False only means that `has_decimal_comma` has to look at every cell.
    """
    soon = (cell.strip() for row in rows[:SAMPLE_ROWS] for cell in row.split(separator))
    certain = any(COMMA_NUMBER.fullmatch(cell) and not GROUPED_NUMBER.fullmatch(cell) for cell in soon)
    return certain and not any("." in row for row in rows)
