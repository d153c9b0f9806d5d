"""What no reader takes is recognised by its content and refused by name, whatever the file is called.

Rows of BAD_INPUTS that concern tables, and where their tests stand:
 1 here and test_table.py; 2, 3, 5-13, 15, 16 test_table.py; 35, 36, 37 test_parquet.py and here;
 36, 40 test_tables.py, test_parquet.py (RLIMIT_AS, bombs); 41 test_run_file.py, tests/cli/test_process.py.
"""

import gzip
import io
import lzma
import os
import pickle
import sqlite3
import zipfile

import numpy as np
import pytest
import scipy.io

from omnidyn.errors import InputError
from omnidyn.files import read_text
from omnidyn.logs.command_file import read_commands
from omnidyn.logs.read_log import read_log
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.run_file import read_run
from omnidyn.logs.steady_table import read_steady_table

TABLE = {"t": np.arange(3.0), "u": [1, 2, 3]}


def saved(save, *arguments):
    stream = io.BytesIO()
    save(stream, *arguments)
    return stream.getvalue()


def zipped(name, content=b"t,u\n0,1\n"):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, content)
    return stream.getvalue()


def database(folder):
    with sqlite3.connect(folder / "bag.db3") as connection:
        connection.execute("create table messages(id integer)")
    connection.close()
    return (folder / "bag.db3").read_bytes()


FORMATS = {
    "npy": (saved(np.save, TABLE["t"]), r"a NumPy \.npy file; .*numpy\.savetxt"),
    "npz": (saved(lambda stream: np.savez(stream, **TABLE)), r"NumPy arrays \(\.npz\); .*numpy\.savetxt"),
    "npz, compressed": (saved(lambda stream: np.savez_compressed(stream, **TABLE)), r"NumPy arrays \(\.npz\)"),
    "zip": (zipped("log.csv"), r"a zip archive; .*unpack it first"),
    "xlsx": (zipped("[Content_Types].xml"), r"an Excel workbook \(\.xlsx\); .*save the sheet as CSV"),
    "xlsx of openpyxl": (zipped("xl/workbook.xml"), r"an Excel workbook"),
    "gzip": (gzip.compress(b"t,u\n0,1\n"), r"a gzip archive; .*gunzip"),
    "xz": (lzma.compress(b"t,u\n0,1\n"), r"an xz archive"),
    "mat": (saved(scipy.io.savemat, {"name": "robot"}), r"no columns of numbers; got no variables; .*save\('log"),
    "mat 7.3": (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n",
        "the MATLAB file is damaged or cut short",
    ),
    "h5": (b"\x89HDF\r\n\x1a\n\x00", "the MATLAB file is damaged or cut short; .*copy it again"),
    "mcap": (b"\x89MCAP0\r\n\x01", "the recording is damaged or cut short; got it ends .*copy it again"),
    "bag": (b"#ROSBAG V2.0\n", "no topic holds numbers that can be read; got no messages"),
    "bag of an old version": (b"#ROSBAG V1.2\n", r"damaged or cut short; got it is not a bag of version 2\.0"),
    "wpilog": (b"WPILOG\x00\x01", "the data log is damaged or cut short; .*copy it again"),
    "ulog": (b"ULog\x01\x125\x01", "a PX4 ULog file"),
    "xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", r"an old Excel \(\.xls\)"),
    "feather": (b"ARROW1\x00\x00", "an Arrow"),
    "json": (b'{"t": [0, 1]}', "this is not a table; got a JSON file"),
    "json lines": (b'\n{"t": 0, "u": 1}\n{"t": 1, "u": 2}\n', "a JSON file"),
    "html": (b"<!DOCTYPE html>\n<html>", "an XML or HTML page"),
    "pdf": (b"%PDF-1.7\n", "a PDF file"),
}
FORMATS |= {
    f"pickle {protocol} of a {type(value).__name__}": (pickle.dumps(value, protocol), "a Python pickle; .*never opened")
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1)
    for value in (TABLE, [1.5, 2.5], np.arange(3.0), (1, 2))
}
NAMES = ["log.csv", "log.parquet", "log"]


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("name", NAMES)
def test_a_format_is_refused_by_name(tmp_path, kind, name):  # 37
    content, words = FORMATS[kind]
    path = tmp_path / name
    path.write_bytes(content)
    for read in (read_table, read_log, read_run, lambda path: list(iter_tables(path))):
        with pytest.raises(InputError, match=words) as seen:
            read(path)
        assert str(seen.value).startswith(str(path))


def test_a_bag_of_ros_2_is_refused_by_name(tmp_path):
    path = tmp_path / "bag.csv"
    path.write_bytes(database(tmp_path))
    with pytest.raises(InputError, match=r"an SQLite database that is not a ROS 2 bag; got messages"):
        read_table(path)


@pytest.mark.parametrize(
    "text", ["ctime,value\nx,1\n", "(a),b\n0,1\n", "Value\np\n", "PK,t\n0,1\n", "[t],u\n0,1\n", "{t},u\n0,1\n"]
)
def test_text_that_begins_like_another_format_is_text(tmp_path, text):
    (tmp_path / "log.csv").write_text(text)
    assert len(read_table(tmp_path / "log.csv")) == 1


def test_a_robot_file_is_told_the_same(tmp_path):
    (tmp_path / "robot.toml").write_bytes(FORMATS["zip"][0])
    with pytest.raises(InputError, match=r"robot\.toml: this is not a text file; got a zip archive"):
        read_text(tmp_path / "robot.toml")


READERS = [
    read_table,
    read_log,
    read_run,
    read_steady_table,
    lambda path: read_commands(path, 3),
    lambda p: list(iter_tables(p)),
]


@pytest.mark.parametrize("read", READERS)
def test_what_is_no_file_is_refused_by_every_reader(tmp_path, read):  # 1, 2
    (tmp_path / "empty.csv").touch()
    with pytest.raises(InputError, match=r"empty\.csv: the file is empty; got 0 bytes"):
        read(tmp_path / "empty.csv")
    with pytest.raises(InputError, match=r"nothing\.csv: no such file; check the spelling"):
        read(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match=r"a=ticks/1440: no such file; .*write the option before it too"):
        read("a=ticks/1440")
    with pytest.raises(InputError, match="cannot read it; got a folder"):
        read(tmp_path)
    with pytest.raises(InputError, match="cannot open it; got embedded null byte"):
        read("a\0b.csv")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
@pytest.mark.parametrize("read", READERS)
def test_a_pipe_is_refused_by_every_reader(tmp_path, read):  # 1
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="a pipe or a device"):
        read(tmp_path / "pipe.csv")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may read anything")
def test_a_file_one_may_not_read_is_refused(tmp_path):  # 1
    (tmp_path / "log.csv").write_text("t,u\n0,1\n")
    (tmp_path / "log.csv").chmod(0)
    with pytest.raises(InputError, match="cannot read it; got Permission denied"):
        read_table(tmp_path / "log.csv")
