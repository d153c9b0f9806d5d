"""How much of the logs a diagnosis looks at, and that sums piece by piece are those of all rows."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.random_effects import RandomEffects, drawn_together
from omnidyn.identification.output_error.linear.rounded_inputs import effects
from omnidyn.identification.output_error.linear.rows import FitRows, Linear, noise_models
from omnidyn.identification.output_error.memory.autoregression import _without_empty_axes
from omnidyn.identification.output_error.problem import bounded as module
from omnidyn.identification.output_error.problem.bounded import ROWS, bounded
from omnidyn.identification.structure.misfit import Gram


@pytest.fixture(scope="module")
def case():
    return right_case(3).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0)


@pytest.fixture(scope="module")
def log(case):
    """Voltages in steps of 0.3 V."""
    run = logged(case, 7001)
    return run.replace(voltage=np.round(run.voltage / 0.3) * 0.3)


@pytest.fixture(scope="module")
def solution(case, log):
    return Fit.of(
        [log, log.replace(source="again")],
        robot_of(case.told),
        OutputError(free="friction", nuisances=()),
    ).solve()


def held(problem, beside, growing):
    """Numbers that are shown in all rows of a problem."""
    pieces = zip(problem.pieces, growing, strict=True)
    return sum(
        (p.last - p.first + 1) * len(p.record.columns) * (1 + len(problem.parameters) + len(p.free) + beside + more)
        for p, more in pieces
    )


def test_what_is_held_is_bounded_by_rows_times_columns_times_what_is_shown(solution, monkeypatch):
    """The bound counts numbers: twice as many columns, or as many channels, leave half of the rows."""
    problem, rows = solution.solver.problem, {}
    assert bounded(problem, 400, effects(problem)) is problem  # of short logs all
    monkeypatch.setattr(module, "NUMBERS", 500_000)
    for beside in (100, 400, 1600):
        part = bounded(problem, beside)
        rows[beside] = sum(p.last - p.first + 1 for p in part.pieces)
        assert 0.95 * module.NUMBERS < held(part, beside, [0] * len(part.pieces)) <= 1.01 * module.NUMBERS
    assert rows[400] / rows[1600] == pytest.approx(4.0, rel=0.15)
    part = bounded(problem, 400, effects(problem))
    assert rows[400] > sum(p.last - p.first + 1 for p in part.pieces)
    assert held(part, 400, effects(part)) <= 1.05 * module.NUMBERS


def test_long_logs_of_few_channels_stay_within_the_rows(solution):
    assert sum(p.last - p.first + 1 for p in bounded(solution.solver.problem, row_limit=1000).pieces) <= 1000 < ROWS


def test_intervals_beside_a_bounded_diagnosis_are_those_of_all_rows(case, log, monkeypatch):
    """A bound that leaves a seventh of the rows to the diagnosis; and one that leaves half of them to the intervals,
    whose part by rounding 60 draws tell within 9 %, others in each."""
    fits = []
    for numbers, rows in ((10**9, 10**9), (300_000, 10**9), (10**9, 750)):
        monkeypatch.setattr(module, "NUMBERS", numbers)
        monkeypatch.setattr(module, "ROWS", rows)
        fits.append(identify(log, robot_of(case.told), OutputError(free="friction", nuisances=())).estimate)
    every, part, half = fits
    assert [f"{each.numbers['wider']:.2g}" for each in every.warnings if each.code == "rounded_inputs"] == ["3.2"]
    for name, std in every.std.items():
        assert part.std[name] == pytest.approx(std, rel=0.05)
        assert part.value[name] == every.value[name]
    ratio = [half.std[name] / std for name, std in every.std.items()]
    assert np.exp(np.mean(np.log(ratio))) == pytest.approx(1.0, abs=0.2)
    assert ratio == pytest.approx([1.0] * len(ratio), abs=0.4)


def test_sums_over_pieces_are_those_of_all_rows_at_once(solution):
    point, problem = solution.state.point, solution.solver.problem
    rows = FitRows.of(problem, point, solution.solver.engine.residuals(point))
    linear = Linear(rows, noise_models(rows, rows.residual))
    shown = [np.random.default_rng(k).normal(size=(*own.shape, 5)) for k, own in enumerate(rows.residual)]
    e, j = linear.whole()
    every = np.column_stack([e, j, linear.white(shown)])
    gram = Gram.of(linear, shown)
    assert gram.matrix * np.outer(gram.size, gram.size) == pytest.approx(every.T @ every, rel=1e-9, abs=1e-6)


def test_columns_that_say_nothing_new_are_left_out_and_change_no_sum():
    rng = np.random.default_rng(1)
    few = rng.normal(size=(20_000, 4))
    series = np.column_stack([10.0 * rng.normal(size=20_000), few @ rng.normal(size=(4, 30))])
    (found,) = _without_empty_axes([series])
    assert found.shape == (20_000, 5)
    assert (found**2).sum() == pytest.approx((series**2).sum(), rel=1e-12)
    assert (found[1:] * found[:-1]).sum() == pytest.approx((series[1:] * series[:-1]).sum(), rel=1e-9)
    short = [series[:100]]
    assert _without_empty_axes(short) is short


def test_effects_that_are_drawn_together_have_the_variance_that_they_have_alone():
    """Of 300 effects that each last for 20 of 3000 rows: 40 columns hold what all do, in each row."""
    shown = np.zeros((3000, 300))
    for k in range(300):
        shown[10 * k : 10 * k + 20, k] = 1.0 + 0.1 * np.arange(len(shown[10 * k : 10 * k + 20]))
    root = RandomEffects.of(shown, 0.3).open
    alone = ((shown @ root) ** 2).sum(axis=1)
    together = ((shown @ drawn_together(root, 40)) ** 2).sum(axis=1)
    assert together.sum() == pytest.approx(alone.sum(), rel=0.01)
    assert together == pytest.approx(alone, rel=0.1)
