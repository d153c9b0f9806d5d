"""The ladder on logs of several groups, of the simulator of wrong_worlds, which shares no code with what fits them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of, truths
from benchmarks.wrong_worlds.world import BOX, ELLIPSE
from omnidyn.document import plain
from omnidyn.identification.identify import identify
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.ladder import STANDS
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.free_run import margins_of
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.structure.ladder.held_out import errors
from omnidyn.identification.structure.ladder.models import Model, can, is_own, moves, moves_apart
from omnidyn.identification.structure.missing.switches import as_fitted
from omnidyn.model.robot_file import load_robot
from omnidyn.report.fit_page import render_fit

SEED = 7001  # of no log of a benchmark, nor of their pilots
FREE, PER = ("friction",), ("gray=gray/*", "green=green/*")
TILE = 0.8  # of the Coulomb friction of gray is that of green


def floors(*shapes, **worlds):
    """(a log on each floor, the file of an owner who thinks of a box, the worlds)."""
    case = right_case(SEED).setup_but(sensor=SPEEDS, memory=0.0, seconds=15.0)
    made, runs = [], []
    for k, (name, shape) in enumerate(zip(("gray", "green"), shapes, strict=True)):
        factor = TILE if k else 1.0
        level = tuple(factor * each for each in case.world.coulomb)
        made.append(replace(case.world, shape=shape, coulomb=level, **worlds))
        runs.append(logged(replace(case, world=made[-1]), 10 * SEED + k).replace(source=f"{name}/1.csv"))
    return runs, robot_of(case.told), made


def ladder(found):
    told = found.fits["gray"].ladder
    assert told is not None
    return told


@pytest.fixture(scope="module")
def mixed():
    """A box on gray, an ellipse on green."""
    runs, robot, worlds = floors(BOX, ELLIPSE)
    return identify(runs, robot, OutputError(free=FREE, ladder=True), groups=PER), worlds


def test_each_group_gets_the_shape_of_its_own(mixed):
    found, worlds = mixed
    (step,) = ladder(found).taken
    assert (step.key, step.groups) == ("friction.direction", ("green",))
    assert str(step.cause).endswith("an ellipse in green")
    for (_, estimate), world in zip(found.groups.items(), worlds, strict=True):
        true = truths(world, world.shape)
        assert set(true) == set(estimate.value)
        held = [low <= true[name] <= high for name, (low, high) in estimate.ci95.items()]
        assert np.mean(held) >= 0.8


def test_the_robot_of_each_group_has_its_shape_and_what_is_shared_stays_so(mixed):
    found, _ = mixed
    gray, green = (estimate.robot for estimate in found.groups.values())
    assert any(gray.friction.axes.coulomb)
    assert not any(gray.friction.direction.coulomb)
    assert any(green.friction.direction.coulomb)
    assert not any(green.friction.axes.coulomb)
    assert gray.body == green.body
    assert gray.motor == green.motor
    late = [{n: own.value for n, own in each.nuisances.items()} for each in found.fits.values()]
    assert late[0] == late[1]
    assert found.differences == ()  # no number is in both


def test_the_answer_has_the_ladder_once(mixed):
    found, _ = mixed
    text, page = found.document().to_text(), render_fit(found, {"omnidyn": "0", "command": "", "inputs": []})
    assert found.verdict.startswith(
        "The ladder took Coulomb friction along the direction of travel, an ellipse in green"
    )
    assert (found.verdict.count("The ladder"), text.count("held-out error  ")) == (1, 1)
    assert page.count("What was switched on, step by step") in (1, 2)  # its heading, and the table of contents
    rungs = json.loads(json.dumps(plain(found.document().data), allow_nan=False))["groups"]["gray"]["ladder"]["rungs"]
    assert ["green"] in [rung["groups"] for rung in rungs if rung["taken"]]


def test_a_number_of_one_group_is_told_with_its_group():
    assert (
        str(as_fitted(STANDS, {}, {"body.mass_kg@gray": 2.0, "body.mass_kg@green": 3.0}))
        == "mass 2 kg in gray and mass 3 kg in green"
    )


@pytest.mark.long
def test_a_shape_that_all_have_is_one():
    runs, robot, _ = floors(ELLIPSE, ELLIPSE)
    found = identify(runs, robot, OutputError(free=FREE, ladder=True), groups=PER)
    (step,) = ladder(found).taken
    assert (step.key, step.groups) == ("friction.direction", ())
    assert {d.key for d in found.differences} >= {"friction.direction.coulomb[0]", "friction.direction.coulomb[1]"}


def test_right_floors_take_no_step():
    runs, robot, _ = floors(BOX, BOX)
    found = identify(runs, robot, OutputError(free=FREE, ladder=True), groups=PER)
    assert ladder(found).taken == ()
    assert ladder(found).end.code == "only_noise"


@pytest.mark.long
def test_what_is_shared_is_switched_on_in_all():
    """A frame that turns, of which the file knows nothing."""
    runs, robot, _ = floors(BOX, BOX, frame=True)
    robot = robot.replace(body=robot.body.replace(rotating_frame=False))
    found = identify(runs, robot, OutputError(free=FREE, ladder=True), groups=PER)
    (step,) = ladder(found).taken
    assert (step.key, step.groups) == ("body.rotating_frame", ())
    assert all(each.robot.body.rotating_frame for each in found.groups.values())


@pytest.fixture(scope="module")
def given():
    """The two floors as they are given, before any step."""
    runs, robot, _ = floors(BOX, ELLIPSE)
    fit = Fit.of(runs, robot, OutputError(free=FREE, nuisances=()), ["gray", "green"])
    return Model.first(fit, fit.solve())


def test_what_is_tried(given):
    def asked(made, worth):
        return [(move.key, move.groups) for move in made(worth, given)]

    ellipse, mass = Remedy("friction.direction", "", 0.1, 0.0), Remedy("body.mass_kg", "", 0.1, 0.0)
    one, both = {"green": [ellipse]}, {"gray": [ellipse, mass], "green": [mass, ellipse]}
    assert asked(moves, one) == [("friction.direction", ()), ("friction.direction", ("green",))]
    assert asked(moves, both) == [("friction.direction", ()), ("body.mass_kg", ())]
    assert asked(moves_apart, one) == []
    assert asked(moves_apart, both) == [("friction.direction", ("gray",)), ("friction.direction", ("green",))]
    twice = [replace(mass, at=1.0), replace(mass, at=2.0)]
    assert [move.remedies["gray"].at for move in moves({"gray": twice}, given)] == [1.0, 2.0]


def test_what_each_group_has_for_itself():
    assert is_own("friction.direction", OutputError())
    assert is_own("friction.axes.stribeck_speed", OutputError(per_free=("friction.axes.coulomb[0]",)))
    assert not is_own("friction.direction", OutputError(per_free=("body.mass_kg",)))
    assert is_own("body.mass_kg", OutputError(per_free=("body.mass_kg",)))
    assert is_own("tilt", OutputError(per_free=("tilt.x", "tilt.y")))
    assert not is_own("motor.resistance_ohm", OutputError())


def test_no_robot_gets_a_shape_that_it_has():
    box = load_robot("axebot")
    assert can("friction.direction", box)
    assert not can("friction.axes", box)
    assert can("friction.axes.stribeck_speed", box)
    assert not can("friction.wheels.stribeck_speed", box)


def test_blocks_of_groups_are_those_of_one_fit_where_all_is_each_groups_own(given):
    """Nothing shared: what is left, and each tenth held out, are the sums of those of the groups, each by itself."""
    memory = {
        "gray": [AutoRegression(np.zeros(0), 0.1, 3000)] * 3,
        "green": [AutoRegression(np.zeros(0), 0.2, 3000)] * 3,
    }
    together = errors(given.solution, memory, margins_of([given.solution]))
    parts = [errors(one, memory[name], margins_of([one])) for name, one in given.alone.items()]
    assert together.square == pytest.approx(sum(each.square for each in parts), rel=1e-9)
    assert together.held_out == pytest.approx(sum(each.held_out for each in parts), rel=1e-9)
    assert (together.rows, together.numbers) == (sum(each.rows for each in parts), 12)


@pytest.mark.long  # another shape, and one of a group, are taken above and in test_ladder.py
def test_an_ellipse_gets_a_level_for_each_wheel():
    """Three unequal wheels beside an ellipse, under the file of an ellipse."""
    case = right_case(7101).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0, seconds=20.0)
    world = replace(case.world, shape=ELLIPSE, each_wheel=(1.7, 1.0, 0.3))
    run, robot = logged(replace(case, world=world), 7101), robot_of(replace(case.told, shape=ELLIPSE))
    estimate = identify(run, robot, OutputError(free=FREE, ladder=True)).estimate
    assert estimate.ladder is not None
    assert [rung.key for rung in estimate.ladder.taken] == ["friction.wheels.coulomb"]
    true = truths(world, ELLIPSE) | {f"friction.wheels.coulomb[{k}]": own for k, own in enumerate(world.each_wheel)}
    held = [low <= true[name] <= high for name, (low, high) in estimate.ci95.items()]
    assert np.mean(held) >= 0.75
    assert estimate.robot.friction.wheels.coulomb == pytest.approx(world.each_wheel, abs=0.15)
