"""Environments for Gymnasium: a robot, or many, at one of three tasks. Importing it registers them.

    import gymnasium, omnidyn.interop.gymnasium
    envs = gymnasium.make_vec("omnidyn/Velocity-v0", num_envs=4096, robot="axebot")

vector: RobotVectorEnv; single: RobotEnv, of one robot; checker: check_vector_env, for vector environments of anybody;
adapters: Stable-Baselines3, rsl_rl, PyTorch; runs: a Run of one robot under a policy; drawing: frames of a video. What
they do is written in `omnidyn.simulation.environments`.
"""

from __future__ import annotations

import importlib
from typing import Any

from omnidyn.errors import MissingExtraError

try:
    import gymnasium
except ImportError:
    raise MissingExtraError("environments need Gymnasium", remedy='pip install "omnidyn[rl]"') from None

_HOME = {
    "RobotEnv": "omnidyn.interop.gymnasium.single",
    "RobotVectorEnv": "omnidyn.interop.gymnasium.vector",
    "check_vector_env": "omnidyn.interop.gymnasium.checker",
    "policy_of_sb3": "omnidyn.interop.gymnasium.adapters",
    "rollout": "omnidyn.interop.gymnasium.runs",
    "rsl_rl_env": "omnidyn.interop.gymnasium.adapters",
    "sb3_env": "omnidyn.interop.gymnasium.adapters",
    "torch_env": "omnidyn.interop.gymnasium.adapters",
}
TASKS = {"omnidyn/Velocity-v0": "velocity", "omnidyn/Pose-v0": "pose", "omnidyn/Path-v0": "path"}

__all__ = [*_HOME]  # pyright: ignore[reportUnsupportedDunderAll]

for _id, _task in TASKS.items():
    if _id not in gymnasium.registry:
        gymnasium.register(
            _id,
            entry_point="omnidyn.interop.gymnasium.single:RobotEnv",
            vector_entry_point="omnidyn.interop.gymnasium.vector:RobotVectorEnv",
            kwargs={"task": _task},
        )


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'omnidyn.interop.gymnasium' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
