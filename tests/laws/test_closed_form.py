"""`simulate` against closed forms of whole runs, and against itself with the steps cut otherwise."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from omnidyn.model.dynamics import state_space
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.strategies import any_robot, volts

AXEBOT = load_robot("axebot")
RATE = [-float(a) for a in np.diag(state_space(AXEBOT).A)]


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 0.05, 1.0])
def test_a_run_up_along_x(dt):
    """u = (0, 3, -3) V: v = w (1 - e^(-a t)), x = w t - v/a, w = (g - c)/a, in 30 digits from Table 3."""
    n = round(2.0 / dt)
    run = simulate(AXEBOT, np.tile([0.0, 3.0, -3.0], (n, 1)), dt)
    with mp.workdps(30):
        ratio, k, resistance, r = (mp.mpf(x) for x in (19.0, 0.0059, 1.69, 0.035))
        a = (mp.mpf(3) / 2 * (ratio * k) ** 2 / (resistance * r**2) + mp.mpf(0.94)) / mp.mpf(1.5)
        w = (mp.sqrt(3) * 3 * ratio * k / (resistance * r) - mp.mpf(2.2)) / mp.mpf(1.5) / a
        samples = range(0, n + 1, max(1, n // 200))
        times = [mp.mpf(dt) * i for i in samples]
        speed = np.array([float(w * (1 - mp.exp(-a * t))) for t in times])
        path = np.array([float(w * t - w * (1 - mp.exp(-a * t)) / a) for t in times])
    np.testing.assert_allclose(run.twist[samples, 0], speed, rtol=0, atol=4e-15)
    np.testing.assert_allclose(run.pose[samples, 0], path, rtol=0, atol=1e-13)
    assert (run.twist[:, 1:] == 0.0).all()
    assert (run.pose[:, 1:] == 0.0).all()
    np.testing.assert_allclose(run.wheel_speed[samples, 1], np.sqrt(3) / 2 * speed / 0.035, rtol=1e-13, atol=1e-13)
    current = (3.0 - 19 * 0.0059 * np.sqrt(3) / 2 * speed / 0.035) / 1.69
    np.testing.assert_allclose(run.current[samples], np.stack([0 * current, current, -current], axis=1), atol=1e-13)


@pytest.mark.parametrize("dt", [1e-3, 0.02, 0.3])
@pytest.mark.parametrize(
    "axis, start, coulomb, mass", [(0, 0.8, 2.2, 1.5), (1, -1.1, 1.5, 1.5), (2, 9.0, 0.099, 0.025)]
)
def test_coasting_to_rest(dt, axis, start, coulomb, mass):
    """Without voltage it stops at t* = log(1 + a v/c)/a after the path v/a - c/a^2 log(1 + a v/c), and stands."""
    a, c = RATE[axis], coulomb / mass
    stop = np.log1p(a * abs(start) / c) / a
    path = np.sign(start) * (abs(start) / a - c / a**2 * np.log1p(a * abs(start) / c))
    run = simulate(AXEBOT, np.zeros((round(3.0 / dt), 3)), dt, twist=start * np.eye(3)[axis])
    assert ((run.twist[:, axis] == 0.0) == (run.t >= stop)).all()
    assert run.pose[-1, axis] == pytest.approx(path, rel=1e-13)
    assert (run.pose[run.t >= stop, axis] == run.pose[-1, axis]).all()


def test_a_steady_circle():
    """Held at its steady twist, the robot drives a circle of radius |v|/omega; one turn brings it back."""
    system = state_space(AXEBOT)
    volts_ = np.array([1.0, 4.0, -1.0])
    twist = np.linalg.solve(-system.A, system.B @ volts_ + system.K @ [1.0, 0.0, 1.0])
    twist[1] = 0.0
    omega, radius = twist[2], twist[0] / twist[2]
    assert np.abs(system.B[1] @ volts_) < 1.0  # y stays at rest
    turn = 2 * np.pi / omega
    run = simulate(AXEBOT, np.tile(volts_, (64, 1)), turn / 64, twist=twist)
    angle = omega * run.t
    circle = np.stack([radius * np.sin(angle), radius * (1 - np.cos(angle)), angle], axis=1)
    np.testing.assert_allclose(run.pose, circle, atol=2e-14)
    np.testing.assert_allclose(run.twist, np.tile(twist, (65, 1)), rtol=1e-14)


@given(any_robot(), st.data())
def test_how_the_time_is_cut_does_not_matter(robot, data):
    """A held voltage in one step, in equal steps and in uneven ones: the same end (unless breakaway is at its edge)."""
    rows = [data.draw(volts(robot.wheels.count)) for _ in range(3)]
    parts = data.draw(st.lists(st.floats(0.01, 1.0), min_size=2, max_size=8))
    whole = np.array([0.02, 0.07, 0.05])
    cut = np.outer(whole, np.array(parts) / sum(parts)).ravel()
    assume((cut > 1e-6).all())
    once = simulate(robot, rows, whole)
    ended = once.twist[1:]
    assume(not ((np.abs(ended) < 1e-9) & (ended != 0.0)).any())
    finely = simulate(robot, np.repeat(rows, len(parts), axis=0), cut)
    np.testing.assert_allclose(finely.t[:: len(parts)], once.t, atol=1e-15)
    np.testing.assert_allclose(finely.twist[:: len(parts)], once.twist, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(finely.pose[:: len(parts)], once.pose, rtol=1e-12, atol=1e-10)


@given(any_robot(), st.data(), st.floats(1e-4, 0.05))
def test_one_dt_is_a_list_of_equal_ones(robot, data, dt):
    """To the last bit, time included."""
    voltage = np.array([data.draw(volts(robot.wheels.count)) for _ in range(7)])
    assert simulate(robot, voltage, dt) == simulate(robot, voltage, np.full(7, dt))


@given(any_robot(), st.data())
def test_a_run_can_be_continued(robot, data):
    """Simulating the second half from the end of the first gives the same twist to the last bit."""
    voltage = np.repeat([data.draw(volts(robot.wheels.count)) for _ in range(4)], 10, axis=0)
    whole = simulate(robot, voltage, 5e-3)
    first = simulate(robot, voltage[:20], 5e-3)
    second = simulate(robot, voltage[20:], 5e-3, twist=first.twist[-1], pose=first.pose[-1])
    np.testing.assert_array_equal(np.concatenate([first.twist, second.twist[1:]]), whole.twist)
    np.testing.assert_allclose(np.concatenate([first.pose, second.pose[1:]]), whole.pose, atol=1e-15, rtol=1e-15)
