"""Train a small policy on the CPU: an evolution strategy on a path under pushes, for robots that are not quite alike.

Then the policy drives a robot that it has not met, beside `mpc`, the best proportional control, and no action at all.
"""

import numpy as np

import omnidyn
from omnidyn.control.controller import Guarded
from omnidyn.control.policy import Policy, policy_of, save_policy
from omnidyn.interop.gymnasium import RobotVectorEnv
from omnidyn.simulation.environments.pool import Range

PAIRS, EPISODES, GENERATIONS = 32, 8, 300  # candidates are tried in pairs, beside the best so far on either side
HIDDEN, SIGMA, RATE = 16, 0.05, 0.03
SCALE = np.array([1, 1, 3, 0.05, 0.05, 0.1, *[1, 1, 1] * 2, *[1] * 3], dtype=np.float32)  # of what is observed

robot = omnidyn.load_robot("axebot")
ranges = {"body.mass_kg": Range(0.8, 1.2), "friction.axes.coulomb": Range(0.7, 1.3)}  # anew in each episode
envs = RobotVectorEnv(
    2 * PAIRS * EPISODES,
    robot,
    "path",
    path="eight",
    duration=2.0,
    push=(0.5, 0.5, 0.03),
    randomise=ranges,
    autoreset_mode="Disabled",
    copy=False,
)
columns, wheels = envs.single_observation_space.shape[0], robot.wheels.count
shapes = [(HIDDEN, columns), (HIDDEN,), (wheels, HIDDEN), (wheels,)]
ends = np.cumsum([np.prod(shape) for shape in shapes])


def layers_of(numbers):
    """W_0, b_0, W_1, b_1 of rows of numbers."""
    parts = np.split(numbers, ends[:-1], axis=-1)
    return [part.reshape(*numbers.shape[:-1], *shape) for part, shape in zip(parts, shapes, strict=True)]


def rewards(candidates, seed):
    """Mean reward of an episode, of each candidate: all of them drive at once, under the same pushes."""
    w0, b0, w1, b1 = (part.astype(np.float32) for part in layers_of(candidates))
    observation, _ = envs.reset(seed=seed)
    total = np.zeros(envs.num_envs)
    for _ in range(envs.environments.setting.steps):
        seen = (observation / SCALE).reshape(len(candidates), EPISODES, columns)
        hidden = np.tanh(seen @ w0.swapaxes(1, 2) + b0[:, None])
        observation, reward, *_ = envs.step((hidden @ w1.swapaxes(1, 2) + b1[:, None]).reshape(-1, wheels))
        total += reward
    return total.reshape(len(candidates), EPISODES).mean(axis=1)


# Salimans et al., "Evolution Strategies as a Scalable Alternative to Reinforcement Learning" (2017): the slope of the
# reward, smoothed by noise, from ranks of pairs; steps as those of Adam.
random = np.random.default_rng(0)
best = np.concatenate([random.standard_normal(ends[0]) / np.sqrt(columns), np.zeros(ends[-1] - ends[0])])
slope, square = np.zeros(len(best)), np.zeros(len(best))
for generation in range(1, GENERATIONS + 1):
    noise = random.standard_normal((PAIRS, len(best)))
    reward = rewards(np.concatenate([best + SIGMA * noise, best - SIGMA * noise]), generation)
    rank = np.argsort(np.argsort(reward)) / (len(reward) - 1)
    new = (rank[:PAIRS] - rank[PAIRS:]) @ noise / PAIRS
    slope, square = 0.9 * slope + 0.1 * new, 0.99 * square + 0.01 * new**2
    best += RATE * slope / (1 - 0.9**generation) / (np.sqrt(square / (1 - 0.99**generation)) + 1e-8)
    if generation % 100 == 0:
        print(f"generation {generation}: {1e3 * np.sqrt(-reward.mean() / envs.environments.setting.steps):.1f} mm rms")
envs.close()

w0, b0, w1, b1 = layers_of(best)
policy = policy_of([(w0 / SCALE, b0), (w1, b1)], "path", dt=0.02)
save_policy(policy, "policy.npz", force=True)  # omnidyn track axebot --path eight --controller policy.npz


class Proportional(Guarded):
    """Volts in proportion to the way to the path: gain [1/s^2] times the error, by the inverse of the input matrix."""

    name = "proportional"

    def __init__(self, robot, gain, dt=0.02):
        self.gain, self.dt = gain, dt
        self.inverse = np.linalg.pinv(omnidyn.state_space(robot).B)
        super().__init__(robot)

    def _output(self, t, dt, pose, twist, path):
        x, y, heading = path.at(t).pose - pose
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        return self.gain * self.inverse @ [cos * x + sin * y, cos * y - sin * x, heading], ()


# A robot heavier than the one that everybody believes in, with more friction, under a push.
body, axes = robot.body, robot.friction.axes
plant = robot.replace(
    name="another robot",
    body=body.replace(mass=1.15 * body.mass),
    friction=robot.friction.replace(axes=axes.replace(coulomb=tuple(1.2 * level for level in axes.coulomb))),
)
around = {"plant": plant, "push": (0.4, -0.3, 0.02), "skip": 1.0}
gains = np.geomspace(10.0, 1000.0, 9)  # the best of them for this very robot
proportional = min(
    (Proportional(robot, gain) for gain in gains),
    key=lambda c: omnidyn.track(robot, "eight", c, **around).rmse_position,
)
nothing = Proportional(robot, 0.0)
nothing.name = "zero action"
tracked = omnidyn.track(robot, "eight", [Policy(robot, policy=policy), "mpc", proportional, nothing], **around)
for one in tracked:
    print(f"{one.controller:14} {1e3 * one.rmse_position:8.2f} mm {1e3 * one.rmse_heading:8.2f} mrad")
error = {one.controller: one.rmse_position for one in tracked}
assert error["policy"] < min(error["proportional"], error["zero action"])
