"""One log through every format: the same verdict of `check`, and the same fit to the last digit."""

import json
import struct

import numpy as np
import pytest

import omnidyn
from omnidyn.findings.check import check
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.logs.mcap_run import messages
from omnidyn.logs.read_log import read_log, recorded_log
from omnidyn.logs.run_file import run_columns, write_run
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.support.axebot_logs import voltages

pytest.importorskip("mcap")
pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def run():
    """Wheels at 100 Hz and another sensor at 25; no heading, which would go through a quaternion."""
    robot, rng = omnidyn.load_robot("axebot"), np.random.default_rng(2)
    run = omnidyn.simulate(robot, voltages(rng, 8.0), 0.01)
    twist = np.where(np.arange(len(run))[:, None] % 4 == 0, run.twist + rng.normal(0.0, 0.02, (len(run), 3)), np.nan)
    speed = wheel_speed(robot.wheels, run.twist) + rng.normal(0.0, 0.3, (len(run), 3))
    return Run(t=np.arange(len(run)) / 100, voltage=run.voltage, wheel_speed=speed, twist=twist)


def write_db3(run, folder):
    """A ROS 2 bag by rosbags, of the messages that our MCAP has."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer

    from tests.support.bags import typestore

    store, known = typestore(), {}
    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        for each in sorted(messages(run), key=lambda sent: sent.stamp):
            if each.topic not in known:
                known[each.topic] = writer.add_connection(each.topic, each.type, typestore=store)
            writer.write(known[each.topic], each.stamp, each.data)
    return folder


def write_bag(run, path):
    """A ROS 1 bag by rosbags, of the same messages."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag1 import Writer

    from tests.support.bags import typestore

    ours, store, known = typestore(), typestore(ros1=True), {}  # rosbags puts in the seq that a ROS 1 header has
    with Writer(path) as writer:
        for each in sorted(messages(run), key=lambda sent: sent.stamp):
            if each.topic not in known:
                known[each.topic] = writer.add_connection(each.topic, each.type, typestore=store)
            writer.write(known[each.topic], each.stamp, ours.cdr_to_ros1(each.data, each.type))
    return path


def write_wpilog(run, path):
    """A data log with an entry for each column, written where the column has a number."""

    def record(entry, stamp, value):
        return b"\x7f" + struct.pack("<IIQ", entry, len(value), stamp) + value

    def text(words):
        return struct.pack("<I", len(words)) + words.encode()

    columns = {name: values for name, values in run_columns(run).items() if name != "t_s"}
    content, values = b"WPILOG\x00\x01\x00\x00\x00\x00", []
    for number, (name, column) in enumerate(columns.items(), 1):
        content += record(0, 0, b"\x00" + struct.pack("<I", number) + text(name) + text("double") + text(""))
        values += [(round(t * 1e6), number, v) for t, v in zip(run.t, column, strict=True) if np.isfinite(v)]
    content += b"".join(record(number, stamp, struct.pack("<d", v)) for stamp, number, v in sorted(values))
    path.write_bytes(content)
    return path


def test_every_format_gives_the_same_verdict_and_the_same_fit(run, tmp_path):
    robot = omnidyn.load_robot("axebot")
    answers, verdicts = {}, {}
    others = {".db3": write_db3, ".bag": write_bag, ".wpilog": write_wpilog}
    for suffix in (".csv", ".parquet", ".mcap", ".mat", *others):
        path = others.get(suffix, write_run)(run, tmp_path / f"a{suffix}")
        again = read_log(path, robot)
        assert again.replace(source="", warnings=()) == run
        fit = identify(again.replace(source=""), robot, OutputError(nuisances=(), start="rest")).estimate
        answers[suffix] = json.dumps([fit.value, fit.std], default=float)
        verdict = check(recorded_log(path, robot), robot)
        grave = {(finding.code, finding.subject) for finding in verdict.findings if finding.severity != "note"}
        verdicts[suffix] = grave, verdict.has_errors
    assert len(set(answers.values())) == 1
    assert all(each == verdicts[".csv"] for each in verdicts.values())
