"""Position, angles of the wheels and a tilted floor in the march, against simulate, which knows nothing of it."""

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.model.dynamics import state_space
from omnidyn.model.keys import Key
from omnidyn.model.log_effects import LogEffects
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.march_cases import FACING, ROBOT_KEYS, a_case, truth

OUTPUTS = ("heading", "position", "wheel_angle")
LATE = {"latency.heading": 0.0137, "latency.position": 0.0071, "latency.wheel_angle": 0.0113}
PUSH = {"push.x": 0.31, "push.y": -0.22, "push.yaw": 0.013}
TILT = {"tilt.x": 0.81, "tilt.y": -0.52}


def problem_of(robot, voltage, dt, values, nuisances=(), free=ROBOT_KEYS):
    t = np.concatenate([[0.0], np.cumsum(dt)])
    count = robot.wheels.count
    pose = np.column_stack([values[:, 1:3], values[:, :1]])
    run = Run(t=t, voltage=np.vstack([voltage, voltage[-1:]]), pose=pose, wheel_angle=values[:, 3 : 3 + count])
    given = OutputError(free=free, nuisances=nuisances, start="free", outputs=OUTPUTS, tick_rad=0.0)
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
        well, many = share_within(
            slopes[np.ix_(rows, at, [problem.where(name)])][..., 0], (sides[0] - sides[1]) / 2e-6, 1e-7
        )
        assert well >= 0.99 * many, name


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_constant_force_is_that_of_volts_that_push_as_hard(seed):
    """Force is linear in volts: simulate under the volts that make up for the push."""
    robot, _, voltage, dt, start = a_case(seed)
    robot = robot.replace(motor=robot.motor.replace(voltage_limit=100.0))

    def pushed(robot, force):
        mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
        volts = np.linalg.lstsq(state_space(robot).B, force / mass, rcond=None)[0]
        return truth(robot, voltage + volts, dt, start)

    force = np.array(list(PUSH.values()))
    expected = pushed(robot, force)
    problem = problem_of(robot, voltage, dt, expected, nuisances=("push",))
    ((outputs, slopes),) = ExactEngine(problem).outputs(at_truth(problem, start, PUSH))
    np.testing.assert_allclose(outputs, expected, atol=1e-10 * np.abs(expected).max())
    good, total = 0, 0
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        sides = [pushed(robot, force + sign * step) for sign in (1.0, -1.0)]
        well, many = share_within(slopes[:, :, len(ROBOT_KEYS) + axis], (sides[0] - sides[1]) / 2e-6)
        good, total = good + well, total + many
    for key in ("body.mass_kg", "body.inertia_kg_m2"):
        step = 1e-6 * Key.parse(key).get(robot)
        sides = [
            pushed(Key.parse(key).set(robot, Key.parse(key).get(robot) + sign * step), force) for sign in (1.0, -1.0)
        ]
        at = slopes[:, :, ROBOT_KEYS.index(key)]
        well, many = share_within(at, (sides[0] - sides[1]) / (2.0 * step))
        good, total = good + well, total + many
    assert good >= 0.99 * total


def on_a_slope(robot, voltage, dt, start, fine=1):
    """What simulate says of a robot that faces FACING at first and is pulled by TILT."""
    log = LogEffects(tilt=tuple(TILT.values()))
    many, short = np.repeat(voltage, fine, axis=0), np.repeat(dt / fine, fine)
    run = simulate(robot, many, short, twist=start, pose=(0.0, 0.0, FACING), log=log, tol=1e-9)
    return run.pose[::fine], run.twist[::fine]


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_force_in_the_room_is_that_of_the_implicit_engine(seed):
    """The engine of a fit turns it once a row: to second order in the row what `simulate` does exactly."""
    robot, _, voltage, dt, start = a_case(seed)
    start[2] += 2.0
    off = []
    for parts in (1, 2, 4):
        volts, steps = np.repeat(voltage, parts, axis=0), np.repeat(dt / parts, parts)
        pose, _ = on_a_slope(robot, volts, steps, start)
        values = np.column_stack([pose[:, 2], pose[:, :2], np.zeros((len(pose), robot.wheels.count))])
        problem = problem_of(robot, volts, steps, values, nuisances=("tilt",))
        ((outputs, _),) = ExactEngine(problem).outputs(at_truth(problem, start, TILT))
        off.append(np.abs(outputs[:, :3] - values[:, :3]).max())
    level, _ = simulate_level(robot, voltage, dt, start)
    assert np.abs(level - on_a_slope(robot, voltage, dt, start)[0]).max() > 1e3 * off[0]
    assert off[2] < off[0] / 4.0


def simulate_level(robot, voltage, dt, start):
    run = simulate(robot, voltage, dt, twist=start, pose=(0.0, 0.0, FACING))
    return run.pose, run.twist


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_the_slopes_by_a_force_in_the_room_are_those_of_differences(seed):
    """By the force, by numbers of the robot, by the start and by the heading at first, which all turn the force."""
    robot, _, voltage, dt, start = a_case(seed)
    start[2] += 2.0
    problem = problem_of(robot, voltage, dt, truth(robot, voltage, dt, start), nuisances=("tilt",))
    point = at_truth(problem, start, TILT)
    engine = ExactEngine(problem)
    ((_, slopes),) = engine.outputs(point)
    count = len(point.values)
    good, total = 0, 0
    for k in range(slopes.shape[2]):
        if k < count:
            size = 1e-5 * max(abs(point.values[k]), 1e-3)
            moved = [Point(point.values + side * size * np.eye(count)[k], point.states) for side in (1.0, -1.0)]
        else:
            if not problem.pieces[0].free[k - count]:
                continue
            size, state = 1e-6, point.states[0]
            moved = [
                Point(point.values, (state + side * size * np.eye(len(state))[k - count],)) for side in (1.0, -1.0)
            ]
        up, down = (engine.outputs(each)[0][0] for each in moved)
        well, many = share_within(slopes[:, :, k], (up - down) / (2.0 * size), 1e-5)
        good, total = good + well, total + many
    print(good / total)
    assert good >= 0.99 * total
