"""The descent: what it asks the engine for."""

import numpy as np
import pytest

import omnidyn.identification.output_error.solve.solver as solver_module
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.moved_axes import motion
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.record import record
from omnidyn.identification.output_error.solve.solver import END_PRECISION, MAX_ITERATIONS, Solver, State
from omnidyn.model import dynamics
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw


def test_a_fit_marches_through_no_point_twice(axebot, monkeypatch):
    """Two starts, two steps, and once more for the intervals: the better start is not marched through again."""
    asked, marched = [], ExactEngine.sums

    def sums(engine, point, weighting):
        asked.append((point.values.tobytes(), weighting.mode))
        return marched(engine, point, weighting)

    monkeypatch.setattr(ExactEngine, "sums", sums)
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    found = identify(log, axebot, OutputError(start="rest", nuisances=())).estimate
    assert found.converged
    assert len(asked) == len(set(asked))


def test_a_fit_derives_the_motors_once(axebot, monkeypatch):
    """For whether the robot is exact, and for what the kernels take; the friction is put beside these."""
    derived, wrench = [], dynamics.wrench_of_motors

    def wrench_of_motors(*given):
        derived.append(given)
        return wrench(*given)

    monkeypatch.setattr(dynamics, "wrench_of_motors", wrench_of_motors)
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    dynamics._motor_wrench.cache_clear()
    derived.clear()
    identify(log, axebot, OutputError(start="rest", nuisances=()))
    assert len(derived) == 2  # braking and driving


def test_what_an_axis_held_is_asked_only_where_one_stood_still(axebot):
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    assert motion([record(log, axebot)], axebot).moving_axes.all()
    assert not motion([record(log, axebot)], axebot).held_forces.any()
    assert log.twist is not None
    still = log.replace(twist=log.twist * [1.0, 0.0, 1.0])
    found = motion([record(still, axebot)], axebot)
    assert found.moving_axes.tolist() == [True, False, True]
    assert found.held_forces[1] > 1.0


# ---- steps that creep along a kink ----------------------------------------------------------------------


class Kink(Solver):
    """A solver on a descent without an end, of which each step lowers F by a number of `drops`."""

    def __init__(self, problem, close, drops):
        super().__init__(problem, ExactEngine(problem), precision=close)
        self.drops, self.level = iter(drops), 0.0

    def state(self, point, variance=None):
        self.level -= next(self.drops)
        return State(point, [], self.level, np.ones(len(self.problem.columns)))


class Downhill:
    """Normal equations that always see the best point far away."""

    def __init__(self, solver, state):
        self.held, self.point = np.zeros(len(solver.problem.parameters), bool), state.point
        self.inner, self.gradient, self.information = (0.0 * self.held, 0.0 * self.held, np.eye(len(self.held)))

    def distance_without(self, still):
        return 100.0

    def moved(self, damping, still, bend, onto, share):
        return self.point


@pytest.fixture
def on_a_kink(axebot, monkeypatch):
    """(close, drops of F) -> the Solution."""
    asked = OutputError(nuisances=())
    log = noisy_draw(simulate(axebot, excitation(2.0), 0.01), 0)
    problem = make_problem(read_records([log], axebot, asked), axebot, asked)
    monkeypatch.setattr(solver_module, "Normal", Downhill)
    return lambda close, drops: Kink(problem, close, drops).minimise(problem.start())


def test_a_coarse_fit_ends_where_its_steps_creep(on_a_kink):
    """Two steps in a row that gain less than 3 x `close`: it went on for all of its sixty steps."""
    assert on_a_kink(0.1, [0.0, 5.0, 0.29, 0.29, *[0.29] * 80]).iterations == 3
    assert on_a_kink(0.1, [0.0, *[0.29] * 80]).converged


def test_steps_that_gain_are_no_creep(on_a_kink):
    """A step that gains begins the count anew, however small the one before."""
    assert on_a_kink(0.1, [0.0, *[0.31] * 80]).iterations == MAX_ITERATIONS
    assert on_a_kink(0.1, [0.0, *[0.29, 0.31] * 40]).iterations == MAX_ITERATIONS


def test_a_fine_fit_may_creep(on_a_kink):
    """Behind a speed loop it creeps for long, and yet finds its way: it ends by the distance alone."""
    found = on_a_kink(END_PRECISION, [0.0, *[1e-6] * 80])
    assert (found.iterations, found.converged) == (MAX_ITERATIONS, False)
