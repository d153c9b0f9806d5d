"""A speed loop whose channels have clocks of their own: odometry slower than the speeds of the wheels."""

import numba
import numpy as np
import pytest

from omnidyn import Run, load_robot, read_log
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.begin import begun
from omnidyn.identification.output_error.moved_axes import motion
from omnidyn.identification.output_error.prepare import read_records
from omnidyn.identification.output_error.solve.loop import loop_pieces
from omnidyn.model.first_guess import first_guess
from omnidyn.model.wheels import Wheels
from tests.support.cases import case

AZIMUTH, ARM, RADIUS, MASS, INERTIA = (45.0, 135.0, -135.0, -45.0), 0.2, 0.05, 9.0, 0.18
OHM, PUSH, LIMIT, GAINS = 4.0, 0.043 * 18.0, 22.0, (0.9, 6.0, 500.0)
LEVEL, VISCOUS = 3.0, np.array([1.0, 1.0, 0.05])
STEP, ROW, SWEEPS = 2e-4, 0.01, 60


@numba.njit(cache=True)
def march(command, g, level, mass, give, steps, ticks):
    """The twist at each row of a robot with friction at its wheels behind a PI loop; projected Gauss-Seidel."""
    rows, wheels, arms = len(command), g.shape[1], np.ascontiguousarray(g.T)
    v, held, gathered, volts = np.zeros(3), np.zeros(wheels), np.zeros(wheels), np.zeros(wheels)
    found = np.zeros((rows, 3))
    for k in range(rows):
        found[k] = v
        for s in range(steps):
            if (k * steps + s) % ticks == 0:
                error = arms @ (command[k] - v) / RADIUS
                for w in range(wheels):
                    more = gathered[w] + error[w] / GAINS[2]
                    asked = GAINS[0] * error[w] + GAINS[1] * more
                    gathered[w] = more if abs(asked) < LIMIT else gathered[w]
                    volts[w] = min(max(asked, -LIMIT), LIMIT)
            push = mass @ v / STEP + g @ (PUSH / (OHM * RADIUS) * volts - held)
            push[0] += MASS * v[2] * v[1]
            push[1] -= MASS * v[2] * v[0]
            v = give @ push
            for _ in range(SWEEPS):
                for w in range(wheels):
                    way = give @ arms[w]
                    new = min(max(held[w] + (arms[w] @ v) / (arms[w] @ way), -level), level)
                    v = v - way * (new - held[w])
                    held[w] = new
    return found


def drive(seconds=8.0, seed=0):
    """(commands, twist, speeds of the wheels) at 100 Hz, with noise; at rest for half a second."""
    rng, rows, row = np.random.default_rng(seed), round(seconds / ROW), 50
    command = np.zeros((rows, 3))
    while row < rows:
        end = row + int(rng.integers(40, 120))
        command[row:end] = rng.uniform(-1.0, 1.0, 3) * [0.5, 0.5, 2.0] * rng.choice([0, 1, 1], 3)
        row = end
    phi = np.radians(AZIMUTH)
    g = np.stack([-np.sin(phi), np.cos(phi), np.full(4, ARM)])
    mass = np.diag([MASS, MASS, INERTIA])
    stiff = mass / STEP + np.diag(VISCOUS) + PUSH**2 / (OHM * RADIUS**2) * g @ g.T
    steps, ticks = round(ROW / STEP), round(1.0 / (GAINS[2] * STEP))
    twist = march(command, g, LEVEL, mass, np.linalg.inv(stiff), steps, ticks)
    speed = twist @ g / RADIUS + rng.normal(0.0, 0.02, (rows, 4))
    return command, twist + rng.normal(0.0, 0.002, (rows, 3)) * [1.0, 1.0, 3.0], speed


@pytest.fixture(scope="module")
def driven():
    return drive()


@pytest.fixture(scope="module")
def robot():
    wheels = Wheels(azimuth_deg=AZIMUTH, robot_radius=ARM, wheel_radius=RADIUS)
    return first_guess("rosbot", wheels, MASS, LIMIT, speed_loop=GAINS)


