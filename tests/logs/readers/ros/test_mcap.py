"""MCAP recordings: what the usual topics say, read as other readers read them; and what damage does."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.readers.recording import Recording, Track
from omnidyn.logs.readers.ros.bags import read_bag

pytest.importorskip("rosbags")
pytest.importorskip("mcap")

from tests.support.bags import BagMaker, drive, write_mcap
from tests.support.codes import said

WHEELS = ["wheel_1_joint", "wheel_2_joint", "wheel_3_joint"]


@pytest.fixture(scope="module")
def drive_file(tmp_path_factory) -> Path:
    return write_mcap(drive(BagMaker(), 1.0), tmp_path_factory.mktemp("bags") / "drive.mcap")


def seen(path, name):
    """The numbers of a column and their times, without the blanks."""
    table = read_table(path)
    values = table.numbers(name, missing=True)
    known = np.isfinite(values)
    return table.numbers("t_s")[known], values[known]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_the_usual_topics_are_mapped(tmp_path, compression):
    log = recorded_log(write_mcap(drive(BagMaker(), 1.0), tmp_path / "a.mcap", compression))
    assert set(log.channels) == {"twist", "twist_command", "pose", "supply", "wheel_angle", "wheel_speed"}
    assert said(log.columns.doubts) == ()
    assert log.columns.unused == ()
    assert np.isfinite(log.channels["wheel_speed"]).all(axis=1).sum() == 200
    assert np.isfinite(log.channels["twist"]).all(axis=1).sum() == 50
    assert np.isfinite(log.channels["supply"]).sum() == 7


def test_numbers_and_stamps_are_those_of_rosbags_message_by_message(drive_file):
    from rosbags.highlevel import AnyReader

    table = read_table(drive_file)
    start = min(
        m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in _messages(AnyReader, drive_file, "/joint_states")
    )
    rows = np.flatnonzero(np.isfinite(table.columns["/joint_states/wheel_2_joint/velocity"]))
    messages = list(_messages(AnyReader, drive_file, "/joint_states"))
    assert len(rows) == len(messages)
    for row, message in zip(rows, messages, strict=True):
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        assert table.columns["t_s"][row] == (stamp - start) / 1e9
        for name, angle, speed in zip(message.name, message.position, message.velocity, strict=True):
            assert table.columns[f"/joint_states/{name}/velocity"][row] == speed
            assert table.columns[f"/joint_states/{name}/position"][row] == angle


def _messages(reader_type, path, topic) -> Iterator[Any]:
    with reader_type([path]) as reader:
        for connection, _, data in reader.messages():
            if connection.topic == topic:
                yield reader.deserialize(data, connection.msgtype)


def test_joints_are_known_by_name_in_any_order_and_arrays_may_be_empty(tmp_path):
    maker = BagMaker()
    maker.joints(0.0, WHEELS, [1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    maker.joints(0.1, WHEELS[::-1], [6.0, 5.0, 4.0], [0.6, 0.5, 0.4])
    maker.joints(0.2, WHEELS, [], [0.7, 0.8, 0.9])
    maker.joints(0.3, [WHEELS[1]], [9.0], [])
    maker.joints(0.4, [], [], [])
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    nan = np.nan
    assert np.array_equal(log.channels["wheel_speed"][:3], [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])
    angles = [[1, 2, 3], [4, 5, 6], [nan] * 3, [nan, 9, nan]]
    assert np.array_equal(log.channels["wheel_angle"], angles, equal_nan=True)


def test_wheels_whose_names_do_not_count_are_asked_for(tmp_path):
    maker = BagMaker()
    for k in range(5):
        maker.joints(0.1 * k, ["red_wheel", "green_wheel", "blue_wheel"], [0, 0, 0], [1.0 * k, 2, 3])
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    assert "wheel_speed" not in log.channels
    assert any(
        "/joint_states/red_wheel/velocity" in words and "which wheel each is" in words
        for words in said(log.columns.doubts)
    )


def test_wheels_whose_names_say_where_they_stand_are_numbered_by_place(tmp_path):
    maker = BagMaker()
    for k in range(5):
        maker.joints(0.1 * k, ["front_left_wheel", "front_right_wheel", "rear_wheel"], [0, 0, 0], [1.0 * k, 2, 3])
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    assert np.array_equal(log.channels["wheel_speed"], [[1.0 * k, 3, 2] for k in range(5)])
    assert any("/joint_states/rear_wheel/position is wheel 2" in words for words in said(log.notes))


def test_joints_that_are_no_wheels_do_not_shift_the_wheels(tmp_path):
    maker = BagMaker()
    for k in range(5):
        maker.joints(0.1 * k, ["arm_4", "wheel0", "wheel1", "wheel2"], [0] * 4, [9.0, 1.0 * k, 2, 3])
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    assert np.array_equal(log.channels["wheel_speed"][:, 0], np.arange(5.0))
    assert log.wheels == 3


def test_the_stamp_in_the_header_counts_not_the_time_of_reception(tmp_path):
    maker = BagMaker()
    for k in range(20):
        maker.odometry(0.02 * k, (0, 0, 0), (0.1 * k, 0, 0), late=0.001 + 0.017 * (k % 3))
    t, values = seen(write_mcap(maker, tmp_path / "a.mcap"), "/odom/vx")
    assert np.array_equal(t, np.arange(20) * 20_000_000 / 1e9)
    assert np.array_equal(values, 0.1 * np.arange(20))


def test_a_stamp_that_is_not_set_falls_back_to_the_time_of_reception_and_says_so(tmp_path):
    maker = BagMaker()
    for k in range(20):
        maker.odometry(0.02 * k, (0, 0, 0), (0.1 * k, 0, 0), stamp=None)
    table = read_table(write_mcap(maker, tmp_path / "a.mcap"))
    assert np.allclose(np.diff(table.columns["t_s"]), 0.02)
    assert any("the times of reception are taken" in note for note in said(table.notes))


def test_a_heading_goes_on_through_full_turns(tmp_path):
    maker = BagMaker()
    heading = np.linspace(0.3, 40.0, 400)
    for k, angle in enumerate(heading):
        maker.odometry(0.02 * k, (0, 0, angle), (0, 0, 0))
    _, values = seen(write_mcap(maker, tmp_path / "a.mcap"), "/odom/heading")
    assert np.abs(values - heading).max() <= 1e-15 * 40.0 + 1e-15


def test_a_custom_message_is_read_by_the_definition_in_the_bag(tmp_path):
    kind = "my_robot/msg/Motors"
    text = "std_msgs/Header header\nuint8 OK=0\nstring<=10 mode\nfloat32[3] current_A\nint16[] ticks\nbool on\n"
    maker = BagMaker(custom={kind: text})
    for k in range(6):
        message = maker.make(
            kind,
            maker.header(0.1 * k),
            "go" if k % 2 else "stop",
            np.array([k, 2, 3], dtype=np.float32),
            np.array([k, -k], dtype=np.int16),
            True,
        )
        maker.add("/motors", kind, 0.1 * k, message)
    path = write_mcap(maker, tmp_path / "a.mcap")
    assert np.array_equal(seen(path, "/motors/current_A[0]")[1], np.arange(6.0))
    assert np.array_equal(seen(path, "/motors/ticks[1]")[1], -np.arange(6.0))
    log = recorded_log(path)
    assert np.array_equal(log.channels["current"], [[k, 2, 3] for k in range(6)])


def test_namespaces_and_two_robots(tmp_path):
    one, two = BagMaker(), BagMaker()
    for k in range(10):
        one.odometry(0.1 * k, (0, 0, 0), (1.0, 0, 0), topic="/robot1/odom")
        two.odometry(0.1 * k, (0, 0, 0), (1.0, 0, 0), topic="/robot1/odom")
        two.odometry(0.1 * k, (0, 0, 0), (2.0, 0, 0), topic="/robot2/odom")
    log = recorded_log(write_mcap(one, tmp_path / "one.mcap"))
    assert (log.channels["twist"][:, 0] == 1.0).all()
    log = recorded_log(write_mcap(two, tmp_path / "two.mcap"))
    assert "twist" not in log.channels
    assert any("/robot1/odom/vx" in words and "/robot2/odom" in words for words in said(log.columns.doubts))


def test_blocks_are_the_whole(drive_file):
    whole = read_table(drive_file)
    parts = list(iter_tables(drive_file, 37))
    assert [len(part) for part in parts[:-1]] == [37] * (len(parts) - 1)
    for name in whole.names:
        joined = np.concatenate([part.columns[name] for part in parts])
        assert np.array_equal(joined, whole.columns[name], equal_nan=True)
    assert parts[-1].sha256 == whole.sha256
    assert len(whole.sha256) == 64


def test_a_topic_with_messages_of_two_types_is_read_by_the_first(tmp_path):
    maker = BagMaker()
    for k in range(40):
        maker.twist(k / 50, (k, 0.0, 0.5))
        if k % 2:
            maker.twist(k / 50 + 0.001, (-1.0, 0.0, 0.5), stamped=True)
    path = write_mcap(maker, tmp_path / "a.mcap")
    np.testing.assert_array_equal(seen(path, "/cmd_vel/vx")[1], np.arange(40.0))
    topics = {each.type: each for each in read_bag(path, ReadOptions()).topics}
    assert topics["geometry_msgs/msg/Twist"].read
    assert "of another type" in topics["geometry_msgs/msg/TwistStamped"].why


@pytest.mark.parametrize("rows", [1, 3, 7, 1000])
def test_blocks_of_any_size_are_the_whole_where_stamps_repeat(rows):
    rng = np.random.default_rng(rows)
    tracks = [
        Track(name, np.sort(rng.integers(0, 60, count)), {name: np.arange(count, dtype=float)})
        for name, count in (("a", 100), ("b", 9), ("c", 1))
    ]
    blocks = list(Recording(tracks, [], "made").tables(rows))
    assert max(map(len, blocks)) <= rows
    for track in tracks:
        t, values = (np.concatenate([block.columns[n] for block in blocks[:-1]]) for n in ("t_s", track.topic))
        assert (np.diff(t) >= 0.0).all()
        known = np.isfinite(values)
        np.testing.assert_array_equal(t[known], track.stamps / 1e9)
        np.testing.assert_array_equal(values[known], track.columns[track.topic])


def test_pictures_are_not_read(tmp_path):
    maker = BagMaker()
    for k in range(5):
        picture = maker.make(
            "sensor_msgs/msg/CompressedImage", maker.header(0.1 * k), "jpeg", np.zeros(1000, dtype=np.uint8)
        )
        maker.add("/camera", "sensor_msgs/msg/CompressedImage", 0.1 * k, picture)
        maker.odometry(0.1 * k, (0, 0, 0), (1, 0, 0))
    recording = read_bag(write_mcap(maker, tmp_path / "a.mcap"), ReadOptions())
    camera = next(topic for topic in recording.topics if topic.name == "/camera")
    assert (camera.count, camera.read, camera.why) == (5, False, "pictures, scans and maps are not read")
    assert camera.rate == pytest.approx(10.0)


def test_a_bag_without_numbers_lists_its_topics(tmp_path):
    maker = BagMaker()
    for k in range(5):
        maker.add("/chat", "std_msgs/msg/String", 0.1 * k, maker.make("std_msgs/msg/String", "hello"))
    with pytest.raises(InputError, match=r"no topic holds numbers.*got /chat \(std_msgs/msg/String, 5\).*JointState"):
        read_table(write_mcap(maker, tmp_path / "a.mcap"))


# ---- damage ---------------------------------------------------------------------------------------------


def test_a_truncated_file_is_read_to_its_last_whole_record(tmp_path):
    maker = drive(BagMaker(), 1.0)
    content = write_mcap(maker, tmp_path / "a.mcap", "none", chunk=2000).read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    recording = read_bag(cut, ReadOptions())
    assert recording.salvaged is not None
    assert 50 < recording.salvaged < 314
    assert f"{recording.salvaged} messages before that were read" in said(recording.notes)[0]
    log = recorded_log(cut)
    assert np.isfinite(log.channels["wheel_speed"]).all(axis=1).sum() == next(
        topic.count for topic in recording.topics if topic.name == "/joint_states"
    )


def test_a_wrong_checksum_stops_the_reading_there(tmp_path):
    maker = drive(BagMaker(), 1.0)
    content = bytearray(write_mcap(maker, tmp_path / "a.mcap", "none", chunk=4000).read_bytes())
    content[len(content) // 2] ^= 1
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(content)
    recording = read_bag(bad, ReadOptions())
    assert recording.salvaged is not None
    assert 0 < recording.salvaged < 314
    assert "another checksum" in said(recording.notes)[0]


def test_a_chunk_that_declares_too_much_is_refused_before_it_is_unpacked(tmp_path):
    import resource

    zstandard = pytest.importorskip("zstandard")
    size = 480 * 2**20
    packed = zstandard.ZstdCompressor(level=3).compressobj(size=size)
    data = b"".join([*(packed.compress(bytes(2**20)) for _ in range(480)), packed.flush()])
    body = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(data)) + data
    bomb = tmp_path / "bomb.mcap"
    head = struct.pack("<BQ", 1, 8) + struct.pack("<II", 0, 0)
    bomb.write_bytes(b"\x89MCAP0\r\n" + head + struct.pack("<BQ", 6, len(body)) + body)
    assert bomb.stat().st_size < 50_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(
        InputError, match=r"the file would grow too much.*got 503316480 bytes from \d+.*at most 200 times"
    ):
        read_table(bomb)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def test_unpacking_stops_where_a_declared_size_lied(tmp_path):
    zstandard = pytest.importorskip("zstandard")
    data = zstandard.ZstdCompressor().compress(bytes(10**7))
    body = struct.pack("<QQQI", 0, 0, 1000, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(data)) + data
    path = tmp_path / "lie.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(body)) + body)
    with pytest.raises(InputError, match=r"got a chunk holds 1001 bytes, and says 1000"):
        read_table(path)


def test_a_file_of_another_name_is_known_by_its_content(tmp_path, drive_file):
    other = tmp_path / "drive.csv"
    other.write_bytes(drive_file.read_bytes())
    assert said(read_table(other).notes)[0] == "the file holds an MCAP recording, though its name ends in .csv"


@pytest.mark.parametrize("way", ["shuffled", "chunks", "by topic"])
def test_an_mcap_in_any_order_is_read_in_the_order_of_time(tmp_path, way):
    maker = drive(BagMaker(), seconds=4.0)
    base = maker.in_order()
    quarter = len(base) // 4
    orders = {
        "shuffled": [base[k] for k in np.random.default_rng(0).permutation(len(base))],
        "chunks": base[2 * quarter :] + base[quarter : 2 * quarter] + base[:quarter],
        "by topic": sorted(base, key=lambda each: each.topic),
    }
    want = recorded_log(write_mcap(maker, tmp_path / "a.mcap", chunk=2**12)).to_run()
    run = recorded_log(write_mcap(maker, tmp_path / "b.mcap", chunk=2**12, order=orders[way])).to_run()
    assert np.array_equal(run.t, want.t)
    turns = (run.pose[:, 2] - want.pose[:, 2]) / (2.0 * np.pi)  # whole ones, the same everywhere
    assert np.ptp(turns[np.isfinite(turns)]) == pytest.approx(0.0, abs=1e-12)
    for name, values in want.channels.items():
        assert np.array_equal(run.channels[name][..., :2], values[..., :2], equal_nan=True), name
