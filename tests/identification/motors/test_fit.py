"""One motor by output error, against logs made by Euler's method in small steps: numbers, intervals, refusals."""

import numpy as np
import pytest

from benchmarks.real import choose_motor as choice
from benchmarks.real.choose_motor import WAYS, choose_motor
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.motors.choice import fit_rmse, run_motor
from omnidyn.identification.motors.fit import fit_motor, fit_ways
from omnidyn.identification.motors.input_between_rows import HOLD
from omnidyn.identification.motors.motor_engine import step_numbers
from omnidyn.run import Run

SLOPE, BAND, LAG = 0.5, 0.4, 0.05
TRUE = {"slope": SLOPE, "dead_band": BAND, "lag": LAG}


def euler(speed, u, band, seconds, steps=100):
    """(speed, angle turned): w' = (u - band sgn w - k w)/(k lag), stick at 0."""
    h, angle = seconds / steps, 0.0
    for _ in range(steps):
        if speed == 0.0 and abs(u) <= band:
            return 0.0, angle
        side = np.sign(speed) or np.sign(u)
        new = speed + h * (u - band * side - SLOPE * speed) / (SLOPE * LAG)
        angle += 0.5 * h * (speed + new)
        speed = new if new * side > 0.0 else 0.0
    return speed, angle


@pytest.fixture(scope="module")
def clean():
    """u, w and angle of 10 s at 100 Hz with and without a dead band."""
    rng, found = np.random.default_rng(0), {}
    level = np.repeat(rng.uniform(-2.0, 2.0, 50), 20)
    for band in (BAND, 0.0):
        w, angle = [0.0], [0.0]
        for u in level:
            speed, turned = euler(w[-1], u, band, 0.01)
            w.append(speed)
            angle.append(angle[-1] + turned)
        found[band] = np.append(level, level[-1]), np.array(w), np.array(angle)
    return found


def run_of(clean, band, seed, noise=0.05, angle=False):
    u, w, turned = clean[band]
    rng = np.random.default_rng(seed)
    more = {"wheel_angle": (turned + 0.01 * rng.standard_normal(len(w)))[:, None]} if angle else {}
    speed = (w + noise * rng.standard_normal(len(w)))[:, None]
    return Run(t=0.01 * np.arange(len(w)), voltage=u[:, None], wheel_speed=speed, **more)


def test_a_log_almost_without_noise_gives_the_truth(clean):
    """What is left is what Euler's steps of 0.1 ms are off by: 0.1 ms/50 ms at most."""
    fit = fit_motor(run_of(clean, BAND, 0, noise=1e-4), between="hold")
    for name, true in TRUE.items():
        assert fit.value[name] == pytest.approx(true, rel=3e-3)


def test_intervals_hold_the_truth(clean, draws):
    """20 draws: 60 intervals of 95 %; 52 or more hold with probability 0.99."""
    fits = [fit_motor(run_of(clean, BAND, seed), between="hold") for seed in range(draws(20))]
    held = sum(
        f.ci95[n][0] - 2e-3 * true <= true <= f.ci95[n][1] + 2e-3 * true for f in fits for n, true in TRUE.items()
    )
    assert held >= 52 / 20 * len(fits)
    assert all(f.dead_band_seen for f in fits)


def test_no_friction_is_invented(clean, draws):
    fits = [fit_motor(run_of(clean, 0.0, seed), between="hold") for seed in range(draws(20))]
    assert sum(f.dead_band_seen for f in fits) <= 2 / 20 * len(fits)  # 0.5 expected of 20


def test_the_angle_alone_is_enough(clean):
    run = run_of(clean, BAND, 3, angle=True).replace(wheel_speed=None)
    fit = fit_motor(run, angle=True, between="hold")
    for name, true in TRUE.items():
        assert abs(fit.value[name] - true) < 4.0 * fit.std[name] + 3e-3 * true


def test_how_the_input_goes_between_rows_is_found(clean):
    assert fit_motor(run_of(clean, BAND, 1)).between == "hold"


