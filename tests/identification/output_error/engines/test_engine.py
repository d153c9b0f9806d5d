"""The march against simulate, which knows nothing of it: outputs, and slopes as central differences of whole runs."""

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.kernel.march_sums import FINAL
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point, per_column
from omnidyn.model.keys import Key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.march_cases import ROBOT_KEYS, a_case

NUISANCES = ("latency", "gain", "dead_band", "fade")
TRUE = {"latency": 0.0137, "gain": 1.07, "dead_band": 0.21, "fade": 0.06}


def problem_of(robot, run, free=ROBOT_KEYS, nuisances=(), outputs=("twist", "wheel_speed", "current", "heading")):
    given = OutputError(free=free, nuisances=nuisances, start="free", outputs=outputs)
    return make_problem(read_records([run], robot, given), robot, given)


def at_truth(problem, start, heading, nuisances=None):
    """The point of the truth: start twist, and the heading counted from where it was."""
    values = problem.start().values.copy()
    for j, name in enumerate(problem.names[problem.robot_count :], problem.robot_count):
        values[j] = (nuisances or TRUE)[name.partition(".")[0]]
    offset = [heading if name == "heading" else 0.0 for name, _ in problem.columns]
    return Point(values, (np.concatenate([start, offset]),))


def logged(run, robot=None):
    return np.hstack([run.twist, run.wheel_speed, run.current, run.pose[:, 2:]])


@pytest.mark.parametrize("seed", range(6))
def test_outputs_are_those_of_simulate(seed):
    robot, run, _, _, start = a_case(seed)
    problem = problem_of(robot, run)
    ((outputs, _),) = ExactEngine(problem).outputs(at_truth(problem, start, 0.0))
    expected = logged(run)
    np.testing.assert_allclose(outputs, expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(6))
def test_slopes_are_central_differences_of_whole_runs(seed):
    """At least 99 % within 1e-6 of the largest slope of the column; the rest stands within a step of a kink."""
    robot, run, voltage, dt, start = a_case(seed)
    problem = problem_of(robot, run)
    point = at_truth(problem, start, 0.0)
    ((_, slopes),) = ExactEngine(problem).outputs(point)
    good, total = 0, 0
    for j, key in enumerate(ROBOT_KEYS):
        step = 1e-6 * Key.parse(key).get(robot)
        sides = []
        for sign in (1.0, -1.0):
            moved = Key.parse(key).set(robot, Key.parse(key).get(robot) + sign * step)
            sides.append(logged(simulate(moved, voltage, dt, twist=start)))
        differences = (sides[0] - sides[1]) / (2.0 * step)
        scale = np.abs(differences).max(axis=0) + 1e-300
        error = np.abs(slopes[:, :, j] - differences) / scale
        good, total = good + int((error <= 1e-6).sum()), total + error.size
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        sides = [logged(simulate(robot, voltage, dt, twist=start + sign * step)) for sign in (1.0, -1.0)]
        differences = (sides[0] - sides[1]) / 2e-6
        error = np.abs(slopes[:, :, len(ROBOT_KEYS) + axis] - differences)
        good, total = good + int((error <= 1e-6 * np.abs(differences).max()).sum()), total + error.size
    assert good >= 0.99 * total


