"""Parquet files: what becomes of each kind of column, and what is refused. Numbers: rows of BAD_INPUTS."""

import datetime
import decimal
import subprocess
import sys

import numpy as np
import pytest

from omnidyn.errors import InputError, MissingExtraError
from omnidyn.logs.readers.parquet import parquet_bytes
from omnidyn.logs.readers.read_table import iter_tables, read_table

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


@pytest.fixture
def write(tmp_path):
    def to_file(columns, name="log.parquet", schema=None, **options):
        path = tmp_path / name
        table = columns if isinstance(columns, pa.Table) else pa.table(columns, schema=schema)
        parquet.write_table(table, path, **options)
        return path

    return to_file


def column(path, name="v"):
    return read_table(path).numbers(name, missing=True).tolist()


UTC = datetime.UTC
MOMENT = datetime.datetime(2026, 3, 1, 12, 0, 0, 250000, tzinfo=UTC)


@pytest.mark.parametrize(
    "array, expected",
    [
        (pa.array([1.5, None, -0.0]), [1.5, np.nan, -0.0]),
        (pa.array([1.5, 0.1], pa.float32()), [1.5, float(np.float32(0.1))]),
        (pa.array(np.array([1.5], np.float16)), [1.5]),
        (pa.array([1, None, -3], pa.int16()), [1.0, np.nan, -3.0]),
        (pa.array([2**64 - 1], pa.uint64()), [2.0**64]),
        (pa.array([True, None, False]), [1.0, np.nan, 0.0]),
        (pa.array([decimal.Decimal("1.25")]), [1.25]),
        (pa.nulls(2), [np.nan, np.nan]),
        (pa.array([1.5, 2.5, 1.5]).dictionary_encode(), [1.5, 2.5, 1.5]),
        (pa.array([MOMENT, None]), [MOMENT.timestamp(), np.nan]),
        (pa.array([1_700_000_000_123_456_789], pa.timestamp("ns")), [1_700_000_000.1234568]),
        (pa.array([-1], pa.timestamp("ms")), [-0.001]),
        (pa.array([1500, None], pa.duration("ms")), [1.5, np.nan]),
        (pa.array([1500], pa.time32("ms")), [1.5]),
        (pa.array([1500], pa.time64("us")), [0.0015]),
        (pa.array([datetime.date(1970, 1, 3)]), [2 * 86400.0]),
        (pa.array(["1.5", "", "nan", None]), [1.5, np.nan, np.nan, np.nan]),
    ],
)
def test_every_kind_of_column(write, array, expected):
    assert np.array_equal(column(write({"v": array})), expected, equal_nan=True)


def test_words_are_words(write):
    path = write({"axis": ["x", "yaw", None], "mode": pa.array(["a", "b", "a"]).dictionary_encode()})
    table = read_table(path)
    assert table.text("axis") == ("x", "yaw", "")
    assert table.text("mode") == ("a", "b", "a")


def test_units_come_from_metadata_brackets_and_kinds(write):
    fields = [
        pa.field("w1", pa.float64(), metadata={"unit": "rpm", "title": "Wheel 1"}),
        pa.field("u1 [V]", pa.float64()),
        pa.field("t", pa.timestamp("us")),
    ]
    table = read_table(write({"w1": [1.0], "u1 [V]": [2.0], "t": [0]}, schema=pa.schema(fields)))
    assert table.names == ("w1", "u1", "t")
    assert dict(table.units) == {"w1": "rpm", "u1": "V", "t": "s"}
    assert dict(table.titles) == {"w1": "Wheel 1"}
    assert table.notes == ("t: moments were read as seconds since 1970 (UTC)",)


def test_rounded_whole_numbers_are_noted(write):
    assert read_table(write({"n": [2**53 + 1]})).notes == ("n: whole numbers beyond 2^53 were rounded",)


def test_rows_are_counted_from_1_and_the_hash_is_that_of_the_file(write):
    import hashlib

    path = write({"v": [1.0, 2.0]})
    table = read_table(path)
    assert table.lines.tolist() == [1, 2]
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_name_does_not_matter_and_is_noted(write, tmp_path):  # 37
    assert read_table(write({"v": [1.0]}, "log.csv")).notes == ("the file holds Parquet, though its name ends in .csv",)
    (tmp_path / "text.parquet").write_text("t,u\n0,1\n")
    assert read_table(tmp_path / "text.parquet").notes == ("the file holds text, though its name ends in .parquet",)


@pytest.mark.parametrize("rows, group", [(1, 2), (3, 2), (7, 100), (1000, 4)])
def test_pieces_joined_are_the_whole(write, rows, group):
    values = np.random.default_rng(0).normal(size=20)
    path = write({"v": values, "word": [f"w{k}" for k in range(20)]}, row_group_size=group)
    pieces = list(iter_tables(path, rows))
    assert all(len(piece) <= rows for piece in pieces)
    assert np.concatenate([piece.numbers("v") for piece in pieces]).tolist() == values.tolist()
    assert np.concatenate([piece.lines for piece in pieces]).tolist() == list(range(1, 21))
    assert sum((piece.text("word") for piece in pieces), ()) == tuple(f"w{k}" for k in range(20))
    assert pieces[-1].sha256 == read_table(path).sha256


