"""Output error on real motors, fitted to some runs and run freely on others, beside the README of the data."""

import json

import numpy as np
import pytest

from benchmarks.real import real_fit, udea
from benchmarks.real.choose_motor import choose_motor
from omnidyn import MotorFit, identify
from omnidyn.identification.motors.choice import fit_rmse
from omnidyn.identification.motors.fit import fit_motor
from tests.support import real_logs as logs

TURN = 2.0 * np.pi


@pytest.fixture(scope="module")
def bench(data):
    return real_fit.bench_runs()


@pytest.fixture(scope="module")
def fits(bench):
    """With and without a dead band, fitted to step1 and chirp1."""
    fitted = [runs[0] for runs in bench.values()]
    return {dead_band: fit_motor(fitted, dead_band=dead_band) for dead_band in (True, False)}


@pytest.mark.parametrize("kind, baseline", [("step", 0.044), ("chirp", 0.051)])
@pytest.mark.parametrize("dead_band", [True, False])
def test_the_bench_is_predicted_as_in_the_readme(bench, fits, dead_band, kind, baseline):
    """The baseline is over both runs of a kind, fitted to them; here half of them were never seen."""
    assert fit_rmse(fits[dead_band], bench[kind]) / TURN <= 1.1 * baseline


def test_no_friction_is_invented_on_the_bench(fits):
    """The negative control: Coulomb 0.35+-0.24 mV, that is none; viscous 0.05509+-0.00006 V/(turn/s)."""
    fit = fits[True]
    assert not fit.dead_band_seen
    assert fit.ci95["dead_band"][0] <= 0.35e-3 <= fit.ci95["dead_band"][1]
    assert fit.ci95["dead_band"][1] < 0.03 * 0.25  # of the voltage of the step
    assert abs(TURN * fit.value["slope"] - 0.05509) <= 3.0 * np.hypot(TURN * fit.std["slope"], 6e-5)
    assert fit.between == "mean"  # its voltages are samples, as the README has it


def test_a_way_of_reading_the_input_that_the_logs_refute_claims_no_friction(bench):
    """Held inputs with a latency had 1.8 +- 0.6 mV, [0.4, 3.2]; as a curve through the rows the logs are met better."""
    fit = fit_motor([runs[0] for runs in bench.values()], between="hold", latency=True)
    assert not fit.dead_band_seen
    low, high = fit.ci95["dead_band"]
    assert low == 0.0 <= 0.35e-3 < high < 0.03 * 0.25
    assert "the logs are fitted better where the input is a curve through the rows" in str(fit.warnings[0])


def test_the_way_is_chosen_on_training_logs_alone(bench):
    """step1 and chirp1, each predicted by the other: a curve through the rows, and no friction; it predicts the others.

    By the sum of squares it was the mean of two rows, which predicts chirp1 better and all of step1 worse.
    """
    choice = choose_motor([runs[0] for runs in bench.values()])
    assert choice.options == {"between": "curve", "latency": True, "dead_band": False}
    assert choice.comparison.better > 0.7 * choice.comparison.blocks
    assert fit_rmse(choice.fit, bench["chirp"][1]) / TURN <= 1.1 * 0.051
    assert fit_rmse(choice.fit, bench["step"][1]) / TURN <= 1.1 * 0.044


def test_the_readmes_regression_comes_out_of_our_windows(data):
    """So that both are scored alike: u = 1.96 w + 0.85 sgn w + 0.18 dw/dt, rmse 0.93 % of duty; 0.51 (rad/s)/%."""
    u, w, change = udea.windows_of_turning(udea.turning_run())
    columns = np.stack([w, np.sign(w), change], axis=1)
    numbers = np.linalg.lstsq(columns, u, rcond=None)[0]
    assert numbers[0] == pytest.approx(1.96, abs=2 * 0.09)
    assert numbers[1] == pytest.approx(0.85, abs=2 * 0.54)
    assert np.sqrt(np.mean((u - columns @ numbers) ** 2)) == pytest.approx(0.93, abs=0.06)


