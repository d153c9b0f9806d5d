"""Dead zone and motion are the same question: `moves` and `breakaway_voltage` against `simulate`."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, moving_axes
from omnidyn.model.dynamics import drive_wrench
from omnidyn.simulation.simulate import simulate
from tests.support.strategies import any_robot, volts

EDGE = 1e-12


@given(any_robot(), st.data())
def test_what_moves_is_what_does_not_stay_at_rest(robot, data):
    rows = np.array([data.draw(volts(robot.wheels.count, limit)) for limit in (0.1, 0.5, 1.0, 6.0)])
    wrench = drive_wrench(robot, np.zeros((4, 3)), rows)
    assume((np.abs(np.abs(wrench) - robot.friction.axes.levels[2]) > EDGE).all())
    for row, expected in zip(rows, moving_axes(robot, rows), strict=True):
        run = simulate(robot, np.tile(row, (3, 1)), [1e-6, 1e-3, 0.1])
        assert ((run.twist[1:] != 0.0) == expected).all()
        assert (run.pose[3] != 0.0).any() == expected.any()


@given(any_robot(), st.data())
def test_just_below_and_just_above_the_breakaway_voltage(robot, data):
    """0.999 of it: bitwise at rest after a minute; 1.001 of it: moving after a microsecond."""
    pattern = np.array(data.draw(volts(robot.wheels.count)))
    for row in (pattern, *axis_patterns(robot)):
        scale = breakaway_voltage(robot, row)
        if scale == np.inf or np.abs(scale * row).max() > 5.9:
            continue
        below, above = (simulate(robot, [factor * scale * row], dt) for factor, dt in ((0.999, 60.0), (1.001, 1e-6)))
        assert (below.twist == 0.0).all()
        assert (below.pose == 0.0).all()
        assert (above.twist[1] != 0.0).any()


@given(any_robot())
def test_a_moving_robot_comes_to_rest_inside_the_dead_zone_and_a_stuck_one_breaks_out_of_it(robot):
    """Between coulomb and breakaway both are steady: sliding on, and standing. Outside there is only one answer."""
    pattern = axis_patterns(robot)[0]
    _, coulomb, breakaway = (level[0] for level in robot.friction.axes.levels)
    assume(breakaway > 1.02 * coulomb)
    scale = breakaway_voltage(robot, pattern) * (coulomb + breakaway) / (2 * breakaway)
    assume(np.abs(scale * pattern).max() < 5.9)
    held = np.tile(scale * pattern, (50, 1))
    standing, sliding = simulate(robot, held, 0.1), simulate(robot, held, 0.1, twist=(0.2, 0.0, 0.0))
    assert (standing.twist == 0.0).all()
    assert sliding.twist[-1, 0] > 0.0
    less = simulate(robot, held * 0.98 * coulomb * 2 / (coulomb + breakaway), 0.1, twist=(0.2, 0.0, 0.0))
    assert less.twist[-1, 0] == 0.0
