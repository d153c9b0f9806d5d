"""The ladder spends a counted number of fits on wheels that slip, and says what it did not try for that."""

from dataclasses import replace

import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import SlipEngine
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.structure.ladder.models import Model, Move
from omnidyn.identification.structure.ladder.slip_budget import FITS, NOT_NEEDED_NOTE, SPENT_NOTE, Purse, quick_first
from tests.identification.structure.test_tails import AXEBOT, log, spoiled

GRIP, MASS = "wheels.traction_mu", "body.mass_kg"


@pytest.fixture(scope="module")
def rolls():
    """A fit of wheels that roll."""
    fit = Fit.of(log(0.0), AXEBOT, OutputError(nuisances=()))
    return Model.first(fit, fit.solve())


def move(key, chi2):
    return Move({"all": Remedy(key, key, 0.1, 0.0, chi2=chi2)})


def test_what_needs_the_slow_engine_comes_last(rolls):
    moves = [move(GRIP, 9.0), move(MASS, 8.0)]
    assert quick_first(moves, rolls) == ([moves[1]], [moves[0]])


def test_so_many_fits_with_wheels_that_slip_are_made_and_the_others_named(rolls):
    robot, question = rolls.begins["all"]
    slippery = robot.replace(wheels=robot.wheels.replace(traction_mu=1.0))
    slips = replace(rolls, begins={"all": (slippery, question)})
    purse, asked = Purse(), [move(f"m{k}", 1.0) for k in range(FITS + 2)]
    assert purse.pays(asked[:2], slips) == asked[:2]
    assert purse.pays(asked[2:], slips) == asked[2:FITS]
    assert purse.pays(asked, rolls) == asked  # others are as many as there are
    assert [(each.move, each.reason) for each in purse.untried()] == [(own, SPENT_NOTE) for own in asked[FITS:]]
    assert purse.untried() == []


def test_behind_what_leaves_only_noise_rivals_alone_are_tried(rolls):
    best = replace(rolls, move=move(MASS, 100.0))
    near, far = move(GRIP, 95.0), move(GRIP, 90.0)
    purse = Purse()
    assert purse.rivals([near, far], best) == [near]
    assert [(each.move, each.reason) for each in purse.untried()] == [(far, NOT_NEEDED_NOTE)]


@pytest.mark.long  # the rule itself is tested above
def test_a_wrong_mass_under_wild_samples_needs_no_fit_of_wheels_that_slip(monkeypatch):
    """A grip is among the remedies: fits of it, by Student's t, took more than ten minutes."""
    made, raw = [], Fit.solve
    monkeypatch.setattr(Fit, "solve", lambda self, *a: made.append(self.groups[0].robot) or raw(self, *a))
    light = AXEBOT.replace(body=AXEBOT.body.replace(mass=0.7 * AXEBOT.body.mass))
    estimate = identify(spoiled(4, 100.0), light, OutputError(nuisances=(), ladder=True)).estimate
    assert estimate.ladder is not None
    assert [rung.key for rung in estimate.ladder.taken] == ["loss", MASS]
    assert abs(estimate.value[MASS] / AXEBOT.body.mass - 1.0) < 3e-3
    assert 3 <= len(made) <= 8
    assert not any(robot.wheels.traction_mu for robot in made)
    assert [rung.why for rung in estimate.ladder.rungs if rung.key == GRIP] == [NOT_NEEDED_NOTE]


def test_a_fit_by_students_t_goes_on_from_the_scales_that_it_has(monkeypatch):
    """Least squares once, of a step a row; not again at every tolerance."""
    asked, raw = [], SlipEngine.sums
    grippy = AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=5.0, wheel_inertia=1e-5))
    seen = lambda self, point, by: asked.append((self.tol, by.nu)) or raw(self, point, by)  # noqa: E731
    monkeypatch.setattr(SlipEngine, "sums", seen)
    run = spoiled(4, 100.0)
    assert run.voltage is not None
    assert run.twist is not None
    short = run.replace(t=run.t[:120], voltage=run.voltage[:120], twist=run.twist[:120])
    identify(short, grippy, OutputError(nuisances=(), loss="student-t", free=("friction",)))
    assert {nu for tol, nu in asked if tol is None} == {0.0, 4.0}
    assert {nu for tol, nu in asked if tol is not None} == {4.0}
