"""RobotVectorEnv: many robots as a VectorEnv of Gymnasium, stepped by one kernel."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.path import path as path_named
from omnidyn.errors import InputError
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.batch.sample import Sample
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.layout import PREVIEW

LARGEST = 1e3  # of what is observed: no robot of this size gets there within an episode
Robots = str | os.PathLike | Robot | Sequence[Robot] | Sample


class RobotVectorEnv(VectorEnv):
    """Robots at one task. Actions are shares of the largest voltage, -1 to 1; one that is no number is 0.

    A robot has the same bits in a batch of any size, on any number of threads and after any reset of others. `reset`
    takes a `reset_mask` in its options in every mode.

    Args:
        num_envs: Number of environments.
        robot: A robot, by name, path or value; or several for life, one after the other: a list, or what
            `omnidyn.sample` gives.
        task: "velocity", "pose" or "path".
        path: Of the task "path": what `omnidyn.path` takes. An episode begins anywhere on it.
        autoreset_mode: Of Gymnasium.
        copy: Whether observations are copied; without, the next step writes into the same array.
        privileged: Whether infos hold what no sensor shows, as "privileged", see `Environments.privileged`.
        dtype: Of all numbers, float32 or float64.
        threads: That share a step.
        seed: Of robots that are drawn beforehand.
        setting: Fields of `Setting`: dt, substeps, duration, spread, push, interval, latency, uncertainty, randomise.

    Raises InputError for what is out of range, UnsupportedError for a robot that blocks cannot move.
    """

    def __init__(
        self,
        num_envs: int = 1,
        robot: Robots = "axebot",
        task: Any = "velocity",
        *,
        path: Any = "eight",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        privileged: bool = False,
        dtype: Any = np.float32,
        threads: int = 1,
        seed: int = 0,
        **setting: Any,
    ) -> None:
        mode = _mode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": mode}
        self.copy, self.privileged, self.num_envs = copy, privileged, num_envs
        self.environments = environments(
            robot,
            num_envs,
            Setting(task=task, **setting),
            path,
            autoreset=mode.name.lower(),
            dtype=dtype,
            threads=threads,
            seed=seed,
        )
        self.single_observation_space, self.single_action_space = spaces(self.environments)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode of all robots, or of those in `options["reset_mask"]`. See VectorEnv."""
        mask = None if options is None else options.get("reset_mask")
        if mask is not None and not np.any(mask):
            raise InputError("nobody to reset", got="a mask of False", expected="one True or more", where="reset_mask")
        super().reset(seed=seed)
        observation = self.environments.reset(mask, seed_of(self, seed))
        return self._shown(observation), self._infos()

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, actions: Any
    ) -> tuple[FloatArray, FloatArray, Any, Any, dict[str, Any]]:
        """Hold actions for dt, shape (num_envs, wheels). See VectorEnv."""
        observation, reward, terminated, truncated = self.environments.step(actions)
        infos = self._infos()
        if self.environments.autoreset == "same_step" and (over := terminated | truncated).any():
            infos |= self._final(over)
        flags = (reward, terminated, truncated)
        if self.copy:
            flags = (reward.copy(), terminated.copy(), truncated.copy())
        return self._shown(observation), *flags, infos

    def close_extras(self, **options: Any) -> None:
        """Let go of threads."""
        self.environments.close()

    def _shown(self, observation: FloatArray) -> FloatArray:
        return observation.copy(order="K") if self.copy else observation

    def _infos(self) -> dict[str, Any]:
        if not self.privileged:
            return {}
        return {"privileged": self.environments.privileged, "_privileged": np.ones(self.num_envs, np.bool_)}

    def _final(self, over: Any) -> dict[str, Any]:
        """The end of episodes whose next one has begun in the same step, as SyncVectorEnv shows it."""
        final = np.full(self.num_envs, None, dtype=object)
        rows = self.environments.final
        for robot in np.flatnonzero(over):
            final[robot] = rows[robot].copy()
        return {"final_obs": final, "_final_obs": over, "final_info": {}, "_final_info": over.copy()}


def _mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        names = ", ".join(entry.value for entry in AutoresetMode)
        raise InputError("unknown autoreset mode", got=mode, expected=names, where="autoreset_mode") from None


def seed_of(env: Any, seed: int | None) -> int | None:
    """The seed of the robots: as given, else from the generator of Gymnasium where nothing has begun yet."""
    if seed is None and not env.environments.was_reset:
        return int(env.np_random.integers(2**32))
    return seed


def spaces(envs: Environments) -> tuple[Box, Box]:
    """(of observations, of actions) of one environment."""
    kind: Any = envs.dtype.type
    return Box(-LARGEST, LARGEST, (envs.columns,), kind), Box(-1.0, 1.0, (envs.wheels,), kind)


def environments(robot: Robots, count: int, setting: Setting, path: Any, **options: Any) -> Environments:
    """The environments of robots by name, path, value or sample, and of a path by name, file or value."""
    robots: Any = load_robot(robot) if isinstance(robot, str | os.PathLike) else robot
    if isinstance(robot, Sample):
        robots = list(robot) if robot.parameters is None else robot.center
        options["parameters"] = robot.parameters
    rows = path_rows(path, setting) if setting.task == "path" else None
    return Environments(robots, count, setting, path=rows, **options)


def path_rows(path: Any, setting: Setting) -> FloatArray:
    """Poses and velocities of a path, step by step: for an episode from any step of it. Shape (steps, 6)."""
    follow, episode = path_named(path), setting.steps + PREVIEW[-1] + 1
    whole = round(follow.duration / setting.dt)
    steps = whole + episode if np.isinf(follow.end) else max(whole + PREVIEW[-1] + 1, episode)
    motion = follow.at(np.arange(steps) * setting.dt)
    return np.concatenate([motion.pose, motion.velocity], axis=1)
