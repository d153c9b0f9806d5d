"""Names of any length are read in linear time, and cost themselves alone; texts from users make no reader slow."""

import contextlib
import struct
import time

import numpy as np
import pytest

from omnidyn.comparison.threshold import parse_threshold
from omnidyn.errors import OmnidynError
from omnidyn.files import file_format, parse_toml, text_format
from omnidyn.interop.robot_json import robot_of_json
from omnidyn.logs.columns.mapping import parse_column
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.read_log import read_log
from omnidyn.logs.readers import spaced_text
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.readers.ros.definitions import parse_definition
from omnidyn.logs.readers.wpilib_structs import leaves_of
from omnidyn.logs.run_file import write_run
from omnidyn.logs.table import dialect
from omnidyn.logs.table.dialect import MAX_NAME
from omnidyn.model.keys import Key
from omnidyn.run import Run
from omnidyn.units import known_unit
from tests.support.growth import LINEAR, growth, ratio

LENGTH = 100_000
PIECES = [
    "a",
    "0",
    "_",
    '"',
    " ",
    "=",
    "[",
    "{",
    ".",
    "-",
    "(",
    "a0",
    "a_",
    "1.",
    '"a',
    "a ",
    "\\",
    "\n",
    "{}",
    "[a",
    "(a",
    ":",
    "aA",
    "/",
    "a:",
    "@",
    "e1",
    "0,",
    ",",
    ';"',
    "[[",
    "<",
    "per ",
    "_per",
    "a b\n",
    "a=",
    "\t",
    "~1",
    "#",
    "nan(",
    "inf",
]
READERS = {
    "name": read_name,
    "unit": known_unit,
    "brackets": dialect.split_unit,
    "cell": dialect.looks_like_number,
    "row": dialect.looks_like_data,
    "spaces": spaced_text.cells,
    "threshold": parse_threshold,
    "key": Key.parse,
    "column": lambda text: parse_column(f"u1={text}"),
    "toml": lambda text: parse_toml(text, "x"),
    "toml key": lambda text: parse_toml(f"a = {text}", "x"),
    "json": robot_of_json,
    "definition": lambda text: parse_definition("a/b", text),
    "struct": lambda text: leaves_of("a", {"a": text}),
    "format": lambda text: (file_format(text.encode()), text_format(text.encode())),
}


@pytest.mark.parametrize("reader", READERS)
def test_no_reader_of_text_is_slow(reader):
    """Of a text that is 4 times as long it takes 4 times as long, within MAX_NAME and beyond; a quadratic one, 16."""
    for piece in PIECES:

        def read(size, number, piece=piece):
            with contextlib.suppress(OmnidynError, ValueError):
                READERS[reader](piece * (size // len(piece)) + f"!{number}")

        for size in (MAX_NAME, LENGTH):
            assert growth(read, size) <= LINEAR, (piece, size)


def test_a_struct_of_nothing_has_no_billion_elements():
    """Nor a few million: it is refused in the time of fewer."""

    def refused(size, number):
        with pytest.raises(ValueError, match="array"):
            leaves_of("a", {"a": f"b x[{size}]", "b": ""})

    assert growth(refused, 8_000_000, enough=10.0, factor=100) <= 10.0
    refused(999_999_999, 0)
    with pytest.raises(ValueError, match="array"):
        leaves_of("a", {"a": f"double x[{'9' * 5000}]"})


def test_a_long_name_costs_itself_alone(tmp_path):
    """Every record with such a name is left out, with a note; the others are read. Not once more for each record."""

    def log(length):
        path = tmp_path / f"{length}.wpilog"
        names = ["/motor1/velocity_rad_s", "a" * length, "/motor2/velocity_rad_s", "/motor3/velocity_rad_s"]
        path.write_bytes(wpilog(names, 1600))
        return path

    short, long = log(10), log(10 * LENGTH)
    assert ratio(lambda: read_table(short), lambda: read_table(long), enough=4.0) <= 4.0
    table = read_table(long)
    assert table.names == ("t_s", *(f"/motor{k}/velocity_rad_s" for k in (1, 2, 3)))
    assert f"a name of {10 * LENGTH} characters, more than 1000: its columns are left out" in " ".join(table.notes)


def wpilog(names, rows):
    """A WPILib log of numbers, one record of each name at each time."""

    def record(entry, stamp, data):
        return bytes([3 | (3 << 2) | (7 << 4)]) + struct.pack("<IIQ", entry, len(data), stamp) + data

    def text(words):
        return struct.pack("<I", len(words)) + words.encode()

    out = b"WPILOG" + struct.pack("<HI", 0x100, 0)
    for k, name in enumerate(names, 1):
        out += record(0, 0, b"\0" + struct.pack("<I", k) + text(name) + text("double") + text(""))
    for row in range(rows):
        for k in range(1, len(names) + 1):
            out += record(k, 10_000 * row, struct.pack("<d", np.sin(0.1 * row + k)))
    return out


def test_a_mat_file_is_the_same_bytes_at_any_time(tmp_path, monkeypatch):
    from scipy.io import loadmat

    run = Run(t=np.arange(5) / 10, voltage=np.ones((5, 3)))
    first = write_run(run, tmp_path / "a.mat").read_bytes()
    monkeypatch.setattr(time, "asctime", lambda *at: "another day")
    monkeypatch.setattr(time, "time", lambda: 1.0)
    assert write_run(run, tmp_path / "b.mat").read_bytes() == first
    assert first[:116] == b"MATLAB 5.0 MAT-file, written by omnidyn".ljust(116)
    assert loadmat(tmp_path / "a.mat")["t_s"].ravel().tolist() == run.t.tolist()
    np.testing.assert_array_equal(read_log(tmp_path / "a.mat").voltage, run.voltage)
