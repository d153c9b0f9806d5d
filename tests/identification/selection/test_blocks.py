"""Which of two models predicts blocks better, against scipy, closed forms, and logs of noise."""

import numpy as np
import pytest
from scipy.stats import binom, wilcoxon

from omnidyn.identification.selection.blocks import LIMIT, compare_blocks


@pytest.mark.parametrize("count", [4, 10, 20])
def test_p_is_that_of_scipy(count):
    for seed in range(20):
        ratio = np.random.default_rng(seed).normal(0.3, 1.0, count)
        comparison = compare_blocks(np.exp(ratio), np.ones(count))
        assert comparison.p == pytest.approx(wilcoxon(ratio, alternative="greater", method="exact").pvalue, abs=1e-12)


@pytest.mark.parametrize("count", [1, 5, 10, 24])
def test_blocks_that_all_improve_have_p_of_all_heads(count):
    """1/2^n: one of all signs; alike ratios share their rank."""
    for with_effect in (np.full(count, 0.5), np.linspace(0.2, 0.8, count)):
        comparison = compare_blocks(np.ones(count), with_effect)
        assert (comparison.better, comparison.blocks) == (count, count)
        assert comparison.p == pytest.approx(0.5**count)


def test_ratios_of_one_size_make_a_sign_test():
    """With all ranks alike W counts signs: the binomial distribution."""
    without = np.where(np.arange(20) < 14, 2.0, 0.5)
    comparison = compare_blocks(without, np.ones(20))
    assert comparison.p == pytest.approx(binom.sf(13, 20, 0.5))
    assert comparison.better == 14
    assert comparison.gain == pytest.approx(0.5)


def test_one_block_that_rules_the_sum_does_not_rule_the_answer():
    """17 of 20 blocks better by a tenth; one, a thousand times the others, a little worse."""
    without = np.ones(20)
    with_effect = np.where(np.arange(20) < 17, 0.9, 1.02)
    without[-1] *= 1e3
    with_effect[-1] *= 1e3
    assert with_effect.sum() > without.sum()
    assert compare_blocks(without, with_effect).is_better
    assert not compare_blocks(with_effect, without).is_better


def test_one_block_that_gains_alone_does_not_pay():
    without, with_effect = np.ones(10), np.where(np.arange(10) == 3, 0.5, 1.01)
    without[3] = with_effect[3] = 1e6
    with_effect[3] /= 100.0
    assert not compare_blocks(without, with_effect).is_better


def test_equal_errors_and_no_errors_tell_nothing():
    for values in (np.ones(10), np.zeros(10), np.zeros(0), np.full(3, np.nan)):
        comparison = compare_blocks(values, values)
        assert (comparison.p, comparison.gain, comparison.better) == (1.0, 0.0, 0)
    assert compare_blocks([1.0, np.nan, 2.0], [0.5, 1.0, np.inf]).blocks == 1


def errors_of_blocks(seed, count, effect, ruling=1.0, tails=False, rows=20):
    """Squared errors of blocks, held out in turn: y = x1 + x2 + effect x3 + noise, without x3 and with it.

    effect: in standard errors of its number. ruling: noise of one block, of that of the others.
    """
    random = np.random.default_rng(seed)
    x = random.standard_normal((count, rows, 3))
    noise = random.standard_t(3, (count, rows)) if tails else random.standard_normal((count, rows))
    noise[random.integers(count)] *= ruling
    y = x @ [1.0, 1.0, effect / np.sqrt(count * rows)] + noise
    errors = []
    for n in (2, 3):
        matrix, moment = np.einsum("bri,brj->bij", x[..., :n], x[..., :n]), np.einsum("bri,br->bi", x[..., :n], y)
        numbers = np.linalg.solve(matrix.sum(0) - matrix, (moment.sum(0) - moment)[..., None])[..., 0]
        errors.append(((y - np.einsum("bri,bi->br", x[..., :n], numbers)) ** 2).sum(axis=1))
    return errors


def share(draws, **how):
    """(share of logs in which the effect is found, that by a sign test with LIMIT)."""
    found = np.zeros(2)
    for seed in range(draws):
        comparison = compare_blocks(*errors_of_blocks(seed, **how))
        found += comparison.is_better, binom.sf(comparison.better - 1, comparison.blocks, 0.5) < LIMIT
    return found / draws


@pytest.mark.parametrize("count", [10, 20])
@pytest.mark.parametrize("kind", [{}, {"tails": True}, {"ruling": 20.0}], ids=["white", "tails", "one block rules"])
def test_a_useless_number_is_found_in_less_than_5_percent_of_logs(count, kind):
    found = share(1000, count=count, effect=0.0, **kind)[0]
    assert found + 2.0 * np.sqrt(0.05 * 0.95 / 1000) < 0.05 + 0.01


def test_an_effect_is_found_more_often_than_by_signs():
    """Of 10 blocks: more of the effects of 4 standard errors, at no more false ones."""
    (ours, signs), (false, false_signs) = (share(1000, count=10, effect=size) for size in (4.0, 0.0))
    assert ours > signs + 0.15
    assert false <= false_signs
    assert ours > 0.6


def test_an_effect_is_found_beside_a_block_that_rules_the_sum():
    """More than twice as often as by the sum of squares and two of its standard errors."""

    def by_sums(without, with_effect):
        gain = without - with_effect
        return gain.sum() > 2.0 * gain.std(ddof=1) * np.sqrt(len(gain))

    logs = [errors_of_blocks(seed, 20, 8.0, ruling=20.0) for seed in range(300)]
    by_ranks = np.mean([compare_blocks(*log).is_better for log in logs])
    assert by_ranks > 2.0 * np.mean([by_sums(*log) for log in logs])
    assert by_ranks > 0.7
