"""Train a policy by PPO of Stable-Baselines3 in a minute, drive with it, and draw the drive.

pip install "omnidyn[rl]" stable-baselines3
"""

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import omnidyn
from omnidyn.control.policy import Policy
from omnidyn.interop.gymnasium import RobotVectorEnv, policy_of_sb3, sb3_env

robot = omnidyn.load_robot("axebot")
envs = RobotVectorEnv(256, robot, "path", path="eight", duration=2.0, autoreset_mode="SameStep")
model = PPO(
    "MlpPolicy",
    VecNormalize(sb3_env(envs), gamma=0.8),
    n_steps=16,
    batch_size=1024,
    n_epochs=5,
    gamma=0.8,
    learning_rate=lambda left: 2e-3 * left,
    policy_kwargs={"net_arch": [64], "log_std_init": -1.0},
    seed=0,
    device="cpu",
)
model.learn(2_000_000)
policy = policy_of_sb3(model, "path")  # the scales of VecNormalize are in it
tracked = omnidyn.track(robot, "eight", [Policy(robot, policy=policy), "pid"])
for one in tracked:
    print(f"{one.controller:8} {1e3 * one.rmse_position:.1f} mm")
tracked.plot().savefig("drive.png")
