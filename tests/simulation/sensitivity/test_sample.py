"""Samples of a run between its rows, against runs that have a row there, and against differences of such runs."""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.sensitivity.late_sample import Direction, VoltageProgram, late_samples
from omnidyn.simulation.sensitivity.stage import EPS
from omnidyn.simulation.simulate import simulate

LATE = (0.0, 0.003, -0.004)
KEYS = ("body.mass_kg", "body.inertia_kg_m2", "friction.direction.coulomb[0]", "friction.direction.yaw_coulomb")


@pytest.fixture(scope="module")
def robot(axebot):
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    return axebot.replace(body=axebot.body.replace(rotating_frame=True), friction=Friction(direction=direction))


def program(rows):
    """Voltages that swing slowly: it moves all the time, nothing stops or reverses."""
    t = np.arange(rows) * 0.01
    return np.stack([4.0 + 0.5 * np.sin(5.0 * t), 1.0 + np.cos(3.0 * t), -3.0 + np.sin(4.0 * t)], axis=1)


def at(robot, voltage, dt, late, tol=1e-9):
    """(twist, heading) at t - late, by a run that has rows there. Shapes (rows + 1, 3), (rows + 1,)."""
    t = np.arange(len(voltage) + 1) * dt
    grid = np.unique(np.round(np.concatenate([t, (t - late)[(t - late > 0) & (t - late < t[-1])]]), 12))
    held = voltage[np.clip(np.searchsorted(t, grid[:-1] + 1e-9) - 1, 0, len(voltage) - 1)]
    run = simulate(robot, held, np.diff(grid), tol=tol)
    where = np.clip(np.searchsorted(grid, t - late - 1e-9), 0, len(grid) - 1)
    out = (t - late < -1e-9) | (t - late > t[-1] + 1e-9)
    twist, heading = run.twist[where], run.pose[where, 2]
    twist[out], heading[out] = np.nan, np.nan
    return twist, heading


def ways(robot):
    moved = lambda key, side: Key.parse(key).set(robot, Key.parse(key).get(robot) * (1.0 + side * EPS))  # noqa: E731
    return [Direction(key, moved(key, 1.0), moved(key, -1.0)) for key in KEYS]


def test_between_the_rows(robot):
    """Values, rates and derivatives at t - late; NaN outside the run."""
    voltage = program(120)
    seen, capped = late_samples(
        robot, VoltageProgram(np.arange(121) * 0.01, voltage, np.zeros(3)), ways(robot), LATE, 1e-7
    )
    assert capped == 0
    for own, late in zip(seen, LATE, strict=True):
        twist, heading = at(robot, voltage, 0.01, late)
        np.testing.assert_array_equal(np.isnan(own.twist), np.isnan(twist))
        np.testing.assert_allclose(own.twist, twist, atol=1e-6)  # ten times the tolerance in rad/s
        np.testing.assert_allclose(own.heading()[0][:, 0], heading, atol=1e-6)
        before, after = at(robot, voltage, 0.01, late + 1e-4)[0], at(robot, voltage, 0.01, late - 1e-4)[0]
        rate, known = (after - before) / 2e-4, slice(5, 115)
        if late:  # at a row the voltage changes, and the rate with it
            np.testing.assert_allclose(own.pace[known], rate[known], atol=2e-3 * np.nanmax(np.abs(rate[known])))
        for k, key in enumerate(KEYS):
            value, width = Key.parse(key).get(robot), 1e-4
            up, down = (at(Key.parse(key).set(robot, value * (1 + s * width)), voltage, 0.01, late) for s in (1, -1))
            for found, ends in ((own.dtwist[:, k], (up[0], down[0])), (own.dtravel[:, k, 0], (up[1], down[1]))):
                slope = (ends[0] - ends[1]) / (2.0 * width)
                size = np.nanmax(np.abs(slope), axis=0)
                assert (np.nanmax(np.abs(found - slope), axis=0) <= 2e-5 * np.max(size) + 1e-6).all(), key