def test_a_refuted_way_widens_the_intervals_and_says_so(clean):
    """The input is held. Asked for the mean of two rows, the fit must say that the logs are fitted better otherwise."""
    asked, right = fit_motor(run_of(clean, BAND, 1), between="mean"), fit_motor(run_of(clean, BAND, 1))
    assert asked.warnings[0].code == "other_reading"
    assert (asked.warnings[0].numbers["better"], asked.warnings[0].numbers["other"]) == (True, HOLD)
    assert right.warnings == ()
    for name, true in TRUE.items():
        assert asked.ci95[name][0] <= right.ci95[name][0] < right.ci95[name][1] <= asked.ci95[name][1]
        assert asked.ci95[name][0] - 2e-3 * true <= true <= asked.ci95[name][1] + 2e-3 * true
        assert asked.std[name] >= abs(asked.value[name] - right.value[name])


def test_a_true_way_is_as_sure_as_before(clean):
    """Held inputs, asked for as held: nothing is widened, and the dead band that is there is seen."""
    fit = fit_motor(run_of(clean, BAND, 1), between="hold")
    assert fit.warnings == ()
    assert fit.dead_band_seen


@pytest.mark.long
@pytest.mark.parametrize("band", [BAND, 0.0])
def test_the_way_chosen_by_logs_left_out_is_the_true_one(clean, band):
    """Held inputs, no latency; a dead band only where there is one. One log is predicted by its parts."""
    for runs in (run_of(clean, band, 2), [run_of(clean, band, seed) for seed in range(2)]):
        chosen = choose_motor(runs)
        assert chosen.options == {"between": "hold", "latency": False, "dead_band": band > 0.0}
        assert len(chosen.errors) == len(WAYS)
        assert min(error for _, error in chosen.errors) == pytest.approx(0.05, rel=0.15)  # the noise


def test_ways_that_differ_between_rows_alone_share_their_fits(clean, monkeypatch):
    """Each fit is made in all of them anyway: a fit for each part of a log, not for each part and way."""
    asked = []

    def counted(runs, motor, **options):
        asked.append(options)
        return fit_ways(runs, motor, **options)

    monkeypatch.setattr(choice, "fit_ways", counted)
    (first, *_), run = WAYS, run_of(clean, 0.0, 2)
    ways = [way for way in WAYS if (way["latency"], way["dead_band"]) == (first["latency"], first["dead_band"])]
    found = choose_motor(run, ways=ways)
    assert [way["between"] for way in ways] == ["hold", "mean", "curve"]
    assert len({error for _, error in found.errors}) == 3
    assert asked == [{"latency": False, "dead_band": False}] * choice.SHARES


def test_a_choice_needs_logs_that_can_be_predicted(clean):
    run = run_of(clean, BAND, 2)
    short = Run(t=run.t[:4], voltage=run.voltage[:4], wheel_speed=run.wheel_speed[:4])
    with pytest.raises(InsufficientDataError, match="no log can be predicted from the others; got 1 logs"):
        choose_motor(short)


def test_a_latency_is_found(clean):
    """The log shows what was 20 ms ago: two rows."""
    run = run_of(clean, BAND, 4)
    late = np.vstack([np.zeros((2, 1)), run.wheel_speed[:-2]])
    fit = fit_motor(run.replace(wheel_speed=late), latency=True, between="hold")
    value, std = fit.value["latency.wheel_speed"], fit.std["latency.wheel_speed"]
    assert abs(value - 0.02) < 4.0 * std
    assert std < 1e-3


def test_a_latency_at_the_end_of_its_range_is_no_estimate(clean):
    """The log shows what was half a second ago; so late is not searched."""
    run = run_of(clean, BAND, 4)
    late = np.vstack([np.zeros((50, 1)), run.wheel_speed[:-50]])
    name = "latency.wheel_speed"
    fit = fit_motor(run.replace(wheel_speed=late), latency=True, between="hold")
    assert name in fit.unidentifiable
    assert np.isnan(fit.std[name])
    assert fit.ci95[name][0] < 0.0 < fit.ci95[name][1] < 0.5
    assert "not determined" in str(fit.statement())
    assert "nan" not in str(fit.statement())


