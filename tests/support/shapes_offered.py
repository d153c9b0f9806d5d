"""Steady states of worlds whose shape of friction is offered, or not: logs that share no code with omnidyn."""

import numpy as np

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.support.plain_world import World, at_wheels, fan, on_rollers, spoiled, steady_logs, turned_box

AXEBOT = load_robot("axebot")
YAW = ((0.0, 0.0, 1.0), 0.099, 0.099)
OFFERED = {
    "box": {"elements": turned_box(0, 2.4, 1.6, 0.099)},
    "disc": {"cone": (2.0, 2.0), "elements": [YAW]},
    "ellipse": {"cone": (2.4, 1.6), "elements": [YAW]},
    "wheel": {"elements": at_wheels(World(), 0.9)},
}
NOT_OFFERED = {
    "box turned by 45 deg": {"elements": turned_box(45, 2.4, 1.6, 0.099)},
    "rollers": {"elements": [*on_rollers(World(), 1.2), YAW]},
    "forward and backward": {
        "elements": [((1.0, 0.0, 0.0), 2.0, 2.6), ((0.0, 1.0, 0.0), 1.6, 1.6), YAW],
    },
}
CLEAN: dict = {}


def study(name, seed, speeds=(0.4,), step=15, **noise):
    """Of spoiled logs of a world, simulated once."""
    key = name, speeds, step
    if key not in CLEAN:
        CLEAN[key] = steady_logs(World(**(OFFERED | NOT_OFFERED)[name]), fan(speeds, step))
    random, runs = np.random.default_rng(seed), []
    for twist, log in CLEAN[key]:
        t, current, speed = spoiled(log, random, **noise)
        runs.append(Run(t=t, current=current, wheel_speed=speed, twist_command=np.tile(twist, (len(t), 1))))
    return identify(runs, AXEBOT, SteadyState()).study
