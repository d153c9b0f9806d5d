"""The log of a set-up, by the simulator of the wrong worlds, which shares no code with omnidyn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.blind.setups import CURRENT, FORWARD, HEADING, POSE, RICH, ROTOR, STEADY, TURNS, TWIST, WHEELS, Setup
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot
from omnidyn.run import Run

RATE, SECONDS = 100.0, 20.0
STARTS = 1.15  # of the truth, where what is free begins
NOISE = {
    TWIST: np.array([0.01, 0.01, 0.08]),
    WHEELS: 0.3,
    CURRENT: 0.05,
    POSE: np.array([0.004, 0.004, 0.01]),
    HEADING: np.array([0.004, 0.004, 0.01]),
}
SETTLED = 3.0  # [s] before a log of one constant speed begins


def world_of(setup: Setup, seed: int) -> World:
    """The truth: numbers near those of a small robot."""
    rng = np.random.default_rng([seed, 1])
    near = lambda value: float(value * np.exp(rng.uniform(-0.2, 0.2)))  # noqa: E731
    base = World()
    rotor = near(2e-6) if ROTOR in setup.free else 0.0
    return replace(
        base,
        mass=near(2.4),
        inertia=near(0.016),
        resistance=(near(2.2),) * 3,
        torque_constant=(near(0.0105),) * 3,
        coulomb=(near(3.0), near(3.4), near(0.2)),
        viscous=(near(3.0), near(3.4), near(0.03)),
        rotor_inertia=rotor,
    )


def robot_of(world: World) -> Robot:
    """The robot as its file has it, all of it right, motors alike."""
    rotor = f"rotor_inertia_kg_m2 = {world.rotor_inertia}\n" if world.rotor_inertia else ""
    return parse_robot(f"""schema = 1
name = "blind"
[body]
mass_kg = {world.mass}
inertia_kg_m2 = {world.inertia}
rotating_frame = false
[wheels]
azimuth_deg = {list(world.azimuth)}
robot_radius_m = {world.robot_radius}
wheel_radius_m = {world.wheel_radius[0]}
[motor]
resistance_ohm = {world.resistance[0]}
torque_constant_Nm_A = {world.torque_constant[0]}
emf_constant_Vs_rad = {world.torque_constant[0]}
gear_ratio = {world.gear_ratio}
voltage_limit_V = {world.voltage_limit}
{rotor}[friction.axes]
viscous = {list(world.viscous)}
coulomb = {list(world.coulomb)}
""")


def started(robot: Robot, setup: Setup) -> Robot:
    """What is free begins a little off, each by as much."""
    for name in setup.free:
        key = Key.parse(name)
        robot = key.set(robot, STARTS * key.get(robot))
    return robot


def logged(setup: Setup, seed: int) -> tuple[Run, Robot]:
    """(the log, the robot that its fit begins from)."""
    world = world_of(setup, seed)
    return noisy(setup, driven(world, setup, seed), seed), started(robot_of(world), setup)


def driven(world: World, setup: Setup, seed: int) -> Run:
    """What a world does, without noise, in all channels."""
    t = np.arange(int(SECONDS * RATE)) / RATE
    voltage = voltages(world, setup.drive, len(t), np.random.default_rng([seed, 2]))
    motion = drive(world, t, voltage, t)
    heading = motion.path[:, 2]
    c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, y = motion.twist[:, :1], motion.twist[:, 1:2]
    ground = np.hstack([c * x - s * y, s * x + c * y])
    place = np.cumsum(np.vstack([np.zeros((1, 2)), 0.5 * (ground[1:] + ground[:-1]) / RATE]), axis=0)
    back = motion.wheel_speed * np.array(world.torque_constant) * world.gear_ratio
    return Run(
        t,
        voltage=voltage,
        twist=motion.twist,
        wheel_speed=motion.wheel_speed,
        current=(voltage - back) / np.array(world.resistance),
        pose=np.column_stack([place, heading]),
    )


def noisy(setup: Setup, run: Run, seed: int) -> Run:
    """What is logged of it."""
    rng, channels = np.random.default_rng([seed, 3]), {}
    first = int(SETTLED * RATE) if setup.drive == STEADY else 0
    for name in setup.logged:
        channel = POSE if name == HEADING else name
        clean = getattr(run, channel)
        values = clean + NOISE[name] * rng.normal(size=clean.shape)
        if name == HEADING:
            values[:, :2] = np.nan
        channels[channel] = values[first:]
    return Run(run.t[first:] - run.t[first], voltage=run.channels["voltage"][first:], **channels)


def voltages(world: World, how: str, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Levels that change every 0.3 to 1 s, along one axis or all; of a constant speed forward, one level."""
    g = world.G
    along = {FORWARD: [0], "y": [1], TURNS: [2], STEADY: [0], RICH: [0, 1, 2]}[how]
    shape = np.linalg.pinv(g)[:, along]
    shape = shape / np.abs(shape).max(axis=0)
    if how == STEADY:
        return np.tile(8.0 * shape[:, 0], (rows, 1))
    out, k = np.zeros((rows, 3)), 0
    while k < rows:
        size = rng.uniform(-1.0, 1.0, len(along))
        out[k : (k := k + int(rng.integers(30, 100)))] = 10.0 * np.clip(shape @ size, -1.0, 1.0)
    return out