def impaired(robot, run, voltage, dt, start, late, gain, dead, fade):
    """What instruments that are `late` record of a robot behind a driver with a gain, a dead band and a fading supply.

    By simulate on a grid with a row at every t - late.
    """
    worn = (run.t[:-1] - run.t[0]) / (run.t[-1] - run.t[0])
    applied = gain * (1.0 - fade * worn)[:, None] * np.sign(voltage) * np.maximum(np.abs(voltage) - dead, 0.0)
    seen = run.t - late
    grid = np.unique(np.concatenate([run.t, seen[seen > 0.0]]))
    which = np.searchsorted(run.t, grid[:-1], side="right") - 1
    fine = simulate(robot, applied[which], np.diff(grid), twist=start)
    return logged(fine)[np.searchsorted(grid, seen[seen > 0.0])], seen > 0.0


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_nuisances_are_those_of_a_run_that_has_them(seed):
    robot, run, voltage, dt, start = a_case(seed)
    problem = problem_of(robot, run, nuisances=NUISANCES)
    point = at_truth(problem, start, 0.0)
    ((outputs, slopes),) = ExactEngine(problem).outputs(point)
    expected, seen = impaired(robot, run, voltage, dt, start, *TRUE.values())
    used = np.isfinite(outputs[seen]).all(axis=1)
    assert used.sum() > 0.8 * len(run)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(outputs[seen][used] / scale, expected[used] / scale, atol=1e-10)
    for k, name in enumerate(NUISANCES):
        sides = []
        for sign in (1.0, -1.0):
            numbers = dict(TRUE)
            numbers[name] += sign * 1e-6
            sides.append(impaired(robot, run, voltage, dt, start, *numbers.values())[0])
        differences = (sides[0] - sides[1]) / 2e-6
        at = [j for j, own in enumerate(problem.names) if own.partition(".")[0] == name]
        ours = slopes[seen][:, :, at].sum(axis=2)
        error = np.abs(ours - differences)[used] / (np.abs(ours[used]).max(axis=0) + 1e-9)
        # A sample whose t - latency meets the start of a row, or that differs by rounding, jumps in the current.
        assert np.mean(error <= 1e-7) >= 0.99, (k, name)


def test_sums_are_those_of_residuals_and_slopes():
    robot, run, _, _, start = a_case(2)
    rng = np.random.default_rng(5)
    twist = run.twist + rng.normal(size=run.twist.shape) * 0.02
    twist[rng.random(twist.shape) < 0.1] = np.nan
    run = Run(t=run.t, voltage=run.voltage, twist=twist, wheel_speed=run.wheel_speed + 0.3)
    problem = problem_of(robot, run, nuisances=("latency", "dead_band"))
    engine, point = ExactEngine(problem), at_truth(problem, start, 0.0)
    variance = np.linspace(0.5, 2.0, len(problem.columns))
    (sums,) = engine.sums(point, Weighting(variance, 4.0, FINAL, 50))
    ((outputs, slopes),) = engine.outputs(point)
    residual = problem.pieces[0].record.outputs - outputs
    known = np.isfinite(residual)
    residual[~known], slopes[~known] = 0.0, 0.0
    z2 = residual**2 / variance
    weight = 5.0 / (4.0 + z2)
    np.testing.assert_array_equal(sums.number, known.sum(axis=0))
    np.testing.assert_allclose(sums.square, (weight * residual**2).sum(axis=0))
    np.testing.assert_allclose(sums.loss, (2.5 * np.log1p(z2 / 4.0)).sum(axis=0))
    np.testing.assert_allclose(sums.grad, np.einsum("kc,kcp->cp", weight * residual, slopes), atol=1e-9)
    curvature = weight * (4.0 - z2) / (4.0 + z2)
    np.testing.assert_allclose(sums.info, np.einsum("kc,kcp,kcq->cpq", curvature, slopes, slopes), atol=1e-7)
    np.testing.assert_allclose(sums.drift.sum(axis=0), (weight * residual).sum(axis=0), atol=1e-10)
    np.testing.assert_allclose(sums.score.sum(axis=0), (sums.grad / variance[:, None]).sum(axis=0), atol=1e-8)


@pytest.mark.parametrize("nu", [0.0, 4.0])
def test_both_marches_add_up_the_same(axebot, nu):
    _, _, voltage, _, _ = a_case(2)
    run = simulate(axebot, np.clip(voltage[:, :3], -6, 6), 0.01)
    twist = run.twist + np.random.default_rng(1).normal(size=run.twist.shape) * 0.05
    twist[7] = np.nan
    run = Run(t=run.t, voltage=run.voltage, twist=twist)
    given = OutputError(start="free", nuisances=())
    problem = make_problem(read_records([run], axebot, given), axebot, given)
    weighting = Weighting(np.array([0.01, 0.02, 0.3]), nu, FINAL, 40)
    fast, slow = (ExactEngine(problem, fast).sums(problem.start(), weighting)[0] for fast in (True, False))
    for name in ("number", "square", "loss", "lag", "grad", "info", "score", "drift"):
        a, b = getattr(fast, name), getattr(slow, name)
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * np.abs(b).max(), err_msg=name)
    assert per_column([fast], 3, "number").sum() == 3 * len(run) - 3
