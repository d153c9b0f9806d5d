"""Reader: what the readers of all formats have in common. The contract stands in the map of this folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.logs.readers.recording import Recording
from omnidyn.logs.table.table import FileTable, join
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
    tables: Callable[[str | os.PathLike, int, ReadOptions], Iterator[FileTable]]
    least: str = "at least one row"
    recording: Callable[[str | os.PathLike, ReadOptions], Recording] | None = None
    whole: bool = False
    variables: bool = False


def completed(tables: Iterable[FileTable], minimum: str, rows: int = 0) -> Iterator[FileTable]:
    """The tables that have rows, each once the next one is there: so the last of them has the hash and all notes.

    rows: small ones that follow each other, as those of a dataset with a file per episode, are joined up to so many,
    but none of numbers to one of words: the text of its cells is gone.
    """
    waiting: list[FileTable] = []
    table = None
    for table in tables:
        if len(table):
            if waiting and (sum(map(len, waiting)) + len(table) > rows or _wordy(table) != _wordy(waiting[-1])):
                yield join(waiting)
                waiting = []
            waiting.append(table)
    if not waiting:
        raise InputError("no rows", got="0 samples", expected=minimum, where=table.source if table is not None else "")
    yield replace(join(waiting), sha256=table.sha256, notes=table.notes)  # type: ignore[union-attr]


def _wordy(table: FileTable) -> list[str]:
    return [name for name, column in table.columns.items() if isinstance(column, tuple)]
