"""A dear engine near a point by a cheap one, and that a fit of a model that misses something needs few dear marches."""

from collections import Counter

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.memory.whitened import near
from omnidyn.identification.output_error.prepare import FINE_TOLERANCE, make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.model.first_guess import first_guess, with_gear
from omnidyn.model.robot import GIVEN
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.friction_shapes import implicit


@pytest.fixture(scope="module")
def guessed(axebot):
    """What `init` makes of a drawing and a scale, for the engine that is dear."""
    wheels = axebot.wheels.replace(wheel_radius=0.035, robot_radius=0.1)
    return implicit(with_gear(first_guess("mine", wheels, 1.5, 6.0), 19.0, "", GIVEN))


@pytest.fixture(scope="module")
def log(axebot):
    """10 s of steps at 100 Hz, friction of every axis by itself: a disc leaves a good deal of it."""
    random = np.random.default_rng(7)
    voltage = np.repeat(random.uniform(-6.0, 6.0, (20, 3)), 50, axis=0)
    run = simulate(axebot, voltage, 0.01)
    speeds = run.channels["wheel_speed"] + 0.1 * random.standard_normal((len(run), 3))
    return Run(t=run.t, voltage=run.voltage, wheel_speed=speeds)


@pytest.fixture
def problem(log, guessed):
    asked = OutputError()
    return make_problem(read_records([log], guessed, asked), guessed, asked)


def apart(ours, theirs):
    """Root mean squares over the only piece: (of what residuals differ by, of what slopes do over that of each)."""
    (residual, slopes, _), (other, others, _) = ours[0], theirs[0]
    off, size = ((part**2).mean(axis=(0, 1)) ** 0.5 for part in (slopes - others, others))
    return np.nanmean((residual - other) ** 2) ** 0.5, (off / size).max()


def test_it_is_exact_at_its_point_and_nearly_so_beside_it(problem):
    """1 % more friction: by a step a row speeds are off by five times as much as put right at the point."""
    dear, cheap, point = ImplicitEngine(problem, FINE_TOLERANCE), ImplicitEngine(problem), problem.start()
    ours = near(dear, point)
    assert max(apart(ours.residuals(point), dear.residuals(point))) < 1e-9
    more = np.where(["friction" in name for name in problem.names], 1.01, 1.0)
    aside = Point(more * point.values, point.states)
    off, corrected = (apart(each.residuals(aside), dear.residuals(aside))[0] for each in (cheap, ours))
    assert corrected < 0.2 * off


def test_it_is_the_engine_itself_where_there_is_no_cheaper_one(problem):
    by_rows = ImplicitEngine(problem)
    assert near(by_rows, problem.start()) is by_rows


def test_a_model_that_misses_something_takes_few_dear_marches(log, guessed, monkeypatch):
    """Errors remember, and bend the likelihood: 32 marches with a tolerance without the cheap one."""
    marched, simulated = Counter(), ImplicitEngine._simulated

    def counted(engine, point):
        marched[engine.tol] += 1
        return simulated(engine, point)

    monkeypatch.setattr(ImplicitEngine, "_simulated", counted)
    found = identify(log, guessed, OutputError(nuisances=("latency",), covariance="autoregressive")).estimate
    assert found.converged
    assert sum(marched.values()) - marched[None] <= 28
