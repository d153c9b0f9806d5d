"""Order, repeats, gaps, jitter, padding and the unit of time."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.findings.check import check, check_blocks
from omnidyn.logs.log import Log
from tests.support.random_logs import clean


def ticking(t, **channels):
    t = np.asarray(t, dtype=float)
    channels = channels or {"supply": 12.0 + 0.01 * np.random.default_rng(0).normal(size=len(t))}
    return Log(t, channels, np.arange(len(t)) + 2)


def test_a_regular_clock_says_nothing():
    assert not check(ticking(np.arange(500) * 0.01)).findings


def test_time_that_goes_back_is_fatal_with_its_lines():
    t = np.arange(200) * 0.01
    t[120:] -= 0.5
    (finding,) = check(ticking(t)).of("time_back")
    assert finding.severity == "error"
    assert finding.rows == ((122, 122),)
    assert finding.numbers["farthest_s"] == pytest.approx(0.49)


@pytest.mark.parametrize(("rows", "times", "often"), [(30, 1, False), (120, 2, False), (120, 3, True), (700, 3, False)])
def test_a_time_that_goes_back_once_or_twice_is_not_often_however_short_the_log(rows, times, often):
    t = np.arange(rows) * 0.01
    for k in range(times):
        t[(k + 1) * rows // (times + 1) :] -= 0.05
    log = ticking(t + 100.0)
    (finding,) = check(log).of("time_back")
    assert finding.count == times
    assert ("finer clock" in finding.remedy_text or "do not sort" in finding.remedy_text) == often
    assert len(log.recordings()) == (1 if often else times + 1)


@pytest.mark.parametrize("lost", [3, 4, 50])
def test_a_gap_of_three_rows_or_more_is_found_where_it_is(lost):
    t = np.delete(np.arange(400) * 0.01, range(200, 200 + lost))
    (finding,) = check(ticking(t)).of("gap")
    assert finding.rows == ((201, 202),)
    assert finding.numbers["lost_rows"] == lost
    assert finding.numbers["longest_s"] == pytest.approx(0.01 * (lost + 1))


def test_two_lost_rows_are_no_gap():
    assert not check(ticking(np.delete(np.arange(400) * 0.01, [200, 201]))).of("gap")


def test_repeated_stamps_are_counted():
    t = np.arange(300) * 0.01
    t[[50, 51, 200]] = t[[49, 49, 199]]
    (finding,) = check(ticking(t)).of("time_repeats")
    assert (finding.severity, finding.count) == ("warning", 3)
    assert finding.rows == ((52, 53), (202, 202))


def test_a_clock_too_coarse_is_fatal():
    (finding,) = check(ticking(np.floor(np.arange(300) / 4) * 0.01)).of("time_repeats")
    assert finding.severity == "error"


def test_padding_at_the_end_is_told_from_time_going_back():
    t = np.concatenate([np.arange(1, 301) * 0.01, np.zeros(11)])
    values = np.concatenate([np.sin(np.arange(300.0)), np.full(11, 0.25)])
    verdict = check(ticking(t, supply=values))
    assert verdict.of("padding")[0].rows == ((302, 312),)
    assert not verdict.of("time_back")


def test_jitter_is_a_note_with_its_size():
    rng = np.random.default_rng(1)
    steps = 0.01 * (1.0 + 0.15 * rng.normal(size=2000).clip(-3, 3))
    (finding,) = check(ticking(np.cumsum(steps))).of("jitter")
    assert finding.severity == "note"
    assert finding.numbers["relative"] == pytest.approx(0.15, rel=0.1)


@pytest.mark.parametrize("step", [10.0, 1e-5])
def test_milliseconds_read_as_seconds_and_back(step):
    (finding,) = check(ticking(np.arange(300) * step)).of("time_unit")
    assert finding.severity == "error"
    assert finding.numbers["step_s"] == pytest.approx(step)


def test_the_unit_of_time_is_seen_in_position_and_speed():
    t = np.arange(4000) * 0.001
    speed = 3.0 * np.sin(5.0 * t)[:, None]
    angle = 0.6 * (1.0 - np.cos(5.0 * t))[:, None]
    wrong = ticking(t, wheel_speed=speed, wheel_angle=angle)
    (finding,) = check(replace(wrong, t=t * 1000.0)).of("time_unit")
    assert finding.numbers["ratio"] == pytest.approx(1e-3, rel=0.02)


def test_rows_without_numbers_and_few_rows():
    t = np.arange(100) * 0.01
    values = np.sin(np.arange(100.0))
    values[[10, 11]] = np.nan
    assert check(ticking(t, supply=values)).of("empty_rows")[0].rows == ((12, 13),)
    values[:50] = np.nan
    assert check(ticking(t, supply=values)).of("empty_rows")[0].severity == "error"
    assert check(ticking(t[:5])).of("few_rows")
    assert check(ticking([])).of("few_rows")[0].severity == "error"


def test_a_run_refuses_what_is_called_fatal():
    t = np.arange(200) * 0.01
    t[120:] -= 0.5
    log = ticking(t)
    assert check(log).has_errors
    with pytest.raises(InputError, match="time goes back"):
        log.to_run()


@pytest.mark.parametrize("size", [100, 333, 1000])
def test_blocks_give_the_verdict_of_the_whole(size):
    t = np.delete(np.arange(1000) * 0.01, range(300, 310))
    t[600] = t[599]
    log = ticking(t)
    whole, parts = check(log), check_blocks(log.rows(slice(k, k + size)) for k in range(0, len(log), size))
    assert {(f.code, f.rows) for f in parts.findings} == {(f.code, f.rows) for f in whole.findings}
    assert parts.rows == whole.rows


def test_a_gap_where_two_blocks_meet_is_found():
    t = np.delete(np.arange(1000) * 0.01, range(500, 520))
    log = ticking(t)
    (finding,) = check_blocks([log.rows(slice(0, 500)), log.rows(slice(500, None))]).of("gap")
    assert finding.rows == ((501, 502),)
    assert finding.numbers["lost_rows"] == 20


def test_angles_without_speeds_are_checked_as_speeds():
    """Two encoders exchanged, in a log that has angles only."""
    log, robot, _ = clean(7)
    speed = log.channels["wheel_speed"]
    angle = np.cumsum(speed * np.gradient(log.t)[:, None], axis=0)
    channels = {name: values for name, values in log.channels.items() if name != "wheel_speed"}
    good = replace(log, channels={**channels, "wheel_angle": angle})
    assert check(good, robot).of("speed_from_angle")
    assert not [finding for finding in check(good, robot).findings if finding.severity != "note"]
    swapped = replace(log, channels={**channels, "wheel_angle": angle[:, [1, 0, *range(2, angle.shape[1])]]})
    (finding,) = check(swapped, robot).of("swapped")
    assert set(finding.subject.split()) == {"w1", "w2"}


def test_a_few_rows_at_rest_are_no_impossible_energy():
    """One row a second is left of a log, the first at rest: noise of its speed is no back-EMF."""
    log, robot, _ = clean(1)
    few = log.rows(slice(0, None, round(1.0 / float(np.median(np.diff(log.t))))))
    speed = few.channels["wheel_speed"].copy()
    speed[0] = 0.01
    assert not check(replace(few, channels={**few.channels, "wheel_speed": speed}), robot).of("energy")
