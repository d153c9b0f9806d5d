"""Parquet files to the same Table as CSV, and a Table's columns to Parquet. Needs pyarrow: the extra `logs`.

Numbers of any kind become floats, true and false 1 and 0, a moment its seconds since 1970 (UTC), a duration its
seconds, null NaN. A unit stands in the metadata of a column ("unit"), or in brackets behind its name.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, MissingExtraError
from omnidyn.files import growth, open_regular, pieces, too_large
from omnidyn.logs.readers.parquet_pages import declared_bytes
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.table.header import MAX_COLUMNS, check_name, split_units
from omnidyn.logs.table.rows import INFINITE, Column, column_of, refuse_infinite, skip_note
from omnidyn.logs.table.table import MAX_CELLS, FileTable
from omnidyn.logs.table.text_file import BLOCK_BYTES, TOO_LARGE_REMEDY
from omnidyn.progress import Report

MAX_EXPANSION, MIN_EXPANDED_BYTES = 200, 64 * 2**20
MAX_THRIFT_STRING, MAX_THRIFT_ITEMS = 16 * 2**20, 10**6
EXACT_WHOLE = 2**53  # beyond, a float does not hold every whole number
SUFFIXES = (".parquet", ".pq")

NUMBER, TRUTH, MOMENT, DURATION, DAY, WORDS = "number", "truth", "moment", "duration", "day", "words"

_UNIT_KEYS, _TITLE_KEYS = (b"unit", b"units"), (b"title", b"long_name", b"description")
_TICKS = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}


def import_pyarrow(where: str = "") -> tuple[Any, Any]:
    """pyarrow and pyarrow.parquet. Raises MissingExtraError with the line that installs them."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtraError(
            "Parquet files need pyarrow", remedy='pip install "omnidyn[logs]"', where=where
        ) from None
    return pyarrow, pyarrow.parquet


def parquet_bytes(columns: Mapping[str, FloatArray], units: Mapping[str, str]) -> bytes:
    """Columns of floats as a Parquet file, to the last bit: NaN stays NaN and is no null.

    Raises MissingExtraError without pyarrow.
    """
    pyarrow, parquet = import_pyarrow()
    fields = [
        pyarrow.field(name, pyarrow.float64(), metadata={"unit": units[name]} if name in units else None)
        for name in columns
    ]
    arrays = [pyarrow.array(np.ascontiguousarray(values)) for values in columns.values()]
    sink = io.BytesIO()
    table = pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields))
    parquet.write_table(table, sink, use_dictionary=False, write_page_checksum=True)
    return sink.getvalue()


