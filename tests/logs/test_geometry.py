"""The geometry of a robot from its logs: known robots, their own kinematics as a log, eq (3)."""

from functools import lru_cache

import numpy as np
import pytest

from omnidyn import load_robot
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.geometry import as_mecanum, mean_speeds, turned_wheels, wheel_geometry
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.support.staggered import Logged, Topic, plant


def log_of(robot, twist, scale=1.0, noise=0.0, names=("twist_command", "wheel_speed_command")):
    """Wheel speeds by hand: rim speed of wheel i is -sin(phi) vx + cos(phi) vy + b omega."""
    phi = np.radians(robot.wheels.azimuth_deg)
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi))
    rim += np.outer(twist[:, 2], np.ones(len(phi))) * robot.wheels.robot_radius
    speed = scale * rim / robot.wheels.wheel_radius
    speed += noise * np.random.default_rng(1).normal(size=speed.shape)
    return Run(t=np.arange(len(twist)) * 0.01, **dict(zip(names, (twist, speed), strict=True)))


def wander(turn=1.0, rows=400):
    rng = np.random.default_rng(2)
    return rng.normal(size=(rows, 3)) * [0.3, 0.2, turn]


@pytest.mark.parametrize("name", ["axebot", "robotino", "four-wheel"])
def test_it_finds_the_wheels_of_a_preset(name):
    robot = load_robot(name)
    found = wheel_geometry([log_of(robot, wander())])
    np.testing.assert_allclose(np.array(found.azimuth_deg), np.array(robot.wheels.azimuth_deg) % 360.0, atol=1e-9)
    assert found.per_metre == pytest.approx(1.0 / robot.wheels.wheel_radius)
    assert found.robot_radius == pytest.approx(robot.wheels.robot_radius)
    assert found.residual < 1e-12


def test_speeds_of_the_motor_show_the_gear():
    robot = load_robot("robotino")
    found = wheel_geometry([log_of(robot, wander(turn=0.0), scale=16.0)])
    assert found.per_metre * robot.wheels.wheel_radius == pytest.approx(16.0)
    assert found.robot_radius is None


