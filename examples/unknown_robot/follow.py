"""Drives the robot of robot.py along an eight, by a controller of omnidyn that knows a robot file and nothing else.

python follow.py fit2.toml pid.toml
"""

import sys

import numpy as np
from robot import COUNTS, Robot

import omnidyn
from omnidyn.model.wheels import twist_from_wheel_speed

DT, COUNTED_FROM = 0.02, 25  # [s] between two commands; steps, in which the robot gets up to speed


def follow(file, controller="pid"):
    """Pose of the robot and of the path after each step, shape (steps, 3) each."""
    model, path, robot = omnidyn.load_robot(file), omnidyn.path("eight"), Robot()
    loop = omnidyn.load_controller(controller).make(model, dt=DT)
    _, before, pose = robot.measure()
    went = []
    for k in range(round(path.duration / DT)):
        battery, counts, seen = robot.measure()
        pose = pose if seen is None else seen  # the last one that the camera saw, late as it is
        twist = twist_from_wheel_speed(model.wheels, 2.0 * np.pi / COUNTS / DT * (counts - before))
        before = counts
        robot.step(loop.step(k * DT, pose, twist, path, battery), DT)
        went.append((robot.pose, path.at((k + 1) * DT).pose))
    return tuple(np.array(poses) for poses in zip(*went, strict=True))


def main(file, controller):
    """Say how far it was off."""
    robot, path = follow(file, controller)
    off = 1e3 * np.hypot(*(robot - path)[COUNTED_FROM:, :2].T)
    print(f"{np.sqrt(np.mean(off**2)):.2f} mm off in the mean, {off.max():.2f} mm at most")


if __name__ == "__main__":
    main(*sys.argv[1:3])
