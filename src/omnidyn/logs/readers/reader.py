"""Reader: what the readers of all formats have in common. The contract stands in the map of this folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.logs.table.table import Table
from omnidyn.logs.table.text_file import Progress


class Options(NamedTuple):
    """How to read a file.

    header: False where the first row of a text file is a row already. skip_bad_rows: leave out rows that cannot be
    read, and count them in the notes. max_bytes: refuse a file that takes more; None for any length.
    progress(bytes_done, bytes_total) is called now and then.
    """

    header: bool = True
    skip_bad_rows: bool = False
    max_bytes: int | None = None
    progress: Progress | None = None


class Reader(NamedTuple):
    """kind: of `files.Format` that it reads, "" for text. word: of such files, in messages. suffixes: of their names,
    lower case. tables(path, rows, options): see the contract.
    """

    kind: str
    word: str
    suffixes: tuple[str, ...]
    tables: Callable[[str | os.PathLike, int, Options], Iterator[Table]]


def completed(tables: Iterable[Table]) -> Iterator[Table]:
    """The tables that have rows, each once the next one is there: so the last of them has the hash and all notes."""
    waiting: Table | None = None
    table = None
    for table in tables:
        if len(table):
            if waiting is not None:
                yield waiting
            waiting = table
    if waiting is None:
        raise InputError(
            "no rows", got="0 samples", expected="at least one row", where=table.source if table is not None else ""
        )
    yield replace(waiting, sha256=table.sha256, notes=table.notes)  # type: ignore[union-attr]
