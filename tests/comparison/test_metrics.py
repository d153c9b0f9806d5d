"""Metrics against closed forms and against sums written out."""

import math

import numpy as np
import pytest

from omnidyn.comparison.errors_from_start import errors_for_whiteness, settled
from omnidyn.comparison.metrics import metrics
from omnidyn.comparison.traces import Trace, compared_components, trace_of, unit, unwrapped
from omnidyn.run import Run

N = 1000
T = np.arange(N) * 0.01
TURNS = np.sin(2.0 * np.pi * np.arange(N) / 100.0)  # ten whole turns: mean 0, mean square 1/2


def trace(measured, model, t=T):
    return Trace(t, np.asarray(measured, dtype=float), np.asarray(model, dtype=float))


def test_an_offset():
    """Model c above a sine of size 1: rmse = max = bias = c, fit = 100 (1 - c sqrt 2), VAF = 100."""
    found = metrics([trace(TURNS, TURNS + 0.1)])
    assert (found.samples, found.rmse, found.max) == (N, pytest.approx(0.1), pytest.approx(0.1))
    assert found.bias == pytest.approx(0.1)
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - 0.1 * math.sqrt(2.0)))
    assert found.vaf == pytest.approx(100.0)
    assert metrics([trace(TURNS, TURNS - 0.1)]).bias == pytest.approx(-0.1)


@pytest.mark.parametrize("gain", [0.0, 0.7, 1.0, 1.5, -1.0])
def test_a_gain(gain):
    """Model g times a sine: rmse = |1 - g|/sqrt 2, fit = 100 (1 - |1 - g|), VAF = 100 (1 - (1 - g)^2)."""
    found = metrics([trace(TURNS, gain * TURNS)])
    assert found.rmse == pytest.approx(abs(1.0 - gain) / math.sqrt(2.0))
    assert found.max == pytest.approx(abs(1.0 - gain))
    assert found.bias == pytest.approx(0.0, abs=1e-15)
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - abs(1.0 - gain)))
    assert found.vaf == pytest.approx(100.0 * (1.0 - (1.0 - gain) ** 2))


def test_several_pieces_are_one_sum():
    """Two pieces of other length and level, written out; a row that lacks either value does not count."""
    measured, model = [1.0, 2.0, 4.0, math.nan, 10.0, 12.0], [1.5, 1.0, math.nan, 3.0, 13.0, 12.0]
    cut = [trace(measured[:3], model[:3], T[:3]), trace(measured[3:], model[3:], T[3:6])]
    found = metrics(cut)
    errors = [0.5, -1.0, 3.0, 0.0]
    assert found.samples == 4
    assert found.rmse == pytest.approx(math.sqrt(sum(e * e for e in errors) / 4.0))
    assert found.max == 3.0
    assert found.bias == pytest.approx(sum(errors) / 4.0)
    mean = (1.0 + 2.0 + 10.0 + 12.0) / 4.0
    spread = math.sqrt(sum((y - mean) ** 2 for y in (1.0, 2.0, 10.0, 12.0)))
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - math.sqrt(sum(e * e for e in errors)) / spread))
    even = sum((e - sum(errors) / 4.0) ** 2 for e in errors) / spread**2
    assert found.vaf == pytest.approx(100.0 * (1.0 - even))
    assert found.whiteness is None


def test_how_far_apart_the_pieces_of_a_path_lie_is_no_merit():
    """Two pieces at 0 and at 100, each a sine that the model has half of: 50 and 75 %, wherever they lie."""
    cut = [trace(level + TURNS, level + 0.5 * TURNS) for level in (0.0, 100.0)]
    assert metrics(cut).fit_percent > 99.0
    found = metrics(cut, start_known=True)
    assert found.fit_percent == pytest.approx(50.0)
    assert found.vaf == pytest.approx(75.0)
    assert found.rmse == metrics(cut).rmse


@pytest.mark.parametrize("level", [0.0, 3.0, -1e6])
def test_a_signal_that_never_changes_has_no_fit(level):
    found = metrics([trace(np.full(N, level), level + TURNS)])
    assert (found.fit_percent, found.vaf, found.lag) == (None, None, None)
    assert found.rmse == pytest.approx(math.sqrt(0.5))
    rounding = np.where(np.arange(N) % 2, level, np.nextafter(level, 1.0))
    assert metrics([trace(rounding, level + TURNS)]).fit_percent is None


