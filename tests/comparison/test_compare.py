"""compare: what it says of the true robot, of wrong ones and of two, over several logs; what it refuses."""

import json

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.stats import binom

import omnidyn
from omnidyn.cli.terminal.streams import to_json
from omnidyn.comparison.compare import what_is_compared
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.overlay import draw_overlay
from omnidyn.run import Run
from tests.support.codes import codes
from tests.support.compared_logs import NOISE, POSE_NOISE, clean_log, coulomb_times, noisy

AXEBOT, FOUR = load_robot("axebot"), load_robot("four-wheel")
POSE = ("x", "y", "heading")


@pytest.fixture(scope="module")
def logs():
    starts = [{}, {"twist": (0.4, -0.2, 2.0), "pose": (1.0, 2.0, 3.0)}]
    return [noisy(clean_log(AXEBOT, seed, **starts[seed % 2]), seed) for seed in range(120)]


@pytest.fixture(scope="module")
def found(logs):
    return [omnidyn.compare(AXEBOT, log) for log in logs]


def test_of_the_true_robot_only_the_noise_is_left(found):
    """rmse = noise within 2 % on average and 15 % each; fit near 100 %; VAF = 100 (1 - noise^2/variance)."""
    for name, noise in NOISE.items():
        rmse = np.array([each.rmse[name] for each in found])
        assert rmse.mean() == pytest.approx(noise, rel=0.025)
        assert np.abs(rmse / noise - 1.0).max() < 0.2
    assert min(each.fit_percent[name] for each in found for name in ("vx", "vy", "omega")) > 94.0
    assert min(each.vaf[name] for each in found for name in ("vx", "vy", "omega")) > 99.6
    one = found[0]
    expected = 100.0 * (1.0 - NOISE["vx"] ** 2 / np.var(one.measured[0].twist[:, 0]))
    assert one.vaf["vx"] == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("names", [tuple(NOISE), POSE])
