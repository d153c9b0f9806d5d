"""Environments against a plain Python loop, bit for bit: random actions, random partial resets, new seeds."""

import numpy as np
import pytest

import omnidyn
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.pool import Range
from tests.support.plain_environment import PlainVelocity

AXEBOT = omnidyn.load_robot("axebot")
SETTING = Setting(duration=0.14, substeps=2, randomise={"body.mass_kg": Range(0.8, 1.2, when="startup")})


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("autoreset", ["next_step", "same_step", "disabled"])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.some(5)
def test_the_same_bits_as_a_plain_loop(dtype, autoreset, threads):
    count, random = 70, np.random.default_rng(3)
    envs = Environments(AXEBOT, count, SETTING, autoreset=autoreset, dtype=dtype, threads=threads)
    rows, spread = envs.numbers.pool, envs.numbers.spread
    plain = [PlainVelocity(rows[k % len(rows)], 3, k, SETTING.steps, spread, 2, autoreset) for k in range(count)]
    assert np.array_equal(envs.reset(seed=7), [one.reset(seed=7) for one in plain])
    for k in range(40):
        if k % 9 == 4 or autoreset == "disabled":
            mask = random.random(count) < 0.3
            mask |= envs.over if autoreset == "disabled" else mask
            seed = 100 + k if k % 3 == 0 else None
            seen = envs.reset(mask, seed).copy()
            for robot in np.flatnonzero(mask):
                assert np.array_equal(seen[robot], plain[robot].reset(seed=seed))
        action = random.uniform(-1.3, 1.3, (count, 3)).astype(dtype)
        step = envs.step(action)
        for robot, one in enumerate(plain):
            observation, reward, over, final = one.step(action[robot])
            assert np.array_equal(step.observation[robot], observation)
            assert step.reward[robot] == reward
            assert step.truncated[robot] == over
            assert not step.terminated[robot]
            assert final is None or np.array_equal(envs.final[robot], final)
    envs.close()
