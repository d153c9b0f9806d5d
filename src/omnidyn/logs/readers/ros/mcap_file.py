"""MCAP: records one after the other (mcap.dev/spec), read from the front, so that a file cut short is no less readable.

A record: opcode (1 byte), length (8), content. What is read: Schema, Channel, Message, Chunk, DataEnd; the index
behind them is not needed. The stream reader of the mcap package is as fast (111 MB/s), but believes a declared size:
a bomb of 15 kB takes it 0.95 GB of memory; and it drops the last chunk of a file that is cut short.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from typing import BinaryIO

from omnidyn.logs.readers.left_out import LeftOut
from omnidyn.logs.readers.ros.messages import Connection, Message
from omnidyn.logs.readers.ros.pack import DamagedError, Unpacker

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 2, 3, 4, 5, 6, 15
_HEAD, _MESSAGE, _CHUNK = struct.Struct("<BQ"), struct.Struct("<HIQQ"), struct.Struct("<QQQI")


class McapFile:
    """One MCAP file. `damage` says why it could not be read to its end, once all messages are taken."""

    def __init__(self, stream: BinaryIO, size: int, unpacker: Unpacker, read_to: Callable[[int], None]):
        self.stream, self.size, self.unpacker, self.read_to = stream, size, unpacker, read_to
        self.schemas: dict[int, tuple[str, str, str]] = {}
        self.channels: dict[int, Connection] = {}
        self.damage, self.odd = "", LeftOut()

    def messages(self, _wants: Callable[[Connection], bool]) -> Iterator[Message]:
        """All messages in the order of the file; up to the first damage. Raises InputError as the Unpacker does."""
        try:
            self.stream.read(len(MAGIC))
            yield from self._records()
        except DamagedError as error:
            self.damage = str(error)
        except (struct.error, IndexError, UnicodeDecodeError):
            self.damage = "a record is not what it says"

    def _records(self) -> Iterator[Message]:
        while True:
            head = self.stream.read(_HEAD.size)
            if len(head) < _HEAD.size:
                raise DamagedError("it ends without its index" if not head else "it ends in the middle of a record")
            opcode, length = _HEAD.unpack(head)
            if opcode in (DATA_END, FOOTER):
                self._check_end()
                return
            if length > self.size - self.stream.tell():
                if opcode == CHUNK:
                    yield from self._half(self.stream.read(self.size - self.stream.tell()))
                raise DamagedError("it ends in the middle of a record")
            if opcode == CHUNK:
                yield from self._chunk(self.stream.read(length))
                self.read_to(self.stream.tell())
            elif opcode in (SCHEMA, CHANNEL, MESSAGE):
                message = self._record(opcode, self.stream.read(length))
                if message is not None:
                    yield message
            else:
                self.stream.seek(length, 1)

    def _check_end(self) -> None:
        """Whether the index and the last mark are there."""
        if self.size < len(MAGIC):
            return
        self.stream.seek(max(0, self.size - len(MAGIC)))
        if self.stream.read() != MAGIC:
            raise DamagedError("all messages are there, but its index is cut short")

    def _half(self, content: bytes) -> Iterator[Message]:
        """What a chunk that is not packed holds up to where the file ends."""
        kind, at = _text(content, _CHUNK.size)
        if not kind:
            yield from self._inner(content[at + 8 :])

    def _chunk(self, content: bytes) -> Iterator[Message]:
        _, _, size, crc = _CHUNK.unpack_from(content)
        kind, at = _text(content, _CHUNK.size)
        (packed,) = struct.unpack_from("<Q", content, at)
        at += 8
        if packed != len(content) - at:
            raise DamagedError("a chunk is not as long as it says")
        records = self.unpacker.unpack(kind, content[at:], size)
        if crc and zlib.crc32(records) != crc:
            raise DamagedError("a chunk has another checksum than it says: it is left out, and what follows")
        yield from self._inner(records)

    def _inner(self, records: bytes) -> Iterator[Message]:
        """The messages of the records of a chunk."""
        at = 0
        while at < len(records):
            opcode, length = _HEAD.unpack_from(records, at)
            at += _HEAD.size
            if length > len(records) - at:
                raise DamagedError("a record of a chunk is longer than the chunk")
            if opcode in (SCHEMA, CHANNEL, MESSAGE):
                message = self._record(opcode, records[at : at + length])
                if message is not None:
                    yield message
            at += length

    def _record(self, opcode: int, content: bytes) -> Message | None:
        """The message of a record, None for another; what cannot be used is left out."""
        try:
            return self._read(opcode, content)
        except DamagedError as error:
            self.odd.add(str(error))
        except (struct.error, IndexError, UnicodeDecodeError):
            self.odd.add("a record that is not what it says")
        return None

    def _read(self, opcode: int, content: bytes) -> Message | None:
        if opcode == MESSAGE:
            channel, _, log_time, published = _MESSAGE.unpack_from(content)
            log_time = log_time or published
            connection = self.channels.get(channel)
            if connection is None:
                raise DamagedError(f"a message of channel {channel}, which is nowhere told")
            if log_time >= 2**63:
                raise DamagedError(f"a message of {connection.topic} before 1970 or after 2262")
            data = content[_MESSAGE.size :]
            return Message(connection, log_time, self.unpacker.message(data) if data[:1] == b"\x28" else data)
        if opcode == SCHEMA:
            (number,) = struct.unpack_from("<H", content)
            name, at = _text(content, 2)
            form, at = _text(content, at)
            definition, _ = _text(content, at)
            self.schemas[number] = name, form, definition
        else:
            number, schema = struct.unpack_from("<HH", content)
            topic, at = _text(content, 4)
            form, _ = _text(content, at)
            name, kind, definition = self.schemas.get(schema, ("", "", ""))
            self.channels[number] = _connection(topic, form, name, kind, definition)
        return None


def _connection(topic: str, form: str, name: str, kind: str, definition: str) -> Connection:
    """kind: of the schema; a definition in IDL is not read, but the usual messages are known without."""
    if kind not in ("ros2msg", "ros1msg"):
        definition = ""
    return Connection(topic or "(no name)", name or "unknown", definition, form or "unknown")


def _text(content: bytes, at: int) -> tuple[str, int]:
    """A text with its length in front, and where it ends."""
    (size,) = struct.unpack_from("<I", content, at)
    at += 4
    if size > len(content) - at:
        raise DamagedError("a text is longer than its record")
    return content[at : at + size].decode("utf-8"), at + size
