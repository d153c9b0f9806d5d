"""CDR, little endian: messages of ROS 2 as bytes. What layout.py of the readers takes apart, put together."""

from __future__ import annotations

import struct
from collections.abc import Sequence


class Packer:
    """The bytes of one message, field by field."""

    def __init__(self) -> None:
        self.content = bytearray(b"\x00\x01\x00\x00")

    def _align(self, size: int) -> None:
        self.content += b"\x00" * (-(len(self.content) - 4) % size)

    def numbers(self, code: str, *values: float) -> Packer:
        """Numbers one after the other; code: as in `struct`."""
        self._align(struct.calcsize(code))
        self.content += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def text(self, text: str) -> Packer:
        """A string."""
        content = text.encode() + b"\x00"
        self.numbers("I", len(content))
        self.content += content
        return self

    def texts(self, texts: Sequence[str]) -> Packer:
        """A sequence of strings."""
        self.numbers("I", len(texts))
        for text in texts:
            self.text(text)
        return self

    def array(self, values: Sequence[float]) -> Packer:
        """A sequence of float64."""
        self.numbers("I", len(values))
        return self.numbers("d", *values) if len(values) else self

    def header(self, stamp: int, frame: str = "") -> Packer:
        """std_msgs/Header. stamp: [ns]."""
        self.numbers("i", stamp // 10**9)
        return self.numbers("I", stamp % 10**9).text(frame)

    def __bytes__(self) -> bytes:
        return bytes(self.content)
