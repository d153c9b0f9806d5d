"""Fits with a cause begin where the fit before ended, guesses of `init` too; their priors stay those of the file."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.structure.missing import refits
from omnidyn.model.first_guess import first_guess, with_gear
from omnidyn.model.robot import GIVEN
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate


def test_numbers_with_a_prior_begin_where_they_were_found(axebot, monkeypatch):
    """Friction of every axis by itself: the disc of `init` misses it, so that causes are fitted."""
    wheels = axebot.wheels.replace(wheel_radius=0.035, robot_radius=0.1)
    guessed = with_gear(first_guess("mine", wheels, 1.5, 6.0), 19.0, "", GIVEN)
    random = np.random.default_rng(7)
    run = simulate(axebot, np.repeat(random.uniform(-6.0, 6.0, (20, 3)), 50, axis=0), 0.01)
    speeds = run.channels["wheel_speed"] + 0.02 * random.standard_normal((len(run), 3))
    begun, begin = [], refits._begun

    def noted(candidate, way, problem, solution, errors):
        fit = begin(candidate, way, problem, solution, errors)
        begun.append((fit, problem, solution))
        return fit

    monkeypatch.setattr(refits, "_begun", noted)
    assert identify(Run(t=run.t, voltage=run.voltage, wheel_speed=speeds), guessed).lack_of_fit.found
    compared = 0
    for fit, problem, solution in begun:
        found = dict(zip(problem.names, solution.state.point.values, strict=True))
        held = dict(zip(problem.names, solution.held_parameters, strict=True))
        priors = {p.name: p.prior for p in problem.parameters if p.prior}
        for p, value in zip(fit.solver.problem.parameters, fit.state.point.values, strict=True):
            if p.name in priors and not held[p.name] and p.part != "friction":
                assert value == pytest.approx(found[p.name], rel=1e-9)
                assert p.prior == priors[p.name]
                compared += 1
    assert compared >= 5
