"""Compressed bytes of a bag: never more of them than was declared, and never a declaration that cannot be true."""

from __future__ import annotations

import bz2
from typing import Any, BinaryIO

from omnidyn.errors import InputError, MissingExtraError

MAX_EXPANSION, MIN_EXPANDED_BYTES = 200, 64 * 2**20
INSTALL = 'pip install "omnidyn[logs]"'


class DamagedError(Exception):
    """From here on a file cannot be read; the message says why. What came before stands."""


class Unpacker:
    """Unpacks the chunks of one file of `size` bytes; holds at most `max_bytes` of one."""

    def __init__(self, source: str, size: int, max_bytes: int):
        self.source, self.size, self.max_bytes = source, size, max_bytes
        self.declared = 0

    def declare(self, size: int) -> None:
        """Raises InputError where a file declares much more than it can hold, before anything is unpacked."""
        self.declared += size
        limit = max(MAX_EXPANSION * self.size, MIN_EXPANDED_BYTES)
        if self.declared > limit:
            raise InputError(
                "the file would grow too much",
                got=f"{self.declared} bytes from {self.size}",
                expected=f"at most {MAX_EXPANSION} times its size",
                where=self.source,
                remedy="a log does not shrink that much: record it again, or write it without compression",
            )
        if size > self.max_bytes:
            raise InputError(
                "a chunk of the file is too large",
                got=f"{size} bytes",
                expected=f"at most {self.max_bytes}",
                remedy="write it in smaller chunks, or allow more with `max_bytes`",
                where=self.source,
            )

    def unpack(self, kind: str, data: bytes, size: int) -> bytes:
        """The bytes of a chunk. Raises DamagedError where they are not `size`, InputError for an unknown packing."""
        if kind in ("", "none"):
            content = data
        else:
            self.declare(size)
            content = self._unpacked(kind, data, size)
        if len(content) != size:
            raise DamagedError(f"a chunk holds {len(content)} bytes, and says {size}")
        return content

    def _unpacked(self, kind: str, data: bytes, size: int) -> bytes:
        try:
            if kind == "zstd":
                return _zstd(self.source).ZstdDecompressor().stream_reader(data).read(size + 1)
            if kind == "lz4":
                return _lz4(self.source).LZ4FrameDecompressor().decompress(data, max_length=size + 1)
            if kind == "bz2":
                return bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
        except (MissingExtraError, MemoryError):
            raise
        except Exception as error:  # each library has its own errors
            raise DamagedError(f"a chunk cannot be unpacked ({' '.join(str(error).split())[:60]})") from None
        raise InputError("unknown compression", got=kind[:40], expected="zstd, lz4, bz2 or none", where=self.source)

    def message(self, data: bytes) -> bytes:
        """A message that a recorder packed by itself with Zstandard; others as they are."""
        if data[:4] != b"\x28\xb5\x2f\xfd":
            return data
        zstandard = _zstd(self.source)
        try:
            size = zstandard.frame_content_size(data)
        except zstandard.ZstdError:
            return data
        size = size if size >= 0 else MIN_EXPANDED_BYTES
        if size > min(self.max_bytes, MIN_EXPANDED_BYTES):
            raise InputError(
                "a message would grow too much",
                got=f"{size} bytes from {len(data)}",
                expected=f"at most {MIN_EXPANDED_BYTES}",
                where=self.source,
            )
        try:
            return zstandard.ZstdDecompressor().stream_reader(data).read(size)
        except zstandard.ZstdError:
            return b""


def unpack_file(packed: BinaryIO, into: BinaryIO, source: str, limit: int) -> None:
    """A file that was packed whole with Zstandard. Raises InputError beyond `limit` bytes."""
    zstandard, written_bytes = _zstd(source), 0
    try:
        with zstandard.ZstdDecompressor().stream_reader(packed, closefd=False) as reader:
            while block := reader.read(2**20):
                written_bytes += len(block)
                if written_bytes > limit:
                    raise InputError(
                        "the file would grow too much",
                        got=f"more than {limit} bytes",
                        expected=f"at most {MAX_EXPANSION} times its size",
                        where=source,
                        remedy="a log does not shrink that much: record it again, or write it without compression",
                    )
                into.write(block)
    except zstandard.ZstdError as error:
        raise InputError(
            "the packed file is damaged or cut short", got=str(error), remedy="copy it again", where=source
        ) from None


def _zstd(source: str) -> Any:
    try:
        import zstandard
    except ImportError:
        raise MissingExtraError("packed bags need zstandard", remedy=INSTALL, where=source) from None
    return zstandard


def _lz4(source: str) -> Any:
    try:
        import lz4.frame
    except ImportError:
        raise MissingExtraError("packed bags need lz4", remedy=INSTALL, where=source) from None
    return lz4.frame
