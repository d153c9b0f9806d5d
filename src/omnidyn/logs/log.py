"""Log: what a file holds, in SI and by channel, before anybody trusts its time.

A Run needs times that increase; a log may have any. `check` reads the Log, everything else the Run made of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError
from omnidyn.logs.mapping import ColumnMap
from omnidyn.run import Run

FloatArray = NDArray[np.float64]

MAX_MISSING = 0.2  # share of rows without a time or without any number


@dataclass(frozen=True, eq=False)
class Log:
    """The rows of a log as recorded.

    t [s], shape (rows,): may repeat, go back, or be NaN. channels: name of a channel of Run -> its values in SI, shape
    as in Run; NaN where missing, and all NaN for a component that was not recorded. lines: line of each row in the
    file, shape (rows,). columns: which column each component came from, and how. source, sha256: of the file.
    current_unsigned: the sensor gives |i|; the sign in `channels` is that of the commanded speed.
    notes: what the readers had to decide, in words.
    """

    t: FloatArray
    channels: Mapping[str, FloatArray]
    lines: NDArray[np.int64]
    columns: ColumnMap = field(default_factory=ColumnMap)
    source: str = ""
    sha256: str = ""
    current_unsigned: bool = False
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.t)

    @property
    def wheels(self) -> int | None:
        """Number of wheels or motors; None where no channel of wheels was recorded."""
        counts = [values.shape[1] for name, values in self.channels.items() if name in WHEEL_CHANNELS]
        return counts[0] if counts else None

    def rows(self, keep: NDArray) -> Log:
        """The log with some of its rows: a mask, indices or a slice."""
        from dataclasses import replace

        channels = {name: values[keep] for name, values in self.channels.items()}
        return replace(self, t=self.t[keep], lines=self.lines[keep], channels=channels)

    def to_run(self, *, sort: bool = False) -> Run:
        """The Run: rows without time or numbers, padding at the end and repeated stamps left out, each said in words.

        Raises InputError when time goes back (unless `sort`), when more than 20 % of the rows cannot be used, or when
        no two times differ.
        """
        warnings = list(self.notes)
        log = self._without(self._empty(), "hold no time or no number", warnings)
        log = log._without(
            log._padding(), "at the end repeat one row with an earlier time (padding)", warnings, bound=1.0
        )
        if sort and (np.diff(log.t) < 0.0).any():
            warnings.append(f"time goes back {int((np.diff(log.t) < 0.0).sum())} times: rows were sorted")
            log = log.rows(np.argsort(log.t, kind="stable"))
        log._refuse_backward()
        log = log._without(
            np.concatenate([[False], np.diff(log.t) == 0.0]), "repeat the time of the row before", warnings
        )
        return Run(t=log.t, **log.channels, source=self.source, warnings=tuple(warnings))

    def _empty(self) -> NDArray[np.bool_]:
        nothing = np.isnan(self.t)
        if self.channels:
            numbers = np.zeros(len(self), dtype=bool)
            for values in self.channels.values():
                numbers |= np.isfinite(values).reshape(len(self), -1).any(axis=1)
            nothing |= ~numbers
        return nothing

    def _padding(self) -> NDArray[np.bool_]:
        """Rows at the end that all repeat the last one while time has gone back."""
        padding = np.zeros(len(self), dtype=bool)
        table = np.column_stack([self.t, *(values.reshape(len(self), -1) for values in self.channels.values())])
        same = (table == table[-1:]) | (np.isnan(table) & np.isnan(table[-1:]))
        differs = np.flatnonzero(~same.all(axis=1))
        first = int(differs[-1]) + 1 if differs.size else 0
        if 0 < first < len(self) and self.t[first] < self.t[first - 1]:
            padding[first:] = True
        return padding

    def _without(self, bad: NDArray[np.bool_], words: str, warnings: list[str], bound: float = MAX_MISSING) -> Log:
        """The other rows, with a warning; refused where more than a share of `bound` would go."""
        count = int(bad.sum())
        if not count:
            return self
        first = int(self.lines[np.flatnonzero(bad)[0]])
        if count > bound * len(self) or count == len(self):
            raise InputError(
                f"{count} of {len(self)} rows {words}", got=f"first in line {first}", expected=f"at most {bound:.0%}",
                remedy="mend the recording, or map another column to t", where=self.source,
            )  # fmt: skip
        warnings.append(f"{count} of {len(self)} rows {words} and were left out, first in line {first}")
        return self.rows(~bad)

    def _refuse_backward(self) -> None:
        back = np.flatnonzero(np.diff(self.t) < 0.0)
        if back.size:
            row = int(back[0]) + 1
            raise InputError(
                "time goes back", got=f"{self.t[row]:.9g} s after {self.t[row - 1]:.9g} s ({back.size} times)",
                expected="times that increase", remedy="sort the rows, or use --sort",
                where=f"{self.source}:{self.lines[row]}",
            )  # fmt: skip


WHEEL_CHANNELS = ("voltage", "duty", "current", "wheel_angle", "wheel_speed", "wheel_speed_command")
