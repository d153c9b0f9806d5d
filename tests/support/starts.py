"""Logs of starts from rest that tell breakaway, by the simulator of wrong_worlds, which shares no code with src."""

import numpy as np

from benchmarks.wrong_worlds.log import NOISE as SENSOR
from benchmarks.wrong_worlds.log import Case, commands, robot_of, truths
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.run import Run

RATIO = 1.3
LEVELS = [f"friction.axes.breakaway[{axis}]" for axis in range(3)]


def in_a_turning_frame(seed, **options):
    """(fit, truth) of 30 s in a turning frame, by the simulator of the wrong worlds, which shares no code with src.

    At 0.4 of its voltages, so that some of its drives lie between Coulomb friction and breakaway.
    """
    world = World(frame=True, breakaway=RATIO)
    asked = 0.4 * commands(Case(world, world), np.random.default_rng([seed, 2]))
    t = np.arange(len(asked)) / 100.0
    speed = drive(world, t, asked, t).wheel_speed
    speed = speed + SENSOR * np.random.default_rng([seed, 3]).normal(size=speed.shape)
    log = Run(t, voltage=asked, wheel_speed=speed)
    fit = identify(log, robot_of(world), OutputError(free=["friction", *LEVELS]), **options).estimate
    levels = zip(LEVELS, (RATIO * level for level in world.coulomb), strict=True)
    return fit, truths(world, "axes") | dict(levels)


def held(fit, truth):
    return {key: fit.ci95[key][0] <= true <= fit.ci95[key][1] for key, true in truth.items()}


PLANE = ["friction.direction.breakaway[0]", "friction.direction.breakaway[1]"]
OF_TABLE = {"direction": [*PLANE, "friction.direction.yaw_breakaway"], "wheels": ["friction.wheels.breakaway"]}


def starts(world, rng, count, turns):
    """Voltages of starts from rest, each its own way: they rise in steps to about twice what Coulomb friction holds,
    then leap, then end. turns: whether every third turns."""
    per = world.ke / np.array(world.resistance)
    out = [np.zeros((30, 3))]
    for k in range(1, 1 + count):
        along = bool(k % 3) or not turns
        angle, way = rng.uniform(-np.pi, np.pi), rng.choice([-1.0, 1.0]) / world.robot_radius
        rim = np.array([np.cos(angle), np.sin(angle), 0.0] if along else [0.0, 0.0, way]) @ world.G
        wrench = world.G @ (per * rim)
        held = world.coulomb[0] / np.hypot(*wrench[:2]) if along else world.coulomb[2] / abs(wrench[2])
        held = world.rim[0] / np.abs(per * rim).max() if world.shape == "wheels" else held
        rise = np.concatenate([np.repeat(np.linspace(0.4, 1.0, 10), 10), np.full(40, 3.0)])
        out += [np.outer(rise, 2.0 * held * rng.uniform(0.8, 1.2) * rim), np.zeros((40, 3))]
    return np.concatenate(out)


def log_of_starts(seed, world, count=14, turns=True):
    """Starts in a turning frame, by the simulator of the wrong worlds."""
    asked = starts(world, np.random.default_rng([seed, 4]), count, turns)
    t = np.arange(len(asked)) / 100.0
    speed = drive(world, t, asked, t).wheel_speed
    speed = speed + SENSOR * np.random.default_rng([seed, 5]).normal(size=speed.shape)
    return Run(t, voltage=asked, wheel_speed=speed)


def of_starts(seed, shape, keys, *options):
    """(fit, truth) of such a log."""
    world = World(frame=True, breakaway=RATIO, shape=shape)
    fit = identify(
        log_of_starts(seed, world, *options), robot_of(world), OutputError(free=["friction", *keys])
    ).estimate
    truth = truths(world, shape)
    return fit, truth | {key: RATIO * truth[key.replace("breakaway", "coulomb")] for key in keys}


def of_slants(seed, count):
    """(fit, truth) of slow starts near the diagonal alone, which tell what both levels are together, and of fast runs
    along x and along y, which tell Coulomb friction."""
    world = World(frame=True, breakaway=RATIO, shape="direction")
    rng, slides = np.random.default_rng([seed, 7]), world.coulomb[0]
    volts_of = np.linalg.pinv(world.G * world.ke / np.array(world.resistance))
    asked = []

    def run(size, angle, turning, rows):
        force = size * np.cos(angle), size * np.sin(angle), turning
        asked.append(np.repeat([volts_of @ force], rows, 0))

    for _ in range(count):
        angle = np.pi / 4.0 + rng.normal(0.0, 0.03) + rng.choice([0.0, np.pi])
        for size in np.sort(rng.uniform(0.9, 1.55, 5)) * slides:
            run(size, angle, 0.0, 25)
        run(0.0, 0.0, 0.0, 25)
        run(rng.uniform(2.2, 3.2) * slides, rng.integers(4) * np.pi / 2.0, rng.normal() * 0.6, 60)
        run(0.0, 0.0, 0.0, 40)
    rows = np.concatenate(asked)
    t = np.arange(len(rows)) / 100.0
    speed = drive(world, t, rows, t).wheel_speed
    speed = speed + SENSOR * np.random.default_rng([seed, 3]).normal(size=speed.shape)
    fit = identify(
        Run(t, voltage=rows, wheel_speed=speed), robot_of(world), OutputError(free=["friction", *PLANE])
    ).estimate
    return fit, {key: RATIO * slides for key in PLANE}
