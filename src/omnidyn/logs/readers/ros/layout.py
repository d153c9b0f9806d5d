"""Where the numbers of a message lie: CDR (ROS 2) and the plain form of ROS 1.

A message is walked through once, field by field; what follows with the same lengths and words is then read by numpy,
thousands at a time. Nothing of a definition is run as a program, and no length in a message is believed before the
bytes behind it are there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from omnidyn.logs.readers.ros.definitions import PRIMITIVES, SEQUENCE, STAMPS, WORDS, Types

MAX_DEPTH, MAX_NESTED, MAX_NUMBERS = 16, 500, 4000
MAX_ARRAY = 64  # a longer row of numbers is no column each: a scan, a picture
CDR_HEAD = 4
SIZES = {"u1": 1, "i1": 1, "u2": 2, "i2": 2, "u4": 4, "i4": 4, "f4": 4, "u8": 8, "i8": 8, "f8": 8}


class Leaf(NamedTuple):
    """A number in a message: where it begins [bytes], and its numpy code."""

    offset: int
    code: str


class BadMessageError(ValueError):
    """Bytes that are no message of their type."""


@dataclass
class MessageLayout:
    """Of all messages of `size` bytes that agree in the `fixed` stretches, which hold their lengths and words.

    numbers: path ("pose.position.x", "velocity[2]") -> Leaf. words: path -> text.
    """

    size: int
    fixed: list[tuple[int, int]] = field(default_factory=list)
    numbers: dict[str, Leaf] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    sample: bytes = b""

    def fits(self, data: bytes) -> bool:
        """Whether a message has this layout."""
        if len(data) != self.size:
            return False
        sample = self.sample
        for a, b in self.fixed:  # noqa: SIM110 - a loop, as this is what reading a long bag waits for
            if data[a:b] != sample[a:b]:
                return False
        return True


def layout_of(types: Types, name: str, data: bytes, ros1: bool = False) -> MessageLayout:
    """The layout of one message. Raises BadMessageError."""
    walk = _FieldWalk(types, bytes(data), ros1)
    walk.message(name, "", 0)
    if len(data) - walk.at >= 8 and not ros1:  # a writer may pad; more is another type
        raise BadMessageError(f"{len(data) - walk.at} bytes too many")
    if ros1 and walk.at != len(data):
        raise BadMessageError(f"{len(data) - walk.at} bytes too many")
    walk.layout.fixed = _merged(walk.layout.fixed)
    return walk.layout


def column(block: np.ndarray, leaf: Leaf) -> np.ndarray:
    """The numbers of a leaf in messages of one layout. block: (messages, size) of bytes. Shape (messages,)."""
    size = SIZES[leaf.code[1:]]
    return np.ascontiguousarray(block[:, leaf.offset : leaf.offset + size]).view(leaf.code)[:, 0]


class _FieldWalk:
    def __init__(self, types: Types, data: bytes, ros1: bool):
        self.types, self.data, self.ros1 = types, data, ros1
        self.base = self.at = 0 if ros1 else CDR_HEAD
        self.order = "<"
        self.layout = MessageLayout(len(data), sample=data)
        if not ros1:
            if len(data) < CDR_HEAD or data[0] != 0 or data[1] > 1:
                raise BadMessageError("not plain CDR")
            self.order = "<" if data[1] else ">"
            self.layout.fixed.append((0, 2))

    def message(self, name: str, path: str, depth: int) -> None:
        """A message and all of its fields. Raises BadMessageError where it is not defined, or has no end."""
        if depth > MAX_DEPTH:
            raise BadMessageError("messages within messages without end")
        fields = self.types.get(name)
        if fields is None:
            raise BadMessageError(f"{name} is not defined")
        if not fields and not self.ros1:
            self.take(1)  # C++ has no empty structures: one byte stands for nothing
        for member in fields:
            self.field(member.type, member.length, f"{path}{member.name}", depth)

    def field(self, kind: str, length: int | None, path: str, depth: int) -> None:
        """A field: a value, an array of so many, or a sequence. Raises BadMessageError for too many."""
        if length is None:
            self.value(kind, path, depth)
            return
        count = self.count() if length == SEQUENCE else length
        if kind in PRIMITIVES:
            self.numbers(PRIMITIVES[kind], count, path)
            return
        if count > MAX_NESTED:
            raise BadMessageError(f"{count} elements in {path}")
        for k in range(count):
            self.value(kind, f"{path}[{k}]", depth)

    def value(self, kind: str, path: str, depth: int) -> None:
        """A number or a text where it stands, or the message that it is."""
        if kind in PRIMITIVES:
            code = PRIMITIVES[kind]
            self.leaf(path, self.take(SIZES[code], SIZES[code]), code)
        elif kind in STAMPS:
            self.leaf(f"{path}.sec", self.take(4, 4), "i4" if kind == "duration" else "u4")
            self.leaf(f"{path}.nanosec", self.take(4, 4), "i4" if kind == "duration" else "u4")
        elif kind in WORDS:
            self.text(kind, path)
        else:
            self.message(kind, f"{path}.", depth + 1)

    def numbers(self, code: str, count: int, path: str) -> None:
        size = SIZES[code]
        if not count:
            return
        first = self.take(size * count, size)
        if count <= MAX_ARRAY:
            for k in range(count):
                self.leaf(f"{path}[{k}]", first + k * size, code)

    def leaf(self, path: str, offset: int, code: str) -> None:
        if len(self.layout.numbers) >= MAX_NUMBERS:
            raise BadMessageError(f"more than {MAX_NUMBERS} numbers")
        self.layout.numbers[path] = Leaf(offset, self.order + code)

    def count(self) -> int:
        """A length in the message, which all messages of this layout have."""
        at = self.take(4, 4)
        self.layout.fixed.append((at, at + 4))
        return int.from_bytes(self.data[at : at + 4], "little" if self.order == "<" else "big")

    def text(self, kind: str, path: str) -> None:
        size = self.count() * (1 if kind == "string" else 4)
        at = self.take(size)
        self.layout.fixed.append((at, at + size))
        if kind == "string":
            self.layout.words[path] = self.data[at : at + size].rstrip(b"\0").decode("utf-8", "replace")

    def take(self, size: int, align: int = 1) -> int:
        """Where the next `size` bytes begin, which have to be there."""
        if not self.ros1 and align > 1:
            self.at += -(self.at - self.base) % align
        at, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise BadMessageError(f"{len(self.data)} bytes, at least {self.at} needed")
        return at


def _merged(stretches: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Stretches that touch, but for padding, as one."""
    merged: list[tuple[int, int]] = []
    for a, b in stretches:
        if merged and a == merged[-1][1]:
            merged[-1] = (merged[-1][0], b)
        else:
            merged.append((a, b))
    return merged
