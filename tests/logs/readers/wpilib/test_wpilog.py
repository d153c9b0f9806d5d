"""WPILib data logs, as robotpy writes and reads them; and cut at every byte."""

import math
import struct

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.read_log import read_log, recorded_log
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.readers.wpilog import read_wpilog

wpiutil = pytest.importorskip("wpiutil")
log_entries = pytest.importorskip("wpiutil.log")


def write(path, fill):
    """A log by robotpy's own writer."""
    writer = wpiutil.DataLogWriter(str(path))
    fill(writer)
    writer.flush()
    writer.stop()
    return path


def drive(writer, rows=40):
    """Wheels each 20 ms, volts when they change, an array of currents, a battery in float."""
    speeds = [log_entries.DoubleLogEntry(writer, f"/drive/wheel{k}/velocity_rad_s", "") for k in (1, 2, 3)]
    volts = [log_entries.DoubleLogEntry(writer, f"/drive/wheel{k}/voltage_V", "") for k in (1, 2, 3)]
    battery = log_entries.FloatLogEntry(writer, "/battery_V", "")
    amps = log_entries.DoubleArrayLogEntry(writer, "/drive/debug", "")
    mode = log_entries.StringLogEntry(writer, "/mode", "")
    enabled = log_entries.BooleanLogEntry(writer, "/enabled", "")
    count = log_entries.IntegerLogEntry(writer, "/loops", "")
    for k in range(rows):
        t = 1_000_000 + 20_000 * k
        for wheel, entry in enumerate(speeds):
            entry.append(math.sin(0.1 * k) + wheel, t)
        if k % 10 == 0:
            for wheel, entry in enumerate(volts):
                entry.append(0.1 * k - wheel, t + 3000)
            battery.append(12.5 - 0.01 * k, t + 5000)
            mode.append("auto" if k else "disabled", t)
            enabled.append(bool(k), t)
        amps.append([1.0 * k, 2.0] if k % 2 else [], t + 1000)
        count.append(k * 2**40, t)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("wpilog") / "a.wpilog", drive)


def oracle(path):
    """name -> list of (time [us], value), by robotpy's reader."""
    found, entries = {}, {}
    for record in log_entries.DataLogReader(str(path)):
        if record.isStart():
            start = record.getStartData()
            entries[start.entry] = start
        elif not record.isControl():
            start = entries[record.getEntry()]
            get = {
                "double": record.getDouble,
                "float": record.getFloat,
                "int64": record.getInteger,
                "boolean": record.getBoolean,
                "double[]": record.getDoubleArray,
                "string": record.getString,
            }[start.type]
            found.setdefault(start.name, []).append((record.getTimestamp(), get()))
    return found


def test_every_value_is_that_of_robotpy(path):
    table, theirs = read_table(path), oracle(path)
    t = table.numbers("t_s")
    for name, values in theirs.items():
        if isinstance(values[0][1], str):
            assert name not in table.names
            continue
        pairs = [(stamp, value) for stamp, value in values if not isinstance(value, list) or value]
        for place in range(2 if isinstance(pairs[0][1], list) else 1):
            column = table.numbers(f"{name}[{place}]" if isinstance(pairs[0][1], list) else name, missing=True)
            rows = np.flatnonzero(np.isfinite(column))
            told = [value[place] if isinstance(value, list) else float(value) for _, value in pairs]
            assert column[rows].tolist() == told
            assert t[rows].tolist() == [stamp / 1e6 for stamp, _ in pairs]


def test_what_is_written_on_change_is_held_where_it_is_a_command(path):
    run = read_log(path)
    assert np.isfinite(run.channels["voltage"][-1]).all()
    assert np.isfinite(run.channels["wheel_speed"]).all(axis=1).sum() == 40
    assert run.supply is not None


def test_topics_are_listed(path):
    topics = {topic.name: topic for topic in read_wpilog(path, ReadOptions()).topics}
    assert topics["/drive/wheel1/velocity_rad_s"].count == 40
    assert topics["/drive/wheel1/velocity_rad_s"].rate == pytest.approx(50.0)
    assert (topics["/mode"].type, topics["/mode"].read, topics["/mode"].why) == ("string", False, "no numbers")


