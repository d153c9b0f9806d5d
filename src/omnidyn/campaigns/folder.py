"""Folder: what a campaign keeps on disk, so that nothing is lost, whatever ends.

manifest.json            spec, hashes of inputs and task, version, samples, rows of a shard
inputs/                  the files that the spec names, copied
shards/00000.parquet     one shard: sample, what varied, what was measured. Written whole or not at all, never changed
shards/00000.json        its record, written after it: a shard without one is not done. Who reads a shard compares them
shards/00000.failed      the traceback of a shard that failed; gone once the shard is there
lock                     held by whoever works, on the bytes of its shards; the system lets go however a process ends
merged.parquet           all shards as one file, by `merge`: the same bytes however it was cut into shards
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.campaigns.manifest import WORD, Manifest, ShardRecord
from omnidyn.campaigns.spec import INPUTS, Spec, parse_spec
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.files import file_sha256, open_atomic, read_text, sha256, write_atomic
from omnidyn.logs.readers.parquet import import_pyarrow

MANIFEST, SHARDS, LOCK, MERGED = "manifest.json", "shards", "lock", "merged.parquet"
DONE, RECORD, FAILED = ".parquet", ".json", ".failed"
SAMPLE = "sample"
GROUP_ROWS = 2**16  # rows of a group of the merged file
CHECKED = {"page_checksum_verification": True}  # what changes while it is read is an error


@dataclass(frozen=True)
class Status:
    """Shards that are there, that failed (shard -> traceback), how many there are in all; and all samples."""

    done: tuple[int, ...]
    failed: dict[int, str]
    shards: int
    samples: int

    @property
    def complete(self) -> bool:
        """Whether all shards are there."""
        return len(self.done) == self.shards


@dataclass(frozen=True)
class Folder:
    """A folder that holds a campaign."""

    path: Path

    @property
    def exists(self) -> bool:
        """Whether a campaign has begun in it."""
        return (self.path / MANIFEST).exists()

    @property
    def manifest(self) -> Manifest:
        """Read from disk. Raises InputError where there is none, or what is there is none."""
        place = self.path / MANIFEST
        if not self.exists:
            raise InputError("no campaign", expected=f"a folder with a {MANIFEST}", where=str(self.path))
        try:
            content = json.loads(read_text(place))
            if content.pop("kind", None) != WORD:
                raise TypeError
            manifest = Manifest(**content)
        except (ValueError, TypeError, AttributeError):
            raise InputError(
                "not the manifest of a campaign", expected="as a sweep wrote it", where=str(place)
            ) from None
        parse_spec(manifest.spec, str(place))
        return manifest

    @property
    def spec(self) -> Spec:
        """The spec of the campaign, files by their copies."""
        return parse_spec(self.manifest.spec, str(self.path / MANIFEST))

    def begin(self, manifest: Manifest, inputs: Mapping[str, bytes], block: int = 1) -> Manifest:
        """Make the folder for a campaign, or find the same campaign in it: its manifest, whose shards count.

        One with more samples goes on where this one ended. block: samples that are moved together.
        Raises InputError where the folder holds another campaign (what differs), or anything else.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        if not self.exists:
            self._refuse_strangers(inputs)
            for name, content in inputs.items():
                (self.path / name).parent.mkdir(exist_ok=True)
                write_atomic(self.path / name, content, force=True)
            (self.path / SHARDS).mkdir(exist_ok=True)
            try:
                write_atomic(self.path / MANIFEST, manifest.to_json())
            except InputError:
                if not self.exists:  # else another part of the same campaign was quicker
                    raise
        before = self._grown(self.manifest, manifest, block)
        if differences := before.differences(manifest):
            raise InputError(
                f"the folder holds another campaign ({'; '.join(differences)})",
                expected="the same spec, inputs, task and version; of sobol and random sampling, more samples",
                remedy="take a new folder",
                where=str(self.path),
            )
        self.check_inputs()
        return before

    def _grown(self, before: Manifest, wanted: Manifest, block: int) -> Manifest:
        """The manifest, with more samples where these are wanted; shards that would hold more are to be made again.

        Raises InputError while somebody works in the folder.
        """
        if not before.can_grow_to(wanted):
            return before
        after = before.with_samples(wanted.samples)
        with self.locked(0, after.shards):
            self.check_inputs()
            whole = before.samples // block * block  # a block that was not whole is driven again
            for shard in range(before.shards):
                if after.rows(shard) != before.rows(shard) or before.rows(shard)[1] > whole:
                    self.shard_path(shard, RECORD).unlink(missing_ok=True)
                    self.shard_path(shard).unlink(missing_ok=True)
            (self.path / MERGED).unlink(missing_ok=True)
            write_atomic(self.path / MANIFEST, after.to_json(), force=True)
        return after

    def _refuse_strangers(self, inputs: Mapping[str, bytes]) -> None:
        names = {name.partition("/")[0] for name in inputs} | {SHARDS, LOCK}
        strangers = [entry.name for entry in self.path.iterdir() if entry.name not in names and entry.name[0] != "."]
        if strangers:
            raise InputError(
                "the folder holds other files", got=strangers[0], expected="a new or empty folder", where=str(self.path)
            )

    def shard_path(self, shard: int, ending: str = DONE) -> Path:
        """Where a shard, or the traceback of one that failed, stands."""
        return self.path / SHARDS / f"{shard:05d}{ending}"

    def check_inputs(self) -> None:
        """Raises InputError where a copy of an input is not what the campaign began with."""
        for name, expected in self.manifest.inputs.items():
            if name.startswith(INPUTS) and (got := file_sha256(self.path / name)) != expected:
                raise InputError(
                    "an input has changed since the campaign began",
                    got=f"SHA-256 {got}",
                    expected=expected,
                    remedy="put the file back as it was, or start in a new folder",
                    where=str(self.path / name),
                )

    def done(self, shards: Iterable[int]) -> tuple[int, ...]:
        """Those of some shards that are there, with a record. Raises InputError where one differs from its record."""
        done, faults = self._judged(shards)
        if faults:
            shard, (what, got, expected) = next(iter(faults.items()))
            count = "it" if len(faults) == 1 else f"it and {len(faults) - 1} more"
            raise InputError(
                what,
                got=got,
                expected=expected,
                remedy=f"make {count} again with `repair`: omnidyn sweep resume {self.path}",
                where=str(self.shard_path(shard)),
            )
        return tuple(done)

    def _judged(self, shards: Iterable[int]) -> tuple[list[int], dict[int, tuple[str, str, str]]]:
        """Those of some shards that are there, with a record; what of these differs from its record."""
        manifest, done, faults = self.manifest, list[int](), dict[int, tuple[str, str, str]]()
        for shard in shards:
            path, record = self.shard_path(shard), self.shard_path(shard, RECORD)
            if path.exists() and record.exists():
                done.append(shard)
                if fault := ShardRecord(file_sha256(path), manifest.rows(shard), manifest.sha256).fault(record):
                    faults[shard] = fault
        return done, faults

    def remove_damaged(self, shards: Iterable[int]) -> tuple[int, ...]:
        """Delete those of some shards that differ from their records, and say which: they are to be made again."""
        damaged = tuple(self._judged(shards)[1])
        for shard in damaged:
            self.shard_path(shard, RECORD).unlink(missing_ok=True)
            self.shard_path(shard).unlink(missing_ok=True)
        return damaged

    def write_shard(self, shard: int, columns: Mapping[str, Any]) -> None:
        """Write a shard, then its record. Raises InputError where they cannot be written: a full disk."""
        pyarrow, parquet = import_pyarrow()
        sink = pyarrow.BufferOutputStream()
        parquet.write_table(pyarrow.table(dict(columns)), sink, write_page_checksum=True)
        content, manifest = sink.getvalue().to_pybytes(), self.manifest
        record = ShardRecord(sha256(content), manifest.rows(shard), manifest.sha256)
        self.shard_path(shard, RECORD).unlink(missing_ok=True)  # a shard that was there is not done until the end
        try:
            write_atomic(self.shard_path(shard), content, force=True)
            write_atomic(self.shard_path(shard, RECORD), record.to_json(), force=True)
        except InputError as error:
            remedy = f"make room there, then go on: omnidyn sweep resume {self.path}"
            raise InputError(error.what, got=error.got, remedy=remedy, where=error.where) from None
        self.shard_path(shard, FAILED).unlink(missing_ok=True)

    def mark_failed(self, shard: int, words: str) -> None:
        """Keep why a shard failed."""
        write_atomic(self.shard_path(shard, FAILED), words, force=True)

    def status(self) -> Status:
        """What is there. Raises InputError where a shard or an input is not what was written."""
        manifest, names = self.manifest, sorted(os.listdir(self.path / SHARDS))
        self.check_inputs()
        done = self.done(int(name[: -len(DONE)]) for name in names if name.endswith(DONE) and name[0] != ".")
        failed = {int(name[: -len(FAILED)]): "" for name in names if name.endswith(FAILED) and name[0] != "."}
        words = {shard: read_text(self.shard_path(shard, FAILED)) for shard in failed if shard not in set(done)}
        return Status(done, words, manifest.shards, manifest.samples)

    @contextlib.contextmanager
    def locked(self, start: int, stop: int) -> Iterator[None]:
        """Within it nobody else works on the shards start to stop. Raises InputError where somebody does.

        Locks of bytes of a file: processes that work on other shards do not meet; the system lets go of
        them when the process ends, however it ends; and a file system in a network (NFS) knows them.
        """
        if _working(self.path, start, stop):
            raise self._taken(start, stop)
        with open(self.path / LOCK, "a+b") as stream:
            if not _seize(stream, start, stop - start):
                raise self._taken(start, stop)
            mark = (self.path.resolve(), start, stop)
            _MARKS.append(mark)
            try:
                yield
            finally:
                _MARKS.remove(mark)

    def _taken(self, start: int, stop: int) -> InputError:
        return InputError(
            "another run works in this folder",
            got=f"shards {start} to {stop - 1}",
            expected="one run at a time",
            remedy="wait for it, or stop it; what it has done stays",
            where=str(self.path),
        )

    def merge(self) -> Path:
        """All shards as one file, in the order of the samples. Raises InsufficientDataError while some are missing."""
        status = self.status()
        if not status.complete:
            raise InsufficientDataError(
                "shards are missing",
                got=f"{len(status.done)} of {status.shards}, {len(status.failed)} failed",
                expected="all of them",
                remedy=f"omnidyn sweep resume {self.path}",
                where=str(self.path),
            )
        _, parquet = import_pyarrow()
        schema = self.schema(status.done)
        tables = (with_columns(parquet.read_table(self.shard_path(shard), **CHECKED), schema) for shard in status.done)
        with (
            open_atomic(self.path / MERGED, force=True) as stream,
            parquet.ParquetWriter(stream, schema, write_page_checksum=True) as writer,
        ):
            for table in _regrouped(tables):
                writer.write_table(table, row_group_size=GROUP_ROWS)
        return self.path / MERGED

    def write_csv(self, path: Path, force: bool) -> None:
        """Write what was merged as CSV, for spreadsheets: cells of what is not there are empty."""
        pyarrow, parquet = import_pyarrow()
        from pyarrow.csv import write_csv

        sink = pyarrow.BufferOutputStream()
        write_csv(parquet.read_table(self.path / MERGED, **CHECKED), sink)
        write_atomic(path, sink.getvalue().to_pybytes(), force=force)

    def schema(self, shards: Iterable[int]) -> Any:
        """Columns of some shards together, in the order in which they are first met: fits have not all the same."""
        pyarrow, parquet = import_pyarrow()
        return pyarrow.unify_schemas([parquet.read_schema(self.shard_path(shard)) for shard in shards])


