"""Document: what a result says, said once: words, points and tables for people, plain values for machines.

A result has one function that makes its Document. Text comes from here, JSON is its `data`, and report/html makes the
same tables and points HTML.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from omnidyn.glossary import explained

WIDTH = 100  # columns of text that knows no terminal
GAP = "  "  # between two columns of a table
TINY_CHANCE = 0.001
VERDICT_WORDS = 25  # of a line
NAME_WORDS = 2  # at most, of what a verdict is about
MOST_DIGITS = 6  # of two numbers that are nearly alike
MOST_WHOLE = 1e6  # from which on an exponent reads better

Paint = Callable[[str, str], str]  # a word and its tone -> the word in the colour of that tone


@dataclass(frozen=True)
class Words:
    """A paragraph. first, rest: what stands before its first line and before the others. tone: of what stands first."""

    text: str
    first: str = ""
    rest: str = ""
    tone: str = ""

    def lines(self, width: int, paint: Paint) -> Iterator[str]:
        """The paragraph, wrapped."""
        wrapped = textwrap.wrap(self.text, width, initial_indent=self.first, subsequent_indent=self.rest)
        sign = self.first.strip()
        for k, line in enumerate(wrapped):
            yield line.replace(sign, paint(sign, self.tone), 1) if sign and k == 0 else line


@dataclass(frozen=True)
class Points:
    """Sentences (text or statements), each a point of a list.

    mark: what stands before each in text, such as "-"; "" for the severity of each statement.
    """

    words: Sequence[object]
    mark: str = "-"
    name: str = ""

    def lines(self, width: int, paint: Paint) -> Iterator[str]:
        """The points, each wrapped."""
        for words in self.words:
            mark = self.mark or f"{getattr(words, 'severity', '-')}:"
            yield from Words(f"{mark} {words}", rest="  ").lines(width, paint)


@dataclass(frozen=True)
class Table:
    """Cells under a head. An empty head is not shown.

    align: "<" (to the left) or ">" of each column; the last one is that of all further columns. least: the least width
    of each column, where it has one.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    align: str = "<>"
    least: Sequence[int] = ()
    name: str = ""

    def lines(self, width: int, paint: Paint) -> Iterator[str]:
        """Aligned columns, however wide that gets: a table is not wrapped."""
        rows = [self.head, *self.rows] if self.head else self.rows
        columns = max(map(len, rows), default=0)
        least = (*self.least, *[0] * columns)
        widths = [max(least[k], *(len(row[k]) for row in rows if k < len(row))) for k in range(columns)]
        for row in rows:
            cells = (f"{cell:{self._side(k)}{widths[k]}}" for k, cell in enumerate(row))
            yield GAP.join(cells).rstrip()

    def _side(self, column: int) -> str:
        return self.align[min(column, len(self.align) - 1)]


def _bare(word: str, tone: str) -> str:
    return word


Part = str | Words | Points | Table  # plain text is a line as it stands


@dataclass(frozen=True)
class Document:
    """What a result says: its parts in the order in which text tells them, and its values as JSON can hold them.

    warnings: what a reader of `data` alone must be told too. ascii: text has an escape for every other character.
    verdict: the result in a sentence (text or a statement); it stands first, and under "verdict" for machines. Words of
    the trade are explained at the end of the text, those that occur.
    """

    parts: Sequence[Part]
    data: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[object] = ()
    ascii: bool = False
    verdict: object = ""

    def __getitem__(self, name: str) -> Points | Table:
        """The points or the table of this name. Raises KeyError."""
        for part in self.parts:
            if isinstance(part, Points | Table) and part.name == name:
                return part
        raise KeyError(name)

    def joined(self, *names: str) -> Points:
        """The points of these names as one list."""
        several = [part for part in map(self.__getitem__, names) if isinstance(part, Points)]
        return Points([words for part in several for words in part.words])

    @property
    def verdict_text(self) -> str:
        """The verdict with a capital and a full stop; text stays as it is."""
        return self.verdict if isinstance(self.verdict, str) else sentence(str(self.verdict))

    def verdict_lines(self, width: int, paint: Paint = _bare) -> list[str]:
        """The verdict in a line, then what it rests on as points."""
        first, points = in_clauses(self.verdict_text)
        return [*Words(first).lines(width, paint), *Points(points).lines(width, paint)]

    def legend(self) -> list[str]:
        """A line for each word of the trade that occurs in the parts."""
        texts = (part if isinstance(part, str) else "\n".join(part.lines(WIDTH, _bare)) for part in self.parts)
        return explained("\n".join(texts))

    def to_text(self, width: int = WIDTH, paint: Paint = _bare) -> str:
        """The document for people, without a line break at its end. paint: how signs get their colours."""
        lines: list[str] = [*self.verdict_lines(width, paint), ""] if self.verdict else []
        for part in self.parts:
            lines += [part] if isinstance(part, str) else part.lines(width, paint)
        if legend := self.legend():
            lines.append("")
            lines += [line for words in legend for line in Words(words, rest="  ").lines(width, paint)]
        text = "\n".join(lines)
        return text.encode("ascii", "backslashreplace").decode() if self.ascii else text