@pytest.mark.parametrize(
    "columns, words",
    [
        (
            {"t": [0.0], "w": [[1.0, 2.0]]},
            r"log\.parquet: a column that hold.*; got w \(list<.*; write each component as a column of its own",
        ),
        ({"pose": [{"x": 1.0}]}, r"got pose \(struct<x: double>\)"),
        ({"raw": [b"12"]}, r"got raw \(binary\)"),
        ({"v": [1.0, np.inf]}, r"log\.parquet:2, column v: not a finite number"),  # 15
        ({"v": pa.array([], pa.float64())}, r"log\.parquet: no rows; got 0 samples"),  # 3
        (pa.Table.from_arrays([pa.array([1.0])] * 2, names=["v", "v"]), "two columns have the same name; got v"),
        (pa.Table.from_arrays([pa.array([1.0])], names=[" "]), "column 1 has no name"),
        ({f"c{k}": [1.0] for k in range(1001)}, "too many columns; got 1001"),
    ],
)
def test_it_refuses_by_name(write, columns, words):
    with pytest.raises(InputError, match=words):
        read_table(write(columns))


def test_infinite_rows_can_be_left_out(write):
    table = read_table(write({"v": [1.0, -np.inf, 3.0], "word": ["a", "b", "c"]}), skip_bad_rows=True)
    assert table.numbers("v").tolist() == [1.0, 3.0]
    assert table.text("word") == ("a", "c")
    assert table.notes == ("1 row was left out for an infinite number (line 2)",)


@pytest.mark.parametrize("keep", [4, 5, 100, -1, -9])
def test_a_truncated_file_is_refused(write, keep):  # 35
    path = write({"v": np.arange(1000.0)})
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match=r"log\.parquet: the Parquet file is damaged or cut short; .*copy or write it"):
        read_table(path)


def test_damage_inside_is_refused_and_nothing_else_leaves(write):
    path = write({"v": np.random.default_rng(0).normal(size=5000)}, compression="zstd", write_page_checksum=True)
    content = bytearray(path.read_bytes())
    content[200:2000] = bytes(1800)
    path.write_bytes(content)
    with pytest.raises(InputError, match="damaged or cut short"):
        list(iter_tables(path))


def test_without_pyarrow_it_says_what_to_install(write, monkeypatch):
    path = write({"v": [1.0]})
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(
        MissingExtraError, match=r'log\.parquet: Parquet files need pyarrow; pip install "omnidyn\[logs\]"'
    ):
        read_table(path)


def test_max_bytes_counts_the_numbers(write):
    path = write({"v": np.zeros(100_000)})
    assert path.stat().st_size < 100_000
    with pytest.raises(InputError, match=r"the file is too large; .*iter_tables"):
        read_table(path, max_bytes=100_000)
    assert sum(map(len, iter_tables(path, 1000))) == 100_000


BOMB_READER = """
import resource, sys
import pyarrow.parquet
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import iter_tables, read_table
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for read in (read_table, lambda path: list(iter_tables(path))):
    try:
        read(sys.argv[1])
    except InputError as error:
        print(error)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs getrusage")
@pytest.mark.parametrize("words", [False, True])
def test_a_bomb_is_refused_before_memory_grows(tmp_path, words):  # 36
    """800 MB of zeros, or 40 GB of one long word, in a small file."""
    path = tmp_path / "bomb.parquet"
    word = pa.DictionaryArray.from_arrays(pa.array(np.zeros(10**6, np.int32)), ["x" * 40_000])
    group = pa.table({"v": word if words else np.zeros(10**7)})
    schema = group.schema
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        for _ in range(1 if words else 10):
            writer.write_table(group)
    assert path.stat().st_size < 2_000_000
    run = subprocess.run([sys.executable, "-c", BOMB_READER, str(path)], capture_output=True, text=True, check=True)
    *errors, grown = run.stdout.splitlines()
    if not words:  # the words stay one word, and a million indices
        assert len(errors) == 2
        assert all("bomb.parquet: the file would grow too much; got 800000000 bytes from" in error for error in errors)
    assert int(grown) * (1 if sys.platform == "darwin" else 1024) < 200e6


def test_bytes_of_columns_hold_every_bit():
    values = np.random.default_rng(3).normal(size=100) * 10.0 ** np.arange(-50, 50)
    back = parquet.read_table(pa.BufferReader(parquet_bytes({"v": values}, {"v": "m"})))
    assert back["v"].to_pylist() == values.tolist()


def test_an_index_beyond_its_dictionary_is_refused(write):
    """Indices 0, 1, 2 of two bits each, made 3 where the dictionary has three words."""
    path = write({"word": ["a", "b", "c"] * 40}, compression="none")
    content = path.read_bytes()
    packed = b"\x24\x49\x92" * 4
    assert content.count(packed) >= 1
    path.write_bytes(content.replace(packed, b"\xff" * len(packed)))
    with pytest.raises(InputError, match=r"damaged or cut short; got .*out of bounds"):
        read_table(path)
