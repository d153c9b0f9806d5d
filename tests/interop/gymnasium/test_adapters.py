"""Adapters, with stand-ins of the libraries they are for: the classes and functions that an adapter asks of each."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from omnidyn.errors import InputError, MissingExtraError
from omnidyn.interop.gymnasium import RobotVectorEnv, policy_of_sb3, rsl_rl_env, sb3_env, torch_env


class Tensor(np.ndarray):
    """An array with what an adapter asks of a tensor."""

    def detach(self):
        return self

    def cpu(self):
        return self

    def to(self, device):
        return self

    def numpy(self):
        return np.asarray(self)

    def long(self):
        return self.astype(np.int64)


class Sb3:
    """What the constructor of a VecEnv of Stable-Baselines3 does, and its `step`."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self._seeds, self.render_mode = [None] * num_envs, self.get_attr("render_mode")[0]

    def seed(self, seed):
        self._seeds = [seed + k for k in range(self.num_envs)]

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()


@pytest.fixture
def libraries(monkeypatch):
    def module(name, **values):
        made = ModuleType(name)
        vars(made).update(values)
        monkeypatch.setitem(sys.modules, name, made)

    torch = {
        "as_tensor": lambda value: np.asarray(value).view(Tensor),
        "from_dlpack": lambda value: np.from_dlpack(value).view(Tensor),
    }
    module("torch", **torch)
    module("tensordict", TensorDict=lambda groups, batch_size: {**groups, "batch_size": batch_size})
    module("rsl_rl")
    module("rsl_rl.env", VecEnv=object)
    for name in ("stable_baselines3", "stable_baselines3.common"):
        module(name)
    module("stable_baselines3.common.vec_env", VecEnv=Sb3)


def made(**options):
    return RobotVectorEnv(5, duration=0.08, autoreset_mode="SameStep", **options)


@pytest.mark.usefixtures("libraries")
def test_stable_baselines3_gets_ends_as_it_wants_them():
    envs, plain = sb3_env(made()), made()
    envs.seed(3)
    assert np.array_equal(envs.reset(), plain.reset(seed=3)[0])
    for k in range(5):
        actions = np.full((5, 3), 0.5, np.float32)
        observation, reward, done, infos = envs.step(actions)
        expected = plain.step(actions)
        assert np.array_equal(observation, expected[0])
        assert np.array_equal(reward, expected[1])
        assert (done == (k == 3)).all()
        assert all(("terminal_observation" in info) == (k == 3) for info in infos)
        if k == 3:
            assert all(info["TimeLimit.truncated"] for info in infos)
            assert np.array_equal(infos[2]["terminal_observation"], expected[4]["final_obs"][2])
    assert envs.env_is_wrapped(object) == [False] * 5
    assert envs.get_attr("num_envs", [1, 2]) == [5, 5]


@pytest.mark.usefixtures("libraries")
def test_rsl_rl_gets_groups_time_outs_and_lengths():
    envs = rsl_rl_env(made(privileged=True))
    first = envs.get_observations()
    assert first["policy"].shape == (5, 9)
    assert first["critic"].shape == (5, 9 + envs_columns())
    assert first["batch_size"] == [5]
    envs.episode_length_buf = np.array([0, 1, 2, 3, 3]).view(Tensor)
    observation, reward, done, extras = envs.step(np.full((5, 3), 0.3).view(Tensor))
    assert done.tolist() == extras["time_outs"].tolist() == [0, 0, 0, 1, 1]
    assert envs.episode_length_buf.tolist() == [1, 2, 3, 0, 0]
    assert reward.shape == (5,)
    assert (observation["policy"][:, 2] != 0.0).tolist() == [True, True, True, False, False]
    assert (envs.num_actions, envs.max_episode_length) == (3, 4)


def envs_columns():
    return RobotVectorEnv(1).environments.privileged.shape[1]


@pytest.mark.usefixtures("libraries")
def test_pytorch_shares_memory():
    plain = made(copy=False)
    envs = torch_env(plain)
    observation, _ = envs.reset(seed=1)
    assert np.shares_memory(observation, plain.environments.buffers.observation)
    observation, reward, terminated, truncated, infos = envs.step(np.ones((5, 3), np.float32).view(Tensor))
    assert np.shares_memory(reward, plain.environments.buffers.reward)
    assert terminated.dtype == truncated.dtype == np.bool_
    assert {*infos} >= {"reward_velocity", "reward_yaw_rate", "success"}


@pytest.mark.usefixtures("libraries")
def test_another_mode_is_refused():
    for adapter in (sb3_env, rsl_rl_env):
        with pytest.raises(InputError, match="SameStep"):
            adapter(RobotVectorEnv(2))


def test_a_missing_library_is_named():
    for adapter, package in ((sb3_env, "stable-baselines3"), (rsl_rl_env, "torch"), (torch_env, "torch")):
        with pytest.raises(MissingExtraError, match=f"pip install {package}"):
            adapter(made())


class Linear:
    """A layer as of PyTorch."""

    def __init__(self, random, columns, rows):
        self.weight, self.bias = (random.standard_normal(shape).view(Tensor) for shape in ((rows, columns), (rows,)))

    def __call__(self, x):
        return x @ np.asarray(self.weight).T + np.asarray(self.bias)


class Tanh:
    def __call__(self, x):
        return np.tanh(x)


def model_of(modules, head, normalised=None):
    policy = SimpleNamespace(mlp_extractor=SimpleNamespace(policy_net=modules), action_net=head)
    return SimpleNamespace(policy=policy, get_vec_normalize_env=lambda: normalised)


@pytest.mark.parametrize("is_normalised", [True, False])
def test_a_policy_of_stable_baselines_acts_as_its_network_with_the_scales_folded_in(is_normalised):
    random = np.random.default_rng(3)
    modules, head = [Linear(random, 9, 8), Tanh(), Linear(random, 8, 8), Tanh()], Linear(random, 8, 3)
    moments = SimpleNamespace(mean=random.standard_normal(9), var=random.uniform(0.1, 4.0, 9))
    scales = SimpleNamespace(norm_obs=True, obs_rms=moments, epsilon=1e-8) if is_normalised else None
    policy = policy_of_sb3(model_of(modules, head, scales), "velocity")
    seen = random.standard_normal((50, 9))
    values = (seen - moments.mean) / np.sqrt(moments.var + 1e-8) if is_normalised else seen
    for module in (*modules, head):
        values = module(values)
    np.testing.assert_allclose(policy(seen), np.clip(values, -1.0, 1.0), rtol=1e-9, atol=1e-12)


def test_a_network_that_is_no_tanh_is_refused():
    random = np.random.default_rng(3)
    relu = type("ReLU", (Tanh,), {})()
    with pytest.raises(InputError, match="no network with tanh; got Linear, ReLU, Linear"):
        policy_of_sb3(model_of([Linear(random, 9, 8), relu], Linear(random, 8, 3)), "velocity")
    with pytest.raises(InputError, match="no such policy"):
        policy_of_sb3(SimpleNamespace(policy=SimpleNamespace()), "velocity")
