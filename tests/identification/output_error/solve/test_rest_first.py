"""Where the fit of a log begins that rests first: at its motion, by a simulator that shares no code with omnidyn."""

import numpy as np
import pytest

from benchmarks.identification.ordinary import initial
from benchmarks.identification.ordinary_robots import MECANUM, Robot
from benchmarks.ten_robots.robots import Sensors
from benchmarks.ten_robots.world import World, drive
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

RATE, REST, SECONDS = 200, 20.0, 20.0
LIGHT = World(
    **MECANUM,
    wheel_radius=(0.054,) * 4,
    robot_radius=(0.177,) * 4,
    mass=2.4,
    inertia=0.029,
    resistance=37.0,
    torque_constant=0.0813,
    gear_ratio=8.68,
    voltage_limit=12.0,
    coulomb=(0.7, 1.09, 0.0525),
    viscous=(0.3, 0.3, 0.0094),
)


def counted(world, rest):
    """Counts of wheels [rad] under short commands, behind a rest of so many seconds."""
    rng, commands = np.random.default_rng(6), [np.zeros((round(rest * RATE), 4))]
    while sum(map(len, commands)) < (rest + SECONDS) * RATE:
        rim = rng.normal(size=3) * [1.0, 1.0, 3.0] @ world.G
        volts = rim / np.abs(rim).max() * 0.85 * world.voltage_limit * rng.uniform(0.15, 1.0) * (rng.random() > 0.15)
        commands.append(np.tile(volts, (round(rng.uniform(0.2, 1.2) * RATE), 1)))
    volts = np.concatenate(commands)[: round((rest + SECONDS) * RATE)]
    count = 2.0 * np.pi / 4096
    path = drive(world, volts, 1.0 / RATE).path[:-1]
    angles = np.floor(path @ world.G / np.array(world.wheel_radius) / count) * count
    return Run(t=np.arange(len(volts)) / RATE, voltage=volts, wheel_angle=angles, source="rests first")


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """What `init` guesses of a robot of this size."""
    file = tmp_path_factory.mktemp("light") / "light.toml"
    initial(Robot("light", "", LIGHT, Sensors()), file)
    return load_robot(file)


@pytest.mark.parametrize("rest", [0.5, REST])
@pytest.mark.some(1)
def test_a_rest_first_is_no_place_to_begin(light, rest):
    """Friction along both axes and about yaw."""
    solution = Fit.of([counted(LIGHT, rest)], light, OutputError()).solve()
    found = dict(zip(solution.solver.problem.names, solution.state.point.values.tolist(), strict=True))
    for name, true in zip(("coulomb[0]", "coulomb[1]", "yaw_coulomb"), LIGHT.coulomb, strict=True):
        assert found[f"friction.direction.{name}"] == pytest.approx(true, rel=0.01), name
    assert abs(found["latency.wheel_angle"]) < 5e-4


@pytest.mark.parametrize("idle", [0.0, 0.02])
def test_rows_that_are_tried_first_are_driven_ones(light, idle):
    """Behind a rest with volts that are zero, or as a monitor of a battery shows them."""
    run = counted(LIGHT, REST)
    voltage = np.where(run.voltage.any(axis=1)[:, None], run.voltage, idle)
    problem = Fit.of([run.replace(voltage=voltage)], light, OutputError()).groups[0].problem()
    (piece,) = problem.shortened(1500, beyond_rest=True).pieces
    assert piece.rest_rows == pytest.approx(REST * RATE, abs=RATE)  # a command of zeros may be the first
    assert piece.last - piece.first == pytest.approx(piece.rest_rows + 1500, abs=1)
