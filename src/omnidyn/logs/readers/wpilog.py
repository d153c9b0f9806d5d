"""WPILib data logs, format 1.0: records one after the other, each of an entry, with a time in microseconds.

A record: a byte that says how many bytes the next three numbers take; the entry, the size of the value, the time; the
value. Entry 0 starts and ends the others. Values are written when they change: commands hold, and a measurement
that did not change was not written.
"""

from __future__ import annotations

import hashlib
import os
import struct
from array import array
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, printable
from omnidyn.files import default_max_bytes, growth, open_regular, pieces, too_large
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.readers.claims import TopicClaim, TopicColumn, tracks_of
from omnidyn.logs.readers.left_out import LeftOut
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.readers.recording import Recording, topic_of
from omnidyn.logs.readers.ros.layout import column
from omnidyn.logs.readers.wpilib_structs import BadSchemaError, leaves_of
from omnidyn.logs.table.table import FileTable
from omnidyn.logs.table.text_file import BLOCK_BYTES, TOO_LARGE_REMEDY, cut_short
from omnidyn.progress import Report

MAGIC = b"WPILOG"
VERSION = 1  # the major one
START = 0
SIZES = {"boolean": ("u1", 1), "int64": ("i8", 8), "float": ("f4", 4), "double": ("f8", 8)}
SIZES["int"] = SIZES["int64"]  # as it was called until 2024
MAX_ARRAY, MAX_ENTRIES, MAX_VALUE = 64, 20_000, 2**28
STRUCT, SCHEMA, SCHEMA_ENTRY = "struct:", "structschema", "/.schema/struct:"
_LATEST_STAMP = 2**62 // 1000  # [us]
STRAY = 20  # values in a row of entries that were nowhere started: nobody knows where the next record begins


class Entry:
    """The values of one name. sizes: of each, in bytes."""

    def __init__(self, name: str, kind: str):
        self.name, self.kind = name, kind
        self.stamps, self.sizes, self.values = array("q"), array("I"), bytearray()
        self.keeps = kind.removesuffix("[]") in SIZES or kind.startswith(STRUCT) or kind == SCHEMA

    def add(self, stamp: int, value: bytes) -> None:
        """The next value, at a time [us]."""
        self.stamps.append(stamp)
        if self.keeps:
            self.sizes.append(len(value))
            self.values += value


class _EndOfRecords(Exception):
    """The file ends here, or what follows is no record; the message says which."""


