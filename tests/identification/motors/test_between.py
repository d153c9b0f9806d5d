"""What a motor got between the rows of its log, and what looks like a dead band and is a bend of its line."""

import numpy as np
import pytest

from omnidyn.identification.motors.choice import fit_rmse, run_motor
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.input_between_rows import SUB, refined
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run
from tests.support.codes import codes

SLOPE, LAG, FINE = 0.5, 0.02, 50  # V s/rad, s, steps of Euler's method in a row
ROWS, DT = 800, 0.01


def sweep(t):
    """A sine whose frequency grows from 0.5 to 8 Hz, 12 rows a swing at the end [V]."""
    return 2.0 * np.sin(2.0 * np.pi * (0.5 * t + 7.5 / 16.0 * t**2))


def log(seed, band=0.0, drag=lambda w: 0.0 * w, noise=0.02, put_in=sweep):
    """w' = (u - drag(w) - band sgn w - k w)/(k lag) in steps of DT/FINE, every FINE-th kept."""
    fine = DT / FINE * np.arange(ROWS * FINE)
    speed, w, u = np.zeros(len(fine)), 0.0, put_in(fine)
    for n in range(len(fine) - 1):
        drive = u[n] - drag(w) - SLOPE * w
        if w == 0.0 and abs(drive) <= band:
            continue
        side = np.sign(w) or np.sign(drive)
        new = w + DT / FINE / (SLOPE * LAG) * (drive - band * side)
        w = new if new * side > 0.0 else 0.0
        speed[n + 1] = w
    rows = slice(None, None, FINE)
    measured = speed[rows] + noise * np.random.default_rng(seed).standard_normal(ROWS)
    return Run(t=fine[rows], voltage=u[rows, None], wheel_speed=measured[:, None])


def test_a_curve_goes_through_the_rows_and_a_line_where_the_input_jumps():
    t = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.015, 400))
    smooth, step = sweep(0.5 * t), np.where(t < 2.0, 0.0, 1.0)
    fine, u, out = refined(t, smooth, t[:, None], [(0, 399)])
    middle = 0.5 * (fine[1:] + fine[:-1])
    assert np.abs(u[:-1] - sweep(0.5 * middle)).max() < 0.01
    np.testing.assert_array_equal(out[::SUB, 0], t)
    assert np.isnan(out[1::SUB]).all()
    u = refined(t, step, t[:, None], [(0, 399)])[1]
    assert 0.0 <= u.min() <= u.max() <= 1.0
    at = SUB * int(np.flatnonzero(np.diff(step))[0])
    np.testing.assert_allclose(u[at : at + SUB], (np.arange(SUB) + 0.5) / SUB, atol=1e-12)


def test_a_sampled_sine_is_met_down_to_the_noise():
    run = log(1)
    fit = fit_motor(run, dead_band=False)
    assert fit.between == "curve"
    assert fit.value["slope"] == pytest.approx(SLOPE, rel=2e-3)
    assert fit.value["lag"] == pytest.approx(LAG, rel=1e-2)
    assert fit.rmse < 1.05 * 0.02
    assert fit_rmse(fit, log(2)) < 1.05 * 0.02
    assert run_motor(fit, run)[0].shape == run.t.shape


def test_a_bend_of_the_line_is_no_dead_band():
    """A drag that grows and falls again with the speed, as that of a motor in its grease may; no dead band."""
    fit = fit_motor(log(3, drag=lambda w: 0.15 * w * np.exp(-((w / 1.5) ** 2))))
    assert fit.value["dead_band"] > 0.01
    assert not fit.dead_band_seen
    assert "line_bends" in codes(fit.warnings)
    low, high = fit.ci95["slope"]  # known only together with the dead band
    assert low <= SLOPE <= high


@pytest.mark.parametrize("seed", range(4))
def test_a_dead_band_is_seen_where_there_is_one(seed):
    fit = fit_motor(log(seed, band=0.1))
    assert fit.dead_band_seen
    low, high = fit.ci95["dead_band"]
    assert low <= 0.1 <= high


def test_a_start_that_no_row_remembers_is_no_trouble():
    """A latency leaves out the first rows; a motor this fast has forgotten its start by then, down to 1e-170."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-2.0, 2.0, 40), 20)
    speed = np.append(0.0, u[:-1]) / SLOPE + 0.05 * rng.standard_normal(len(u))
    run = Run(t=DT * np.arange(len(u)), voltage=u[:, None], wheel_speed=speed[:, None])
    fit = fit_motor(run, latency=True, between="hold", loss="student-t")
    assert fit.value["slope"] == pytest.approx(SLOPE, rel=1e-2)


def test_rows_between_two_stretches_that_are_too_fast_are_not_believed():
    """A sweep that passes the rate of the rows, 178 Hz, looks slow there."""
    t = np.cumsum(0.0056 + 0.0004 * np.random.default_rng(0).uniform(-1.0, 1.0, 1000))
    rate = np.exp(1.382 * t)
    rough = unresolved_rows(np.sin(2.0 * np.pi * rate / 1.382))
    assert not rough[rate < 10.0].any()
    assert rough[(rate > 30.0) & (rate < 500.0)].all()
