"""The likelihood of counts against 50 digits, and against what it is the limit of."""

import mpmath
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_ndtr
from scipy.stats import truncnorm

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.kernel.counts import count_terms, information, rounding, tail
from omnidyn.model.deadzone import push_per_volt
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot import Prior
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import voltages
from tests.support.codes import codes
from tests.support.march_cases import truth

mpmath.mp.dps = 50
WIDE = np.exp(np.linspace(np.log(1e-9), np.log(30.0), 12))
AWAY = np.concatenate([[0.0, 1e-9, 1e-3], np.exp(np.linspace(np.log(0.05), np.log(35.0), 11))])


def reference(z, h):
    """(E x, E x^2, var x, rho) of a normal number cut to [z - h, z + h]."""
    z, h = mpmath.mpf(z), mpmath.mpf(h)
    low, high = z - h, z + h
    share = (mpmath.erfc(low / mpmath.sqrt(2)) - mpmath.erfc(high / mpmath.sqrt(2))) / 2
    if low < 0:
        share = (mpmath.erf(high / mpmath.sqrt(2)) - mpmath.erf(low / mpmath.sqrt(2))) / 2
    mean = (mpmath.npdf(low) - mpmath.npdf(high)) / share
    square = 1 + (low * mpmath.npdf(low) - high * mpmath.npdf(high)) / share
    return mean, square, square - mean**2, -mpmath.log(share / (2 * h)) - mpmath.log(2 * mpmath.pi) / 2


def test_terms_of_a_count_against_50_digits():
    for h in WIDE:
        for z in AWAY:
            with mpmath.workdps(90 + int(z * z)):
                expected = [float(value) for value in reference(float(z), float(h))]
            for side in (1.0, -1.0):
                mean, square, spread, rho = count_terms(side * z, h)
                assert mean == pytest.approx(side * expected[0], rel=1e-11, abs=1e-14), (z, h)
                assert square == pytest.approx(expected[1], rel=1e-11), (z, h)
                assert spread == pytest.approx(expected[2], rel=1e-6, abs=3e-13 * (1.0 + z * z)), (z, h)
                assert rho == pytest.approx(expected[3], rel=1e-12, abs=1e-12), (z, h)


@pytest.mark.parametrize("u", [-5.0, -1.0, 0.0, 3.0, 4.999, 5.0, 20.0, 1e3, 1e8])
def test_tail(u):
    with mpmath.workdps(60):
        exact = mpmath.erfc(mpmath.mpf(u) / mpmath.sqrt(2)) / 2 * mpmath.exp(mpmath.mpf(u) ** 2 / 2)
    assert tail(u) == pytest.approx(float(exact), rel=1e-13)


def test_a_row_a_thousand_ticks_away_is_finite_and_pulls():
    for h in (1e-6, 0.1, 5.0):
        mean, square, spread, rho = count_terms(1e5, h)
        assert np.isfinite([mean, square, spread, rho]).all()
        assert 1e5 - h <= mean <= 1e5
        assert 0.0 <= spread <= 1.0


def test_information_of_a_row_against_draws_and_its_limits():
    """Fine ticks: 1 and 2, less Sheppard's share; coarse ones: the variance of the score over many draws."""
    fine, none = information(np.ones(2), np.array([1e-3, 0.0])).T
    assert fine == pytest.approx([1.0, 2.0], rel=1e-6)
    assert none.tolist() == [1.0, 2.0]
    moderate = information(np.ones(1), np.array([0.5]))[:, 0]
    assert moderate[0] == pytest.approx(1.0 / (1.0 + 0.25 / 12.0), rel=1e-3)
    rng, h = np.random.default_rng(1), 2.5
    phase = rng.uniform(-h, h, 40_000)
    y = 2.0 * h * np.round((phase + rng.normal(size=phase.size)) / (2.0 * h))
    terms = np.array([count_terms(z, h)[:2] for z in y - phase])
    angle, scale = information(np.ones(1), np.array([2.0 * h]))[:, 0]
    assert np.mean(terms[:, 0] ** 2) == pytest.approx(angle, rel=0.03)
    assert np.mean((terms[:, 1] - 1.0) ** 2) == pytest.approx(scale, rel=0.06)
    assert abs(np.mean(terms[:, 0])) < 4.0 * np.sqrt(angle / phase.size)


