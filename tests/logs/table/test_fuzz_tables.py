"""Whatever the file holds, only an OmnidynError leaves the readers, and what they return is sound."""

import io
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from omnidyn.errors import OmnidynError
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.command_file import read_commands
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.run_file import read_run
from omnidyn.logs.steady_table import read_steady_table
from omnidyn.model.robot_file import load_robot

STEADY = (
    b"axis,speed,force,force_std\nx,0,2.25,0.1\nx,0.37,2.48,0.1\nx,-0.74,-2.79,0.1\nx,1.08,3.28,0.2\nyaw,5,0.1,0.01\n"
)
VOLTAGE = b"t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.5,0,0,0\n1.5,1,1,1\n"
PIECES = [
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r",
    b'"',
    b"#",
    b"nan",
    b"inf",
    b"1e400",
    b"-",
    b"0",
    b"1e308",
    b"1e-320",
    b"1,5",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\x00",
    b"\xb5",
    b"x",
    b"yaw",
    b"_",
    b" ",
    b"\x85",
    b"\x0b",
    b"\xe2\x80\xa8",
]
ROBOT = load_robot("axebot")


def mutated(seed: bytes) -> st.SearchStrategy[bytes]:
    """The seed with a few pieces put in, cut out or replaced."""
    edit = st.tuples(st.integers(0, len(seed)), st.integers(0, 4), st.sampled_from([*PIECES, b""]))

    def apply(edits):
        content = seed
        for place, cut, piece in edits:
            content = content[:place] + piece + content[place + cut :]
        return content

    return st.lists(edit, min_size=1, max_size=6).map(apply)


def files(seed: bytes) -> st.SearchStrategy[bytes]:
    soup = st.lists(st.sampled_from(PIECES), max_size=40).map(b"".join)
    return st.one_of(mutated(seed), st.binary(max_size=200), soup)


@pytest.fixture(scope="module")
def path():
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder) / "fuzz.csv"


def outcome(call, *arguments):
    """(result, None) or (None, the OmnidynError); any other error is a failure of the test."""
    try:
        return call(*arguments), None
    except OmnidynError as error:
        return None, error


@settings(max_examples=400, deadline=None)
@given(content=files(STEADY))
@example(content=b"\xff\xfea")
@example(content=b"a\n\x0b\n")
def test_read_table(path, content):
    path.write_bytes(content)
    table, error = outcome(read_table, path)
    if error:
        assert "fuzz.csv" in str(error)
        return
    assert len(table) > 0
    assert set(table.columns) == set(table.names)
    for name in table.names:
        column = table.columns[name]
        assert len(column) == len(table)
        assert isinstance(column, tuple) or not np.isinf(column).any()
        values, error = outcome(table.numbers, name)
        assert error or np.isfinite(values).all()
        assert error is None or f"column {name}"[:20] in error.where


LOGGED = b"%made by hand\r\nTime;Speed;mode;\r\nms;rad/s;;\r\nt;w1;m;\r\n0;1,5;go;\r\n10;2,500;stop;\r\n\r\n20;;go;\r\n"


SPACED = b'# a log\r\n  t "w 1"\tstate [x]\r\n 0  1.5 go\r\n0.1\t2,5  "all well"\r\n 0.2 nan go\r\n\r\n0.3 4 go\r\n'


@settings(max_examples=600, deadline=None)
@given(
    content=st.one_of(files(LOGGED), files(SPACED)), rows=st.integers(1, 5), header=st.booleans(), skip=st.booleans()
)
def test_read_any_and_its_pieces(path, content, rows, header, skip):
    path.write_bytes(content)
    table, error = outcome(partial(read_table, path, header=header, skip_bad_rows=skip))
    pieces, refused = outcome(lambda: list(iter_tables(path, rows, header=header, skip_bad_rows=skip)))
    assert (error is None) == (refused is None)
    assert error is not None or sum(map(len, pieces)) == len(table)


@settings(max_examples=200, deadline=None)
@given(content=files(b"t_s,vx_m_s,vy_m_s,omega_rad_s\n0,1,2,3\n0.1,,nan,-0.5\n0.2,1e-3,5,6\n"))
def test_read_run(path, content):
    path.write_bytes(content)
    run, error = outcome(read_run, path)
    assert error or (len(run) > 0 and not np.isinf(run.t).any())


@pytest.fixture(scope="module")
def parquet_seed():
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    sink = io.BytesIO()
    columns = {"t_s": np.arange(20.0), "word": ["go", "stop"] * 10, "n": pa.array([None, 1] * 10)}
    parquet.write_table(pa.table(columns), sink, row_group_size=7)
    return sink.getvalue()


@settings(max_examples=400, deadline=None)
@given(edits=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=6), cut=st.floats(0, 1))
def test_read_any_of_parquet(path, parquet_seed, edits, cut):
    content = bytearray(parquet_seed)
    for place, byte in edits:
        content[min(int(place * len(content)), len(content) - 1)] = byte
    path.write_bytes(content[: max(4, int(cut * len(content)))] if cut < 0.2 else content)
    table, error = outcome(read_table, path)
    assert error or set(table.columns) == set(table.names)


@settings(max_examples=400, deadline=None)
@given(content=files(VOLTAGE), duration=st.none() | st.floats(1e-3, 1e3))
def test_read_commands(path, content, duration):
    path.write_bytes(content)
    try:
        held = read_commands(path, 3, duration)
    except OmnidynError:
        return
    assert held.voltage.shape == (len(held.dt), 3)
    assert np.isfinite(held.voltage).all()
    assert (held.dt > 0.0).all()


@settings(max_examples=400, deadline=None)
@given(content=files(STEADY), rest=st.sampled_from(["bound", "line", "ignore"]))
def test_read_steady_table_and_fit(path, content, rest):
    path.write_bytes(content)
    try:
        estimate = fit_steady_state(ROBOT, read_steady_table(path), rest_use=rest)
    except OmnidynError:
        return
    for name, value in estimate.value.items():
        low, high = estimate.ci95[name]
        assert low <= value <= high
        assert value >= 0.0
