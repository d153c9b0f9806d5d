"""Who watches the reference: two arithmetics, two quadratures, printed numbers, a search for its event times."""

from decimal import Decimal, localcontext

import mpmath as mp
import numpy as np
import pytest

from tests.reference.make import EVERY, FILE, RATIOS, stored, table_3_truth
from tests.reference.reference import (
    DIGITS,
    axes_of,
    axis_history,
    decimal_numbers,
    displacements,
    mpmath_numbers,
    position_by_quadrature,
    reference,
    wrench_matrix,
)
from tests.support.robots import (
    TABLE_3,
    random_program,
    random_robot,
    random_steps,
    table_3_voltages,
    with_breakaway,
)


def test_the_axes_of_table_3():
    """Numbers of EVIDENCE.md, section 1, to their printed digits."""
    axes = axes_of(TABLE_3)
    assert [round(float(axis.rate), 4) for axis in axes] == [6.6967, 6.7100, 7.6840]
    assert [round(float(axis.coulomb), 4) for axis in axes] == [1.4667, 1.0, 3.96]
    gains = [[round(float(gain), 4) for gain in axis.gain] for axis in axes]
    assert gains == [[0.0, 1.0942, -1.0942], [-1.2635, 0.6317, 0.6317], [7.5807, 7.5807, 7.5807]]
    assert axes[0].gain[0] == 0


def test_the_wrench_matrix_keeps_power():
    """Twist from the printed (3), its sign put right, times G^T gives the rim speeds back."""
    with mp.workdps(40):
        inverse = mp.matrix([[0, 1, -1], [-2, 1, 1], [1, 1, 1]])
        for column in range(3):
            inverse[0, column] *= mp.sqrt(3) / 3
            inverse[1, column] *= mp.mpf(1) / 3
            inverse[2, column] /= 3 * mp.mpf(0.1)
        assert mp.mnorm(wrench_matrix(TABLE_3).T * inverse - mp.eye(3)) < mp.mpf(10) ** -38


@pytest.mark.parametrize("seed", [1, 2])
def test_decimal_and_mpmath_agree_to_45_digits(seed):
    p = random_robot(seed)
    voltage = random_program(seed, 150, len(p.azimuth_deg)).tolist()
    dt = random_steps(seed, 150).tolist()
    with localcontext() as context, mp.workdps(DIGITS):
        context.prec = DIGITS
        for axis in axes_of(p):
            one, other = (
                axis_history(axis, voltage, dt, 0.5, numbers) for numbers in (decimal_numbers, mpmath_numbers)
            )
            for a, b in ((one.speed, other.speed), (one.turned, other.turned)):
                assert max(abs(mp.mpf(str(x)) - y) for x, y in zip(a, b, strict=True)) < mp.mpf(10) ** -45
            assert [v == 0 for v in one.speed] == [v == 0 for v in other.speed]
            assert one.edges == other.edges == 0


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_stored_files_are_what_the_script_makes(ratio):
    """Twist, heading and rest to the last bit, position to the last bits of sine and cosine."""
    with np.load(FILE) as content:
        made = stored(table_3_truth(ratio), ratio)
        for name, values in made.items():
            np.testing.assert_allclose(content[name], values, rtol=0, atol=1e-15 if name.startswith("pose") else 0)
        np.testing.assert_array_equal(content[f"pose_{ratio}"][:, 2], made[f"pose_{ratio}"][:, 2])
        np.testing.assert_array_equal(content["millivolts"] / 1000.0, table_3_voltages())
        assert len(content[f"twist_{ratio}"]) == 10_000 // EVERY + 1


