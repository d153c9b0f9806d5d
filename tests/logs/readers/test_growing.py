"""Files that grow while they are read: what they held when they were opened is read, and that they grew is said."""

import hashlib
import os
import shutil
import sqlite3

import pytest

from benchmarks.logs.fuzz_readers import READERS
from omnidyn import read_log
from omnidyn.logs.info import read_info
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.run_file import write_run
from omnidyn.run import Run
from tests.support.codes import said


def write_text(folder):
    path = folder / "log.csv"
    path.write_text("t_s,w1_rad_s\n" + "".join(f"{k / 100},{k}\n" for k in range(50)))
    return path, b"0.5,50\n0.51,5"


def write_wpilog(folder):
    path = folder / "log.wpilog"
    path.write_bytes(content := READERS["read_log, wpilog"][0]()[0])
    return path, content[-40:]


def write_mcap(folder):
    pytest.importorskip("mcap")
    path = folder / "log.mcap"
    t = [k / 100 for k in range(20)]
    write_run(Run(t=t, wheel_speed=[[k, k, k] for k in t]), path)
    return path, b"\x05" * 400


def write_parquet(folder):
    pytest.importorskip("pyarrow")
    path = folder / "log.parquet"
    t = [k / 100 for k in range(20)]
    write_run(Run(t=t, wheel_speed=[[k, k, k] for k in t]), path)
    return path, b"\x05" * 400


def write_bag(folder):
    pytest.importorskip("rosbags")
    from tests.support.bags import BagMaker, drive, write_ros1

    return write_ros1(drive(BagMaker(ros1=True), 0.2), folder / "log.bag"), b"\x05" * 40


@pytest.mark.parametrize("write", [write_text, write_wpilog, write_mcap, write_parquet, write_bag])
def test_what_it_held_at_first_is_read(tmp_path, write):
    path, more = write(tmp_path)
    before = path.read_bytes()
    quiet = read_table(path)

    def writer(report):
        with open(path, "ab") as stream:
            stream.write(more)

    grown = read_table(path, progress=writer)
    assert len(path.read_bytes()) > len(before)
    assert {name: list(map(repr, column)) for name, column in grown.columns.items()} == {
        name: list(map(repr, column)) for name, column in quiet.columns.items()
    }
    assert grown.sha256 == hashlib.sha256(before).hexdigest()
    assert any("grew while it was read" in note for note in said(grown.notes)), grown.notes
    assert not any("grew" in note for note in said(quiet.notes))


def test_messages_in_the_journal_of_a_recorder_are_said_to_be_missing(tmp_path):
    pytest.importorskip("rosbags")
    from tests.support.bags import BagMaker, drive, write_ros2

    folder = write_ros2(drive(BagMaker(), 0.2), tmp_path / "bag")
    path = next(folder.glob("*.db3"))
    whole = len(read_log(path))
    recorder = sqlite3.connect(path)
    recorder.execute("pragma journal_mode = wal")
    recorder.execute(
        "insert into messages (topic_id, timestamp, data) select topic_id, timestamp + 1000000000, data from messages"
    )
    recorder.commit()
    copy = tmp_path / "copy.db3"
    shutil.copy(path, copy)
    shutil.copy(f"{path}-wal", f"{copy}-wal")
    recorder.close()
    assert os.path.getsize(f"{copy}-wal") > 0
    assert len(read_log(copy)) == whole
    assert any("ends in -wal" in str(note) for note in read_info(copy).notes)