def test_a_look_beyond_the_last_row_sees_its_voltage_hold_on(robot):
    """Of voltages that do, as of a run that has a row more; of a voltage less, there is nothing to see."""
    voltage, t = program(60), np.arange(60) * 0.01
    seen, _ = late_samples(robot, VoltageProgram(t, voltage, np.zeros(3)), ways(robot), (-0.004, 0.0), 1e-7)
    more = VoltageProgram(np.arange(61) * 0.01, voltage, np.zeros(3))
    longer, _ = late_samples(robot, more, ways(robot), (-0.004, 0.0), 1e-7)
    for own, more in zip(seen, longer, strict=True):
        assert np.isfinite(own.twist).all()
        np.testing.assert_allclose(own.twist, more.twist[:60], atol=1e-6)
        np.testing.assert_allclose(own.dtwist, more.dtwist[:60], atol=1e-5)
        np.testing.assert_array_equal(own.voltage, more.voltage[:60])
    shorter, _ = late_samples(robot, VoltageProgram(t, voltage[:-1], np.zeros(3)), [], (-0.004,), 1e-7)
    assert np.flatnonzero(np.isnan(shorter[0].twist[:, 0])).tolist() == [59]


def test_a_look_between_fixed_steps_is_of_second_order(robot):
    """Half the step, a quarter of the error: where the rows are, and between them."""
    errors = []
    for refine in (1, 2):
        voltage, dt = np.repeat(program(60), refine, axis=0), 0.01 / refine
        t = np.arange(len(voltage) + 1) * dt
        seen, _ = late_samples(robot, VoltageProgram(t, voltage, np.zeros(3)), [], (0.0, 0.37 * dt), None)
        own = [seen[0].twist[20 * refine :], seen[1].twist[20 * refine :]]
        true = [at(robot, voltage, dt, late)[0][20 * refine :] for late in (0.0, 0.37 * dt)]
        errors.append([np.abs(a - b).max() for a, b in zip(own, true, strict=True)])
    ratio = np.array(errors[0]) / np.array(errors[1])
    assert (ratio > 3.0).all(), errors
    assert errors[0][1] < 1.5 * errors[0][0], errors


def test_derivatives_stay_numbers_where_an_ellipse_rests_for_a_moment(robot):
    """A slow ramp through 0: at this tolerance the robot stops and is released within a step."""
    direction = DirectionFriction(
        coulomb=(2.20872993, 1.4954003), viscous=0.94363386, yaw_coulomb=0.09920503, yaw_viscous=0.00963314
    )
    slow = robot.replace(friction=Friction(direction=direction))
    ramp = np.arange(-10, 20)[:, None] * np.array([-0.17723524, 0.03305544, 0.0369125])
    found = derivatives(slow, ramp, 0.01, list(KEYS), tol=1e-4, twist=(0.0008046, -0.10423209, 0.2690644))
    assert np.isfinite(found.twist).all()
    assert (np.sign(found.run.twist[[0, -1], 1]) == [-1.0, 1.0]).all()


@pytest.mark.parametrize(("speed", "adaptive"), [(1e-3, True), (0.05, False)])
def test_a_row_that_would_be_cut_into_many_steps_is_run_within_a_tolerance(axebot, speed, adaptive):
    """Steps of one length must resolve the steepest fall everywhere; adaptive ones do where it is."""
    levels = {"coulomb": (2.2, 1.5, 0.099), "breakaway": (4.0, 3.0, 0.12), "viscous": (0.9, 0.9, 0.01)}
    falls = AxesFriction(stribeck_speed=(speed, speed, 10.0 * speed), **levels)
    robot, t, voltage = axebot.replace(friction=Friction(axes=falls)), np.arange(61) * 0.01, program(60)
    rough, fixed, fine = (
        late_samples(robot, VoltageProgram(t, voltage, np.zeros(3)), [], [0.0], tol)[0][0] for tol in (1e-3, None, 1e-6)
    )
    assert np.array_equal(rough.twist, fixed.twist) == adaptive
    np.testing.assert_allclose(fixed.twist, fine.twist, atol=1e-2)  # ten times 1e-3 in rad/s
