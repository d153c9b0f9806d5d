"""Which of two models predicts blocks better, against scipy, closed forms, and logs of noise."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from scipy.stats import binom, norm, t, ttest_rel, wilcoxon

from omnidyn.identification.selection.blocks import LIMIT, LIMIT_ERRORS, compare_blocks
from tests.support.held_out_blocks import errors_of_blocks


@pytest.mark.parametrize("count", [2, 4, 10, 20])
def test_p_is_that_of_scipy(count):
    for seed in range(20):
        without, with_effect = np.exp(np.random.default_rng(seed).normal([[0.3], [0.0]], 1.0, (2, count)))
        comparison = compare_blocks(without, with_effect)
        middle = np.median(np.minimum(without, with_effect))
        ratio = np.log((without + middle) / (with_effect + middle))
        p = ttest_rel(ratio, np.zeros(count), alternative="greater").pvalue
        assert comparison.p == pytest.approx(np.clip(p, 0.5**count, 1.0 - 0.5**count), abs=1e-12)


@pytest.mark.parametrize("count", [1, 5, 10, 24])
def test_blocks_that_all_improve_alike_have_p_of_all_heads(count):
    comparison = compare_blocks(np.ones(count), np.full(count, 0.5))
    assert (comparison.better, comparison.blocks) == (count, count)
    assert comparison.p == pytest.approx(0.5**count)
    assert comparison.gain == pytest.approx(0.5)
    assert compare_blocks(np.full(count, 0.5), np.ones(count)).p == pytest.approx(1.0 - 0.5**count)


def test_one_block_and_two_decide_nothing():
    assert not compare_blocks([1.0, 1.0], [0.1, 0.1001]).is_better
    single = compare_blocks([1.0], [0.1])  # it has no scatter: neither a standard error nor a limit of t
    assert (single.std, single.t, single.p) == (0.0, np.inf, 0.5)
    assert compare_blocks([1.0, 1.0, 1.0], [0.1, 0.1, 0.1001]).is_better


@pytest.mark.parametrize("share", [0.2, 0.9, 1.0, 3.0])
def test_the_gain_is_the_share_of_the_squared_error_that_every_block_loses(share):
    without = np.random.default_rng(0).uniform(1.0, 1.001, 10)
    assert compare_blocks(without, share * without).gain == pytest.approx(1.0 - share, abs=2e-3)


def test_a_block_that_is_quiet_by_chance_does_not_decide():
    """A hundredth of an ordinary error in one block of ten, which is a hundred times as small without the effect."""
    without, with_effect = np.ones(10), np.where(np.arange(10) < 8, 0.8, 1.05)
    without[9], with_effect[9] = 1e-4, 1e-2
    assert compare_blocks(without, with_effect).is_better


def test_a_clear_gain_is_a_tenth_of_the_squared_error():
    without = np.linspace(1.0, 1.01, 10)
    assert compare_blocks(without, 0.89 * without).is_clear
    comparison = compare_blocks(without, 0.91 * without)
    assert comparison.is_better
    assert not comparison.is_clear


def test_one_block_that_rules_the_sum_does_not_rule_the_answer():
    """17 of 20 blocks better by a tenth; one, a thousand times the others, a little worse."""
    without = np.ones(20)
    with_effect = np.where(np.arange(20) < 17, 0.9, 1.02)
    without[-1] *= 1e3
    with_effect[-1] *= 1e3
    assert with_effect.sum() > without.sum()
    assert compare_blocks(without, with_effect).is_better
    assert not compare_blocks(with_effect, without).is_better


@pytest.mark.parametrize("count", [4, 10, 20])
@pytest.mark.parametrize("share", [0.5, 1e-12])
def test_one_block_that_gains_alone_does_not_pay(count, share):
    """Of one d > 0 beside others <= 0, t <= 1, however large it is."""
    without, with_effect = np.ones(count), np.where(np.arange(count) == 3, share, 1.001)
    without[3] *= 1e6
    with_effect[3] *= 1e6
    assert not compare_blocks(without, with_effect).is_better


def test_equal_errors_and_no_errors_tell_nothing():
    for values in (np.ones(10), np.zeros(10), np.zeros(0), np.full(3, np.nan)):
        comparison = compare_blocks(values, values)
        assert (comparison.p, comparison.gain, comparison.better) == (1.0, 0.0, 0)
    assert compare_blocks([1.0, np.nan, 2.0], [0.5, 1.0, np.inf]).blocks == 1


def test_errors_that_differ_by_rounding_are_equal():
    values = 1.0 + 1e-13 * np.arange(10)
    assert compare_blocks(values, np.ones(10)).p == 1.0


def test_errors_of_0_to_rounding_tell_nothing():
    """A square that is computed by differences may be below 0."""
    zeros = 1e-18 * np.random.default_rng(0).standard_normal((2, 9))
    comparison = compare_blocks(np.append(zeros[0], 1.0), np.append(zeros[1], 0.9))
    assert comparison.better == 1
    assert not comparison.is_better


def test_the_standard_error_is_that_of_the_ratios():
    """By the rule of propagation of errors: where the gain is small, all of it is 1 - exp(-ratio)."""
    ratio = np.random.default_rng(5).normal(0.1, 0.02, 10)
    comparison = compare_blocks(np.exp(ratio), np.ones(10))
    assert comparison.std == pytest.approx(np.exp(-ratio.mean()) * ratio.std(ddof=1) / np.sqrt(10), rel=0.02)


@pytest.mark.parametrize("way", [1, -1], ids=["better", "worse"])
def test_the_standard_error_is_the_slope_of_the_gain_times_that_of_the_ratios(way):
    """Of blocks of which each is about three times as bad with or without the effect, with an ordinary error of 1."""
    size = 3.0 * np.exp(np.random.default_rng(6).normal(0.0, 1e-4, 10))

    def comparison(sizes):
        return compare_blocks(*(sizes, np.ones(len(sizes)))[::way])

    by = 1e-5
    higher, lower = (comparison(2.0 * np.full(10, np.exp(np.log(2.0) + way * off)) - 1.0).gain for off in (by, -by))
    ratio = np.log((size + 1.0) / 2.0)
    expected = (higher - lower) / (2.0 * by) * ratio.std(ddof=1) / np.sqrt(10)
    assert comparison(size).std == pytest.approx(expected, rel=1e-3)


def test_the_limit_is_about_its_standard_errors_and_a_comparison_stays_as_it_is():
    assert abs(norm.sf(LIMIT_ERRORS) - LIMIT) < 2e-3
    with pytest.raises(FrozenInstanceError):
        compare_blocks([2.0, 2.0], [1.0, 1.0]).p = 0.0


def found(effect, count, logs=1000, **kind):
    """The share of logs in which the effect is found."""
    without, with_effect, _ = errors_of_blocks(1, logs, count, effect, **kind)
    return np.mean([compare_blocks(*log).is_better for log in zip(without, with_effect, strict=True)])


def found_by_others(effect, count, logs=300, **kind):
    """The same by ranks and by signs at 0.1, and by sums beyond one standard error: rules that were ours."""
    without, with_effect, _ = errors_of_blocks(1, logs, count, effect, **kind)
    gain, better = without - with_effect, (with_effect < without).sum(axis=1)
    ranks = [wilcoxon(ratio, alternative="greater").pvalue < 0.1 for ratio in np.log(without / with_effect)]
    sums = gain.sum(axis=1) > gain.std(axis=1, ddof=1) * np.sqrt(count)
    return np.mean(ranks), np.mean(binom.sf(better - 1, count, 0.5) < 0.1), np.mean(sums)


@pytest.mark.parametrize("count", [5, 10, 20])
@pytest.mark.parametrize("kind", [{}, {"tails": True}, {"ruling": 20.0}], ids=["white", "tails", "one block rules"])
def test_a_useless_number_is_found_in_less_than_5_percent_of_logs(count, kind):
    assert found(0.0, count, **kind) <= 0.05


def test_an_effect_is_found_more_often_than_by_ranks_and_signs():
    """Of 10 blocks, effects of 4 standard errors: those that all blocks show, and those that three do."""
    ours, (ranks, signs, _) = found(4.0, 10), found_by_others(4.0, 10)
    assert ours > ranks + 0.05 > signs
    assert ours > 0.75
    ours, (ranks, _, sums) = found(4.0, 10, shown=3), found_by_others(4.0, 10, shown=3)
    assert ours > ranks + 0.3
    assert ours > sums - 0.06


def test_an_effect_is_found_beside_a_block_that_rules_the_sum():
    ours, (_, _, sums) = found(8.0, 20, ruling=20.0), found_by_others(8.0, 20, ruling=20.0)
    assert ours > sums + 0.15
    assert ours > 0.7


@pytest.mark.parametrize("count", [4, 10, 20, 50])
def test_the_limit_is_beyond_one_standard_error(count):
    """So that no block decides alone."""
    assert t.sf(1.0, count - 1) > LIMIT > t.sf(1.25, count - 1)
