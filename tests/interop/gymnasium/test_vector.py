"""RobotVectorEnv and RobotEnv: Gymnasium's checker, the same bits in any batch, infos of ends, rollouts as Runs."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import omnidyn
from omnidyn.errors import InputError
from omnidyn.interop.gymnasium import RobotEnv, RobotVectorEnv, rollout

TASKS = ["velocity", "pose", "path"]
RANDOM = {"push": (1.0, 1.0, 0.1), "interval": 0.1, "latency": 0.03, "uncertainty": ""}


@pytest.mark.parametrize("task", TASKS)
def test_gymnasiums_checker_is_content(task):
    check_env(gymnasium.make(f"omnidyn/{task.capitalize()}-v0", privileged=True).unwrapped)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_robot_has_the_same_bits_in_any_batch_and_on_any_threads(task, dtype):
    """Of 1, 65 and 300 robots; also after a partial reset of others; and as a single environment."""
    random = np.random.default_rng(4)
    actions = random.uniform(-1.2, 1.2, (40, 300, 3)).astype(dtype)
    runs = {}
    for count, threads in ((1, 1), (65, 1), (300, 3)):
        envs = RobotVectorEnv(count, task=task, dtype=dtype, threads=threads, duration=0.3, **RANDOM)
        seen = [envs.reset(seed=11)[0]]
        for k, action in enumerate(actions):
            if k in (7, 23) and count > 1:
                envs.reset(options={"reset_mask": np.arange(count) > 2})
            observation, reward, *_ = envs.step(action[:count])
            seen += [observation, reward[:, None]]
        runs[count] = [part[:2] for part in seen]
        envs.close()
    single = RobotEnv(task=task, dtype=dtype, duration=0.3, **RANDOM)
    assert np.array_equal(single.reset(seed=11)[0], runs[1][0][0])
    assert np.array_equal(single.step(actions[0, 0])[0], runs[1][1][0])
    for one, some, many in zip(runs[1], runs[65], runs[300], strict=True):
        assert np.array_equal(one[0], many[0])
        assert np.array_equal(some, many)


def test_an_end_in_the_same_step_shows_the_last_observation():
    envs = RobotVectorEnv(70, duration=0.1, autoreset_mode=AutoresetMode.SAME_STEP, privileged=True)
    other = RobotVectorEnv(70, duration=0.1, autoreset_mode="Disabled")
    start, _ = envs.reset(seed=1)
    other.reset(seed=1)
    for k in range(5):
        actions = envs.action_space.sample()
        observation, reward, _, truncated, infos = envs.step(actions)
        end, reward_of_end, _, over, _ = other.step(actions)
        assert np.array_equal(reward, reward_of_end)
        assert (truncated == (k == 4)).all()
    assert over.all()
    assert np.array_equal(np.stack(infos["final_obs"]), end)
    assert infos["_final_obs"].all()
    assert not observation[:, :3].any()
    assert (observation[:, 3:6] != start[:, 3:6]).all()
    with pytest.raises(InputError, match="nobody resets them"):
        other.step(actions)


def test_views_are_written_again_and_copies_are_not():
    actions = np.ones((64, 3), np.float32)
    for copy in (True, False):
        envs = RobotVectorEnv(64, copy=copy)
        envs.reset(seed=1)
        first = envs.step(actions)[0]
        before = first.copy()
        assert np.shares_memory(first, envs.environments.buffers.observation) is not copy
        envs.step(-actions)
        assert np.array_equal(first, before) is copy


def test_an_action_that_is_no_number_is_none():
    first, second = (RobotVectorEnv(2) for _ in range(2))
    for envs, action in ((first, np.nan), (second, 0.0)):
        envs.reset(seed=1)
        envs.step(np.ones((2, 3)))
        envs.seen = envs.step(np.full((2, 3), action))[0]
    assert np.array_equal(first.seen, second.seen)


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: RobotVectorEnv(2, autoreset_mode="never"), "autoreset mode"),
        (lambda: RobotVectorEnv(2, robot="axbot"), "axebot"),
        (lambda: RobotVectorEnv(2).reset(options={"reset_mask": np.zeros(2, bool)}), "nobody to reset"),
        (lambda: RobotVectorEnv(2).reset(seed=1, options={"reset_mask": np.ones(3, bool)}), "not a mask"),
    ],
)
def test_what_cannot_be_is_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


@pytest.mark.parametrize("key", ["body.mass_kg", "wheels.robot_radius_m"])
def test_robots_of_a_sample_live_one_after_the_other(key):
    """Drawn as parameters, and as robots, where a number does not scale."""
    sample = omnidyn.sample(omnidyn.load_robot("axebot"), 5, factors={key: (0.7, 1.3)})
    envs = RobotVectorEnv(7, sample, dtype=np.float64)
    envs.reset(seed=1)
    actions = np.repeat([[0.2, -0.9, 0.8]], 7, axis=0)
    for _ in range(10):
        envs.step(actions)
    for k, twist in enumerate(envs.environments.twist):
        run = omnidyn.simulate(sample.robot(k % 5), np.repeat(6.0 * actions[:1], 10, axis=0), 0.02)
        assert twist == pytest.approx(run.twist[-1], abs=1e-12)


@pytest.mark.parametrize("task", TASKS)
def test_a_rollout_is_a_run_that_simulate_repeats(task):
    envs = RobotVectorEnv(3, task=task, dtype=np.float64, substeps=20, duration=1.0)
    random = np.random.default_rng(1)
    run = rollout(envs, lambda seen: random.uniform(-1, 1, (len(seen), 3)), index=1, seed=5)
    start = {} if run.pose is None else {"pose": run.pose[0]}
    again = omnidyn.simulate(envs.environments.robot, run.voltage[:-1], 0.02, **start)
    assert len(run) == 51
    assert np.abs(run.twist - again.twist).max() < 1e-12
    assert run.pose is None or np.abs(run.pose - again.pose).max() < 3e-6
    assert (run.pose is None) == (task == "velocity")
