"""Paths drawn by hand, smoothed until a robot can follow them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.control.demand import path_demand
from omnidyn.control.paths.motion import Reference
from omnidyn.control.paths.polyline import Polyline, lines
from omnidyn.model.robot import Robot

WIDTHS = (0.1, 0.2, 0.4, 0.8, 1.6)  # [s] that are tried
LONGEST_WINDOW = 2.0  # [s]
ROWS = 40  # of a window
MOST_ROWS = 200_000  # of a path: of a long one a window has fewer, and one of less than two smooths nothing


@dataclass(frozen=True, eq=False, repr=False)
class Smooth(Polyline):
    """What a smoothed path means between its rows: velocity and acceleration are their central differences.

    t [s], evenly spaced, pose [m, m, rad], shape (rows, 3).
    """

    def at(self, t: ArrayLike) -> Reference:
        """See Path."""
        time = np.asarray(t, dtype=float)
        velocity = np.gradient(self.pose, self.t, axis=0)
        parts = (self.pose, velocity, np.gradient(velocity, self.t, axis=0))
        return Reference(
            *(np.stack([np.interp(time, self.t, part[:, k]) for k in range(3)], axis=-1) for part in parts)
        )


def smoothed(path: Polyline, width: float, *, closed: bool = False) -> Polyline:
    """The path averaged over a Hann window of so many seconds; it begins and ends where it did, in the same time.

    closed: whether it goes on where it began, so that its first corner is smoothed too.
    """
    step = max(width / ROWS, path.duration / MOST_ROWS)
    half = int(width / (2.0 * step) + 1e-9)
    if half < 1:
        return path
    t = np.linspace(0.0, path.duration, max(2, round(path.duration / step) + 1))
    pose, half = path.at(t).pose, min(half, len(t) - 1)
    window = np.hanning(2 * half + 1)
    if closed:
        before, after = pose[-1 - half : -1], pose[1 : half + 1]
    else:  # mirrored in its ends, which stay
        before, after = 2.0 * pose[0] - pose[half:0:-1], 2.0 * pose[-1] - pose[-2 : -2 - half : -1]
    whole = np.concatenate([before, pose, after])
    mean = [np.convolve(column, window / window.sum(), mode="valid") for column in whole.T]
    return lines(t, np.column_stack(mean), path.name)


def least_smoothing(robot: Robot, path: Polyline, *, closed: bool = False) -> float:
    """The first of the windows WIDTHS [s] with which the robot can follow the path; the last one where it cannot."""
    for width in WIDTHS:
        made = smoothed(path, width, closed=closed)
        if path_demand(robot, Smooth(made.name, made.t, made.pose)).follows:
            return width
    return WIDTHS[-1]
