"""Runs under Coulomb friction against DOP853 mode by mode, and their derivatives against the general engine's.

The general engine differentiates stage by stage, with plants a little up and down; it shares the law of the robot.
"""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Body, Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.wheels import Wheels
from omnidyn.simulation.coulomb.door import moved
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.sensitivity.directions import EPS, prepared
from omnidyn.simulation.sensitivity.late_sample import Direction, VoltageProgram, late_samples
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.travel import PATH, PLACE
from tests.reference.modes import reference
from tests.support.friction_shapes import AXEBOT, implicit

YAW = {"yaw_coulomb": 1.4, "yaw_viscous": 0.05}
ELLIPSE = DirectionFriction(coulomb=(14.0, 11.0), viscous=2.0, **YAW)
DISC = DirectionFriction(coulomb=(12.0, 12.0), viscous=2.0, **YAW)
PLAIN = DirectionFriction(coulomb=(14.0, 11.0), viscous=2.0, ellipse="plain", **YAW)
BOX = AxesFriction(viscous=(2.0, 3.0, 0.05), coulomb=(14.0, 11.0, 1.4))
BACKWARD = AxesFriction(viscous=(2.0, 3.0, 0.05), coulomb=(14.0, 11.0, 1.4), coulomb_backward=(9.0, 12.0, 1.0))
UNEQUAL = (1.1, 1.2, 1.35, 1.2)


def limited(robot, most):
    return robot.replace(motor=robot.motor.replace(current_limit=most))


def ordinary(friction, azimuth=(45.0, 135.0, 225.0, 315.0), resistance=1.2, inertia=0.12, frame=True):
    """A robot as `init` writes it: four wheels, a turning frame."""
    motor = AXEBOT.motor.replace(
        resistance=resistance, torque_constant=0.025, emf_constant=0.025, gear_ratio=12.0, voltage_limit=12.6
    )
    wheels = Wheels(azimuth_deg=azimuth, robot_radius=0.19, wheel_radius=0.05)
    own = {"direction": friction} if isinstance(friction, DirectionFriction) else {"axes": friction}
    body = Body(mass=6.2, inertia=inertia, rotating_frame=frame)
    return Robot(name="ordinary", body=body, wheels=wheels, motor=motor, friction=Friction(**own))


ROBOTS = {
    "ellipse": ordinary(ELLIPSE),
    "disc": ordinary(DISC),
    "plain ellipse": ordinary(PLAIN),
    "box": ordinary(BOX),
    "box, other levels backward": ordinary(BACKWARD),
    "box without a turning frame": ordinary(BOX, frame=False),
    "three wheels": ordinary(ELLIPSE, (180.0, -60.0, 60.0)),
    "three wheels at odd places": ordinary(ELLIPSE, (170.0, -50.0, 70.0)),
    "five wheels": ordinary(DISC, (0.0, 72.0, 144.0, 216.0, 288.0)),
    "unequal motors": ordinary(ELLIPSE, resistance=UNEQUAL),
    "unequal motors, box": ordinary(BOX, resistance=UNEQUAL),
    "yaw of 2 ms": ordinary(ELLIPSE, inertia=0.004),
}
ROBOTS |= {
    f"{name}, at most {most:g} A": limited(ROBOTS[name], most)
    for name, most in (("ellipse", 1.5), ("box", 4.0), ("unequal motors", 2.5), ("three wheels", 1.5))
}


def program(robot, rows, seed=0):
    """Levels, ramps and rests, each for .2 to 1.2 s."""
    random, volts = np.random.default_rng(seed), []
    while len(volts) < rows:
        level, ramp = random.uniform(-9.0, 9.0, (2, robot.wheels.count))
        kind, count = random.integers(0, 4), random.integers(20, 120)
        volts += [level * (kind > 0) + ramp * (kind == 1) * share for share in np.linspace(0.0, 0.4, count)]
    return np.array(volts[:rows])


def keys_of(robot):
    keys = ["body.mass_kg", "body.inertia_kg_m2", "motor.torque_constant_Nm_A", "wheels.wheel_radius_m"]
    keys += ["wheels.robot_radius_m"]
    if robot.motor.current_limit:
        keys += ["motor.current_limit_A"]
    direction = robot.friction.direction.coulomb[0] > 0.0
    if direction:
        return [*keys, *(f"friction.direction.{name}" for name in ("coulomb[0]", "coulomb[1]", "viscous", *YAW))]
    levels = [f"friction.axes.{name}[{axis}]" for name in ("coulomb", "viscous") for axis in range(3)]
    return [*keys, *levels]


