"""Runs at constant speeds within which friction may change, by the simulator of wrong_worlds."""

from dataclasses import replace

import numpy as np

from benchmarks.wrong_worlds.world import drive
from omnidyn.run import Run

RATE, HOLD = 100.0, 1.6  # [Hz], [s] of a command
ROUND = {"coulomb": (3.9, 3.0, 0.2), "viscous": (0.0, 0.0, 0.0), "rim": (1.6, 0.0)}


def logged(world, commands, rng, source):
    """A run under commands (n, wheels) [V] that hold for HOLD each."""
    volts = np.repeat(commands, round(HOLD * RATE), axis=0)
    t = np.arange(len(volts)) / RATE
    moved = drive(world, t, volts, t)
    back = moved.wheel_speed * world.gear_ratio * np.array(world.torque_constant)
    current = (volts - back) / np.array(world.resistance)
    return Run(
        t,
        voltage=volts,
        wheel_speed=moved.wheel_speed + 0.1 * rng.normal(size=volts.shape),
        current=current + 0.03 * rng.normal(size=volts.shape),
        source=source,
    )


def once(seed, world, count, swept=False, change=1e9, factor=1.0):
    """Directions of which none comes again, each at a level of its own, in an order of their own or one round."""
    rng = np.random.default_rng([seed, count])
    angle = 2.0 * np.pi / count * (np.arange(count) + rng.uniform(0.2, 0.8, count))
    angle = angle if swept else rng.permutation(angle)
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ np.linalg.pinv(world.G)[:, :2].T
    rim *= rng.uniform(5.0, 8.0, (count, 1)) / np.abs(rim).max(axis=1, keepdims=True)
    return logged(replace(world, change=change, after_friction=factor), rim, rng, f"run {seed}")
