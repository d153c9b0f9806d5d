"""Reader: what the readers of all formats have in common. The contract stands in the map of this folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.logs.readers.recording import Recording
from omnidyn.logs.table.table import Table
from omnidyn.progress import Progress, silent


class ReadOptions(NamedTuple):
    """How to read a file.

    header: False where the first row of a text file is a row already. skip_bad_rows: leave out rows that cannot be
    read, and count them in the notes. max_bytes: refuse a file that takes more; None for any length.
    progress(bytes_done, bytes_total) is called now and then. variables: of a file that holds variables (MATLAB), those
    to read, with all that is in them; none: all.
    """

    header: bool = True
    skip_bad_rows: bool = False
    max_bytes: int | None = None
    progress: Progress = silent
    variables: tuple[str, ...] = ()


class Reader(NamedTuple):
    """kind: of `files.Format` that it reads, "" for text. word: of such files, in messages. suffixes: of their names,
    lower case. tables(path, rows, options): see the contract. least: what a file must hold, in messages.
    recording(path, options): where topics have clocks of their own, all that a file holds. whole: it holds the numbers
    of a file at once, and streams them no more. variables: whether a file is made of some, to choose from.
    """

    kind: str
    word: str
    suffixes: tuple[str, ...]
    tables: Callable[[str | os.PathLike, int, ReadOptions], Iterator[Table]]
    least: str = "at least one row"
    recording: Callable[[str | os.PathLike, ReadOptions], Recording] | None = None
    whole: bool = False
    variables: bool = False


def completed(tables: Iterable[Table], least: str) -> Iterator[Table]:
    """The tables that have rows, each once the next one is there: so the last of them has the hash and all notes."""
    waiting: Table | None = None
    table = None
    for table in tables:
        if len(table):
            if waiting is not None:
                yield waiting
            waiting = table
    if waiting is None:
        raise InputError("no rows", got="0 samples", expected=least, where=table.source if table is not None else "")
    yield replace(waiting, sha256=table.sha256, notes=table.notes)  # type: ignore[union-attr]


# Logs that are folders: a bag of ROS 2 (metadata.yaml and the files of one recording, split where they grew too
# long), and a dataset of LeRobot (meta/info.json and data/)

METADATA = "metadata.yaml"  # never read: a bag is what its files are
INFO = "meta/info.json"  # of a dataset of LeRobot
BAG_SUFFIXES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")


def is_bag_folder(path: str | os.PathLike) -> bool:
    """Whether a path is a folder that holds one recording of ROS 2."""
    return os.path.isfile(os.path.join(path, METADATA)) and bool(_files(Path(path)))


def is_dataset_folder(path: str | os.PathLike) -> bool:
    """Whether a path is the folder of a dataset of LeRobot."""
    return os.path.isfile(os.path.join(path, INFO)) and bool(data_files(Path(path)))


def is_log_folder(path: str | os.PathLike) -> bool:
    """Whether a path is a folder that is one log."""
    return is_bag_folder(path) or is_dataset_folder(path)


def log_folders(path: str | os.PathLike) -> list[Path]:
    """The folders below a path that are one log each."""
    found = [file.parent for file in Path(path).rglob(METADATA)]
    found += [file.parent.parent for file in Path(path).rglob("info.json") if file.parent.name == "meta"]
    return [folder for folder in found if is_log_folder(folder)]


def data_files(folder: Path) -> list[Path]:
    """The files of the rows of a dataset, in their order."""
    found = [file for file in (folder / "data").rglob("*.parquet") if file.is_file()]
    return sorted(found, key=lambda file: natural(str(file)))


def files_of(path: str | os.PathLike) -> list[Path]:
    """The files of a recording in their order: those in its folder, else the file itself."""
    if is_bag_folder(path):
        return _files(Path(path))
    return data_files(Path(path)) if is_dataset_folder(path) else [Path(path)]


def _files(folder: Path) -> list[Path]:
    found = [file for file in folder.iterdir() if file.name.lower().endswith(BAG_SUFFIXES) and file.is_file()]
    return sorted(found, key=lambda each: natural(each.name))


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which numbers in names count as numbers: exp2 before exp10."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", name)]
