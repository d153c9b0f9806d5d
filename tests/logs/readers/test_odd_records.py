"""One implausible record costs itself, not the rest of a sound file."""

import sqlite3
import struct

import numpy as np
import pytest

from omnidyn import read_log
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.readers.wpilog import read_wpilog
from tests.support.cases import case
from tests.support.codes import said
from tests.support.data_logs import data_log, record, start

ROWS = 400


def motor_log(path, odd=b"", kind="double", pack="<d"):
    """Volts and speed of a motor, with odd records after the 50th row."""
    records = [
        start(1, "/motor1/voltage_V", kind),
        start(2, "/motor1/velocity_rad_s", kind),
        start(3, "/mode", "string"),
    ]
    for k in range(ROWS):
        records += [odd] * (k == 50)
        records += [record(n, 1_000_000 + 20_000 * k, struct.pack(pack, n * (k % 9))) for n in (1, 2)]
    path.write_bytes(data_log(*records))
    return path


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        (record(3, -428_585_087, b"auto"), "1 record was left out: a value of /mode at -428.585 s"),
        (record(1, -5, struct.pack("<d", 1.0)) * 3, "3 records were left out, the first: a value of /motor1"),
        (record(3, 2**62, b"auto"), "1 record was left out: a value of /mode at 4.61169e+12 s"),
        (record(1, 10**15, struct.pack("<d", 1.0)), "1 record was left out: a time of 1e+09 s in /motor1"),
        (record(9, 1_500_000, b"12345678"), "1 record was left out: a value of entry 9, which is nowhere started"),
        (record(0, 0, b"\x07" + bytes(8)), "1 record was left out: a control record of kind 7"),
        (record(0, 0, b"\0"), "1 record was left out: a control record that is too short"),
        (start(4, "/later", "foo") + record(4, 1_500_000, b"??"), ""),
    ],
    ids=["negative", "negative numbers", "late", "absurd", "stray", "kind", "short", "type"],
)
def test_an_odd_record_of_a_data_log_costs_itself(tmp_path, odd, words):
    path = motor_log(tmp_path / "odd.wpilog", odd)
    run = read_log(path)
    assert len(run) == ROWS
    np.testing.assert_allclose(run.t, 1.0 + 0.02 * np.arange(ROWS))
    np.testing.assert_array_equal(run.voltage[:, 0], np.arange(ROWS) % 9)
    assert not words or any(words in note for note in said(run.warnings))
    assert not any("damaged" in note for note in said(run.warnings))


def test_many_strays_in_a_row_are_damage(tmp_path):
    path = motor_log(tmp_path / "bad.wpilog", record(9, 1_500_000, b"1") * 50)
    recording = read_wpilog(path, ReadOptions())
    assert recording.salvaged == 100
    assert any("the file is damaged: a value of entry 9" in note for note in said(recording.notes))


@pytest.mark.parametrize(("kind", "pack"), [("int64", "<q"), ("int", "<q")])
def test_the_old_name_of_whole_numbers_is_read(tmp_path, kind, pack):
    run = read_log(motor_log(tmp_path / "int.wpilog", kind=kind, pack=pack))
    np.testing.assert_array_equal(run.wheel_speed[:, 0], 2.0 * (np.arange(ROWS) % 9))


def test_the_old_name_of_arrays_is_read(tmp_path):
    values = [record(1, 20_000 * k, struct.pack("<qq", k, -k)) for k in range(50)]
    (tmp_path / "a.wpilog").write_bytes(data_log(start(1, "/enc", "int[]"), *values))
    table = read_table(tmp_path / "a.wpilog")
    np.testing.assert_array_equal(table.numbers("/enc[1]"), -np.arange(50.0))


def test_the_cases_of_data_logs():
    run = read_log(case("logs/wpilog_negative_stamp/negative.wpilog"))
    assert int(np.isfinite(run.wheel_speed).sum()) == 3000
    assert any(
        "1 record was left out: a value of NT:/SmartDashboard/Auto/selected" in note for note in said(run.warnings)
    )
    table = read_table(case("logs/wpilog_int/int.wpilog"))
    assert int(np.isfinite(table.numbers("NT:/motor1/position_ticks", missing=True)).sum()) == 3000


def drive_in(tmp_path, form):
    pytest.importorskip("rosbags")
    pytest.importorskip("mcap")
    from tests.support.bags import BagMaker, drive, write_mcap, write_ros2

    if form == "mcap":
        return write_mcap(drive(BagMaker(), 2.0), tmp_path / "drive.mcap", "none")
    return next(write_ros2(drive(BagMaker(), 2.0), tmp_path / "bag").glob("*.db3"))


def test_an_odd_message_of_a_db3_costs_itself(tmp_path):
    path = drive_in(tmp_path, "db3")
    rows = len(read_table(path))
    with sqlite3.connect(path) as db:
        db.execute("insert into messages (topic_id, timestamp, data) values (99, 1, x'00')")
        db.execute("insert into messages (topic_id, timestamp, data) values (1, 'noon', x'00')")
    table = read_table(path)
    assert len(table) == rows
    assert any("2 records were left out, the first: a message of topic 99" in note for note in said(table.notes))


@pytest.mark.parametrize("where", ["receive", "channel"])
def test_an_odd_message_of_an_mcap_costs_itself(tmp_path, where):
    """A record of its own between two chunks: of a channel that is nowhere told, or at a time before 1970."""
    path = drive_in(tmp_path, "mcap")
    rows = len(read_table(path))
    content = path.read_bytes()
    at = content.rindex(bytes([15]) + struct.pack("<Q", 4))  # the end of the data
    head = struct.pack("<HIQQ", 1 if where == "receive" else 999, 0, 2**64 - 5 if where == "receive" else 5, 0)
    odd = bytes([5]) + struct.pack("<Q", len(head) + 4) + head + bytes(4)
    path.write_bytes(content[:at] + odd + content[at:])
    table = read_table(path)
    assert len(table) == rows
    assert any("1 record was left out: a message of" in note for note in said(table.notes))


def test_a_single_row_of_a_parquet_far_from_all_others_is_left_out(tmp_path):
    pq = pytest.importorskip("pyarrow.parquet")
    pa = pytest.importorskip("pyarrow")
    t = np.arange(200) * 0.01
    t[77] = -9e9
    pq.write_table(pa.table({"t_s": t, "w1_rad_s": np.arange(200.0)}), tmp_path / "log.parquet")
    run = read_log(tmp_path / "log.parquet")
    assert len(run) == 199
    assert any("1 row has a time far from all others" in note for note in said(run.warnings))


def test_a_file_of_odd_records_alone_is_refused(tmp_path):
    (tmp_path / "a.wpilog").write_bytes(data_log(start(1, "/u", "double"), record(1, -5, bytes(8))))
    with pytest.raises(InputError, match="damaged or cut short; got a value of /u at -5e-06 s"):
        read_table(tmp_path / "a.wpilog")