SCHEMAS = {
    "Pose2d": "Translation2d translation;Rotation2d rotation",
    "Translation2d": "double x;double y",
    "Rotation2d": "double value",
    "ChassisSpeeds": "double vx;double vy;double omega",
    "SwerveModuleState": "double speed;Rotation2d angle",
    "Odd": "enum {a=1, b=2} int8 mode;float32 volts[2];bool on",
    "Bits": "int8 a : 4; int8 b : 4",
}


def test_structs_are_read_by_the_schemas_in_the_log(tmp_path):
    def fill(writer):
        for name, text in SCHEMAS.items():
            writer.addSchema(f"struct:{name}", "structschema", text)

        def entry(name, kind):
            return log_entries.RawLogEntry(writer, name, "", f"struct:{kind}")

        pose, speeds = entry("/odometry/pose", "Pose2d"), entry("/setpoint/speeds", "ChassisSpeeds")
        modules, odd = entry("/modules", "SwerveModuleState[]"), entry("/odd", "Odd")
        bits, lost = entry("/bits", "Bits"), entry("/lost", "Nowhere")
        for k in range(10):
            t = 20_000 * (k + 1)
            pose.append(struct.pack("<3d", 0.1 * k, -0.2 * k, 0.3 * k), t)
            speeds.append(struct.pack("<3d", 1.0, 0.5, 0.1 * k), t)
            modules.append(struct.pack("<4d", k, 0.2, k + 0.5, 0.3), t)
            odd.append(struct.pack("<bff?", 1, k, k + 0.5, True), t)
            bits.append(b"\x12", t)
            lost.append(b"\x12", t)

    path = write(tmp_path / "a.wpilog", fill)
    log, table = recorded_log(path), read_table(path)
    assert np.array_equal(log.channels["pose"], np.arange(10)[:, None] * [0.1, -0.2, 0.3])
    assert np.array_equal(log.channels["twist_command"][:, 2], 0.1 * np.arange(10))
    assert np.array_equal(table.numbers("/modules[1]/speed"), np.arange(10) + 0.5)
    assert np.array_equal(table.numbers("/odd/volts[1]"), np.arange(10) + 0.5)
    why = {topic.name: topic.why for topic in read_wpilog(path, ReadOptions()).topics}
    assert why["/bits"] == "its values cannot be read: int8 a : 4 in Bits"
    assert why["/lost"] == "its values cannot be read: no schema of Nowhere"


def test_a_cut_log_says_how_much_was_saved(path, tmp_path):
    cut = tmp_path / "cut.wpilog"
    cut.write_bytes(path.read_bytes()[:-3])
    recording = read_wpilog(cut, ReadOptions())
    assert recording.notes[0] == (
        f"the file is damaged: it ends in the middle of a record; {recording.salvaged} values before that were read"
    )
    assert recording.salvaged == sum(topic.count for topic in read_wpilog(path, ReadOptions()).topics) - 1


def test_damage_within_stops_the_reading_there(path, tmp_path):
    content = bytearray(path.read_bytes())
    content[1500:1520] = b"\xff" * 20
    bad = tmp_path / "bad.wpilog"
    bad.write_bytes(content)
    recording = read_wpilog(bad, ReadOptions())
    assert recording.salvaged is not None
    assert "damaged" in recording.notes[0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"WPILOG", r"damaged or cut short; got it ends in its first bytes"),
        (b"WPILOG\x00\x02\x00\x00\x00\x00", r"a data log of another version; got 2\.0; expected 1\.x"),
        (b"WPILOG\x00\x01\xff\x00\x00\x00", r"its first text is longer than the file"),
        (b"WPILOG\x00\x01\x00\x00\x00\x00", r"no topic holds numbers"),
        (b"WPILOG\x00\x01\x00\x00\x00\x00\x00\x07\x01\x00\xff", r"damaged or cut short; got a value of entry 7"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, content, words):
    path = tmp_path / "a.wpilog"
    path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_table(path)


def test_a_log_is_held_within_bounds(path):
    with pytest.raises(InputError, match=r"the file is too large; got more than 1000 bytes"):
        read_wpilog(path, ReadOptions(max_bytes=1000))
