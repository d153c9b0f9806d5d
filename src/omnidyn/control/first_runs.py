"""Short closed loops that need every kernel of the controllers: see identification/first_runs.py."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.closed_loop import track
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.paths.path import path
from omnidyn.control.pid import Pid
from omnidyn.control.pid_batch import PidBatch
from omnidyn.control.tracking import Tracking
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot

PATH, SECONDS = "circle", 0.2  # [s]


def first_runs() -> list[tuple[str, Callable[[], object]]]:
    """(what it stands for, how to make it), in the order in which they are wanted. Compiled, each takes below 1 s."""
    paper, mecanum = load_robot("axebot"), load_robot("mecanum")
    return [
        ("predictive controller", partial(_tracked, paper)),
        ("predictive controller, any friction", partial(_tracked, mecanum)),
        ("predictive controllers of many robots", partial(_many, paper)),
        ("a measurement that is missing", partial(_bridged, paper)),
        ("pid of many robots", partial(_many_by_pid, paper)),
        ("poses of a camera", partial(_seen, paper)),
    ]


def _seen(robot: Robot) -> FloatArray:
    """A step of one robot and of two whose poses arrive late."""
    late = robot.replace(sensors=Sensors(pose_delay=0.06, pose_rate=30.0, pose_noise=1e-3))
    at, route = np.zeros((2, 3)), path(PATH)
    Pid(late).step(0.0, at[0], at[0], route)
    return PidBatch(Pid(late), 2).step_batch(0.0, at, at, route)


def _tracked(robot: Robot) -> Tracking:
    """A few steps along a path."""
    return track(robot, PATH, "mpc", duration=SECONDS)


def _bridged(robot: Robot) -> FloatArray:
    """A step, and one without a measurement."""
    controller, rest, route = Mpc(robot), np.zeros(3), path(PATH)
    controller.step(0.0, rest, rest, route)
    return controller.step(controller.dt, np.full(3, np.nan), rest, route)


def _many(robot: Robot) -> FloatArray:
    """One step of two robots."""
    at = np.zeros((2, 3))
    return Mpc(robot).batch(2).step_batch(0.0, at, at, path(PATH))


def _many_by_pid(robot: Robot) -> FloatArray:
    """One step of two robots."""
    at = np.zeros((2, 3))
    return PidBatch(Pid(robot), 2).step_batch(0.0, at, at, path(PATH))