@pytest.mark.parametrize(
    "row, twist, h",
    [
        ((3.0, -1.0, 2.0), (0.0, 0.0, 0.0), 0.05),  # starts from rest
        ((-3.0, 4.0, 5.0), (0.05, 0.2, -1.5), 0.1),  # all axes reverse
        ((0.0, 0.1, -0.1), (0.4, -0.3, 5.0), 0.3),  # all axes stop
        ((6.0, 6.0, 6.0), (1.0, 1.0, 20.0), 0.5),  # many radians in one step
    ],
)
def test_displacement_against_adaptive_quadrature(row, twist, h):
    """16 Gauss nodes in double precision against mpmath's own quadrature in 30 digits."""
    p = with_breakaway(TABLE_3, 1.25)
    with localcontext() as context:
        context.prec = DIGITS
        axes = axes_of(p)
        histories = [axis_history(axis, [row], [h], v) for axis, v in zip(axes, twist, strict=True)]
    speeds = np.array([[float(v) for v in history.speed] for history in histories]).T
    got = displacements(histories, [float(axis.rate) for axis in axes], speeds, np.array([h]))[0]
    np.testing.assert_allclose(got, position_by_quadrature(p, row, h, twist), rtol=0, atol=1e-15 * (1 + 10 * h))


def test_the_event_is_where_a_search_finds_it():
    """Bisection on the textbook solution until v changes sign, then the second piece from rest: no logarithm."""
    with localcontext() as context:
        context.prec = DIGITS
        axis = axes_of(TABLE_3)[0]
        volts, v0, h = (0.0, -3.0, 3.0), 0.3, 0.2
        history = axis_history(axis, [volts], [h], v0)
        a, c = axis.rate, axis.coulomb
        g = sum(k * Decimal(u) for k, u in zip(axis.gain, volts, strict=True))
        w, low, high = (g - c) / a, Decimal(0), Decimal(h)
        for _ in range(150):
            middle = (low + high) / 2
            low, high = (middle, high) if w + (Decimal(v0) - w) * (-a * middle).exp() > 0 else (low, middle)
        assert 0.01 < float(low) < 0.19
        assert history.event[0] == float(low)
        end = (g + c) / a * (1 - (-a * (Decimal(h) - low)).exp())
        assert abs(history.speed[1] - end) < Decimal(10) ** -44
        assert history.after[0] == pytest.approx(float(g + c))


def test_decisions_at_an_edge_are_counted():
    """c < q <= S with a speed of 1e-13, and a drive a hair from breakaway: both could fall either way in a double."""
    p = with_breakaway(TABLE_3, 1.5)
    per_volt = 2 * 0.75**0.5 * 19 * 0.0059 / (1.69 * 0.035)
    between, edge = 1.2 * 2.2 / per_volt, 3.3 / per_volt
    assert reference(p, np.array([[0.0, between, -between]]), [1e-3]).edges == 0
    assert reference(p, np.array([[0.0, between, -between]]), [1e-3], (1e-13, 0.0, 0.0)).edges == 1
    assert reference(p, np.array([[0.0, edge, -edge]]), [1e-3]).edges == 1
    assert reference(p, np.array([[0.0, edge * (1 + 1e-9), -edge * (1 + 1e-9)]]), [1e-3]).edges == 0


def test_wheels_that_couple_the_axes_have_no_reference():
    skewed = type(TABLE_3)(**{**vars(TABLE_3), "azimuth_deg": (180.0, -60.0, 61.0)})
    with pytest.raises(ValueError, match="axis 0 is coupled"):
        axes_of(skewed)


def test_the_programme_exercises_all_branches():
    """10 s of Table 3: rest, sliding, stops inside steps, reversals inside steps, on every axis."""
    with localcontext() as context:
        context.prec = DIGITS
        voltage, dt = table_3_voltages(), [1e-3] * 10_000
        for axis in axes_of(with_breakaway(TABLE_3, 1.25)):
            history = axis_history(axis, voltage.tolist(), dt)
            events = history.event < 1e-3
            assert (events & (history.after == 0.0)).any()  # stops
            assert (events & (history.after != 0.0)).sum() >= 100  # reversals
            assert 0.1 < np.mean([v == 0 for v in history.speed]) < 0.4