def test_a_free_run_on_another_log_is_as_good_as_its_noise(clean):
    fit = fit_motor(run_of(clean, BAND, 5), between="hold")
    other = run_of(clean, BAND, 6)
    assert fit_rmse(fit, other) == pytest.approx(0.05, rel=0.1)
    assert np.abs(run_motor(fit, other)[0] - clean[BAND][1]).max() < 0.1  # the start is one noisy sample


def test_derivatives_of_the_numbers_of_the_step():
    """Against central differences."""
    values, h = np.array([0.5, 0.05, 0.4]), 1e-6
    law, by_law, drive, by_drive = step_numbers(values, 2, 4)
    assert law[0, 2] == 20.0
    assert drive[2, 0] == 40.0
    assert law[1, 2] == law[2, 2] == pytest.approx(16.0)
    for j in range(3):
        step = np.eye(3)[j] * h * values[j]
        up, down = step_numbers(values + step, 2, 4), step_numbers(values - step, 2, 4)
        for a, b, slope in ((up[0][:2], down[0][:2], by_law), (up[2], down[2], by_drive)):
            assert (a - b) / (2.0 * h * values[j]) == pytest.approx(slope[..., j], rel=1e-6, abs=1e-5)


def test_what_cannot_be_used_is_refused(clean):
    run = run_of(clean, BAND, 0)
    with pytest.raises(InputError, match="no such motor; got 2; expected 1 to 1"):
        fit_motor(run, 1)
    with pytest.raises(
        InputError, match="the motors' input is not in the log; got wheel_speed; expected voltage, duty"
    ):
        fit_motor(run.replace(voltage=None))
    with pytest.raises(InputError, match="no speed and no angle of the motors"):
        fit_motor(run.replace(wheel_speed=None))
    with pytest.raises(InputError, match="between: no such way; got spline"):
        fit_motor(run, between="spline")
    with pytest.raises(InputError, match="loss: unknown loss; got huber"):
        fit_motor(run, loss="huber")
    with pytest.raises(InputError, match="no such input; got current"):
        fit_motor(run, kind="current")
    with pytest.raises(InsufficientDataError, match="the motor was never driven"):
        fit_motor(run.replace(voltage=np.zeros_like(run.voltage)))


def test_one_step_tells_no_dead_band():
    """From rest to one speed: u - band and slope w balance, whatever the band; slope and band cannot be told apart."""
    rng = np.random.default_rng(7)
    u = np.where(np.arange(400) < 100, 0.0, 2.0)
    w = [0.0]
    for level in u[:-1]:
        w.append(euler(w[-1], level, BAND, 0.01)[0])
    run = Run(t=0.01 * np.arange(400), voltage=u[:, None], wheel_speed=(w + 0.01 * rng.standard_normal(400))[:, None])
    for between in ("hold", "mean"):
        fit = fit_motor(run, between=between)
        low, high = fit.ci95["dead_band"]
        assert not fit.dead_band_seen
        assert "dead_band" in fit.unidentifiable or low <= 0.0 < high


def test_an_input_that_outruns_the_rows_does_not_count():
    """A motor without dead band under a chirp that ends at 3 rows a swing: what the rows do not show is no friction."""
    rng, fine = np.random.default_rng(8), 20
    t = np.arange(0.0, 8.0, 0.01 / fine)
    u = np.sin(2.0 * np.pi * (0.5 * t + 2.0 * t**2))
    w = [0.0]
    for level in u[:-1]:
        w.append(euler(w[-1], level, 0.0, 0.01 / fine, steps=5)[0])
    rows = slice(None, None, fine)
    speed = np.array(w)[rows] + 0.01 * rng.standard_normal(len(t[rows]))
    fit = fit_motor(Run(t=t[rows], voltage=u[rows, None], wheel_speed=speed[:, None]))
    assert fit.left_out > 100
    assert fit.statement().numbers["left_out"]
    assert not fit.dead_band_seen
    assert fit.value["slope"] == pytest.approx(SLOPE, rel=0.1)
