"""The dead zone against the numbers that follow from Table 3 (EVIDENCE.md, section 1; Fig. 5)."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, moving_axes
from omnidyn.model.first_guess import even_azimuths, first_guess
from omnidyn.model.wheels import Wheels


def test_patterns_drive_one_axis_each(axebot):
    np.testing.assert_allclose(axis_patterns(axebot), [[0, 1, -1], [-1, 0.5, 0.5], [1, 1, 1]], atol=1e-15)
    assert axis_patterns(axebot)[0, 0] == 0.0


def test_breakaway_voltages_of_table_3(axebot):
    """By hand: 2.2 N / (sqrt(3) g), 1.5 N / (1.5 g), 0.099 N m / (3 b g) with g = l K_t/(R r) N/V."""
    per_volt = 19 * 0.0059 / (1.69 * 0.035)
    by_hand = [2.2 / (np.sqrt(3) * per_volt), 1.5 / (1.5 * per_volt), 0.099 / (0.3 * per_volt)]
    found = breakaway_voltage(axebot, axis_patterns(axebot))
    np.testing.assert_allclose(found, by_hand, rtol=1e-14)
    assert found.round(3).tolist() == [0.670, 0.528, 0.174]


def test_the_first_axis_decides(axebot):
    """u = s (0, 2, -2) moves at s = 0.335 V; one motor alone turns the robot long before it drives it."""
    assert breakaway_voltage(axebot, [0.0, 2.0, -2.0]) == pytest.approx(0.670 / 2, abs=3e-4)
    per_volt = 19 * 0.0059 / (1.69 * 0.035)
    assert breakaway_voltage(axebot, [1.0, 0.0, 0.0]) == pytest.approx(0.099 / (0.1 * per_volt), rel=1e-14)
    assert breakaway_voltage(axebot, [0.0, 0.0, 0.0]) == np.inf
    assert breakaway_voltage(axebot, [[0.0, 1.0, -1.0], [0.0, -1.0, 1.0]]).tolist() == pytest.approx(
        [0.670, 0.670], abs=5e-4
    )


def test_breakaway_counts_not_coulomb(axebot):
    sticky = axebot.replace(
        friction=axebot.friction.replace(axes=axebot.friction.axes.replace(breakaway=(3.3, 2.25, 0.198)))
    )
    ratio = breakaway_voltage(sticky, axis_patterns(sticky)) / breakaway_voltage(axebot, axis_patterns(axebot))
    np.testing.assert_allclose(ratio, [1.5, 1.5, 2.0], rtol=1e-14)


def test_moves_tells_the_axes(axebot):
    volts = [[0.0, 0.66, -0.66], [0.0, 0.68, -0.68], [0.54, -0.27, -0.27], [0.18, 0.18, 0.18], [0.0, 0.0, 0.0]]
    assert moving_axes(axebot, volts).tolist() == [
        [False, False, False],
        [True, False, False],
        [False, True, False],
        [False, False, True],
        [False, False, False],
    ]


@pytest.mark.parametrize("pattern", [1.0, [1.0, 1.0], np.ones((3, 2))])
def test_a_pattern_of_the_wrong_length(axebot, pattern):
    with pytest.raises(InputError, match=r"wrong voltage pattern.*one entry per wheel \(3\)"):
        breakaway_voltage(axebot, pattern)


@pytest.mark.parametrize("count", [3, 4, 5, 7, 8])
def test_a_push_along_one_axis_moves_no_other(count):
    """By rounding, the pattern of y pushes along x too, 1e-16 as hard."""
    wheels = Wheels(azimuth_deg=even_azimuths(count), wheel_radius=0.03, robot_radius=0.1)
    robot = first_guess("even", wheels, 2.0, None, "direction")
    for pattern, alone in zip(axis_patterns(robot), np.eye(3, dtype=bool), strict=True):
        scale = breakaway_voltage(robot, pattern)
        assert (moving_axes(robot, 2.0 * scale * pattern) == alone).all()
        assert (moving_axes(robot, (1.0 + 1e-9) * scale * pattern) == alone).all()
        assert not moving_axes(robot, (1.0 - 1e-9) * scale * pattern).any()
