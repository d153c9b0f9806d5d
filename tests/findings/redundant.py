"""A three-wheeled robot that drives about, by kinematics alone: what its sensors say, to be put wrong one at a time."""

from __future__ import annotations

import numpy as np

from omnidyn.logs.log import Log
from omnidyn.model.robot_file import robot_from_dict

AZIMUTHS, RADIUS, WHEEL = np.radians([60.0, 180.0, 300.0]), 0.2, 0.05

ROBOT = robot_from_dict(
    {
        "schema": 1,
        "name": "omni",
        "body": {"mass_kg": 5.0, "inertia_kg_m2": 0.1},
        "wheels": {"azimuth_deg": [60.0, 180.0, 300.0], "robot_radius_m": RADIUS, "wheel_radius_m": WHEEL},
        "motor": {
            "resistance_ohm": 1.0,
            "torque_constant_Nm_A": 0.02,
            "emf_constant_Vs_rad": 0.02,
            "gear_ratio": 20.0,
            "voltage_limit_V": 12.0,
        },
    }
)


def driven(seconds: float = 40.0, dt: float = 0.02, seed: int = 0, slip_y: float = 1.0):
    """(t, commanded twist, twist, wheel speeds, positions, heading, velocity in the room)."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / dt)) * dt
    levels = rng.uniform(-1.0, 1.0, (round(seconds / 2.0), 3)) * [0.6, 0.5, 0.9]
    command = np.repeat(levels, round(2.0 / dt), axis=0)[: len(t)]
    command[(t < 2.0) | (t > seconds - 2.0)] = 0.0
    twist = np.zeros_like(command)
    for k in range(1, len(t)):
        twist[k] = twist[k - 1] + dt / 0.2 * (command[k - 1] - twist[k - 1])
    wheels = twist @ (np.column_stack([-np.sin(AZIMUTHS), np.cos(AZIMUTHS), np.full(3, RADIUS)]) / WHEEL).T
    twist = twist * [1.0, slip_y, 1.0]
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (twist[1:, 2] + twist[:-1, 2]) * dt)])
    room = (twist[:, 0] + 1j * twist[:, 1]) * np.exp(1j * heading)
    place = np.concatenate([[0.0], np.cumsum(0.5 * (room[1:] + room[:-1]) * dt)])
    return t, command, twist, wheels, place, heading, room


def recorded(seed: int = 0, slip_y: float = 1.0, **parts) -> Log:
    """The log of `driven` with noise; parts: channel -> what it says instead, None: without it."""
    rng = np.random.default_rng(seed + 1)
    t, command, twist, wheels, place, heading, _ = driven(seed=seed, slip_y=slip_y)
    channels = {
        "wheel_speed": wheels + 0.05 * rng.normal(size=wheels.shape),
        "twist": twist + 0.004 * rng.normal(size=twist.shape),
        "pose": np.column_stack([place.real, place.imag, heading]) + 0.0005 * rng.normal(size=twist.shape),
        "twist_command": command,
    }
    for name, change in parts.items():
        channels[name] = None if change is None else change(channels[name])
    kept = {name: values for name, values in channels.items() if values is not None}
    return Log(t, kept, np.arange(len(t)) + 2)
