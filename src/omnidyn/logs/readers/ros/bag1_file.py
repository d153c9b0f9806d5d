"""ROS 1 bags (format 2.0): records of a header and data, one after the other, read from the front.

A record: length of the header (4 bytes), its fields (length, name=value), length of the data, data. What is read:
connections, messages and chunks of both. The index is not needed; that it is whole tells that the file is.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import BinaryIO

from omnidyn.logs.readers.left_out import LeftOut
from omnidyn.logs.readers.ros.messages import Connection, Message
from omnidyn.logs.readers.ros.pack import DamagedError, Unpacker

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 5, 6, 7
_LENGTH, _STAMP, _PLACE = struct.Struct("<I"), struct.Struct("<II"), struct.Struct("<Q")


class Bag1File:
    """One ROS 1 bag. `damage` says why it could not be read to its end, once all messages are taken."""

    def __init__(self, stream: BinaryIO, size: int, unpacker: Unpacker, read_to: Callable[[int], None]):
        self.stream, self.size, self.unpacker, self.read_to = stream, size, unpacker, read_to
        self.connections: dict[int, Connection] = {}
        self.damage, self.odd = "", LeftOut()
        self.promised: tuple[int, int] | None = None  # where the index begins, and how many records it has
        self.indexed = 0

    def messages(self, _wants: Callable[[Connection], bool]) -> Iterator[Message]:
        """All messages in the order of the file; up to the first damage. Raises InputError as the Unpacker does."""
        try:
            if self.stream.read(len(MAGIC)) != MAGIC:
                raise DamagedError("it is not a bag of version 2.0")
            while self.stream.tell() < self.size:
                at = self.stream.tell()
                fields = _fields(self._read())
                data, complete = self._read_some()
                if complete or (fields["op"][0] == CHUNK and fields["compression"] == b"none"):
                    yield from self._record(fields, data, complete)
                if not complete:
                    raise DamagedError("it ends in the middle of a record")
                self._count(fields, at)
                self.read_to(self.stream.tell())
            if self.promised is not None and (not self.promised[0] or self.indexed < self.promised[1]):
                raise DamagedError("it ends without its index")
        except DamagedError as error:
            self.damage = str(error)
        except (struct.error, KeyError, UnicodeDecodeError, ValueError):
            self.damage = "a record is not what it says"

    def _read(self) -> bytes:
        content, complete = self._read_some()
        if not complete:
            raise DamagedError("it ends in the middle of a record")
        return content

    def _read_some(self) -> tuple[bytes, bool]:
        """The next content with a length in front, and whether all of it is there."""
        length, remaining = self.stream.read(4), self.size - self.stream.tell()
        if len(length) < 4:
            return b"", False
        (count,) = _LENGTH.unpack(length)
        return self.stream.read(min(count, remaining)), count <= remaining

    def _count(self, fields: dict[str, bytes], at: int) -> None:
        """Records of the index, of those that the head of the bag promises. at: where the record begins."""
        operation = fields["op"][0]
        if operation == BAG_HEADER:
            records = sum(_LENGTH.unpack(fields[name])[0] for name in ("conn_count", "chunk_count"))
            self.promised = _PLACE.unpack(fields["index_pos"])[0], records
        elif operation in (CONNECTION, CHUNK_INFO) and self.promised is not None:
            self.indexed += at >= self.promised[0]

    def _record(self, fields: dict[str, bytes], data: bytes, complete: bool = True) -> Iterator[Message]:
        """The messages of a record. Not `complete`: of a chunk that is not packed, up to where it ends."""
        operation = fields["op"][0]
        if operation == CHUNK:
            kind, content = fields["compression"].decode(), data
            if complete:
                content = self.unpacker.unpack(kind, data, _LENGTH.unpack(fields["size"])[0])
            at = 0
            while at < len(content):
                head, at = _piece(content, at)
                inner, at = _piece(content, at)
                inner_fields = _fields(head)
                if inner_fields["op"][0] == CHUNK:
                    raise DamagedError("a chunk within a chunk")
                yield from self._record(inner_fields, inner)
        elif operation == CONNECTION:
            connection_fields = _fields(data)
            number = _LENGTH.unpack(fields["conn"])[0]
            text = connection_fields["message_definition"].decode("utf-8", "replace")
            self.connections[number] = Connection(
                fields["topic"].decode(), connection_fields["type"].decode(), text, "ros1"
            )
        elif operation == MESSAGE:
            seconds, rest = _STAMP.unpack(fields["time"])
            connection = self.connections.get(_LENGTH.unpack(fields["conn"])[0])
            if connection is None:
                self.odd.add("a message of a connection that is nowhere told")
                return
            yield Message(connection, seconds * 10**9 + rest, data)


def _piece(content: bytes, at: int) -> tuple[bytes, int]:
    (length,) = _LENGTH.unpack_from(content, at)
    at += 4
    if length > len(content) - at:
        raise DamagedError("a record of a chunk is longer than the chunk")
    return content[at : at + length], at + length


def _fields(content: bytes) -> dict[str, bytes]:
    """name=value, each with its length in front."""
    fields, at = {}, 0
    while at < len(content):
        field, at = _piece(content, at)
        name, _, value = field.partition(b"=")
        fields[name.decode()] = value
    return fields