def test_nothing_in_common_is_no_metrics():
    nothing = np.full(N, np.nan)
    assert metrics([]) is None
    assert metrics([trace(nothing, TURNS)]) is None


def run_of(**channels):
    return Run(t=np.arange(4.0), **channels)


def test_a_heading_is_compared_without_its_turns():
    """Measured wrapped at a turn, or counted from another turn: the error is the small one; a drift keeps growing."""
    model = np.linspace(0.0, 40.0, N)
    for real in (np.mod(model, 2.0 * np.pi), model - 4.0 * np.pi, np.angle(np.exp(1j * model))):
        np.testing.assert_allclose(model - unwrapped(real + 0.01, model), -0.01, atol=1e-12)
    drift = np.linspace(0.0, 9.0, N)
    np.testing.assert_allclose(unwrapped(np.mod(model + drift, 2.0 * np.pi), model), model + drift, atol=1e-12)
    holes = np.where(np.arange(N) % 7 == 3, np.nan, np.mod(model, 2.0 * np.pi))
    kept = unwrapped(holes, model)
    np.testing.assert_array_equal(np.isnan(kept), np.isnan(holes))
    np.testing.assert_allclose(kept[np.isfinite(kept)], model[np.isfinite(kept)], atol=1e-12)


def test_a_fast_turn_between_rows_is_no_trap():
    """3 rad a row and half of the rows missing: what is unwrapped is the error, not the heading."""
    model = 3.0 * np.arange(50.0)
    real = np.mod(model, 2.0 * np.pi)
    real[1::2] = np.nan
    np.testing.assert_allclose(unwrapped(real, model)[::2], model[::2], atol=1e-9)


def test_unsigned_currents_are_compared_by_size():
    real = run_of(current=[[1.0, 2.0, 3.0]] * 4)
    ours = run_of(current=[[-1.0, 2.5, -3.0]] * 4)
    assert trace_of("i1", real, ours, slice(0, 4)).error[0] == -2.0
    sized = [trace_of(name, real, ours, slice(0, 4), current_unsigned=True).error[0] for name in ("i1", "i2", "i3")]
    assert sized == [0.0, 0.5, 0.0]


def test_which_components_are_compared():
    run = run_of(
        twist=np.ones((4, 3)),
        voltage=np.ones((4, 3)),
        wheel_speed=np.array([[1.0, np.nan, 1.0]] * 4),
        supply=np.ones(4),
    )
    assert compared_components(run, "voltage") == ("vx", "vy", "omega", "w1", "w3")
    assert compared_components(run, "wheel_speed_command")[-3:] == ("u1", "u2", "u3")
    assert [unit(name) for name in ("vx", "omega", "w2", "i1", "x", "heading", "u1")] == [
        "m/s",
        "rad/s",
        "rad/s",
        "A",
        "m",
        "rad",
        "V",
    ]


def test_what_the_start_is_off_by_is_not_tested_for_whiteness():
    """A pose shifted and turned a little as a whole has no error left; the first 0.6 s are left out of speeds."""
    angle = np.linspace(0.0, 3.0, N)
    x, y, turn = np.cos(angle), np.sin(2.0 * angle), 1e-6
    pose = {
        "x": [trace(x + 0.3 - turn * y, x)],
        "y": [trace(y - 0.2 + turn * x, y)],
        "heading": [trace(angle + turn, angle)],
    }
    for name in pose:
        assert np.abs(errors_for_whiteness(name, pose)[0]).max() < 1e-11
    ramp = {"vx": [trace(0.0 * T, T)]}
    np.testing.assert_array_equal(errors_for_whiteness("vx", ramp)[0], T[60:])
    assert len(settled(trace(TURNS[:100], TURNS[:100], T[:100])).t) == 75  # never more than a quarter
    bent = {"x": [trace(x, x + 0.1 * angle**2)], "y": [trace(y, y)]}
    assert np.abs(errors_for_whiteness("x", bent)[0]).max() > 0.01
