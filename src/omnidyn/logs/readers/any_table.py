"""Tables from files of any kind that a reader takes: text (CSV and its kin) or Parquet, told by the content.

A new format is one more file beside parquet.py, and one more line here.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from omnidyn.files import format_of
from omnidyn.logs.readers.parquet import SUFFIXES, iter_parquet, read_parquet
from omnidyn.logs.table.table import ROWS, Table, iter_text, read_table
from omnidyn.logs.table.text import Progress


def read_any(
    path: str | os.PathLike,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    max_bytes: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """Read a table whole, whatever its format. A name that promises another format is noted.

    header: False where a text file has none. skip_bad_rows: leave out rows that cannot be read, and count them in
    `notes`. max_bytes: of the file, and of its numbers; a quarter of the memory where it is not given.
    progress(bytes_done, bytes_total) is called now and then.
    Raises InputError for what cannot be read, with the place and what to do; other formats are refused by name.
    """
    options = {"skip_bad_rows": skip_bad_rows, "max_bytes": max_bytes, "progress": progress}
    if _is_parquet(path):
        return _noted(read_parquet(path, **options), _name_note(path, True))
    return _noted(read_table(path, header=header, **options), _name_note(path, False))


def iter_tables(
    path: str | os.PathLike,
    rows: int = ROWS,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    progress: Progress | None = None,
) -> Iterator[Table]:
    """The pieces of a file of any length, at most `rows` rows each; joined they are what `read_any` reads.

    Memory is bounded by the piece. Only the last piece has the sha256 and all notes. A column that begins with numbers
    and goes on with words is numbers in the first pieces. Options and errors as those of `read_any`.
    """
    parquet = _is_parquet(path)
    note = _name_note(path, parquet)
    if parquet:
        pieces = iter_parquet(path, rows, skip_bad_rows=skip_bad_rows, progress=progress)
    else:
        pieces = iter_text(path, rows, header=header, skip_bad_rows=skip_bad_rows, progress=progress)
    return (_noted(piece, note) for piece in pieces)


def _is_parquet(path: str | os.PathLike) -> bool:
    kind = format_of(path)
    return kind is not None and kind.name == "parquet"


def _name_note(path: str | os.PathLike, parquet: bool) -> str:
    suffix = Path(path).suffix
    if parquet == (suffix.lower() in SUFFIXES) or not suffix:
        return ""
    return f"the file holds {'Parquet' if parquet else 'text'}, though its name ends in {suffix}"


def _noted(table: Table, note: str) -> Table:
    return replace(table, notes=(note, *table.notes)) if note else table
