"""What tests of exports share: robots with an exact step, robots of `init`, volts, C that is compiled and run."""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import omnidyn
from omnidyn.model.first_guess import DIRECTION, even_azimuths, first_guess, mecanum_wheels
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import Floor
from omnidyn.model.wheels import Wheels

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror")
STRICT = ("-std=c99", "-O2", *WARNINGS)


def exact_robot(seed: int) -> Robot:
    """A robot with an exact step: 3 to 6 wheels, breakaway, rotors, dead band, winding inductance by its seed."""
    random, plain = Random(f"exact {seed}"), omnidyn.load_robot("axebot")

    def around(value: float) -> float:
        return float(f"{value * random.uniform(0.6, 1.4):.6g}")

    count, first = 3 + seed % 4, random.uniform(-180.0, 180.0)
    azimuth = [(first + 360.0 * k / count + 180.0) % 360.0 - 180.0 for k in range(count)]
    wheels = Wheels(
        azimuth_deg=tuple(azimuth),
        robot_radius=around(0.1),
        wheel_radius=around(0.035),
        wheel_inertia=around(1e-5) if seed % 3 == 0 else 0.0,
    )
    coulomb = tuple(map(around, (2.2, 1.5, 0.099)))
    friction = Friction(
        axes=AxesFriction(
            viscous=tuple(map(around, (0.94, 0.96, 0.01))),
            coulomb=coulomb,
            breakaway=tuple(c * random.uniform(1.0, 1.5) for c in coulomb) if seed % 2 else None,
        )
    )
    motor = plain.motor.replace(
        resistance=around(1.69),
        gear_ratio=around(19.0),
        rotor_inertia=around(1e-7) if seed % 3 == 1 else 0.0,
        inductance=around(10.0 ** random.uniform(-4.0, -2.0)),
        electrical=DYNAMIC if seed % 4 == 3 else "quasi-static",
    )
    drive = plain.drive.replace(dead_band=around(0.2)) if seed % 5 == 2 else plain.drive
    body = plain.body.replace(mass=around(1.5), inertia=around(0.025))
    return Robot(name=f"exact {seed}", body=body, wheels=wheels, motor=motor, drive=drive, friction=friction)


def program(robot: Robot, seed: int, rows: int = 400) -> np.ndarray:
    """Volts, beyond the limit now and then, held for some rows, with rest in between. Shape (rows, wheels)."""
    rng = np.random.default_rng(seed)
    levels = rng.uniform(-8.0, 8.0, (rows // 20 + 1, robot.wheels.count)) * rng.choice(
        [0.0, 0.1, 1.0], (rows // 20 + 1, 1)
    )
    return np.repeat(levels, 20, axis=0)[:rows]


def init_robot(seed: int) -> Robot:
    """A robot as `omnidyn init` writes it, with what `identify` then makes of it by its seed.

    3 to 6 omni wheels or 4 mecanum ones, the turning frame; friction a box, a disc, an ellipse, a plain one, or an
    ellipse that holds more than it slides with; every third a latency of whole rows of 2^-9 s, a dead band every other.
    """
    random = Random(f"init {seed}")
    wheel_radius, robot_radius = random.uniform(0.02, 0.06), random.uniform(0.08, 0.25)
    count = 3 + seed % 5
    if count == 7:
        wheels = mecanum_wheels(wheel_radius, robot_radius)
    else:
        wheels = Wheels(azimuth_deg=even_azimuths(count), wheel_radius=wheel_radius, robot_radius=robot_radius)
    shape = ("axes", DIRECTION, "ellipse", "plain", "breakaway")[seed * 3 % 5]
    robot = first_guess(
        f"init {seed}",
        wheels,
        random.uniform(1.0, 20.0),
        random.choice((6.0, 12.0, 24.0)),
        "axes" if shape == "axes" else DIRECTION,
    )
    along = robot.friction.direction
    levels = tuple(level * random.uniform(0.6, 1.4) for level in along.coulomb)
    if shape in ("ellipse", "plain", "breakaway"):
        hold = tuple(level * random.uniform(1.1, 1.5) for level in levels) if shape == "breakaway" else None
        along = along.replace(coulomb=levels, breakaway=hold, ellipse="plain" if shape == "plain" else "dissipation")
        robot = robot.replace(friction=Friction(direction=along))
    latency = random.randrange(1, 20) * 2.0**-9 if seed % 3 == 0 else 0.0
    band = 0.05 * float(np.max(robot.motor.voltage_limit)) if seed % 2 else 0.0
    return robot.replace(drive=robot.drive.replace(latency=latency, dead_band=band), priors={})


class Stepper:
    """omnidyn_step of an exported c-model, compiled with every warning an error."""

    def __init__(self, robot: Robot, folder: Path, precision: str = "double", **options: Any) -> None:
        made = omnidyn.export.c_model(robot, precision=precision, **options)
        made.write(folder)
        command = ["gcc", *STRICT, "-O1", "-shared", "-fPIC", "-o", "step.so", "omnidyn_step.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        self.real, real = (np.float32, ctypes.c_float) if precision == "single" else (np.float64, ctypes.c_double)
        self._step = ctypes.CDLL(str(folder / "step.so")).omnidyn_step
        memory = re.search(r"OMNIDYN_MEMORY (\d+)", made.files["omnidyn_step.h"])
        self.sizes = [3, 3, *([int(memory[1])] if memory else [3] if robot.motor.electrical == DYNAMIC else [])]
        self.states = len(self.sizes)
        self._step.argtypes = [ctypes.c_void_p, real, *[ctypes.c_void_p] * self.states]
        self._step.restype = ctypes.c_int

    def run(self, volts: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """(twist, pose) after each row, the start in row 0. Shape (rows + 1, 3) each."""
        state = [np.zeros(size, self.real) for size in self.sizes]
        volts = np.ascontiguousarray(volts, self.real)
        out = np.zeros((len(volts) + 1, 2, 3))
        for k in range(len(volts)):
            assert self._step(volts[k].ctypes.data, dt, *(array.ctypes.data for array in state)) == 0
            out[k + 1] = state[:2]
        return out[:, 0], out[:, 1]


def sloping(robot: Robot) -> Robot:
    """The same robot on a floor that is not level."""
    return robot.replace(name=f"{robot.name} on a slope", floor=Floor(tilt=2.0, downhill=30.0))
