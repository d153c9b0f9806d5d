"""The level of the noise by what a log shows without the model, against the noise that was put in; and misfit that
follows nothing, which only such a level tells from noise."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.lack_of_fit import HOLDS, NEIGHBOURS, REPEATS, REST
from omnidyn.identification.methods import OutputError
from omnidyn.identification.validation import validate
from tests.support.axebot_logs import NOISE
from tests.support.codes import codes
from tests.support.held_commands import AXEBOT, RATE, commands, lack_of, log_of


def assert_levels(lack, source):
    """The noise that was put in, within four standard errors of the level by its degrees of freedom, and no misfit."""
    for (name, one), std in zip(lack.noise.items(), NOISE, strict=True):
        assert one.source == source, name
        assert one.level == pytest.approx(std, rel=4.0 / np.sqrt(2.0 * one.degrees)), name
        assert one.chi2 == pytest.approx(1.0, abs=0.4)
    assert not lack.beyond
    assert not lack.found


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_repeats_show_all_of_the_noise(rho):
    once = commands(1, 10.0)
    lack = lack_of(np.tile(once, (3, 1)), rho=rho)
    assert_levels(lack, REPEATS)
    assert all(one.from_hz == 0.0 for one in lack.noise.values())


def test_holds_show_white_noise():
    lack = lack_of(commands(2))
    assert_levels(lack, HOLDS)
    assert all(0.0 < one.from_hz < 10.0 for one in lack.noise.values())
    assert all(one.degrees > 100.0 for one in lack.noise.values())


def test_slow_noise_is_no_misfit_beside_holds_that_do_not_see_it():
    """At a correlation of .98 windows of a hold hold half of it: so do those that they are compared with."""
    lack = lack_of(commands(3), rho=0.98)
    assert all(one.level < 0.7 * std for one, std in zip(lack.noise.values(), NOISE, strict=True))
    assert not lack.found


def unsteady(clean, rng):
    """Up and down from row to row, for 0.15 s from each change of the command on: nothing smooth follows that."""
    changed = np.diff(clean.voltage, axis=0, prepend=clean.voltage[:1]).any(axis=1)
    rows = np.arange(len(clean.t))
    soon = rows - np.maximum.accumulate(np.where(changed, rows, -100)) < 15
    return 3.0 * NOISE * (soon * (-1.0) ** rows)[:, None]


def test_misfit_that_follows_nothing_is_found_by_holds_and_leads_the_verdict():
    lack = lack_of(commands(2), unsteady)
    assert lack.found
    assert lack.follows == ()
    assert lack.remedies == ()
    assert "twist[0]" in lack.beyond
    one = lack.noise["twist[0]"]
    assert one.level == pytest.approx(NOISE[0], rel=0.12)
    assert one.share == pytest.approx(1.0 - 1.0 / one.chi2, abs=0.1)
    assert lack.channels["twist[0]"] >= one.share
    words = str(lack.statement())
    assert "m/s where the log scatters, while commands are held, by" in words or "rad/s where the log scatters" in words
    assert "% of its variance is not noise" in words
    assert lack.to_dict()["noise"]["twist[0]"]["source"] == HOLDS


def test_misfit_that_comes_again_with_the_commands_is_found_by_repeats_and_chi2_fails():
    """White, so that nothing else finds it, but the same each time."""
    again = 1.5 * NOISE * np.random.default_rng(5).normal(size=(1000, 3))
    log = log_of(np.tile(commands(1, 10.0), (3, 1)), lambda clean, rng: np.resize(again, clean.twist.shape))
    fit = identify(log, AXEBOT, OutputError(nuisances=())).estimate
    lack, seen = fit.lack_of_fit, validate(fit, [log], [log])
    assert all(score.chi2 == pytest.approx(1.0 + 1.5**2, rel=0.25) for score in seen.scores["fitted"].values())
    assert seen.statement().numbers["fitted_too"]
    assert lack.found
    assert {"twist[0]", "twist[1]", "twist[2]"} == set(lack.beyond)
    for one, std in zip(lack.noise.values(), NOISE, strict=True):
        assert one.source == REPEATS
        assert one.level == pytest.approx(std, rel=4.0 / np.sqrt(2.0 * one.degrees))
        assert one.share == pytest.approx(1.5**2 / (1.0 + 1.5**2), abs=0.08)


def test_a_misfit_beside_slow_noise_is_as_large_as_it_is_said_to_be():
    """A white one of .4 of the noise, which remembers: seen in what is new from row to row, 14 % of the variance."""
    again = 0.4 * NOISE * np.random.default_rng(5).normal(size=(1000, 3))
    lack = lack_of(np.tile(commands(1, 10.0), (3, 1)), lambda clean, rng: np.resize(again, clean.twist.shape), rho=0.95)
    assert {"twist[0]", "twist[1]", "twist[2]"} == set(lack.beyond)
    for (name, one), std in zip(lack.noise.items(), NOISE, strict=True):
        assert one.new > 0.5
        assert one.share == pytest.approx(0.4**2 / (1.0 + 0.4**2), abs=0.15)
        assert lack.channels[name] == one.share
        assert lack.sizes[name] < 0.6 * std
    assert "of what is new from row to row, is not noise" in str(lack.statement())


def test_noise_that_comes_of_motion_is_said_and_is_no_misfit():
    """Three times as much noise while it moves: at rest the log says nothing of that."""

    def shaken(clean, rng):
        moves = (clean.twist != 0.0).any(axis=1)[:, None]
        return 3.0 * NOISE * moves * rng.normal(size=clean.twist.shape)

    lack = lack_of(commands(4), shaken)
    assert not lack.found
    assert {one.source for one in lack.noise.values()} == {HOLDS}
    assert all(one.level == pytest.approx(std, rel=0.3) for one, std in zip(lack.at_rest.values(), NOISE, strict=True))
    told = "\n".join(map(str, lack.statements()))
    assert "follow nothing that a model should know" in told
    assert "misfit, or noise that comes with motion" in told


def test_a_log_that_cannot_tell_says_so():
    """No command is held, nothing comes again, and slow noise is no noise from row to row."""
    t = np.arange(3000) / RATE
    sweep = 4.0 * np.stack([np.sin(2.0 * np.pi * (f * t + 0.02 * t**2)) for f in (0.31, 0.47, 0.73)], axis=1) + 0.3
    lack = lack_of(sweep, rho=0.5)
    assert lack.noise == {}
    assert "noise_unknown" in codes(lack.statements())


def test_neighbours_tell_white_noise_where_nothing_else_does():
    t = np.arange(3000) / RATE
    sweep = 4.0 * np.stack([np.sin(2.0 * np.pi * f * t) for f in (0.031, 0.047, 0.073)], axis=1) + 0.3
    lack = lack_of(sweep)
    told = [one for one in lack.noise.values() if one.source == NEIGHBOURS]
    assert told
    assert not lack.beyond
    for name, std in zip(("twist[0]", "twist[1]", "twist[2]"), NOISE, strict=True):
        if name in lack.noise:
            one = lack.noise[name]
            assert one.level == pytest.approx(std, rel=4.0 / np.sqrt(2.0 * one.degrees))


@pytest.mark.parametrize("times", [4.0])
def test_a_sensor_that_rounds_says_nothing_at_rest(times):
    step = times * NOISE
    lack = lack_of(commands(4), twist=lambda values: np.round(values / step) * step)
    assert REST not in {one.source for one in (*lack.noise.values(), *lack.at_rest.values())}
