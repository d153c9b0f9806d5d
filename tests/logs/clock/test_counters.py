"""Encoders that start over, against the angle they were made from."""

import numpy as np
import pytest

from omnidyn import read_log
from omnidyn.errors import InputError
from omnidyn.logs.clock.counters import unrolled
from tests.support.codes import said
from tests.support.counted import bench, counts_of, wandering

TURNS = np.cumsum(np.concatenate([np.linspace(0.0, 0.04, 600), np.linspace(0.04, -0.06, 1200)]))


@pytest.mark.parametrize(
    ("unit", "size", "period"),
    [
        ("ticks/2000", 2000.0, 2000.0),
        ("ticks/32768", 32768.0, 2.0**16),
        ("counts/32768", 32768.0, 2.0**32),
        ("rad", 2.0 * np.pi, 2.0 * np.pi),
        ("deg", 360.0, 360.0),
        ("turns", 1.0, 1.0),
    ],
)
@pytest.mark.parametrize("signed", [False, True])
def test_an_encoder_that_starts_over_goes_on(unit, size, period, signed):
    counts = TURNS * size
    offset = period - 0.5 * size - signed * period / 2.0
    seen = np.mod(counts + offset, period)
    seen = np.where(seen >= period / 2.0, seen - period, seen) if signed else seen
    seen[5] = np.nan
    again, found, _ = unrolled(seen, unit, "log.csv")
    assert found == pytest.approx(period)
    np.testing.assert_allclose(np.delete(again - again[0], 5), np.delete(counts - counts[0], 5), atol=1e-4)
    assert np.isnan(again[5])


@pytest.mark.parametrize("counts", [TURNS * 2000.0, np.zeros(50), np.array([3.0]), np.array([]), TURNS * 0.04])
def test_an_encoder_that_goes_on_is_left_alone(counts):
    again, found, _ = unrolled(counts, "ticks/2000", "log.csv")
    assert found is None
    np.testing.assert_array_equal(again, counts)


def test_a_wheel_too_fast_for_its_rows_is_refused():
    seen = np.mod(0.45 * 2.0 * np.pi * np.arange(200) + 0.1, 2.0 * np.pi)
    with pytest.raises(InputError, match=r"log.csv: an angle starts over after 6.28319 and moves too far between rows"):
        unrolled(seen, "rad", "log.csv")


def test_a_wheel_that_is_followed_from_rest_on_may_turn_nearly_half_a_turn_between_rows():
    rate = 0.44 * 360.0 * np.sin(np.linspace(0.0, 3.0 * np.pi, 300))
    angle = np.cumsum(rate)
    found = unrolled(np.mod(angle, 360.0), "deg", "log.csv")[0]
    np.testing.assert_allclose(found - found[0], angle - angle[0], atol=1e-9)
    with pytest.raises(InputError, match="moves too far between rows"):
        unrolled(np.mod(np.cumsum(rate * 1.2), 360.0), "deg", "log.csv")


def test_a_log_says_that_its_counter_starts_over(tmp_path):
    counts = np.mod(np.round(TURNS * 32768.0) + 60_000, 2**16)
    rows = [f"{0.01 * k:.2f},{count:.0f}" for k, count in enumerate(counts)]
    path = tmp_path / "log.csv"
    path.write_text("t_s,enc1_ticks\n" + "\n".join(rows))
    run = read_log(path, assume={"a": "ticks/32768"})
    np.testing.assert_allclose(np.ptp(run.wheel_angle), np.ptp(TURNS) * 2.0 * np.pi, rtol=1e-3)
    assert any(
        "enc1_ticks starts over after 65536 ticks: it is taken to go on" in words for words in said(run.warnings)
    )


@pytest.mark.parametrize(("bits", "kind"), [(16, float), (16, np.float32), (32, float)])
def test_counts_that_a_driver_made_radians_go_on_too(bits, kind):
    """JointState.position of a driver that multiplies the integer of its encoder."""
    tick, half = 2.0 * np.pi / 4096.0, 2.0 ** (bits - 1)
    counts = np.round(TURNS * 4096.0) + half - 5000.0
    seen = (tick * (np.mod(counts + half, 2.0 * half) - half)).astype(kind).astype(float)
    again, found, _ = unrolled(seen, "rad", "log.csv")
    assert found == pytest.approx(tick * 2.0 * half, rel=1e-5)
    np.testing.assert_allclose(again - again[0], (counts - counts[0]) * tick, atol=tick)


def test_an_encoder_that_was_set_to_0_has_not_started_over():
    """It fell by nearly all that two bytes hold, but a wheel that moves by 20 a row does not jump by 3000."""
    counts = np.concatenate([np.arange(0.0, 62_500.0, 20.0), np.arange(0.0, 5000.0, 20.0)])
    again, period, restarts = unrolled(counts, "ticks/2000", "log.csv")
    assert (period, restarts) == (None, (3125,))
    np.testing.assert_array_equal(again, 20.0 * np.arange(len(counts)))


@pytest.fixture(scope="module")
def steady():
    """Counts of a motor that turns by up to 180 a row."""
    t, _, speed = bench()
    return t, counts_of(speed)


@pytest.mark.parametrize("period", [1000.0, 777.0, 1440.0, 3000.0, 4096.0, 10_000.0, 65_536.0])
@pytest.mark.parametrize("signed", [False, True])
def test_any_modulus_is_found(steady, period, signed):
    t, counts = steady
    seen = np.mod(counts + signed * period / 2.0, period) - signed * period / 2.0
    again, found, restarts = unrolled(seen, "ticks/2048", "log.csv", t)
    assert (found, restarts) == (period, ())
    np.testing.assert_array_equal(again - again[0], counts - counts[0])


@pytest.mark.parametrize("value", [0.0, 12_345.0, -500_000.0])
@pytest.mark.parametrize("row", [1900, 2700, 4500])
def test_a_counter_may_begin_again_at_any_value(steady, value, row):
    t, counts = steady
    seen = counts.copy()
    seen[row:] += value - seen[row]
    again, found, restarts = unrolled(seen, "ticks/2048", "log.csv", t)
    assert (found, restarts) == (None, (row,))
    np.testing.assert_allclose(again, counts, atol=10.0)  # what it turned in that row is taken from those beside it


def test_a_counter_that_starts_over_may_begin_again_too(steady):
    t, counts = steady
    seen = counts.copy()
    seen[2700:] -= seen[2700]
    again, found, restarts = unrolled(np.mod(seen, 4096.0), "ticks/2048", "log.csv", t)
    assert (found, restarts) == (4096.0, (2700,))
    np.testing.assert_allclose(again - again[0], counts - counts[0], atol=10.0)


def test_a_counter_whose_end_is_passed_too_fast_is_refused(steady):
    t, counts = steady
    with pytest.raises(InputError, match=r"an angle starts over after 1000 and moves too far between rows"):
        unrolled(np.mod(5.0 * counts, 1000.0), "ticks/2048", "log.csv", t)


def test_sound_logs_are_left_alone():
    """Reversals, slips, rows that are missing, and stamps that jitter."""
    for seed in range(200):
        t, counts = wandering(seed)
        again, period, restarts = unrolled(counts, "ticks/9999", "log.csv", t)
        assert (seed, period, restarts) == (seed, None, ())
        assert again is counts


def test_a_wild_value_is_no_restart(steady):
    t, counts = steady
    seen = counts.copy()
    seen[2000] = 9e6
    assert unrolled(seen, "ticks/2048", "log.csv", t).restarts == ()
