"""RobotVectorEnv: many robots as a VectorEnv of Gymnasium, stepped by one kernel."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from omnidyn.arguments import unknown_option
from omnidyn.arrays import FloatArray
from omnidyn.control.paths.path import path as path_named
from omnidyn.errors import InputError
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.batch.sample import Sample
from omnidyn.simulation.environments.environments import SPREAD, Environments, Setting
from omnidyn.simulation.environments.layout import PREVIEW

OPTIONS = ("goal", "start", "twist")  # of a reset
RENDER_MODES = ("rgb_array",)
LARGEST = 1e3  # of what is observed: no robot of this size gets there within an episode
Robots = str | os.PathLike | Robot | Sequence[Robot] | Sample


class RobotVectorEnv(VectorEnv):
    """Robots at one task. Actions are shares of the largest voltage, -1 to 1; one that is no number is 0.

    Behind a speed loop they are shares of the largest wheel speed. A robot has the same bits in a batch of any size, on
    any number of threads and after any reset of others. `reset` takes a `reset_mask` in its options in every mode, and
    `goal`, `start` and `twist`, as of `Environments.reset`. infos hold the terms of the reward, and success. A subclass
    may write `judge`, for a reward or an end of its own.

    Args:
        num_envs: Number of environments.
        robot: A robot, by name, path or value; or several for life, one after the other: a list, or what
            `omnidyn.sample` gives.
        task: "velocity", "pose" or "path".
        path: Of the task "path": what `omnidyn.path` takes. An episode begins anywhere on it.
        autoreset_mode: Of Gymnasium.
        copy: Whether observations are copied; without, the next step writes into the same array.
        privileged: Whether infos hold what no sensor shows, as "privileged", see `Environments.privileged`.
        render_mode: None, or "rgb_array": `render` gives a picture of each robot.
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
        render_mode: str | None = None,
        dtype: Any = np.float32,
        threads: int = 1,
        seed: int = 0,
        **setting: Any,
    ) -> None:
        mode = _mode(autoreset_mode)
        self.render_mode = check_render_mode(render_mode)
        self.copy, self.privileged, self.num_envs = copy, privileged, num_envs
        self.environments = environments(
            robot,
            num_envs,
            made_setting(task, setting),
            path,
            autoreset=mode.name.lower(),
            dtype=dtype,
            threads=threads,
            seed=seed,
            poses=render_mode is not None,
        )
        self.metadata = {**metadata_of(self.environments), "autoreset_mode": mode}
        self.single_observation_space, self.single_action_space = spaces(self.environments)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode of all robots, or of those in `options["reset_mask"]`. See VectorEnv."""
        mask, placed = None if options is None else options.get("reset_mask"), placed_by(options, ("reset_mask",))
        if mask is not None and not np.any(mask):
            raise InputError("nobody to reset", got="a mask of False", expected="one True or more", where="reset_mask")
        super().reset(seed=seed)
        observation = self.environments.reset(mask, seed_of(self, seed), **placed)
        return self._shown(observation), self._infos()

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, actions: Any
    ) -> tuple[FloatArray, FloatArray, Any, Any, dict[str, Any]]:
        """Hold actions for dt, shape (num_envs, wheels). See VectorEnv."""
        observation, reward, terminated, truncated = self.environments.step(actions)
        infos = self._infos() | self._terms()
        if self.environments.autoreset == "same_step" and (over := terminated | truncated).any():
            infos |= self._final(over, infos)
        flags = (reward, terminated, truncated)
        if self.copy:
            flags = (reward.copy(), terminated.copy(), truncated.copy())
        return self._judged(self._shown(observation), *flags, infos, actions)

    def judge(
        self, observation: FloatArray, reward: FloatArray, terminated: Any, actions: Any, infos: dict[str, Any]
    ) -> tuple[FloatArray, Any]:
        """(rewards, which episodes end), for a subclass to write: as they are. Shapes (num_envs, ..) and (num_envs,).

        An end of its own begins the next episode as `autoreset_mode` says; not of SAME_STEP, which has begun it.
        """
        return reward, terminated

    def _judged(self, observation: FloatArray, reward: Any, terminated: Any, truncated: Any, infos: Any, actions: Any):
        own_reward, own_end = self.judge(observation, reward, terminated, actions, infos)
        if (ended := np.asarray(own_end, np.bool_) & ~terminated).any():
            self.environments.end(ended)
        return observation, own_reward, terminated | ended, truncated, infos

    def render(self) -> tuple[Any, ...] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """A picture of each robot, (256, 256, 3) uint8. None without a render mode."""
        return None if self.render_mode is None else tuple(pictures(self.environments))

    def close_extras(self, **options: Any) -> None:
        """Let go of threads."""
        self.environments.close()

    def _shown(self, observation: FloatArray) -> FloatArray:
        return observation.copy(order="K") if self.copy else observation

    def _infos(self) -> dict[str, Any]:
        if not self.privileged:
            return {}
        return {"privileged": self.environments.privileged, "_privileged": np.ones(self.num_envs, np.bool_)}

    def _terms(self) -> dict[str, Any]:
        """The terms of the reward, and success."""
        terms, there = self.environments.terms, np.ones(self.num_envs, np.bool_)
        shown = {name: value.copy() if self.copy else value for name, value in terms.items()}
        return shown | {f"_{name}": there for name in terms}

    def _final(self, over: Any, infos: dict[str, Any]) -> dict[str, Any]:
        """The end of episodes whose next one has begun in the same step, as SyncVectorEnv shows it."""
        final = np.full(self.num_envs, None, dtype=object)
        rows = self.environments.final
        for robot in np.flatnonzero(over):
            final[robot] = rows[robot].copy()
        last = {name: infos[name].copy() for name in self.environments.terms}
        last |= {f"_{name}": over.copy() for name in self.environments.terms}
        return {"final_obs": final, "_final_obs": over, "final_info": last, "_final_info": over.copy()}


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


def check_render_mode(mode: str | None) -> str | None:
    """Raises InputError for a render mode that there is not."""
    if mode is not None and mode not in RENDER_MODES:
        raise InputError("unknown render mode", got=mode, expected="rgb_array, or None", where="render_mode")
    return mode


def made_setting(task: str, options: dict[str, Any]) -> Setting:
    """The setting of options. Raises InputError for one that there is not, with the nearest."""
    names = [field.name for field in fields(Setting)]
    for name in options:
        if name not in names:
            raise unknown_option("an environment", name, names, "environment")
    return Setting(**{"task": task, **options})


def placed_by(options: dict[str, Any] | None, others: tuple[str, ...] = ()) -> dict[str, Any]:
    """Goal, start and twist of the options of a reset. Raises InputError for an option that there is not."""
    for name in options or {}:
        if name not in (*OPTIONS, *others):
            raise unknown_option("a reset", name, (*OPTIONS, *others), "options")
    return {name: value for name, value in (options or {}).items() if name in OPTIONS}


def metadata_of(envs: Environments) -> dict[str, Any]:
    """What Gymnasium wants to know."""
    return {"render_modes": list(RENDER_MODES), "render_fps": max(1, round(1.0 / envs.setting.dt))}


def pictures(envs: Environments) -> Iterator[Any]:
    """A picture of each robot; in the task "velocity" it stays in the middle, and the floor moves."""
    from omnidyn.interop.gymnasium.drawing import Scene

    setting, path = envs.setting, envs.numbers.path.astype(float)
    size = 3.0 * float(np.mean(envs.robot.wheels.robot_radius))
    scene = Scene(envs.robot, np.zeros(2), float(max((setting.spread or SPREAD[setting.task])[:2])) + size)
    if setting.task == "path":
        low, high = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
        scene = Scene(envs.robot, 0.5 * (low + high), 0.5 * float((high - low).max()) + size, path[:, :2])
    for pose, goal in zip(envs.pose.astype(float), envs.goal.astype(float), strict=True):
        if setting.task == "velocity":
            scene = Scene(envs.robot, pose[:2], 1.0)
        yield scene.draw(pose, goal if setting.task == "pose" else None)


def spaces(envs: Environments) -> tuple[Box, Box]:
    """(of observations, of actions) of one environment."""
    kind: Any = envs.dtype.type
    return Box(-LARGEST, LARGEST, (envs.columns,), kind), Box(-1.0, 1.0, (envs.wheels,), kind)


def environments(robot: Robots, count: int, setting: Setting, path: Any, **options: Any) -> Environments:
    """The environments of robots by name, path, value or sample, and of a path by name, file or value."""
    robots: Any = load_robot(robot) if isinstance(robot, str | os.PathLike) else robot
    if isinstance(robot, Sample):
        alone = robot.parameters is None or robot.center.drive.kind == SPEED
        robots = list(robot) if alone else robot.center
        options["parameters"] = None if alone else robot.parameters
    rows = path_rows(path, setting) if setting.task == "path" else None
    return Environments(robots, count, setting, path=rows, **options)


def path_rows(path: Any, setting: Setting) -> FloatArray:
    """Poses and velocities of a path, step by step: for an episode from any step of it. Shape (steps, 6)."""
    follow, episode = path_named(path), setting.steps + PREVIEW[-1] + 1
    whole = round(follow.duration / setting.dt)
    steps = whole + episode if np.isinf(follow.end) else max(whole + PREVIEW[-1] + 1, episode)
    motion = follow.at(np.arange(steps) * setting.dt)
    return np.concatenate([motion.pose, motion.velocity], axis=1)