class WpilogFile:
    """The entries of a log; `damage` says why it could not be read to its end."""

    def __init__(self, stream: BinaryIO, size: int, source: str, options: ReadOptions):
        self.stream, self.size, self.source, self.options = stream, size, source, options
        self.max_bytes = options.max_bytes if options.max_bytes is not None else default_max_bytes()
        self.entries: dict[tuple[str, str], Entry] = {}
        self.open: dict[int, Entry] = {}
        self.damage, self.count, self.held = "", 0, 0
        self.odd, self.stray = LeftOut(), 0

    def read(self) -> None:
        """All records, up to the first that is not whole. Raises InputError for another version, or too many bytes."""
        head = self.stream.read(12)
        if len(head) < 12:
            raise self._nothing("it ends in its first bytes")
        if head[7] != VERSION:
            raise InputError(
                "a data log of another version", got=f"{head[7]}.{head[6]}", expected=f"{VERSION}.x", where=self.source
            )
        extra = int.from_bytes(head[8:12], "little")
        if extra > self.size - 12:
            raise self._nothing("its first text is longer than the file")
        self.stream.seek(extra, 1)
        try:
            for entry, stamp, value in self._records():
                self._take(entry, stamp, value)
        except _EndOfRecords as end:
            self.damage = str(end)
        if self.damage and not self.count:
            raise self._nothing(self.damage)
        if self.odd.count and not self.count:
            raise self._nothing(self.odd.first)

    def _records(self) -> Iterator[tuple[int, int, bytes]]:
        buffer, at, offset = b"", 0, self.stream.tell()
        while True:
            if len(buffer) - at < 32:  # the longest head takes 17
                offset += at
                buffer, at = buffer[at:] + self._more(BLOCK_BYTES), 0
                self.options.progress(Report("reading", offset, self.size))
            if at == len(buffer):
                return
            sizes = buffer[at]
            a = at + 1
            b = a + (sizes & 3) + 1
            c = b + (sizes >> 2 & 3) + 1
            d = c + (sizes >> 4 & 7) + 1
            if d > len(buffer):
                raise _EndOfRecords("it ends in the middle of a record")
            entry, length = int.from_bytes(buffer[a:b], "little"), int.from_bytes(buffer[b:c], "little")
            stamp = int.from_bytes(buffer[c:d], "little", signed=d - c == 8)
            if length > self.size - (offset + d):
                raise _EndOfRecords("it ends in the middle of a record")
            if sizes & 0x80 or length > MAX_VALUE:
                raise _EndOfRecords(f"what stands at byte {offset + at} is no record")
            if d + length > len(buffer):
                buffer, offset, at, d = buffer[at:] + self._more(length + BLOCK_BYTES), offset + at, 0, d - at
                if d + length > len(buffer):
                    raise _EndOfRecords("it ends in the middle of a record")
            yield entry, stamp, buffer[d : d + length]
            at = d + length

    def _more(self, count: int) -> bytes:
        """What follows, up to what the file held when it was opened."""
        return self.stream.read(max(0, min(count, self.size - self.stream.tell())))

    def _take(self, number: int, stamp: int, value: bytes) -> None:
        if number == START:
            if reason := self._control(value):
                self.odd.add(reason)
            return
        entry = self.open.get(number)
        if entry is None:
            self.odd.add(f"a value of entry {number}, which is nowhere started")
            self.stray += 1
            if self.stray >= STRAY:
                raise _EndOfRecords(self.odd.first)
            return
        self.stray = 0
        if not 0 <= stamp <= _LATEST_STAMP:
            self.odd.add(f"a value of {printable(entry.name)} at {stamp / 1e6:.6g} s")
            return
        entry.add(stamp, value)
        self.count += 1
        self.held += len(value) + 12 if entry.keeps else 8
        if self.held > self.max_bytes:
            raise too_large(self.source, self.max_bytes, TOO_LARGE_REMEDY)

    def _control(self, value: bytes) -> str:
        """Start or end an entry. Why the record cannot be used; "" where it was."""
        if len(value) < 5:
            return "a control record that is too short"
        kind, number = value[0], int.from_bytes(value[1:5], "little")
        if kind == 0:
            try:
                name, at = _text(value, 5)
                form, _ = _text(value, at)
            except (struct.error, ValueError):
                return "a text that is longer than its record"
            key = (name, form)
            if key not in self.entries and len(self.entries) >= MAX_ENTRIES:
                raise _EndOfRecords(f"more than {MAX_ENTRIES} entries")
            self.open[number] = self.entries.setdefault(key, Entry(name, form))
        elif kind == 1:
            self.open.pop(number, None)
        elif kind != 2:
            return f"a control record of kind {kind}"
        return ""

    def _nothing(self, reason: str) -> InputError:
        return InputError(
            "the data log is damaged or cut short",
            got=reason,
            expected="at least one whole record",
            remedy="copy it again from the robot; nothing in it can be saved",
            where=self.source,
        )


