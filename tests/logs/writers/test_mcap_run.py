"""A Run as MCAP, and back: equal to the last bit; and as rosbags and mcap read it."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.logs.read_log import read_log
from omnidyn.logs.run_file import write_run
from omnidyn.run import CHANNELS, Run

pytest.importorskip("mcap")


def full_run(rows=60, wheels=3, seed=0):
    """Every channel; stamps of whole microseconds, not regular; measurements missing here and there."""
    rng = np.random.default_rng(seed)
    sizes = {"wheel": (rows, wheels), "axis": (rows, 3), "scalar": (rows,)}
    channels = {name: rng.normal(size=sizes[kind]) for name, kind in CHANNELS.items()}
    channels["pose"][:, 2] = np.cumsum(rng.uniform(-0.1, 0.6, rows))
    channels["wheel_angle"] = np.cumsum(channels["wheel_angle"], axis=0)
    for name in ("current", "wheel_angle", "wheel_speed", "twist", "pose"):
        channels[name][rng.random(rows) < 0.3] = np.nan
    channels["wheel_speed"][7, 1] = np.nan
    return Run(t=np.cumsum(rng.integers(1, 20_000, rows)) / 1e6, **channels)


def same_but_heading(a, b):
    assert np.array_equal(a.t, b.t)
    for name in CHANNELS:
        one, other = getattr(a, name), getattr(b, name)
        if name == "pose" and one is not None:
            error = np.abs(one[:, 2] - other[:, 2])
            assert (error <= 1e-15 * np.maximum(1.0, np.abs(one[:, 2])))[np.isfinite(error)].all()
            one, other = one[:, :2], other[:, :2]
        assert (one is None) == (other is None)
        assert one is None or np.array_equal(one, other, equal_nan=True), name


@pytest.mark.parametrize("seed", range(3))
def test_a_run_comes_back_to_the_last_bit(tmp_path, seed):
    run = full_run(seed=seed)
    back = read_log(write_run(run, tmp_path / "a.mcap"))
    same_but_heading(run, back)
    assert not any("reception" in str(words) for words in back.warnings)


@pytest.mark.parametrize("begin", [10.0, -7.0, 4000.0])
def test_a_heading_keeps_its_full_turns(tmp_path, begin):
    """A quaternion holds two turns; what begins beyond these stands beside it."""
    run = full_run(seed=4)
    pose = run.pose.copy()
    pose[:, 2] += begin - pose[np.isfinite(pose[:, 2])][0, 2]
    run = run.replace(pose=pose)
    back = read_log(write_run(run, tmp_path / "a.mcap"))
    same_but_heading(run, back)
    assert np.array_equal(back.pose[:, 2], pose[:, 2], equal_nan=True)


def test_channels_that_are_not_there_stay_away(tmp_path):
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), [[0.0, 3.0, -3.0]] * 50, 0.01)
    run = run.replace(t=np.arange(51) / 100, current=None, pose=None)
    same_but_heading(run, read_log(write_run(run, tmp_path / "a.mcap")))


def test_a_heading_within_two_turns_needs_nothing_beside_it(tmp_path):
    back = read_log(write_run(full_run(), tmp_path / "a.mcap"))
    assert not any("/omnidyn/heading" in str(words) for words in back.warnings)


def test_rosbags_reads_the_same(tmp_path):
    rosbags = pytest.importorskip("rosbags.highlevel")
    run = full_run(20)
    path = write_run(run, tmp_path / "a.mcap")
    stamps = []
    with rosbags.AnyReader([path]) as reader:
        kinds = {each.topic: each.msgtype for each in reader.connections}
        for connection, stamp, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            row = int(np.flatnonzero(np.rint(run.t * 1e9).astype(int) == stamp)[0])
            if connection.topic == "/joint_states":
                stamps.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp)
                if len(message.velocity):
                    assert np.array_equal(message.velocity, run.wheel_speed[row], equal_nan=True)
            if connection.topic == "/odom" and np.isfinite(run.twist[row]).all():
                assert message.twist.twist.angular.z == run.twist[row, 2]
                assert message.child_frame_id == "base_link"
            if connection.topic == "/omnidyn/voltage":
                assert np.array_equal(message.data, run.voltage[row])
    assert stamps
    assert all(stamps)
    assert kinds["/cmd_vel"] == "geometry_msgs/msg/TwistStamped"


def test_times_that_are_no_stamps_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"these times are not time stamps; got -1 to 1 s; .*from 0 on; shift"):
        write_run(Run(t=[-1.0, 0.0, 1.0], supply=[1, 2, 3]), tmp_path / "a.mcap")
    with pytest.raises(InputError, match="no sensor gives such a number; got inf"):
        write_run(Run(t=[0.0, 1.0], supply=[1, np.inf]), tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []
