"""Logs of laws of friction along the direction of travel, or at the wheels, by the integrators of tests/reference.

They share no code with simulation/: differential equations of bristles, events for what sticks. How far a law is from
none is told by differences of the same integrators.
"""

from functools import lru_cache

import numpy as np

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key, friction_keys
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import bristles, modes

DIRECTION, WHEELS = "direction", "wheels"
DT, ROWS, PROGRAMS = 0.02, 360, 4
PLAIN = {
    DIRECTION: DirectionFriction(coulomb=(2.2, 1.7), viscous=0.9, yaw_coulomb=0.12, yaw_viscous=0.012),
    WHEELS: WheelFriction(coulomb=0.8, viscous=0.35),
}
FALL_OF = {
    DIRECTION: {"breakaway": (2.9, 2.25), "stribeck_speed": 0.05, "yaw_breakaway": 0.16, "yaw_stribeck_speed": 0.5},
    WHEELS: {"breakaway": 1.1, "stribeck_speed": 0.05},
}
STIFF = {DIRECTION: {"stiffness": 2e3, "yaw_stiffness": 12.0}, WHEELS: {"stiffness": 7e2}}
DAMPED = {DIRECTION: {"damping": 60.0, "yaw_damping": 0.6}, WHEELS: {"damping": 25.0}}
NUMBERS = {
    "none": lambda place: {},
    "Stribeck": lambda place: FALL_OF[place],
    "Dahl": lambda place: STIFF[place],
    "LuGre": lambda place: STIFF[place] | FALL_OF[place] | DAMPED[place],
}
WORD = {"none": "coulomb", "Stribeck": "coulomb", "Dahl": "dahl", "LuGre": "lugre"}
NAMED = {"Stribeck": "stribeck_speed", "Dahl": "stiffness", "LuGre": "damping"}
NOISE = {  # [m/s]
    (DIRECTION, "Dahl"): 0.014,
    (DIRECTION, "LuGre"): 0.002,
    (WHEELS, "Dahl"): 0.02,
    (WHEELS, "LuGre"): 0.004,
    (WHEELS, "Stribeck"): 0.005,
}


def robot_of(place, law, factor=1.0):
    """The paper's robot; levels and damping times a factor."""
    own = PLAIN[place].replace(law=WORD[law], **NUMBERS[law](place))
    robot = load_robot("axebot").replace(friction=Friction(**{place: own}))
    for key in map(Key.parse, friction_keys(robot)):
        robot = key.set(robot, factor * key.get(robot))
    return robot


def program(number):
    """Ramps forward, sideways, round and between them, both ways, below and above what it takes to move."""
    random = np.random.default_rng([number, 77])
    ways = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])
    found = []
    for k in range(ROWS // 20):
        way = ways[k % 3] if k % 6 < 3 else ways[k % 3] + random.uniform(-0.5, 0.5) * ways[(k + 1) % 3]
        found.append(np.outer(np.linspace(0.2, 1.0, 20) * random.uniform(1.2, 4.0) * (-1) ** (k // 3), way))
    return np.concatenate(found)


def moved(robot, number):
    table = next(own for own in (robot.friction.direction, robot.friction.wheels) if np.any(own.coulomb))
    if table.law == "coulomb":
        return modes.reference(robot, program(number), DT).twist
    return bristles.reference(robot, program(number), DT, rtol=1e-8, atol=1e-10)[0]


@lru_cache(maxsize=64)
def true_twist(place, law, number):
    return moved(robot_of(place, law), number)


def log_of(place, law, seed, noise):
    number = seed % PROGRAMS
    twist, volts = true_twist(place, law, number), program(number)
    off = np.random.default_rng([seed, 991]).normal(size=twist.shape) * noise * [1.0, 1.0, 4.0]
    return Run(t=DT * np.arange(ROWS + 1), voltage=np.concatenate([volts, volts[-1:]]), twist=twist + off)


def climbed(place, law, seed, noise):
    """What the ladder makes of a log under the file of plain friction, 1.3 times as large."""
    robot = robot_of(place, "none", 1.3)
    return identify(
        [log_of(place, law, seed, noise)], robot, OutputError(free=("friction",), nuisances=(), ladder=True)
    ).estimate


def numbers_of(place, law):
    """The keys of all numbers, entry by entry."""
    own = {f"friction.{place}.{name}": value for name, value in NUMBERS[law](place).items()}
    law_keys = [f"{key}[{k}]" for key, value in own.items() if np.ndim(value) for k in range(len(value))]
    return [*friction_keys(robot_of(place, "none")), *law_keys, *(key for key, v in own.items() if not np.ndim(v))]


def held(found, place, law):
    """Whether each interval holds the truth."""
    true = {key: Key.parse(key).get(robot_of(place, law)) for key in numbers_of(place, law)}
    return [found.ci95[key][0] <= value <= found.ci95[key][1] for key, value in true.items() if key in found.ci95]


def clear(place, law, number):
    """How many of their standard errors the numbers of a law are from 0, a fall from none."""
    robot, names, columns = robot_of(place, law), numbers_of(place, law), []
    size = NOISE[place, law] * np.array([1.0, 1.0, 4.0])
    for key in map(Key.parse, names):
        value = key.get(robot)
        up, down = (moved(key.set(robot, value * by), number) for by in (1.002, 0.998))
        columns.append(((up - down) / (0.004 * value * size)).ravel())
    slopes = np.stack(columns, axis=1)
    std = dict(zip(names, np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes))).tolist(), strict=True))
    for name in names[len(friction_keys(robot_of(place, "none"))) :]:
        key = Key.parse(name)
        slide = Key.parse(name.replace("breakaway", "coulomb")).get(robot) if "breakaway" in name else 0.0
        yield (key.get(robot) - slide) / std[name]
