"""RobotEnv: one robot as an Env of Gymnasium. It does what robot 0 of a RobotVectorEnv with the same seed does."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Env

from omnidyn.arrays import FloatArray
from omnidyn.interop.gymnasium.vector import (
    RENDER_MODES,
    Robots,
    check_render_mode,
    environments,
    made_setting,
    metadata_of,
    pictures,
    placed_by,
    seed_of,
    spaces,
)


class RobotEnv(Env):
    """A robot at one task. Actions are shares of the largest voltage, -1 to 1; one that is no number is 0.

    Behind a speed loop they are shares of the largest wheel speed. `reset` takes `goal`, `start` and `twist` in its
    options, as of `Environments.reset`. infos hold the terms of the reward, and success.

    Args:
        robot: A robot, by name, path or value.
        task: "velocity", "pose" or "path".
        path: Of the task "path": what `omnidyn.path` takes.
        privileged: Whether infos hold what no sensor shows, as "privileged".
        render_mode: None, or "rgb_array": `render` gives a picture, (256, 256, 3) uint8.
        dtype: Of all numbers, float32 or float64.
        seed: Of robots that are drawn beforehand.
        setting: Fields of `Setting`, as for RobotVectorEnv.
    """

    metadata = {"render_modes": [*RENDER_MODES], "render_fps": 50}  # noqa: RUF012  as Gymnasium has it

    def __init__(
        self,
        robot: Robots = "axebot",
        task: Any = "velocity",
        *,
        path: Any = "eight",
        privileged: bool = False,
        render_mode: str | None = None,
        dtype: Any = np.float32,
        seed: int = 0,
        **setting: Any,
    ) -> None:
        self.privileged, self.render_mode = privileged, check_render_mode(render_mode)
        self.environments = environments(
            robot,
            1,
            made_setting(task, setting),
            path,
            autoreset="disabled",
            dtype=dtype,
            seed=seed,
            poses=render_mode is not None,
        )
        self.metadata = metadata_of(self.environments)
        self.observation_space, self.action_space = spaces(self.environments)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode. See Env."""
        placed = placed_by(options)
        super().reset(seed=seed)
        return self.environments.reset(seed=seed_of(self, seed), **placed)[0].copy(), self._info()

    def step(self, action: Any) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Hold an action for dt, shape (wheels,). See Env."""
        step = self.environments.step(np.asarray(action)[None])
        flags = bool(step.terminated[0]), bool(step.truncated[0])
        terms = {name: value[0].item() for name, value in self.environments.terms.items()}
        return step.observation[0].copy(), float(step.reward[0]), *flags, self._info() | terms

    def render(self) -> Any:
        """A picture, (256, 256, 3) uint8; None without a render mode."""
        return None if self.render_mode is None else next(pictures(self.environments))

    def close(self) -> None:
        """Let go of threads."""
        self.environments.close()

    def _info(self) -> dict[str, Any]:
        return {"privileged": self.environments.privileged[0]} if self.privileged else {}