def test_the_pull_of_a_row_without_noise_is_the_sum_of_its_harmonics():
    half, steps = 5.0, 20_000
    turn = (np.arange(steps) + 0.5) / steps - 0.5
    low, high = (2.0 * half * turn + side * half for side in (-1.0, 1.0))
    mean, spread = truncnorm.mean(low, high), truncnorm.var(low, high)
    series, square, curvature = rounding(half, 40, 4096)
    for m in (1, 2, 7, 40):
        assert series[m - 1] == pytest.approx(2.0 * np.mean(mean * np.sin(2.0 * np.pi * m * turn)), abs=1e-4)
    assert square == pytest.approx(np.mean(mean**2), rel=1e-4)
    assert curvature == pytest.approx(1.0 - np.mean(spread), rel=1e-4)


def test_without_noise_the_spread_of_the_draws_is_what_a_fit_says(axebot, rolled, draws):
    """Rows at rest repeat one another: a sandwich over blocks shorter than a rest says 1.3 times too little."""
    run, angle = rolled
    z = []
    for seed in range(draws(40)):
        counted = ticks_of(angle, 2.0 * np.pi / 512, np.random.default_rng(seed), 0.0)
        log = Run(t=run.t, voltage=run.voltage, wheel_angle=counted)
        fit = identify(log, axebot, OutputError(nuisances=(), start="rest")).estimate
        z.append([(v - float(Key.parse(key).get(axebot))) / fit.std[key] for key, v in fit.value.items()])
    sizes = np.sqrt(np.mean(np.square(z), axis=0))  # 1, +- 0.11 by 40 draws
    assert sizes.max() < 1.33
    assert sizes.min() > 0.67
    assert 0.85 < np.sqrt(np.mean(sizes**2)) < 1.15


def test_the_spread_of_a_product_is_what_a_fit_says_though_its_factors_are_guesses(axebot, rolled, draws):
    """Torque constant and gear are known to 15 %, what they push together to 0.1 %: all but nothing of their std.

    With the std of each factor raised to what rounding alone makes of it, that of the product was 1.4 times too small.
    """
    run, angle = rolled
    factors = ("motor.torque_constant_Nm_A", "motor.gear_ratio", "motor.resistance_ohm")
    guess = {key: Prior(std=0.15 * float(Key.parse(key).get(axebot)), origin="guess") for key in factors}
    z = []
    for seed in range(draws(40)):
        counted = ticks_of(angle, 2.0 * np.pi / 512, np.random.default_rng(seed), 0.0)
        log = Run(t=run.t, voltage=run.voltage, wheel_angle=counted)
        fit = identify(
            log, axebot.replace(priors=guess), OutputError(free=(*BOX, *factors), nuisances=(), start="rest")
        ).estimate
        true = push_per_volt(axebot)
        pushes = {f"push.{axis}": value for axis, value in zip(["x", "y", "yaw"], true, strict=True)}
        z.append([(one.value - pushes[one.name]) / one.std for one in fit.combinations if one.name in pushes])
    sizes = np.sqrt(np.mean(np.square(z), axis=0))  # 1, +- 0.11 by 40 draws
    assert len(sizes) == 3
    assert (sizes < 1.33).all()
    assert (sizes > 0.67).all()


def test_groups_of_counts_without_noise_say_what_each_says_alone(axebot, rolled):
    run, angle = rolled
    logs = [
        Run(t=run.t, voltage=run.voltage, wheel_angle=ticks_of(angle, 2.0 * np.pi / 512, np.random.default_rng(s), 0.0))
        for s in (1, 2)
    ]
    both = identify(logs, axebot, OutputError(nuisances=(), start="rest"), groups=["a", "b"])
    for name, log in zip(("a", "b"), logs, strict=True):
        alone = identify(log, axebot, OutputError(nuisances=(), start="rest")).estimate
        for key, std in alone.std.items():
            assert both.groups[name].std[key] == pytest.approx(std, rel=0.05)


def ticks_of(angle, tick, rng, jitter):
    """What an encoder shows: the angle with a little noise, rounded down to a tick, from wherever it begins."""
    return np.floor((angle + jitter * tick * rng.normal(size=angle.shape) + rng.uniform(0, tick, 3)) / tick) * tick


@pytest.fixture(scope="module")
def rolled(axebot):
    """(run of 20 s, angles of its wheels): the exact engine, and its twist integrated by simulate itself."""
    voltage = voltages(np.random.default_rng(3), 20.0)
    run = simulate(axebot, voltage, 0.01)
    return run, truth(axebot, voltage, np.full(len(voltage), 0.01), np.zeros(3), 0.0)[:, 3:]