@pytest.mark.parametrize(
    "name", [name for name in ROBOTS if name not in ("plain ellipse", "box without a turning frame")]
)
@pytest.mark.some(5)
def test_the_twist_and_the_pose_against_the_modes(name):
    """DOP853 restarted at every event: the error follows the tolerance, what rests is exactly 0."""
    robot = ROBOTS[name]
    voltage = program(robot, 250, 1)
    truth, twist = reference(robot, voltage, 0.01), (0.4, -0.2, 1.0)
    thrown = reference(robot, 0.0 * voltage[:60], 0.01, twist=twist)
    for tol in (1e-4, 1e-6):
        for run, true in (
            (simulate(robot, voltage, 0.01, tol=tol), truth),
            (simulate(robot, 0.0 * voltage[:60], 0.01, twist=twist, tol=tol), thrown),
        ):
            assert "Coulomb engine" in run.source
            assert (np.abs(run.twist - true.twist) / [1.0, 1.0, 10.0]).max() <= tol
            assert np.abs(run.pose - true.pose).max() <= tol
            np.testing.assert_array_equal(run.twist == 0.0, true.stuck[:, :3])


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.some(5)
def test_derivatives_are_those_of_the_general_engine(name):
    """At tolerance 1e-8, of ten numbers and more: within 1e-3, half of them within 1e-5."""
    robot = ROBOTS[name]
    keys, voltage = keys_of(robot), program(robot, 250, 2)
    true = derivatives(implicit(robot), voltage, 0.01, keys, tol=1e-8)
    ready, t = prepared(robot, keys), np.arange(251) * 0.01
    directions = [Direction(key, *ready.robots[2 * k : 2 * k + 2]) for k, key in enumerate(keys)]
    (seen,), _ = late_samples(robot, VoltageProgram(t, voltage, np.zeros(3)), directions, [0.0], 1e-7, PLACE)
    assert moved(ready.numbers, ready.plants, EPS) is not None
    assert np.abs(seen.twist - true.run.twist).max() <= 1e-6
    pose = seen.dtravel[..., [PATH, PATH + 1, 0]]
    for found, right in ((seen.dtwist, true.twist), (pose, true.pose)):
        by = np.moveaxis(found, 1, 2) / ready.scale
        size = (right**2).sum(axis=(0, 1))
        off = np.sqrt(((by - right) ** 2).sum(axis=(0, 1)) / np.where(size > 0.0, size, 1.0))
        assert off.max() <= 1e-3, dict(zip(keys, off, strict=True))
        assert np.median(off) <= 1e-5


@pytest.mark.parametrize("name", ["ellipse", "box", "unequal motors"])
def test_a_look_between_steps_is_that_of_a_finer_grid(name):
    """Four latencies: the twist, the place and their derivatives are those of rows cut where the sensor looks."""
    robot, late = ROBOTS[name], 0.0037
    keys, voltage = keys_of(robot)[:4], program(robot, 120, 4)
    ready, t = prepared(robot, keys), np.arange(121) * 0.01
    directions = [Direction(key, *ready.robots[2 * k : 2 * k + 2]) for k, key in enumerate(keys)]
    looks, _ = late_samples(
        robot, VoltageProgram(t, voltage, np.zeros(3)), directions, [0.0, late, 0.012, -0.004], 1e-8, PLACE
    )
    cut = np.tile([0.01 - late, late], 120)
    fine = derivatives(implicit(robot), np.repeat(voltage, 2, axis=0), cut, keys, tol=1e-8)
    seen, rows = looks[1], slice(1, 240, 2)
    assert np.abs(seen.twist[1:] - fine.run.twist[rows]).max() <= 2e-6
    assert np.abs(seen.travel[1:, PATH:] - fine.run.pose[rows, :2]).max() <= 1e-6
    size = np.abs(fine.twist).max(axis=(0, 1)) * ready.scale
    assert (
        np.abs(np.moveaxis(seen.dtwist[1:], 1, 2) - fine.twist[rows] * ready.scale).max(axis=(0, 1)) <= 1e-4 * size
    ).all()
    slope = (looks[0].twist[40] - looks[1].twist[40]) / late
    assert np.abs(seen.pace[40] - slope).max() <= 0.3 * np.abs(seen.pace[40]).max() + 0.05
    assert np.isnan(looks[1].twist[0]).all()


def test_derivatives_by_volts_pushes_and_the_start_are_differences():
    """What changes no number of the robot: central differences of whole runs, away from kinks."""
    robot = ROBOTS["ellipse"]
    voltage, t = program(robot, 80, 5), np.arange(81) * 0.01
    changes = {
        "voltage": np.random.default_rng(1).normal(size=voltage.shape),
        "push": np.random.default_rng(2).normal(size=(80, 3)) * [1.0, 1.0, 0.1],
        "start": np.array([0.3, -0.2, 0.5]),
    }
    start, push, step = np.array([0.5, 0.2, 1.0]), np.tile([1.0, -2.0, 0.1], (80, 1)), 1e-5

    def run(side, name, directions=()):
        own = {"voltage": voltage, "push": push, "start": start}
        own[name] = own[name] + side * step * changes[name]
        program = VoltageProgram(t, own["voltage"], own["start"], own["push"])
        return late_samples(robot, program, directions, [0.0], 1e-9, PLACE)[0][0]

    directions = [Direction(name, **{name: change}) for name, change in changes.items()]
    seen = run(0.0, "start", directions)
    for k, name in enumerate(changes):
        up, down = run(1.0, name), run(-1.0, name)
        for found, ends in (
            (seen.dtwist[:, k], (up.twist, down.twist)),
            (seen.dtravel[:, k], (up.travel, down.travel)),
        ):
            by = (ends[0] - ends[1]) / (2.0 * step)
            assert np.abs(found - by).max() <= 2e-3 * np.abs(by).max(), name


