"""Policy: what a network of plain numbers has learnt, as a controller. Its file is .npz, without pickle.

    action = W_n tanh(.. tanh(W_0 z + b_0) ..) + b_n   within -1 and 1,   z the observation of its task

It sees what its task shows of a robot in an environment, see `simulation/environments/task.py`: the pose of the path as
a goal, the path itself, or its twist. An action is a share of the largest voltage, held for dt.
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import plain
from omnidyn.control.controller import Guarded
from omnidyn.control.feedforward import DT, check_dt
from omnidyn.errors import InputError
from omnidyn.files import read_bytes, write_atomic
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.frames import world_to_body
from omnidyn.model.robot import Robot
from omnidyn.simulation.environments.environments import TASKS
from omnidyn.simulation.environments.layout import PATH, POSE, PREVIEW, columns_of
from omnidyn.simulation.environments.pool import largest_voltage
from omnidyn.simulation.environments.task import put_goal, put_path

SUFFIX, SCHEMA = ".npz", 1
MAX_BYTES, MOST_LAYERS = 32 * 2**20, 16
Layers = Sequence[tuple[Any, Any]]


@dataclass(frozen=True, eq=False)
class PolicyFile:
    """layers: (W, b) of each, shapes (out, in) and (out,). task: "velocity", "pose" or "path". dt [s]: of a step."""

    layers: tuple[tuple[FloatArray, FloatArray], ...]
    task: str
    dt: float

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise InputError("unknown task", got=self.task, expected=", ".join(TASKS), where="task")
        check_dt(self.dt)
        if not 1 <= len(self.layers) <= MOST_LAYERS:
            raise InputError("not a network", got=f"{len(self.layers)} layers", expected=f"1 to {MOST_LAYERS}")
        columns = None
        for k, (weight, bias) in enumerate(self.layers):
            fits = weight.ndim == 2 and bias.shape == weight.shape[:1] and columns in (None, weight.shape[-1])
            if not (fits and np.isfinite(weight).all() and np.isfinite(bias).all()):
                got = f"shapes {weight.shape} and {bias.shape}"
                expected = f"finite numbers, (out, {columns or 'in'}) and (out,)"
                raise InputError("not a layer", got=got, expected=expected, where=f"layer {k}")
            columns = len(weight)
        if self.layers[0][0].shape[1] != columns_of(TASKS[self.task], self.wheels):
            expected = f"{columns_of(TASKS[self.task], self.wheels)} columns for {self.wheels} wheels"
            got = f"{self.layers[0][0].shape[1]} columns"
            raise InputError(f"not a network of the task {self.task}", got=got, expected=expected, where="layer 0")

    @property
    def wheels(self) -> int:
        """That it drives."""
        return len(self.layers[-1][1])

    def __call__(self, observation: Any) -> FloatArray:
        """Actions, (*batch, wheels), of observations, (*batch, columns)."""
        values = np.asarray(observation, dtype=float)
        for k, (weight, bias) in enumerate(self.layers):
            values = (np.tanh(values) if k else values) @ weight.T + bias
        return np.clip(values, -1.0, 1.0)


def policy_of(layers: Layers, task: str, dt: float = DT) -> PolicyFile:
    """A policy of arrays, lists or tensors: (W, b) of each layer. Raises InputError for what is no network."""
    try:
        arrays = tuple((np.array(weight, dtype=float), np.array(bias, dtype=float)) for weight, bias in layers)
    except (TypeError, ValueError):
        raise InputError("not a network", got=type(layers).__name__, expected="(W, b) of each layer") from None
    return PolicyFile(arrays, task, dt)


def save_policy(policy: PolicyFile, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a policy as .npz. Raises InputError where the file exists, unless `force`."""
    layers, buffer = enumerate(policy.layers), io.BytesIO()
    numbers: Any = {f"{name}_{k}": part for k, layer in layers for name, part in zip("wb", layer, strict=True)}
    np.savez(buffer, schema=SCHEMA, task=np.array(policy.task), dt=policy.dt, **numbers)
    return write_atomic(path, buffer.getvalue(), force)


def load_policy(path: str | os.PathLike) -> PolicyFile:
    """Read a policy. Raises InputError for what is none; nothing in the file is ever run."""
    name = os.fspath(path)
    try:
        content = io.BytesIO(read_bytes(path, MAX_BYTES))
        with zipfile.ZipFile(content) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_BYTES:
                raise ValueError("too large")
        with np.load(content, allow_pickle=False) as table:
            if int(table["schema"]) != SCHEMA:
                raise ValueError("another schema")
            count = sum(key.startswith("w_") for key in table)
            layers = [(table[f"w_{k}"], table[f"b_{k}"]) for k in range(count)]
            task, dt = str(table["task"]), float(table["dt"])
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        got, remedy = f"{type(error).__name__}: {error}", "write it by omnidyn.control.policy.save_policy"
        expected = f"a policy of schema {SCHEMA}, of at most {MAX_BYTES // 2**20} MiB"
        raise InputError("not a policy", got=got, expected=expected, remedy=remedy, where=name) from None
    try:
        return policy_of(layers, task, dt)
    except InputError as error:
        raise error.at(name) from None


class Policy(Guarded):
    """A trained policy. See Controller.

    policy: a PolicyFile, or the path of one. dt [s]: between two steps, as the policy was trained. supply [V]: behind a
    duty.
    """

    name = "policy"

    def __init__(
        self, robot: Robot, *, policy: PolicyFile | str = "", dt: float = DT, supply: float | None = None
    ) -> None:
        self.policy = policy if isinstance(policy, PolicyFile) else load_policy(policy)
        self.dt = check_dt(dt)
        if abs(self.dt - self.policy.dt) > 1e-9:
            got, expected = f"steps of {self.dt:g} s", f"{self.policy.dt:g} s"
            raise InputError("the policy was trained with other steps", got=got, expected=expected, where="dt")
        super().__init__(robot, supply)

    def _take(self, robot: Robot) -> None:
        if robot.wheels.count != self.policy.wheels or robot.drive.kind == SPEED:
            got, expected = (
                f"{robot.wheels.count} wheels, {robot.drive.kind}",
                f"{self.policy.wheels} wheels, volts or duties",
            )
            raise InputError("the policy was trained for another drive", got=got, expected=expected, where="robot")
        super()._take(robot)
        self._estimator = self._filtered_twist = None  # it was trained on what sensors show
        self._largest = largest_voltage(robot)

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Any
    ) -> tuple[FloatArray, tuple[str, ...]]:
        full = self._largest * (self._per_volt if self.output == DUTY else 1.0)
        share = self.policy(self.observation(t, pose, twist, path, self._last / full))
        return share * full, ("voltage",) if (np.abs(share) == 1.0).any() else ()

    def observation(self, t: float, pose: FloatArray, twist: FloatArray, path: Any, last: FloatArray) -> FloatArray:
        """What its task shows it. Shape (columns,). last: the action before, (wheels,)."""
        task = TASKS[self.policy.task]
        column = np.zeros((columns_of(task, len(last)), 1))
        x, y, heading = pose.tolist()
        motion = path.at(t + self.dt * np.arange(PREVIEW[-1] + 1))
        if task == PATH:
            plain(put_path)(column, 0, x, y, heading, np.concatenate([motion.pose, motion.velocity], axis=1), 0)
        elif task == POSE:
            plain(put_goal)(column, 0, x, y, heading, *motion.pose[0].tolist())
        else:
            column[3:6, 0] = world_to_body(heading) @ motion.velocity[1]
        column[:3, 0], column[len(column) - len(last) :, 0] = twist, last
        return column[:, 0]