def test_its_errors_are_called_white_in_95_percent(found, names):
    """False alarms within what a rate of 5 % gives; wheels follow the body, so tests of one log are not independent."""
    p = np.array([[each.overall["axebot"][name].whiteness for name in names] for each in found])
    low, high = binom.ppf([0.001, 0.999], p.size // 2, 0.05) / (p.size // 2)
    assert low <= (p < 0.05).mean() <= high


def test_its_lag_is_zero(found):
    lags = [each.overall["axebot"][name].lag for each in found for name in NOISE]
    assert set(lags) == {0.0}
    assert found[0].overall["axebot"]["x"].lag is None


def test_of_a_wrong_robot_more_is_left(logs):
    """A fifth more friction: never white, errors well above the noise, and the drift of the pose is in them."""
    wrong = coulomb_times(AXEBOT, 1.2)
    for log in logs[:10]:
        found = omnidyn.compare(wrong, log)
        assert found.rmse["vx"] > 1.5 * NOISE["vx"]
        assert found.overall[wrong.name]["vx"].whiteness < 1e-6
        assert found.overall[wrong.name]["vy"].whiteness < 1e-3
    assert omnidyn.compare(wrong, logs[:10]).rmse["x"] > 3.0 * POSE_NOISE[0]


def test_a_late_sensor_is_hinted_at(logs):
    """Speeds of the wheels recorded 50 ms late."""
    clean = clean_log(AXEBOT, 5)
    late = np.stack([np.interp(clean.t - 0.05, clean.t, column) for column in clean.wheel_speed.T], axis=1)
    found = omnidyn.compare(AXEBOT, clean.replace(wheel_speed=late)).overall["axebot"]
    for name in ("w1", "w2", "w3"):
        assert found[name].lag == pytest.approx(0.05, abs=0.004)
    assert found["vx"].lag == 0.0


def test_of_two_robots_the_true_one_is_better(logs):
    wrong = coulomb_times(AXEBOT, 1.2)
    for first, second in ((AXEBOT, wrong), (wrong, AXEBOT)):
        found = omnidyn.compare(first, logs[:12], second)
        assert found.robots == (first.name, second.name)
        assert {found.better(name) for name in ("vx", "vy")} == {"axebot"}
        assert {found.better(name) for name in ("x", "y")} <= {"axebot", None}
        gap = found.overall[first.name]["vx"].rmse - found.overall[second.name]["vx"].rmse
        assert found.difference["vx"].rmse_difference == pytest.approx(gap, rel=1e-9)


def test_a_robot_is_no_better_than_itself(logs):
    found = omnidyn.compare(AXEBOT, logs[0], AXEBOT)
    assert found.robots == ("axebot (A)", "axebot (B)")
    assert {found.better(name) for name in found.channels} == {None}
    assert "the same" in found.summary()


def test_robots_that_differ_by_nothing_measurable_are_not_told_apart(logs):
    """One a ten-thousandth off on either side: the noise decides, and is not believed."""
    pair = coulomb_times(AXEBOT, 1.0001), coulomb_times(AXEBOT, 0.9999)
    for tried in ([[log] for log in logs[:30]], [logs[k : k + 10] for k in range(0, 120, 10)]):
        told = [omnidyn.compare(pair[0], each, pair[1]).difference.values() for each in tried]
        assert sum(any(one.better is not None for one in each) for each in told) <= 5  # of 30 and 12, at 5 % each


def test_several_logs_are_one_comparison(logs):
    """Overall numbers are over all samples of all logs; segments keep apart; the summary names the count."""
    three = logs[:3]
    found, each = omnidyn.compare(AXEBOT, three), [omnidyn.compare(AXEBOT, log) for log in three]
    assert [segment.log for segment in found.segments] == [0, 1, 2]
    squares = sum(one.rmse["vx"] ** 2 * one.overall["axebot"]["vx"].samples for one in each)
    assert found.overall["axebot"]["vx"].samples == 3 * 401
    assert found.rmse["vx"] == pytest.approx(np.sqrt(squares / (3 * 401)), rel=1e-12)
    for k, one in enumerate(each):
        part = found.by_segment["axebot"]["vx"][k]
        assert (part.rmse, part.samples) == (one.rmse["vx"], 401)
    seconds = sum(log.t[-1] for log in three)
    assert f"axebot against 3 logs, first log 0: 3 free runs, {seconds:.4g} s" in found.summary()


def test_logs_may_hold_different_channels(logs):
    """A component that only one log has is compared there; the other log has no sample of it."""
    found = omnidyn.compare(AXEBOT, [logs[0], logs[1].replace(twist=None)])
    assert found.overall["axebot"]["vx"].samples == 401
    assert found.by_segment["axebot"]["vx"][1] is None
    assert found.overall["axebot"]["w1"].samples == 802
    assert "0" in found.summary(segments=True)
    absent = found.trace("axebot", "vx", found.segments[1])
    assert np.isnan(absent.measured).all()
    assert absent.model == pytest.approx(logs[1].twist[:, 0], abs=0.1)
    assert draw_overlay(found, log=1, channels=("vx", "w1")).svg


def test_a_gap_makes_segments(logs):
    log = logs[0]
    kept = np.r_[0:200, 230:401]
    cut = Run(t=log.t[kept], **{name: values[kept] for name, values in log.channels.items()}, source="cut")
    found = omnidyn.compare(AXEBOT, cut)
    rows = [(segment.start, segment.stop) for segment in found.segments]
    assert rows == [(0, 200), (200, 371)]
    assert found.segments[1].begin == log.t[230]
    assert codes(found.warnings) == ["restarts_at_gaps"]
    assert found.rmse["vx"] == pytest.approx(NOISE["vx"], rel=0.15)
    assert "segment 2: rows 200 to 370" in found.summary(segments=True)


def test_a_signal_that_never_changes_has_no_fit():
    run = omnidyn.simulate(AXEBOT, [[0.0, 3.0, -3.0]] * 100, 0.01)
    found = omnidyn.compare(coulomb_times(AXEBOT, 1.2), run)
    assert (found.fit_percent["vy"], found.vaf["vy"]) == (None, None)
    assert "no fit and no VAF where the measured signal never changes" in found.summary()


def test_currents_without_sign(logs):
    clean = clean_log(AXEBOT, 7)
    sized = clean.replace(current=np.abs(clean.current))
    plain = omnidyn.compare(AXEBOT, sized)
    assert plain.rmse["i1"] > 0.3
    assert codes(plain.warnings)[-1] == "currents_never_negative"
    assert omnidyn.compare(AXEBOT, clean).warnings == ()
    found = omnidyn.compare(AXEBOT, sized, current_unsigned=True)
    assert found.rmse["i1"] < 1e-9
    assert "currents are compared by size" in found.summary()


def test_four_wheels():
    found = omnidyn.compare(FOUR, clean_log(FOUR, 1))
    assert found.channels[3:11] == ("w1", "w2", "w3", "w4", "i1", "i2", "i3", "i4")
    assert max(found.rmse.values()) < 1e-9


def test_the_paper_s_robot_repeats_table_4():
    """The steps of Table 4 replayed: axebot to rounding; the robot of the lab's own numbers is off, and is told."""
    volts = np.repeat([[0.0, 3.0, -3.0], [4.0, -2.0, -2.0], [2.0, 2.0, 2.0]], 150, axis=0)
    run = omnidyn.simulate(AXEBOT, volts, 0.01)
    found = omnidyn.compare(AXEBOT, run, load_robot("axebot-lab"))
    assert max(found.overall["axebot"][name].rmse for name in found.channels) < 1e-9
    assert {found.better(name) for name in ("vx", "vy", "omega")} == {"axebot"}


def test_as_json(logs):
    found = omnidyn.compare(AXEBOT, logs[:2], coulomb_times(AXEBOT, 1.2))
    document = json.loads(to_json(found.to_dict()))
    assert document["logs"] == ["log 0", "log 1"]
    assert document["units"]["w1"] == "rad/s"
    assert document["robots"]["axebot"]["overall"]["vx"]["rmse"] == found.rmse["vx"]
    assert document["difference"]["vx"]["better"] == "axebot"
    assert document["segments"][1]["log"] == 1


def test_the_summary_is_ascii(logs):
    text = omnidyn.compare(AXEBOT, logs[0].replace(source="Fahrt über Gras")).summary()
    assert text.isascii()
    assert "applied: the logged voltage" in text
    assert max(map(len, text.splitlines())) <= 110


def test_what_is_refused(logs):
    with pytest.raises(InputError, match="log 0: the log is of another robot; got voltage of 3 wheels; expected 4"):
        omnidyn.compare(FOUR, logs[0])
    with pytest.raises(InputError, match="the two robots cannot both be that of the logs; got 3 and 4 wheels"):
        omnidyn.compare(AXEBOT, logs[0], FOUR)
    with pytest.raises(InsufficientDataError, match="no log to compare with"):
        omnidyn.compare(AXEBOT, [])
    blind = Run(t=logs[0].t, voltage=logs[0].voltage)
    with pytest.raises(InsufficientDataError, match="hold nothing that a model predicts; got voltage"):
        omnidyn.compare(AXEBOT, blind)
    with pytest.raises(InputError, match="did you mean voltage"):
        omnidyn.compare(AXEBOT, logs[0], apply="voltages")
    assert what_is_compared([AXEBOT], logs[:1])[:3] == ("vx", "vy", "omega")


def test_angles_of_wheels_are_compared_from_where_they_begin():
    """Against Simpson's rule on a run with a hundred rows for one; they count from any level."""
    voltage = np.repeat(np.random.default_rng(4).uniform(-6.0, 6.0, (10, 3)), 15, axis=0)
    voltage[:15] = 0.0
    speed = omnidyn.simulate(AXEBOT, np.repeat(voltage, 100, axis=0), 2e-4).wheel_speed
    assert speed is not None
    angle = cumulative_simpson(speed, dx=2e-4, axis=0, initial=0.0)[::100] + np.array([5.0, -3.0, 100.0])
    log = Run(t=0.02 * np.arange(151), voltage=np.vstack([voltage, voltage[-1:]]), wheel_angle=angle)
    found = omnidyn.compare(AXEBOT, log)
    assert found.channels == ("a1", "a2", "a3")
    assert max(found.rmse.values()) < 1e-3
    assert min(found.fit_percent.values()) > 99.9
    wrong = omnidyn.compare(coulomb_times(AXEBOT, 1.2), log)
    assert max(wrong.rmse.values()) > 100.0 * max(found.rmse.values())
