"""Tables from files of any kind that a reader takes, told by the content. A new format: a file, and a line here."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from omnidyn.errors import InputError
from omnidyn.files import default_max_bytes, format_of
from omnidyn.logs.readers.folders import files_of, is_bag_folder, is_log_folder, log_folders, natural
from omnidyn.logs.readers.lerobot import PARQUET
from omnidyn.logs.readers.matlab.mat import HDF5, MAT
from omnidyn.logs.readers.reader import Reader, ReadOptions, completed
from omnidyn.logs.readers.ros.bags import MCAP, ROS1, ROS2
from omnidyn.logs.readers.text import TEXT
from omnidyn.logs.readers.wpilog import WPILOG
from omnidyn.logs.table.table import ROWS, FileTable, join
from omnidyn.progress import Progress, silent

READERS: tuple[Reader, ...] = (
    TEXT,
    PARQUET,
    MCAP,
    ROS2,
    ROS1,
    WPILOG,
    MAT,
    HDF5,
)  # what no other reads is text, or refused by name
LOG_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".log", *(suffix for reader in READERS for suffix in reader.suffixes))
"""How names of logs end: what commands take from a folder."""
ROW_BYTES = 2**10  # what a row takes that is at hand, its text and its numbers


def read_table(
    path: str | os.PathLike,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    max_bytes: int | None = None,
    progress: Progress = silent,
    variables: Sequence[str] = (),
) -> FileTable:
    """Read a table whole, whatever its format. A name that promises another format is noted.

    header: False where a text file has none; the columns are then called c1, c2, ... skip_bad_rows: leave out rows
    with another number of cells, a broken quote, an infinite number, or text where the column holds numbers; they are
    counted in `notes`. max_bytes: of the file, and of its numbers; a quarter of the memory where it is not given.
    progress: hears how many bytes are done. variables: of a MATLAB file, those to read; none: all.
    Raises InputError for what cannot be read: `file:line, column NAME: what; got ...; expected ...; remedy`; other
    formats are refused by name.
    """
    limit = default_max_bytes() if max_bytes is None else max_bytes
    return join(_tables(path, ROWS, ReadOptions(header, skip_bad_rows, limit, progress, tuple(variables))), limit)


def iter_tables(
    path: str | os.PathLike,
    rows: int = ROWS,
    *,
    header: bool = True,
    skip_bad_rows: bool = False,
    max_bytes: int | None = None,
    progress: Progress = silent,
    variables: Sequence[str] = (),
) -> Iterator[FileTable]:
    """The tables of a file of any length, at most `rows` rows each; joined they are what `read_table` reads.

    Only the last has the sha256 and all notes. A column that begins with numbers and goes on with words is numbers in
    the first tables. Options and errors as those of `read_table`, but that `max_bytes` bounds what is held at once: a
    text or a Parquet file may be of any length.
    """
    limit = default_max_bytes() if max_bytes is None else max_bytes
    if not reader_of(path).whole:
        rows, limit = min(rows, max(1, limit // ROW_BYTES)), None
    return _tables(path, rows, ReadOptions(header, skip_bad_rows, limit, progress, tuple(variables)))


def reader_of(path: str | os.PathLike) -> Reader:
    """The reader of a file, by its content; of a folder that holds one recording, by its first file."""
    files = files_of(path)
    kind = format_of(files[0])
    if is_bag_folder(path):
        return ROS2 if kind is not None and kind.name in ("sqlite", "zstd") else MCAP
    return next((reader for reader in READERS if kind is not None and reader.kind == kind.name), TEXT)


def _tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    if rows < 1:
        raise InputError("no rows in a piece", got=rows, expected="1 or more")
    reader, suffix = reader_of(path), Path(path).suffix
    if options.variables and not reader.variables:
        raise InputError(
            "there are no variables to choose from",
            got=reader.word,
            expected="a MATLAB or HDF5 file",
            where=str(path),
            remedy="leave `variables` out; `column` chooses columns and topics",
        )
    if is_log_folder(path):
        suffix = ""
    promised = next((reader for reader in READERS if suffix.lower() in reader.suffixes), TEXT)
    tables = completed(reader.tables(path, rows, options), reader.least, rows)
    if promised is reader or not suffix:
        return tables
    note = f"the file holds {reader.word}, though its name ends in {suffix}"
    return (replace(table, notes=(note, *table.notes)) for table in tables)


def logs_in(folder: str | os.PathLike) -> list[str]:
    """The logs in a folder and below, numbers in names as numbers. Raises InputError where there is none."""
    folders = log_folders(folder)
    matches = [
        str(path)
        for path in Path(folder).rglob("*")
        if path.suffix.lower() in LOG_SUFFIXES and path.is_file() and not {*path.parents} & {*folders}
    ]
    matches += map(str, folders)
    if not matches:
        expected = f"files that end in {' '.join(LOG_SUFFIXES)}"
        raise InputError("no log in the folder", expected=expected, where=str(folder))
    return sorted(matches, key=natural)
