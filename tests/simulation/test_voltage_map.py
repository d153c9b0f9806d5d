"""A driver that is no line: its map in the file, forward and backward, in simulations, fits and controllers."""

import numpy as np
import pytest

import omnidyn
from benchmarks.wrong_worlds.log import robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.control.table import feedforward_table
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.methods import OutputError
from omnidyn.model.actuation import asked_for, reaching
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, dead_zone_map
from omnidyn.model.drive import Drive
from omnidyn.model.keys import all_keys
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from omnidyn.simulation.live import LiveRobot
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate

POINTS = ((0.5, 0.0), (2.0, 4.0, 0.1), (5.0, 7.5), (9.0, 9.0))


def robot(world=World(), **driver):  # noqa: B008
    exact = robot_of(world).replace(friction=omnidyn.load_robot("axebot").friction)
    axes = exact.friction.axes.replace(viscous=world.viscous, coulomb=world.coulomb, breakaway=None)
    return exact.replace(friction=exact.friction.replace(axes=axes), drive=Drive(**driver))


def curve(volts):
    """The map by the book: straight between the points."""
    asked, passed = np.array([(0.0, 0.0), *(point[:2] for point in POINTS)]).T
    return np.sign(volts) * np.interp(np.abs(volts), asked, passed)


def volts(seed, rows=300):
    return np.repeat(np.random.default_rng(seed).uniform(-9.0, 9.0, (rows // 25, 3)), 25, axis=0)


BENT = robot(voltage_map=POINTS)


def test_the_file_keeps_the_map_and_its_errors():
    assert parse_robot(robot_to_toml(BENT)) == BENT
    assert not [key for key in all_keys(BENT) if "map" in key]  # no number that a fit could free


@pytest.mark.parametrize(
    "points, words",
    [
        (
            [(2.0, 1.0), (1.0, 2.0)],
            r"voltage_map_V is not monotone; got \[\[2.0, 1.0\], \[1.0, 2.0\]\]; expected pairs",
        ),
        ([(1.0, 2.0), (2.0, 2.0)], "not monotone"),
        ([(1.0, 0.0)], "not monotone"),
        ([(1.0,)], "at least 2 values"),
    ],
)
def test_what_is_no_map(points, words):
    with pytest.raises(InputError, match=words):
        Drive(voltage_map=points)


def test_no_speed_loop_stands_behind_a_map():
    with pytest.raises(InputError, match='kind = "speed" takes no voltage_map_V; expected kind = "duty" or "voltage"'):
        Drive(kind="speed", kp=1.0, rate=100.0, voltage_map=POINTS)


def test_what_is_asked_for_reaches_the_motors():
    wanted = np.linspace(-11.0, 11.0, 201)
    behind_a_band = BENT.replace(drive=BENT.drive.replace(dead_band=0.3))
    assert np.allclose(reaching(behind_a_band, asked_for(behind_a_band, wanted)), wanted, atol=1e-12)
    assert np.allclose(reaching(BENT, wanted[20:-20]), curve(wanted[20:-20]), atol=1e-12)


@pytest.mark.parametrize("frame", [False, True], ids=["exact", "implicit"])
def test_a_robot_behind_a_map_is_that_of_another_simulator(frame):
    world, voltage, t = World(frame=frame), volts(1), np.arange(301) * 0.01
    run = simulate(robot(world, voltage_map=POINTS), voltage, 0.01)
    true = drive(world, t[:-1], curve(voltage), t, 1e-3)
    assert np.abs(run.twist - true.twist).max() < 5e-3 * np.abs(true.twist).max()
    assert np.array_equal(run.voltage[:-1], voltage)  # as a log has it: before the driver


def test_a_live_robot_and_derivatives_go_through_it():
    voltage = volts(2, 50)
    run, live = simulate(BENT, voltage, 0.01), LiveRobot(BENT, 0.01)
    for row in voltage:
        live.step(row)
    assert np.allclose(live.twist, run.twist[-1], atol=1e-9)
    found = derivatives(BENT, voltage, 0.01, keys=["body.mass_kg"])
    assert np.array_equal(found.run.voltage[:-1], voltage)
    assert np.allclose(found.run.twist, run.twist, atol=1e-6)


def test_a_fit_finds_friction_behind_the_map():
    run = simulate(BENT, volts(3, 500), 0.01)
    fit = omnidyn.identify([run], BENT, method=OutputError())
    assert fit.robot.drive.voltage_map == POINTS
    for key in ("friction.axes.coulomb[0]", "friction.axes.viscous[1]"):
        level, axis = key[14:-3], int(key[-2])
        assert fit.estimate.value[key] == pytest.approx(getattr(BENT.friction.axes, level)[axis], rel=0.02)


def test_dead_zones_are_asked_of_the_driver():
    straight = robot()
    for pattern in axis_patterns(straight)[[0, 2]]:  # whose motors that push have one voltage
        least = breakaway_voltage(straight, pattern)
        assert breakaway_voltage(BENT, pattern) == pytest.approx(float(asked_for(BENT, least)), rel=1e-6)
    assert np.isfinite(dead_zone_map(BENT, [0.0])[0]).all()


def test_feedforward_inverts_the_map_or_refuses_by_name():
    ask = (np.array([0.4, 0.2, 0.5]), np.array([0.1, 0.0, 0.2]))
    assert np.allclose(curve(omnidyn.voltage_for(BENT, *ask)), omnidyn.voltage_for(robot(), *ask))
    with pytest.raises(UnsupportedError, match=r"a driver that is no line; got \[drive\] voltage_map_V"):
        feedforward_table(BENT)
