"""Recording: what a file holds whose topics have clocks of their own; and the Tables that the contract asks for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, shortened
from omnidyn.logs.clock.stamps import astray
from omnidyn.logs.readers.left_out import LeftOut
from omnidyn.logs.table.dialect import MAX_NAME
from omnidyn.logs.table.header import MAX_COLUMNS
from omnidyn.logs.table.rows import Column, refuse_infinite
from omnidyn.logs.table.table import MAX_CELLS, Declaration, FileTable
from omnidyn.statement import Statement

TIME_COLUMN = "t_s"
DAY_NS = 86_400 * 10**9
EPOCH_NS = 10**17  # later counts from 1970: the start is taken off before it becomes a float, so that no digit is lost


@dataclass(frozen=True)
class Topic:
    """A topic of a file, or a column of a table. count: of its messages, or of cells that are not blank.

    rate: [Hz] by the median step, 0 where it has none. longest_gap: [s]. read: whether its numbers are read. why: what
    stands against it, in words.
    """

    name: str
    type: str
    count: int
    rate: float = 0.0
    longest_gap: float = 0.0
    read: bool = False
    why: str = ""


@dataclass
class Track:
    """The numbers of one topic. stamps [ns], shape (n,), as recorded. columns: name -> shape (n,).

    says: column -> what the format itself says it is. units: column -> unit.
    """

    topic: str
    stamps: IntArray
    columns: dict[str, FloatArray]
    units: dict[str, str] = field(default_factory=dict)
    says: dict[str, Declaration] = field(default_factory=dict)

    def in_order(self) -> Track:
        """The same by stamps; those of one stamp in their order."""
        if (self.stamps[1:] >= self.stamps[:-1]).all():
            return self
        return self.rows(np.argsort(self.stamps, kind="stable"))

    def rows(self, keep: NDArray) -> Track:
        """The same with some of its rows: a mask or indices."""
        columns = {name: values[keep] for name, values in self.columns.items()}
        return Track(self.topic, self.stamps[keep], columns, self.units, self.says)


@dataclass
class Recording:
    """What was read of a file. topics: all there are. salvaged: how many messages, where the file is cut short."""

    tracks: list[Track]
    topics: list[Topic]
    source: str
    sha256: str = ""
    notes: list[Statement | str] = field(default_factory=list)
    salvaged: int | None = None

    def tables(self, rows: int) -> Iterator[FileTable]:
        """Tables in the order of time: a row per stamp, blank in the columns of topics that have nothing there.

        Raises InputError where no topic holds numbers.
        """
        named_tracks = self._without_strays(self._named())
        tracks = [track.in_order() for track in named_tracks if len(track.stamps) and track.columns]
        names = (TIME_COLUMN, *(name for track in tracks for name in track.columns))
        if not tracks:
            raise self._nothing()
        if len(names) > MAX_COLUMNS:
            raise InputError(
                "too many columns",
                got=len(names),
                expected=f"at most {MAX_COLUMNS}",
                where=self.source,
                remedy="record fewer topics, or cut it with `ros2 bag convert`",
            )
        units = {TIME_COLUMN: "s"} | {name: unit for track in tracks for name, unit in track.units.items()}
        says = {TIME_COLUMN: Declaration("t")} | {
            name: declaration for track in tracks for name, declaration in track.says.items()
        }
        first, start = min(int(track.stamps[0]) for track in tracks), 0
        notes = tuple(self.notes)
        if first >= EPOCH_NS:
            start = first
            moment = np.datetime64(start, "ns").astype("datetime64[ms]")
            notes = (*notes, f"time begins at 0 with the first stamp, {moment} UTC")
        rest = (units, self.source)
        several_clocks, row_count = len(tracks) > 1, 0
        for stamps, columns in _blocks(tracks, max(1, min(rows, MAX_CELLS // len(names)))):
            lines = np.arange(row_count + 1, row_count + 1 + len(stamps))
            row_count += len(stamps)
            block: dict[str, Column] = {TIME_COLUMN: (stamps - start) / 1e9, **columns}
            refuse_infinite(block, lines, self.source)
            yield FileTable(names, block, lines, *rest, "", notes, says=says, own_clocks=several_clocks)
        yield FileTable(
            names, {}, np.zeros(0, dtype=np.int64), *rest, self.sha256, notes, says=says, own_clocks=several_clocks
        )

    def _without_strays(self, tracks: list[Track]) -> list[Track]:
        """The tracks without single stamps far from all others."""
        stamps = np.concatenate([track.stamps for track in tracks] or [np.zeros(0, dtype=np.int64)])
        stray = astray(stamps, DAY_NS)
        if not stray.any():
            return tracks
        parts = np.split(stray, np.cumsum([len(track.stamps) for track in tracks])[:-1])
        topic = next(track.topic for track, part in zip(tracks, parts, strict=True) if part.any())
        left_out = LeftOut(
            int(stray.sum()), f"a time of {stamps[stray][0] / 1e9:.9g} s in {topic}, far from all others"
        )
        self.notes += left_out.notes
        return [track.rows(~part) for track, part in zip(tracks, parts, strict=True)]

    def _named(self) -> list[Track]:
        """The tracks without those whose names no table takes, which are noted."""
        longest = {id(track): max(map(len, track.columns), default=0) for track in self.tracks}
        for track in self.tracks:
            if longest[id(track)] > MAX_NAME:
                words = f"a name of {longest[id(track)]} characters, more than {MAX_NAME}: its columns are left out"
                self.notes.append(f"{shortened(track.topic, 60)}: {words}")
        return [track for track in self.tracks if longest[id(track)] <= MAX_NAME]

    def _nothing(self) -> InputError:
        topic_words = [f"{topic.name} ({topic.type}, {topic.count})" for topic in self.topics if topic.count]
        return InputError(
            "no topic holds numbers that can be read",
            got=shortened(", ".join(topic_words), 400) or "no messages",
            expected="JointState, Odometry, Twist, BatteryState, Imu or messages with plain numbers",
            remedy="record the topics of wheels and commands too",
            where=self.source,
        )


def _repeats(stamps: IntArray) -> IntArray:
    """How many before it have the same stamp. stamps: in order."""
    new = np.append(True, np.diff(stamps) != 0)
    if new.all():
        return np.zeros(len(stamps), dtype=np.int64)
    rows = np.arange(len(stamps))
    return rows - np.maximum.accumulate(np.where(new, rows, 0))


def _stamps(tracks: Sequence[Track]) -> IntArray:
    """The stamps of all rows, in order: each as often as the topic that repeats it most."""
    stamps = np.unique(np.concatenate([track.stamps for track in tracks]))
    counts = np.ones(len(stamps), dtype=np.int64)
    for track in tracks:
        again = _repeats(track.stamps)
        if again.any():
            np.maximum.at(counts, np.searchsorted(stamps, track.stamps), again + 1)
    return np.repeat(stamps, counts)


def _blocks(tracks: Sequence[Track], block_rows: int) -> Iterator[tuple[IntArray, dict[str, FloatArray]]]:
    """(stamps [ns] of at most `block_rows` rows, the columns in them), block by block; stamps of a topic are in order.

    A block is a stretch of time, so that no more than a block is ever put together.
    """
    positions = [0] * len(tracks)
    while any(at < len(track.stamps) for at, track in zip(positions, tracks, strict=True)):
        until = _until(tracks, positions, block_rows)
        ends = [int(np.searchsorted(track.stamps, until, side="right")) for track in tracks]
        parts = [
            Track(track.topic, track.stamps[a:b], {name: values[a:b] for name, values in track.columns.items()})
            for a, b, track in zip(positions, ends, tracks, strict=True)
        ]
        positions, stamps = ends, _stamps(parts)
        rows = [np.searchsorted(stamps, part.stamps) + _repeats(part.stamps) for part in parts]
        for first in range(0, len(stamps), block_rows):  # one stamp may have more messages than a block has rows
            columns: dict[str, FloatArray] = {}
            for part, track_rows in zip(parts, rows, strict=True):
                columns |= _placed(part, track_rows, first, min(block_rows, len(stamps) - first))
            yield stamps[first : first + block_rows], columns


def _until(tracks: Sequence[Track], positions: Sequence[int], block_rows: int) -> int:
    """The latest stamp [ns] up to which all topics have at most `block_rows` messages more; the next one at least."""
    ahead = [track.stamps[at : at + block_rows + 1] for at, track in zip(positions, tracks, strict=True)]
    ahead = [stamps for stamps in ahead if len(stamps)]
    low, high = min(int(stamps[0]) for stamps in ahead), max(int(stamps[-1]) for stamps in ahead)
    while low < high:
        middle = (low + high + 1) // 2
        count = sum(int(np.searchsorted(stamps, middle, side="right")) for stamps in ahead)
        low, high = (middle, high) if count <= block_rows else (low, middle - 1)
    return low


def _placed(track: Track, rows: IntArray, first: int, count: int) -> Mapping[str, FloatArray]:
    """The columns of a track in rows first .. first + count, NaN where it has no message. rows: of its messages."""
    a, b = np.searchsorted(rows, [first, first + count])
    placed = {}
    for name, values in track.columns.items():
        column = np.full(count, np.nan)
        column[rows[a:b] - first] = values[a:b]
        placed[name] = column
    return placed


def topic_of(name: str, kind: str, stamps: IntArray, read: bool = False, reason: str = "") -> Topic:
    """A Topic with its rate and gaps. stamps [ns]."""
    steps = np.diff(stamps)
    if (steps < 0).any():
        steps = np.diff(np.sort(stamps))
    longest = int(steps.max(initial=0)) / 1e9
    positive = steps if len(steps) and steps.min() > 0 else steps[steps > 0]
    rate = 1e9 / float(np.median(positive, overwrite_input=True)) if positive.size else 0.0
    return Topic(shortened(name, MAX_NAME), kind, len(stamps), rate, longest, read, reason)
