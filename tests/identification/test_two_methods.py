"""Two methods on one log, by a simulator that shares no code: intervals that overlap, or words that say why."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import NOISE, robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.comparison.drift import drift
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.run import Run

KEYS = tuple(f"friction.axes.{level}[{axis}]" for level in ("viscous", "coulomb") for axis in range(2))
DEAD = 0.5  # [V]


def held_commands(seed, world):
    """Two seconds each of 40 directions along the floor, at 100 Hz, with the noise of an encoder's speeds."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 80.0, 0.01)
    angle, size = rng.uniform(0.0, 2.0 * np.pi, 40), rng.uniform(4.0, 9.0, 40)
    push = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(40)]) @ robot_of(world).wheels.wrench_matrix
    levels = push / np.abs(push).max(axis=1, keepdims=True) * size[:, None]
    voltage = np.repeat(levels, 200, axis=0)
    motion = drive(world, t, voltage, t)
    return Run(t, voltage=voltage, wheel_speed=motion.wheel_speed + NOISE * rng.normal(size=motion.wheel_speed.shape))


def both(seed, world):
    log, robot = held_commands(seed, world), robot_of(World())
    whole = identify(log, robot, OutputError()).estimate
    return whole, identify(log, robot, SteadyState(shape="box+viscous")).estimate


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.some(1)
def test_a_right_model_is_the_same_by_both(seed):
    whole, steady = both(seed, World())
    truth = dict(zip(KEYS, (*World().viscous[:2], *World().coulomb[:2]), strict=True))
    for key, value in truth.items():
        assert abs(whole.value[key] - value) < 4.0 * whole.std[key]
        assert abs(steady.value[key] - value) < 4.0 * steady.std[key]
        assert max(whole.ci95[key][0], steady.ci95[key][0]) < min(whole.ci95[key][1], steady.ci95[key][1])
    assert not drift([whole.robot, steady.robot]).document().data["changed"]


def test_where_they_differ_the_steady_state_says_by_what():
    """A dead band of the driver, which steady runs cannot tell from Coulomb friction: the whole log takes it off. Along
    an axis that is what the words say; in directions between them wheels that hardly turn take less."""
    whole, steady = both(7, World(dead=DEAD))
    low, high = whole.nuisances["dead_band"].ci95
    assert low < DEAD < high
    gap = steady.value[KEYS[3]] - whole.value[KEYS[3]]
    assert gap > 4.0 * np.hypot(steady.std[KEYS[3]], whole.std[KEYS[3]])
    told = steady.scale.partition("every 0.1 V more would be up to ")[2]
    each = float(told.partition(" N, ")[2].partition(" N ")[0])  # along y
    assert 0.3 < gap / (each * DEAD / 0.1) <= 1.0
    assert "a fit to whole logs, which tells the two apart, differs by that" in steady.scale
