"""Log: what a file holds, in SI and by channel, before anybody trusts its time.

A Run needs times that increase; a log may have any. `check` reads the Log, everything else the Run made of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import fastest_step, has_own_clock, usual_step
from omnidyn.errors import InputError
from omnidyn.logs.channels import components, place
from omnidyn.logs.clock.restarts import Restart
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.segments import filled
from omnidyn.run import CHANNELS, SCALAR, WHEEL, Run
from omnidyn.statement import NOTE, WARNING, Statement, statements

REFUSED = {
    "rows_empty": "hold no time or no number",
    "rows_of_padding": "at the end repeat one row with an earlier time (padding)",
    "rows_repeated": "repeat the time of the row before",
}
OFTEN_BACK = 0.005  # of the rows: no recorder writes so many out of order
FEW_TIMES_BACK = 2  # are never often, however short the log: where recordings were joined
MAX_MISSING = 0.2  # share of rows without a time or without any number
ON_CHANGE = 0.2  # a component with more blank cells than this share, gaps left out, is recorded on change
SAME_TIME_SHARE = 1e-6  # of a row: times that are no farther apart are one
COMMAND_CHANNELS = (
    "voltage",
    "duty",
    "force",
    "wheel_speed_command",
    "twist_command",
)  # what is commanded holds until the next value
NEVER_MADE_UP = (*COMMAND_CHANNELS, "supply")  # a battery is an input like any other: it holds too


@dataclass(frozen=True, eq=False)
class Log:
    """The rows of a log as recorded.

    t [s], shape (rows,): may repeat, go back, or be NaN. channels: name of a channel of Run -> its values in SI, shape
    as in Run; NaN where missing, and all NaN for a component that was not recorded. lines: line of each row in the
    file, shape (rows,). columns: which column each component came from, and how. source, sha256: of the file.
    current_unsigned: the sensor gives |i|; the sign in `channels` is that of the commanded speed.
    notes: what the readers had to decide. own_clocks: topics with clocks of their own; a blank is no missing
    value. restarts: where its clock or a counter begins again, which the times and angles here no longer show.
    """

    t: FloatArray
    channels: Mapping[str, FloatArray]
    lines: IntArray
    columns: ColumnMap = field(default_factory=ColumnMap)
    source: str = ""
    sha256: str = ""
    current_unsigned: bool = False
    notes: tuple[Statement, ...] = ()
    own_clocks: bool = False
    restarts: tuple[Restart, ...] = ()

    @classmethod
    def of_run(cls, run: Run) -> Log:
        """A Run as a log; lines count its samples from 0."""
        return cls(
            run.t,
            run.channels,
            np.arange(len(run)),
            source=run.source,
            notes=run.warnings,
            own_clocks=run.staggered,
        )

    def __len__(self) -> int:
        return len(self.t)

    @property
    def wheels(self) -> int | None:
        """Number of wheels or motors; None where no channel of wheels was recorded."""
        counts = [values.shape[1] for name, values in self.channels.items() if CHANNELS[name] == WHEEL]
        return counts[0] if counts else None

    def rows(self, keep: NDArray | slice) -> Log:
        """The log with some of its rows: a mask, indices or a slice."""
        channels = {name: values[keep] for name, values in self.channels.items()}
        return replace(self, t=self.t[keep], lines=self.lines[keep], channels=channels)

    def recordings(self) -> list[Log]:
        """The log cut where its clock or a counter begins again, and where its time goes back now and then."""
        back = np.flatnonzero(np.diff(self.t) < 0.0) + 1
        cuts = back[:0] if goes_back_often(back.size, len(self)) else back
        lines = [restart.line for restart in self.restarts if restart.is_gap]
        begins = np.searchsorted(self.lines, lines).tolist()
        edges = sorted({0, *cuts.tolist(), *begins, len(self)})
        parts = [self.rows(slice(a, b)) for a, b in pairwise(edges)]
        return [replace(part, restarts=()) for part in parts] if len(parts) > 1 else [self]

    def to_run(self, *, sort: bool = False) -> Run:
        """The Run: rows without time or numbers, padding at the end and repeated stamps left out, each said in words.

        Raises InputError when time goes back (unless `sort`), when more than 20 % of the rows cannot be used, or when
        no two times differ.
        """
        warnings: list[Statement | str] = list(self.notes)
        log = self._without(self.empty_rows(), "rows_empty", warnings)
        log = log._without(log.padding_rows(), "rows_of_padding", warnings, bound=1.0)
        if sort and (np.diff(log.t) < 0.0).any():
            warnings.append(Statement("rows_sorted", WARNING, "t", {"times": int((np.diff(log.t) < 0.0).sum())}))
            log = log.rows(np.argsort(log.t, kind="stable"))
        log._refuse_backward()
        repeated = np.concatenate([[False], np.diff(log.t) == 0.0])
        if len(log) > 1 and repeated.sum() == len(log) - 1:
            raise InputError(
                "time stands still",
                got=f"t = {log.t[0]:.9g} s in all {len(log)} rows",
                expected="times that increase",
                where=self.source,
            )
        log = log._without(repeated, "rows_repeated", warnings, bound=1.0)._moved(warnings)
        channels = {name: log.aligned(name, values, warnings) for name, values in log.channels.items()}
        channels = {name: np.where(log.between(name), np.nan, values) for name, values in channels.items()}
        return Run(t=log.t, **channels, source=self.source, warnings=statements(warnings))

    def _moved(self, warnings: list[Statement | str]) -> Log:
        """What was recorded late, at the times when it happened: in rows of its own where no row has such a time.

        No number is changed, and none stands between two rows. Times increase. What happened before the first row goes.
        """
        late = {key: column.latency for key, column in self.columns.columns.items() if column.latency and place(key)}
        if not late or len(self) < 2:
            return self
        tolerance = SAME_TIME_SHARE * fastest_step(self.t, self.channels.values())
        at = {key: self.t - seconds for key, seconds in late.items()}
        new = np.unique(np.concatenate([times for times in at.values()]))
        new = new[(new > self.t[0]) & (new < self.t[-1]) & (np.abs(new - self.t[_nearest(new, self.t)]) > tolerance)]
        t = np.sort(np.concatenate([self.t, new[np.append(True, np.diff(new) > tolerance)]])) if new.size else self.t
        row_places = np.searchsorted(t, self.t)
        channels = {}
        for name, values in self.channels.items():
            columns = values.reshape(len(self), -1)
            table = np.full((len(t), columns.shape[1]), np.nan)
            for k, key in enumerate(components(name, columns.shape[1])):
                rows = _nearest(at[key], t) if key in late else row_places
                at_row = np.abs(t[rows] - at[key]) <= tolerance if key in late else np.ones(len(row_places), dtype=bool)
                table[rows[at_row], k] = columns[at_row, k]
            channels[name] = table[:, 0] if CHANNELS[name] == SCALAR else table
        warnings += [Statement("latency_taken_out", NOTE, key, {"seconds": seconds}) for key, seconds in late.items()]
        settled = {key: replace(column, latency=0.0) for key, column in self.columns.columns.items()}
        lines = self.lines[np.searchsorted(self.t, t, side="right") - 1]
        log = replace(
            self,
            t=t,
            channels=channels,
            lines=lines,
            columns=replace(self.columns, columns=settled),
            own_clocks=self.own_clocks or len(t) > len(self),
        )
        empty = log.empty_rows()
        empty[row_places] = False
        return log.rows(~empty)

    def joined(self) -> Log:
        """Rows of one time that fill each other's blanks are one row, as where every topic writes a row of its own."""
        if not len(self) or not (np.diff(self.t) == 0.0).any():
            return self
        new = np.append(True, np.diff(self.t) != 0.0)
        first, group = np.flatnonzero(new), np.cumsum(new) - 1
        table = np.column_stack([values.reshape(len(self), -1) for values in self.channels.values()] or [self.t])
        low, high = np.fmin.reduceat(table, first), np.fmax.reduceat(table, first)
        numbers = np.add.reduceat(np.isfinite(table).astype(np.int64), first)
        size = np.diff(np.append(first, len(self)))[:, None]
        one_value, partly = ~np.any(low < high, axis=1), np.any((numbers > 0) & (numbers < size), axis=1)
        fits = np.asarray(one_value & partly)
        if not fits.any():
            return self
        joins = new & fits[group]
        keep = ~fits[group] | joins
        channels = {}
        for name, values in self.channels.items():
            combined = np.fmax.reduceat(values, first)[group]
            channels[name] = np.where(joins if values.ndim == 1 else joins[:, None], combined, values)[keep]
        note = Statement("rows_joined", NOTE, "t", {"joined": int((~keep).sum()), "rows": len(self)})
        return replace(self, t=self.t[keep], channels=channels, lines=self.lines[keep], notes=(*self.notes, note))

    def aligned(self, channel: str, values: FloatArray, warnings: list[Statement | str]) -> FloatArray:
        """A channel in every row of the log, once its times can be trusted; what was done goes to `warnings`.

        What was recorded on change, or by a topic with a clock of its own: commands held, measurements on the line
        between two of them, which `between` tells from what was measured; nothing in a gap, where a sensor was out.
        And the latency of each component taken out. `values` has the shape of the channel, and so has the result.
        """
        columns = values.reshape(len(self), -1)
        aligned_columns = columns.copy()
        for k, component in enumerate(components(channel, columns.shape[1])):
            if self.now_and_then(columns[:, k]):
                hold = channel in NEVER_MADE_UP
                aligned_columns[:, k] = _held(columns[:, k]) if hold else filled(self.t, columns[:, k])
                if not self.own_clocks:
                    share = float(np.isnan(columns[:, k]).mean())
                    warnings.append(Statement("on_change", NOTE, component, {"blank": share, "held": hold}))
            late = self.columns.columns[component].latency if component in self.columns.columns else 0.0
            if late:
                aligned_columns[:, k] = np.interp(self.t + late, self.t, aligned_columns[:, k], right=np.nan)
                warnings.append(Statement("latency_taken_out", NOTE, component, {"seconds": late}))
        return aligned_columns[:, 0] if CHANNELS[channel] == SCALAR else aligned_columns

    def now_and_then(self, values: FloatArray) -> bool:
        """Whether a component, shape (rows,), was recorded when it changed, or at times of its own.

        By the share of blanks outside its gaps: where a sensor or a driver was out, it is missing. Fewer blanks are
        those of a clock of its own where its steps say so.
        """
        present = np.isfinite(values)
        if present.all():
            return False
        covered = present | np.isfinite(filled(self.t, values))
        blank = 1.0 - present.sum() / max(covered.sum(), 1)
        return 0.0 < blank < 1.0 and (self.own_clocks or blank > ON_CHANGE or has_own_clock(self.t, values))

    def between(self, channel: str) -> BoolArray:
        """Which values of `aligned` lie between measurements, where no sensor gave any. Shape as in the channel."""
        columns = self.channels[channel].reshape(len(self), -1)
        made_up = np.zeros(columns.shape, dtype=bool)
        for k, component in enumerate(components(channel, columns.shape[1])):
            blank = np.isnan(columns[:, k])
            if channel in NEVER_MADE_UP or not self.now_and_then(columns[:, k]):
                continue
            late = self.columns.columns[component].latency if component in self.columns.columns else 0.0
            made_up[:, k] = _far_from(self.t + late, self.t[~blank], self.t) if late else blank
        return made_up[:, 0] if CHANNELS[channel] == SCALAR else made_up

    def empty_rows(self) -> BoolArray:
        """Rows without a time or without any number. Shape (rows,)."""
        nothing = np.isnan(self.t)
        if self.channels:
            numbers = np.zeros(len(self), dtype=bool)
            for values in self.channels.values():
                numbers |= np.isfinite(values).reshape(len(self), -1).any(axis=1)
            nothing |= ~numbers
        return nothing

    def padding_rows(self) -> BoolArray:
        """Rows at the end that all repeat the last one while time has gone back."""
        padding = np.zeros(len(self), dtype=bool)
        table = np.column_stack([self.t, *(values.reshape(len(self), -1) for values in self.channels.values())])
        equal_cells = (table == table[-1:]) | (np.isnan(table) & np.isnan(table[-1:]))
        differs = np.flatnonzero(~equal_cells.all(axis=1))
        first = int(differs[-1]) + 1 if differs.size else 0
        if 0 < first < len(self) and self.t[first] < self.t[first - 1]:
            padding[first:] = True
        return padding

    def _without(self, mask: BoolArray, code: str, warnings: list[Statement | str], bound: float = MAX_MISSING) -> Log:
        """The other rows, with a warning; refused where more than a share of `bound` would go."""
        count = int(mask.sum())
        if not count:
            return self
        first = int(self.lines[np.flatnonzero(mask)[0]])
        warning = Statement(code, WARNING, "", {"left_out": count, "rows": len(self), "first": first})
        if count > bound * len(self) or count == len(self):
            raise InputError(
                f"{count} of {len(self)} rows {REFUSED[code]}",
                got=f"first in line {first}",
                expected=f"at most {bound:.0%}",
                remedy="mend the recording, or map another column to t",
                where=self.source,
            )
        warnings.append(warning)
        return self.rows(~mask)

    def _refuse_backward(self) -> None:
        back = np.flatnonzero(np.diff(self.t) < 0.0)
        if back.size:
            row = int(back[0]) + 1
            raise InputError(
                "time goes back",
                got=f"{self.t[row]:.9g} s after {self.t[row - 1]:.9g} s ({back.size} times)",
                expected="times that increase",
                remedy=back_remedy(back.size, len(self.t), "sort them, or use `sort`"),
                where=f"{self.source}:{self.lines[row]}",
            )


