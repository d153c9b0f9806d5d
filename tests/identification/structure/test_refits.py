"""Candidates that are fitted before they are ranked: other shapes of friction, and what that costs."""

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import logged, robot_of
from benchmarks.wrong_worlds.score import FRICTION, drawn
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.structure import diagnosis
from omnidyn.identification.structure.missing import refits
from omnidyn.model.keys import WHEELS
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw


def test_friction_at_the_wheels_under_the_file_of_a_box_is_named_first():
    """A simulator that shares no code; a column near the fit named limits, radii and resistances instead."""
    case, seed, _ = drawn(by_name("wheels"), 65)
    lack = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).lack_of_fit
    assert lack.found
    first = lack.remedies[0]
    assert first.key == WHEELS
    assert first.gain > first.gain_std


def test_a_right_model_costs_no_fit_of_others(monkeypatch):
    """All that is tried of it stays within columns near the fit."""
    asked = []
    monkeypatch.setattr(diagnosis, "refits", lambda *args: asked.append(args) or {})
    robot = load_robot("axebot")
    log = noisy_draw(simulate(robot, excitation(20.0, 100.0), 0.01), 3)
    assert not identify(log, robot, OutputError()).lack_of_fit.found
    assert not asked


def test_steps_are_few(monkeypatch):
    """Every candidate STEPS of the solver, the best GO_ON of them MORE."""
    taken, own = [], refits._Refit.gone_on
    monkeypatch.setattr(refits._Refit, "gone_on", lambda self, steps: taken.append(steps) or own(self, steps))
    case, seed, _ = drawn(by_name("resistance"), 61)
    lack = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).lack_of_fit
    assert lack.found
    assert sum(steps == refits.MORE_STEPS for steps in taken) <= refits.MORE_FITS
    assert sum(steps == refits.STEPS for steps in taken) <= refits.BEST + 2 * len(refits.ALWAYS_TRIED)
