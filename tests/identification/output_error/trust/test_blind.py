"""What a log does not tell, in words, with what would: of set-ups whose lost directions follow from the equation of
motion, driven by a simulator that shares no code with ours. Seeds are others than those of the benchmark."""

import json

import numpy as np
import pytest

from benchmarks.blind.log import logged
from benchmarks.blind.setups import DEFICIENT, FRICTION, FULL, INERTIA, MASS, OHM, RADIUS, Setup
from benchmarks.blind.told import named, said
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.advice import advice
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.trust.blind_directions import _lost, _sparse

BY_NAME = {setup.name: setup for setup in (*DEFICIENT, *FULL)}


@pytest.mark.parametrize("name", [setup.name for setup in DEFICIENT])
def test_what_is_lost_is_named_with_a_cure(name):
    setup = BY_NAME[name]
    told = said(setup, 31)
    assert named(setup, told), told


@pytest.mark.parametrize("name", [setup.name for setup in FULL if setup.drive == "rich"][::2])
def test_nothing_is_named_where_nothing_is_lost(name):
    assert not said(BY_NAME[name], 32)


def test_the_scale_of_all_forces_is_one_direction_with_equal_changes():
    """Masses and friction as much larger as the resistance is smaller move the robot in the same way."""
    setup = BY_NAME["masses, resistance and friction"]
    run, robot = logged(Setup("", (*setup.free, RADIUS), logged=("twist", "wheel_speed")), 33)
    (lost,) = identify(run, robot, OutputError(free=(*setup.free, RADIUS), nuisances=())).directions
    share = {key: change / lost.changes[MASS] for key, change in lost.changes.items()}
    assert share == pytest.approx(dict.fromkeys((MASS, INERTIA, *FRICTION), 1.0) | {OHM: -1.0}, rel=0.02)
    assert lost.exact
    assert str(lost.statement()).startswith("mass +10 %, inertia +10 %, resistance -10 %")
    assert {MASS, "current"} <= set(lost.cures)


def test_the_answer_holds_it_for_people_and_for_machines():
    setup = BY_NAME["wheel radius and gear, speed over ground"]
    run, robot = logged(setup, 34)
    fit = identify(run, robot, OutputError(free=setup.free, nuisances=())).estimate
    words = "wheel radius +10 % and gear ratio +10 %: not distinguishable with this log"
    assert words in fit.summary()
    assert any(str(each).startswith(words) and "log wheel speeds" in str(each) for each in advice(fit, None))
    data = json.loads(json.dumps(fit.to_dict()))
    assert data["directions"][0]["changes"] == {RADIUS: pytest.approx(0.01), "motor.gear_ratio": pytest.approx(0.01)}
    assert RADIUS in data["directions"][0]["cures"]


def test_a_refusal_names_the_direction_and_what_would_tell_it():
    setup = BY_NAME["wheel radius and masses, wheel speeds only"]
    run, robot = logged(setup, 35)
    with pytest.raises(InsufficientDataError, match=r"wheel radius \+5 %, mass -10 %.*weigh the robot.*speed over the"):
        identify(run, robot, OutputError(free=setup.free, nuisances=()))


def test_directions_are_told_apart_so_that_each_holds_few_numbers():
    rng = np.random.default_rng(3)
    plain = np.zeros((2, 6))
    plain[0, [0, 3]], plain[1, [2, 4, 5]] = (1.0, -0.5), (1.0, 0.7, -0.3)
    turned = np.array([[0.8, 0.6], [-0.6, 0.8]]) @ plain
    found = sorted(_sparse(turned), key=lambda row: np.count_nonzero(np.abs(row) > 1e-9))
    for row, wanted in zip(found, plain, strict=True):
        assert row * np.sign(row[np.argmax(np.abs(row))]) == pytest.approx(wanted, abs=1e-12)
    assert len(_sparse(rng.normal(size=(3, 5)))) == 3


def test_what_shows_at_some_size_shows_at_a_larger_one():
    """So that the sizes of what motors push need not be found where the numbers themselves are large enough."""
    rng, shown = np.random.default_rng(5), 0
    for _ in range(300):
        root, size = rng.standard_normal((6, 12)), 10.0 ** rng.uniform(0.0, 2.0, 6)
        information = root @ root.T
        if not _lost(information, size)[1].any():
            shown += 1
            assert not _lost(information, size * (1.0 + rng.exponential(size=6)))[1].any()
    assert shown > 50
