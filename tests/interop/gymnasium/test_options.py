"""Options of reset, terms of the reward, own rewards and ends, pickling, robots behind a speed loop."""

import pickle

import numpy as np
import pytest
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import omnidyn
from omnidyn.errors import InputError
from omnidyn.interop.gymnasium import RobotEnv, RobotVectorEnv, check_vector_env
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.pool import largest_speed
from omnidyn.simulation.environments.task import ARM
from omnidyn.simulation.simulate import simulate

ACTIONS = np.random.default_rng(0).uniform(-0.6, 0.6, (10, 3)).repeat(10, axis=0)


@pytest.mark.parametrize("name", ["lekiwi", "robotino"])
def test_a_robot_behind_a_speed_loop_moves_as_simulate_moves_it(name):
    robot = omnidyn.load_robot(name)
    envs = Environments(robot, 2, Setting("pose", substeps=80), dtype=np.float64)
    envs.reset(seed=1)
    twists, poses = [envs.twist[1]], [envs.pose[1]]
    for action in ACTIONS:
        envs.step(np.tile(action, (2, 1)))
        twists.append(envs.twist[1])
        poses.append(envs.pose[1])
    run = simulate(robot, dt=0.02, wheel_speed_command=ACTIONS * largest_speed(robot), tol=1e-8)
    assert np.abs(run.twist).max() > 0.2
    assert np.abs(twists - run.twist).max() < 2e-3
    assert np.abs(poses - run.pose).max() < 1e-4


def test_a_late_set_point_counts_from_the_next_tick():
    robot = omnidyn.load_robot("lekiwi")
    robot = robot.replace(drive=robot.drive.replace(latency=0.0273))
    envs = Environments(robot, 1, Setting("pose", substeps=80), dtype=np.float64)
    envs.reset(seed=1)
    twists = [envs.twist[0]]
    for action in ACTIONS:
        envs.step(action[None])
        twists.append(envs.twist[0])
    run = simulate(robot, dt=0.02, wheel_speed_command=ACTIONS * largest_speed(robot), tol=1e-8)
    assert np.abs(twists - run.twist).max() < 2e-3


def test_a_step_that_is_no_whole_number_of_ticks_is_refused():
    with pytest.raises(InputError, match="not a whole number of ticks"):
        RobotEnv("lekiwi", dt=0.0205e-1)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_robots_behind_a_speed_loop_keep_what_gymnasium_promises(mode):
    check_vector_env(RobotVectorEnv(3, "lekiwi", "pose", duration=0.3, autoreset_mode=mode), steps=60)


