"""Clean logs of random robots, to check and to put faults into (benchmarks/logs/check_faults.py).

A clean log is a simulated run of a random robot (box or disc friction or a turning frame, three or four wheels, its
robot file exact) under commands that a user would give, seen through sensors with noise, steps and jitter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.logs.log import Log
from omnidyn.model.frames import body_to_world
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import robot_from_dict
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

FloatArray = NDArray[np.float64]
Rng = np.random.Generator

LIMIT = 12.0  # [V] of every random robot
AXES = ("vx", "vy", "omega")


@dataclass(frozen=True)
class Scene:
    """What is drawn before anything is simulated. floor: twist, pose, gyro or none. drive: voltage or duty."""

    robot: Robot
    rate: float
    seconds: float
    jitter: float
    drive: str
    floor: str
    has_current: bool
    has_speed: bool
    amplitude: float
    clip: float = np.inf  # share of the limit at which the driver gives up
    sag: float = 0.0


def random_robot(rng: Rng) -> Robot:
    """A robot that exists in shops: 1 to 10 kg, 0.8 to 2 m/s, friction of 3 to 12 % of its weight."""
    n = int(rng.choice([3, 4]))
    start = float(rng.choice([180.0, 60.0, 30.0, 0.0])) if n == 3 else float(rng.choice([45.0, 0.0]))
    mass, b, r = rng.uniform(1.0, 10.0), rng.uniform(0.08, 0.22), rng.uniform(0.02, 0.06)
    gear, top = float(np.round(rng.uniform(8.0, 40.0))), rng.uniform(0.8, 2.0)
    constant = LIMIT / (gear * top / r)
    coulomb = mass * 9.81 * rng.uniform(0.03, 0.12)
    resistance = gear * constant * LIMIT / r * 2.0 / (coulomb * rng.uniform(3.0, 8.0))
    kind, ratio, yaw = str(rng.choice(["box", "disc"])), rng.uniform(0.7, 1.3), 0.6 * coulomb * b
    viscous = coulomb / top * rng.uniform(0.0, 0.4)
    friction = {
        "box": {"axes": {"viscous": [viscous, viscous, viscous * b**2], "coulomb": [coulomb, coulomb * ratio, yaw]}},
        "disc": {
            "direction": {
                "coulomb": [coulomb, coulomb * ratio],
                "viscous": viscous,
                "yaw_coulomb": yaw,
                "yaw_viscous": viscous * b**2,
            }
        },
    }[kind]
    return robot_from_dict(
        {
            "schema": 1,
            "name": f"random-{kind}-{n}",
            "body": {"mass_kg": mass, "inertia_kg_m2": 0.5 * mass * b**2, "rotating_frame": bool(rng.random() < 0.3)},
            "wheels": {
                "azimuth_deg": [start + 360.0 * k / n - 360.0 * (start + 360.0 * k / n > 180.0) for k in range(n)],
                "robot_radius_m": b,
                "wheel_radius_m": r,
            },
            "motor": {
                "resistance_ohm": resistance,
                "torque_constant_Nm_A": constant,
                "emf_constant_Vs_rad": constant,
                "gear_ratio": gear,
                "voltage_limit_V": LIMIT,
            },
            "drive": {"kind": "voltage"},
            "friction": friction,
        }
    )


def random_scene(rng: Rng) -> Scene:
    """A robot and a way to log it: 10 to 60 s at 50 to 200 Hz; some sensors are missing."""
    return Scene(
        random_robot(rng),
        float(rng.choice([50.0, 100.0, 125.0, 200.0])),
        rng.uniform(10.0, 60.0),
        float(rng.choice([0.0, 0.02, 0.1])),
        str(rng.choice(["voltage", "duty"])),
        str(rng.choice(["twist", "pose", "gyro", "none"], p=[0.45, 0.25, 0.2, 0.1])),
        bool(rng.random() < 0.8),
        bool(rng.random() < 0.95),
        rng.uniform(0.5, 0.85),
    )


def program(rng: Rng, scene: Scene, n: int, dt: float) -> FloatArray:
    """Share of the limit for each wheel, shape (n, wheels): rest, then pushes in many directions, ramps and pauses."""
    wheels = scene.robot.wheels
    out = np.zeros((n, wheels.count))
    k = round(rng.uniform(0.3, 1.0) / dt)
    push = wheels.wrench_matrix.T / np.array([1.0, 1.0, float(np.mean(wheels.robot_radius))])
    while k < n:
        length = round(rng.uniform(0.3, 1.5) / dt)
        direction = rng.normal(size=3) * (1.0, 1.0, rng.choice([0.0, 0.3, 1.0]))
        if rng.random() < 0.25:
            direction = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
        pattern = push @ direction
        level = scene.amplitude * rng.uniform(0.35, 1.0) * pattern / np.abs(pattern).max()
        shape = np.linspace(0.0, 1.0, length) if rng.random() < 0.2 else np.ones(length)
        if rng.random() < 0.1:
            level = 0.0 * level
        out[k : k + length] = np.outer(shape, level)[: max(0, n - k)]
        k += length
    return out


class Truth(NamedTuple):
    """A simulated run, and the supply."""

    run: Run
    supply: FloatArray
    share: FloatArray  # of the supply that was asked for


def play(rng: Rng, scene: Scene) -> Truth:
    """The run of a scene."""
    n, dt = round(scene.seconds * scene.rate), 1.0 / scene.rate
    steps = dt * (1.0 + scene.jitter * np.clip(rng.normal(size=n), -3.0, 3.0))
    share = np.round(np.clip(program(rng, scene, n, dt), -scene.clip, scene.clip) * 1000.0) / 1000.0
    supply = np.full(n, LIMIT)
    if scene.sag:
        # A weak battery: it gives way under load, a little later than the load comes.
        load = np.abs(share).sum(axis=1)
        for k in range(1, n):
            load[k] += (load[k - 1] - load[k]) * np.exp(-dt / 0.1)
        supply = LIMIT * (1.0 - scene.sag * load / load.max())
    run = simulate(scene.robot, share * supply[:, None], steps, tol=None)
    return Truth(run, np.append(supply, supply[-1]), np.vstack([share, share[-1:]]))


def stepped(values: FloatArray, step: float) -> FloatArray:
    """As a sensor counts."""
    return np.round(values / step) * step


def record(rng: Rng, scene: Scene, truth: Truth, ground_slip: FloatArray | None = None) -> Log:
    """What the sensors make of a run. ground_slip: share of the wheels' path that the floor sees, per row."""
    run, robot = truth.run, scene.robot
    rows = len(run)
    channels: dict[str, FloatArray] = {}
    assert run.voltage is not None
    assert run.current is not None
    assert run.wheel_speed is not None
    assert run.twist is not None
    if scene.drive == "voltage":
        channels["voltage"] = np.round(run.voltage, 3)
    else:
        channels["duty"] = truth.share
        channels["supply"] = stepped(truth.supply + 0.02 * rng.normal(size=rows), 0.01)
    stall = float(np.max(settled_current(robot.motor, np.full(robot.wheels.count, LIMIT), 0.0 * run.current[0])))
    if scene.has_current:
        noise = stall * rng.uniform(0.003, 0.02)
        channels["current"] = stepped(
            run.current + noise * rng.normal(size=run.current.shape), stall * rng.uniform(0.001, 0.01)
        )
    top = float(np.abs(run.wheel_speed).max()) or 1.0
    if scene.has_speed:
        channels["wheel_speed"] = encoder(rng, run.t, run.wheel_speed, top)
    slip = np.ones(rows) if ground_slip is None else ground_slip
    twist = run.twist * slip[:, None]
    size = np.maximum(np.abs(run.twist).max(axis=0), 0.05)
    if scene.floor in ("twist", "gyro"):
        seen = twist + rng.uniform(0.003, 0.02) * size * rng.normal(size=twist.shape)
        if scene.floor == "gyro":
            seen[:, :2] = np.nan
        channels["twist"] = seen
    if scene.floor == "pose":
        channels["pose"] = tracked(rng, run, twist)
    return Log(run.t, channels, np.arange(rows) + 2, source="simulated")


