"""The program is solved to its optimum: beside scipy, beside DAQP, and by the conditions of an optimum."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tests.support.mpc_programs import Solver, dense, random_program, residual, reweighed


def by_scipy(program, hessian, slope):
    """Bounded least squares of scipy: 1/2 |L^T u + L^-1 f|^2 with H = L L^T. Source: Stark & Parker (1995)."""
    lower = np.linalg.cholesky(hessian)
    low, high = (each.ravel() for each in program.bounds)
    found = lsq_linear(lower.T, -np.linalg.solve(lower, slope), (low, high), method="bvls", tol=1e-14, max_iter=2000)
    return found.x.reshape(program.wanted.shape)


@pytest.mark.parametrize("robot", ["axebot", "four-wheel", "mecanum"])
@pytest.mark.parametrize("scale", [0.2, 1.0, 5.0])
@pytest.mark.some(4)
def test_it_is_the_optimum_of_scipy(robot, scale):
    rng = np.random.default_rng(8)
    for _ in range(5):
        program = random_program(rng, scale, n=8, robot=robot)
        u, passes = Solver(*program.wanted.shape).solve(program)
        hessian, slope = dense(program)
        assert passes > 0
        assert np.abs(u - by_scipy(program, hessian, slope)).max() < 1e-6


@pytest.mark.parametrize("n", [1, 20, 50])
@pytest.mark.parametrize("scale", [0.2, 1.0, 5.0])
def test_the_conditions_of_an_optimum_hold(n, scale):
    rng = np.random.default_rng(9)
    solver = Solver(n, 3)
    for _ in range(100):
        program = random_program(rng, scale, n)
        u, passes = solver.solve(program)
        assert 0 < passes <= 60
        assert residual(program, *dense(program), u) < 1e-8


def test_it_is_the_optimum_of_daqp():
    daqp = pytest.importorskip("daqp")
    rng = np.random.default_rng(10)
    solver = Solver(20, 3)
    for _ in range(200):
        program = random_program(rng, 5.0)
        u, _ = solver.solve(program)
        hessian, slope = dense(program)
        low, high = (np.ascontiguousarray(each.ravel()) for each in program.bounds)
        other = daqp.solve(hessian, slope, np.zeros((0, 60)), high, low, np.zeros(60, dtype=np.intc))[0]
        if np.abs(u.ravel() - other).max() >= 1e-6:  # then the other is the one that is off
            assert residual(program, hessian, slope, u) < residual(program, hessian, slope, other)


def test_a_good_guess_takes_one_pass():
    solver, program = Solver(20, 3), random_program(np.random.default_rng(11), 1.0)
    u, first = solver.solve(program)
    again, passes = solver.solve(program, warm=True)
    assert (first > 1, passes) == (True, 1)
    assert np.abs(again - u).max() < 1e-9


def test_inputs_stay_within_their_bounds():
    rng, solver = np.random.default_rng(12), Solver(20, 3)
    for _ in range(50):
        program = random_program(rng, 5.0)
        u, _ = solver.solve(program)
        assert np.all(np.abs(u) <= 6.0 + 1e-9)


def test_an_answer_that_rounding_moved_says_so():
    """Weights apart by up to 1e18: whatever is not called inaccurate meets the conditions of an optimum."""
    rng, solver, told, wrong = np.random.default_rng(12), Solver(20, 3), 0, 0
    for _ in range(400):
        program = reweighed(random_program(rng, 1.0), 10.0 ** rng.uniform(-6.0, 6.0, 3))
        u, passes = solver.solve(program)
        off = residual(program, *dense(program), u)
        inaccurate = solver.is_inaccurate(program, passes)
        assert inaccurate or off < 1e-6
        told, wrong = told + inaccurate, wrong + (off >= 1e-6)
    assert 0 < wrong <= told <= 100


def test_ordinary_weights_are_never_called_inaccurate():
    rng, solver = np.random.default_rng(13), Solver(20, 3)
    for _ in range(100):
        program = random_program(rng, 5.0)
        _, passes = solver.solve(program)
        assert not solver.is_inaccurate(program, passes)
