"""omnidyn info and convert: what they say, what they end with, and that nothing is half-written."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.cli.log_options import log_files
from omnidyn.errors import InputError
from omnidyn.logs.read_log import read_log
from omnidyn.logs.readers.read_table import READERS
from omnidyn.logs.run_file import check_format, read_run, write_run
from omnidyn.model.robot_file import load_robot, robot_to_toml
from omnidyn.run import Run

pytest.importorskip("rosbags")
pytest.importorskip("mcap")
from tests.support.bags import BagMaker, drive, write_mcap, write_ros2


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return write_mcap(drive(BagMaker(), 1.0), tmp_path_factory.mktemp("bags") / "drive.mcap", "none", 2000)


@pytest.fixture(scope="module")
def long_bag(tmp_path_factory):
    return write_mcap(drive(BagMaker(), 60.0, (100.0, 20.0, 1.0)), tmp_path_factory.mktemp("bags") / "long.mcap")


def told(capsys, *arguments):
    code = main([*map(str, arguments)])
    found = capsys.readouterr()
    return code, found.out, found.err


def test_info_of_a_bag_for_machines(bag, capsys):
    code, out, _ = told(capsys, "info", bag, "--json")
    found = json.loads(out)
    assert code == 0
    assert (found["format"], found["salvaged"]) == ("mcap", None)
    topics = {topic["name"]: topic for topic in found["topics"]}
    assert topics["/joint_states"]["type"] == "sensor_msgs/msg/JointState"
    assert topics["/joint_states"]["count"] == 200
    assert topics["/odom"]["rate_hz"] == pytest.approx(50.0)
    assert topics["/battery_state"]["longest_gap_s"] == pytest.approx(1 / 7, rel=1e-4)
    assert found["mapping"]["w2"] == {"column": "/joint_states/wheel_2_joint/velocity", "unit": "rad/s"}


def test_info_of_what_is_cut_short_ends_with_0(bag, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(bag.read_bytes()[:30_000])
    code, out, _ = told(capsys, "info", cut, "--json")
    assert code == 0
    assert json.loads(out)["salvaged"] > 20
    code, out, _ = told(capsys, "info", cut)
    assert code == 0
    assert "cut short" in out
    assert "messages salvaged" in out


def test_info_where_nothing_can_be_read_ends_with_3(tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(b"\x89MCAP0\r\n\x01")
    code, _, err = told(capsys, "info", cut)
    assert code == 3
    assert "damaged or cut short" in err
    assert told(capsys, "info", tmp_path / "none.mcap")[0] == 3


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_info_of_a_table(tmp_path, capsys, suffix):
    run = Run(t=np.arange(100) / 50, wheel_speed=np.where(np.arange(100)[:, None] % 2, np.nan, np.ones((100, 3))))
    code, out, _ = told(capsys, "info", write_run(run, tmp_path / f"a{suffix}"), "--json")
    found = json.loads(out)
    topics = {topic["name"]: topic for topic in found["topics"]}
    assert code == 0
    assert found["format"] == {".csv": "text", ".parquet": "parquet"}[suffix]
    assert topics["t_s"]["count"] == 100
    assert topics["w1_rad_s"]["count"] == 50
    assert topics["w1_rad_s"]["rate_hz"] == pytest.approx(25.0)
    assert topics["w1_rad_s"]["longest_gap_s"] == pytest.approx(0.04)
    assert found["mapping"]["t"]["column"] == "t_s"
    assert found["span_s"] == pytest.approx(1.98)


def test_a_bag_in_every_format_is_the_same_run(bag, tmp_path, capsys):
    whole = read_log(bag)
    for suffix in (".csv", ".parquet", ".mcap"):
        assert told(capsys, "convert", bag, tmp_path / f"a{suffix}")[0] == 0
        again = read_log(tmp_path / f"a{suffix}")
        assert np.array_equal(again.t, whole.t)
        for name, values in whole.channels.items():
            if name != "supply" or suffix != ".mcap":
                np.testing.assert_allclose(again.channels[name], values, rtol=3e-15, atol=1e-15)
    assert read_run(tmp_path / "a.csv").channels.keys() == whole.channels.keys()


def test_convert_replaces_nothing_without_force(bag, tmp_path, capsys):
    out = tmp_path / "a.csv"
    out.write_text("mine")
    code, _, err = told(capsys, "convert", bag, out)
    assert code == 3
    assert "--force" in err
    assert out.read_text() == "mine"
    assert told(capsys, "convert", bag, out, "--force")[0] == 0
    code, _, err = told(capsys, "convert", out, out, "--force")
    assert code == 3
    code, _, err = told(capsys, "convert", bag, tmp_path / "a.xlsx")
    assert code == 3
    assert ".mcap or .mat" in err
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.csv"]


def test_a_folder_of_bags_is_a_folder_of_logs(tmp_path, capsys):
    (tmp_path / "day").mkdir()
    for name in ("one", "two"):
        write_ros2(drive(BagMaker(), 0.5), tmp_path / "day" / name)
    code, out, _ = told(capsys, "check", tmp_path / "day")
    assert out.startswith("Of 2 logs")
    assert code in (0, 4)


def test_what_a_reader_reads_is_taken_from_a_folder_and_no_run_is_written_as_it(tmp_path):
    endings = [suffix for reader in READERS for suffix in reader.suffixes]
    for ending in (*endings, ".csv", ".png"):
        (tmp_path / f"log{ending}").touch()
    assert {Path(name).suffix for name in log_files([str(tmp_path)])} == {*endings, ".csv"}
    for ending in {*endings} - {".parquet", ".pq", ".mcap", ".mat"}:
        with pytest.raises(InputError, match="a run is not written in this format"):
            check_format(f"run{ending}")


@pytest.mark.parametrize("command", ["info", "check", "compare --robot axebot", "identify --robot axebot", "convert"])
def test_every_command_that_reads_logs_holds_no_more(tmp_path, capsys, command, long_bag):
    name, *more = command.split()
    out = [tmp_path / "b.csv"] if name == "convert" else []
    code, told_out, err = told(capsys, name, long_bag, *out, *more, "--max-bytes", "100000")
    assert code == 3
    assert "the file is too large; got more than 100000 bytes" in told_out + err


def test_a_variable_of_matlab_is_chosen_or_named(tmp_path, capsys):
    scipy = pytest.importorskip("scipy.io")
    t = np.arange(50) / 100
    path = tmp_path / "a.mat"
    runs = {f"run{k}": {"t_s": t, "w1_rad_s": k * t} for k in (1, 2)}
    scipy.savemat(path, {**runs, "scratch": np.ones((3, 4))})
    code, out, _ = told(capsys, "info", path, "--var", "run2")
    assert code == 0
    assert "w1_rad_s" in out
    assert "scratch" not in out
    code, _, err = told(capsys, "convert", path, tmp_path / "b.csv", "--var", "run2")
    assert code == 0
    speed = read_log(tmp_path / "b.csv").wheel_speed
    assert speed is not None
    np.testing.assert_array_equal(speed[:, 0], 2 * t)
    code, _, err = told(capsys, "info", path, "--var", "run3")
    assert code == 3
    assert "no such variable; got run3; expected run1/t_s, run1, run1/w1_rad_s, " in err
    code, _, err = told(capsys, "info", tmp_path / "b.csv", "--var", "run2")
    assert code == 3
    assert "there are no variables to choose from; got text" in err
    assert "leave --var out" in err


def test_a_missing_extra_says_how_to_install_it(bag, tmp_path):
    hidden = "import sys; sys.modules['mcap'] = sys.modules['zstandard'] = None; from omnidyn.cli import main; "
    script = hidden + "raise SystemExit(main(sys.argv[1:]))"
    run = [sys.executable, "-c", script, "convert", str(bag), str(tmp_path / "a.mcap")]
    done = subprocess.run(run, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 6
    assert 'pip install "omnidyn[logs]"' in done.stderr
    packed = write_mcap(drive(BagMaker(), 0.2), tmp_path / "b.mcap", "zstd")
    run[-3:] = ["info", str(packed)]
    done = subprocess.run(run, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 6
    assert "packed bags need zstandard" in done.stderr


def test_info_of_a_robot_file(tmp_path, capsys):
    path = tmp_path / "own.toml"
    path.write_text(robot_to_toml(load_robot("axebot")) + "\n[variations.tilt.ramp]\ntilt_deg = 2.0\n", "utf-8")
    code, out, _ = told(capsys, "info", path)
    assert code == 0
    assert "body.mass_kg" in out
    assert "can be varied by tilt: ramp" in out
    found = json.loads(told(capsys, "info", path, "--json")[1])
    assert found["variations"] == {"tilt": ["ramp"]}
    path.write_text(path.read_text("utf-8").replace("tilt_deg", "til_deg"), "utf-8")
    code, _, err = told(capsys, "info", path)
    assert code == 3
    assert "did you mean tilt_deg?" in err


def _field(name, value):
    content = name.encode() + b"=" + value
    return struct.pack("<I", len(content)) + content


def _only_a_header(index):
    """A ROS 1 bag without a record; index: where it says that its index begins, 0 where it was never closed."""
    numbers = {"index_pos": struct.pack("<Q", index), "conn_count": bytes(4), "chunk_count": bytes(4)}
    head = b"".join(_field(name, value) for name, value in {"op": b"\x03", **numbers}.items())
    return b"#ROSBAG V2.0\n" + struct.pack("<I", len(head)) + head + struct.pack("<I", 4000) + b" " * 4000


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.bag", _only_a_header(4096), "no messages; got 0 messages; expected one message"),
        ("a.bag", _only_a_header(0), "damaged or cut short; got it ends without its index; expected at least one"),
        ("a.bag", b"#ROSBAG V2.0\n", "no messages; got 0 messages"),
        ("a.wpilog", b"WPILOG\x00\x01\x00\x00\x00\x00", "no messages; got 0 messages; expected one value"),
    ],
)
def test_a_file_that_is_only_a_header_has_nothing_to_say(tmp_path, capsys, name, content, words):
    (tmp_path / name).write_bytes(content)
    code, out, err = told(capsys, "info", tmp_path / name)
    assert code == 3
    assert words in err
    assert out == ""
