"""Points of steady speed, of a table or of a log of a row a second, against a motor whose levels are known."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorFit, MotorLine
from omnidyn.identification.motors.points import line_of_speed
from omnidyn.logs.motor_table import MotorTable
from omnidyn.run import Run
from tests.support.codes import codes

SLOPE, NOISE = 1.5, 0.1
HOLD, SLIDE = (20.0, 26.0), (14.0, 17.0)  # [%] forward and backward


def settled(put_in, seed=0):
    """The speed to which the motor settles under one input after the other, which at rest holds it harder."""
    rng, w, found = np.random.default_rng(seed), 0.0, []
    for u in put_in:
        side = np.sign(w) or (1.0 if u > HOLD[0] else -1.0 if u < -HOLD[1] else 0.0)
        w = (u - side * SLIDE[0 if side > 0.0 else 1]) / SLOPE if side else 0.0
        if w * side <= 0.0:  # it stopped, and may set off the other way at once
            w = (u + SLIDE[1]) / SLOPE if u < -HOLD[1] else (u - SLIDE[0]) / SLOPE if u > HOLD[0] else 0.0
        found.append(w + NOISE * rng.standard_normal() if w else 0.0)
    return np.array(found)


def sweep(step=2.0):
    up = np.arange(0.0, 60.0, step)
    return np.concatenate([up, 60.0 - up, -up, up - 60.0, [0.0]])


def slow_log(seed=0, hold=1, later=False):
    """A row a second. later: the row of an input holds the speed before it, as where a logger sets, then reads."""
    put_in = np.repeat(sweep(), hold)
    speed = settled(put_in, seed)
    if later:
        speed = np.concatenate([[0.0], speed[:-1]])
    return Run(t=np.arange(len(put_in), dtype=float), duty=put_in[:, None] / 100.0, wheel_speed=speed[:, None])


def table(put_in, speed, motor=None, **how):
    motor = np.zeros(len(put_in), dtype=np.int64) if motor is None else motor
    return MotorTable(np.asarray(put_in, dtype=float), np.asarray(speed, dtype=float), motor, "duty", "%", **how)


@pytest.mark.parametrize("how", [{}, {"hold": 5}, {"later": True}], ids=str)
def test_a_sweep_of_a_row_a_second_tells_all(how):
    """Up, down and either way: it used to be refused, there being no window of half a second."""
    study = identify([slow_log(**how)], None, MotorLine()).study
    for each, hold, slide in zip(study.starts, HOLD, SLIDE, strict=True):
        assert each.ci95["start"] == pytest.approx((hold, hold + 2.0))
        low, high = each.ci95["stop"]
        assert low - 1e-9 <= slide <= high <= slide + 3.0
        assert each.value["slope"] == pytest.approx(SLOPE, rel=0.01)
        assert each.value["offset"] == pytest.approx(slide, abs=0.3)
        assert np.isnan(each.value["lag"])
    assert str(study.verdict) == "motor 1 starts at 21 % (+) and 27 % (-)"
    assert "rows_as_points" in codes(study.warnings)


def test_whole_logs_of_a_row_a_second_have_the_same_starts():
    study = identify([slow_log()], None, MotorFit(between="hold", nuisances="none")).study
    assert [each.ci95["start"] for each in study.starts] == [pytest.approx((hold, hold + 2.0)) for hold in HOLD]


def test_a_table_has_the_largest_input_at_rest_and_the_smallest_that_moves():
    put_in = np.arange(0.0, 60.0, 4.0)
    study = identify(table(put_in, settled(put_in)), None, MotorLine()).study
    (each,) = study.starts
    assert each.ci95["start"] == (20.0, 24.0)
    assert np.isnan(each.value["stop"])
    assert each.ci95["offset"][0] <= SLIDE[0] <= each.ci95["offset"][1]


def test_rows_of_a_table_have_no_order():
    put_in = sweep(4.0)
    speed = settled(np.concatenate([np.zeros(0), put_in]))
    order = np.random.default_rng(1).permutation(len(put_in))
    one, other = (
        identify(table(put_in[rows], speed[rows]), None, MotorLine()).study.starts for rows in (slice(None), order)
    )
    assert [each.ci95["start"] for each in one] == [each.ci95["start"] for each in other]
    assert any("starts_scatter" in codes(each.warnings) for each in one)  # up and down are in one table


def test_motors_of_a_table_are_told_apart():
    put_in = np.arange(0.0, 60.0, 4.0)
    motor = np.repeat([0, 1], len(put_in))
    study = identify(
        table(np.tile(put_in, 2), np.concatenate([settled(put_in), settled(put_in - 8.0)]), motor), None, MotorLine()
    ).study
    assert [(each.motor, each.ci95["start"]) for each in study.starts] == [(0, (20.0, 24.0)), (1, (28.0, 32.0))]


def test_the_exact_intervals_of_slope_and_offset_hold_the_truth():
    """Of 1000 lines through 6 points, 95 % of the intervals, within four standard errors of that share."""
    rng, put_in = np.random.default_rng(0), np.linspace(20.0, 60.0, 6)
    held = np.zeros(2)
    for _ in range(1000):
        speed = (put_in - 14.0) / SLOPE + rng.standard_normal(6)
        for k, (name, true) in enumerate(zip(line_of_speed(put_in, speed), (SLOPE, 14.0), strict=True)):
            held[k] += name[1][0] <= true <= name[1][1]
    assert held / 1000.0 == pytest.approx([0.95, 0.95], abs=0.028)


def test_a_line_without_a_slope_has_no_end():
    rng = np.random.default_rng(1)
    (_, slope), (_, offset) = line_of_speed(np.linspace(20.0, 21.0, 4), 5.0 + rng.standard_normal(4))
    assert slope == offset == (-np.inf, np.inf)


def test_a_table_at_rest_and_one_of_whole_logs_are_refused():
    with pytest.raises(InsufficientDataError, match=r"no row tells how the motors answer; got 3 rows at rest"):
        identify(table([0.0, 10.0, 12.0], [0.0, 0.0, 0.0]), None, MotorLine())
    with pytest.raises(InputError, match=r"a table input,speed holds the lines of motors, without time"):
        identify(table([0.0, 10.0], [0.0, 1.0]), None, MotorFit())
