"""Breakaway between the drives of a log: runs of the reference integrator, which goes from event to event."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import NOISE as SENSOR
from benchmarks.wrong_worlds.log import Case, commands, robot_of, truths
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.identification.output_error.solve.progress import Progress
from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import modes

SLIDES, HOLDS = 2.2, 5.9  # [N] along x and y
VISCOUS = (0.94, 0.96, 0.01)
DT, NOISE = 0.02, 0.005
VOLTS = (1.0, 1.5, 2.5, 1.2, 0.0, -1.5, -2.5, -1.2, 0.0, 1.5, 3.0, 0.8, 0.0)  # 1.5 V give 4.9 N at rest, 2.5 V 8.2 N
X, Y = (0.0, 1.0, -1.0), (2.0 / np.sqrt(3.0), -1.0 / np.sqrt(3.0), -1.0 / np.sqrt(3.0))  # as much force either way


def test_it_is_found_above_the_last_drive_below_three_times_coulomb():
    """It held 4.9 N and gave way under 8.2 N, more than three times Coulomb friction: between the two it may be.

    That plateau was left out once Coulomb friction was known: breakaway ended below 4.9 N, beside wrong levels.
    """
    levels = {"viscous": VISCOUS, "coulomb": (SLIDES, SLIDES, 0.099)}
    robot = load_robot("axebot").replace(friction=Friction(axes=AxesFriction(**levels)))
    holding = robot.friction.axes.replace(breakaway=(HOLDS, HOLDS, 0.13))
    volts = np.concatenate([np.outer(np.repeat(VOLTS, 50), way) for way in (X, Y)])
    truth = modes.reference(robot.replace(friction=Friction(axes=holding)), volts, DT)
    noise = np.random.default_rng(3).normal(size=truth.twist.shape) * [NOISE, NOISE, 4.0 * NOISE]
    t = DT * np.arange(len(truth.twist))
    log = Run(t=t, voltage=np.concatenate([volts, volts[-1:]]), twist=truth.twist + noise)
    keys = [f"friction.axes.{name}[{axis}]" for name in ("viscous", "coulomb", "breakaway") for axis in (0, 1)]
    fit = fit_output_error(log, robot, free=keys, nuisances=())
    for key, true in zip(keys[:4], (*VISCOUS[:2], SLIDES, SLIDES), strict=True):
        assert abs(fit.value[key] - true) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.05
    for key in keys[4:]:
        low, high = fit.ci95[key]
        assert 4.9 < low < HOLDS < high < 8.3
    assert fit.noise["twist[0]"] < 1.1 * NOISE


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
    fit = fit_output_error(log, robot_of(world), free=["friction", *LEVELS], **options)
    levels = zip(LEVELS, (RATIO * level for level in world.coulomb), strict=True)
    return fit, truths(world, "axes") | dict(levels)


def held(fit, truth):
    return {key: fit.ci95[key][0] <= true <= fit.ci95[key][1] for key, true in truth.items()}


def test_it_is_found_in_a_turning_frame_too():
    """The implicit engine runs it. Two axes are told well here, turning from below only: that is said."""
    words = []
    fit, truth = in_a_turning_frame(8, watch=Progress(words=words.append))
    assert all(held(fit, truth).values())
    for key in LEVELS[:2]:
        low, high = fit.ci95[key]
        assert 1.1 * truth[key.replace("breakaway", "coulomb")] < low < high < 1.2 * truth[key]
        assert fit.robot.priors[key].std == pytest.approx(fit.std[key])
    assert fit.unidentifiable == (LEVELS[2],)
    assert fit.lower_bound == {LEVELS[2]: fit.ci95[LEVELS[2]][0]}
    assert fit.robot.priors[LEVELS[2]].std is None
    assert any(each.startswith("breakaway friction sideways, fit ") for each in words)
    assert sum(each.startswith("breakaway friction") for each in words) < 300


@pytest.mark.long
def test_intervals_in_a_turning_frame_hold_the_truth():
    every = [held(*in_a_turning_frame(seed)) for seed in range(12)]
    levels = [each[key] for each in every for key in LEVELS]
    others = [each[key] for each in every for key in each if key not in LEVELS]
    assert np.mean(levels) >= 0.9
    assert np.mean(others) >= 0.9
