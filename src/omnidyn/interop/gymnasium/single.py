"""RobotEnv: one robot as an Env of Gymnasium. It does what robot 0 of a RobotVectorEnv with the same seed does."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Env

from omnidyn.arrays import FloatArray
from omnidyn.interop.gymnasium.vector import Robots, environments, seed_of, spaces
from omnidyn.simulation.environments.environments import Setting


class RobotEnv(Env):
    """A robot at one task. Actions are shares of the largest voltage, -1 to 1; one that is no number is 0.

    Args:
        robot: A robot, by name, path or value.
        task: "velocity", "pose" or "path".
        path: Of the task "path": what `omnidyn.path` takes.
        privileged: Whether infos hold what no sensor shows, as "privileged".
        dtype: Of all numbers, float32 or float64.
        seed: Of robots that are drawn beforehand.
        setting: Fields of `Setting`, as for RobotVectorEnv.
    """

    metadata = {"render_modes": []}  # noqa: RUF012  as Gymnasium has it

    def __init__(
        self,
        robot: Robots = "axebot",
        task: Any = "velocity",
        *,
        path: Any = "eight",
        privileged: bool = False,
        dtype: Any = np.float32,
        seed: int = 0,
        **setting: Any,
    ) -> None:
        self.privileged = privileged
        self.environments = environments(
            robot, 1, Setting(task=task, **setting), path, autoreset="disabled", dtype=dtype, seed=seed
        )
        self.observation_space, self.action_space = spaces(self.environments)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode. See Env."""
        super().reset(seed=seed)
        return self.environments.reset(seed=seed_of(self, seed))[0].copy(), self._info()

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for dt, shape (wheels,). See Env."""
        step = self.environments.step(np.asarray(action)[None])
        flags = bool(step.terminated[0]), bool(step.truncated[0])
        return step.observation[0].copy(), float(step.reward[0]), *flags, self._info()

    def _info(self) -> dict[str, Any]:
        return {"privileged": self.environments.privileged[0]} if self.privileged else {}
