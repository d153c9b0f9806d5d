"""Voltages that are seen to have driven a robot: never below the dead band of the world that made the log."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import AR, COUNTS, SPEEDS, TICKS, TWIST, Case, Setup, logged, robot_of
from benchmarks.wrong_worlds.world import World
from omnidyn.identification.output_error.problem.driving_voltages import least_that_drove
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


def test_wild_samples_drive_nothing():
    """2 % of the samples off by a metre a second, of a world whose dead band is 3 V."""
    robot, rng = robot_of(World()), np.random.default_rng(7)
    log = logged(Case(World(dead=3.0), World(), Setup(sensor=TWIST)), 951)
    wild = rng.normal(size=log.twist.shape) * (rng.random(log.twist.shape) < 0.02)
    assert 3.0 < least_that_drove([record(log.replace(twist=log.twist + wild), robot)], robot) < 8.0


def test_a_dead_band_is_sought_below_what_turned_a_real_robot():
    """Its heading turns under 10.3 % of 22.2 V; its wheel speeds are too noisy to show anything."""
    data = real.folder()
    if not (data / "udea_three_omni").is_dir():
        pytest.skip(f"no real logs in {data}")
    robot, run = real.udea_turning(data)
    robot = robot.replace(drive=Drive(kind="duty", supply=22.2), motor=robot.motor.replace(voltage_limit=22.2))
    (dead,) = nuisance_parameters(["dead_band"], [record(run, robot)], robot)
    assert dead.high == pytest.approx(2.2874, abs=1e-4)
    assert least_that_drove([record(run.replace(pose=None), robot)], robot) == np.inf
