"""Wheel speeds that are differences of counts: recognised, added up and fitted; what only looks alike is left alone."""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.identification.coloured import TICK, counted
from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import TICK as TICKS
from benchmarks.wrong_worlds.log import logged, right_case
from omnidyn.comparison.compare import compare
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.problem.differences import added_up, differences
from omnidyn.identification.output_error.problem.record import record
from omnidyn.identification.validation import validate
from omnidyn.run import Run
from tests.support.axebot_logs import TRUTH, voltages

RATE = 100.0
STEP = TICK * RATE  # [rad/s] of the speeds


@pytest.fixture(scope="module")
def make(axebot):
    """seed -> a log of 20 s."""
    return counted(axebot, voltages(np.random.default_rng(31), 20.0, RATE))


@pytest.fixture(scope="module")
def log(make):
    return make(0)


@pytest.fixture(scope="module")
def clean(make):
    """Speeds of the wheels: the mean over many phases has next to no rounding left."""
    return np.mean([make(seed).wheel_speed for seed in range(60)], axis=0)


def with_speed(log, speed, rows=None):
    rows = slice(None) if rows is None else rows
    return Run(log.t[rows], voltage=log.voltage[rows], wheel_speed=speed[rows])


def test_counts_and_their_tick_are_found(log):
    found = differences([log])
    assert found is not None
    assert found.ticks == pytest.approx(TICK)
    assert not found.reason
    angle, lost = added_up(log, found)
    assert np.diff(angle, axis=0) == pytest.approx(log.wheel_speed[1:] / RATE)
    assert not lost.any()


@pytest.mark.parametrize("name, seed", [("ellipse", 340_004), ("turning frame", 8141), ("wheels", 142_004)])
def test_counts_of_a_robot_that_moves_briskly_at_50_rows_a_second_are_found(name, seed):
    """Over four rows its motion alone looks like a sum that wanders."""
    case = by_name(name).make(right_case(seed).setup_but(sensor="counts", memory=0.0, rate=50.0), 0.03)
    assert differences([logged(case, seed)]) is not None
    own = logged(case.setup_but(sensor="speeds"), seed, noisy=False)
    step, rng = TICKS * 50.0, np.random.default_rng(seed)
    assert own.wheel_speed is not None
    anew = np.floor(own.wheel_speed / step + rng.random(own.wheel_speed.shape)) * step
    assert differences([with_speed(own, anew)]) is None


def test_a_text_of_two_decimals_and_a_clock_of_milliseconds_keep_them(log):
    t = np.round(log.t + 1e-3 * np.random.default_rng(1).uniform(-1.0, 1.0, len(log)), 3)
    found = differences([Run(t, voltage=log.voltage, wheel_speed=np.round(log.wheel_speed, 2))])
    assert found is not None
    assert found.ticks == pytest.approx(TICK, rel=1e-3)


def test_speeds_over_uneven_rows_of_their_own_stamps(log):
    """A firmware that divides by the time since the row before."""
    dt = 0.01 * np.random.default_rng(2).uniform(0.8, 1.2, len(log))
    speed = log.wheel_speed * 0.01 / dt[:, None]
    found = differences([Run(np.cumsum(dt), voltage=log.voltage, wheel_speed=speed)])
    assert found is not None
    assert found.has_stamps
    assert found.ticks == pytest.approx(TICK)


def test_a_wheel_that_never_turned_has_the_tick_of_the_others(log):
    speed = log.wheel_speed.copy()
    speed[:, 1] = 0.0
    found = differences([with_speed(log, speed)])
    assert found is not None
    assert found.ticks == pytest.approx(TICK)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 2.0, 5.0])
def test_rounded_speeds_are_none(log, clean, noise):
    """Each row rounded by itself, with noise of so many steps."""
    speed = clean + noise * STEP * np.random.default_rng(3).normal(size=clean.shape)
    assert differences([with_speed(log, np.round(speed / STEP) * STEP)]) is None


