"""A dead band lies below every input under which the motor turned; numbers at the end of a search are none."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.log import motor_logs
from omnidyn.identification.motors.steady_windows import turned_under
from omnidyn.logs.motor_table import MotorTable
from omnidyn.run import Run

SLOPE, BAND, DT, PARTS = 0.5, 0.5, 0.01, 10


def motor(volts, lag=0.1, noise=0.3, seed=1):
    """A run of w' = (u - c sgn w - k w)/(k lag), by Euler's method."""
    speed, out, h = 0.0, [], DT / PARTS
    for u in volts:
        out.append(speed)
        for _ in range(PARTS):
            if speed == 0.0 and abs(u) <= BAND:
                break
            side = np.sign(speed) or np.sign(u)
            new = speed + h * (u - BAND * side - SLOPE * speed) / (SLOPE * lag)
            speed = new if new * side > 0.0 or abs(u) > BAND else 0.0
    seen = np.array(out) + noise * np.random.default_rng(seed).normal(size=len(out))
    return Run(t=DT * np.arange(len(volts)), voltage=np.array(volts)[:, None], wheel_speed=seen[:, None])


def steps(*levels):
    return np.repeat(levels, 200)


def test_a_line_that_is_too_short_says_no_more_than_that_it_turned():
    """It rested at 0.35 V and turned at 2 V; the line alone would say up to 5 V and more."""
    study = identify([motor(steps(0.35, 2.0, 2.0))], None, MotorLine()).study
    low, high = study.motors[0].ci95["dead_band"]
    assert low <= BAND
    assert high == pytest.approx(2.0, abs=1e-6)
    (start,) = study.starts
    assert start.ci95["start"] == pytest.approx((0.35, 2.0))


def test_a_motor_that_runs_out_does_not_turn_steadily():
    """Its lag is 2 s: under 0.3 V, below the dead band, it still turns for seconds."""
    for noise in (0.01, 0.3):  # where little hides it no window is steady; where much does, its halves differ
        (log,) = motor_logs([motor(steps(2.0, 2.0, 2.0, 0.3), lag=2.0, noise=noise)])
        assert turned_under([log], 0) == pytest.approx(2.0)
    (slowly,) = motor_logs([motor(steps(-2.0, -1.0, 0.0, 1.5), noise=0.05)])
    assert turned_under([slowly], 0) == pytest.approx(1.0)
    assert turned_under([slowly], 0, side=1.0) == pytest.approx(1.5)
    (rests,) = motor_logs([motor(steps(0.2, 0.4), noise=0.05)])
    assert turned_under([rests], 0) == np.inf


def test_a_motor_that_a_positive_input_turns_backward():
    forward = motor(steps(0.35, 2.0, 2.0, -1.5))
    backward = forward.replace(voltage=-forward.voltage)
    (log,) = motor_logs([backward])
    assert turned_under([log], 0, orientation=-1.0) == pytest.approx(1.5)
    assert turned_under([log], 0, side=1.0, orientation=-1.0) == pytest.approx(2.0)
    forward, backward = (identify([each], None, MotorLine()).study.starts for each in (forward, backward))
    assert [each.ci95["start"] for each in forward] == [each.ci95["start"] for each in backward]


@pytest.mark.parametrize("rounding", [0.0, 1e-13])
def test_a_free_run_at_one_speed_says_between_what(rounding):
    """It turns from one row to the next, so that any lag that is short enough fits: slope and dead band are one."""
    volts = steps(0.35, 2.0, 2.0)
    speed = np.where(volts > BAND, (volts - BAND) / SLOPE, 0.0)
    speed = speed * (1.0 + rounding * np.random.default_rng(0).standard_normal((37, len(speed)))[-1])
    fit = fit_motor(Run(t=DT * np.arange(len(volts)), voltage=volts[:, None], wheel_speed=speed[:, None]))
    assert {"dead_band", "lag"} <= set(fit.unidentifiable)
    assert all(np.isnan(fit.std[name]) for name in ("dead_band", "lag", "inertia"))
    assert fit.ci95["dead_band"] == pytest.approx((0.35, 2.0))
    assert fit.ci95["slope"][0] < 0.01  # that of a dead band just below 2 V; rounding had it at 0.37 on some processors
    assert fit.ci95["slope"][1] > 0.549  # that of a dead band of 0.35 V
    assert not fit.statement().numbers["lag_known"]
    assert "it is between 0.35 and 2 V, because it turned steadily at that input" in str(fit.statement())


def test_a_table_with_few_inputs_is_bounded_by_them():
    put_in = np.array([0.35, 0.35, 2.0, 2.0, 2.05, 2.05, 2.1, 2.1])
    speed = np.array([0.0, 0.0, 3.2, 2.8, 3.0, 3.3, 3.0, 3.4])
    study = identify(MotorTable(put_in, speed, np.zeros(8, dtype=np.int64), "voltage", "V"), None, MotorLine()).study
    assert study.motors[0].ci95["dead_band"][1] == pytest.approx(2.0)
    assert study.starts[0].ci95["start"] == pytest.approx((0.35, 2.0))


def test_slow_rows_that_show_rest_and_motion_apart_bound_a_start():
    """A gap hides when it set off: it did so between what it rested under and what it turned under."""
    t = np.concatenate([np.arange(6.0), 100.0 + np.arange(8.0)])
    put_in = np.concatenate([np.full(6, 0.35), np.repeat([2.0, 2.4], 4)])
    speed = np.where(put_in > BAND, (put_in - BAND) / SLOPE, 0.0)
    speed += np.where(speed > 0.0, 0.05 * np.random.default_rng(2).normal(size=len(t)), 0.0)
    study = identify([Run(t=t, voltage=put_in[:, None], wheel_speed=speed[:, None])], None, MotorLine()).study
    assert study.starts[0].ci95["start"] == pytest.approx((0.35, 2.0))
    assert "it sets off between 0.35 and 2 V" in str(study.starts[0].statement())