def test_runs_in_one_direction_each_add_up():
    robot = load_robot("robotino")
    runs = [log_of(robot, np.tile([np.cos(a), np.sin(a), 0.0], (9, 1))) for a in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(wheel_geometry(runs).azimuth_deg, robot.wheels.azimuth_deg, atol=1e-9)
    with pytest.raises(InsufficientDataError, match="do not show where the wheels stand"):
        wheel_geometry(runs[:1])


def test_noise_stays_within_its_standard_error():
    robot = load_robot("robotino")
    found = wheel_geometry([log_of(robot, wander(), noise=0.5, names=("twist", "wheel_speed"))])
    error = np.abs(np.array(found.azimuth_deg) - robot.wheels.azimuth_deg)
    assert (error < 4.0 * np.array(found.azimuth_std)).all()
    assert (np.array(found.azimuth_std) < 1.0).all()


def test_what_is_no_omni_robot_is_refused():
    rng = np.random.default_rng(5)
    run = Run(t=np.arange(99.0), twist=rng.normal(size=(99, 3)), wheel_speed=rng.normal(size=(99, 3)))
    with pytest.raises(InputError, match="do not follow the body as omni wheels do"):
        wheel_geometry([run])
    with pytest.raises(InputError, match="cannot tell where the wheels stand; got wheel_speed"):
        wheel_geometry([Run(t=run.t, wheel_speed=run.wheel_speed)])


def test_mecanum_wheels_are_no_omni_wheels():
    """By hand, rollers in an X, forward: (vx - vy - b om, vx + vy + b om, vx + vy - b om, vx - vy + b om)/r."""
    twist = np.random.default_rng(3).normal(size=(60, 3))
    vx, vy, turn = twist[:, 0], twist[:, 1], 0.35 * twist[:, 2]
    speed = np.column_stack([vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn]) / 0.05
    speed *= [-1.0, 1.0, -1.0, 1.0]  # counter-clockwise about the robot: on the left that is backward
    run = Run(t=np.arange(60.0), twist=twist, wheel_speed=speed)
    seen = as_mecanum(wheel_geometry([run]))
    assert seen.robot_radius == pytest.approx(0.35)
    assert seen.per_metre == pytest.approx(20.0)
    preset = load_robot("mecanum").wheels
    other = wheel_geometry([run.replace(wheel_speed=wheel_speed(preset, twist))])
    assert as_mecanum(other).robot_radius == pytest.approx(preset.robot_radius)
    backward = wheel_geometry([run.replace(wheel_speed=speed * [-1.0, 1.0, 1.0, -1.0])])
    assert turned_wheels(backward) == (1, 4)
    assert as_mecanum(backward).robot_radius == pytest.approx(0.35)
    all_back = wheel_geometry([run.replace(wheel_speed=-speed)])
    assert turned_wheels(all_back) == (1, 2, 3, 4)
    assert as_mecanum(all_back).robot_radius == pytest.approx(0.35)
    assert turned_wheels(wheel_geometry([run.replace(twist=twist * [1.0, 1.0, -1.0])])) == ()  # the heading is turned
    other = run.replace(wheel_speed=speed[:, [1, 0, 2, 3]])
    with pytest.raises(InputError, match="front left, front right, rear left, rear right"):
        as_mecanum(wheel_geometry([other]))


def test_what_mecanum_logs_do_not_show_is_the_radius_and_not_where_they_stand():
    t = np.arange(100) * 0.01
    twist, speed = np.tile([0.3, 0.0, 0.0], (100, 1)), np.full((100, 4), 5.0)
    run = Run(t=t, twist=twist, wheel_speed=speed, source="straight.csv")
    with pytest.raises(InsufficientDataError, match="leave the logs out and give `azimuth`"):
        wheel_geometry([run])
    with pytest.raises(InsufficientDataError, match="leave the logs out and give --robot-radius"):
        wheel_geometry([run], "--robot-radius")
    with pytest.raises(InputError, match="give --robot-radius"):
        wheel_geometry([run.replace(twist=None)], "--robot-radius")


BODY, WHEELS = ("twist", "pose"), ("wheel_speed", "wheel_angle")


@lru_cache
def driven(offset, rates):
    """20 s of a robot with wheels at 60, 180 and 300 degrees, 0.2 m and 0.05 m, all channels, stamps apart."""
    true = plant(20.0)
    speeds, angles = [f"w{k}" for k in (1, 2, 3)], [f"a{k}" for k in (1, 2, 3)]
    twist, pose = ["vx", "vy", "omega"], ["x", "y", "heading"]
    rate = (100.0, 100.0, 30.0, 20.0) if rates else (50.0,) * 4
    made = [
        Topic({name: true[name] for name in names}, offset * k, each)
        for k, (names, each) in enumerate(zip((speeds, angles, twist, pose), rate, strict=True))
    ]
    logged = Logged.of(made, 20.0)
    t = np.unique(np.concatenate([stamps for stamps, _ in logged.topics]))
    channels = {}
    for channel, (stamps, values) in zip((*WHEELS, *BODY), logged.topics, strict=True):
        channels[channel] = np.full((len(t), 3), np.nan)
        channels[channel][np.searchsorted(t, stamps)] = np.column_stack(list(values.values()))
    return Run(t=t, **channels)


@pytest.mark.parametrize(("offset", "rates"), [(0.0, False), (20e-6, False), (0.005, True)])
@pytest.mark.parametrize("body", BODY)
@pytest.mark.parametrize("wheels", WHEELS)
def test_body_and_wheels_need_no_common_stamps(body, wheels, offset, rates):
    run = driven(offset, rates)
    found = wheel_geometry([Run(t=run.t, **{body: getattr(run, body), wheels: getattr(run, wheels)})])
    np.testing.assert_allclose(found.azimuth_deg, (60.0, 180.0, 300.0), atol=0.5)
    assert 1.0 / found.per_metre == pytest.approx(0.05, rel=0.01)
    assert found.robot_radius == pytest.approx(0.2, rel=0.01)
    assert (found.source, found.measured) == (f"{body} and {wheels}", True)
    assert found.residual < 0.05


def test_the_way_of_a_turning_body_is_its_arc():
    """A circle of 1 m radius driven sideways at 2 rad/s, its pose at 10 Hz: chords are 0.17 % short, arcs are not."""
    t = np.arange(200) * 0.1
    pose = np.column_stack([np.cos(2.0 * t), np.sin(2.0 * t), 2.0 * t])
    run = Run(t=t, pose=pose, wheel_angle=np.outer(2.0 * t, [1.0, 1.0, 1.0]))
    twist, speed = mean_speeds(run, "pose", "wheel_angle")
    np.testing.assert_allclose(twist, np.tile([0.0, 2.0, 2.0], (len(twist), 1)), atol=1e-9)
    np.testing.assert_allclose(speed, 2.0, rtol=1e-9)
    assert len(twist) > 40


def test_nothing_is_compared_across_a_gap_of_a_sensor():
    t = np.arange(1000) * 0.02
    gone = (t > 5.0) & (t < 9.0)
    twist = np.where(gone[:, None], np.nan, np.tile([0.3, 0.0, 0.0], (1000, 1)))
    found, _ = mean_speeds(Run(t=t, twist=twist, wheel_angle=np.outer(t, [1.0, 2.0, 3.0])), "twist", "wheel_angle")
    assert 35 <= len(found) <= 40  # of 50 windows of 0.4 s, ten lie in the gap or reach into it
    np.testing.assert_allclose(found[:, 0], 0.3)


def test_commands_that_contradict_do_not_hide_what_was_measured():
    """What the firmware was told is of another moment; what was measured fits."""
    run = driven(0.0, False)
    turned = np.roll(run.wheel_speed, 300, axis=0)
    both = run.replace(twist_command=run.twist, wheel_speed_command=turned, pose=None)
    found = wheel_geometry([both])
    assert found.source in ("twist and wheel_speed", "twist and wheel_angle")
    assert found.residual < 0.02
    with pytest.raises(InputError, match="do not follow the body as omni wheels do"):
        wheel_geometry([both.replace(twist=None)])


# A mecanum robot with counts at its motors, seen by cameras: r .0757 m, half length plus half width .364 m

RADIUS, ARM, GEAR, COUNTS = 0.0757, 0.364, 5.0, 42


def camera_log(path, seed, glitches=False):
    """By hand, rollers in an X. 170 Hz, 30 s, noise of .2 to 10 mm, 1 to 50 mrad; in half some wheels count back."""
    rng, dt, every = np.random.default_rng(seed), 1.0 / 1700.0, 10
    t = np.arange(0.0, 30.0, dt)
    waves = [0.05, 0.11, 0.23, 0.41]
    vx, vy, turn = (
        sum(size * rng.normal() * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in waves)
        for size in (0.1, 0.1, 0.3)
    )
    heading = np.cumsum(turn) * dt
    x = np.cumsum(vx * np.cos(heading) - vy * np.sin(heading)) * dt
    y = np.cumsum(vx * np.sin(heading) + vy * np.cos(heading)) * dt
    back = rng.choice([-1.0, 1.0], 4) if seed % 2 else np.ones(4)
    forward = np.column_stack([vx - vy - ARM * turn, vx + vy + ARM * turn, vx + vy - ARM * turn, vx - vy + ARM * turn])
    speed = back * [-1.0, 1.0, -1.0, 1.0] * forward / RADIUS
    counts = np.round(np.cumsum(speed, axis=0) * dt * GEAR * COUNTS / (2.0 * np.pi))
    noise = 10.0 ** rng.uniform(-1.0, 0.7)
    pose = np.column_stack([x, y, heading]) + noise * rng.normal(size=(len(t), 3)) * [0.002, 0.002, 0.01]
    shown = np.column_stack([t, pose, counts])[::every]
    names = "t_s,x_m,y_m,heading_rad,enc1,enc2,enc3,enc4"
    if glitches:  # a speed in a unit of its own, with spikes
        spikes = 300.0 * (rng.random((len(shown), 4)) < 0.02)
        shown, names = np.column_stack([shown, 0.3 * speed[::every] + spikes]), names + ",w1,w2,w3,w4"
    np.savetxt(path, shown, "%.6f", ",", header=names, comments="")
    return back


@pytest.mark.parametrize("glitches", [False, True])
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.some(7)
def test_counts_at_the_motor_and_cameras_show_radius_and_arm(tmp_path, seed, glitches):
    back = camera_log(tmp_path / "log.csv", seed, glitches)
    options = LogOptions(assume={"a": f"ticks/{COUNTS}@motor"}, gear_ratio=GEAR)
    seen = wheel_geometry([recorded_log(tmp_path / "log.csv", options=options).to_run()])
    assert seen.source == "pose and wheel_angle"
    assert turned_wheels(seen) == tuple(np.flatnonzero(back < 0.0) + 1)
    wheels = as_mecanum(seen)
    assert 1.0 / wheels.per_metre == pytest.approx(RADIUS, rel=0.01)
    assert wheels.robot_radius == pytest.approx(ARM, rel=0.03)
