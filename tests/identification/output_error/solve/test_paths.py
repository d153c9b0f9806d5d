"""Fits of angles that wheels have turned by, from guesses so far off that the path goes astray."""

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.first_point import Rates, coarse_point
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solver
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

TICK, STEP, ROWS = 2.0 * np.pi / 1440.0, 0.02, 500  # [rad], [s]
KEYS = (
    "friction.direction.coulomb[0]",
    "friction.direction.coulomb[1]",
    "friction.direction.viscous",
    "friction.direction.yaw_coulomb",
    "friction.direction.yaw_viscous",
    "body.inertia_kg_m2",
)
SPREAD = 0.9  # of the logarithms of the guesses
WAYS = np.array([[0.0, 0.87, -0.87], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])  # volts of x, y, yaw


def driven(rng):
    """Volts (ROWS, 3): at rest, then directions and turns, each held for a while, some rest between."""
    out = [np.zeros((25, 3))]
    while sum(map(len, out)) < ROWS:
        way = np.array([rng.normal(), rng.normal(), rng.normal() * (rng.random() < 0.6)]) @ WAYS
        way *= 6.0 * rng.uniform(0.2, 1.0) / np.abs(way).max() * (rng.random() > 0.12)
        out.append(np.repeat(way[None], int(rng.uniform(0.2, 1.5) / STEP), axis=0))
    return np.concatenate(out)[:ROWS]


def problem_of(seed, missing=()):
    """(a problem of counts from bad guesses, where its truth lies). missing: rows of the first wheel."""
    rng = np.random.default_rng(seed)
    robot = first_guess("new", load_robot("axebot").wheels, 1.5)
    volts = driven(rng)
    speed = simulate(robot, volts, STEP).wheel_speed
    assert speed is not None
    way = np.vstack([np.zeros(3), np.cumsum(0.5 * (speed[1:] + speed[:-1]) * STEP, axis=0)])[:ROWS]
    counts = np.floor((way + rng.uniform(0.0, 9.0, 3)) / TICK)
    counts[[*missing], 0] = np.nan
    log = Run(t=STEP * np.arange(ROWS, dtype=np.float64), voltage=volts, wheel_angle=counts * TICK)
    start = robot
    for key in KEYS:
        start = Key.parse(key).set(start, Key.parse(key).get(robot) * float(np.exp(SPREAD * rng.normal())))
    question = OutputError(free=KEYS, start="rest", tick_rad=TICK)
    problem = make_problem(read_records([log], start, question), start, question)
    true = [Key.parse(p.name).get(robot) if k < problem.robot_count else 0.0 for k, p in enumerate(problem.parameters)]
    return problem, Point(np.array(true), problem.start().states)


@pytest.mark.parametrize("seed", [4, 15, 18, 35])
def test_a_fit_of_counts_from_bad_guesses_finds_what_one_from_the_truth_does(seed):
    """It ended where an axis creeps that should rest, thousands above."""
    problem, true = problem_of(seed)
    solver = Solver(problem, ImplicitEngine(problem), counts_ticks=False)
    found = solver.state(coarse_point(problem, 0.0, FitProgress()).point)
    assert found.objective < solver.minimise(true).state.objective + 50.0


def test_a_rate_is_the_difference_from_the_last_row_that_was_measured():
    problem, true = problem_of(4, missing=(100, 101, 102))
    ((path, by_path, _),) = ImplicitEngine(problem).residuals(true)
    ((rate, by_rate, _),) = Rates(ImplicitEngine(problem)).residuals(true)
    first = int(np.flatnonzero(np.isfinite(path[0]))[0])
    assert np.isnan(rate[0, [first, 100, 101, 102]]).all()
    assert rate[0, 103] == path[0, 103] - path[0, 99]
    np.testing.assert_array_equal(by_rate[0, 103], by_path[0, 103] - by_path[0, 99])
    np.testing.assert_allclose(np.nansum(rate, axis=1), path[:, -1] - path[:, first], atol=1e-9)
