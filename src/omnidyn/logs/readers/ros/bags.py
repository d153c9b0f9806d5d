"""Bags of ROS as readers of logs: MCAP, ROS 2 (db3, or a folder of either) and ROS 1."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes, growth, open_regular, pieces
from omnidyn.logs.readers.folders import files_of
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.readers.recording import Recording
from omnidyn.logs.readers.ros.bag1_file import Bag1File
from omnidyn.logs.readers.ros.db3_file import Db3File
from omnidyn.logs.readers.ros.mcap_file import McapFile
from omnidyn.logs.readers.ros.messages import Bag
from omnidyn.logs.readers.ros.pack import MAX_EXPANSION, MIN_EXPANDED_BYTES, Unpacker, unpack_file
from omnidyn.logs.table.table import FileTable
from omnidyn.logs.table.text_file import cut_short
from omnidyn.progress import Report

SQLITE, ROSBAG, ZSTD = b"SQLite format 3\x00", b"#ROSBAG V", b"\x28\xb5\x2f\xfd"


def read_bag(path: str | os.PathLike, options: ReadOptions) -> Recording:
    """A bag: a file, or the folder of one. Raises InputError where no message can be read, or it grows too much."""
    return read_files(files_of(path), str(path), options)


def read_files(paths: Sequence[Path], source: str, options: ReadOptions) -> Recording:
    """Files of one recording, in their order."""
    limit = options.max_bytes if options.max_bytes is not None else default_max_bytes()
    bag, digest, damage, grown = Bag(source, limit), hashlib.sha256(), [], []
    total, bytes_before = sum(os.stat(path).st_size for path in paths if path.exists()), 0
    for path in paths:

        def read_to(at: int, before: int = bytes_before) -> None:
            options.progress(Report("reading", before + at, total))

        with open_regular(path) as stream:
            size = os.fstat(stream.fileno()).st_size
            for block in pieces(stream, size):
                digest.update(block)
            stream.seek(0)
            bytes_before += size
            with _opened(stream, path, limit, read_to) as file:
                bag.add(file.messages(bag.wants))
            damage += [file.damage] if file.damage else []
            grown += file.odd.notes
            grown += growth(stream, size, path.name if len(paths) > 1 else "")
    if damage and not bag.count:
        raise InputError(
            "the recording is damaged or cut short",
            got=damage[0],
            expected="at least one whole message",
            remedy="copy it again, with all files that stand beside it",
            where=source,
        )
    tracks, topics, notes = bag.result()
    notes = [*grown, *notes]
    if damage:
        words = f"the file is damaged: {damage[0]}; {bag.count} messages before that were read"
        notes.insert(0, cut_short(words))
    return Recording(tracks, topics, source, digest.hexdigest(), notes, bag.count if damage else None)


@contextlib.contextmanager
def _opened(stream: BinaryIO, path: Path, limit: int, progress: Callable[[int], None]) -> Iterator[Any]:
    """The file by its first bytes; one that was packed whole is unpacked beside, within bounds."""
    size, start = os.fstat(stream.fileno()).st_size, stream.read(16)
    stream.seek(0)
    if start.startswith(ZSTD):
        with tempfile.TemporaryDirectory(prefix="omnidyn-") as folder:
            plain = Path(folder) / path.with_suffix("").name
            with open(plain, "wb") as unpacked:
                unpack_file(stream, unpacked, str(path), max(MAX_EXPANSION * size, MIN_EXPANDED_BYTES))
            with open_regular(plain) as inner, _opened(inner, plain, limit, progress) as file:
                yield file
        return
    unpacker = Unpacker(str(path), size, limit)
    if start.startswith(SQLITE):
        yield Db3File(path, size, unpacker, progress)
    else:
        yield (Bag1File if start.startswith(ROSBAG) else McapFile)(stream, size, unpacker, progress)


def tables_of(read: Callable[[str | os.PathLike, ReadOptions], Recording]) -> Callable[..., Iterator[FileTable]]:
    """The `tables` of a Reader from what reads a Recording."""

    def tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
        yield from read(path, options).tables(rows)

    return tables


_BAG_READER: tuple[Any, ...] = (tables_of(read_bag), "one message", read_bag, True)
MCAP = Reader("mcap", "an MCAP recording", (".mcap",), *_BAG_READER)
ROS2 = Reader("sqlite", "a ROS 2 bag", (".db3",), *_BAG_READER)
ROS1 = Reader("bag", "a ROS 1 bag", (".bag",), *_BAG_READER)
