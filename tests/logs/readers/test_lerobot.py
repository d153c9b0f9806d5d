"""Datasets of LeRobot: the speeds of a base out of action and observation.state."""

import json

import numpy as np
import pytest

import omnidyn.cli.check
from omnidyn import check, load_robot, read_log
from omnidyn.cli import main
from omnidyn.errors import InputError
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.segments import segments
from tests.support.codes import said
from tests.support.lerobot_set import NAMES, ROWS, lerobot_episode, pa, write_dataset


@pytest.mark.parametrize("kind", [None, "fixed", "large"])
@pytest.mark.parametrize("names", [NAMES, {"motors": NAMES}])
def test_actions_are_commands_and_the_state_is_measured(tmp_path, kind, names):
    float32 = pa.float32()
    kinds = {None: None, "fixed": pa.list_(float32, len(NAMES)), "large": pa.large_list(float32)}
    command, seen = lerobot_episode()
    run = read_log(write_dataset(tmp_path / "set", [(command, seen)], names, kinds[kind]))
    to_si = np.array([1.0, 1.0, np.pi / 180.0])
    np.testing.assert_allclose(run.twist_command, command * to_si, atol=1e-6)
    np.testing.assert_allclose(run.twist, seen * to_si, atol=1e-6)
    np.testing.assert_allclose(run.t, np.arange(ROWS) / 30.0, atol=1e-6)
    assert set(run.channels) == {"twist", "twist_command"}


def test_the_folder_and_its_one_file_are_the_same_log(tmp_path):
    root = write_dataset(tmp_path / "set", [lerobot_episode()])
    whole, single = read_log(root), read_log(root / "data" / "chunk-000" / "file-000.parquet")
    np.testing.assert_array_equal(whole.twist, single.twist)
    np.testing.assert_array_equal(whole.t, single.t)


@pytest.mark.parametrize("files", [1, 3])
def test_each_episode_is_a_recording_of_its_own(tmp_path, files):
    log = recorded_log(write_dataset(tmp_path / "set", [lerobot_episode(seed) for seed in range(3)], files=files))
    steps = np.diff(log.t)
    assert [part.start for part in segments(log.t)] == [0, ROWS, 2 * ROWS]
    np.testing.assert_allclose(np.delete(steps, [ROWS - 1, 2 * ROWS - 1]), 1.0 / 30.0, atol=1e-5)
    assert any("3 episodes are recordings of their own" in note for note in said(log.notes))
    assert any("not read: arm_shoulder_pan.pos" in note for note in said(log.notes))
    assert not check(log).of("gap")
    assert [len(part) for part in log.recordings()] == [ROWS] * 3


@pytest.mark.parametrize("late", [0, 1, 2])
@pytest.mark.parametrize("single", [True, False])
def test_a_state_that_is_the_action_of_a_row_before_is_no_measurement(tmp_path, late, single):
    command, _ = lerobot_episode()
    echo = np.roll(command, late, axis=0)
    echo[:late] = 0.0
    echo = echo.astype(np.float32).astype(float) if single else echo
    verdict = check(
        recorded_log(write_dataset(tmp_path / "set", [(command, echo)]), load_robot("lekiwi")), load_robot("lekiwi")
    )
    (finding,) = verdict.of("echo")
    assert finding.severity == "error"
    assert finding.numbers["rows"] == late
    assert "is the command of" in str(finding)


@pytest.mark.parametrize("seed", range(3))
def test_a_state_that_was_measured_is_no_echo(tmp_path, seed):
    assert not check(recorded_log(write_dataset(tmp_path / "set", [lerobot_episode(seed)]))).of("echo")


def test_a_robot_that_hardly_moves_is_no_echo(tmp_path):
    command, seen = np.zeros((ROWS, 3)), np.zeros((ROWS, 3))
    command[40:, 0], seen[45:, 0] = 0.2, 0.199
    assert not check(recorded_log(write_dataset(tmp_path / "set", [(command, seen)]))).of("echo")


def test_what_is_lacking_is_said(tmp_path):
    root = write_dataset(tmp_path / "a", [lerobot_episode()])
    (root / "meta" / "info.json").unlink()
    with pytest.raises(InputError, match=r"names in meta/info\.json; got no such file.*give the folder of the dataset"):
        read_log(root / "data" / "chunk-000" / "file-000.parquet")
    with pytest.raises(InputError, match=r"not the description of a dataset; got meta/info\.json"):
        read_log(write_dataset(tmp_path / "b", [lerobot_episode()], info="{"))
    others = [f"joint_{k}.pos" for k in range(len(NAMES))]
    with pytest.raises(InputError, match=r"no speeds of a base in the dataset; got joint_0\.pos.*expected x\.vel"):
        read_log(write_dataset(tmp_path / "c", [lerobot_episode()], others))
    with pytest.raises(InputError, match=r"rows without all numbers of a feature"):
        read_log(
            write_dataset(tmp_path / "d", [lerobot_episode()], ["x.vel", "y.vel", "theta.vel", "more"] + ["z"] * 3)
        )


@pytest.mark.parametrize("late", [1, 2, 3])
def test_many_short_episodes_do_not_hide_an_echo(tmp_path, late):
    """The rows on either side of a gap are not compared: with episodes of 4 s they are 2 % of all."""
    commands = [lerobot_episode(seed)[0] for seed in range(6)]
    echoes = [np.concatenate([np.full((late, 3), 0.1), command[:-late]]).astype(np.float32) for command in commands]
    verdict = check(recorded_log(write_dataset(tmp_path / "set", list(zip(commands, echoes, strict=True)))))
    assert [finding.numbers["rows"] for finding in verdict.of("echo")] == [late]


@pytest.mark.parametrize("block", [500_000, ROWS, 50])
def test_a_file_for_each_episode_is_no_gap_to_the_command_line(tmp_path, monkeypatch, capsys, block):
    """Datasets of version 2.1 have a file per episode; "299 rows lost" stood where version 3 named two episodes."""
    monkeypatch.setattr(omnidyn.cli.check, "BLOCK", block)
    root = write_dataset(tmp_path / "set", [lerobot_episode(seed) for seed in range(2)], files=2)
    main(["check", str(root), "--json"])
    shown = capsys.readouterr()
    assert "2 episodes are recordings of their own" in shown.err
    codes = {finding["code"] for finding in json.loads(shown.out)["logs"][0]["findings"]}
    assert "gap" not in codes


def test_a_dataset_without_names_or_with_one_twice_says_what_to_do(tmp_path):
    with pytest.raises(InputError, match=r'got no names.*write what the numbers are into meta/info\.json: "names"'):
        read_log(write_dataset(tmp_path / "a", [lerobot_episode()], None))
    twice = ["x.vel", *NAMES[1:]]
    with pytest.raises(InputError, match=r"one name; got x\.vel, 2 times in action.*correct its names in meta/info"):
        read_log(write_dataset(tmp_path / "b", [lerobot_episode()], twice))
