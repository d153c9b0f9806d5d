"""Fits that begin with motors far from their own, and latencies that no log has."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import EMF, TORQUE, Key
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

RESISTANCE = "motor.resistance_ohm"
STEP = 0.04  # [s]


@pytest.fixture(scope="module")
def true():
    return first_guess("new", load_robot("axebot").wheels, 1.5)


@pytest.fixture(scope="module")
def run(true):
    volts = np.clip(1.5 * np.vstack([np.zeros((10, 3)), excitation(6.0, 25.0)]), -6.0, 6.0)
    return simulate(true, volts, STEP)


def noisy(values, std):
    return values + std * np.random.default_rng(3).standard_normal(values.shape)


@pytest.mark.parametrize(("resistance", "constant"), [(4.0, 0.5), (0.25, 0.5), (4.0, 2.0)])
@pytest.mark.some(2)
def test_currents_find_their_latency_beside_a_motor_that_is_a_wrong_guess(true, run, resistance, constant):
    """It stayed at -0.1 s or a part of a row, and resistance and currents with it."""
    log = run.replace(twist=noisy(run.twist, 0.005), current=noisy(run.current, 0.02), wheel_speed=None, pose=None)
    start = Key.parse(RESISTANCE).set(true, resistance * true.motor.resistance)
    for key in (TORQUE, EMF):
        start = Key.parse(key).set(start, constant * true.motor.torque_constant)
    fit = identify(log, start, OutputError(start="rest")).estimate
    assert abs(fit.nuisances["latency.current"].value) < 0.1 * STEP
    assert fit.noise["current[0]"] < 0.025
    assert abs(fit.value[RESISTANCE] - true.motor.resistance) < 4.0 * fit.std[RESISTANCE]


def test_a_path_finds_its_latency_beside_a_motor_that_is_a_wrong_guess(true, run):
    """Motors first: half the force a row earlier looks like all of it. It ended at -41 ms and 0.4 of the friction."""
    log = run.replace(twist=None, wheel_speed=None, current=None, pose=noisy(run.pose, 0.002))
    start = Key.parse(RESISTANCE).set(true, 4.0 * true.motor.resistance)
    for key in (TORQUE, EMF):
        start = Key.parse(key).set(start, 0.5 * true.motor.torque_constant)
    fit = identify(log, start, OutputError(start="rest")).estimate
    assert abs(fit.nuisances["latency.position"].value) < 0.1 * STEP
    assert all(std < 0.0023 for std in fit.noise.values())
    for k in (0, 1):
        key = f"friction.direction.coulomb[{k}]"
        assert abs(fit.value[key] - Key.parse(key).get(true)) < 4.0 * fit.std[key]


def test_a_speed_long_before_its_voltage_is_no_automatic_latency(true, run):
    """Speeds 120 ms early; rows are 40 ms apart."""
    early = np.vstack([run.twist[3:], np.repeat(run.twist[-1:], 3, axis=0)])
    log = run.replace(twist=noisy(early, 0.005), current=None, wheel_speed=None, pose=None)
    fit = identify(log, true, OutputError(start="rest")).estimate
    assert "latency.twist" not in fit.nuisances
    (early,) = [each for each in fit.warnings if each.code == "implausible_latency"]
    assert (early.subject, early.numbers["fitted"]) == ("latency.twist", False)
    asked = identify(log, true, OutputError(start="rest", nuisances="latency")).estimate
    assert asked.nuisances["latency.twist"].value < -0.08
    assert ("implausible_latency", "latency.twist") in {(each.code, each.subject) for each in asked.warnings}