def test_goal_start_and_twist_by_options():
    envs = RobotVectorEnv(3, "axebot", "pose", dtype=np.float64)
    goals = np.array([[0.5, 0.0, 0.0], [0.0, -0.5, 1.0], [0.1, 0.2, -1.0]])
    options = {"goal": goals, "start": (0.0, 0.0, 0.5), "twist": (0.1, -0.2, 0.3)}
    seen, _ = envs.reset(seed=1, options=options)
    core = envs.environments
    np.testing.assert_array_equal(core.goal, goals)
    np.testing.assert_array_equal(core.pose, [[0.0, 0.0, 0.5]] * 3)
    np.testing.assert_allclose(seen[:, :3], [[0.1, -0.2, 0.3]] * 3)
    np.testing.assert_allclose(seen[0, 3:7], [0.5 * np.cos(0.5), -0.5 * np.sin(0.5), np.sin(-0.5), np.cos(-0.5)])
    before = seen.copy()
    seen, _ = envs.reset(options={"goal": (1.0, 0.0, 0.0), "reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(seen[[0, 2]], before[[0, 2]])
    np.testing.assert_allclose(seen[1, 3:5], [1.0, 0.0])
    single, _ = RobotEnv("axebot", "velocity").reset(seed=1, options={"goal": (0.4, 0.0, 0.0)})
    np.testing.assert_allclose(single[3:6], [0.4, 0.0, 0.0], rtol=1e-6)


@pytest.mark.parametrize(
    "task, options, words",
    [
        ("pose", {"gaol": (0.0, 0.0, 0.0)}, "a reset has no such option; got gaol.*goal"),
        ("pose", {"goal": (0.0, 0.0)}, "goal: wrong shape"),
        ("pose", {"goal": (np.nan, 0.0, 0.0)}, "goal: no robot gets there"),
        ("path", {"goal": (0.0, 0.0, 0.0)}, "the task path has no goal"),
        ("velocity", {"start": (0.0, 0.0, 0.0)}, "the task velocity has no start"),
    ],
)
def test_options_that_cannot_be_are_refused(task, options, words):
    for envs in (RobotEnv("axebot", task), RobotVectorEnv(2, "axebot", task)):
        with pytest.raises(InputError, match=words):
            envs.reset(seed=1, options=options)


def test_an_unknown_argument_is_refused_with_the_nearest():
    for make in (lambda **options: RobotEnv(**options), lambda **options: RobotVectorEnv(2, **options)):
        with pytest.raises(InputError, match=r"an environment has no such option; got substep.*substeps"):
            make(substep=3)
        with pytest.raises(InputError, match="unknown render mode; got human"):
            make(render_mode="human")


@pytest.mark.parametrize("task", ["velocity", "pose", "path"])
def test_the_terms_of_the_reward_add_up_and_success_is_told(task):
    envs = RobotVectorEnv(4, "axebot", task, dtype=np.float64, duration=0.4)
    envs.reset(seed=2)
    core = envs.environments
    for _ in range(30):
        _, reward, _, _, infos = envs.step(np.full((4, 3), 0.3))
        names = [name for name in infos if name.startswith("reward_")]
        assert len(names) == 2
        np.testing.assert_array_equal(reward, infos[names[0]] + infos[names[1]])
        assert infos["_success"].all()
    if task == "velocity":
        off = core.twist - core.goal
        np.testing.assert_allclose(infos["reward_yaw_rate"], -((ARM * off[:, 2]) ** 2))
    envs.reset(seed=2, options={} if task == "path" else {"goal": (0.0, 0.0, 0.0)})
    *_, infos = envs.step(np.zeros((4, 3)))
    assert infos["success"].all() == (task != "path")


def test_a_success_in_the_same_step_stands_in_what_was_final():
    envs = RobotVectorEnv(2, "axebot", "pose", autoreset_mode="SameStep")
    envs.reset(seed=1, options={"goal": [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]})
    *_, terminated, _, infos = envs.step(np.zeros((2, 3)))
    assert terminated.tolist() == [True, False]
    assert infos["final_info"]["success"].tolist() == [True, False]
    assert infos["final_info"]["_success"].tolist() == [True, False]


class Careful(RobotVectorEnv):
    """Own reward: an action costs; own end: too far from the goal."""

    def judge(self, observation, reward, terminated, actions, infos):
        return reward - 0.1 * np.square(actions).sum(axis=1), np.hypot(*observation[:, 3:5].T) > 0.9


def test_a_subclass_has_a_reward_and_an_end_of_its_own():
    plain, own = (kind(64, "axebot", "pose", dtype=np.float64) for kind in (RobotVectorEnv, Careful))
    for envs in (plain, own):
        envs.reset(seed=4)
    actions = np.full((64, 3), 0.2)
    seen, reward, *_ = plain.step(actions)
    _, own_reward, terminated, *_ = own.step(actions)
    np.testing.assert_allclose(own_reward, reward - 0.1 * 3 * 0.2**2)
    np.testing.assert_array_equal(terminated, np.hypot(*seen[:, 3:5].T) > 0.9)
    assert 0 < terminated.sum() < 64
    own.step(actions)
    assert own.environments.steps_done[terminated].max() == 0  # those begin anew, the others go on
    assert own.environments.steps_done[~terminated].min() == 2


@pytest.mark.parametrize("threads", [1, 2])
def test_an_environment_pickles_and_goes_on_with_the_same_bits(threads):
    envs = RobotVectorEnv(200, "axebot", "pose", threads=threads)
    envs.reset(seed=3)
    actions = np.full((200, 3), 0.4, np.float32)
    envs.step(actions)
    copied = pickle.loads(pickle.dumps(envs))
    for _ in range(3):
        ours, theirs = envs.step(actions), copied.step(actions)
    for one, other in zip(ours[:4], theirs[:4], strict=True):
        np.testing.assert_array_equal(one, other)
    envs.close()
    copied.close()


def test_what_the_page_says_of_wrappers_and_ends_in_the_same_step_is_so():
    envs = RecordEpisodeStatistics(RobotVectorEnv(2, duration=0.1, autoreset_mode="SameStep"))
    envs.reset(seed=1)
    rewards, returns = [], []
    for _ in range(10):
        _, reward, _, truncated, infos = envs.step(np.full((2, 3), 0.3))
        rewards.append(reward)
        if truncated.any():
            returns.append(infos["episode"]["r"])
    np.testing.assert_allclose(returns, np.reshape(rewards, (2, 5, 2)).sum(axis=1), rtol=1e-6)
    with pytest.raises(ValueError, match="SAME_STEP"):
        NormalizeObservation(RobotVectorEnv(2, autoreset_mode="SameStep"))
    NormalizeObservation(RobotVectorEnv(2))
