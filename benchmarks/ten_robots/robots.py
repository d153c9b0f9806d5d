"""Ten robots as people have them, what each logs, and the two commands that their owners type."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.ten_robots.world import BOX, Motion, World, currents, drive

SECONDS = 20.0  # [s] of a log


@dataclass(frozen=True)
class Sensors:
    """What is logged, and how well: standard deviations; None where it is not logged. counts: of an encoder a turn."""

    speeds: float | None = None  # [rad/s] wheel speeds
    counts: int = 0
    gyro: float | None = None  # [rad/s]
    capture: tuple[float, float] | None = None  # [m], [rad]
    amps: float | None = None  # [A]
    duty: bool = False  # PWM of a battery whose voltage is logged, else volts
    loop: bool = False  # set speeds of the firmware's loop, and no volts


@dataclass(frozen=True)
class Case:
    """A robot, its logs and its owner. init, facts: what the owner types after `init NAME` and after `identify LOG`."""

    name: str
    world: World
    sensors: Sensors
    init: tuple[str, ...]
    facts: tuple[str, ...] = ()
    rate: float = 50.0  # [Hz] of the log
    words: str = ""
    seconds: float = SECONDS  # of a log


def _numbers(values: tuple[float, ...]) -> str:
    return ",".join(f"{value:g}" for value in values) if len(set(values)) > 1 else f"{values[0]:g}"


def init_options(world: World, *more: str) -> tuple[str, ...]:
    """What a ruler and a scale tell."""
    where = ("--mecanum",) if world.roller else ("--azimuth", ",".join(f"{a:g}" for a in world.azimuth))
    return (
        *where,
        "--wheel-radius",
        _numbers(world.wheel_radius),
        "--robot-radius",
        _numbers(world.robot_radius),
        "--mass",
        f"{world.mass:g}",
        "--voltage-limit",
        f"{world.voltage_limit:g}",
        *more,
    )


def _rotors(share: float, mass: float, radius: float, gear: float, wheels: int) -> float:
    """Inertia of a rotor [kg m2] where all of them weigh `share` of the mass on the move along x."""
    return share * mass * radius**2 / (gear**2 * wheels / 2.0)


def _counts(turn: int) -> tuple[str, ...]:
    return ("--assume", f"a=ticks/{turn}")


PWM = ("--assume", "d=duty/255")
THREE, FOUR = (60.0, 180.0, 300.0), (45.0, 135.0, 225.0, 315.0)
SIX = (30.0, 90.0, 150.0, 210.0, 270.0, 330.0)
MECANUM = {"azimuth": (90.0, -90.0, 90.0, -90.0), "roller": (-45.0, 45.0, 45.0, -45.0)}


def cases() -> tuple[Case, ...]:
    """The ten."""
    kiwi = World(
        THREE,
        (0.03,) * 3,
        (0.11,) * 3,
        2.4,
        0.016,
        2.2,
        0.0105,
        24.0,
        12.0,
        (3.9, 3.9, 0.2),
        (1.2, 1.2, 0.012),
    )
    duty = World(
        THREE,
        (0.029,) * 3,
        (0.12,) * 3,
        3.1,
        0.022,
        2.9,
        0.014,
        30.0,
        12.0,
        (5.2, 4.4, 0.24),
        (0.9, 0.9, 0.01),
        rotor_inertia=_rotors(0.2, 3.1, 0.029, 30.0, 3),
    )
    square = World(
        FOUR,
        (0.05,) * 4,
        (0.2,) * 4,
        6.2,
        0.13,
        1.6,
        0.021,
        30.0,
        12.0,
        (14.0, 14.0, 1.2),
        (3.0, 3.0, 0.12),
        rotor_inertia=1.5e-6,
    )
    captured = World(
        FOUR,
        (0.04,) * 4,
        (0.15,) * 4,
        4.0,
        0.05,
        2.1,
        0.016,
        25.0,
        11.1,
        (7.0, 8.5, 0.5),
        (1.5, 1.5, 0.03),
    )
    mecanum = World(
        **MECANUM,
        wheel_radius=(0.05,) * 4,
        robot_radius=(0.3,) * 4,
        mass=7.5,
        inertia=0.3,
        resistance=1.1,
        torque_constant=0.02,
        gear_ratio=26.0,
        voltage_limit=12.0,
        coulomb=(8.0, 14.0, 1.8),
        viscous=(2.5, 2.5, 0.2),
        rotor_inertia=_rotors(0.2, 7.5, 0.05, 26.0, 8),
    )
    current = World(
        **MECANUM,
        wheel_radius=(0.038,) * 4,
        robot_radius=(0.24,) * 4,
        mass=5.0,
        inertia=0.11,
        resistance=1.7,
        torque_constant=0.017,
        gear_ratio=20.0,
        voltage_limit=12.0,
        coulomb=(7.5, 11.0, 1.1),
        viscous=(2.0, 2.0, 0.1),
        rotor_inertia=_rotors(0.2, 5.0, 0.038, 20.0, 8),
    )
    six = World(
        SIX,
        (0.06,) * 6,
        (0.25,) * 6,
        15.0,
        0.5,
        1.4,
        0.03,
        28.0,
        24.0,
        (26.0, 26.0, 3.4),
        (6.0, 6.0, 0.4),
    )
    uneven = World(
        THREE,
        (0.03, 0.03, 0.034),
        (0.11, 0.11, 0.14),
        2.8,
        0.02,
        2.4,
        0.011,
        24.0,
        12.0,
        (4.2, 4.2, 0.24),
        (1.0, 1.0, 0.012),
    )
    looped = World(
        FOUR,
        (0.05,) * 4,
        (0.18,) * 4,
        5.5,
        0.09,
        1.5,
        0.02,
        30.0,
        12.0,
        (12.0, 10.0, 0.9),
        (2.5, 2.5, 0.08),
        loop=(0.6, 4.0, 100.0),
    )
    box = World(
        (180.0, -60.0, 60.0),
        (0.035,) * 3,
        (0.1,) * 3,
        1.5,
        0.0095,
        1.69,
        0.0085,
        19.0,
        8.0,
        (2.2, 1.5, 0.099),
        (0.94, 0.96, 0.01),
        shape=BOX,
        rotor_inertia=_rotors(0.2, 1.5, 0.035, 19.0, 3),
    )
    loop = ",".join(f"{value:g}" for value in looped.loop)
    return (
        Case("kiwi", kiwi, Sensors(speeds=0.15), init_options(kiwi), words="3 omni; volts; wheel speeds"),
        Case(
            "arduino",
            duty,
            Sensors(counts=1440, gyro=0.02, duty=True),
            init_options(duty),
            (*_counts(1440), *PWM),
            words="3 omni, rotors 20 %; PWM, counts, gyro",
        ),
        Case(
            "square",
            square,
            Sensors(counts=2048),
            init_options(square),
            _counts(2048),
            100.0,
            "4 omni at 45 deg, rotors 18 %; volts, counts",
        ),
        Case(
            "studio",
            captured,
            Sensors(capture=(0.001, 0.003), duty=True),
            init_options(captured),
            PWM,
            100.0,
            "4 omni at 45 deg; PWM, motion capture",
        ),
        Case(
            "mecanum",
            mecanum,
            Sensors(counts=1024, capture=(0.002, 0.004), duty=True),
            init_options(mecanum),
            (*_counts(1024), *PWM),
            words="mecanum, rotors 20 %; PWM, counts, motion capture",
        ),
        Case(
            "currents",
            current,
            Sensors(speeds=0.1, amps=0.05),
            init_options(current),
            (),
            100.0,
            "mecanum, rotors 20 %; volts, wheel speeds, currents",
        ),
        Case(
            "six", six, Sensors(speeds=0.08, gyro=0.01), init_options(six), words="6 wheels; volts, wheel speeds, gyro"
        ),
        Case(
            "uneven",
            uneven,
            Sensors(speeds=0.12, gyro=0.02),
            init_options(uneven),
            words="3 omni, unequal radii; volts, wheel speeds, gyro",
        ),
        Case(
            "firmware",
            looped,
            Sensors(speeds=0.1, amps=0.05, loop=True),
            init_options(looped, "--speed-loop", loop),
            (),
            100.0 / 3.0,
            "4 omni behind a loop of 100 Hz, logged at 33 Hz; set speeds, speeds, currents",
        ),
        Case(
            "paper",
            box,
            Sensors(speeds=0.15, gyro=0.02, duty=True),
            init_options(box, "--friction", "axes"),
            PWM,
            words="3 omni, the paper's box, rotors 20 %; PWM, wheel speeds, gyro",
        ),
    )


def commands(case: Case, rng: np.random.Generator) -> np.ndarray:
    """What a person sends: at rest, then directions and turns at levels of their own, some rest between. (rows, n)."""
    world, rows = case.world, round(case.seconds * case.rate)
    radii = np.array(world.wheel_radius)
    top = 0.85 * world.voltage_limit / np.max(world.emf)  # [m/s] of a rim
    out = [np.zeros((round(0.5 * case.rate), radii.size))]
    while sum(map(len, out)) < rows:
        kind, angle, level = rng.random(), rng.uniform(-np.pi, np.pi), rng.uniform(0.25, 1.0)
        twist = np.array([np.cos(angle), np.sin(angle), 0.0]) if kind < 0.55 else np.array([0.0, 0.0, np.sign(angle)])
        if kind > 0.75:
            twist = np.array([np.cos(angle), np.sin(angle), rng.normal() / max(world.robot_radius)])
        rim = twist @ world.G
        rim = rim / np.abs(rim).max() * top * level * (rng.random() > 0.12)
        own = rim / radii if case.sensors.loop else rim * world.emf
        out.append(np.repeat(own[None], round(rng.uniform(0.2, 1.5) * case.rate), axis=0))
    return np.concatenate(out)[:rows]


def _own(case: Case) -> int:
    """A number of each robot: with the same draws for all, one unlucky noise would count ten times."""
    return zlib.crc32(case.name.encode())


def simulated(case: Case, seed: int) -> tuple[Motion, np.ndarray, np.ndarray]:
    """(motion, what was commanded (rows, n), voltage of the battery (rows,)); the last row repeats the one before."""
    rng = np.random.default_rng([seed, _own(case)])
    asked = commands(case, rng)
    rows, limit = len(asked), case.world.voltage_limit
    battery = np.full(rows, limit)
    if case.sensors.duty:
        sag = np.abs(asked).mean(axis=1) / limit
        battery = np.round(limit * (1.0 - 0.06 * np.linspace(0.0, 1.0, rows) - 0.05 * sag), 2)
        asked = np.round(np.clip(asked / limit, -1.0, 1.0) * 255.0)
    applied = asked / 255.0 * battery[:, None] if case.sensors.duty else asked
    return drive(case.world, applied, 1.0 / case.rate, case.sensors.loop), asked, battery


def write_log(case: Case, seed: int, path: Path) -> None:
    """One log as its owner writes it: own names, own units, own digits."""
    motion, asked, battery = simulated(case, seed)
    rng, world, sensors = np.random.default_rng([seed, _own(case), 1]), case.world, case.sensors
    rows, wheels, radii = len(asked), asked.shape[1], np.array(world.wheel_radius)
    twist, path_of, pose = motion.twist[:-1], motion.path[:-1], motion.pose[:-1]
    each: Callable[[str], list[str]] = lambda words: [words.format(i + 1) for i in range(wheels)]  # noqa: E731
    columns: list[tuple[list[str], np.ndarray, str]] = []
    if sensors.duty:
        columns = [
            (["time_ms"], np.round(motion.t[:-1, None] * 1e3, 3), "%.10g"),
            (each("pwm{}"), asked, "%d"),
            (["vbat_V"], battery[:, None], "%.2f"),
        ]
    elif sensors.loop:
        columns = [(["t_s"], motion.t[:-1, None], "%.6f"), (each("w{}_cmd_rad_s"), asked, "%.4f")]
    else:
        columns = [(["t_s"], motion.t[:-1, None], "%.6f"), (each("u{}_V"), asked, "%.5f")]
    if sensors.speeds is not None:
        measured = twist @ world.G / radii + sensors.speeds * rng.normal(size=(rows, wheels))
        columns.append((each("w{}_rad_s"), measured, "%.3f"))
    if sensors.counts:
        turned = path_of @ world.G / radii + rng.uniform(-9.0, 9.0, wheels)
        columns.append((each("enc{}"), np.floor(turned * sensors.counts / (2.0 * np.pi)), "%d"))
    if sensors.gyro is not None:
        columns.append((["gyro_z_rad_s"], twist[:, 2:] + sensors.gyro * rng.normal(size=(rows, 1)), "%.4f"))
    if sensors.capture is not None:
        place, angle = sensors.capture
        c, s, x0 = np.cos(0.7), np.sin(0.7), np.array([1.2, -0.4])  # where the robot stands when the log begins
        world_pose = np.column_stack([pose[:, :2] @ np.array([[c, s], [-s, c]]) + x0, pose[:, 2] + 0.7])
        noisy = world_pose + np.array([place, place, angle]) * rng.normal(size=(rows, 3))
        columns += [(["x_m", "y_m"], noisy[:, :2], "%.5f"), (["yaw_rad"], noisy[:, 2:], "%.5f")]
    if sensors.amps is not None:
        drawn = currents(world, twist, motion.voltage)
        columns.append((each("i{}_A"), drawn + sensors.amps * rng.normal(size=(rows, wheels)), "%.3f"))
    header = ",".join(name for names, _, _ in columns for name in names)
    formats = [form for names, _, form in columns for _ in names]
    np.savetxt(path, np.hstack([values for _, values, _ in columns]), formats, ",", header=header, comments="")
