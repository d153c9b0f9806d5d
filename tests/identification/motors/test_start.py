"""Each direction of a motor by itself, against a motor of `tests/support/bench_motor.py`, whose start is known."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine
from omnidyn.run import Run
from tests.support.bench_motor import BenchMotor
from tests.support.codes import codes
from tests.support.motor_ramps import ALL, DT, EQUAL, STICKY, bench, both_ways, coverage


def test_each_direction_has_its_own_start_stop_line_and_lag():
    """Stiction 0.6 and 0.9 V, sliding friction 0.4 and 0.55 V: a line through all of it meets zero in between."""
    run, _ = bench()
    study = identify([run], None, MotorLine()).study
    for each, hold, slide in zip(both_ways(study), STICKY.hold, STICKY.slide, strict=True):
        assert each.sharp
        assert each.value["start"] == pytest.approx(hold, abs=0.02)
        assert each.value["offset"] == pytest.approx(slide, abs=0.02)
        assert each.value["stop"] < each.value["offset"] + 0.02 < each.value["start"]
        assert each.value["slope"] == pytest.approx(STICKY.slope, rel=0.02)
        assert each.value["lag"] == pytest.approx(STICKY.inertia / STICKY.slope, abs=DT)
    assert str(study.verdict) == "motor 1 starts at 0.603 V (+) and 0.898 V (-)"
    told = study.to_dict()["starts"]
    assert told[0]["parameters"]["start"]["ci95"][0] <= 0.6 <= told[0]["parameters"]["start"]["ci95"][1]
    assert len(study.document()["starts"].rows) == 2
    assert any(one.numbers.get("line_elsewhere") for one in study.statements)


def test_a_bend_of_the_line_moves_no_start():
    """A drag that doubles what the motor needs at full speed moves the line's crossing by half a volt."""
    motor = BenchMotor(hold=(0.6, 0.6), slide=(0.6, 0.6), drag=0.05)
    study = identify([bench(motor)[0]], None, MotorLine()).study
    for each in both_ways(study):
        low, high = each.ci95["start"]
        assert low <= 0.6 <= high
        assert high - low < 0.15
        assert not each.ci95["offset"][0] <= 0.6 <= each.ci95["offset"][1]


@pytest.mark.parametrize("how", [{}, {"noise": 0.5}, {"ticks": 400}, {"ticks": 2000}], ids=str)
@pytest.mark.some(2)
def test_the_intervals_hold_the_truth(how, draws):
    """Two draws of each; bench studies has many."""
    found = coverage([STICKY, EQUAL], draws(2), ALL, **how)
    assert min(found.values()) >= 0.75


def test_duty_is_in_percent_and_a_reversed_motor_has_sizes():
    """The same motor, plugged in the other way round: what was the start forward is that backward."""
    run, _ = bench()
    turned = Run(t=run.t, duty=run.voltage / 10.0, wheel_speed=-run.wheel_speed)
    back, ahead = both_ways(identify([turned], None, MotorLine()).study)[::-1]
    assert (back.unit, back.direction) == ("%", "-")
    assert back.value["start"] == pytest.approx(6.0, abs=0.2)
    assert ahead.value["start"] == pytest.approx(9.0, abs=0.2)
    assert back.value["slope"] < 0.0
    assert back.value["offset"] == pytest.approx(4.0, abs=0.2)


def test_a_direction_in_which_it_never_sets_off_has_a_bound():
    run, _ = bench(peaks=(3.0, -0.7, 3.0, -0.7))
    ahead, back = both_ways(identify([run], None, MotorLine()).study)
    assert ahead.sharp
    low, high = back.ci95["start"]
    assert 0.5 < low <= 0.9
    assert np.isinf(high)
    assert back.statement().code == "never_sets_off"


def test_a_slow_motor_that_has_just_set_off_does_not_rest():
    """At 1 kHz a motor with a lag of 0.65 s moves for long before its speed shows: no rest under more is told."""
    t = 1e-3 * np.arange(20_000)
    phases = np.random.default_rng(4).uniform(0.0, 2.0 * np.pi, 9)
    put_in = sum(np.sin(2.0 * np.pi * 0.1 * n * t + phase) / n**0.5 for n, phase in enumerate(phases, 1))
    slow = BenchMotor(hold=(0.3, 0.3), slide=(0.3, 0.3), slope=5.0, inertia=3.25)
    _, angle, *_ = slow.turn(t, put_in)
    noisy = angle + 1e-5 * np.random.default_rng(0).standard_normal(len(t))
    study = identify([Run(t=t, voltage=put_in[:, None], wheel_angle=noisy[:, None])], None, MotorLine()).study
    assert all(not start.ci95["start"][0] > 0.3 for start in study.starts)


def test_steps_alone_give_bounds():
    """From 0 to 2 V: it starts somewhere in between, and no number is made up."""
    t = DT * np.arange(800)
    put_in = np.repeat([0.0, 2.0, 0.0, 2.5, 0.0, -2.0, 0.0, -3.0], 100)
    speed, *_ = STICKY.turn(t, put_in)
    noisy = speed + 0.02 * np.random.default_rng(0).standard_normal(len(t))
    for each in both_ways(
        identify([Run(t=t, voltage=put_in[:, None], wheel_speed=noisy[:, None])], None, MotorLine()).study
    ):
        assert each.ci95["start"] == (0.0, 2.0)
        assert np.isnan(each.value["start"])
        assert each.statement().code == "sets_off_below"


def test_passing_zero_is_no_rest():
    """Reversals of a motor without friction: no start is invented."""
    t = DT * np.arange(2000)
    put_in = 3.0 * np.sin(2.0 * np.pi * 0.5 * t)
    speed, *_ = BenchMotor(hold=(0.0, 0.0), slide=(0.0, 0.0)).turn(t, put_in)
    noisy = speed + 0.05 * np.random.default_rng(0).standard_normal(len(t))
    study = identify([Run(t=t, voltage=put_in[:, None], wheel_speed=noisy[:, None])], None, MotorLine()).study
    assert not any(each.sharp for each in study.starts)
    assert codes(study.verdict.numbers["parts"]) == ["motors_without_dead_band"]


def test_reversals_through_a_dead_band_count():
    t = DT * np.arange(3000)
    put_in = 3.0 * np.sin(2.0 * np.pi * 0.1 * t)
    speed, *_ = STICKY.turn(t, put_in)
    noisy = speed + 0.05 * np.random.default_rng(0).standard_normal(len(t))
    study = identify([Run(t=t, voltage=put_in[:, None], wheel_speed=noisy[:, None])], None, MotorLine()).study
    for each, hold in zip(both_ways(study), STICKY.hold, strict=True):
        low, high = each.ci95["start"]
        assert low <= hold <= high
        assert high - low < 0.1
        assert each.starts == 3


def test_starts_that_differ_from_time_to_time_are_spanned():
    """Cogging: 0.6 V at one angle, 0.8 at another."""
    runs = [bench(BenchMotor(hold=(hold, hold)), seed)[0] for seed, hold in enumerate((0.6, 0.8))]
    for each in both_ways(identify(runs, None, MotorLine()).study):
        low, high = each.ci95["start"]
        assert low <= 0.6 < 0.8 <= high
        assert "starts_scatter" in codes(each.warnings)