@pytest.mark.parametrize("step", [0.01, 0.05, 0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("noise", [0.02, 0.4])
def test_speeds_rounded_by_a_text_are_none(log, clean, noise, step):
    speed = clean + noise * np.random.default_rng(4).normal(size=clean.shape)
    assert differences([with_speed(log, np.round(speed / step) * step)]) is None


@pytest.mark.parametrize("rows", [2, 3, 5])
def test_means_over_several_rows_and_centred_differences_are_none(log, rows):
    count = np.cumsum(log.wheel_speed, axis=0)
    back = np.zeros_like(count)
    back[rows:] = (count[rows:] - count[:-rows]) / rows
    assert differences([with_speed(log, back)]) is None
    assert differences([with_speed(log, np.roll(back, -(rows // 2), axis=0))]) is None
    held = np.repeat(back[rows::rows], rows, axis=0)
    assert differences([with_speed(log, held, slice(len(held)))]) is None


def test_speeds_over_less_than_a_row_are_none(log, clean):
    """A controller of 1 kHz whose log has every tenth speed: what was turned in between is not in it."""
    speed = np.floor(clean / STEP + np.random.default_rng(5).uniform(size=clean.shape)) * STEP
    assert differences([with_speed(log, speed)]) is None


def test_missing_rows_split_the_log(axebot, log):
    kept = ~np.isin(np.arange(len(log)), [700, 1300])
    speed = log.wheel_speed.copy()
    speed[1000, 2] = np.nan
    run = with_speed(log, speed, kept)
    read = record(run, axebot, count_differences=differences([run]))
    assert [first for first, _ in read.pieces] == [0, 700, 999, 1299]
    assert {name for name, _ in read.columns} == {"wheel_angle"}
    assert [each.numbers["rows"] for each in read.notes if each.code == "split_at_missing_counts"] == [3]


def test_a_wheel_that_is_out_for_long_is_one_loss(axebot, log):
    speed = log.wheel_speed.copy()
    speed[800:1200, 1] = np.nan
    run = with_speed(log, speed)
    read = record(run, axebot, count_differences=differences([run]))
    assert read.pieces == ((0, 799), (1199, len(log) - 1))
    assert {name for name, _ in read.columns} == {"wheel_angle"}
    assert [each.numbers["rows"] for each in read.notes if each.code == "split_at_missing_counts"] == [400]


def test_too_many_missing_rows_leave_them_as_they_are(axebot, log):
    kept = np.random.default_rng(6).random(len(log)) > 0.1
    run = with_speed(log, log.wheel_speed, kept)
    read = record(run, axebot, count_differences=differences([run]))
    assert {name for name, _ in read.columns} == {"wheel_speed"}
    assert [each.numbers["why"].code for each in read.notes if each.code == "counts_as_readings"] == ["counts_missing"]


def test_the_fit_to_them_is_as_sharp_as_counts_are(axebot, make):
    """Speeds as of a moment have a latency of half a row, and intervals two to five times as wide.

    (Four to eight times while only an autoregression told their errors: differences of rounding want mixed.py.)
    """
    miss, logs = [], [make(seed) for seed in range(4)]
    fits = [identify(log, axebot, OutputError()).estimate for log in logs]
    for fit in fits:
        assert "wheel speeds are differences of encoder counts (tick 0.00517 rad)" in " ".join(map(str, fit.warnings))
        assert set(fit.noise) == {f"wheel_angle[{i}]" for i in range(3)}
        assert abs(fit.nuisances["latency.wheel_angle"].value) < 1e-4 if fit.nuisances else True
        miss += [(fit.value[key] - true) / fit.std[key] for key, true in TRUTH.items()]
    plain = identify(logs[0], axebot, OutputError(tick_rad=0.0)).estimate
    assert set(plain.noise) == {f"wheel_speed[{i}]" for i in range(3)}
    assert plain.nuisances["latency.wheel_speed"].value == pytest.approx(0.5 / RATE, abs=2e-4)
    wider = [plain.std[key] / fits[0].std[key] for key in TRUTH]
    assert min(wider) > 2.0
    assert np.mean(wider) > 3.0
    assert all(plain.ci95[key][0] <= true <= plain.ci95[key][1] for key, true in TRUTH.items())
    assert np.sqrt(np.mean(np.square(miss))) < 1.6
    assert np.abs(miss).max() < 4.5


def test_no_misfit_is_found_where_there_is_none(axebot, make):
    """The mean over a row is half a row late; taken as the speed of a moment it was a misfit in every log."""
    for seed in (11, 12):
        lack = identify(make(seed), axebot, OutputError()).lack_of_fit
        assert lack is not None
        assert not lack.found


def test_a_latency_of_the_speeds_is_that_of_the_angles(axebot, log):
    fit = identify(log, axebot, OutputError(nuisances=("latency.wheel_speed",))).estimate
    assert set(fit.nuisances) == {"latency.wheel_angle"}


def test_free_runs_are_compared_half_a_row_earlier(axebot, log):
    fit = identify(log, axebot, OutputError(nuisances=())).estimate
    assert fit.robot.log.latency.of("wheel_speed", 0.0, 1.0 / RATE) == pytest.approx(0.5 / RATE)
    assert fit.robot.log.is_of(log)
    found, anew = validate(fit, [log]).fitted, compare(fit.robot.replace(log=None), log)
    assert found.rmse["w1"] < anew.rmse["w1"]


def test_forces_that_no_model_has_are_errors_with_a_memory(axebot, make):
    """They add up in the angles; counts alone would be far too sure of numbers that they pull aside."""
    rng, volts = np.random.default_rng(7), voltages(np.random.default_rng(31), 20.0, RATE)
    forces = lfilter([0.05 * np.sqrt(1.0 - 0.97**2)], [1.0, -0.97], rng.normal(size=volts.shape), axis=0)
    run = counted(axebot, volts + forces)(1).replace(voltage=np.vstack([volts, volts[-1:]]))
    found = {}
    for tick in (None, 0.0):
        fit = identify(run, axebot, OutputError(nuisances=(), tick_rad=tick)).estimate
        found[tick] = np.sqrt(np.mean([(fit.value[key] / true - 1.0) ** 2 for key, true in TRUTH.items()]))
        if tick is None:
            assert fit.covariance == "autoregressive"
            assert min(fit.noise.values()) > 2.0 * TICK
            assert all(abs(fit.value[key] - true) < 6.0 * fit.std[key] for key, true in TRUTH.items())
    assert found[None] < found[0.0]
