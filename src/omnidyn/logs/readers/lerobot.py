"""Parquet files, plain ones and those of a LeRobotDataset: the speeds of a base out of its action and its state.

A dataset is a folder: meta/info.json names the numbers of each feature, data/chunk-000/file-000.parquet holds them, a
row per frame. Of LeKiwi and its kin x.vel, y.vel [m/s] and theta.vel [deg/s] are read: of the action as what was asked
for, of observation.state as what was measured. Each episode is a recording of its own: a gap lies before it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, shortened
from omnidyn.files import open_regular, read_text, sha256
from omnidyn.logs.readers.folders import INFO, data_files, is_dataset_folder
from omnidyn.logs.readers.parquet import (
    SUFFIXES,
    batches_of,
    check_size,
    damage,
    import_pyarrow,
    missing_of,
    numbers_of,
    parquet_tables,
    sha256_of,
)
from omnidyn.logs.readers.parquet_pages import declared_bytes
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.table.rows import refuse_infinite
from omnidyn.logs.table.table import MAX_CELLS, Declaration, FileTable
from omnidyn.progress import Report

ACTION, STATE = "action", "observation.state"
STAMP, EPISODE = "timestamp", "episode_index"
SPEEDS = {"x.vel": ("vx", "m/s"), "y.vel": ("vy", "m/s"), "theta.vel": ("omega", "deg/s")}
MAX_INFO = 4 * 2**20  # bytes of meta/info.json
BETWEEN = 10.0  # [s] that a gap between two episodes is given
ABOVE = 3  # folders between a file and that of its dataset


class _EpisodeClock:
    """Time over episodes, each of which counts its own from 0; what comes next lies BETWEEN behind."""

    def __init__(self) -> None:
        self.shifts: dict[float, float] = {}
        self.end = -BETWEEN
        self.begins: list[int] = []

    def times(self, stamps: FloatArray, episodes: FloatArray) -> FloatArray:
        """Seconds since the first row of all, shape (rows,). begins: rows of these in which a later episode begins."""
        self.begins = []
        out = np.empty(len(stamps))
        for row, (stamp, episode) in enumerate(zip(stamps.tolist(), episodes.tolist(), strict=True)):
            if episode not in self.shifts:
                self.begins += [row] if self.shifts else []
                self.shifts[episode] = self.end + BETWEEN - stamp
            out[row] = self.end = stamp + self.shifts[episode]
        return out


def tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    """The tables of a Parquet file or of a dataset; see the contract."""
    files = data_files(Path(path)) if is_dataset_folder(path) else [Path(path)]
    lists = _lists(files[0])
    if not lists & {ACTION, STATE}:
        yield from parquet_tables(files[0], rows, options)
        return
    source, info = str(path), _info(Path(path))
    if info is None:
        raise InputError(
            "the numbers of a LeRobot dataset have their names in meta/info.json",
            got="no such file beside the data",
            expected="the folder as it was recorded: meta/info.json and data/chunk-000/file-000.parquet",
            remedy="give the folder of the dataset, whole",
            where=source,
        )
    names = {key: _names_of(info, key) for key in (ACTION, STATE) if key in lists}
    yield from _dataset_tables(files, names, source, rows, options)


def _lists(file: Path) -> set[str]:
    """The columns of a file that hold lists."""
    pyarrow, parquet = import_pyarrow(str(file))
    with open_regular(file) as stream, damage(pyarrow, str(file)):
        kinds, schema = pyarrow.types, parquet.ParquetFile(stream, pre_buffer=False).schema_arrow
        return {
            field.name
            for field in schema
            if kinds.is_list(field.type) or kinds.is_large_list(field.type) or kinds.is_fixed_size_list(field.type)
        }


def _info(path: Path) -> Mapping[str, Any] | None:
    """What meta/info.json of the dataset of a file or folder says; None where there is none. Raises InputError."""
    path = path.resolve()
    folders = [path] if path.is_dir() else [*path.parents][: ABOVE + 1]
    file = next((folder / INFO for folder in folders if (folder / INFO).is_file()), None)
    if file is None:
        return None
    try:
        content = json.loads(read_text(file, MAX_INFO))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or not isinstance(content.get("features"), dict):
        raise InputError("not the description of a dataset", got=INFO, expected='JSON with "features"', where=str(file))
    return content


def _names_of(info: Mapping[str, Any], feature: str) -> list[str]:
    """The names of the numbers of a feature: a list, or a list under one key, as older versions write it."""
    description = info["features"].get(feature)
    names = description.get("names") if isinstance(description, dict) else None
    if isinstance(names, dict) and len(names) == 1:
        (names,) = names.values()
    return [str(name) for name in names] if isinstance(names, list) else []


def _dataset_tables(
    files: Sequence[Path], names: Mapping[str, list[str]], source: str, rows: int, options: ReadOptions
) -> Iterator[FileTable]:
    """The tables of the files of a dataset, one after the other."""
    columns_of = {
        f"{feature}.{name}": (feature, feature_names.index(name), component, unit)
        for feature, feature_names in names.items()
        for name, (component, unit) in SPEEDS.items()
        if name in feature_names
    }
    if not columns_of:
        all_names = [name for feature_names in names.values() for name in feature_names]
        raise InputError(
            "no speeds of a base in the dataset",
            got=shortened(", ".join(dict.fromkeys(all_names)) or "no names", 200),
            expected=f"{', '.join(SPEEDS)} in {ACTION} or {STATE}",
            remedy="give the dataset of a robot with a base that drives"
            if all_names
            else f'write what the numbers are into {INFO}: "names" of {ACTION} and {STATE}, in their order',
            where=source,
        )
    _refuse_twins(names, source)
    units = {STAMP: "s"} | {column: unit for column, (*_, unit) in columns_of.items()}
    says = {STAMP: Declaration("t")} | {
        column: Declaration(component + "_cmd" * (feature == ACTION))
        for column, (feature, _, component, _) in columns_of.items()
    }
    unread = dict.fromkeys(name for feature_names in names.values() for name in feature_names if name not in SPEEDS)
    clock, row_count, digests = _EpisodeClock(), 0, list[str]()

    def table(columns: Mapping[str, FloatArray], lines: IntArray, sha256: str = "") -> FileTable:
        notes = _notes(len(clock.shifts), list(unread)) if sha256 else ()
        begins = tuple(int(lines[row]) for row in clock.begins) if columns else ()
        return FileTable(tuple(units), dict(columns), lines, units, source, sha256, notes, {}, says, begins=begins)

    for file in files:
        for part, digest in _parts(file, list(names), len(units), rows, options):
            if digest:
                digests.append(digest)
                continue
            columns = {STAMP: clock.times(part[STAMP], part[EPISODE])}
            for column, (feature, place, _, _) in columns_of.items():
                columns[column] = _place(part[feature], place, len(names[feature]), str(file), row_count)
            lines = np.arange(row_count + 1, row_count + 1 + len(columns[STAMP]))
            refuse_infinite(columns, lines, source)
            row_count += len(lines)
            yield table(columns, lines)
    total_digest = digests[0] if len(digests) == 1 else sha256("".join(digests))
    yield table({}, np.zeros(0, dtype=np.int64), total_digest)


def _refuse_twins(names: Mapping[str, list[str]], source: str) -> None:
    """Raises InputError where two numbers of a feature are called by one name of a speed: which is it?"""
    for feature, feature_names in names.items():
        for name in SPEEDS:
            if feature_names.count(name) > 1:
                raise InputError(
                    "two numbers of a feature have one name",
                    got=f"{name}, {feature_names.count(name)} times in {feature}",
                    expected="a name for each number",
                    remedy=f"correct its names in {INFO}",
                    where=source,
                )


def _notes(episodes: int, unread: list[str]) -> tuple[str, ...]:
    many = f"{episodes} episodes are recordings of their own: a gap of {BETWEEN:g} s is put before each"
    note = f"not speeds of the base, and not read: {shortened(', '.join(unread), 200)}"
    return (*([many] if episodes > 1 else []), *([note] if unread else []))


def _parts(
    file: Path, features: list[str], count: int, rows: int, options: ReadOptions
) -> Iterator[tuple[dict[str, FloatArray], str]]:
    """(column -> numbers, "") of each block of a file; ({}, sha256) at its end. Lists are (rows, numbers)."""
    source = str(file)
    pyarrow, parquet = import_pyarrow(source)
    with open_regular(file) as stream:
        size = os.fstat(stream.fileno()).st_size
        digest = sha256_of(stream, size)
        with damage(pyarrow, source):
            data = parquet.ParquetFile(stream, pre_buffer=False, page_checksum_verification=True)
            pages, present = declared_bytes(stream), set(data.schema_arrow.names)
        absent = [name for name in (STAMP, *features) if name not in present]
        if absent:
            raise InputError(
                "a file of a dataset without its columns",
                got=f"no {', '.join(absent)}",
                where=source,
                expected=", ".join((STAMP, EPISODE, *features)),
            )
        check_size(data.metadata, pages, count, size, options.max_bytes, source)
        wanted_columns = [name for name in (STAMP, EPISODE, *features) if name in present]
        for row_count, batch in batches_of(
            pyarrow, data, max(1, min(rows, MAX_CELLS // count)), source, wanted_columns
        ):
            with damage(pyarrow, source):
                part = {name: _numbers(batch.column(name)) for name in wanted_columns}
            part.setdefault(EPISODE, np.zeros(batch.num_rows))
            options.progress(
                Report("reading", size * (row_count + batch.num_rows) // max(1, data.metadata.num_rows), size)
            )
            yield part, ""
    yield {}, digest


def _numbers(array: Any) -> FloatArray:
    """Numbers, or lists of numbers as they follow on one another, NaN where missing. Shape (rows,) or (numbers,)."""
    if hasattr(array, "flatten") and "list" in str(array.type):
        array = array.flatten()
    blank = missing_of(array)
    return np.where(blank, np.nan, numbers_of(array.cast("float64", safe=False)))


def _place(values: FloatArray, place: int, count: int, source: str, first_row: int) -> FloatArray:
    """One of `count` numbers of each row. Raises InputError for rows that hold more or fewer."""
    if count == 0 or len(values) % count:
        raise InputError(
            "rows without all numbers of a feature",
            got=f"{len(values)} numbers from row {first_row + 1} on",
            expected=f"{count} in each row, as meta/info.json names them",
            where=source,
        )
    return values.reshape(-1, count)[:, place].copy()


PARQUET = Reader("parquet", "Parquet", SUFFIXES, tables)
