"""A shape of friction of each floor, in logs of the simulators of wrong_worlds, which share no code with omnidyn."""

import numpy as np
import pytest

from benchmarks.identification import steady_shapes
from benchmarks.identification.steady_shapes import KINDS, driven
from benchmarks.wrong_worlds.log import truths
from benchmarks.wrong_worlds.world import ELLIPSE
from omnidyn.attempts import Attempts
from omnidyn.identification.identify import After, Identification, identify
from omnidyn.identification.methods import SteadyState
from tests.support.codes import codes

FLOORS = ("gray", "green")
MIXED, EACH, _, SAME = KINDS
SEED = 31  # of no benchmark


def study_of(kind, **options):
    runs, groups, robot, worlds = driven(kind, SEED, FLOORS)
    return identify(runs, robot, SteadyState(**options), groups=groups).study, worlds


@pytest.fixture(scope="module")
def mixed():
    """A box on gray, an ellipse on green."""
    return study_of(MIXED)


def test_each_floor_gets_the_shape_that_it_has(mixed):
    study, worlds = mixed
    assert [study.choice.of(floor) for floor in FLOORS] == ["box", "ellipse"]
    for floor, table in zip(FLOORS, ("axes", "direction"), strict=True):
        estimate, true = study.estimates[floor], worlds[floor].coulomb[:2]
        assert getattr(estimate.robot.friction, table).coulomb[:2] == pytest.approx(true, rel=0.03)
        assert f"shape {study.choice.of(floor)}" in estimate.method
    assert not any(study.estimates["green"].robot.friction.axes.coulomb)
    assert study.differences == ()  # no level is in both


def test_the_answer_says_so(mixed):
    study, _ = mixed
    data = study.document().data
    assert [data["groups"][floor]["shape"] for floor in FLOORS] == ["box", "ellipse"]
    assert codes(study.statements).count("group_shape") == len(study.choice.own) >= 1
    text = study.document().to_text()
    assert all(f"chosen in {floor}" in text for floor in study.choice.own)
    found = Identification(SteadyState(), study.estimates, lambda: After({}, {}, (), (), Attempts()), study=study)
    assert "its shape, box (gray) and ellipse (green), predicts" in found.verdict


def test_the_pictures_show_each_floor_with_its_shape(mixed):
    study, _ = mixed
    figure = study.plot()
    labels = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    assert {"box, gray", "ellipse, green"} <= labels


def test_floors_of_one_shape_share_it():
    study, _ = study_of(SAME)
    assert (study.choice.chosen, study.choice.own) == ("ellipse", {})
    assert {each.key for each in study.differences} == {f"friction.direction.coulomb[{k}]" for k in range(2)}
    assert study.choice.error == pytest.approx(study.choice.score.loo, rel=1e-12)


def test_a_shape_that_is_asked_for_is_that_of_all_floors():
    study, _ = study_of(MIXED, shape="ellipse")
    assert (study.choice.chosen, study.choice.own) == ("ellipse", {})


def test_each_wheel_has_a_level_beside_an_ellipse(monkeypatch):
    monkeypatch.setattr(steady_shapes, "DIRECTIONS", 12)
    study, _ = study_of(EACH)
    assert [study.choice.of(floor) for floor in FLOORS] == ["ellipse+wheels"] * 2
    assert all(np.size(each.robot.friction.wheels.coulomb) == 3 for each in study.estimates.values())


def test_clean_logs_give_the_level_of_each_wheel(monkeypatch):
    monkeypatch.setattr(steady_shapes, "OFF", 0.0)
    monkeypatch.setattr(steady_shapes, "NOISE", 0.0)
    monkeypatch.setattr(steady_shapes, "DIRECTIONS", 8)
    study, worlds = study_of(EACH, shape="ellipse+wheels")
    for floor in FLOORS:
        true = truths(worlds[floor], ELLIPSE)
        true |= {f"friction.wheels.coulomb[{k}]": own for k, own in enumerate(worlds[floor].each_wheel)}
        value = study.estimates[floor].value
        assert len(value) == 5
        assert value == pytest.approx({key: true[key] for key in value}, abs=2e-3)
