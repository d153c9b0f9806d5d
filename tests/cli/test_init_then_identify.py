"""The two commands of a newcomer, all defaults, on each kind of robot, input and sensor; logs by another simulator.

The worlds have the paper's box of friction, which `init` does not write: the fit leaves something out, and the
diagnosis tries every candidate.
"""

import json
from dataclasses import replace
from itertools import product

import pytest

from benchmarks.ten_robots.robots import FOUR, MECANUM, SIX, THREE, Case, Sensors, init_options, write_log
from benchmarks.ten_robots.world import BOX, World
from omnidyn.cli import main
from omnidyn.model.robot_file import load_robot

COUNTS = 2048
INPUTS = {"volts": Sensors(), "duty": Sensors(duty=True), "speed loop": Sensors(loop=True)}
SENSORS = {"speeds": {"speeds": 0.1}, "counts": {"counts": COUNTS}, "pose": {"capture": (0.001, 0.003)}}


def omni(azimuth, **numbers):
    wheels = len(azimuth)
    return World(
        azimuth,
        (0.04,) * wheels,
        (0.15,) * wheels,
        4.0,
        0.05,
        2.1,
        0.016,
        25.0,
        12.0,
        (9.0, 5.0, 0.5),
        (1.5, 1.5, 0.03),
        shape=BOX,
        **numbers,
    )


ROBOTS = {
    "three omni": omni(THREE),
    "four omni": omni(FOUR),
    "six omni": omni(SIX),
    "four mecanum": omni(MECANUM["azimuth"], roller=MECANUM["roller"]),
}


# Every input with every sensor, the robots by turns; bench ten_robots has others, against the truth.
CASES = [(list(ROBOTS)[k % len(ROBOTS)], *pair) for k, pair in enumerate(product(INPUTS, SENSORS))]


@pytest.mark.long
@pytest.mark.parametrize("kind, put_in, sensor", CASES)
def test_init_then_identify(kind, put_in, sensor, tmp_path, capsys):
    world, sensors = ROBOTS[kind], replace(INPUTS[put_in], **SENSORS[sensor])
    more, facts = (), ()
    if sensors.loop:
        world = replace(world, loop=(0.6, 4.0, 100.0))
        more = ("--speed-loop", "0.6,4,100")
    if sensors.duty:
        facts += ("--assume", "d=duty/255")
    if sensors.counts:
        facts += ("--assume", f"a=ticks/{COUNTS}")
    case = Case(f"{kind} {put_in} {sensor}", world, sensors, init_options(world, *more), facts, seconds=8.0)
    robot, log, fit = (tmp_path / name for name in ("mine.toml", "log.csv", "fit.toml"))
    write_log(case, 1, log)
    assert main(["init", "mine", *case.init, "-o", str(robot)]) == 0
    capsys.readouterr()
    code = main(["identify", str(log), "--robot", str(robot), "-o", str(fit), "--json", *facts])
    out, err = capsys.readouterr()
    answer = json.loads(out)
    assert code in (0, 4), err
    assert answer["lack_of_fit"] is not None
    assert load_robot(fit).wheels.count == len(world.azimuth)
