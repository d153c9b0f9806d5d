"""Laws of the exact step: halving, oddness, the closed forms it stands for. The formula is called as plain Python.

Independent source: the exponential and logarithm of the textbook solution, in mpmath, which the formula does without.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from omnidyn.simulation.exact.step import exact_step, pieces, speed_within, turned_within

POSITIVE = st.floats(1e-3, 30.0)


@st.composite
def steps(draw):
    """(speed, drive, coulomb, breakaway, rate, dt): all branches, the borders between them included."""
    coulomb = draw(st.floats(0.01, 10.0) | st.just(0.0))
    breakaway = coulomb * draw(st.just(1.0) | st.floats(1.0, 1.6))
    rate, dt = draw(POSITIVE), draw(st.floats(1e-5, 0.3) | st.floats(0.3, 30.0))
    edge = st.sampled_from([coulomb, -coulomb, breakaway, -breakaway, 0.0, -0.0])
    drive = draw(st.floats(-25.0, 25.0, allow_subnormal=False) | edge)
    speed = draw(st.floats(-5.0, 5.0, allow_subnormal=False) | st.sampled_from([0.0, -0.0, 1e-9, -1e-9]))
    return speed, drive, coulomb, breakaway, rate, dt


def phi_of(rate, dt):
    return -math.expm1(-rate * dt) / rate


def take(speed, drive, coulomb, breakaway, rate, dt):
    return exact_step(speed, drive, coulomb, breakaway, rate, phi_of(rate, dt), 0.0)


def textbook(speed, drive, coulomb, breakaway, rate, dt):
    """(speed after, turned, whether the outcome hangs on the last bits) from event to event, 40 digits."""
    with mp.workdps(40):
        v, g, c, held, a, h = map(mp.mpf, (speed, drive, coulomb, breakaway, rate, dt))
        if v == 0 and abs(g) <= held:
            return 0.0, 0.0, False
        s = mp.sign(v) or mp.sign(g)
        w = (g - s * c) / a
        end = w + (v - w) * mp.exp(-a * h)
        close = abs(end) < 1e-12 or (abs(v) < 1e-12 and v != 0)
        if s * end >= 0:
            return float(end), float(w * h + (v - end) / a), close
        t = mp.log1p(-v / w) / a
        turned = w * t + v / a
        if s * g >= -held:
            return 0.0, float(turned), close
        w2 = (g + s * c) / a
        end = w2 * (1 - mp.exp(-a * (h - t)))
        return float(end), float(turned + w2 * (h - t) - end / a), close


def scale(speed, drive, coulomb, breakaway, rate, dt):
    """The largest speed that can take part in the sums of a step."""
    return abs(speed) + (abs(drive) + coulomb) * phi_of(rate, dt)


@given(steps())
@example((1.0, -5.0, 1.0, 1.0, 2.0, 0.5))  # reverses
@example((1.0, -0.5, 1.0, 1.0, 2.0, 3.0))  # stops and stays
@example((1.0, -1.2, 1.0, 1.5, 2.0, 3.0))  # stops and stays, held by breakaway
@example((0.0, 1.2, 1.0, 1.5, 2.0, 3.0))  # held at rest
@example((0.0, 1.6, 1.0, 1.5, 2.0, 3.0))  # breaks away
def test_a_step_is_the_textbook_solution(step):
    end, _, close = textbook(*step)
    got = take(*step)
    if close:
        return
    assert got == pytest.approx(end, abs=1e-14 * scale(*step), rel=1e-14)
    assert (got == 0.0) == (end == 0.0)


@given(steps(), st.floats(0.0, 1.0))
def test_the_path_within_a_step(step, part):
    """Speed and angle turned at any time inside a step are those of a shorter step."""
    speed, drive, coulomb, breakaway, rate, dt = step
    event, before, after = pieces(speed, drive, coulomb, breakaway, rate, phi_of(rate, dt), dt)
    t = part * dt
    end, turned, close = textbook(speed, drive, coulomb, breakaway, rate, t)
    if close or textbook(*step)[2]:
        return
    size = scale(*step)
    now = speed_within(t, speed, event, before, after, rate)
    assert now == pytest.approx(end, abs=1e-13 * size, rel=1e-13)
    assert turned_within(t, speed, now, event, before, after, rate) == pytest.approx(
        turned, abs=1e-13 * size * max(dt, 1 / rate)
    )
    assert 0.0 <= event <= dt


@given(steps())
def test_two_half_steps_are_one_step(step):
    speed, drive, coulomb, breakaway, rate, dt = step
    half = take(speed, drive, coulomb, breakaway, rate, dt / 2)
    twice, once = take(half, drive, coulomb, breakaway, rate, dt / 2), take(*step)
    if textbook(*step)[2] or 0.0 < abs(half) < 1e-12:
        return
    assert twice == pytest.approx(once, abs=1e-14 * scale(*step), rel=1e-13)
    assert (twice == 0.0) == (once == 0.0)


@given(steps())
def test_it_is_odd_to_the_last_bit(step):
    speed, drive, *rest = step
    assert take(-speed, -drive, *rest) == -take(speed, drive, *rest)


@given(steps())
def test_rest_is_kept_up_to_breakaway_and_no_further(step):
    _, drive, coulomb, breakaway, rate, dt = step
    end = take(0.0, drive, coulomb, breakaway, rate, dt)
    assert (end == 0.0) == (abs(drive) <= breakaway)
    assert end * drive >= 0.0


@given(steps())
def test_a_sliding_axis_stays_between_where_it_is_and_where_it_tends(step):
    """|v| never exceeds both its start and the steady speed; without drive it never grows."""
    speed, drive, coulomb, _, rate, _ = step
    end = take(*step)
    steady = max(abs(drive) - coulomb, 0.0) / rate
    assert abs(end) <= max(abs(speed), steady) * (1 + 1e-15)
    assert math.isfinite(end)


@given(steps(), POSITIVE)
def test_scaling_speeds_and_forces_scales_the_answer(step, factor):
    """The law is homogeneous: a power of two changes no bit."""
    speed, drive, coulomb, breakaway, rate, dt = step
    factor = 2.0 ** math.floor(math.log2(factor))
    grown = take(factor * speed, factor * drive, factor * coulomb, factor * breakaway, rate, dt)
    phi = phi_of(rate, dt)
    divisor_is_scaled = coulomb + breakaway + phi > 0.0
    assert divisor_is_scaled
    assert grown == factor * take(*step)


def test_no_argument_makes_it_divide_by_zero():
    """The corners: q = c, where the divisor of the reversal vanishes, with steps so long that e^(-a h) is rounding."""
    for rate in np.geomspace(0.3, 900.0, 60):
        for dt in (1e-3, 1.0, 40.0, 1e3):
            for speed in (0.0, 1e-12, 0.3, 7.0):
                for drive in (1.0, -1.0, 0.0, 1.5, -1.5, np.nextafter(1.0, 0.0)):
                    for breakaway in (1.0, 1.5):
                        step = (speed, drive, 1.0, breakaway, float(rate), dt)
                        assert math.isfinite(take(*step))
                        assert all(map(math.isfinite, pieces(*step[:5], phi_of(rate, dt), dt)))
