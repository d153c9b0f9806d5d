"""ROS 2 bags in SQLite (.db3): tables topics, messages and, from Iron on, message_definitions."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from omnidyn.errors import InputError
from omnidyn.logs.readers.left_out import LeftOut
from omnidyn.logs.readers.ros.messages import Connection, Message
from omnidyn.logs.readers.ros.pack import Unpacker

MAX_BLOB = 2**28


class Db3File:
    """One .db3 file. What SQLite cannot read is refused, as nobody knows which pages are missing; `damage` says whether
    messages stand beside it, where SQLite puts them until they are folded in."""

    def __init__(self, path: Path, size: int, unpacker: Unpacker, read_to: Callable[[int], None]):
        self.path, self.size, self.unpacker, self.read_to = path, size, unpacker, read_to
        self.damage, self.odd = "", LeftOut()

    def messages(self, wants: Callable[[Connection], bool]) -> Iterator[Message]:
        """All messages in the order in which they were recorded; without bytes those that nobody `wants`.

        Raises InputError for a file that is cut short, damaged, or no bag.
        """
        self._refuse_cut()
        try:
            connection = sqlite3.connect(f"{self.path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
            try:
                yield from self._rows(connection, wants)
            finally:
                connection.close()
            if self._beside():
                self.damage = "messages that stand in the file beside it, which ends in -wal, are not read"
        except (sqlite3.Error, OverflowError, MemoryError, ValueError, TypeError) as error:
            raise self._damaged(" ".join(str(error).split()) or type(error).__name__) from None

    def _rows(self, db: sqlite3.Connection, wants: Callable[[Connection], bool]) -> Iterator[Message]:
        db.text_factory = lambda content: content.decode("utf-8", "replace")
        db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(MAX_BLOB, self.unpacker.max_bytes))
        db.execute("pragma trusted_schema = off")
        tables = {str(name) for (name,) in db.execute("select name from sqlite_master where type = 'table'")}
        if not {"topics", "messages"} <= tables:
            raise InputError(
                "an SQLite database that is not a ROS 2 bag",
                got=", ".join(sorted(tables)[:8]) or "no tables",
                expected="the tables topics and messages",
                where=str(self.path),
            )
        texts = self._definitions(db) if "message_definitions" in tables else {}
        connections = {
            number: Connection(str(name), str(kind), texts.get(str(kind), ""), str(form))
            for number, name, kind, form in db.execute("select id, name, type, serialization_format from topics")
            if isinstance(number, int)
        }
        numbers = ", ".join(str(number) for number, connection in connections.items() if wants(connection)) or "-1"
        query = f"select topic_id, timestamp, case when topic_id in ({numbers}) then data end from messages order by id"
        for count, (number, stamp, data) in enumerate(db.execute(query)):
            if number not in connections or not isinstance(stamp, int):
                self.odd.add(f"a message of topic {number} at {stamp}, which is nowhere told or no time")
                continue
            content = data if isinstance(data, bytes) else b""
            yield Message(
                connections[number], stamp, self.unpacker.message(content) if content[:1] == b"\x28" else content
            )
            if count % 20_000 == 0:
                self.read_to(min(self.size, count * 200))

    def _definitions(self, db: sqlite3.Connection) -> dict[str, str]:
        query = "select topic_type, encoded_message_definition from message_definitions where encoding = 'ros2msg'"
        return {str(kind): str(text) for kind, text in db.execute(query)}

    def _refuse_cut(self) -> None:
        """The first page says how many there are."""
        with open(self.path, "rb") as stream:
            head = stream.read(100)
        pages, size = int.from_bytes(head[28:32], "big"), int.from_bytes(head[16:18], "big")
        size = 65536 if size == 1 else size
        if len(head) < 100 or pages * size > self.size:
            raise self._damaged(f"{self.size} bytes of {pages * size}" if len(head) == 100 else f"{self.size} bytes")

    def _beside(self) -> bool:
        """Whether a recorder is at work, or died, and left a journal with messages."""
        journal = f"{self.path}-wal"
        return os.path.exists(journal) and os.path.getsize(journal) > 0

    def _damaged(self, got: str) -> InputError:
        remedy = "copy it again; sqlite3 BAG .recover saves what can be saved"
        if self._beside():
            remedy += "; the file beside it that ends in -wal holds messages too: copy both"
        return InputError(
            "the bag is damaged or cut short",
            got=got,
            expected="a whole SQLite database",
            remedy=remedy,
            where=str(self.path),
        )
