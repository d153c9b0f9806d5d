"""What gives way at once: membership in sums of friction sets, against linear programs and bounded least squares."""

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

from omnidyn.model.deadzone import breakaway_voltage, moving_axes
from omnidyn.model.dynamics import acceleration
from omnidyn.model.robot_file import load_robot
from tests.support.mixed_robots import random_robot


def sets(robot, voltage):
    """(wrench of the motors (3,), directions (k, 3), forward and backward levels (k, 2), ellipse or None) at rest.

    Put together from the robot alone: eq (10) and (11) at standstill, what a lossy gear takes from i either way.
    """
    n, m, f = robot.wheels.count, robot.motor, robot.friction

    def each(value):
        return np.broadcast_to(np.asarray(value, dtype=float), (n,))

    u = np.asarray(voltage, dtype=float)
    i = np.sign(u) * np.maximum(np.abs(u) - each(m.voltage_drop), 0.0) / each(m.resistance)
    if m.current_limit is not None:
        i = np.clip(i, -each(m.current_limit), each(m.current_limit))
    rim = each(m.gear_ratio) * each(m.torque_constant) / each(robot.wheels.wheel_radius) * i
    eta = each(m.gear_efficiency)
    forward = np.where(rim > 0, rim * eta, rim / eta)  # what drives a wheel that would turn forward
    backward = np.where(rim < 0, rim * eta, rim / eta)
    levels = np.array([forward - each(f.wheels.hold_forward), backward + each(f.wheels.hold_backward)]).T
    axes = np.array(f.axes.coulomb if f.axes.breakaway is None else f.axes.breakaway, dtype=float)
    yaw = f.direction.yaw_coulomb if f.direction.yaw_breakaway is None else f.direction.yaw_breakaway
    axes[2] += yaw
    directions = np.vstack([np.eye(3), robot.wheels.wrench_matrix.T])
    intervals = np.vstack([np.array([-axes, axes]).T, levels])
    hold = f.direction.coulomb if f.direction.breakaway is None else f.direction.breakaway
    return directions, intervals, np.array(hold) if max(hold) > 0 else None


def holds(robot, voltage):
    """(whether the forces at rest can balance, how clearly): 0 = sum of f_k d_k (+ ellipse), f_k in its interval."""
    directions, intervals, ellipse = sets(robot, voltage)
    unit = np.array([1.0, 1.0, np.sqrt(robot.body.mass / robot.body.inertia)])
    d = directions * unit
    low, width = intervals[:, 0], np.maximum(intervals[:, 1] - intervals[:, 0], 1e-12)
    if ellipse is None:  # the least worst axis by a linear program
        k = len(d)
        cost = np.r_[np.zeros(k), np.ones(6)]
        equal = np.hstack([d.T, np.eye(3), -np.eye(3)])
        bounds = [*zip(low, low + width, strict=True), *[(0.0, None)] * 6]
        left = linprog(cost, A_eq=equal, b_eq=np.zeros(3), bounds=bounds).fun
        return left < 1e-9, left
    scale = np.array([1.0 / ellipse[0], 1.0 / ellipse[1], 1e5])
    best = lsq_linear((d * scale).T * width, -low @ (d * scale), (0.0, 1.0), "bvls", tol=1e-14)
    left = (low + best.x * width) @ (d * scale)
    excess = np.hypot(*left[:2]) - 1.0
    return excess < 0.0 and abs(left[2]) < 1e-3, min(abs(excess), 1.0)


@pytest.mark.parametrize("seed", range(0, 40, 2))
@pytest.mark.some(6)
def test_what_holds_is_what_the_program_says(seed):
    """Voltages around the dead zone of 20 robots of every shape; a draw nearer than 1e-7 to an edge is not judged."""
    robot, random = random_robot(seed), np.random.default_rng(seed)
    judged = {True: 0, False: 0}
    for _ in range(30):
        row = random.normal(size=robot.wheels.count)
        level = breakaway_voltage(robot, row)
        row *= level * random.choice([0.3, 0.9, 0.999, 1.001, 1.1, 3.0]) if np.isfinite(level) else 1.0
        held, _ = holds(robot, row)
        assert moving_axes(robot, row).any() != held
        judged[held] += 1
    assert min(judged.values()) >= 5


@pytest.mark.parametrize("seed", range(0, 40, 2))
def test_the_edge_is_where_the_program_says(seed):
    """The breakaway voltage of random patterns, bisected on the program alone: to 1e-6 of it."""
    robot, random = random_robot(seed), np.random.default_rng(100 + seed)
    for _ in range(2):
        row = random.normal(size=robot.wheels.count)
        level = breakaway_voltage(robot, row)
        if not np.isfinite(level):
            assert holds(robot, 100.0 * row)[0]
            continue
        low, high = 0.5 * level, 2.0 * level
        assert holds(robot, low * row)[0]
        assert not holds(robot, high * row)[0]
        for _ in range(22):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(robot, middle * row)[0] else (low, middle)
        assert low == pytest.approx(level, rel=2e-6)


@pytest.mark.parametrize("seed", range(0, 40, 2))
def test_the_acceleration_of_what_gives_way_is_the_least(seed):
    """Breakaway = Coulomb: 1/2 a.M a - F.a + D(a) is least at the answer; no nearby acceleration is below it."""
    robot, random = random_robot(seed), np.random.default_rng(200 + seed)
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])

    def cost(a, d, intervals, ellipse):
        along = d @ a
        value = 0.5 * (mass * a) @ a - np.where(along > 0, intervals[:, 0] * along, intervals[:, 1] * along).sum()
        return value + (np.hypot(*(ellipse * a[:2])) if ellipse is not None else 0.0)

    for _ in range(5):
        row = random.uniform(-3.0, 3.0, robot.wheels.count)
        a = acceleration(robot, np.zeros(3), row)
        least = cost(a, *sets(robot, row))
        for scale in (1e-5, 1e-3, 0.1, 3.0):
            for change in scale * random.normal(size=(30, 3)) * [1.0, 1.0, 8.0]:
                assert cost(a + change, *sets(robot, row)) >= least - 1e-12 * (1.0 + abs(least))


def test_the_paper_holds_up_to_its_levels():
    """By hand: 2.2 N along x, 1.5 N along y, 0.099 N m about yaw of Table 3, one at a time."""
    robot = load_robot("axebot")
    per_volt = 19.0 * 0.0059 / (1.69 * 0.035)
    for pattern, level in (
        ([0.0, 1.0, -1.0], 2.2 / (np.sqrt(3.0) * per_volt)),
        ([-1.0, 0.5, 0.5], 1.5 / (1.5 * per_volt)),
        ([1.0, 1.0, 1.0], 0.099 / (0.3 * per_volt)),
    ):
        assert not moving_axes(robot, 0.9999 * level * np.array(pattern)).any()
        assert moving_axes(robot, 1.0001 * level * np.array(pattern)).sum() == 1
        assert holds(robot, 0.9999 * level * np.array(pattern))[0]
        assert not holds(robot, 1.0001 * level * np.array(pattern))[0]
