"""Lines of motors from windows in integral form, against motors whose line is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorFit, MotorLine
from omnidyn.identification.motors.log import motor_logs
from omnidyn.identification.motors.study import dead_bands_apart
from omnidyn.identification.motors.window_fit import fit_line
from omnidyn.identification.motors.windows import motor_windows
from omnidyn.run import Run

SLOPE, INERTIA = 0.5, 0.08


def motor(voltage, dt, band, slope=SLOPE, inertia=INERTIA, fine=20):
    """m w' = u - k w - c sgn w with exact rest, by small steps: (speed, angle) at the rows. The voltage is held."""
    w = a = 0.0
    speed, angle = [], []
    for u in voltage:
        speed.append(w)
        angle.append(a)
        for _ in range(fine):
            before = w
            drive = u - slope * w
            if w == 0.0:
                push = np.sign(drive) * max(abs(drive) - band, 0.0)
            else:
                push = drive - band * np.sign(w)
            w += push / inertia * dt / fine
            if before * w < 0.0:
                w = 0.0
            a += 0.5 * (before + w) * dt / fine
    return np.array(speed), np.array(angle)


def steps(rng, rows=900, hold=45, size=3.0):
    return np.repeat(rng.uniform(-size, size, rows // hold), hold)


def bench(band, seed=0, noise=0.0, with_angle=True, **how):
    rng, dt = np.random.default_rng(seed), 0.01
    voltage = steps(rng)
    speed, angle = motor(voltage, dt, band, **how)
    t = np.arange(len(voltage)) * dt
    noisy = speed + noise * rng.standard_normal(len(t))
    return Run(
        t=t, voltage=voltage[:, None], wheel_speed=noisy[:, None], wheel_angle=angle[:, None] if with_angle else None
    )


def line_of(run, **how):
    return identify([run], None, MotorLine(**how)).motors[0]


def test_a_clean_motor_gives_its_line():
    line = line_of(bench(0.4))
    assert line.value["slope"] == pytest.approx(SLOPE, rel=0.02)
    assert line.value["dead_band"] == pytest.approx(0.4, abs=0.03)
    assert line.value["inertia"] == pytest.approx(INERTIA, rel=0.1)
    assert line.dead_band_seen


def test_no_friction_is_invented(draws):
    """The negative control: of twenty motors without friction, no more than two may seem to have some."""
    lines = [line_of(bench(0.0, seed, noise=0.1, with_angle=False)) for seed in range(draws(20))]
    assert sum(line.dead_band_seen for line in lines) <= 2 / 20 * len(lines)
    assert abs(np.mean([line.value["dead_band"] for line in lines])) < 0.02


def test_a_dead_band_is_kept_where_windows_left_out_need_it():
    assert "dead_band" not in line_of(bench(0.4, noise=0.1, with_angle=False)).rejected
    rejected = line_of(bench(0.0, noise=0.1, with_angle=False))
    assert "dead_band" in rejected.rejected
    assert not rejected.dead_band_seen
    assert "of 10 held-out blocks are predicted better with one, no more than by chance" in str(rejected.statement())


def test_dead_bands_that_exclude_each_other_are_said():
    windows = motor_windows(motor_logs([bench(0.4)]))
    line = fit_line(windows, 0, "")
    other = replace(line, ci95={**line.ci95, "dead_band": (0.1, 0.2)})
    assert not list(dead_bands_apart([line], windows))
    (found,) = dead_bands_apart([other], windows)
    assert "the dead band is between 0.1 and 0.2 V by free runs" in str(found)


def test_the_intervals_hold_the_truth(draws):
    lines = [line_of(bench(0.4, seed, noise=0.2, with_angle=False)) for seed in range(draws(20))]
    for name, truth in (("dead_band", 0.4), ("slope", SLOPE)):
        held = [line.ci95[name][0] <= truth <= line.ci95[name][1] for line in lines]
        assert sum(held) >= 15 / 20 * len(lines), name


def test_noise_of_the_speed_does_not_flatten_the_slope():
    """Least squares of u on a noisy speed would: its slope comes out below half here."""
    rng, dt = np.random.default_rng(7), 0.01
    voltage = np.repeat(np.linspace(0.5, 4.0, 8), 150)
    speed, _ = motor(voltage, dt, 0.0)
    noisy = speed + 30.0 * rng.standard_normal(len(speed))
    run = Run(t=np.arange(len(voltage)) * dt, voltage=voltage[:, None], wheel_speed=noisy[:, None])
    line = line_of(run)
    low, high = line.ci95["slope"]
    assert low <= SLOPE <= high
    assert not line.dead_band_seen
    assert "not identifiable here" in str(identify([run], None, MotorLine()).study.statements[0])


def test_one_speed_gives_no_dead_band_and_says_so():
    voltage = np.full(600, 2.0)
    _speed, angle = motor(voltage, 0.01, 0.3)
    study = identify(
        [Run(t=np.arange(600) * 0.01, voltage=voltage[:, None], wheel_angle=angle[:, None])], None, MotorLine()
    ).study
    assert np.isnan(study.motors[0].value["dead_band"])
    assert "nan" not in str(study)  # what is not known is a dash
    assert study.statements[0].numbers["dead_band"].code == "dead_band_bounded"


def test_a_motor_at_rest_bounds_what_holds_it():
    rng = np.random.default_rng(1)
    voltage = np.concatenate([np.full(200, 0.35), steps(rng, 600)])
    _speed, angle = motor(voltage, 0.01, 0.4)
    line = line_of(Run(t=np.arange(len(voltage)) * 0.01, voltage=voltage[:, None], wheel_angle=angle[:, None]))
    assert line.rest == pytest.approx(0.35)


def test_an_input_that_the_log_does_not_resolve_is_left_out():
    rng, dt, fine = np.random.default_rng(2), 0.01, 10
    voltage = rng.uniform(-3.0, 3.0, 6000)  # white, ten values between two rows
    _speed, angle = motor(voltage, dt / fine, 0.0)
    run = Run(t=np.arange(600) * dt, voltage=voltage[::fine, None], wheel_angle=angle[::fine, None])
    with pytest.raises(InsufficientDataError, match=r"whose input the log does not resolve"):
        motor_windows(motor_logs([run]))


def test_a_gap_is_not_integrated_over():
    run = bench(0.4)
    keep = (run.t < 3.0) | (run.t > 4.5)
    cut = Run(
        t=run.t[keep], voltage=run.voltage[keep], wheel_speed=run.wheel_speed[keep], wheel_angle=run.wheel_angle[keep]
    )
    assert line_of(cut).value["dead_band"] == pytest.approx(0.4, abs=0.04)


def test_duty_is_in_percent():
    run = bench(0.4)
    line = line_of(Run(t=run.t, duty=run.voltage / 10.0, wheel_angle=run.wheel_angle))
    assert line.unit == "%"
    assert line.value["dead_band"] == pytest.approx(4.0, abs=0.3)


def test_several_motors_have_a_line_each_and_one_together():
    one, other = bench(0.2, 0), bench(0.6, 1)
    both = Run(
        t=one.t,
        voltage=np.hstack([one.voltage, other.voltage]),
        wheel_angle=np.hstack([one.wheel_angle, other.wheel_angle]),
    )
    lines = {line.motor: line for line in identify([both], None, MotorLine()).motors}
    assert lines[0].value["dead_band"] == pytest.approx(0.2, abs=0.05)
    assert lines[1].value["dead_band"] == pytest.approx(0.6, abs=0.05)
    assert 0.2 < lines[None].value["dead_band"] < 0.6


def test_the_same_data_give_the_same_intervals():
    assert line_of(bench(0.4, noise=0.2)).ci95 == line_of(bench(0.4, noise=0.2)).ci95


@pytest.mark.parametrize(
    "how, words",
    [
        ({"input": "luck"}, r"no such input; got luck; expected voltage, duty, current"),
        ({"input": "current"}, r"input is not in the log; got voltage, wheel_angle.*expected current"),
        ({"speed": "light"}, r"no such speed; got light; expected wheel, set or ground"),
        ({"speed": "set"}, r"no such speed; got set; expected wheel or ground"),
        ({"speed": "ground"}, r"the heading is not known"),
    ],
)
def test_wrong_options_are_refused(how, words):
    with pytest.raises(InputError, match=words):
        identify([bench(0.4)], None, MotorLine(**how))


def test_a_free_run_takes_no_nuisance_that_motors_do_not_have():
    with pytest.raises(InputError, match="no such nuisance of motors; got gain; expected dead_band, offset, latency"):
        identify([bench(0.4)], None, MotorFit(nuisances="gain", between="hold"))


def test_too_few_windows_are_refused():
    run = bench(0.4)
    short = Run(t=run.t[:60], voltage=run.voltage[:60] + 2.0, wheel_angle=run.t[:60, None] * 4.0)
    with pytest.raises(InsufficientDataError, match=r"too few windows for a line with intervals.*6 or more"):
        identify([short], None, MotorLine())
