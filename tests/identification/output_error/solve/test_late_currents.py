"""Where the fit of late currents begins, by a simulator that shares no code with omnidyn.

A current answers its voltage at once: its likelihood jumps wherever a latency passes a row, which no descent crosses.
"""

import numpy as np
import pytest

from benchmarks.identification.ordinary import initial
from benchmarks.identification.ordinary_robots import Robot
from benchmarks.ten_robots.robots import Sensors
from benchmarks.ten_robots.world import World, currents, drive
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

RATE, SECONDS, COUNT, AMPERES = 100, 16.0, 2.0 * np.pi / 360.0, 0.005
WORLD = World(
    azimuth=(2.0, 112.0, 234.0),
    wheel_radius=(0.067,) * 3,
    robot_radius=(0.105,) * 3,
    mass=2.02,
    inertia=0.0122,
    resistance=33.8,
    torque_constant=0.0138,
    gear_ratio=64.0,
    voltage_limit=24.0,
    coulomb=(2.12, 2.99, 0.164),
    viscous=(0.756, 0.756, 0.011),
)


@pytest.fixture(scope="module")
def guessed(tmp_path_factory):
    """What `init` guesses of a robot of this size."""
    file = tmp_path_factory.mktemp("late") / "late.toml"
    initial(Robot("late", "", WORLD, Sensors()), file)
    return load_robot(file)


def late_log(rows, seed):
    """Counts of wheels and currents under random volts, so many rows late."""
    rng, commands = np.random.default_rng(seed), [np.zeros((RATE, 3))]
    while sum(map(len, commands)) < SECONDS * RATE:
        volts = WORLD.voltage_limit * rng.uniform(-1.0, 1.0, 3)
        commands.append(np.tile(volts, (round(rng.uniform(0.15, 1.6) * RATE), 1)))
    volts = np.concatenate(commands)[: round(SECONDS * RATE)]
    acting = np.concatenate([np.zeros((rows, 3)), volts[: len(volts) - rows]])
    motion = drive(WORLD, acting, 1.0 / RATE)
    angles = np.floor(motion.path[:-1] @ WORLD.G / np.array(WORLD.wheel_radius) / COUNT) * COUNT
    amperes = currents(WORLD, motion.twist[:-1], acting) + AMPERES * rng.normal(size=acting.shape)
    t = np.arange(len(volts)) / RATE
    return Run(t=t, voltage=volts, wheel_angle=angles, current=amperes, source="late")


@pytest.mark.parametrize(("rows", "seed"), [(6, 2), (12, 0), (3, 3)])
@pytest.mark.some(1)
def test_late_currents_lead_no_fit_astray(guessed, rows, seed):
    solution = Fit.of([late_log(rows, seed)], guessed, OutputError()).solve()
    found = dict(zip(solution.solver.problem.names, solution.state.point.values.tolist(), strict=True))
    for channel in ("current", "wheel_angle"):
        assert found[f"latency.{channel}"] == pytest.approx(rows / RATE, abs=5e-3), channel
    assert found["motor.resistance_ohm"] == pytest.approx(WORLD.resistance, rel=0.02)
    for name, true in zip(("coulomb[0]", "coulomb[1]", "yaw_coulomb"), WORLD.coulomb, strict=True):
        assert found[f"friction.direction.{name}"] == pytest.approx(true, rel=0.02), name
