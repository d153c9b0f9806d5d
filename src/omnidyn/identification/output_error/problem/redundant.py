"""Whether one channel of a log is computed from another: wheel odometry is the integral of its own twist.

Such a pair holds the same errors twice; to fit both would count the same data twice and make intervals too narrow. An
integral goes along with its rate for ever: over N rows they part by rounding only, where independent measurements part
by the noise of the rate, sqrt(N) sigma dt.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.frames import body_to_world
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import MAD_TO_STD

NEAR = 0.2  # of what independent measurements part by
WINDOWS = (1, 16, 256)  # rows
ENOUGH, LEAST = 50_000, 30  # rows looked at; windows needed
TO_STD = MAD_TO_STD / np.sqrt(20.0)  # from the median size of third differences to the noise of a row


def redundant(run: Run, robot: Robot) -> dict[str, str]:
    """Outputs that say nothing beside another one: output -> the one that it is computed from, or that has it all."""
    found = {}
    t = run.t[:ENOUGH]
    if run.wheel_angle is not None and run.wheel_speed is not None:
        change = np.diff(run.wheel_angle[:ENOUGH], axis=0)
        if goes_along(change, _held(run.wheel_speed[:ENOUGH], np.diff(t)), run.wheel_speed[:ENOUGH], t):
            found["wheel_speed"] = "wheel_angle"
    source = "twist" if run.twist is not None else "wheel_speed"
    twist = run.twist if run.twist is not None else run.wheel_speed
    if run.pose is None or twist is None:
        return found
    if source == "wheel_speed":
        twist = twist_from_wheel_speed(robot.wheels, twist)
    twist, pose = twist[:ENOUGH], run.pose[:ENOUGH]
    change = np.diff(pose, axis=0)
    if goes_along(change[:, 2:], _held(twist[:, 2:], np.diff(t)), twist[:, 2:], t):
        found["heading"] = source
    if goes_along(change[:, :2], _turned(twist, pose[:, 2], np.diff(t)), twist[:, :2], t):
        found["position"] = source
    return found


def goes_along(change: FloatArray, tried: Iterator[FloatArray], rate: FloatArray, t: FloatArray) -> bool:
    """Whether one of `tried`, changes from row to row by the rate, is what `change` is. All of shape (rows, K)."""
    third = np.abs(np.diff(rate, 3, axis=0))
    third = third[np.isfinite(third).all(axis=1)]
    if len(third) < LEAST:
        return False
    noise = TO_STD * np.median(third, axis=0)
    noise = np.where(noise > 0.0, noise, TO_STD * third.mean(axis=0)) * float(np.median(np.diff(t)))
    for own in tried:
        off = change - own
        off = off[np.isfinite(off).all(axis=1)]
        for rows in WINDOWS:
            count = len(off) // rows
            if count < LEAST:
                break
            parted = off[: count * rows].reshape(count, rows, -1).sum(axis=1)
            if (np.sqrt(np.mean(parted**2, axis=0)) <= NEAR * np.sqrt(rows) * noise).all():
                return True
    return False


def _held(rate: FloatArray, dt: FloatArray) -> Iterator[FloatArray]:
    """The change from row to row by a rate that holds before, after, or as the mean."""
    for share in (0.0, 1.0, 0.5):
        yield ((1.0 - share) * rate[:-1] + share * rate[1:]) * dt[:, None]


def _turned(twist: FloatArray, heading: FloatArray, dt: FloatArray) -> Iterator[FloatArray]:
    """The change of the position, for the same three and for the heading before, between and after."""
    for way in _held(twist[:, :2], dt):
        for share in (0.5, 0.0, 1.0):
            turn = body_to_world((1.0 - share) * heading[:-1] + share * heading[1:])[:, :2, :2]
            yield np.einsum("kij,kj->ki", turn, way)
