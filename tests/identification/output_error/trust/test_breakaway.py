"""Breakaway between the drives of a log: runs of the reference integrator, which goes from event to event."""

import numpy as np
import pytest

import omnidyn
from benchmarks.wrong_worlds.log import robot_of
from benchmarks.wrong_worlds.world import World
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import modes
from tests.support.starts import LEVELS, OF_TABLE, PLANE, held, in_a_turning_frame, log_of_starts, of_slants, of_starts

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
    fit = identify(log, robot, OutputError(free=keys, nuisances=())).estimate
    for key, true in zip(keys[:4], (*VISCOUS[:2], SLIDES, SLIDES), strict=True):
        assert abs(fit.value[key] - true) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.05
    for key in keys[4:]:
        low, high = fit.ci95[key]
        assert 4.9 < low < HOLDS < high < 8.3
    assert fit.noise["twist[0]"] < 1.1 * NOISE


def test_it_is_found_in_a_turning_frame_too():
    """The implicit engine runs it. Two axes are told well here, turning from below only: that is said."""
    words = []
    fit, truth = in_a_turning_frame(8, progress=lambda report: words.append(str(report).removeprefix("fitting: ")))
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


@pytest.mark.parametrize("shape, keys", [("direction", PLANE), ("wheels", OF_TABLE["wheels"])])
def test_it_is_found_wherever_friction_acts(shape, keys):
    """The truth lies clear of Coulomb friction, and between the ends. It was refused, or taken for a smooth number."""
    fit, truth = of_starts(0, shape, keys, 8, shape != "direction")
    assert all(held(fit, {key: truth[key] for key in fit.value}).values())
    for key in keys:
        low, high = fit.ci95[key]
        assert 1.1 * truth[key.replace("breakaway", "coulomb")] < low < high < 1.3 * truth[key]
        assert Key.parse(key).get(fit.robot) == fit.value[key]
        assert fit.robot.priors[key].std == pytest.approx(fit.std[key])
    assert not set(keys) & set(fit.unidentifiable)


def test_at_the_wheels_it_is_named_where_it_is_left_out():
    """It is the first remedy; with it nothing is left."""
    world = World(frame=True, breakaway=1.5, shape="wheels")
    log, (key,) = log_of_starts(0, world), OF_TABLE["wheels"]
    lack = omnidyn.identify([log], robot_of(world)).lack_of_fit
    assert lack.found
    assert lack.remedies[0].key == key
    assert not omnidyn.identify([log], robot_of(world), omnidyn.OutputError(free=["friction", key])).lack_of_fit.found


def test_levels_of_an_ellipse_that_one_way_of_starting_tells_together_are_wide():
    """Alone each lies within a percent of a wrong value: that of the other, a little off, made up for it."""
    fit, truth = of_slants(0, 5)
    assert all(held(fit, truth).values())
    assert all(high > 1.3 * low for low, high in map(fit.ci95.get, PLANE))


def test_a_level_that_no_law_has_is_refused_by_name():
    log = Run(t=DT * np.arange(5), voltage=np.ones((5, 3)), twist=np.zeros((5, 3)))
    box, round_ = robot_of(World()), robot_of(World(shape="direction"))
    with pytest.raises(InputError, match=r"no Coulomb friction .*; got friction\.wheels\.breakaway, .*coulomb is 0"):
        identify(log, box, OutputError(free=["friction", "friction.wheels.breakaway"]))
    bristles = DirectionFriction(coulomb=(3.9, 3.9), law="dahl", stiffness=1e3)
    bends = round_.replace(friction=Friction(direction=bristles))
    with pytest.raises(
        InputError, match=r'bristles bend before .*; got friction\.direction\.breakaway\[0\] of law = "dahl"'
    ):
        identify(log, bends, OutputError(free=["friction", "friction.direction.breakaway"]))
    with pytest.raises(UnsupportedError, match=r"not profiled in groups; got friction\.direction\.breakaway\[0\]"):
        identify([log, log], round_, OutputError(free=["friction", "friction.direction.breakaway"]), groups=["a", "b"])
