"""Which rows of fast logs are looked at once a fit is done, and what is applied between them."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.decimated import KEPT_ROWS, LONGEST, Decimated
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

QUESTION = OutputError(nuisances=(), start="rest")


def problem_of(rate, seconds, robot, logs=1):
    """A fit of some logs with a gap each: voltages change every 0.1 s, but for the last wheel, which changes always."""
    random, rows = np.random.default_rng(5), round(rate * seconds)
    runs = []
    for _ in range(logs):
        voltage = np.repeat(random.uniform(-6.0, 6.0, (rows // 50 + 1, 3)), 50, axis=0)[:rows]
        voltage[:, 2] = 4.0 * np.sin(np.arange(rows) / rate)
        t = np.arange(rows + 1) / rate
        t[rows // 2 :] += 3.0
        run = simulate(robot, voltage, 1.0 / rate)
        runs.append(run.replace(t=t, wheel_speed=None, wheel_angle=None, pose=None, current=None))
    records = read_records(runs, robot, QUESTION)
    return make_problem(records, robot, QUESTION, ExactEngine)


@pytest.fixture(scope="module")
def robot():
    return load_robot("axebot")


@pytest.mark.parametrize(("rate", "seconds", "logs", "stride"), [(1000, 25, 1, 8), (200, 40, 3, 4), (100, 30, 1, 1)])
def test_as_many_rows_as_the_bench_of_wrong_worlds_has(robot, rate, seconds, logs, stride):
    problem = problem_of(rate, seconds, robot, logs)
    few = Decimated.of(problem)
    rows = sum(piece.last - piece.first + 1 for piece in few.problem.pieces)
    assert rows >= 0.99 * KEPT_ROWS
    assert rows == pytest.approx(rate * seconds * logs / stride, rel=0.01)
    assert stride / rate <= LONGEST
    assert (few.problem is problem) == (stride == 1)


def means(values, rows):
    """Of values (n, ...), over what is nearest to each of some rows; of two that are as near the later one."""
    nearest = np.array([np.flatnonzero(np.abs(rows - k) == np.abs(rows - k).min())[-1] for k in range(len(values))])
    return np.array([np.nanmean(values[nearest == k], axis=0) for k in range(len(rows))])


def test_rows_that_are_kept_are_means_and_inputs_push_as_much(robot):
    """Times and shares of the run are those of the log; the integral of each voltage is, over every row."""
    problem = problem_of(1000, 12, robot)
    few = Decimated.of(problem)
    for piece, own, kept in zip(problem.pieces, few.problem.pieces, few.rows, strict=True):
        rows, record = slice(own.first, own.last + 1), own.record
        assert np.array_equal(record.t[rows], piece.record.t[kept])
        measured = piece.record.outputs[piece.first : kept[-1] + 1]
        assert np.allclose(record.outputs[rows], means(measured, kept - piece.first), atol=1e-12)
        assert np.allclose(record.share[rows], piece.record.share[kept], rtol=1e-12)
        pushed = np.cumsum(piece.record.voltage[piece.first : piece.last] * 1e-3, axis=0)
        between = np.diff(record.t[rows])[:, None]
        here = np.cumsum(record.voltage[own.first : own.last] * between, axis=0)
        assert np.allclose(here, pushed[kept[1:] - piece.first - 1], atol=1e-9)


def test_what_is_shown_in_them_is_what_all_rows_show(robot):
    problem = problem_of(1000, 12, robot)
    few = Decimated.of(problem)
    short = few.problem.shortened(900)
    every = ExactEngine.of(problem).residuals(problem.start())
    part = few.kept(ExactEngine.of(few.all_rows(short)).residuals(problem.start()))
    for (residual, slopes, _), (mine, my_slopes, _), piece, own, kept in zip(
        every, part, problem.pieces, short.pieces, few.rows, strict=True
    ):
        rows = kept[: own.last - own.first + 1] - piece.first
        assert mine.shape[1] == len(rows)
        assert np.allclose(mine.T, means(residual.T[: rows[-1] + 1], rows), atol=1e-12)
        shown = means(np.moveaxis(slopes, 1, 0)[: rows[-1] + 1], rows)
        assert np.allclose(np.moveaxis(my_slopes, 1, 0), shown, atol=1e-12)


def test_counts_are_as_measured(robot):
    problem = problem_of(1000, 12, robot)
    record = problem.pieces[0].record
    counts = replace(record, ticks=(0.01, *record.ticks[1:]))
    problem = replace(problem, pieces=tuple(replace(piece, record=counts) for piece in problem.pieces))
    few = Decimated.of(problem)
    rows = slice(few.problem.pieces[0].first, few.problem.pieces[0].last + 1)
    assert np.array_equal(few.problem.pieces[0].record.outputs[rows, 0], record.outputs[few.rows[0], 0])


def test_outputs_of_a_slower_rate_keep_all_their_rows(robot):
    problem = problem_of(1000, 12, robot)
    record = problem.pieces[0].record
    outputs = record.outputs.copy()
    outputs[np.arange(len(outputs)) % 7 > 0, 1] = np.nan
    slower = replace(record, outputs=outputs, run=None)
    sparse = replace(problem, pieces=tuple(replace(piece, record=slower) for piece in problem.pieces))
    assert Decimated.of(sparse).problem is sparse