def parquet_tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    """The tables of a Parquet file, its rows numbered from 1 in `Table.lines`; see the contract.

    Raises InputError for a file that is damaged, has nested columns, or whose rows take more than `max_bytes`, or 200
    times the size of the file and more than 64 MB; MissingExtraError without pyarrow.
    """
    source = str(path)
    pyarrow, parquet = import_pyarrow(source)
    with open_regular(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        digest = sha256_of(stream, size)
        with damage(pyarrow, source):
            file, columns = _opened(pyarrow, parquet, stream, source)
            pages = declared_bytes(stream)
        check_size(file.metadata, pages, len(columns.names), size, options.max_bytes, source)
        reader = _RowGroups(columns, source, options.skip_bad_rows)

        def table(values: dict[str, Column], lines: Any, sha256: str = "") -> FileTable:
            notes = (*reader.notes, *(growth(stream, size) if sha256 else ()))
            return FileTable(columns.names, values, lines, columns.units, source, sha256, notes, columns.titles)

        for row_count, batch in batches_of(pyarrow, file, max(1, min(rows, MAX_CELLS // len(columns.names))), source):
            with damage(pyarrow, source):
                values, lines = reader.read(batch, row_count)
            options.progress(
                Report("reading", size * (row_count + batch.num_rows) // max(1, file.metadata.num_rows), size)
            )
            yield table(values, lines)
        yield table({}, np.zeros(0, dtype=np.int64), digest)


def _opened(pyarrow: Any, parquet: Any, stream: BinaryIO, source: str) -> tuple[Any, _ParquetColumns]:
    """The file and its columns. Words stay a dictionary and indices: a long word repeated often takes no memory."""
    options = {
        "page_checksum_verification": True,
        "pre_buffer": False,
        "buffer_size": BLOCK_BYTES,
        "thrift_string_size_limit": MAX_THRIFT_STRING,
        "thrift_container_size_limit": MAX_THRIFT_ITEMS,
    }
    file = parquet.ParquetFile(stream, **options)
    columns = _ParquetColumns(pyarrow, file.schema_arrow, source)
    words = [name for name, kind in zip(columns.raw, columns.kinds, strict=True) if kind == WORDS]
    return parquet.ParquetFile(stream, read_dictionary=words, **options), columns


def check_size(metadata: Any, pages: int, columns: int, size: int, max_bytes: int | None, source: str) -> None:
    """Refuse what would take much more memory than the file, before it is read.

    A constant column packs to nothing: so the numbers in memory count as well, and not only what the pages declare.
    """
    expanded = max(pages, 8 * columns * metadata.num_rows)
    if expanded > max(MAX_EXPANSION * size, MIN_EXPANDED_BYTES):
        raise InputError(
            "the file would grow too much",
            got=f"{expanded} bytes from {size}",
            expected=f"at most {MAX_EXPANSION} times its size",
            remedy="a log does not shrink that much: write it again from its source",
            where=source,
        )
    if max_bytes is not None and max(size, expanded) > max_bytes:
        raise too_large(source, max_bytes, TOO_LARGE_REMEDY)


def batches_of(
    pyarrow: Any, file: Any, rows: int, source: str, columns: list[str] | None = None
) -> Iterator[tuple[int, Any]]:
    """Blocks of the file, of all its columns or some, and how many rows stand before each."""
    row_count = 0
    with damage(pyarrow, source):
        batches = iter(file.iter_batches(batch_size=rows, use_threads=False, columns=columns))
    while True:
        with damage(pyarrow, source):
            batch = next(batches, None)
        if batch is None:
            return
        yield row_count, batch
        row_count += batch.num_rows


@contextlib.contextmanager
def damage(pyarrow: Any, source: str) -> Iterator[None]:
    """Every way in which pyarrow stumbles over a broken file, as an InputError."""
    try:
        yield
    except (pyarrow.ArrowException, OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise InputError(
            "the Parquet file is damaged or cut short",
            got=" ".join(str(error).split()) or type(error).__name__,
            expected="a whole file",
            remedy="copy or write it again; a writer that was killed leaves no footer",
            where=source,
        ) from None


def sha256_of(stream: BinaryIO, size: int) -> str:
    digest = hashlib.sha256()
    for block in pieces(stream, size):
        digest.update(block)
    stream.seek(0)
    return digest.hexdigest()


class _ParquetColumns:
    """What the columns of a file are: `raw` names in the file, `names` without units, `kinds`, units and titles.

    Raises InputError for nested columns, raw bytes, blank or repeated names, and too many columns.
    """

    def __init__(self, pyarrow: Any, schema: Any, source: str):
        self.raw = list(schema.names)
        if not 0 < len(self.raw) <= MAX_COLUMNS:
            raise InputError(
                "too many columns" if self.raw else "no columns",
                got=len(self.raw),
                expected=f"1 to {MAX_COLUMNS}",
                where=source,
            )
        for k in range(len(self.raw)):
            check_name(k, [name if name.strip() else "" for name in self.raw], source)
        self.kinds = [_kind(pyarrow.types, field.type) for field in schema]
        self._refuse(schema, source)
        names, self.units = split_units(self.raw)
        self.names = tuple(names)
        self.titles: dict[str, str] = {}
        for name, field, kind in zip(names, schema, self.kinds, strict=True):
            if kind in (MOMENT, DURATION, DAY):
                self.units[name] = "s"
            _take(self.units, name, field.metadata, _UNIT_KEYS)
            _take(self.titles, name, field.metadata, _TITLE_KEYS)
        moments = [name for name, kind in zip(names, self.kinds, strict=True) if kind in (MOMENT, DAY)]
        self.notes = [f"{', '.join(moments)}: moments were read as seconds since 1970 (UTC)"] if moments else []

    def _refuse(self, schema: Any, source: str) -> None:
        bad_columns = [
            f"{field.name} ({field.type})" for field, kind in zip(schema, self.kinds, strict=True) if not kind
        ]
        if bad_columns:
            raise InputError(
                f"{'columns' if len(bad_columns) > 1 else 'a column'} that hold no single numbers or words",
                got=", ".join(bad_columns),
                expected="plain columns, one for each wheel or axis",
                remedy="write each component as a column of its own",
                where=source,
            )


def _take(into: dict[str, str], name: str, metadata: Mapping[bytes, bytes] | None, keys: tuple[bytes, ...]) -> None:
    for key in keys:
        text = (metadata or {}).get(key, b"").decode("utf-8", "replace").strip()
        if text:
            into[name] = text
            return


def _kind(types: Any, kind: Any) -> str:
    """What a column holds; "" for what no column of a table can hold."""
    if types.is_dictionary(kind):
        kind = kind.value_type
    tests = {
        TRUTH: types.is_boolean,
        NUMBER: lambda k: types.is_floating(k) or types.is_integer(k) or types.is_decimal(k) or types.is_null(k),
        MOMENT: types.is_timestamp,
        DURATION: lambda k: types.is_duration(k) or types.is_time(k),
        DAY: types.is_date,
        WORDS: lambda k: types.is_string(k) or types.is_large_string(k),
    }
    return next((name for name, test in tests.items() if test(kind)), "")


class _RowGroups:
    """Batches into columns of floats and words."""

    def __init__(self, columns: _ParquetColumns, source: str, skip: bool):
        self.columns, self.source, self.skip = columns, source, skip
        self.rounded: set[str] = set()
        self.skipped: list[int] = []
        self.words: set[str] = set()

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided so far, in words."""
        rounded = [f"{name}: whole numbers beyond 2^53 were rounded" for name in sorted(self.rounded)]
        return (*self.columns.notes, *rounded, *([skip_note(INFINITE, self.skipped)] if self.skipped else []))

    def read(self, batch: Any, row_count: int) -> tuple[dict[str, Column], Any]:
        """Columns and numbers of the rows, counted from 1. Raises InputError for an infinite number."""
        columns = {
            name: self._column(name, kind, array)
            for name, kind, array in zip(self.columns.names, self.columns.kinds, batch.columns, strict=True)
        }
        lines = np.arange(row_count + 1, row_count + 1 + batch.num_rows)
        if not self.skip:
            refuse_infinite(columns, lines, self.source)
            return columns, lines
        finite = np.ones(len(lines), dtype=bool)
        for column in columns.values():
            finite &= True if isinstance(column, tuple) else ~np.isinf(column)
        if finite.all():
            return columns, lines
        self.skipped += lines[~finite].tolist()
        return {name: _where(column, finite) for name, column in columns.items()}, lines[finite]

    def _column(self, name: str, kind: str, array: Any) -> Column:
        if hasattr(array, "dictionary"):
            array.validate(full=True)  # a broken file may point beyond its dictionary; nothing else checks that
        if kind == WORDS:
            column = _words(array, name in self.words)
            if isinstance(column, tuple):
                self.words.add(name)
            return column
        if hasattr(array, "dictionary_decode"):
            array = array.dictionary_decode()
        blank = missing_of(array)
        if kind in (MOMENT, DURATION, DAY):
            return np.where(blank, np.nan, _seconds(array))
        if str(array.type) in ("int64", "uint64") and not _is_exact(_whole(array)).all():
            self.rounded.add(name)
        if kind == TRUTH:
            array = array.cast("int8")
        return np.where(blank, np.nan, numbers_of(array.cast("float64", safe=False)))


def _whole(array: Any) -> Any:
    """Whole numbers, 0 where missing."""
    return np.where(missing_of(array), np.array(0, dtype=str(array.type)), numbers_of(array))


def missing_of(array: Any) -> Any:
    return numbers_of(array.is_null().cast("uint8")) == 1


def numbers_of(array: Any) -> Any:
    """Numbers as they lie in memory, any where one is missing. `to_numpy` imports pandas where it is installed."""
    start, stop = array.offset, array.offset + len(array)
    return np.frombuffer(array.buffers()[1], dtype=str(array.type).replace("double", "float64"))[start:stop]


def _is_exact(integers: Any) -> Any:
    return (
        (integers <= EXACT_WHOLE) & (integers >= -EXACT_WHOLE)
        if integers.dtype.kind == "i"
        else integers <= EXACT_WHOLE
    )


def _seconds(array: Any) -> FloatArray:
    """Seconds of moments, durations, times and days, as near as a float can be."""
    kind = str(array.type)
    if kind.startswith("date32"):
        return _whole(array.cast("int32")).astype(float) * 86400.0
    ticks = 1000 if kind.startswith("date64") else _TICKS[array.type.unit]
    values = _whole(array.cast("int32").cast("int64") if kind.startswith("time32") else array.cast("int64"))
    # Beyond 2^53 a division would round twice: whole seconds and the rest apart.
    return np.where(_is_exact(values), values / ticks, values // ticks + (values % ticks) / ticks)


def _words(array: Any, before: bool) -> Column:
    """Words, or the numbers that are all they hold, as in a CSV file; words where an earlier block held some."""
    if hasattr(array, "dictionary"):
        vocabulary = [word or "" for word in array.dictionary.to_pylist()]
        cells = ["" if k is None else vocabulary[k] for k in array.indices.to_pylist()]
    else:
        cells = [word or "" for word in array.to_pylist()]
    return tuple(cells) if before else column_of([cell.strip() for cell in cells])


def _where(column: Column, keep: Any) -> Column:
    if isinstance(column, tuple):
        return tuple(cell for cell, is_kept in zip(column, keep, strict=True) if is_kept)
    return column[keep]
