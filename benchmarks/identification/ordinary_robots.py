"""Robots as people have them, and their logs: 60 s at 100 Hz each, by simulators that share no code with omnidyn.

Friction of the body by benchmarks/ten_robots/world.py (exact stops), friction at the wheels by RK4 with tanh. A person
drives with little patience: short commands, so that a stop or a reversal falls into one row of fifty or so.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from benchmarks.ten_robots.robots import Sensors, init_options
from benchmarks.ten_robots.world import World, drive

SECONDS, RATE = 60.0, 100.0  # of a log
SPANS = (0.15, 0.9)  # [s] of a command
FINE_STEP = 2e-4  # [s] of RK4 where a robot forgets within 2 ms
SUBSTEPS, SMOOTHED = 50, 2e-3  # of a row, and [m/s] of tanh, for friction at the wheels
FOUR, THREE, FIVE = (45.0, 135.0, 225.0, 315.0), (60.0, 180.0, 300.0), (0.0, 72.0, 144.0, 216.0, 288.0)
MECANUM = {"azimuth": (90.0, -90.0, 90.0, -90.0), "roller": (-45.0, 45.0, 45.0, -45.0)}


@dataclass(frozen=True)
class Robot:
    """A robot and its sensors. at_wheels [N]: friction at the rim of each wheel, in the place of that of the body."""

    name: str
    words: str
    world: World
    sensors: Sensors
    at_wheels: float = 0.0

    @property
    def init(self) -> tuple[str, ...]:
        """What the owner types after `init NAME`."""
        return init_options(self.world, *(("--friction", "wheels") if self.at_wheels else ()))

    @property
    def facts(self) -> tuple[str, ...]:
        """What the owner types after `identify LOG`."""
        return ("--assume", f"a=ticks/{self.sensors.counts}") if self.sensors.counts else ()


def robots() -> tuple[Robot, ...]:
    """Those of the table."""
    four = World(FOUR, (0.05,) * 4, (0.19,) * 4, 6.2, 0.11, 1.6, 0.021, 20.0, 12.6, (14.0, 14.0, 1.4), (2.7, 2.7, 0.08))
    three = World(
        THREE, (0.03,) * 3, (0.11,) * 3, 2.4, 0.016, 2.2, 0.0105, 24.0, 12.0, (3.9, 3.9, 0.2), (1.2, 1.2, 0.012)
    )
    five = World(FIVE, (0.04,) * 5, (0.17,) * 5, 7.0, 0.12, 1.8, 0.018, 22.0, 12.0, (13.0, 13.0, 1.1), (3.0, 3.0, 0.08))
    mecanum = World(
        **MECANUM,
        wheel_radius=(0.0508,) * 4,
        robot_radius=(0.35,) * 4,
        mass=12.0,
        inertia=0.45,
        resistance=0.9,
        torque_constant=0.03,
        gear_ratio=14.0,
        voltage_limit=24.0,
        coulomb=(8.0, 14.0, 1.2),
        viscous=(4.0, 4.0, 0.5),
    )
    lekiwi = World(
        (60.0, 180.0, -60.0),
        (0.05,) * 3,
        (0.125,) * 3,
        2.5,
        0.02,
        4.4,
        0.005,
        345.0,
        12.0,
        (4.9, 4.9, 0.31),
        (1.0, 1.0, 0.016),
    )
    turning = float((four.push * four.emf) @ np.array(four.robot_radius) ** 2 + four.viscous[2])  # [N m s]
    quick = World(
        FOUR, (0.05,) * 4, (0.19,) * 4, 6.2, 2e-3 * turning, 1.6, 0.021, 20.0, 12.6, (14.0, 14.0, 1.4), (2.7, 2.7, 0.08)
    )
    wheels = World(
        THREE, (0.03,) * 3, (0.11,) * 3, 2.4, 0.016, 2.2, 0.0105, 24.0, 12.0, (0.0, 0.0, 0.0), (1.2, 1.2, 0.012)
    )
    return (
        Robot("four", "four omni wheels; volts, wheel speeds", four, Sensors(speeds=0.05)),
        Robot("three", "three omni wheels; volts, counts of 1440", three, Sensors(counts=1440)),
        Robot("five", "five omni wheels; volts, wheel speeds, gyroscope", five, Sensors(speeds=0.05, gyro=0.01)),
        Robot(
            "mecanum",
            "mecanum; volts, counts of 4096, gyroscope, motion capture: four latencies",
            mecanum,
            Sensors(counts=4096, gyro=0.01, capture=(0.001, 0.0014)),
        ),
        Robot("lekiwi", "LeKiwi, driven by volts; wheel speeds", lekiwi, Sensors(speeds=0.03)),
        Robot("quick", "four omni wheels, yaw forgets within 2 ms; volts, wheel speeds", quick, Sensors(speeds=0.05)),
        Robot("wheels", "three omni wheels, friction at the wheels: the exception", wheels, Sensors(speeds=0.05), 1.6),
    )


def voltages(world: World, rng: np.random.Generator) -> np.ndarray:
    """Rest first, then directions and turns at levels of their own, some rest between. Shape (rows, wheels) [V]."""
    rows = round(SECONDS * RATE)
    top = 0.85 * world.voltage_limit
    out = [np.zeros((round(0.5 * RATE), len(world.azimuth)))]
    while sum(map(len, out)) < rows:
        kind, angle, level = rng.random(), rng.uniform(-np.pi, np.pi), rng.uniform(0.25, 1.0)
        moves, turns = float(kind < 0.6 or kind > 0.8), float(kind >= 0.6) * rng.normal() / max(world.robot_radius)
        rim = np.array([moves * np.cos(angle), moves * np.sin(angle), turns]) @ world.G
        volts = rim / max(np.abs(rim).max(), 1e-9) * top * level * (rng.random() > 0.15)
        out.append(np.repeat(volts[None], round(rng.uniform(*SPANS) * RATE), axis=0))
    return np.concatenate(out)[:rows]


@numba.njit(cache=True)
def _with_wheels(volts, dt, substeps, smooth, G, inverse, mass, push, emf, viscous, level, states):
    """RK4 of a robot whose friction is `level` tanh(s/smooth) at the rim of each wheel; states (rows + 1, 6)."""
    h, y, slopes = dt / substeps, np.zeros(6), np.zeros((4, 6))
    for n in range(len(volts)):
        for _ in range(substeps):
            for stage in range(4):
                z = y.copy()
                if stage > 0:
                    z += slopes[stage - 1] * (h if stage == 3 else 0.5 * h)
                force = -viscous * z[:3]
                force[0] += mass * z[2] * z[1]
                force[1] -= mass * z[2] * z[0]
                for i in range(G.shape[1]):
                    s = G[0, i] * z[0] + G[1, i] * z[1] + G[2, i] * z[2]
                    force += G[:, i] * (push[i] * (volts[n, i] - emf[i] * s) - level * np.tanh(s / smooth))
                slopes[stage, :3] = inverse @ force
                slopes[stage, 3:] = z[:3]
            y += h / 6.0 * (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3])
        states[n + 1] = y


def driven(robot: Robot, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(volts (rows, wheels), twist, path and pose (rows, 3)) of a log; the path is the integral of the twist."""
    rng = np.random.default_rng([seed, zlib.crc32(robot.name.encode())])
    world = robot.world
    volts = np.round(voltages(world, rng), 2)
    if not robot.at_wheels:
        motion = drive(world, volts, 1.0 / RATE, step=FINE_STEP if robot.name == "quick" else 1e-3)
        return volts, motion.twist[:-1], motion.path[:-1], motion.pose[:-1]
    states = np.zeros((len(volts) + 1, 6))
    _with_wheels(
        volts,
        1.0 / RATE,
        SUBSTEPS,
        SMOOTHED,
        world.G,
        np.linalg.inv(world.M),
        world.mass,
        world.push,
        world.emf,
        np.array(world.viscous),
        robot.at_wheels,
        states,
    )
    return volts, states[:-1, :3], states[:-1, 3:], np.zeros((len(volts), 3))


