"""rollout: what one robot of an environment does under a policy, as a Run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.interop.gymnasium.vector import RobotVectorEnv
from omnidyn.model.drive import DUTY
from omnidyn.run import Run
from omnidyn.simulation.environments.pool import largest_voltage


def rollout(envs: RobotVectorEnv, policy: Callable[[FloatArray], Any], index: int = 0, seed: int | None = None) -> Run:
    """The episode of robot `index` from a reset of all on, as a Run: `omnidyn.check`, `compare`, `identify` take it.

    policy: from observations, (num_envs, columns), to actions, (num_envs, wheels). voltage, duty are what was asked
    for; pose is None in the task "velocity", which asks for none.
    """
    core = envs.environments
    robot, task = core.robot, core.setting.task
    observation, _ = envs.reset(seed=seed)
    twists, poses, shares = [core.twist[index].astype(float)], [core.pose[index].astype(float)], []
    for _ in range(core.setting.steps):
        action = np.asarray(policy(observation), dtype=core.dtype)
        shares.append(np.clip(np.nan_to_num(action[index].astype(float), nan=0.0), -1.0, 1.0))
        observation, _, terminated, truncated, _ = envs.step(action)
        ends = bool(terminated[index] or truncated[index])
        if ends and core.autoreset == "same_step":  # the next episode has begun: where this one ended is not kept
            shares.pop()
            break
        twists.append(core.twist[index].astype(float))
        poses.append(core.pose[index].astype(float))
        if ends:
            break
    shares.append(shares[-1] if shares else np.zeros(core.wheels))
    voltage = np.array(shares) * largest_voltage(robot)
    supply = robot.drive.supply if robot.drive.kind == DUTY else None
    return Run(
        t=np.arange(len(twists), dtype=np.float64) * core.setting.dt,
        voltage=voltage,
        duty=None if supply is None else voltage / supply,
        twist=np.array(twists),
        pose=None if task == "velocity" else np.array(poses),
        supply=None if supply is None else np.full(len(twists), supply),
        source=f"rollout: {robot.name}, {task}",
    )