def run_of(driven, every, first=0, moved=0, channels=("twist", "wheel_speed")):
    """A run whose odometry is there in each `every`-th row only."""
    command, twist, speed = (values[moved:] for values in driven)
    seen = np.full_like(twist, np.nan)
    seen[first::every] = twist[first::every]
    told = {"twist": seen, "wheel_speed": speed}
    return Run(np.arange(len(command)) * ROW, twist_command=command, **{name: told[name] for name in channels})


@pytest.mark.parametrize("every, first", [(1, 0), (2, 0), (2, 1), (5, 3), (10, 0), (10, 9)])
@pytest.mark.parametrize("channels", [("twist", "wheel_speed"), ("twist",)])
@pytest.mark.some(4)
def test_a_log_begins_at_rest_whatever_the_clock_of_its_odometry(driven, robot, every, first, channels):
    records = read_records([run_of(driven, every, first, channels=channels)], robot, OutputError())
    (piece,) = loop_pieces(records, robot, "auto")
    assert (piece.first, piece.last) == (0, len(driven[0]) - 1)


@pytest.mark.parametrize("every", [1, 2, 10])
def test_a_log_that_begins_in_motion_is_refused_all_the_same(driven, robot, every):
    moving = int(np.flatnonzero(np.abs(driven[1]).max(axis=1) > 0.2)[30])
    records = read_records([run_of(driven, every, moved=moving)], robot, OutputError())
    with pytest.raises(InsufficientDataError, match="no log begins at rest"):
        loop_pieces(records, robot, "auto")


def test_a_gyroscope_beside_wheel_speeds_is_a_log_too(driven, robot):
    run = run_of(driven, 2)
    twist = run.twist.copy()
    twist[:, :2] = np.nan
    whole = Run(run.t, twist_command=run.twist_command, wheel_speed=run.wheel_speed, twist=twist)
    records = read_records([whole], robot, OutputError())
    assert len(loop_pieces(records, robot, "auto")) == 1


def test_guesses_of_an_axis_that_rested_are_not_asked_for(driven, robot):
    """They have a spread, and were asked for although the robot never turned."""
    run = run_of(driven, 2)
    still = {name: getattr(run, name).copy() for name in ("twist", "twist_command", "wheel_speed")}
    still["twist_command"][:, 1:] = 0.0
    still["twist"][:, 1:] = 1e-3 * np.sin(np.arange(len(run)) * 1.7)[:, None] * np.isfinite(still["twist"][:, 1:])
    only_x = Run(run.t, twist_command=still["twist_command"], twist=still["twist"])
    records = read_records([only_x], robot, OutputError())
    assert motion(records, robot).moving_axes.tolist() == [True, False, False]
    free = begun("all", [only_x], robot, OutputError(), joint=False)[0].question.free
    assert not [key for key in free if key.startswith("friction.direction.yaw")]


@pytest.mark.long
def test_the_case_runs():
    robot = load_robot(case("logs/slow_odometry/rosbot.toml"))
    fit = identify([read_log(case("logs/slow_odometry/rest.csv"), robot)], robot, OutputError()).estimate
    assert not [key for key in fit.value if "yaw" in key]
    push = next(each for each in fit.combinations if each.name == "push.x")
    assert push.ci95[0] < push.value < push.ci95[1]
    assert fit.noise["wheel_speed[0]"] == pytest.approx(0.02, rel=0.1)


@pytest.mark.long
def test_friction_at_the_wheels_is_named_behind_a_loop(robot):
    """The file says that it acts along travel; the log is of wheels that each hold 3 N."""
    fit = identify([run_of(drive(20.0), 2)], robot).estimate
    lack = fit.lack_of_fit
    assert lack.found
    assert lack.remedies[0].key == "friction.wheels"
    assert lack.remedies[0].share > 0.7
    assert "friction at the wheels" in str(lack.statement())