def stops(robot: Robot, twist: np.ndarray) -> float:
    """The share of rows in which something that moves comes to rest or turns round: an axis, of `at_wheels` a wheel."""
    speed = twist @ robot.world.G if robot.at_wheels else twist
    slow = SMOOTHED if robot.at_wheels else 0.0
    before, after = speed[:-1], speed[1:]
    ends = (np.abs(before) > slow) & ((np.abs(after) <= slow) | (before * after < 0.0))
    return float(ends.any(axis=1).mean())


def write_log(robot: Robot, seed: int, path: Path) -> float:
    """One log as its owner writes it; the share of its rows that hold a stop."""
    volts, twist, way, pose = driven(robot, seed)
    rng, world, sensors = np.random.default_rng([seed, zlib.crc32(robot.name.encode()), 1]), robot.world, robot.sensors
    rows, wheels, radii = len(volts), volts.shape[1], np.array(world.wheel_radius)
    columns = [(["t_s"], np.arange(rows)[:, None] / RATE, "%.6f"), (_each("u{}_V", wheels), volts, "%.2f")]
    if sensors.speeds is not None:
        measured = twist @ world.G / radii + sensors.speeds * rng.normal(size=(rows, wheels))
        columns.append((_each("w{}_rad_s", wheels), measured, "%.4f"))
    if sensors.counts:
        turned = way @ world.G / radii + rng.uniform(-9.0, 9.0, wheels)
        columns.append((_each("a{}", wheels), np.floor(turned * sensors.counts / (2.0 * np.pi)), "%d"))
    if sensors.gyro is not None:
        columns.append((["omega_rad_s"], twist[:, 2:] + sensors.gyro * rng.normal(size=(rows, 1)), "%.5f"))
    if sensors.capture is not None:
        place, angle = sensors.capture
        noisy = pose + np.array([place, place, angle]) * rng.normal(size=(rows, 3))
        columns += [(["x_m", "y_m"], noisy[:, :2], "%.5f"), (["heading_rad"], noisy[:, 2:], "%.5f")]
    header = ",".join(name for names, _, _ in columns for name in names)
    formats = [form for names, _, form in columns for _ in names]
    np.savetxt(path, np.hstack([values for _, values, _ in columns]), formats, ",", header=header, comments="")
    return stops(robot, twist)


def _each(words: str, wheels: int) -> list[str]:
    return [words.format(i + 1) for i in range(wheels)]
