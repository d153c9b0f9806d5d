"""Messages of a bag, topic by topic, to tracks: only the numbers that are needed are kept."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, printable
from omnidyn.files import too_large
from omnidyn.logs.readers.claims import TopicClaim, TopicColumn, tracks_of
from omnidyn.logs.readers.recording import Topic, Track, topic_of
from omnidyn.logs.readers.ros.clocks import Clocked, trusted
from omnidyn.logs.readers.ros.definitions import USUAL_TYPES, BadDefinitionError, Types, parse_definition, plain
from omnidyn.logs.readers.ros.layout import BadMessageError, MessageLayout, column, layout_of
from omnidyn.logs.readers.ros.usual import NANOSECONDS, SECONDS, Rule, rank_of, rule_of
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY

BATCH_BYTES = 2**19
MAX_MESSAGE = 2**16  # bytes of a message whose type no rule knows
MAX_TOPICS = 5000
TRIES = 50  # messages of a topic of which none can be read before it is given up
LAYOUTS = 8  # kept at once


class Connection(NamedTuple):
    """Where messages come from: topic, type, definition ("" where the bag has none). form: "cdr", "ros1", or what is
    not read."""

    topic: str
    type: str
    definition: str = ""
    form: str = "cdr"


class Message(NamedTuple):
    """A message as recorded: time of reception [ns], and its bytes."""

    connection: Connection
    receive: int
    data: bytes


class TopicReader:
    """The messages of one topic, one after the other."""

    def __init__(self, connection: Connection):
        self.connection, self.why = connection, ""
        self.receive, self.order = array("q"), array("q")
        self.left_out = array("q")  # which messages were not understood
        self.kept = self.taken = 0  # how many were, and how many of these stand in `numbers`
        self.bad, self.last_fault = 0, ""
        self.rule: Rule | None = rule_of(connection.type)
        self.types: Types = {}
        self.layouts: list[tuple[MessageLayout, dict[str, str]]] = []
        self.waiting: dict[int, tuple[MessageLayout, dict[str, str], list[int], list[bytes]]] = {}
        self.bytes_waiting = 0
        self.numbers: dict[str, array] = {}  # of all messages kept; arrays that grow in place: a long bag is held once
        self.stamps = array("q")
        self._prepare()

    def _prepare(self) -> None:
        """What is known before the first message: whether this topic can be read."""
        kind = plain(self.connection.type)
        if self.rule is None:
            self.why = "pictures, scans and maps are not read"
        elif self.connection.form not in ("cdr", "ros1"):
            self.why = f"messages in {printable(self.connection.form)[:40]} are not read"
        elif self.connection.definition:
            try:
                self.types = parse_definition(kind, self.connection.definition)
            except BadDefinitionError as error:
                self.why = f"its definition cannot be read: {printable(str(error))}"
        elif kind in USUAL_TYPES:
            self.types = USUAL_TYPES
        else:
            self.why = "the file holds no definition of its type"

    @property
    def reads(self) -> bool:
        return not self.why

    def add(self, receive: int, order: int, data: bytes) -> None:
        """The next message."""
        number = len(self.receive)
        self.receive.append(receive)
        self.order.append(order)
        if self.why:
            return
        layout_and_picks = self._layout(data)
        if layout_and_picks is None or not layout_and_picks[1]:
            self.left_out.append(number)
            return
        layout, picks = layout_and_picks
        waiting = self.waiting.get(id(layout))
        if waiting is None:
            waiting = self.waiting[id(layout)] = (layout, picks, [], [])
        waiting[2].append(self.kept - self.taken)
        waiting[3].append(data)
        self.kept += 1
        self.bytes_waiting += len(data)
        if self.bytes_waiting > BATCH_BYTES:
            self.flush()

    def _layout(self, data: bytes) -> tuple[MessageLayout, dict[str, str]] | None:
        for entry in reversed(self.layouts):
            if entry[0].fits(data):
                return entry
        try:
            if len(data) > MAX_MESSAGE and self.rule is not None and self.rule.rank == 9:
                raise BadMessageError(f"{len(data)} bytes are not plain numbers")
            layout = layout_of(self.types, plain(self.connection.type), data, self.connection.form == "ros1")
        except BadMessageError as error:
            self.bad, self.last_fault = self.bad + 1, str(error)
            if self.bad >= TRIES and not self.kept:
                self.why = f"its messages cannot be read: {printable(self.last_fault)}"
            return None
        assert self.rule is not None
        picks = dict(self.rule.picks(layout))
        new_entry = layout, picks if picks.keys() - {SECONDS, NANOSECONDS} else {}
        self.layouts = [*self.layouts[1 - LAYOUTS :], new_entry]
        return new_entry

    def flush(self) -> None:
        """Turn the waiting messages into numbers, in the order in which they came; NaN where one has no such number."""
        count = self.kept - self.taken
        parts: dict[str, FloatArray] = {}
        stamps = np.zeros(count, dtype=np.int64)
        for layout, picks, rows, waiting in self.waiting.values():
            block = np.frombuffer(b"".join(waiting), dtype=np.uint8).reshape(len(waiting), layout.size)
            for key, path in picks.items():
                if key not in (SECONDS, NANOSECONDS):
                    parts.setdefault(key, np.full(count, np.nan))[rows] = column(block, layout.numbers[path])
            if SECONDS in picks:
                seconds = column(block, layout.numbers[picks[SECONDS]]).astype(np.int64)
                rest = column(block, layout.numbers[picks[NANOSECONDS]]).astype(np.int64)
                stamps[rows] = seconds * 10**9 + rest
        for key in parts:
            if key not in self.numbers:
                self.numbers[key] = array("d", np.full(self.taken, np.nan).tobytes())
        for key, numbers in self.numbers.items():
            numbers.frombytes((parts[key] if key in parts else np.full(count, np.nan)).data.cast("B"))
        self.stamps.frombytes(stamps.data.cast("B"))
        self.taken = self.kept
        self.waiting.clear()
        self.bytes_waiting = 0

    @property
    def held(self) -> int:
        """Bytes of its numbers and times."""
        return 8 * (len(self.numbers) * self.taken + self.taken + 2 * len(self.receive))

    def clocked(self) -> Clocked:
        """When its messages were received, and when they say they were made: 0 where they do not. Lets its own go."""
        self.flush()
        nothing = np.zeros(0, dtype=np.int64)
        if not self.kept:
            return Clocked(self.connection.topic, nothing, nothing, nothing)
        receive, order, stamps = (
            np.frombuffer(values, dtype=np.int64) for values in (self.receive, self.order, self.stamps)
        )
        if self.left_out:
            receive, order = (np.delete(values, self.left_out) for values in (receive, order))
        self.order, self.stamps = array("q"), array("q")
        return Clocked(self.connection.topic, receive, order, stamps)

    def columns(self, source: str) -> tuple[list[TopicColumn], list[str]]:
        """Its columns, over the messages that were understood, and notes. Raises InputError for an infinite number."""
        assert self.rule is not None
        numbers = {key: np.frombuffer(number, dtype=float) for key, number in self.numbers.items()}
        self.numbers = {}
        columns, notes = [], []
        for out in self.rule.columns(self.connection.topic, numbers):
            infinite = np.isinf(out.values)
            if infinite.any() and out.component:
                where = f"{source}, {out.name}, message {self._place(int(np.argmax(infinite))) + 1}"
                raise InputError(
                    "not a finite number",
                    got="inf",
                    expected="a finite number, or NaN where missing",
                    remedy="mend what records it",
                    where=where,
                )
            if infinite.any():
                notes.append(f"{out.name}: {int(infinite.sum())} infinite numbers are taken as missing")
                out = out._replace(values=np.where(infinite, np.nan, out.values))
            if out.component or not np.isnan(out.values).all():
                columns.append(out)
        if self.bad:
            notes.append(
                f"{self.connection.topic}: {self.bad} of {len(self.receive)} messages cannot be read and were left "
                f"out: {printable(self.last_fault)}"
            )
        return columns, notes

    def _place(self, index: int) -> int:
        """The place among all messages, from 0, of one of those that were kept."""
        return int(np.delete(np.arange(len(self.receive)), self.left_out)[index])


class Bag:
    """All topics of a bag, filled message by message; and what becomes of them."""

    def __init__(self, source: str, max_bytes: int):
        self.source, self.max_bytes = source, max_bytes
        self.readers: dict[tuple[str, str], TopicReader] = {}
        self.count = 0
        self._held_at = 10_000

    def reader(self, connection: Connection) -> TopicReader:
        """The reader of a connection; those of one topic and type are one. Raises InputError for too many."""
        key = (connection.topic, connection.type)
        if key not in self.readers:
            if len(self.readers) >= MAX_TOPICS:
                raise InputError(
                    "too many topics",
                    got=f"more than {MAX_TOPICS}",
                    expected=f"at most {MAX_TOPICS}",
                    where=self.source,
                )
            self.readers[key] = TopicReader(connection)
        return self.readers[key]

    def wants(self, connection: Connection) -> bool:
        """Whether the bytes of its messages are needed."""
        return self.reader(connection).reads

    def add(self, messages: Iterable[Message]) -> None:
        """Take all messages. Raises InputError when their numbers take more than `max_bytes`."""
        for connection, receive, data in messages:
            self.reader(connection).add(receive, self.count, data)
            self.count += 1
            if self.count >= self._held_at:
                self._held_at += 50_000
                self._refuse_more()
        self._refuse_more()

    def _refuse_more(self) -> None:
        if sum(reader.held for reader in self.readers.values()) > self.max_bytes:
            raise too_large(self.source, self.max_bytes, TOO_LARGE_REMEDY)

    def result(self) -> tuple[list[Track], list[Topic], list[str]]:
        """Tracks, topics, and notes."""
        readers, clocked = list(self.readers.values()), []
        read: dict[str, TopicReader] = {}
        for reader in readers:
            clock = reader.clocked()
            if reader.kept and reader.reads and reader.connection.topic not in read:
                read[reader.connection.topic] = reader
                clocked.append(clock)
        stamps, notes = trusted(clocked)
        del clocked
        claims: dict[str, TopicClaim] = {}
        topics = []
        for topic_reader in readers:
            topic = topic_reader.connection.topic
            is_chosen = read.get(topic) is topic_reader
            if is_chosen:
                columns, new_notes = topic_reader.columns(self.source)
                notes += new_notes
                if columns and topic_reader.rule is not None:
                    claims[topic] = TopicClaim(topic, stamps[topic], columns, rank_of(topic, topic_reader.rule))
            is_used = is_chosen and topic in claims
            topic_stamps = stamps[topic] if is_used else np.array(topic_reader.receive, dtype=np.int64)
            topics.append(
                topic_of(
                    topic,
                    topic_reader.connection.type,
                    topic_stamps,
                    is_used,
                    "" if is_used else _why(topic_reader, is_chosen),
                )
            )
            topic_reader.receive = array("q")
        tracks = list(tracks_of(list(claims.values()), notes))
        return tracks, topics, notes


def _why(reader: TopicReader, is_chosen: bool) -> str:
    """Why the messages of a topic are not used. is_chosen: whether the topic is read by this type of them."""
    if reader.why:
        return reader.why
    if reader.kept and not is_chosen:
        return "the topic has messages of another type too, and these are read"
    return f"its messages cannot be read: {printable(reader.last_fault)}" if reader.bad else "it holds no numbers"
