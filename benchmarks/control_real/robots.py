"""The robots of the bench: numbers that the plant and the robot file of omnidyn are both made of; and a random one."""

from __future__ import annotations

from typing import Any

import numpy as np

import omnidyn
from omnidyn.model.drive import Drive
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels

Numbers = dict[str, Any]

NUMBERS: dict[str, Numbers] = {
    "axebot": {
        "azimuth": (180.0, -60.0, 60.0),
        "lever": 0.1,
        "radius": 0.035,
        "gear": 19.0,
        "constant": 0.0059,
        "resistance": 1.69,
        "mass": 1.5,
        "inertia": 0.025,
        "turning": False,
        "viscous": (0.94, 0.96, 0.01),
        "coulomb": (2.2, 1.5, 0.099),
        "volts": 6.0,
        "counts": 2048,
    },
    "xdrive": {
        "azimuth": (45.0, 135.0, -135.0, -45.0),
        "lever": 0.2,
        "radius": 0.05,
        "gear": 19.0,
        "constant": 0.022,
        "resistance": 1.0,
        "mass": 10.0,
        "inertia": 0.25,
        "rotor": 1e-6,
        "amperes": 8.0,
        "disc": (18.0, 14.0),
        "disc_breakaway": (19.8, 15.4),
        "disc_viscous": 3.0,
        "viscous": (0.0, 0.0, 0.05),
        "coulomb": (0.0, 0.0, 1.6),
        "breakaway": (0.0, 0.0, 1.76),
        "volts": 12.0,
        "latency": 0.02,
        "counts": 4096,
    },
    "mecanum": {
        "azimuth": (90.0, -90.0, 90.0, -90.0),
        "roller": (-45.0, 45.0, 45.0, -45.0),
        "lever": 0.45,
        "radius": 0.0762,
        "gear": 20.0,
        "constant": 0.018,
        "resistance": 1.2,
        "mass": 20.0,
        "inertia": 0.8,
        "viscous": (6.0, 8.0, 0.6),
        "coulomb": (18.0, 24.0, 3.2),
        "breakaway": (27.0, 36.0, 4.8),
        "volts": 12.6,
        "sag": 0.05,
        "duty": True,
        "weak": (0.9, 1.0, 1.0, 1.0),
        "counts": 2048,
    },
}
# A drive with a speed loop in its firmware: slower than the others, so are its paths.
NUMBERS["lekiwi"] = {
    "azimuth": (60.0, 180.0, -60.0),
    "lever": 0.125,
    "radius": 0.05,
    "gear": 345.0,
    "constant": 0.0032,
    "emf": 0.0074,
    "resistance": 4.4,
    "mass": 2.5,
    "inertia": 0.02,
    "rotor": 2e-9,
    "disc": (4.9, 4.9),
    "disc_viscous": 1.0,
    "viscous": (0.0, 0.0, 0.016),
    "coulomb": (0.0, 0.0, 0.31),
    "volts": 12.0,
    "loop": (5.0, 25.0, 1000.0),
    "counts": 4096,
}
SLOWER = {"lekiwi": 3.0}  # times as much time that its paths take
SPREAD = 0.3  # a random robot has each of its numbers within this share of one of the three
CHANGED = ("radius", "gear", "constant", "resistance", "mass", "inertia", "viscous", "coulomb", "disc", "disc_viscous")
COUNTS = (1024, 2048, 4096)


def random_numbers(seed: int) -> Numbers:
    """A robot drawn from a seed: one of the three, its numbers changed, latency and breakaway drawn anew."""
    random = np.random.default_rng(seed)
    numbers = dict(NUMBERS[str(random.choice(["axebot", "xdrive", "mecanum"]))])
    for name in CHANGED:
        if name in numbers:
            value = np.asarray(numbers[name], float)
            changed = value * random.uniform(1.0 - SPREAD, 1.0 + SPREAD, value.shape)
            numbers[name] = tuple(changed.tolist()) if changed.ndim else float(changed)
    more = random.uniform(1.0, 1.5)
    for name, hold in (("coulomb", "breakaway"), ("disc", "disc_breakaway")):
        if name in numbers:
            numbers[hold] = tuple(more * level for level in numbers[name])
    return numbers | {"latency": float(random.uniform(0.0, 0.04)), "counts": int(random.choice(COUNTS))}


def robot_of(name: str, numbers: Numbers) -> Robot:
    """What omnidyn is told of it: all but a weak motor and a battery that sags."""
    if name == "lekiwi":
        known = omnidyn.load_robot(name)
        return known.replace(drive=known.drive.replace(ki=numbers["loop"][1]))
    if name == "axebot":
        return omnidyn.load_robot(name)
    wheels = {"roller_angle_deg": numbers["roller"]} if "roller" in numbers else {}
    friction: dict[str, Any] = {}
    if "disc" in numbers:
        cx, cy = numbers["disc"]
        friction["direction"] = DirectionFriction(
            coulomb=(cx, cy),
            breakaway=numbers["disc_breakaway"],
            viscous=numbers["disc_viscous"],
            yaw_coulomb=numbers["coulomb"][2],
            yaw_breakaway=numbers["breakaway"][2],
            yaw_viscous=numbers["viscous"][2],
        )
    else:
        levels = {key: numbers[key] for key in ("viscous", "coulomb", "breakaway") if key in numbers}
        friction["axes"] = AxesFriction(**levels)
    duty = numbers.get("duty", False)
    return Robot(
        name=name,
        body=Body(mass=numbers["mass"], inertia=numbers["inertia"], rotating_frame=numbers.get("turning", True)),
        wheels=Wheels(
            azimuth_deg=numbers["azimuth"], robot_radius=numbers["lever"], wheel_radius=numbers["radius"], **wheels
        ),
        motor=Motor(
            resistance=numbers["resistance"],
            torque_constant=numbers["constant"],
            emf_constant=numbers["constant"],
            gear_ratio=numbers["gear"],
            voltage_limit=numbers["volts"],
            current_limit=numbers.get("amperes"),
            rotor_inertia=numbers.get("rotor", 0.0),
        ),
        drive=Drive(
            kind="duty" if duty else "voltage",
            supply=numbers["volts"] if duty else None,
            latency=numbers.get("latency", 0.0),
        ),
        friction=Friction(**friction),
        priors={},
    )
