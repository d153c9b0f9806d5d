"""Datasets of LeRobot: the speeds of a base out of action and observation.state."""

import json

import numpy as np
import pytest

from omnidyn import check, load_log, load_robot, read_log
from omnidyn.errors import InputError

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

ARM = [f"arm_{joint}.pos" for joint in ("shoulder_pan", "elbow_flex", "gripper")]
NAMES = [*ARM, "x.vel", "y.vel", "theta.vel"]
ROWS = 120


def base(seed=0, rows=ROWS):
    """(commands, measured) of an episode: m/s, m/s, deg/s; a lag of the first order and noise. Shapes (rows, 3)."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(-1.0, 1.0, (rows // 12, 3)) * [0.3, 0.3, 60.0], 12, axis=0)
    command[:12] = 0.0
    seen = np.zeros_like(command)
    for k in range(1, rows):
        seen[k] = seen[k - 1] + 0.4 * (command[k - 1] - seen[k - 1])
    return command, seen + rng.normal(size=seen.shape) * [0.002, 0.002, 0.3]


def write(root, episodes, names=NAMES, kind=None, files=1, info=None):
    """A dataset of these (commands, measured), in so many files."""
    kind = kind or pa.list_(pa.float32())
    (root / "meta" / "episodes").mkdir(parents=True)
    (root / "data" / "chunk-000").mkdir(parents=True)
    pq.write_table(pa.table({"x": [1.0]}), root / "meta" / "tasks.parquet")
    feature = {"dtype": "float32", "shape": [len(NAMES)], "names": names}
    told = {"codebase_version": "v3.0", "fps": 30, "features": {"action": feature, "observation.state": feature}}
    (root / "meta" / "info.json").write_text(json.dumps(told) if info is None else info)
    arm = np.full((ROWS, len(ARM)), 7.0)
    for number in range(files):
        own = list(enumerate(episodes))[number::files]
        columns = {
            "action": pa.array(np.concatenate([np.hstack([arm, c]) for _, (c, _) in own]).tolist(), kind),
            "observation.state": pa.array(np.concatenate([np.hstack([arm, s]) for _, (_, s) in own]).tolist(), kind),
            "timestamp": pa.array(np.tile(np.arange(ROWS) / 30.0, len(own)), pa.float32()),
            "frame_index": pa.array(np.tile(np.arange(ROWS), len(own))),
            "episode_index": pa.array(np.repeat([k for k, _ in own], ROWS)),
            "index": pa.array(np.arange(ROWS * len(own))),
        }
        pq.write_table(pa.table(columns), root / "data" / "chunk-000" / f"file-{number:03d}.parquet")
    return root


@pytest.mark.parametrize("kind", [None, "fixed", "large"])
@pytest.mark.parametrize("names", [NAMES, {"motors": NAMES}])
def test_actions_are_commands_and_the_state_is_measured(tmp_path, kind, names):
    float32 = pa.float32()
    kinds = {None: None, "fixed": pa.list_(float32, len(NAMES)), "large": pa.large_list(float32)}
    command, seen = base()
    run = read_log(write(tmp_path / "set", [(command, seen)], names, kinds[kind]))
    to_si = np.array([1.0, 1.0, np.pi / 180.0])
    np.testing.assert_allclose(run.twist_command, command * to_si, atol=1e-6)
    np.testing.assert_allclose(run.twist, seen * to_si, atol=1e-6)
    np.testing.assert_allclose(run.t, np.arange(ROWS) / 30.0, atol=1e-6)
    assert set(run.channels) == {"twist", "twist_command"}


def test_the_folder_and_its_one_file_are_the_same_log(tmp_path):
    root = write(tmp_path / "set", [base()])
    whole, single = read_log(root), read_log(root / "data" / "chunk-000" / "file-000.parquet")
    np.testing.assert_array_equal(whole.twist, single.twist)
    np.testing.assert_array_equal(whole.t, single.t)


@pytest.mark.parametrize("files", [1, 3])
def test_each_episode_is_a_recording_of_its_own(tmp_path, files):
    log = load_log(write(tmp_path / "set", [base(seed) for seed in range(3)], files=files))
    steps = np.diff(log.t)
    assert np.flatnonzero(steps > 1.0).tolist() == [ROWS - 1, 2 * ROWS - 1]
    np.testing.assert_allclose(np.delete(steps, [ROWS - 1, 2 * ROWS - 1]), 1.0 / 30.0, atol=1e-5)
    assert any("3 episodes are recordings of their own" in note for note in log.notes)
    assert any("not read: arm_shoulder_pan.pos" in note for note in log.notes)


def test_commands_take_the_folder_and_a_folder_of_datasets(call, here):
    write(here / "both" / "one", [base(1)])
    write(here / "both" / "two", [base(2)])
    code, out, _ = call("check", "both", "--robot", "lekiwi")
    assert code == 0
    assert "one" in out and "two" in out and "tasks" not in out
    assert call("convert", "both/one", "one.csv")[0] == 0
    assert read_log(here / "one.csv").twist.shape == (ROWS, 3)


@pytest.mark.parametrize("late", [0, 1, 2])
@pytest.mark.parametrize("single", [True, False])
def test_a_state_that_is_the_action_of_a_row_before_is_no_measurement(tmp_path, late, single):
    command, _ = base()
    echo = np.roll(command, late, axis=0)
    echo[:late] = 0.0
    echo = echo.astype(np.float32).astype(float) if single else echo
    verdict = check(load_log(write(tmp_path / "set", [(command, echo)]), load_robot("lekiwi")), load_robot("lekiwi"))
    (finding,) = verdict.of("echo")
    assert finding.level == "fatal"
    assert finding.numbers["rows"] == late
    assert "is the command of" in finding.message


@pytest.mark.parametrize("seed", range(3))
def test_a_state_that_was_measured_is_no_echo(tmp_path, seed):
    assert not check(load_log(write(tmp_path / "set", [base(seed)]))).of("echo")


def test_a_robot_that_hardly_moves_is_no_echo(tmp_path):
    command, seen = np.zeros((ROWS, 3)), np.zeros((ROWS, 3))
    command[40:, 0], seen[45:, 0] = 0.2, 0.199
    assert not check(load_log(write(tmp_path / "set", [(command, seen)]))).of("echo")


def test_what_is_lacking_is_said(tmp_path):
    root = write(tmp_path / "a", [base()])
    (root / "meta" / "info.json").unlink()
    with pytest.raises(InputError, match=r"names in meta/info\.json; got no such file.*give the folder of the dataset"):
        read_log(root / "data" / "chunk-000" / "file-000.parquet")
    with pytest.raises(InputError, match=r"not the description of a dataset; got meta/info\.json"):
        read_log(write(tmp_path / "b", [base()], info="{"))
    others = [f"joint_{k}.pos" for k in range(len(NAMES))]
    with pytest.raises(InputError, match=r"no speeds of a base in the dataset; got joint_0\.pos.*expected x\.vel"):
        read_log(write(tmp_path / "c", [base()], others))
    with pytest.raises(InputError, match=r"rows without all numbers of a feature"):
        read_log(write(tmp_path / "d", [base()], ["x.vel", "y.vel", "theta.vel", "more"] + ["z"] * 3))