def _text(value: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", value, at)
    if size > len(value) - at - 4:
        raise ValueError(size)
    return value[at + 4 : at + 4 + size].decode("utf-8", "replace"), at + 4 + size


def read_wpilog(path: str | os.PathLike, options: ReadOptions) -> Recording:
    """A data log. Raises InputError where not one record is whole, or its numbers take more than `max_bytes`."""
    source, digest = str(path), hashlib.sha256()
    with open_regular(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        for block in pieces(stream, size):
            digest.update(block)
        stream.seek(0)
        file = WpilogFile(stream, size, source, options)
        file.read()
        notes = [*growth(stream, size), *file.odd.notes]
    damage = []
    if file.damage:
        damage = [cut_short(f"the file is damaged: {file.damage}; {file.count} values before that were read")]
    schemas = {
        name.removeprefix(SCHEMA_ENTRY): bytes(entry.values[: entry.sizes[0]]).decode("utf-8", "replace")
        for (name, kind), entry in file.entries.items()
        if kind == SCHEMA and name.startswith(SCHEMA_ENTRY) and len(entry.sizes)
    }
    claims, topics = [], []
    for entry in file.entries.values():
        stamps = np.array(entry.stamps, dtype=np.int64) * 1000
        outs, reason = _outs(entry, schemas, notes)
        if outs:
            claims.append(TopicClaim(entry.name, stamps, outs, 1))
        topics.append(topic_of(printable(entry.name), printable(entry.kind), stamps, bool(outs), reason))
    tracks = list(tracks_of(_renamed(claims), notes))
    return Recording(tracks, topics, source, digest.hexdigest(), [*notes, *damage], file.count if file.damage else None)


def _renamed(claims: list[TopicClaim]) -> list[TopicClaim]:
    """Two entries of one name and two types are told apart by a number: no column may be called as another."""
    names: set[str] = set()
    renamed = []
    for claim in claims:
        columns = []
        for out in claim.columns:
            name = out.name if out.name not in names else f"{out.name} ({len(names)})"
            names.add(name)
            columns.append(out._replace(name=name))
        renamed.append(claim._replace(columns=columns))
    return renamed


def _outs(entry: Entry, schemas: dict[str, str], notes: list[str]) -> tuple[list[TopicColumn], str]:
    """(the columns of an entry, why there are none)."""
    if not entry.keeps or entry.kind == SCHEMA or not len(entry.stamps):
        return [], "" if not len(entry.stamps) else "no numbers"
    sizes = np.array(entry.sizes, dtype=np.int64)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    content = np.frombuffer(bytes(entry.values), dtype=np.uint8)
    try:
        columns = (
            _struct(entry, schemas, sizes, starts, content)
            if entry.kind.startswith(STRUCT)
            else _plain(entry, sizes, starts, content)
        )
    except BadSchemaError as error:
        return [], f"its values cannot be read: {printable(str(error))}"
    outs = []
    for out in columns:
        infinite = np.isinf(out.values)
        if infinite.any():
            notes.append(f"{printable(out.name)}: {int(infinite.sum())} infinite numbers are taken as missing")
            out = out._replace(values=np.where(infinite, np.nan, out.values))
        if not np.isnan(out.values).all():
            outs.append(out)
    return outs, "" if outs else "no numbers"


def _block(content: np.ndarray, starts: IntArray, size: int) -> np.ndarray:
    """The bytes of values of one size, a row each."""
    return content[starts[:, None] + np.arange(size)]


def _plain(entry: Entry, sizes: IntArray, starts: IntArray, content: np.ndarray) -> list[TopicColumn]:
    """Numbers, and arrays of them: a column for each place. Values of another size are missing."""
    code, size = SIZES[entry.kind.removesuffix("[]")]
    if not entry.kind.endswith("[]"):
        return [TopicColumn(entry.name, _numbers(sizes == size, starts, content, size, f"<{code}"))]
    longest = min(int(sizes.max()) // size, MAX_ARRAY)
    return [
        TopicColumn(
            f"{entry.name}[{k}]", _numbers(sizes >= (k + 1) * size, starts + k * size, content, size, f"<{code}")
        )
        for k in range(longest)
    ]


def _numbers(mask: np.ndarray, starts: IntArray, content: np.ndarray, size: int, code: str) -> FloatArray:
    values = np.full(len(starts), np.nan)
    if mask.any():
        values[mask] = np.ascontiguousarray(_block(content, starts[mask], size)).view(code)[:, 0]
    return values


def _struct(
    entry: Entry, schemas: dict[str, str], sizes: IntArray, starts: IntArray, content: np.ndarray
) -> list[TopicColumn]:
    """The numbers of a struct, or of each in an array of them."""
    kind = entry.kind.removeprefix(STRUCT)
    leaves, size = leaves_of(kind.removesuffix("[]"), schemas)
    if not size:
        return []
    many = min(int(sizes.max()) // size, MAX_ARRAY) if kind.endswith("[]") else 1
    columns: list[TopicColumn] = []
    for k in range(many):
        mask = sizes >= (k + 1) * size if kind.endswith("[]") else sizes == size
        if not mask.any():
            continue
        block = _block(content, starts[mask] + k * size, size)
        for path, leaf in leaves.items():
            values = np.full(len(sizes), np.nan)
            values[mask] = column(block, leaf)
            index = f"[{k}]" if kind.endswith("[]") else ""
            columns.append(TopicColumn(f"{entry.name}{index}/{path}", values))
    return [_known(kind, entry.name, out) for out in columns]


_POSE = {"translation/x": ("x", "m"), "translation/y": ("y", "m"), "rotation/value": ("heading", "rad")}
_SPEEDS = {"vx": ("vx", "m/s"), "vy": ("vy", "m/s"), "omega": ("omega", "rad/s")}


def _known(kind: str, name: str, out: TopicColumn) -> TopicColumn:
    """What the usual structs say: a pose of the robot, speeds of its body, commanded or measured."""
    of = {"Pose2d": _POSE, "ChassisSpeeds": _SPEEDS}.get(kind, {})
    component, unit = of.get(out.name.removeprefix(f"{name}/"), (None, ""))
    if component is None:
        return out
    command = kind == "ChassisSpeeds" and words.COMMAND in read_name(name.replace("/", "_")).roles
    return out._replace(unit=unit, component=f"{component}{'_cmd' * command}")


def _tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    yield from read_wpilog(path, options).tables(rows)


WPILOG = Reader("wpilog", "a WPILib data log", (".wpilog",), _tables, "one value", read_wpilog, True)
