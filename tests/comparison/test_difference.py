"""Which model is better: false calls, power, and the standard error against repeated experiments."""

import numpy as np
import pytest

from omnidyn.comparison.nearer_model import changes, difference
from omnidyn.comparison.traces import Trace


def coloured(random, count, memory):
    """Noise of standard deviation 1 whose neighbours correlate by `memory`."""
    noise, root = random.normal(size=count + 100), np.sqrt(1.0 - memory**2)
    for k in range(1, len(noise)):
        noise[k] = memory * noise[k - 1] + root * noise[k]
    return noise[100:]


def pair(measured, first, second):
    t = np.arange(len(measured)) * 0.01
    return Trace(t, measured, first), Trace(t, measured, second)


def both(random, pieces, count, memory, shift=0.0, size=0.5):
    """Models as far above the truth as below, by `size`, but for a shift towards the first."""
    pairs = []
    for _ in range(pieces):
        off = np.full(count, size)
        pairs.append(pair(coloured(random, count, memory) + shift, off, -off))
    return [list(side) for side in zip(*pairs, strict=True)]


@pytest.mark.parametrize("pieces, count, memory", [(1, 400, 0.0), (1, 3000, 0.9), (20, 150, 0.5)])
def test_of_two_equally_good_models_none_is_better(pieces, count, memory):
    """The truth lies in the middle: at most about 5 % of the logs may say otherwise."""
    random = np.random.default_rng(4)
    told = [difference(*both(random, pieces, count, memory)).better for _ in range(150)]
    assert sum(each is not None for each in told) <= 18  # 12 %: 4 standard deviations above 5 %
    assert {0, 1} >= set(told) - {None}


def test_what_the_start_is_off_by_is_one_draw_for_the_whole_piece():
    """Twelve pieces, each with an offset of its own besides little noise: whole pieces are the blocks."""
    random = np.random.default_rng(7)
    told = {True: 0, False: 0}
    for _ in range(150):
        pairs = [pair(random.normal() + 0.3 * random.normal(size=200), np.ones(200), -np.ones(200)) for _ in range(12)]
        sides = [list(side) for side in zip(*pairs, strict=True)]
        for whole in told:
            told[whole] += difference(*sides, whole=whole).better is not None
    assert told[True] <= 18  # 12 %: 4 standard deviations above 5 %
    one = difference(*([each] for each in pairs[0]), whole=True)
    assert (one.blocks, one.std_error, one.better) == (1, None, None)


def test_many_components_judged_together_are_judged_harder():
    random = np.random.default_rng(4)
    logs = [both(random, 1, 400, 0.0) for _ in range(300)]
    alone = sum(difference(*log).better is not None for log in logs)
    together = sum(difference(*log, tests=12).better is not None for log in logs)
    assert together <= 5
    assert together < alone


@pytest.mark.parametrize("shift, better", [(0.3, 0), (-0.3, 1)])
def test_the_nearer_model_is_found(shift, better):
    random = np.random.default_rng(4)
    told = [difference(*both(random, 1, 1000, 0.5, shift)).better for _ in range(50)]
    assert told == [better] * 50


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_the_standard_error_is_the_scatter_of_repeated_experiments(memory):
    random = np.random.default_rng(9)
    found = [difference(*both(random, 1, 2000, memory, 0.2)) for _ in range(150)]
    scatter = np.std([each.rmse_difference for each in found])
    assert np.median([each.std_error for each in found]) == pytest.approx(scatter, rel=0.25)


def test_the_difference_is_that_of_the_rmse():
    random = np.random.default_rng(2)
    measured, first, second = random.normal(size=(3, 500))
    measured[17] = np.nan
    found = difference(*([each] for each in pair(measured, first, second)))
    known = np.isfinite(measured)
    one, two = (np.sqrt(np.mean((model - measured)[known] ** 2)) for model in (first, second))
    assert found.rmse_difference == pytest.approx(one - two, rel=1e-12)
    turned = difference(*([each] for each in pair(measured, second, first)))
    assert turned.rmse_difference == pytest.approx(two - one, rel=1e-12)


def test_a_model_right_to_the_noise_beats_a_wrong_one_on_one_short_run():
    """The inputs are given: a smooth gap between the models is no noise."""
    random, t = np.random.default_rng(3), np.arange(300) * 0.01
    truth = np.sin(3.0 * t)
    found = difference(*([each] for each in pair(truth + 0.01 * random.normal(size=300), truth, 1.2 * truth)))
    assert found.better == 0
    assert found.std_error < 0.01 * abs(found.rmse_difference)


def test_equal_models_are_the_same_and_few_blocks_cannot_tell():
    random = np.random.default_rng(0)
    y = random.normal(size=200)
    same = difference(*([each] for each in pair(y, y + 1.0, y + 1.0)))
    assert (same.rmse_difference, same.std_error, same.better) == (0.0, 0.0, None)
    slow = np.cumsum(random.normal(size=200))
    few = difference(*([each] for each in pair(slow, np.zeros(200), np.ones(200))))
    assert few.blocks < 8
    assert (few.std_error, few.better) == (None, None)
    nothing = np.full(50, np.nan)
    assert difference(*([each] for each in pair(nothing, nothing, nothing))) is None


def test_how_far_wheels_turn_in_each_tenth_of_a_second_tells_of_one_log():
    """Two models whose speeds are equally wrong by draws of 20 s: at most about 5 % of the logs may say otherwise.
    Their angles wander off, and tell nothing of one log; a model three times as wrong is found."""
    random, told, found = np.random.default_rng(9), 0, 0
    for _ in range(100):
        true, *wrong = (np.cumsum(0.01 * coloured(random, 2000, 0.9)) for _ in range(4))
        sides = [[changes(trace, 0.1)] for trace in pair(true, true + wrong[0], true + wrong[1])]
        told += difference(*sides).better is not None
        sides = [[changes(trace, 0.1)] for trace in pair(true, true + wrong[0], true + 3.0 * wrong[2])]
        found += difference(*sides).better == 0
        whole = [[trace] for trace in pair(true, true + wrong[0], true + 3.0 * wrong[2])]
        assert difference(*whole, whole=True).better is None
    assert told <= 14  # 4 standard deviations above 5 %
    assert found >= 95


def test_changes_are_those_of_the_rows():
    trace = changes(pair(np.arange(201.0) ** 2, np.arange(201.0), np.zeros(201))[0], 0.5)
    assert trace.t.tolist() == [0.5, 1.0, 1.5, 2.0]
    assert trace.measured.tolist() == [2500.0, 7500.0, 12500.0, 17500.0]
    assert trace.model.tolist() == [50.0, 50.0, 50.0, 50.0]
