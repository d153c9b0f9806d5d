"""Datasets of LeRobot as LeKiwi records them, made of nothing but numpy and pyarrow."""

import json

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

ARM = [f"arm_{joint}.pos" for joint in ("shoulder_pan", "elbow_flex", "gripper")]
NAMES = [*ARM, "x.vel", "y.vel", "theta.vel"]
ROWS = 120


def lerobot_episode(seed=0, rows=ROWS):
    """(commands, measured) of an episode: m/s, m/s, deg/s; a lag of the first order and noise. Shapes (rows, 3)."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(-1.0, 1.0, (rows // 12, 3)) * [0.3, 0.3, 60.0], 12, axis=0)
    command[:12] = 0.0
    seen = np.zeros_like(command)
    for k in range(1, rows):
        seen[k] = seen[k - 1] + 0.4 * (command[k - 1] - seen[k - 1])
    return command, seen + rng.normal(size=seen.shape) * [0.002, 0.002, 0.3]


def write_dataset(root, episodes, names=NAMES, kind=None, files=1, info=None):
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