@pytest.mark.parametrize("name", ["ellipse", "box", "unequal motors, at most 2.5 A"])
@pytest.mark.some(1)
def test_motors_coast_as_in_the_general_engine(name):
    """A duty of 0 leaves a motor without current, one or all; derivatives too."""
    robot = ROBOTS[name]
    robot = robot.replace(drive=robot.drive.replace(kind="duty", supply=12.0, off="coast"))
    random = np.random.default_rng(5)
    duty = np.repeat(random.uniform(-0.8, 0.8, (25, 4)) * (random.random((25, 4)) < 0.7), 10, axis=0)
    duty[100:120] = 0.0
    keys = [key for key in keys_of(robot) if "limit" not in key]
    found = derivatives(robot, duty=duty, dt=0.01, keys=keys, tol=1e-7)
    true = derivatives(implicit(robot), duty=duty, dt=0.01, keys=keys, tol=1e-8)
    assert "Coulomb engine" in found.run.source
    assert np.abs(found.run.twist - true.run.twist).max() <= 1e-6
    assert np.abs(found.run.current - true.run.current).max() <= 1e-5
    assert (found.run.current[:-1][duty == 0.0] == 0.0).all()
    size = np.sqrt((true.twist**2).sum(axis=(0, 1)))
    off = np.sqrt(((found.twist - true.twist) ** 2).sum(axis=(0, 1))) / size
    assert off.max() <= 1e-3
    assert np.median(off) <= 1e-4


def test_a_speed_loop_whose_motors_meet_their_limit():
    robot = ROBOTS["ellipse, at most 1.5 A"]
    robot = robot.replace(drive=robot.drive.replace(kind="speed", kp=0.5, ki=3.0, rate=100.0))
    speeds = np.repeat(np.random.default_rng(6).uniform(-12.0, 12.0, (10, 4)), 25, axis=0)
    run = simulate(robot, wheel_speed_command=speeds, dt=0.01, tol=1e-6)
    true = simulate(implicit(robot), wheel_speed_command=speeds, dt=0.01, tol=1e-8)
    assert "Coulomb engine" in run.source
    assert (np.abs(run.current) > 1.499).mean() > 0.2
    assert (np.abs(run.twist - true.twist) / [1.0, 1.0, 10.0]).max() <= 1e-6
    keys = keys_of(robot)
    found, right = (
        derivatives(r, wheel_speed_command=speeds, dt=0.01, keys=keys, tol=tol)
        for r, tol in ((robot, 1e-7), (implicit(robot), 1e-8))
    )
    size = np.sqrt((right.twist**2).sum(axis=(0, 1)))
    assert (np.sqrt(((found.twist - right.twist) ** 2).sum(axis=(0, 1))) <= 2e-3 * size).all()


def test_what_other_laws_ask_for_is_left_to_the_general_engine():
    """A robot that this room does not know is never taken for one that it knows."""
    robot = ROBOTS["ellipse"]
    strange = {
        "breakaway": robot.replace(friction=Friction(direction=ELLIPSE.replace(breakaway=(15.0, 12.0)))),
        "at the wheels": robot.replace(friction=Friction(wheels=WheelFriction(coulomb=1.0))),
        "box and ellipse": robot.replace(friction=Friction(axes=BOX, direction=DISC)),
        "Stribeck": robot.replace(
            friction=Friction(direction=ELLIPSE.replace(breakaway=(15.0, 12.0), stribeck_speed=0.01))
        ),
        "drop": robot.replace(motor=robot.motor.replace(voltage_drop=0.1)),
        "gear": robot.replace(motor=robot.motor.replace(gear_efficiency=0.9)),
        "centre": robot.replace(body=robot.body.replace(centre=(0.01, 0.0))),
        "rotors that couple": robot.replace(motor=robot.motor.replace(rotor_inertia=(1e-4, 2e-4, 1e-4, 1e-4))),
    }
    for name, other in strange.items():
        assert moved(plant(other), [], 1.0) is None, name
    friction = robot.friction
    assert friction.only_direction
    key = Key.parse("friction.direction.breakaway[0]")
    up = key.set(
        robot.replace(friction=Friction(direction=ELLIPSE.replace(breakaway=(14.0, 11.0)))), 14.1, checked=False
    )
    assert moved(plant(robot), [plant(up), plant(robot)], EPS) is None


def test_random_pushes_never_end_in_what_is_no_number():
    """Fast voltages around what holds, from any start, at tolerances rough and fine."""
    random = np.random.default_rng(3)
    for name, robot in ROBOTS.items():
        volts = random.normal(size=(200, robot.wheels.count)) * random.choice([0.5, 2.0, 12.0], (200, 1))
        for tol in (1e-2, 1e-6):
            run = simulate(robot, volts, 0.004, twist=random.normal(size=3), tol=tol)
            assert np.isfinite(run.twist).all(), name
