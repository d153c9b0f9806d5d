"""The clock of each channel: samples, steps, and whether a blank is a missing value or the row of another sensor."""

import numpy as np
import pytest

from omnidyn.clocks import fastest_step, has_own_clock, is_staggered, samples, time_of_row, usual_step
from omnidyn.errors import InputError
from omnidyn.findings.check import check
from omnidyn.identification.output_error.problem.differences import added_up, differences
from omnidyn.logs.log import Log
from omnidyn.logs.run_file import read_run, write_run
from omnidyn.run import Run

NAN = np.nan


def interleaved(offset, rows=200, step=0.02, jitter=0.0):
    """Two sensors of one rate, the second so much later: (t, first, second)."""
    rng = np.random.default_rng(1)
    one, other = (np.arange(rows) * step + late + jitter * rng.normal(size=rows) for late in (0.0, offset))
    t = np.unique(np.concatenate([one, other]))
    columns = [np.full(len(t), NAN) for _ in range(2)]
    for column, own in zip(columns, (one, other), strict=True):
        column[np.searchsorted(t, own)] = np.sin(own)
    return t, *columns


@pytest.mark.parametrize("offset", [1e-6, 20e-6, 3e-3, 0.01])
def test_the_step_of_a_channel_is_that_of_its_own_samples(offset):
    t, one, other = interleaved(offset)
    assert usual_step(t, one) == pytest.approx(0.02)
    assert usual_step(t, np.column_stack([one, other])) == pytest.approx(0.02)
    assert fastest_step(t, [one, other]) == pytest.approx(0.02)
    assert usual_step(t) < 0.0101
    own, values = samples(t, one)
    np.testing.assert_allclose(own, np.arange(200) * 0.02)
    np.testing.assert_array_equal(values, np.sin(own))


@pytest.mark.parametrize("jitter", [0.0, 1e-3])
def test_blanks_are_rows_of_others_or_missing_values(jitter):
    t, one, other = interleaved(3e-3, jitter=jitter)
    assert has_own_clock(t, one)
    assert is_staggered(t, [one, other])
    equal = np.arange(400) * 0.02 + jitter * np.random.default_rng(2).normal(size=400)
    for share in (0.02, 0.15):
        missing = np.where(np.random.default_rng(3).uniform(size=400) < share, NAN, 1.0)
        assert not has_own_clock(equal, missing)
        assert not is_staggered(equal, [missing])
        assert usual_step(equal, missing) == np.median(np.diff(equal))


def test_a_slow_topic_leaves_few_blanks_in_a_fast_one():
    """200 Hz beside 5 Hz: 2.4 % of the cells of the fast one are blank, and none is missing."""
    fast, slow = np.arange(2000) / 200.0, np.arange(50) / 5.0 + 0.0011
    t = np.unique(np.concatenate([fast, slow]))
    values = np.where(np.isin(t, fast), 1.0, NAN)
    assert has_own_clock(t, values)
    assert usual_step(t, values) == pytest.approx(0.005)


def test_a_time_is_so_many_rows_of_all_topics():
    t, *_ = interleaved(1e-6)
    assert round(0.4 / time_of_row(t, True)) == 40  # 20 samples of each of two
    assert time_of_row(np.arange(9) * 0.02, False) == pytest.approx(0.02)
    assert time_of_row(np.zeros(1), True) == 0.0


def test_speeds_that_are_counts_are_added_up_at_their_own_clock():
    """Counts of an encoder over 10 ms, and another sensor 3 ms later: the angles are those of equal stamps."""
    t = np.arange(2000) * 0.01
    tick = 2.0 * np.pi / 1000.0
    turned = np.floor((8.0 * np.sin(0.7 * t) + 3.0 * np.sin(1.9 * t))[:, None] * [1.0, 0.7] / tick)
    speed = np.diff(turned, axis=0, prepend=turned[:1]) * tick / 0.01
    equal = Run(t=t, wheel_speed=speed, current=np.ones((2000, 2)))
    rows = np.sort(np.concatenate([t, t + 0.003]))
    mine = np.searchsorted(rows, t)
    wide = [np.full((4000, 2), NAN) for _ in range(2)]
    wide[0][mine], wide[1][mine + 1] = speed, 1.0
    apart = Run(t=rows, wheel_speed=wide[0], current=wide[1])
    found, told = differences([equal]), differences([apart])
    assert found is not None
    assert told is not None
    np.testing.assert_array_equal(told.ticks, found.ticks)
    angle, lost = added_up(apart, told)
    np.testing.assert_array_equal(angle[mine], added_up(equal, found)[0])
    assert np.isnan(angle[mine + 1]).all()
    assert not lost.any()


def run_of(offset):
    t, one, other = interleaved(offset)
    return Run(t=t, wheel_speed=one[:, None], current=other[:, None])


def test_a_run_has_the_step_of_its_sensors_and_gives_their_samples():
    run = run_of(20e-6)
    assert run.staggered
    assert run.step == pytest.approx(0.02)
    t, values = run.samples("current")
    np.testing.assert_allclose(t, np.arange(200) * 0.02 + 20e-6)
    assert values.shape == (200, 1)
    assert len(run.samples("twist")[0]) == 0
    with pytest.raises(InputError, match="no such channel; got speed; expected voltage, duty"):
        run.samples("speed")
    assert "400 samples, 3.98002 s at 50 Hz" in run.document().to_text(120)
    assert "%" not in run.document().to_text(120)  # nothing is missing


def test_what_a_blank_is_survives_runs_and_their_files(tmp_path):
    run = run_of(3e-3)
    kept = read_run(write_run(run, tmp_path / "run.csv"))
    for each in (run, kept):
        assert Log.of_run(each).own_clocks
        assert not [found for found in check(each).findings if found.code in ("missing", "time_unit")]
        assert check(each).rate == pytest.approx(50.0)
    whole = np.sin(np.arange(200) * 0.1)[:, None]
    gone = np.where(np.arange(200)[:, None] % 20 == 3, NAN, whole)
    few = Run(t=np.arange(200) * 0.02, wheel_speed=gone, current=whole)
    kept = read_run(write_run(few, tmp_path / "few.csv"))
    for each in (few, kept):
        assert not Log.of_run(each).own_clocks
        assert [found.subject for found in check(each).findings if found.code == "missing"] == ["w1"]
