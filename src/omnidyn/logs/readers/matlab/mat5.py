"""MATLAB files of version 5 to 7 (`save` without -v7.3): elements with a type and a length, packed by zlib or not.

The format is that of MathWorks' "MAT-File Format". It is read here and not by scipy 1.17, which ends the process on a
damaged file (segmentation fault, after 1 to 370 files with up to three wrong bytes) and takes 1 GB for a bomb of 0.8
MB; here that is refused within 0.15 GB. The price: 141 MB/s of processor time for packed numbers, checksum included,
where scipy has 199.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

import numpy as np

from omnidyn.errors import InputError
from omnidyn.files import too_large
from omnidyn.logs.readers.matlab.variables import Variables
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY

HEADER, TAG, MATRIX, COMPRESSED = 128, 8, 14, 15
MAX_EXPANSION, MIN_EXPANDED_BYTES, PIECE = 200, 64 * 2**20, 2**20
MAX_DEPTH, MAX_ELEMENTS, MAX_FIELDS = 8, 64, 2000
CODES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CELL, STRUCT, OBJECT, CHAR, SPARSE, FIRST_NUMERIC, LAST_NUMERIC = 1, 2, 3, 4, 5, 6, 15
WORDS = {CELL: "cells", SPARSE: "a sparse matrix"}  # of what is passed over; all others are objects
COMPLEX = 0x800


class _Element(NamedTuple):
    kind: int
    data: memoryview


class _Damaged(ValueError):
    """Bytes that are no element; the message says why."""


def read_mat5(stream: BinaryIO, size: int, variables: Variables, max_bytes: int) -> None:
    """The variables of a file. Raises InputError for one that is damaged, cut short, or grows too much."""
    stream.seek(0)
    head = stream.read(HEADER)
    order = {b"IM": "<", b"MI": ">"}.get(head[126:128])
    if order is None:
        raise damaged(
            variables.source, "a header that is cut short" if len(head) < HEADER else "no mark of the byte order"
        )
    unpacker = _MatUnpacker(stream, size, variables.source, max_bytes)
    try:
        while stream.tell() < size:
            content = unpacker.element(order)
            if content is not None:
                _Matrix(content, order, variables).read("", 0)
    except (_Damaged, struct.error, zlib.error) as error:
        raise damaged(variables.source, str(error)) from None


def damaged(source: str, got: str) -> InputError:
    """The error of a file that cannot be read."""
    return InputError(
        "the MATLAB file is damaged or cut short",
        got=got[:80],
        expected="a whole file",
        remedy="copy it again, or save it again in MATLAB",
        where=source,
    )


class _MatUnpacker:
    """The variables of a file one by one, unpacked within bounds."""

    def __init__(self, stream: BinaryIO, size: int, source: str, max_bytes: int):
        self.stream, self.size, self.source, self.max_bytes = stream, size, source, max_bytes
        self.expanded, self.most = 0, max(MAX_EXPANSION * size, MIN_EXPANDED_BYTES)

    def element(self, order: str) -> memoryview | None:
        """The content of the next matrix; None for an element of another kind."""
        tag = self.stream.read(TAG)
        if len(tag) < TAG:
            raise _Damaged("it ends in the middle of a variable")
        kind, count = struct.unpack(f"{order}II", tag)
        if count > self.size - self.stream.tell():
            raise _Damaged("it ends in the middle of a variable")
        if kind == COMPRESSED:
            kind, content = self._unpacked(count, order)
        elif kind == MATRIX:
            self._count(count)
            content = self.stream.read(count)
        else:
            raise _Damaged(f"an element of kind {kind}")
        return memoryview(content) if kind == MATRIX else None

    def _count(self, size: int) -> None:
        """Raises InputError beyond what the file may grow to, before that is held."""
        self.expanded += size
        if self.expanded > self.most:
            raise InputError(
                "the file would grow too much",
                got=f"more than {self.most} bytes",
                where=self.source,
                expected=f"at most {MAX_EXPANSION} times its size",
                remedy="a log does not shrink that much: save it again from its source",
            )
        if self.expanded > max(self.max_bytes, MIN_EXPANDED_BYTES):
            raise too_large(self.source, self.max_bytes, TOO_LARGE_REMEDY)

    def _unpacked(self, count: int, order: str) -> tuple[int, bytes]:
        """(kind, content) of a packed variable, whose own tag says how long it is."""
        unpacker, packed, content = zlib.decompressobj(), self.stream.read(count), bytearray()
        while packed and not unpacker.eof:
            piece = unpacker.decompress(packed, PIECE)
            self._count(len(piece))
            content += piece
            packed = unpacker.unconsumed_tail
        if not unpacker.eof or len(content) < TAG:
            raise _Damaged("a variable that is cut short")
        kind, length = struct.unpack_from(f"{order}II", content)
        if length > len(content) - TAG:
            raise _Damaged("a variable that is shorter than it says")
        return kind, bytes(content[TAG : TAG + length])


class _Matrix:
    """One matrix, or what it is made of: its parts one after the other."""

    def __init__(self, content: memoryview, order: str, variables: Variables):
        self.content, self.order, self.variables, self.at = content, order, variables, 0

    def read(self, name: str, depth: int) -> np.ndarray | None:
        """Enter the matrix under its own name, or below `name`. The number of a field that holds one, else None."""
        flags = self._numbers()
        if not len(flags):
            return None
        kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & COMPLEX)
        if kind > LAST_NUMERIC:
            self.variables.passed[name or "a variable"] = "an object"
            return None
        shape = tuple(int(number) for number in self._numbers())
        matrix_name = bytes(self._next().data).rstrip(b"\0").decode("latin-1")
        name = name or matrix_name or "a variable"
        if not shape or min(shape) < 0:
            raise _Damaged(f"{name} has no shape")
        if FIRST_NUMERIC <= kind <= LAST_NUMERIC:
            return self._numeric(name, shape, is_complex)
        if kind == STRUCT and depth < MAX_DEPTH:
            self._struct(name, int(np.prod(shape, dtype=float)), depth)
        elif kind == CHAR:
            self.variables.texts[name] = bytes(self._next().data[:200]).replace(b"\0", b"").decode("utf-8", "replace")
        else:
            self.variables.passed[name] = WORDS.get(kind, "an object")
        return None

    def _next(self) -> _Element:
        """The next part; a short one stands in its own tag."""
        if self.at + 4 > len(self.content):
            raise _Damaged("a matrix that is cut short")
        (kind,) = struct.unpack_from(f"{self.order}I", self.content, self.at)
        if kind >> 16:
            count, first = kind >> 16, self.at + 4
            kind, after = kind & 0xFFFF, self.at + TAG
        else:
            (count,) = struct.unpack_from(f"{self.order}I", self.content, self.at + 4)
            first = self.at + TAG
            after = first + count + -count % 8
        if first + count > len(self.content) or (count > 4 and first == self.at + 4):
            raise _Damaged("a part of a matrix is longer than the matrix")
        self.at = after
        return _Element(kind, self.content[first : first + count])

    def _numbers(self) -> np.ndarray:
        if self.at >= len(self.content):
            return np.zeros(0)
        kind, data = self._next()
        if kind not in CODES or len(data) % int(CODES[kind][1]):
            raise _Damaged(f"numbers of kind {kind}")
        return np.frombuffer(data, dtype=f"{self.order}{CODES[kind]}")

    def _numeric(self, name: str, shape: tuple[int, ...], is_complex: bool) -> np.ndarray:
        values = self._numbers()
        if len(values) != np.prod(shape, dtype=float):
            raise _Damaged(f"{name} has {len(values)} numbers, and says {' x '.join(map(str, shape))}")
        values = values.reshape(shape, order="F").astype(float)
        if is_complex:
            self.variables.passed[name] = "complex numbers"
            return values
        self.variables.add(name, values)
        return values

    def _struct(self, name: str, count: int, depth: int) -> None:
        """A struct, or an array of structs: where each holds single numbers, these are a column."""
        width = self._numbers()
        names = bytes(self._next().data)
        size = int(width[0]) if len(width) else 0
        if size <= 0 or len(names) // size > MAX_FIELDS:
            raise _Damaged(f"{name} has no fields")
        fields = [
            names[k : k + size].partition(b"\0")[0].decode("latin-1") for k in range(0, len(names) // size * size, size)
        ]
        if count * len(fields) * TAG > len(self.content) - self.at:  # each part has a tag at least
            raise _Damaged(f"{name} says {count} structs of {len(fields)} fields, and is shorter")
        singles: dict[str, list[float]] = {field: [] for field in fields}
        for k in range(count if fields else 0):
            inner = Variables(self.variables.source)
            for field, part in zip(fields, self._parts(len(fields)), strict=True):
                index = f"[{k + 1}]" if count > 1 else ""
                value = _Matrix(part, self.order, inner).read(f"{name}{index}/{field}", depth + 1)
                if value is not None and value.size == 1:
                    singles[field].append(float(value.reshape(-1)[0]))
            if k < MAX_ELEMENTS:
                self._take(inner, f"{name}[{k + 1}]" if count > 1 else name)
        for field, numbers in singles.items():
            if len(numbers) == count > 1:
                self.variables.add(f"{name}/{field}", np.array(numbers))

    def _parts(self, count: int) -> Iterator[memoryview]:
        for _ in range(count):
            kind, data = self._next()
            if kind != MATRIX:
                raise _Damaged(f"an element of kind {kind} in a struct")
            yield data

    def _take(self, inner: Variables, path: str) -> None:
        """What a struct holds; a signal of Simulink under its own label."""
        label = inner.texts.get(f"{path}/label", "")
        for name, values in inner.arrays.items():
            self.variables.arrays[label if label and name == f"{path}/values" else name] = values
        self.variables.passed |= inner.passed
