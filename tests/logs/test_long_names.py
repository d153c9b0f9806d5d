"""Names of any length are read in linear time, and cost themselves alone; texts from users make no reader slow."""

import contextlib
import math
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
from omnidyn.logs.readers import text
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.readers.ros.layout import parse_definition
from omnidyn.logs.readers.wpilog import leaves_of
from omnidyn.logs.run_file import write_run
from omnidyn.logs.table import dialect
from omnidyn.model.keys import Key
from omnidyn.run import Run
from omnidyn.units import known_unit

LENGTH = 200_000
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
    "spaces": text.cells,
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
    """0.5 s of the processor for 200 kB, the best of three where the machine is busy; a quadratic one takes minutes."""
    for piece in PIECES:
        took = math.inf
        for last in "abc":  # no answer is remembered
            text, begun = piece * (LENGTH // len(piece)) + "!" + last, time.process_time()
            with contextlib.suppress(OmnidynError, ValueError):
                READERS[reader](text)
            took = min(took, time.process_time() - begun)
            if took < 0.5:
                break
        assert took < 0.5, piece


def test_a_struct_of_nothing_has_no_billion_elements():
    begun = time.process_time()
    with pytest.raises(ValueError, match="array"):
        leaves_of("a", {"a": "b x[999999999]", "b": ""})
    with pytest.raises(ValueError, match="array"):
        leaves_of("a", {"a": f"double x[{'9' * 5000}]"})
    assert time.process_time() - begun < 0.5


def test_a_long_name_costs_itself_alone(tmp_path):
    """Every record with such a name is left out, with a note; the others are read."""
    path = tmp_path / "log.wpilog"
    names = ["/motor1/velocity_rad_s", "a" * LENGTH, "/motor2/velocity_rad_s", "/motor3/velocity_rad_s"]
    path.write_bytes(wpilog(names, 100))
    read_table(path)
    begun = time.process_time()
    table = read_table(path)
    assert time.process_time() - begun < 0.5
    assert table.names == ("t_s", names[0], names[2], names[3])
    assert f"a name of {LENGTH} characters, more than 1000: its columns are left out" in " ".join(table.notes)


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
