"""Intervals under colour, at bounds, from profiles and bootstrap; directions that the data do not show."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.trust.uncertainty import _at_least
from omnidyn.model.keys import BOX, Key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, TRUTH, excitation, noisy, voltages
from tests.support.codes import codes

KT = "motor.torque_constant_Nm_A"


@pytest.fixture(scope="module")
def clean(axebot):
    return simulate(axebot, voltages(np.random.default_rng(11)), 0.01)


def coloured(run, seed, memory=0.9):
    """Noise of the same size with a correlation of 0.9 from sample to sample: its slow part is 4.4 times as large."""
    rng = np.random.default_rng(seed)
    noise = np.zeros(run.twist.shape)
    fresh = rng.normal(size=noise.shape) * NOISE * np.sqrt(1.0 - memory**2)
    for k in range(1, len(noise)):
        noise[k] = memory * noise[k - 1] + fresh[k]
    return Run(t=run.t, voltage=run.voltage, twist=run.twist + noise)


def test_coloured_noise_is_seen_and_the_intervals_follow(axebot, clean):
    """6 logs, 36 intervals: with white intervals fewer than 85 % would hold the truth; those that know of it do."""
    held = {"auto": 0, "white": 0}
    for seed in range(6):
        log = coloured(clean, seed)
        for kind in held:
            fit = identify(log, axebot, OutputError(nuisances=(), start="rest", covariance=kind)).estimate
            held[kind] += sum(fit.ci95[key][0] <= true <= fit.ci95[key][1] for key, true in TRUTH.items())
        assert fit.covariance == kind or (kind, fit.covariance) == ("auto", "autoregressive")
    assert (
        identify(log, axebot, OutputError(nuisances=(), start="rest", covariance="sandwich")).covariance == "sandwich"
    )
    assert held["white"] < 0.85 * 36
    assert held["auto"] >= 0.90 * 36


def test_no_friction_stands_at_the_bound_with_an_interval_that_holds_it(axebot, clean):
    none = axebot
    for key in BOX:
        none = Key.parse(key).set(none, 0.0)
    fit = identify(
        noisy(simulate(none, clean.voltage[:-1], 0.01), 5), axebot, OutputError(nuisances=(), start="rest")
    ).estimate
    assert all(fit.ci95[key][0] <= 0.0 <= fit.ci95[key][1] for key in BOX)
    assert fit.at_bound
    for key in fit.at_bound:
        assert fit.value[key] == 0.0
        assert ("bound", key) in {(each.code, each.subject) for each in fit.warnings}


def test_what_only_the_product_shows_is_named(axebot, clean):
    """Torque constant times gear ratio is all that voltage and speed see of the two; from 1.5x wrong constants."""
    start = Key.parse("motor.emf_constant_Vs_rad").set(Key.parse(KT).set(axebot, 1.5 * 0.0059), 1.5 * 0.0059)
    fit = identify(
        noisy(clean, 1), start, OutputError(nuisances=(), free=[*BOX, KT, "motor.gear_ratio"], start="rest")
    ).estimate
    assert set(fit.unidentifiable) == {KT, "motor.gear_ratio"}
    assert fit.value[KT] * fit.value["motor.gear_ratio"] == pytest.approx(0.0059 * 19.0, rel=0.01)
    (lost,) = fit.directions
    assert lost.exact
    assert set(lost.changes) == {KT, "motor.gear_ratio"}
    assert lost.changes[KT] == pytest.approx(-lost.changes["motor.gear_ratio"], rel=1e-3)
    assert abs(lost.changes[KT]) == pytest.approx(0.01, rel=1e-3)
    assert "friction" not in str(fit.blind[0])
    assert np.isfinite([fit.std[key] for key in BOX]).all()


def test_physical_numbers_with_currents(axebot, clean):
    """Mass, inertia, resistance and torque constant are identifiable once currents are measured."""
    rng, keys = np.random.default_rng(2), ("body.mass_kg", "body.inertia_kg_m2", "motor.resistance_ohm", KT)
    log = noisy(clean, 2).replace(current=clean.current + 0.05 * rng.normal(size=clean.current.shape))
    start = axebot
    for key, wrong in zip((*keys, "motor.emf_constant_Vs_rad"), (2.5, 0.015, 2.6, 0.009, 0.009), strict=True):
        start = Key.parse(key).set(start, wrong)
    fit = identify(log, start, OutputError(nuisances=(), free=[*BOX, *keys], start="rest")).estimate
    for key, true in zip(keys, (1.5, 0.025, 1.69, 0.0059), strict=True):
        assert abs(fit.value[key] - true) < 4.0 * fit.std[key]
        assert fit.std[key] < 0.005 * true
    assert fit.robot.motor.emf_constant == pytest.approx(fit.robot.motor.torque_constant)


def test_the_profile_agrees_where_the_likelihood_is_quadratic(axebot, clean):
    key = BOX[0]
    log = noisy(clean, 3)
    plain = identify(log, axebot, OutputError(nuisances=(), start="rest")).estimate
    profiled = identify(log, axebot, OutputError(nuisances=(), start="rest", profile=[key])).estimate
    np.testing.assert_allclose(profiled.ci95[key], plain.ci95[key], atol=0.15 * plain.std[key])
    with pytest.raises(InputError, match=r"not a free number; got body\.mass_kg"):
        identify(log, axebot, OutputError(nuisances=(), profile=["body.mass_kg"]))


@pytest.mark.parametrize("loss", ["gaussian", "student-t"])
def test_a_profile_knows_of_colour(axebot, clean, loss):
    """Autocorrelated errors make the likelihood too steep; it is all but a parabola, so both ways say the same."""
    keys, how = [BOX[0], BOX[4]], {"start": "rest", "loss": loss}
    log = coloured(clean, 3)
    plain = identify(log, axebot, OutputError(nuisances=(), **how)).estimate
    profiled = identify(log, axebot, OutputError(nuisances=(), profile=keys, **how)).estimate
    white = identify(log, axebot, OutputError(nuisances=(), covariance="white", **how)).estimate
    for key in keys:
        assert plain.std[key] > 2.0 * white.std[key]
        assert np.ptp(profiled.ci95[key]) == pytest.approx(np.ptp(plain.ci95[key]), rel=0.15)


def test_breakaway_knows_of_colour(axebot):
    """All 9 intervals hold the truth; by the limit for white noise 19 of 30 did."""
    levels = tuple(1.2 * c for c in axebot.friction.axes.coulomb)
    axes = axebot.friction.axes.model_copy(update={"breakaway": levels})
    robot = axebot.replace(friction=axebot.friction.model_copy(update={"axes": axes}))
    keys, held = [f"friction.axes.breakaway[{axis}]" for axis in range(3)], 0
    for seed in range(3):
        log = coloured(simulate(robot, excitation(30.0, seed=200 + seed), 0.01), seed)
        fit = identify(log, axebot, OutputError(nuisances=(), free=[*BOX, *keys], start="rest")).estimate
        held += sum(fit.ci95[key][0] <= level <= fit.ci95[key][1] for key, level in zip(keys, levels, strict=True))
    assert held == 9


def test_bootstrap_over_runs(axebot):
    rng = np.random.default_rng(4)
    runs = [noisy(simulate(axebot, voltages(rng, 10.0), 0.01), k) for k in range(12)]
    plain = identify(runs, axebot, OutputError(nuisances=(), start="rest")).estimate
    drawn, again = (
        identify(runs, axebot, OutputError(nuisances=(), start="rest", bootstrap=60)).estimate for _ in range(2)
    )
    assert drawn.std == again.std
    ratio = np.array([drawn.std[key] / plain.std[key] for key in BOX])
    assert (ratio > 0.5).all()
    assert (ratio < 2.0).all()
    with pytest.raises(InsufficientDataError, match="too few runs for a bootstrap; got 1; expected 5"):
        identify(runs[0], axebot, OutputError(nuisances=(), bootstrap=10))


def test_what_differs_from_run_to_run_is_in_the_intervals(axebot, draws):
    """25 short runs, Coulomb friction of each 15 % off at random; the truth is their expected value.

    40 draws: errors in standard errors scatter by 1, within three counting errors of 40; by white noise they
    scatter by nearly 2.
    """
    rng, key = np.random.default_rng(5), "friction.axes.coulomb[0]"
    base = voltages(np.random.default_rng(3))[:100]
    errors = {"auto": [], "white": []}
    for _ in range(draws(40)):
        runs = []
        for level in TRUTH[key] * (1.0 + 0.15 * rng.normal(size=25)):
            run = simulate(Key.parse(key).set(axebot, float(level)), base, 0.01)
            runs.append(Run(t=run.t, voltage=run.voltage, twist=run.twist + rng.normal(size=run.twist.shape) * NOISE))
        for kind, found in errors.items():
            fit = identify(runs, axebot, OutputError(nuisances=(), start="rest", covariance=kind)).estimate
            found.append((fit.value[key] - TRUTH[key]) / fit.std[key])
    fit = identify(runs, axebot, OutputError(nuisances=(), start="rest")).estimate
    assert fit.covariance == "sandwich"
    assert 25 in [each.numbers.get("runs") for each in fit.warnings]
    assert abs(np.std(errors["auto"]) - 1.0) < 3.0 / np.sqrt(2.0 * 40)
    assert np.std(errors["white"]) > 1.6


def test_a_number_with_a_small_share_of_a_lost_direction_is_lost_too(axebot, clean):
    """Twist tells of K/R, and of K^2/R only with viscous friction: 1 % of K and R is worth 5 % of it or more."""
    start = axebot
    for key in (KT, "motor.emf_constant_Vs_rad"):
        start = Key.parse(key).set(start, 0.95 * 0.0059)
    resistance = "motor.resistance_ohm"
    fit = identify(
        noisy(clean, 1), start, OutputError(nuisances=(), free=[*BOX, KT, resistance], start="rest")
    ).estimate
    lost = {KT, resistance, *BOX[:3]}
    assert set(fit.unidentifiable) == lost
    assert all(np.isinf(fit.std[key]) for key in lost)
    (direction,) = fit.directions
    assert set(direction.changes) == lost
    known = identify(noisy(clean, 1), axebot, OutputError(nuisances=(), start="rest")).estimate
    for key in BOX[3:]:  # as well known as where the other numbers are: no better
        assert fit.value[key] == pytest.approx(known.value[key], abs=0.2 * known.std[key])
        assert 0.95 * known.std[key] < fit.std[key] < 2.0 * known.std[key]
    for key in lost:  # together they are right, so the robot has all of them
        assert Key.parse(key).get(fit.robot) == fit.value[key]


def test_what_lies_on_the_other_side_of_a_bound_is_lost_too(axebot, clean):
    """With the torque constant too large, viscous friction stops at 0; that does not tell the constant."""
    start = axebot
    for key in (KT, "motor.emf_constant_Vs_rad"):
        start = Key.parse(key).set(start, 1.3 * 0.0059)
    fit = identify(
        noisy(clean, 1), start, OutputError(nuisances=(), free=[*BOX, KT, "motor.resistance_ohm"], start="rest")
    ).estimate
    assert {KT, "motor.resistance_ohm"} <= set(fit.unidentifiable)


def test_a_model_that_does_not_follow_the_log_is_said(axebot, clean):
    log = noisy(clean, 1)
    assert "not_followed" not in codes(identify(log, axebot, OutputError(nuisances=(), start="rest")).warnings)
    wrong = Run(t=log.t, voltage=log.voltage, twist=log.twist * [1.0, -1.0, 1.0])
    fit = identify(wrong, axebot, OutputError(nuisances=(), start="rest")).estimate
    assert [each.numbers["outputs"] for each in fit.warnings if each.code == "not_followed"] == [("twist[1]",)]
    for key in fit.unidentifiable:
        assert fit.value[key] == TRUTH[key]  # as the robot had it
    backward = Run(t=log.t, voltage=-log.voltage, twist=log.twist)
    with pytest.raises(InsufficientDataError, match=r"the robot moved, but with no value .* check signs, units"):
        identify(backward, axebot, OutputError(nuisances=(), start="rest"))


def test_errors_that_remember_ask_for_no_nuisance(axebot, clean):
    """The scatter of white noise is too small a measure: five of its standard errors are one or two of theirs."""
    fit = identify(coloured(clean, 0), axebot, OutputError(start="rest")).estimate
    assert not any(remedy.confident for remedy in fit.lack_of_fit.remedies)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_least_covariance_of_one_direction_alone_is_no_crash(angle):
    """Along it the larger variance, across it what is wide: max(2, 5), and max(3, 0)."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    wide, least, answer = (turn @ np.diag(variances) @ turn.T for variances in ((2.0, 3.0), (5.0, 0.0), (5.0, 3.0)))
    assert _at_least(wide, least, 1.0) == pytest.approx(answer, abs=1e-6)