def in_clauses(words: str, most: int = VERDICT_WORDS) -> tuple[str, list[str]]:
    """(the first clauses with at most so many words, a sentence; the other clauses): how a long verdict is laid out.

    A clause ends at a semicolon or with its sentence, outside of brackets; a first one that is too long at a colon or
    before "but" too, or at a comma where a name alone stands before the colon.
    """
    first, *others = _cut(words, r"(?<=;) |(?<=\.) (?=[A-Z])")
    if len(first.split()) > most:
        parts = _cut(first, r"(?<=:) |(?<=,) (?=but )")
        count = _fitting(parts, most)
        if len(" ".join(parts[:count]).split()) <= NAME_WORDS:
            parts = _cut(first, r"(?<=,) ")
            count = _fitting(parts, most)
        first, others = " ".join(parts[:count]), [*([" ".join(parts[count:])] if parts[count:] else []), *others]
    else:
        count = _fitting([first, *others], most)
        first, others = " ".join([first, *others[: count - 1]]), others[count - 1 :]
    return f"{first.rstrip(';:,.')}." if others else first, [clause.rstrip(";.") for clause in others]


def _cut(words: str, ends: str) -> list[str]:
    """Words, cut at each blank that matches and does not stand in brackets."""
    blanks = [match.start() for match in re.finditer(ends, words)]
    cuts = [k for k in blanks if all(words.count(a, 0, k) == words.count(b, 0, k) for a, b in ("()", "[]"))]
    return [words[a + 1 : b] for a, b in pairwise([-1, *cuts, len(words)])]


def _fitting(parts: Sequence[str], most: int) -> int:
    """How many of the first parts have at most so many words together, at least one."""
    return max([1, *(k for k in range(1, len(parts) + 1) if len(" ".join(parts[:k]).split()) <= most)])


def sentence(words: str) -> str:
    """Words with a capital at their begin and a full stop at their end."""
    return f"{words[:1].upper()}{words[1:]}."


def all_of(names: Sequence[str]) -> str:
    """Names in a sentence: "x", "x and y", "x, y and z"; "" for none."""
    *names_before, last = names or ("",)
    return f"{', '.join(names_before)} and {last}" if names_before else last


def apart(*blocks: Sequence[Part]) -> list[Part]:
    """The parts of all blocks that have any, with an empty line between the blocks."""
    return [part for block in blocks if block for part in ("", *block)][1:]


def plain(value: Any) -> Any:
    """A value as JSON can hold it: lists of arrays and tuples, None for a number that is not finite."""
    if hasattr(value, "to_dict"):  # a statement
        value = value.to_dict()
    if hasattr(value, "tolist"):  # NumPy, which need not be imported for this
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not -float("inf") < value < float("inf"):
        return None
    return value


def short(value: float, form: str = ".2g") -> str:
    """A number of a sentence: 120, where Python writes 1.2e+02."""
    text = f"{value:{form}}"
    return f"{float(text):{form[: form.index('.')]}.0f}" if "e+" in text and abs(value) < MOST_WHOLE else text


def both(first: float, second: float, digits: int = 3) -> tuple[str, str] | None:
    """Two numbers of a sentence with as many digits as show that they differ; None where MOST_DIGITS do not."""
    for count in range(digits, MOST_DIGITS + 1):
        words = (short(first, f".{count}g"), short(second, f".{count}g"))
        if words[0] != words[1]:
            return words
    return None


def cell(value: float | None, form: str) -> str:
    """A number of a table; "-" where there is none."""
    return "-" if value is None else f"{value:{form}}"


def chance_cell(value: float | None) -> str:
    """A p-value of a table; none is 0."""
    return f"<{TINY_CHANCE:g}" if value is not None and value < TINY_CHANCE else cell(value, ".3f")


def interval_cell(ends: tuple[float, float], form: str = ".4g") -> str:
    """An interval of a table."""
    return f"[{ends[0]:{form}}, {ends[1]:{form}}]"


TELLS_NOTHING = 3.0  # half an interval, of the number, from which on no digit is shown


def percent_cell(half: float) -> str:
    """Half an interval as a share of its number, in a table of percents."""
    return f"{100.0 * half:.2g}" if half < TELLS_NOTHING else "-"
