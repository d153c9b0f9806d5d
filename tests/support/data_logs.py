"""WPILib data logs (format 1.0) from the public text of the format, byte by byte; no code of omnidyn."""

from __future__ import annotations

import struct


def record(entry: int, stamp: int, value: bytes) -> bytes:
    """A record at a time [us], which may be before 0."""
    time = stamp & 0xFFFFFFFFFFFFFFFF
    bytes_of = [max(1, (number.bit_length() + 7) // 8) for number in (entry, len(value), time)]
    head = (bytes_of[0] - 1) | (bytes_of[1] - 1) << 2 | (bytes_of[2] - 1) << 4
    parts = zip((entry, len(value), time), bytes_of, strict=True)
    return bytes([head]) + b"".join(number.to_bytes(size, "little") for number, size in parts) + value


def start(entry: int, name: str, kind: str, stamp: int = 0) -> bytes:
    """The record that starts an entry."""
    texts = b"".join(struct.pack("<I", len(text)) + text.encode() for text in (name, kind, ""))
    return record(0, stamp, b"\0" + struct.pack("<I", entry) + texts)


def data_log(*records: bytes) -> bytes:
    """The file."""
    return b"WPILOG" + bytes([0, 1]) + struct.pack("<I", 0) + b"".join(records)
