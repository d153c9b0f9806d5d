"""Points in a table whose separator is no comma: decimal, or between thousands, as spreadsheets of many countries do.

One cell that can be nothing else, such as 0.5, settles it for the whole table. Where there is none, a column that has
1.500 beside a whole number such as 950 is refused; where every cell has a point, it is read as decimal, and that is
said.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.logs.table import dialect

Column = FloatArray | tuple[str, ...]
THOUSAND = 1000


class PointMeaning:
    """What the points of one table mean, from its rows in order, given in blocks.

    names: of the columns. source: the path.
    """

    def __init__(self, separator: str, names: Sequence[str], source: str) -> None:
        self.separator, self.names, self.source = separator, names, source
        self.settled = separator == ","
        self._grouped: dict[int, tuple[str, int]] = {}  # column -> first doubtful cell and its line
        self._whole: set[int] = set()

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided, in words; empty where nothing was doubtful."""
        if self.settled or not self._grouped:
            return ()
        cell = next(iter(self._grouped.values()))[0]
        return (f"points were read as decimal: {cell} is {float(cell):g}, not {cell.replace('.', '')}",)

    def look(
        self,
        texts: Sequence[str],
        lines: IntArray,
        columns: Mapping[str, Column],
        later: Callable[[], Iterable[str]],
    ) -> None:
        """Look at more rows. Raises InputError where a column mixes 1.500 with whole numbers and nothing settles it.

        texts, lines: the rows. columns: the numbers in them. later: gives the texts of the rows that follow.
        """
        if self.settled:
            return
        if any("." in text for text in texts):
            for text, line in zip(texts, lines, strict=True):
                self._row(text, int(line))
                if self.settled:
                    return
        else:
            numbers = [(k, columns[name]) for k, name in enumerate(self.names)]
            self._whole |= {k for k, v in numbers if not isinstance(v, tuple) and bool((np.abs(v) < THOUSAND).any())}
        mixed = sorted(self._whole & self._grouped.keys())
        if mixed and not any(self._settles(text) for text in later()):
            cell, line = self._grouped[mixed[0]]
            raise dialect.ambiguous_point(cell, f"{self.source}:{line}, column {self.names[mixed[0]]}")
        self.settled = bool(mixed)

    def _row(self, text: str, line: int) -> None:
        for k, cell in enumerate(self._cells(text)[: len(self.names)]):
            if dialect.is_decimal_point(cell):
                self.settled = True
                return
            if "." in cell and dialect.GROUPED_POINT.fullmatch(cell):
                self._grouped.setdefault(k, (cell, line))
            elif dialect.WHOLE_NUMBER.fullmatch(cell):
                self._whole.add(k)

    def _settles(self, text: str) -> bool:
        return any(map(dialect.is_decimal_point, self._cells(text)))

    def _cells(self, text: str) -> list[str]:
        return [cell.strip(' "') for cell in text.split(self.separator)]
