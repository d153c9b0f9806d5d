"""Gains by where the poles of the closed loop should lie, from the state space of the robot, each axis for itself.

A step of dt [s] takes the errors of an axis (e, its rate, the sum of e dt) and the acceleration alpha to

    e+ = e + phi e' - beta alpha,   e'+ = d e' - phi alpha,   sum+ = sum + dt e,      d = e^(-a dt), phi = (1 - d)/a,
                                                                                    beta = (dt - phi)/a

and alpha = k_p e + k_d e' + k_i (sum + dt e) puts the three poles where they are wanted (Ackermann's formula), for
any dt. A pole at 1 needs no sum: k_i = 0. a is what the robot does by itself: -diag(A) of eqs (13), viscous friction
included.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError

SWIFT = 0.4  # the fastest pole of a loop, in radians a step
SWIFT_LATE = 0.6  # and in radians of a step and all that its outputs are late: at twice that a loop begins to swing
MOST_FASTER = 1e3


class PoseGains(NamedTuple):
    """Of each axis: on the error of the place [1/s^2], of the speed [1/s], of the sum of the place [1/s^3]. (3,)."""

    place: FloatArray
    speed: FloatArray
    sum: FloatArray


class SpeedGains(NamedTuple):
    """Of each axis: on the error of the speed [1/s], of its sum [1/s^2]; decay of the reference a step [1]. (3,)."""

    speed: FloatArray
    sum: FloatArray
    decay: FloatArray


def pole_rate(rates: FloatArray, faster: float, dt: float, late: float = 0.0) -> FloatArray:
    """How fast the loop of each axis shall forget [1/s]: so many times as fast as the robot, within what time allows.

    dt [s]: between two steps; late [s]: until an output acts.
    """
    return np.minimum(faster * np.maximum(rates, 1e-3), min(SWIFT / dt, SWIFT_LATE / (dt + late)))


def pose_gains(rates: FloatArray, faster: float, integral: float, dt: float, late: float = 0.0) -> PoseGains:
    """Two poles at `pole_rate`, one at the share `integral` of it. rates a [1/s], shape (3,)."""
    gains = [
        _ackermann(float(a), float(rate), float(integral * rate), dt)
        for a, rate in zip(rates, pole_rate(rates, faster, dt, late), strict=True)
    ]
    return PoseGains(*np.array(gains).T)


def place_gains(rates: FloatArray, faster: float, integral: float, dt: float, late: float = 0.0) -> PoseGains:
    """The same where speeds are had as they are asked for: k_p = (1 - p q)/dt, k_i = (1 - p)(1 - q)/dt^2."""
    rate = pole_rate(rates, faster, dt, late)
    p, q = np.exp(-rate * dt), np.exp(-integral * rate * dt)
    return PoseGains((1.0 - p * q) / dt, 0.0 * rate, (1.0 - p) * (1.0 - q) / dt**2)


def _ackermann(a: float, rate: float, slow: float, dt: float) -> FloatArray:
    """(k_p, k_d, k_i) of an axis."""
    d, phi = np.exp(-a * dt), -np.expm1(-a * dt) / a
    move = np.array([[1.0, phi, 0.0], [0.0, d, 0.0], [dt, 0.0, 1.0]])
    push = np.array([-(dt - phi) / a, -phi, 0.0])
    p, q = np.exp(-rate * dt), np.exp(-slow * dt)
    if slow == 0.0:  # no sum: two poles, two gains
        move, push = move[:2, :2], push[:2]
    polynomial = (move - p * np.eye(len(move))) @ (move - p * np.eye(len(move)))
    reach = [push]
    for _ in range(len(push) - 1):
        reach.append(move @ reach[-1])
    if slow > 0.0:
        polynomial = polynomial @ (move - q * np.eye(3))
    last = np.zeros(len(push))
    last[-1] = 1.0
    gains = -last @ np.linalg.inv(np.column_stack(reach)) @ polynomial  # alpha = gains . errors, and the errors fall
    return np.array([gains[0] - dt * gains[2], gains[1], gains[2]]) if slow > 0.0 else np.append(gains, 0.0)


def speed_gains(rates: FloatArray, faster: float, dt: float, late: float = 0.0) -> SpeedGains:
    """Both poles of each axis at `pole_rate`: k = (d - p^2)/phi, k_i dt = (1 - p)^2/phi, p = e^(-rate dt)."""
    rate = pole_rate(rates, faster, dt, late)
    d, phi = np.exp(-rates * dt), -np.expm1(-rates * dt) / rates
    p = np.exp(-rate * dt)
    return SpeedGains((d - p**2) / phi, (1.0 - p) ** 2 / (phi * dt), p)


def check_faster(faster: float) -> float:
    """How many times as fast as the robot. Raises InputError outside 0.05..1000."""
    if not isinstance(faster, int | float) or not 0.05 <= faster <= MOST_FASTER:
        raise InputError(
            "not a speed for a loop",
            got=faster,
            expected=f"0.05 to {MOST_FASTER:g} times that of the robot",
            where="faster",
        )
    return float(faster)


def check_integral(integral: float) -> float:
    """The share of the slow pole. Raises InputError outside 0..1."""
    if not isinstance(integral, int | float) or not 0.0 <= integral <= 1.0:
        raise InputError(
            "not a share for the slow pole", got=integral, expected="0 (no sum of errors) to 1", where="integral"
        )
    return float(integral)