@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.some(1)
def test_no_friction_is_written(bench, k):
    """No dead band and no offset, of either run of a kind, for held-out blocks do not need them."""
    (motor,) = identify([runs[k] for runs in bench.values()], None, MotorFit()).study.motors
    assert "dead_band" in motor.rejected
    assert not {"dead_band", "offset"} & set(motor.value)


def test_what_is_written_of_the_first_runs_predicts_the_second_as_in_the_readme(bench):
    """A latency is written beside the lag, by 13 of 20 blocks: README has 5.3 ms for the two together. Beside slope and
    lag alone it predicts the second chirp better, and the second step worse."""
    (motor,) = identify([runs[0] for runs in bench.values()], None, MotorFit()).study.motors
    assert motor.value["lag"] + motor.value["latency.wheel_speed"] == pytest.approx(5.3e-3, abs=1e-3)
    for kind, baseline in (("step", 0.044), ("chirp", 0.051)):
        assert fit_rmse(motor, bench[kind][1]) / TURN <= 1.1 * baseline


def test_a_chirp_that_outruns_the_rows_claims_nothing(data):
    """README: beyond 4 s the chirp is faster than the rows, so what the motor got is not in the log."""
    fit = fit_motor(logs.odrive(data, ("step", "chirp")))
    assert not fit.dead_band_seen


def test_coulomb_does_not_help_on_logs_it_never_saw(bench, fits):
    for runs in bench.values():
        with_band, without = (fit_rmse(fits[dead_band], runs[1]) for dead_band in (True, False))
        assert with_band == pytest.approx(without, rel=0.02)


def test_lag_and_latency_together(bench):
    """README: 1/a and the lag of the sensor are 5.3 ms together; only the sum is identifiable."""
    fit = fit_motor([runs[0] for runs in bench.values()], between="mean", latency=True)
    assert fit.value["lag"] + fit.value["latency.wheel_speed"] == pytest.approx(5.3e-3, abs=0.5e-3)


def test_the_robot_that_turns_on_the_spot(data):
    """README, predicting w: 0.46 rad/s with a dead zone, 0.56 proportional. Half of the log predicts the other."""
    run = udea.turning_run()
    half = len(run) // 2
    parts = [udea.part(run, slice(0, half)), udea.part(run, slice(half, None))]
    for dead_band, baseline in ((True, 0.46), (False, 0.56)):
        how = {"dead_band": dead_band, "kind": "duty", "angle": True, "latency": True}
        errors = [udea.window_rmse(fit_motor(a, **how), [b]) for a, b in (parts, parts[::-1])]
        assert np.sqrt(np.mean(np.square(errors))) < baseline


@pytest.mark.long
def test_drives_with_noisy_encoders(data):
    """README: 0.5 s means are predicted within 1.55 rad/s, fitted to all; here exp4 and exp5 from exp1 to exp3."""
    runs = udea.drive_runs()
    errors = []
    for motor in range(3):
        fit = fit_motor(runs[:3], motor, kind="duty", loss="student-t", between="hold")
        errors.append(udea.window_rmse(fit, runs[3:], udea.SPAN))
        assert 1.0 / fit.value["slope"] == pytest.approx(0.33, abs=0.035)
    assert np.sqrt(np.mean(np.square(errors))) <= 1.55


def test_one_step_of_the_bench_tells_no_dead_band(data):
    """Rest, then one level: slope and dead band balance. The fit ends at the bound of the dead band and must say so."""
    run = logs.odrive(data, ["step"])[0]
    fit = fit_motor([run], between="mean")
    assert {"slope", "dead_band"} <= set(fit.unidentifiable)
    assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["parameters"]["slope"]["std"] is None
    assert not fit.dead_band_seen
    assert fit.ci95["dead_band"][0] == 0.0
    assert "not identifiable" in str(fit.statement())
