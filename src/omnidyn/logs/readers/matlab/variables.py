"""Variables of a file as columns: vectors, matrices by column, structs by field; together by their length."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, did_you_mean, shortened
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.readers.recording import Recording, Track, topic_of
from omnidyn.logs.table.header import MAX_COLUMNS
from omnidyn.logs.table.rows import refuse_infinite
from omnidyn.logs.table.table import MAX_CELLS, FileTable
from omnidyn.units import TIME, known_unit

WIDEST = 64  # a matrix with more columns is no table
LATEST_NS = 2.0**62
SHORTEST_STEP, LONGEST_STEP = 1e-4, 1.0  # [s] between rows, where a time has no unit
OBJECTS = (
    "tables, timetables and timeseries are objects: save a struct instead, S = table2struct(T, 'ToScalar', true); "
    "save('log.mat', '-struct', 'S')"
)


@dataclass
class Variables:
    """What a file holds. arrays: name ("odom/vx" of a field) -> numbers. passed: name -> why it was passed over.
    texts: name -> its first characters. said: what else is to be known.
    """

    source: str
    sha256: str = ""
    arrays: dict[str, FloatArray] = field(default_factory=dict)
    passed: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    said: tuple[str, ...] = ()

    def add(self, name: str, values: np.ndarray) -> None:
        """An array as it stands in the file; what is no column is passed over, and that is said."""
        if values.ndim > 2 or np.iscomplexobj(values) or values.dtype.kind not in "fiub":
            self.passed[name] = f"{values.dtype}, {' x '.join(map(str, values.shape))}"
        elif values.size > 1:
            self.arrays[name] = values.astype(float)

    def chosen(self, names: Sequence[str]) -> Variables:
        """Those of the names, and what is in them; all for no names. Raises InputError for a name that is none."""
        if not names:
            return self
        heads = [tuple(_below(array)) for array in self.arrays]
        for name in names:
            if not any(name in head for head in heads):
                known_names = list(dict.fromkeys(part for head in heads for part in head))
                raise InputError(
                    "no such variable",
                    got=name,
                    expected=shortened(", ".join(known_names), 300) or "a file with variables",
                    remedy=did_you_mean(name, known_names),
                    where=self.source,
                )
        arrays = {variable: values for variable, values in self.arrays.items() if set(_below(variable)) & set(names)}
        return replace(
            self,
            arrays=arrays,
            passed={variable: w for variable, w in self.passed.items() if set(_below(variable)) & set(names)},
        )

    @property
    def columns(self) -> dict[str, FloatArray]:
        """Vectors, and the columns of matrices, whose rows are as many as the times of their file or struct."""
        times = [array for name, array in self.arrays.items() if _is_time(name)]
        lengths = {time_values.size for time_values in times if time_values.ndim == 1 or 1 in time_values.shape}
        columns: dict[str, FloatArray] = {}
        for name, values in self.arrays.items():
            if values.ndim == 1 or 1 in values.shape:
                columns[name] = values.reshape(-1)
                continue
            turned = values.shape[0] not in lengths and values.shape[1] in lengths
            turned |= not lengths & set(values.shape) and values.shape[0] < values.shape[1]
            table = values.T if turned else values
            if table.shape[1] > WIDEST:
                self.passed[name] = f"{' x '.join(map(str, values.shape))}: more than {WIDEST} columns"
                continue
            columns |= {_numbered(name, k): column for k, column in enumerate(table.T, 1)}
        return columns

    @property
    def notes(self) -> tuple[str, ...]:
        omissions = [f"{name} ({reason})" for name, reason in self.passed.items()]
        return (*self.said, *((f"not read: {shortened(', '.join(omissions), 300)}",) if omissions else ()))


def _below(name: str) -> Iterator[str]:
    """A variable and all that it is in: log/odom/vx, log/odom, log."""
    parts = name.split("/")
    return ("/".join(parts[:k]) for k in range(len(parts), 0, -1))


def _numbered(name: str, number: int) -> str:
    """The name of a column of a matrix: w1 of w, u1_V of u_V."""
    for split in re.finditer("_", name):
        stem, unit = name[: split.start()], name[split.start() :]
        if stem and known_unit(unit[1:].replace("_", "/")) is not None:
            return f"{_numbered(stem, number)}{unit}"
    return f"{name}{'_' if name[-1:].isdigit() else ''}{number}"


def _is_time(name: str) -> bool:
    last = re.split(r"[/.]", name)[-1]
    return last.lower() == "tout" or read_name(last).roles == {words.TIME}


def tables_of(variables: Variables, rows: int) -> Iterator[FileTable]:
    """The tables: one where all columns have one length, else those of a Recording, a track per time."""
    columns = {name: values for name, values in variables.columns.items() if len(values) > 1}
    if not columns:
        raise _nothing(variables)
    if len({len(values) for values in columns.values()}) > 1:
        yield from recording_of(variables).tables(rows)
        return
    if len(columns) > MAX_COLUMNS:
        raise InputError(
            "too many columns", got=len(columns), expected=f"at most {MAX_COLUMNS}", where=variables.source
        )
    if len(structs := {name.rpartition("/")[0] for name in columns}) == 1:
        columns = {name.removeprefix(f"{next(iter(structs))}/"): values for name, values in columns.items()}
    names, count = tuple(columns), len(next(iter(columns.values())))
    block_rows = max(1, min(rows, MAX_CELLS // len(names)))
    for first in range(0, count, block_rows):
        part = {name: values[first : first + block_rows].copy() for name, values in columns.items()}
        lines = np.arange(first + 1, min(first + block_rows, count) + 1)
        refuse_infinite(part, lines, variables.source)
        yield FileTable(names, part, lines, {}, variables.source, "", variables.notes)
    yield FileTable(names, {}, np.zeros(0, dtype=np.int64), {}, variables.source, variables.sha256, variables.notes)


def recording_of(variables: Variables) -> Recording:
    """Columns with times of their own: those of a struct with its time, others with the time of their length."""
    columns = {name: values for name, values in variables.columns.items() if len(values) > 1}
    times = {name: values for name, values in columns.items() if _is_time(name)}
    members: dict[str, dict[str, FloatArray]] = {name: {} for name in times}
    topics, notes = [], list(variables.notes)
    timeless = []
    for name, values in columns.items():
        if name in times:
            continue
        owner = _clock(name, len(values), times)
        if owner is None:
            timeless.append(name)
        else:
            members[owner][name] = values
    if timeless:
        notes.append(f"no time of their length: {shortened(', '.join(timeless), 300)} are not used")
    tracks = []
    for name, struct_columns in members.items():
        stamps = np.rint(times[name] * _second(name, times[name], variables.source) * 1e9)
        valid = np.abs(stamps) < LATEST_NS
        track_columns = {column_name: values[valid] for column_name, values in struct_columns.items()}
        track = Track(name, stamps[valid].astype(np.int64), track_columns)
        if track_columns:
            tracks.append(track)
        topics.append(topic_of(name, "time", track.stamps, bool(track_columns)))
        topics += [
            topic_of(column_name, "numbers", track.stamps[np.isfinite(values)], True)
            for column_name, values in track_columns.items()
        ]
    if not tracks:
        raise _nothing(variables)
    return Recording(tracks, topics, variables.source, variables.sha256, [*notes])


def _clock(name: str, length: int, times: Mapping[str, FloatArray]) -> str | None:
    """The time of a column: in its own struct, else the only one of its length."""
    fits = [time_name for time_name, values in times.items() if len(values) == length]
    siblings = [fit for fit in fits if fit.rpartition("/")[0] == name.rpartition("/")[0]]
    candidates = siblings or fits
    return candidates[0] if len(candidates) == 1 else None


def _second(name: str, values: FloatArray, source: str) -> float:
    """What one count of a time is in seconds. Raises InputError where nothing says it."""
    unit = read_name(re.split(r"[/.]", name)[-1]).unit
    if unit is not None and unit.quantity == TIME:
        return unit.size
    steps = np.diff(values[np.isfinite(values)])
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    if SHORTEST_STEP <= usual <= LONGEST_STEP:
        return 1.0
    raise InputError(
        "a time without a unit",
        got=f"rows {usual:.4g} apart",
        expected="seconds",
        where=f"{source}, {name}",
        remedy=f"call it {name}_ms, or whatever it counts",
    )


def _nothing(variables: Variables) -> InputError:
    contents = ", ".join([*(f"{name}: {reason}" for name, reason in variables.passed.items()), *variables.arrays])
    objects = any("object" in reason for reason in variables.passed.values())
    return InputError(
        "the file holds no columns of numbers",
        got=shortened(contents, 300) or "no variables",
        expected="vectors of one length, or structs of them, with a time among them",
        remedy=OBJECTS if objects else "save one vector per wheel, and the time: save('log.mat', 't_s', 'u1_V')",
        where=variables.source,
    )
