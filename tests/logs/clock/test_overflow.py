"""Speeds that leave 16 bits, against those they were made from."""

import numpy as np
import pytest

from omnidyn import check
from omnidyn.logs.clock.widened import widened
from omnidyn.logs.read_log import LogOptions, recorded_log
from tests.support.cases import case
from tests.support.counted import bench, wandering, write_columns


@pytest.fixture(scope="module")
def speeds():
    t, volts, speed = bench(slope=0.02)
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(t))
    return t, volts, np.round((speed + noise) * 150.0)


def wrapped(values):
    return np.mod(values + 2**15, 2**16) - 2**15


@pytest.mark.parametrize("scale", [1.0, 0.0066666667])
@pytest.mark.parametrize("first", [0, 400])
def test_speeds_beyond_16_bits_are_put_right(speeds, scale, first):
    t, _, true = (each[first:] for each in speeds)
    assert np.abs(true).max() > 40_000
    right, jumps, followed = widened(scale * wrapped(true), t)
    assert followed
    assert jumps == int((np.abs(np.diff(wrapped(true))) > 2**15).sum())
    np.testing.assert_allclose(right, scale * true, atol=1e-6)


@pytest.mark.parametrize("size", [20.0, 100.0, 150.0])
@pytest.mark.parametrize("first", [0, 400])
def test_speeds_sent_without_a_sign_get_it_back(speeds, size, first):
    t, _, true = (each[first:] for each in speeds)
    true = np.round(true / 150.0 * size)
    right, jumps, followed = widened(np.mod(true, 2**16), t)
    assert followed
    assert jumps > 0
    np.testing.assert_array_equal(right, true)


def test_a_speed_that_changes_too_fast_to_be_followed_is_named(tmp_path, speeds):
    t, volts, true = speeds
    path = write_columns(tmp_path / "log.csv", "t_s,voltage_V,speed_ticks_s", t, volts, wrapped(true))
    column = ("w1=speed_ticks_s:0.0066666667 rad/s",)
    (finding,) = check(recorded_log(path, options=LogOptions(overrides=column))).of("speed_overflow")
    assert finding.severity == "warning"
    assert "leaves its 16 bits" in str(finding)
    true = true.copy()
    true[3000:3100:2] -= 40_000  # kicks of which nobody can tell whether they go over the end
    path = write_columns(tmp_path / "fast.csv", "t_s,voltage_V,speed_ticks_s", t, volts, wrapped(true))
    log = recorded_log(path, options=LogOptions(overrides=column))
    found = check(log).of("speed_overflow")
    assert not found or found[0].severity == "error"


def test_full_speeds_that_reverse_are_left_alone():
    for seed in range(100):
        t, counts = wandering(seed, 400)
        speed = np.gradient(counts)
        raw = np.round(speed / max(np.abs(speed).max(), 1.0) * 32_000.0)
        right, jumps, _ = widened(raw, t)
        assert (seed, jumps) == (seed, 0)
        assert right is raw
        raw = np.abs(2.0 * raw)  # a controller that logs sizes
        assert widened(raw, t)[0] is raw


def test_the_case_of_a_hub_motor():
    path = case("logs/speed_overflow/wrap16.csv")
    log = recorded_log(path, options=LogOptions(overrides=("w1=velocity_ticks_s:0.0066666667 rad/s",)))
    assert float(np.nanmax(log.channels["wheel_speed"])) == pytest.approx((6.0 - 0.35) / 0.02, rel=0.02)
    assert check(log).of("speed_overflow")[0].severity == "warning"