def with_columns(table: Any, schema: Any) -> Any:
    """The table with all columns of a schema; null where it has none."""
    pyarrow, _ = import_pyarrow()
    if table.schema == schema:
        return table
    has = {*table.column_names}
    columns = [table[field.name] if field.name in has else pyarrow.nulls(len(table), field.type) for field in schema]
    return pyarrow.table(columns, schema=schema)


def _regrouped(tables: Iterable[Any]) -> Iterator[Any]:
    """The rows of tables in groups of GROUP_ROWS, whatever they were cut into."""
    pyarrow, _ = import_pyarrow()
    rest = None
    for table in tables:
        rest = table if rest is None else pyarrow.concat_tables([rest, table])
        while len(rest) >= GROUP_ROWS:
            yield rest.slice(0, GROUP_ROWS).combine_chunks()
            rest = rest.slice(GROUP_ROWS)
    if rest is not None and len(rest):
        yield rest.combine_chunks()


# POSIX locks are of a process: two runs in one are told apart here, before the file is opened: to close it lets go.
_MARKS: list[tuple[Path, int, int]] = []


def _working(path: Path, start: int, stop: int) -> bool:
    return any(path.resolve() == other and start < end and first < stop for other, first, end in _MARKS)


def _seize(stream: Any, start: int, count: int) -> bool:
    """Lock bytes of an open file, if they are free. Kept until the file is closed, or the process ends."""
    try:
        if os.name == "nt":
            import msvcrt

            stream.seek(start)
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, count)
        else:
            import fcntl

            fcntl.lockf(stream, fcntl.LOCK_EX | fcntl.LOCK_NB, count, start)
    except OSError:
        return False
    return True


def as_columns(rows: list[Mapping[str, float]]) -> dict[str, Any]:
    """Rows of numbers as columns. Raises InputError where rows have other names."""
    names = [*rows[0]]
    for row in rows:
        if [*row] != names:
            raise InputError("a task returned other names", got=", ".join(row), expected=", ".join(names))
    return {name: np.array([row[name] for row in rows], dtype=float) for name in names}


def as_table(rows: list[Mapping[str, bool | float | str | None]]) -> dict[str, Any]:
    """Rows of numbers and words that need not have the same names as columns, null where a row has nothing."""
    pyarrow, _ = import_pyarrow()
    kinds, columns = {str: pyarrow.string(), bool: pyarrow.bool_()}, {}
    for name in dict.fromkeys(name for row in rows for name in row):
        values = [row.get(name) for row in rows]
        kind = next((type(value) for value in values if value is not None), float)
        columns[name] = pyarrow.array(values, kinds.get(kind, pyarrow.float64()))
    return columns
