"""Position, angles of the wheels and a tilted floor in the march, against simulate, which knows nothing of it."""

import numpy as np
import pytest

from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.fit import Options, make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.model.keys import Key
from omnidyn.model.statespace import state_space
from omnidyn.run import Run
from tests.support.march_cases import FACING, ROBOT_KEYS, a_case, truth

OUTPUTS = ("heading", "position", "wheel_angle")
LATE = {"latency.heading": 0.0137, "latency.position": 0.0071, "latency.wheel_angle": 0.0113}
TILT = {"tilt.x": 0.31, "tilt.y": -0.22, "tilt.yaw": 0.013}


def problem_of(robot, voltage, dt, values, nuisances=(), free=ROBOT_KEYS):
    t = np.concatenate([[0.0], np.cumsum(dt)])
    count = robot.wheels.count
    pose = np.column_stack([values[:, 1:3], values[:, :1]])
    run = Run(t=t, voltage=np.vstack([voltage, voltage[-1:]]), pose=pose, wheel_angle=values[:, 3 : 3 + count])
    given = Options(free=free, nuisances=nuisances, start="free", outputs=OUTPUTS, tick_rad=0.0)
    return make_problem(read_records([run], robot, given), robot, given)


def at_truth(problem, start, nuisances):
    values = problem.start().values.copy()
    for name, value in nuisances.items():
        values[problem.where(name)] = value
    offset = [FACING if name == "heading" else 0.0 for name, _ in problem.columns]
    return Point(values, (np.concatenate([start, offset]),))


def share_within(slopes, differences, tol=1e-6):
    """How many agree, of how many. 1e-9: what rounding makes of differences that are 0."""
    good = np.abs(slopes - differences) <= tol * np.abs(differences).max(axis=0) + 1e-9
    return int(good.sum()), good.size


@pytest.mark.parametrize("seed", range(6))
def test_outputs_and_slopes_are_those_of_whole_runs(seed):
    robot, _, voltage, dt, start = a_case(seed)
    start[2] += 4.0  # it turns
    expected = truth(robot, voltage, dt, start)
    problem = problem_of(robot, voltage, dt, expected)
    assert problem.columns[:3] == (("heading", 0), ("position", 0), ("position", 1))
    ((outputs, slopes),) = ExactEngine(problem).outputs(at_truth(problem, start, {}))
    np.testing.assert_allclose(outputs, expected, atol=1e-11 * np.abs(expected).max())
    good, total = 0, 0
    for j, key in enumerate(ROBOT_KEYS):
        step = 1e-6 * Key.parse(key).get(robot)
        sides = [
            truth(Key.parse(key).set(robot, Key.parse(key).get(robot) + sign * step), voltage, dt, start)
            for sign in (1.0, -1.0)
        ]
        well, many = share_within(slopes[:, :, j], (sides[0] - sides[1]) / (2.0 * step))
        good, total = good + well, total + many
    for axis in range(3):
        moved = 1e-6 * np.eye(3)[axis]
        sides = [truth(robot, voltage, dt, start + sign * moved) for sign in (1.0, -1.0)]
        well, many = share_within(slopes[:, :, len(ROBOT_KEYS) + axis], (sides[0] - sides[1]) / 2e-6)
        good, total = good + well, total + many
    sides = [truth(robot, voltage, dt, start, FACING + sign * 1e-6) for sign in (1.0, -1.0)]
    well, many = share_within(slopes[:, :3, len(ROBOT_KEYS) + 3], ((sides[0] - sides[1]) / 2e-6)[:, :3])
    assert well == many  # the heading at the start
    assert good >= 0.99 * total


@pytest.mark.parametrize("seed", range(6))
def test_each_channel_has_its_latency(seed):
    robot, _, voltage, dt, start = a_case(seed)
    start[2] += 4.0
    t = np.concatenate([[0.0], np.cumsum(dt)])
    problem = problem_of(robot, voltage, dt, truth(robot, voltage, dt, start), nuisances=("latency",))
    ((outputs, slopes),) = ExactEngine(problem).outputs(at_truth(problem, start, LATE))

    def seen(name, late):
        times = t - late
        grid = np.unique(np.concatenate([t, times[times > 0.0]]))
        fine = truth(robot, voltage[np.searchsorted(t, grid[:-1], side="right") - 1], np.diff(grid), start)
        rows = np.flatnonzero((times > 0.0) & (t > 0.4))
        at = [c for c, (channel, _) in enumerate(problem.columns) if f"latency.{channel}" == name]
        return rows, at, fine[np.searchsorted(grid, times[rows])][:, at]

    for name, late in LATE.items():
        rows, at, expected = seen(name, late)
        np.testing.assert_allclose(outputs[np.ix_(rows, at)], expected, atol=1e-10 * np.abs(expected).max())
        sides = [seen(name, late + sign * 1e-6)[2] for sign in (1.0, -1.0)]
        well, many = share_within(slopes[np.ix_(rows, at, [problem.where(name)])][..., 0],
                                  (sides[0] - sides[1]) / 2e-6, 1e-7)  # fmt: skip
        assert well >= 0.99 * many, name


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_constant_force_is_that_of_volts_that_push_as_hard(seed):
    """Force is linear in volts: simulate under the volts that make up for the tilt."""
    robot, _, voltage, dt, start = a_case(seed)
    robot = robot.replace(motor=robot.motor.replace(voltage_limit=100.0))

    def tilted(robot, force):
        mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
        volts = np.linalg.lstsq(state_space(robot).B, force / mass, rcond=None)[0]
        return truth(robot, voltage + volts, dt, start)

    force = np.array(list(TILT.values()))
    expected = tilted(robot, force)
    problem = problem_of(robot, voltage, dt, expected, nuisances=("tilt",))
    ((outputs, slopes),) = ExactEngine(problem).outputs(at_truth(problem, start, TILT))
    np.testing.assert_allclose(outputs, expected, atol=1e-10 * np.abs(expected).max())
    good, total = 0, 0
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        sides = [tilted(robot, force + sign * step) for sign in (1.0, -1.0)]
        well, many = share_within(slopes[:, :, len(ROBOT_KEYS) + axis], (sides[0] - sides[1]) / 2e-6)
        good, total = good + well, total + many
    for key in ("body.mass_kg", "body.inertia_kg_m2"):
        step = 1e-6 * Key.parse(key).get(robot)
        sides = [
            tilted(Key.parse(key).set(robot, Key.parse(key).get(robot) + sign * step), force) for sign in (1.0, -1.0)
        ]
        at = slopes[:, :, ROBOT_KEYS.index(key)]
        well, many = share_within(at, (sides[0] - sides[1]) / (2.0 * step))
        good, total = good + well, total + many
    assert good >= 0.99 * total