def encoder(rng: Rng, t: FloatArray, speed: FloatArray, top: float) -> FloatArray:
    """Speed as firmware gives it (steps and noise), or as differences of counts from row to row."""
    if rng.random() < 0.3 and len(t) > 2:
        angle = np.vstack(
            [np.zeros(speed.shape[1]), np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t)[:, None], axis=0)]
        )
        counts = 2.0 * np.pi / rng.choice([1024.0, 2048.0, 4096.0])
        measured = np.diff(stepped(angle, counts), axis=0) / np.diff(t)[:, None]
        return np.vstack([np.zeros(speed.shape[1]), measured])
    moving = speed != 0.0
    noisy = speed + rng.uniform(0.003, 0.02) * top * rng.normal(size=speed.shape) * moving
    return stepped(noisy, top * rng.uniform(0.002, 0.03))


def tracked(rng: Rng, run: Run, twist: FloatArray) -> FloatArray:
    """A pose as a camera on the ceiling sees it: it starts anywhere, heading wraps."""
    assert run.pose is not None
    # Without slip this is the simulated pose; with slip, the path of the slower twist.
    turned = np.diff(run.t) * 0.5 * (twist[1:, 2] + twist[:-1, 2])
    heading = np.concatenate([[0.0], np.cumsum(turned)])
    world = np.einsum("kij,kj->ki", body_to_world(heading), twist)
    middle = 0.5 * (world[1:] + world[:-1])
    path = np.vstack([np.zeros(3), np.cumsum(middle * np.diff(run.t)[:, None], axis=0)])
    pose = run.pose if np.array_equal(twist, run.twist) else path  # type: ignore[arg-type]
    noise = rng.normal(size=pose.shape) * [rng.uniform(2e-4, 2e-3)] * 3
    return pose + noise + [*rng.uniform(-2.0, 2.0, size=2), 0.0]


def plain(rng: Rng, scene: Scene) -> Log:
    return record(rng, scene, play(rng, scene))


def clean(seed: int) -> tuple[Log, Robot, Scene]:
    """(log without any fault, its robot, how it was made)."""
    rng = np.random.default_rng([seed, 1000])
    scene = random_scene(rng)
    return plain(rng, scene), scene.robot, scene
