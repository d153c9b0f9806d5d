"""Bags of ROS 2 (db3, MCAP, packed or not, folders) and of ROS 1: the same numbers from each; and damage."""

import shutil
import sqlite3

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.readers.ros.bags import read_bag

pytest.importorskip("rosbags")
pytest.importorskip("mcap")
from tests.support.bags import BagMaker, drive, write_mcap, write_ros1, write_ros2


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return read_table(write_mcap(drive(BagMaker(), 0.5), tmp_path_factory.mktemp("plain") / "a.mcap"))


def same(table, other):
    assert table.names == other.names
    assert dict(table.units) == dict(other.units)
    for name in other.names:
        assert np.array_equal(table.columns[name], other.columns[name], equal_nan=True)


@pytest.mark.parametrize("compression", ["", "file", "message"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_folder_of_ros_2_is_read_as_the_plain_file(tmp_path, plain, storage, compression):
    folder = write_ros2(drive(BagMaker(), 0.5), tmp_path / "bag", storage, compression)
    same(read_table(folder), plain)
    if compression != "file":
        lone = next(folder.glob("*.db3" if storage == "sqlite3" else "*.mcap"))
        same(read_table(lone), plain)


@pytest.mark.parametrize("compression", ["", "bz2", "lz4"])
def test_a_bag_of_ros_1_is_read_as_that_of_ros_2(tmp_path, plain, compression):
    same(read_table(write_ros1(drive(BagMaker(ros1=True), 0.5), tmp_path / "a.bag", compression)), plain)


def test_a_db3_without_definitions_knows_the_usual_messages(tmp_path, plain):
    folder = write_ros2(drive(BagMaker(), 0.5), tmp_path / "bag")
    lone = next(folder.glob("*.db3"))
    with sqlite3.connect(lone) as db:
        db.execute("drop table message_definitions")
    db.close()
    same(read_table(lone), plain)


def test_a_custom_type_without_definition_is_named(tmp_path):
    kind = "my_robot/msg/Motors"
    maker = BagMaker(custom={kind: "float32 current\n"})
    maker.add("/motors", kind, 0.1, maker.make(kind, 1.5))
    maker.odometry(0.1, (0, 0, 0), (1, 0, 0))
    lone = next(write_ros2(maker, tmp_path / "bag").glob("*.db3"))
    with sqlite3.connect(lone) as db:
        db.execute("delete from message_definitions")
    db.close()
    topics = {topic.name: topic for topic in read_bag(lone, ReadOptions()).topics}
    assert topics["/motors"].why == "the file holds no definition of its type"
    assert topics["/odom"].read


def test_a_split_recording_is_one(tmp_path, plain):
    """Files of one recording: _2 comes before _10."""
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    messages = drive(BagMaker(), 0.5).in_order()
    third = len(messages) // 3
    for name, part in (
        ("bag_1", messages[:third]),
        ("bag_2", messages[third : 2 * third]),
        ("bag_10", messages[2 * third :]),
    ):
        write_mcap(BagMaker(), folder / f"{name}.mcap", order=part)
    table = read_table(folder)
    assert len(table) == len(plain)
    assert np.array_equal(table.columns["t_s"], plain.columns["t_s"])


def test_a_db3_with_torn_pages_is_refused(tmp_path):
    content = bytearray(next(write_ros2(drive(BagMaker(), 0.5), tmp_path / "bag").glob("*.db3")).read_bytes())
    content[4096 * 3 : 4096 * 12] = bytes(4096 * 9)
    bad = tmp_path / "bad.db3"
    bad.write_bytes(content)
    with pytest.raises(InputError, match=r"damaged or cut short; got .*expected a whole SQLite database"):
        read_table(bad)


def test_a_database_that_is_no_bag_says_so(tmp_path):
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as db:
        db.execute("create table people (name text)")
    db.close()
    with pytest.raises(InputError, match=r"not a ROS 2 bag; got people; expected the tables topics and messages"):
        read_table(path)


def test_a_packed_bag_that_is_cut_is_refused(tmp_path):
    folder = write_ros2(drive(BagMaker(), 0.5), tmp_path / "bag", "sqlite3", "file")
    packed = next(folder.glob("*.zstd"))
    packed.write_bytes(packed.read_bytes()[:-100])
    with pytest.raises(InputError, match="damaged or cut short"):
        read_table(folder)


def test_a_folder_without_metadata_is_no_bag(tmp_path):
    folder = write_ros2(drive(BagMaker(), 0.1), tmp_path / "bag")
    (folder / "metadata.yaml").unlink()
    with pytest.raises(InputError, match="cannot read it; got a folder"):
        read_table(folder)
    shutil.rmtree(folder)


def test_a_bag_is_a_log(tmp_path):
    log = recorded_log(write_ros2(drive(BagMaker(), 0.5), tmp_path / "bag"))
    assert {"wheel_speed", "twist", "twist_command", "supply"} <= set(log.channels)
