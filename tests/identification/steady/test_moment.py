"""A change inside a run at constant speeds: runs of a simulator that shares no code with ours, Coulomb friction only.

So the force at every command is the level of the floor; where none comes again, that of the shape."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.blind.log import robot_of
from benchmarks.identification.floors import driven
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, WHEELS, World
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.moment import levelled, moments
from omnidyn.identification.steady.operating_points import steady_windows
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.support.codes import codes
from tests.support.constant_speeds import HOLD, ROUND, logged, once

LEVEL = 3.9  # [N]
WORLD = World(coulomb=(LEVEL, LEVEL, 0.2), viscous=(0.0, 0.0, 0.0))
WAYS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def run(seed, rounds=6, change=1e9, factor=1.0):
    """Commands along four ways, again and again, in an order of their own each time."""
    rng = np.random.default_rng(seed)
    shape = np.linalg.pinv(WORLD.G)[:, :2]
    shape /= np.abs(shape).max(axis=0)
    order = np.concatenate([rng.permutation(len(WAYS)) for _ in range(rounds)])
    world = replace(WORLD, change=change, after_friction=factor)
    return logged(world, 7.0 * WAYS[order] @ shape.T, rng, f"run {seed}")


@pytest.mark.parametrize("factor", [1.15, 0.9])
def test_a_change_is_found_with_its_time_and_both_levels(factor):
    changed = 21.4
    study = identify([run(1, change=changed, factor=factor)], robot_of(WORLD), SteadyState()).study
    (moment,) = study.moments
    assert moment.between[0] <= changed <= moment.between[1]
    assert moment.at == pytest.approx(changed, abs=HOLD)
    assert moment.before_ci95[0] <= LEVEL <= moment.before_ci95[1]
    assert moment.after_ci95[0] <= factor * LEVEL <= moment.after_ci95[1]
    assert moment.before == pytest.approx(LEVEL, rel=0.01)
    assert moment.after == pytest.approx(factor * LEVEL, rel=0.01)
    assert moment.ci95[0] <= factor - 1.0 <= moment.ci95[1]
    assert "changes_within_run" in codes(study.warnings)


@pytest.mark.parametrize("late", [True, False])
def test_currents_that_are_gone_on_one_side_are_not_scaled(late):
    whole = run(1)
    gone, count = whole.current.copy(), len(whole.current)
    gone[slice(count // 2, None) if late else slice(count // 2)] = 0.0
    study = identify([whole.replace(current=gone)], robot_of(WORLD), SteadyState()).study
    (moment,) = study.moments
    side = "after" if late else "before"
    assert side in [w.numbers["vanished"] for w in study.warnings if w.code == "changes_within_run"]
    points = steady_windows([whole], robot_of(WORLD)).points(robot_of(WORLD))
    left = levelled(points, [moment], {int(points.run[0]): moment.source})
    known = points.span[:, 1] <= moment.at if late else points.span[:, 0] >= moment.at
    assert 5 < len(left) == known.sum()
    assert np.array_equal(left.wrench, points.wrench[known])


def test_a_right_run_does_not_change():
    found = [identify([run(seed)], robot_of(WORLD), SteadyState()).study.moments for seed in range(10, 18)]
    assert not any(found)


def test_the_run_that_changed_is_named():
    runs = [run(2), run(3, change=17.0, factor=1.2)]
    found = identify(runs, robot_of(WORLD), SteadyState())
    assert found.study is not None
    (moment,) = found.study.moments
    assert moment.source == "run 3"
    assert found.document().data["moments"][0]["source"] == "run 3"


@pytest.mark.parametrize(("shape", "count", "factor"), [(BOX, 12, 1.1), (ELLIPSE, 16, 0.95), (WHEELS, 12, 1.05)])
@pytest.mark.some(1)
def test_a_change_is_found_by_the_shape_where_no_command_comes_again(shape, count, factor):
    world, changed = World(shape=shape, **ROUND), 0.55 * count * HOLD
    study = identify([once(5, world, count, change=changed, factor=factor)], robot_of(world), SteadyState()).study
    (moment,) = study.moments
    assert moment.between[0] <= changed <= moment.between[1]
    assert moment.at == pytest.approx(changed, abs=HOLD)
    assert moment.ci95[0] <= factor - 1.0 <= moment.ci95[1]
    assert moment.after / moment.before == pytest.approx(factor, abs=0.015)
    assert moment.before_ci95[0] < moment.before < moment.before_ci95[1]
    assert moment.shape == study.choice.chosen
    (change,) = (warning for warning in study.warnings if warning.code == "changes_within_run")
    assert change.numbers["shape"]


@pytest.mark.parametrize("shape", [BOX, ELLIPSE, WHEELS])
@pytest.mark.some(2)
def test_a_right_shape_does_not_change(shape):
    world = World(shape=shape, **ROUND)
    assert not identify([once(6, world, 14)], robot_of(world), SteadyState()).study.moments


def test_a_wrong_shape_that_is_driven_round_is_no_change():
    """A box turned by 25 degrees against the body: what it leaves over follows the direction, which follows time."""
    world = World(shape=BOX, **ROUND)
    told = replace(world, azimuth=tuple(angle - 25.0 for angle in world.azimuth))
    assert not identify([once(7, world, 24, swept=True)], robot_of(told), SteadyState()).study.moments


@pytest.mark.parametrize("shape", [BOX, ELLIPSE, WHEELS])
@pytest.mark.some(1)
def test_a_change_is_told_first_and_the_shape_fits_on_both_sides_of_it(shape):
    """One round: left is driven before it, right after, which looks like another level to the left."""
    world, changed = World(shape=shape, **ROUND), 0.55 * 20 * HOLD
    found = identify([once(102, world, 20, swept=True, change=changed, factor=1.25)], robot_of(world), SteadyState())
    study = found.study
    assert study is not None
    assert [moment.shape for moment in study.moments] == [study.choice.chosen]
    assert not study.lack_of_fit["all"].found
    assert study.lack_of_fit["all"].tried
    assert any(one.numbers["changes"] for one in study.statements if one.code == "no_lack_of_fit")
    assert found.verdict.startswith("The force of friction changes within a run (+2")
    assert "no offered shape fits" not in found.verdict


@pytest.mark.parametrize("factor", [1.0, 1.2])
def test_a_shape_that_fits_on_neither_side_of_a_change_is_said_behind_it(factor):
    """A box turned by 25 degrees against the body; every direction comes again, so that the change needs no shape."""
    world = World(shape=BOX, **ROUND)
    told = replace(world, azimuth=tuple(angle - 25.0 for angle in world.azimuth))
    rng, angle = np.random.default_rng(8), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False) + 0.1
    order = np.concatenate([rng.permutation(24) for _ in range(2)])
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)[order] @ np.linalg.pinv(world.G)[:, :2].T
    rim *= 7.0 / np.abs(rim).max(axis=1, keepdims=True)
    run = logged(replace(world, change=36.0, after_friction=factor), rim, rng, "round")
    study = identify([run], robot_of(told), SteadyState()).study
    assert len(study.moments) == (factor != 1.0)
    assert study.lack_of_fit["all"].found
    found = [one for one in study.warnings if one.code in ("changes_within_run", "no_shape_fits")]
    assert codes(found) == ["changes_within_run"] * (factor != 1.0) + ["no_shape_fits"]
    assert found[-1].numbers["changes"] == (factor != 1.0)


# ---- one command, held for long -----------------------------------------------------------------------------


def held(seed, course, way=0.7, row=0.03):
    """A robot driven one way for 17 s: levels [N] of time in the currents, with noise that lasts a second."""
    rng, robot = np.random.default_rng(seed), load_robot("robotino")
    t = np.arange(0.0, 17.0, row)
    twist = 0.2 * np.array([np.cos(way), np.sin(way), 0.0])
    slow = np.convolve(rng.normal(size=len(t) + 33), np.ones(34) / 34**0.5, "valid")
    push = np.linalg.pinv(robot.wheels.wrench_matrix) @ [np.cos(way), np.sin(way), 0.0]
    per_ampere = 0.0514 * 16.0 / 0.040
    current = course(t)[:, None] * (1.0 + 0.03 * slow)[:, None] * push / per_ampere
    speed = np.tile(wheel_speed(robot.wheels, twist), (len(t), 1)) * (1.0 - np.exp(-t / 0.1))[:, None]
    return Run(
        t=t,
        twist_command=np.tile(twist, (len(t), 1)),
        wheel_speed=speed + 0.05 * rng.normal(size=speed.shape),
        current=current + 0.16 * rng.normal(size=current.shape),
        source=f"run {seed}",
    )


def changes(*runs):
    return moments(runs, load_robot("robotino"), "current")[0]


def test_two_floors_under_one_command_are_told_with_time_and_levels():
    rng, right = np.random.default_rng(3), 0
    for seed in range(20):
        when = rng.uniform(4.0, 13.0)
        (moment,) = changes(held(seed, lambda t, when=when: np.where(t < when, 35.0, 14.0), rng.uniform(0.0, 6.28)))
        levels = moment.before / 35.0, moment.after / 14.0
        right += abs(moment.at - when) < 1.0 and max(abs(level - 1.0) for level in levels) < 0.1
    assert right >= 18


def test_one_floor_is_no_change():
    assert len(changes(*(held(seed, lambda t: 35.0 + 0.0 * t) for seed in range(100, 200)))) <= 2


@pytest.mark.parametrize("course", [lambda t: 35.0 - 0.4 * t, lambda t: 30.0 + 8.0 * np.exp(-t / 8.0)])
def test_a_motor_that_warms_up_is_no_change(course):
    assert len(changes(*(held(seed, course) for seed in range(200, 250)))) <= 8


def test_a_run_that_is_too_short_is_not_tested():
    whole = held(1, lambda t: 35.0 + 0.0 * t)
    short = whole.replace(**{name: values[:90] for name, values in {"t": whole.t, **whole.channels}.items()})
    found, tested = moments([short.replace(source="short"), whole], load_robot("robotino"), "current")
    assert (found, tested) == ((), {"run 1"})
    runs = [held(k, lambda t: 35.0 + 0.0 * t, way) for k, way in enumerate(np.linspace(0.0, 6.0, 8))]
    runs[2] = runs[2].replace(t=runs[2].t[:90], **{name: values[:90] for name, values in runs[2].channels.items()})
    study = identify(runs, load_robot("robotino"), SteadyState(shape="disc")).study
    assert study.untested == ("run 2",)
    (note,) = (one for one in study.warnings if one.code == "changes_not_tested")
    assert note.numbers == {"untested": 1, "runs": 8}


def test_one_drive_over_two_floors_says_so_though_no_shape_can_be_fitted():
    with pytest.raises(InsufficientDataError, match=r"changes within a run \(-6\d.*, from 3\d\.?\d? to 1\d"):
        identify([held(4, lambda t: np.where(t < 8.0, 35.0, 14.0))], load_robot("robotino"), SteadyState())


def test_what_is_clear_by_hand_is_named_and_one_floor_is_not():
    """By the simulator of `bench floors`. A crossing takes up to 3 s, and the force is uneven."""
    robot, clear, named = robot_of(World(rim=(0.0, 0.0))), 0, 0
    for number in range(40):
        drive = driven(number, True)
        errors = [drive.by_hand(slice(k, None, 2)) for k in (0, 1)]
        found = bool(moments([drive.run], robot, "current")[0])
        assert not (found and max(errors) < 3.0)
        clear, named = clear + (min(errors) > 4.0), named + (found and min(errors) > 4.0)
    assert clear > 30
    assert named >= 0.85 * clear  # before a crossing was thought of, 25 of 35
    assert sum(bool(moments([driven(number, False).run], robot, "current")[0]) for number in range(40)) <= 2