def goes_back_often(times: int, rows: int) -> bool:
    """Whether time goes back so often that the clock is wrong, not the order of the rows."""
    return times > max(OFTEN_BACK * rows, FEW_TIMES_BACK)


def back_remedy(times: int, rows: int, sort: str) -> str:
    """What to do about a time that goes back; sort: how to sort. Over and over, the clock is wrong: never sort."""
    if goes_back_often(times, rows):
        return (
            "do not sort the rows: look at how the time is written (milliseconds without leading zeros?), and whether "
            "another column is the clock (`column` t=NAME:UNIT)"
        )
    split = "split the file where two logs were joined (`convert` with `split`)"
    return f"{split}; where rows were written out of order, {sort}"


def _held(values: FloatArray) -> FloatArray:
    """Each blank takes the last value before it; before the first there is none."""
    last = np.maximum.accumulate(np.where(np.isnan(values), -1, np.arange(len(values))))
    return np.where(last >= 0, values[last], np.nan)


def _nearest(at: FloatArray, t: FloatArray) -> IntArray:
    """The row of `t`, which increases, whose time is nearest to each of `at`."""
    after = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
    return np.where(at - t[after - 1] <= t[after] - at, after - 1, after)


def _far_from(at: FloatArray, known_times: FloatArray, t: FloatArray) -> BoolArray:
    """Which times `at` have no time of `known_times` within half a row of `t`. Shape of `at`."""
    half_row = 0.5 * usual_step(t)
    after = np.clip(np.searchsorted(known_times, at), 1, max(len(known_times) - 1, 1))
    return (
        np.minimum(
            np.abs(at - known_times[after - 1]), np.abs(at - known_times[np.minimum(after, len(known_times) - 1)])
        )
        > half_row
    )


def component(log: Log, name: str) -> FloatArray | None:
    """The values of one component, such as "u2" or "heading"; shape (rows,). None where it was not recorded."""
    location = place(name)
    values = log.channels.get(location[0]) if location else None
    if location is None or values is None:
        return None
    column = values if values.ndim == 1 else values[:, location[1]] if location[1] < values.shape[1] else None
    return None if column is None or np.isnan(column).all() else column
