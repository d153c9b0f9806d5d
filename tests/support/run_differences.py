"""Derivatives of a run as differences of whole runs: central, two widths, extrapolated (Richardson)."""

from collections.abc import Callable

import numpy as np

from omnidyn.model.keys import Key

AGREES = 1e-5
CHANNELS = ("twist", "pose", "current")
BODY = ["body.mass_kg", "body.inertia_kg_m2", "wheels.wheel_radius_m", "wheels.robot_radius_m"]
MOTOR = ["motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad", "motor.resistance_ohm"]


def differences(run: Callable, robot, key, width, watched=slice(None)):
    """(twist, pose, current) by key, of `run(robot)`; asserts that all four runs show the same events.

    watched: axes whose dry friction makes a change of sign an event.
    """
    value, kept = Key.parse(key).get(robot), {}
    for steps in (-2, -1, 1, 2):
        kept[steps] = run(Key.parse(key).set(robot, value + steps * width * value))
    pattern = [np.sign(one.twist[:, watched]).tolist() for one in kept.values()]
    assert all(p == pattern[0] for p in pattern), f"events do not pair up: {key}"
    assert len({getattr(one, "events", 0) for one in kept.values()}) == 1

    def slope(channel, n):
        return (getattr(kept[n], channel) - getattr(kept[-n], channel)) / (2 * n * width * value)

    return [(4 * slope(channel, 1) - slope(channel, 2)) / 3 for channel in CHANNELS]


def worst(found, expected):
    """Largest error of a derivative, relative to its largest value; 0 where both are exactly 0."""
    error, size = np.abs(found - expected).max(), np.abs(expected).max()
    return error / size if size > 0.0 else error


def held(*rows):
    """Voltage rows from (how often, voltages)."""
    return np.array([row for count, row in rows for _ in range(count)], dtype=float)