def test_a_log_of_ticks_alone_against_another_optimiser(axebot, rolled):
    """scipy's BFGS on -log P from scipy's normal distribution, over whole runs of simulate."""
    run, angle = rolled[0], rolled[1]
    rows = slice(0, 301)
    voltage, tick = run.voltage[:300], 2.0 * np.pi / 256
    counted = ticks_of(angle[rows], tick, np.random.default_rng(1), 0.3)
    log = Run(t=run.t[rows], voltage=run.voltage[rows], wheel_angle=counted)
    free = ["friction.axes.viscous[0]", "friction.axes.coulomb[0]"]
    fit = identify(log, axebot, OutputError(free=free, nuisances=(), start="rest")).estimate

    own, std = np.array([fit.value[key] for key in free]), np.array([fit.std[key] for key in free])

    def model(values):
        moved = axebot
        for key, value in zip(free, values, strict=True):
            moved = Key.parse(key).set(moved, float(value))
        return truth(moved, voltage, np.full(300, 0.01), np.zeros(3), 0.0)[:, 3:]

    def cost(x):
        """x: friction in standard errors from ours, initial angles in ticks, log of the noise in ticks."""
        off, deviation = counted - model(own + x[:2] * std) - x[2:5] * tick, np.exp(x[5:8]) * tick
        low, high = (np.abs(off) - 0.5 * tick) / deviation, (np.abs(off) + 0.5 * tick) / deviation
        return -(log_ndtr(-low) + np.log1p(-np.exp(log_ndtr(-high) - log_ndtr(-low)))).sum()

    middle = (counted - model(own)).mean(axis=0) / tick
    found = minimize(cost, np.concatenate([[0.5, -0.5], middle, np.full(3, -1.0)]), method="BFGS")
    assert np.abs(found.x[:2]).max() < 0.01
    noise = [fit.noise[f"wheel_angle[{i}]"] / tick for i in range(3)]
    np.testing.assert_allclose(noise, np.exp(found.x[5:8]), rtol=0.005)


def test_fine_ticks_give_the_gaussian_answer(axebot, rolled):
    run, angle = rolled
    noise = 0.02 * np.random.default_rng(5).normal(size=angle.shape)
    tick = 2e-4
    log = Run(t=run.t, voltage=run.voltage, wheel_angle=np.round((angle + noise) / tick) * tick)
    counts, plain = (identify(log, axebot, OutputError(nuisances=(), tick_rad=q)).estimate for q in (tick, 0.0))
    for key, std in plain.std.items():
        assert counts.value[key] == pytest.approx(plain.value[key], abs=1e-2 * std)
        assert counts.std[key] == pytest.approx(std, rel=0.25)  # a sandwich of 100 blocks
    assert counts.noise["wheel_angle[1]"] == pytest.approx(plain.noise["wheel_angle[1]"], rel=1e-3)


def test_ticks_are_found_and_hold_the_truth(axebot, rolled):
    run, angle = rolled
    tick = 2.0 * np.pi / 512
    log = Run(t=run.t, voltage=run.voltage, wheel_angle=ticks_of(angle, tick, np.random.default_rng(7), 0.3))
    fit = identify(log, axebot, OutputError(nuisances=())).estimate
    for key, value in fit.value.items():
        assert abs(value - float(Key.parse(key).get(axebot))) <= 4.5 * fit.std[key]
    assert list(fit.noise) == [f"wheel_angle[{i}]" for i in range(3)]
    assert list(fit.noise.values()) == pytest.approx([0.3 * tick] * 3, rel=0.1)
    assert fit.robot.log.encoder_counts == pytest.approx(512)
    assert fit.robot.sensor_model.encoder_counts == pytest.approx(512)


def test_wheel_speeds_that_are_differences_of_the_angles_are_left_out(axebot, rolled):
    run, angle = rolled
    tick = 2.0 * np.pi / 512
    counted = ticks_of(angle, tick, np.random.default_rng(8), 0.3)
    speed = np.vstack([np.zeros(3), np.diff(counted, axis=0) / 0.01])
    both = Run(t=run.t, voltage=run.voltage, wheel_angle=counted, wheel_speed=speed)
    fit = identify(both, axebot, OutputError(nuisances=())).estimate
    assert list(fit.noise) == [f"wheel_angle[{i}]" for i in range(3)]
    assert "nothing_new" in codes(fit.warnings)
    tacho = run.wheel_speed + 0.2 * np.random.default_rng(9).normal(size=angle.shape)
    fit = identify(both.replace(wheel_speed=tacho), axebot, OutputError(nuisances=())).estimate
    assert len(fit.noise) == 6
