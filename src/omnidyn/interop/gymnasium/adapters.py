"""Environments as Stable-Baselines3, rsl_rl and PyTorch take them. Each library is imported where it is asked for."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from omnidyn.control.feedforward import DT
from omnidyn.control.policy import PolicyFile, policy_of
from omnidyn.errors import InputError, MissingExtraError
from omnidyn.interop.gymnasium.vector import RobotVectorEnv


def _library(name: str, package: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise MissingExtraError(f"this adapter needs {package}", remedy=f"pip install {package}") from None


def _check_mode(envs: RobotVectorEnv) -> None:
    """Raises InputError for a mode in which these libraries would learn from steps that are none."""
    if envs.environments.autoreset != "same_step":
        got = envs.metadata["autoreset_mode"].value
        raise InputError("another autoreset mode", got=got, expected="SameStep", where="autoreset_mode")


def sb3_env(envs: RobotVectorEnv) -> Any:
    """A VecEnv of Stable-Baselines3. The environments reset in the same step; their observations may be views."""
    base: Any = _library("stable_baselines3.common.vec_env", "stable-baselines3").VecEnv
    _check_mode(envs)

    class Sb3Env(base):
        def __init__(self) -> None:
            self.envs = envs
            super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

        def reset(self) -> Any:
            seeds = getattr(self, "_seeds", [None])
            self.reset_infos = [{} for _ in range(self.num_envs)]
            observation, _ = envs.reset(seed=seeds[0])
            self._seeds = [None] * self.num_envs
            return np.array(observation)

        def step_async(self, actions: Any) -> None:
            self.actions = actions

        def step_wait(self) -> Any:
            observation, reward, terminated, truncated, infos = envs.step(self.actions)
            words: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
            for robot in np.flatnonzero(terminated | truncated):
                words[robot]["TimeLimit.truncated"] = bool(truncated[robot] and not terminated[robot])
                words[robot]["terminal_observation"] = infos["final_obs"][robot]
                words[robot]["is_success"] = bool(infos["final_info"]["success"][robot])
            return np.array(observation), np.array(reward), terminated | truncated, words

        def close(self) -> None:
            envs.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(envs, attr_name)] * len(np.arange(self.num_envs)[_all(indices)])

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            setattr(envs, attr_name, value)

        def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **options: Any) -> list[Any]:
            raise NotImplementedError("robots of one kernel have no methods of their own")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * len(np.arange(self.num_envs)[_all(indices)])

    return Sb3Env()


def _all(indices: Any) -> Any:
    return slice(None) if indices is None else np.atleast_1d(indices)


def policy_of_sb3(model: Any, task: str, dt: float = DT) -> PolicyFile:
    """The policy of a trained PPO or A2C of Stable-Baselines3, which `omnidyn track --controller` drives.

    What VecNormalize does to observations, z = (x - mean)/sqrt(var + epsilon), is folded into the first layer:
    W z + b = (W/s) x + (b - W mean/s). That it clips them, at 10 by default, is left out.
    Raises InputError for a network of other layers than Linear and Tanh.
    """
    head, trunk = getattr(model.policy, "action_net", None), getattr(model.policy, "mlp_extractor", None)
    if head is None or trunk is None:
        got = f"{type(model).__name__} of {type(model.policy).__name__}"
        raise InputError("no such policy", got=got, expected='PPO or A2C of "MlpPolicy"', where="model")
    modules = [*trunk.policy_net, head]
    kinds = [type(module).__name__ for module in modules]
    if kinds != ["Linear", "Tanh"] * (len(kinds) // 2) + ["Linear"]:
        got, expected = ", ".join(kinds), "Linear and Tanh by turns, as MlpPolicy has it by default"
        raise InputError("no network with tanh", got=got, expected=expected, where="model")
    layers = [
        (module.weight.detach().cpu().numpy().astype(float), module.bias.detach().cpu().numpy().astype(float))
        for module in modules[::2]
    ]
    normalised = model.get_vec_normalize_env()
    if normalised is not None and normalised.norm_obs:
        moments, (weight, bias) = normalised.obs_rms, layers[0]
        scaled = weight / np.sqrt(np.asarray(moments.var) + normalised.epsilon)
        layers[0] = scaled, bias - scaled @ np.asarray(moments.mean)
    return policy_of(layers, task, dt)


def torch_env(envs: RobotVectorEnv) -> Any:
    """The environments with tensors of PyTorch, by DLPack: without copies where the environments make none.

    reset and step as of a VectorEnv; infos are as they are. Observations are written again by the next step where
    `copy=False`.
    """
    torch = _library("torch", "torch")

    class TorchEnv:
        num_envs = envs.num_envs

        def reset(self, **options: Any) -> Any:
            observation, infos = envs.reset(**options)
            return torch.from_dlpack(observation), infos

        def step(self, actions: Any) -> Any:
            *columns, infos = envs.step(np.from_dlpack(actions.detach().cpu()))
            return *(torch.from_dlpack(column) for column in columns), infos

        def close(self) -> None:
            envs.close()

    return TorchEnv()


def rsl_rl_env(envs: RobotVectorEnv, device: str = "cpu") -> Any:
    """A VecEnv of rsl_rl: observations "policy", and "critic" beside it with what is privileged, in a TensorDict.

    What ends by time only stands in extras["time_outs"]. The environments reset in the same step.
    """
    torch, tensordict = _library("torch", "torch"), _library("tensordict", "tensordict")
    base: Any = _library("rsl_rl.env", "rsl-rl-lib").VecEnv
    _check_mode(envs)
    core = envs.environments

    class RslRlEnv(base):
        num_envs, num_actions, cfg = envs.num_envs, core.wheels, core.setting
        max_episode_length = core.setting.steps

        def __init__(self) -> None:
            self.device = device
            self._seen = envs.reset()

        @property
        def episode_length_buf(self) -> Any:
            return torch.as_tensor(core.steps_done.astype(np.int64)).to(device)

        @episode_length_buf.setter
        def episode_length_buf(self, steps: Any) -> None:
            core.steps_done = np.asarray(steps.cpu())

        def get_observations(self) -> Any:
            observation, infos = self._seen
            groups = {"policy": observation}
            if "privileged" in infos:
                groups["critic"] = np.concatenate([observation, infos["privileged"]], axis=1)
            tensors = {name: torch.as_tensor(np.ascontiguousarray(value)).to(device) for name, value in groups.items()}
            return tensordict.TensorDict(tensors, batch_size=[envs.num_envs])

        def step(self, actions: Any) -> Any:
            observation, reward, terminated, truncated, infos = envs.step(actions.detach().cpu().numpy())
            self._seen = observation, infos
            flags = {"rewards": reward, "dones": terminated | truncated, "time_outs": truncated & ~terminated}
            tensors = {name: torch.as_tensor(np.array(value)).to(device) for name, value in flags.items()}
            extras = {"time_outs": tensors["time_outs"]}
            return self.get_observations(), tensors["rewards"], tensors["dones"].long(), extras

    return RslRlEnv()
