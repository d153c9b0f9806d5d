"""Voltages that are seen to have driven a robot: never below the dead band of the world that made the log."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import AR, COUNTS, SPEEDS, TICKS, TWIST, Case, Setup, logged, robot_of
from benchmarks.wrong_worlds.world import World
from omnidyn.identification.output_error.problem.driven import least_that_drove
from omnidyn.identification.output_error.problem.nuisances import nuisance_parameters
from omnidyn.identification.output_error.problem.record import record
from omnidyn.model.drive import Drive
from tests.support import real_logs as real


@pytest.mark.parametrize("sensor", [SPEEDS, TWIST, AR, COUNTS, TICKS])
@pytest.mark.parametrize("dead", [0.4, 3.0])
def test_no_voltage_within_the_dead_band_is_seen_to_drive(sensor, dead):
    robot = robot_of(World())
    setup = Setup(latency=0.02, sensor=sensor, memory=0.8 if sensor == AR else 0.0)
    for seed in (951, 953):
        log = logged(Case(World(dead=dead), World(), setup), seed)
        seen = least_that_drove([record(log, robot)], robot)
        assert dead < seen < 0.75 * np.abs(log.voltage).max()


def test_noise_drives_nothing():
    robot, still = robot_of(World()), logged(Case(World(dead=100.0), World()), 951)
    assert least_that_drove([record(still, robot)], robot) == np.inf


def test_a_dead_band_is_sought_below_what_turned_a_motor():
    """Stairs of PWM of a real robot, from 10 % of 22.2 V on, at which its wheels turned."""
    data = real.folder()
    if not (data / "udea_three_omni").is_dir():
        pytest.skip(f"no real logs in {data}")
    robot = real.udea_turning(data)[0].replace(drive=Drive(kind="duty", supply=22.2))
    robot = robot.replace(motor=robot.motor.replace(voltage_limit=22.2))
    (dead,) = nuisance_parameters(["dead_band"], [record(real.udea_stairs(data)[0], robot)], robot)
    assert dead.high == pytest.approx(2.22)
