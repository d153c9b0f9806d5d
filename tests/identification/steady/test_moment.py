"""A change inside a run at constant speeds: runs of a simulator that shares no code with ours, Coulomb friction only.

So the force at every command is the level of the floor."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.blind.log import robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.identification.identify import Identification
from omnidyn.identification.steady.study import identify_steady
from omnidyn.run import Run

RATE, HOLD = 100.0, 1.6  # [Hz], [s] of a command
LEVEL = 3.9  # [N]
WORLD = World(coulomb=(LEVEL, LEVEL, 0.2), viscous=(0.0, 0.0, 0.0))
WAYS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def run(seed, rounds=6, change=1e9, factor=1.0):
    """Commands along four ways, again and again, in an order of their own each time."""
    rng = np.random.default_rng(seed)
    shape = np.linalg.pinv(WORLD.G)[:, :2]
    shape /= np.abs(shape).max(axis=0)
    order = np.concatenate([rng.permutation(len(WAYS)) for _ in range(rounds)])
    volts = np.repeat(7.0 * WAYS[order] @ shape.T, round(HOLD * RATE), axis=0)
    t = np.arange(len(volts)) / RATE
    world = replace(WORLD, change=change, after_friction=factor)
    moved = drive(world, t, volts, t)
    back = moved.wheel_speed * world.gear_ratio * np.array(world.torque_constant)
    current = (volts - back) / np.array(world.resistance)
    return Run(
        t, voltage=volts, wheel_speed=moved.wheel_speed + 0.1 * rng.normal(size=volts.shape),
        current=current + 0.03 * rng.normal(size=volts.shape), source=f"run {seed}",
    )  # fmt: skip


@pytest.mark.parametrize("factor", [1.15, 0.9])
def test_a_change_is_found_with_its_time_and_both_levels(factor):
    changed = 21.4
    study = identify_steady([run(1, change=changed, factor=factor)], robot_of(WORLD))
    (moment,) = study.moments
    assert moment.between[0] <= changed <= moment.between[1]
    assert moment.at == pytest.approx(changed, abs=HOLD)
    assert moment.before_ci95[0] <= LEVEL <= moment.before_ci95[1]
    assert moment.after_ci95[0] <= factor * LEVEL <= moment.after_ci95[1]
    assert moment.before == pytest.approx(LEVEL, rel=0.01)
    assert moment.after == pytest.approx(factor * LEVEL, rel=0.01)
    assert moment.ci95[0] <= factor - 1.0 <= moment.ci95[1]
    assert any("changes within the run, most likely at" in words for words in study.warnings)


def test_a_right_run_does_not_change():
    found = [identify_steady([run(seed)], robot_of(WORLD)).moments for seed in range(10, 30)]
    assert not any(found)


def test_the_run_that_changed_is_named():
    runs = [run(2), run(3, change=17.0, factor=1.2)]
    found = Identification.of(runs, robot_of(WORLD), method="steady-state")
    assert found.study is not None
    (moment,) = found.study.moments
    assert moment.source == "run 3"
    assert found.document().data["moments"][0]["source"] == "run 3"


def test_commands_that_are_given_once_tell_nothing():
    assert not identify_steady([run(4, rounds=1, change=3.0, factor=1.3)], robot_of(WORLD)).moments
