"""Closed curves that a robot goes round for ever, and what its heading does meanwhile.

    eight    (A sin wt, A sin wt cos wt)            circle   (r cos wt - r, r sin wt)
    square   corners (0, 0) (L, 0) (L, L) (0, L)    zigzag   forward and back, each axis a moment later

Heading: "held" stays, "turning" turns evenly, "along" points where the curve goes; a zigzag swings it by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference

Plane = Callable[[FloatArray], FloatArray]  # t, shape (k,) -> position and its first three derivatives, (4, k, 2)
CORNER = 1e-9  # of a side: so near before a corner, the corner is reached
BRANCHES = 2048  # places of a round at which the whole turns of a heading along it are counted


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Path):
    """A closed curve. plane: of its points. period [s]: of a round.

    heading [rad]: at the start; where it points along the curve, beside it. turn [rad/s]: how fast the heading turns.
    along: whether it points where the curve goes. swing: the heading and its first two derivatives where the curve
    has one of its own, t (k,) -> (3, k).
    """

    name: str
    plane: Plane
    period: float
    duration: float
    heading: float = 0.0
    turn: float = 0.0
    along: bool = False
    swing: Callable[[FloatArray], FloatArray] | None = None
    end: float = math.inf
    _branch: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        """Count the whole turns of the heading over a round."""
        ways = np.zeros(2)
        if self.along:
            speed = self.plane(np.linspace(0.0, self.period, BRANCHES + 1))[1]
            ways = np.unwrap(np.arctan2(speed[:, 1], speed[:, 0]))
        object.__setattr__(self, "_branch", ways)

    def at(self, t: ArrayLike) -> Reference:
        """See Path. Before t = 0 it stands at its start."""
        time = np.asarray(t, dtype=float)
        now = np.maximum(time.reshape(-1), 0.0)
        place, speed, change, jerk = self.plane(now)
        heading = self._heading(now, speed, change, jerk)
        stack = [np.column_stack([part, angle]) for part, angle in zip((place, speed, change), heading, strict=True)]
        before = time.reshape(-1) < 0.0
        for part in stack[1:]:
            part[before] = 0.0
        return Reference(*(part.reshape(*time.shape, 3) for part in stack))

    def _heading(self, t: FloatArray, speed: FloatArray, change: FloatArray, jerk: FloatArray) -> FloatArray:
        """The heading and its first two derivatives. Shape (3, k).

        Along: theta = atan2(v_y, v_x), theta' = (v x a)/v^2, theta'' = (v x j)/v^2 - 2 theta' (v . a)/v^2.
        """
        if self.swing is not None:
            return self.swing(t) + np.array([[self.heading], [0.0], [0.0]])
        if not self.along:
            return np.stack([self.heading + self.turn * t, np.full_like(t, self.turn), np.zeros_like(t)])
        square = np.sum(speed**2, axis=1)
        rate = (speed[:, 0] * change[:, 1] - speed[:, 1] * change[:, 0]) / square
        swerve = (speed[:, 0] * jerk[:, 1] - speed[:, 1] * jerk[:, 0]) / square
        swerve -= 2.0 * rate * np.sum(speed * change, axis=1) / square
        return np.stack([self.heading + self._way(t, speed), rate, swerve])

    def _way(self, t: FloatArray, speed: FloatArray) -> FloatArray:
        """Direction of travel [rad], continuous over all rounds; it begins within half a turn of 0."""
        rounds = np.floor(t / self.period)
        share = t / self.period - rounds
        guess = np.interp(share, np.linspace(0.0, 1.0, len(self._branch)), self._branch)
        guess = guess + rounds * (self._branch[-1] - self._branch[0])
        angle = np.arctan2(speed[:, 1], speed[:, 0])
        return angle + 2.0 * math.pi * np.round((guess - angle) / (2.0 * math.pi))


def eight(size: float, period: float) -> Plane:
    """(A sin wt, (A/2) sin 2wt) [m]: through the origin twice a round of `period` [s]."""
    rate = 2.0 * math.pi / period

    def plane(t: FloatArray) -> FloatArray:
        return np.stack([_sines(size, rate, t), _sines(0.5 * size, 2.0 * rate, t)], axis=-1)

    return plane


def circle(radius: float, period: float) -> Plane:
    """(r cos wt - r, r sin wt) [m]: counter-clockwise, from the origin."""
    rate = 2.0 * math.pi / period

    def plane(t: FloatArray) -> FloatArray:
        sine = _sines(radius, rate, t)
        cosine = np.stack([sine[1] / rate - radius, -rate * sine[0], -rate * sine[1], -rate * sine[2]])
        return np.stack([cosine, sine], axis=-1)

    return plane


def _sines(size: float, rate: float, t: FloatArray) -> FloatArray:
    """A sin wt and its first three derivatives. Shape (4, k)."""
    sin, cos = size * np.sin(rate * t), size * np.cos(rate * t)
    return np.stack([sin, rate * cos, -(rate**2) * sin, -(rate**3) * cos])


def square(side: float, speed: float) -> Plane:
    """Round the corners (0, 0) (L, 0) (L, L) (0, L) [m] at one speed [m/s]."""
    corners = side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])

    def plane(t: FloatArray) -> FloatArray:
        sides = t * speed / side
        corner = np.floor(sides + CORNER).astype(int) % 4
        share = np.maximum(sides - np.floor(sides + CORNER), 0.0)[:, None]
        out = np.zeros((4, len(t), 2))
        out[0] = corners[corner] + share * (corners[corner + 1] - corners[corner])
        out[1] = (corners[corner + 1] - corners[corner]) * speed / side
        return out

    return plane


def triangle(speed: float, half: float, t: FloatArray) -> FloatArray:
    """Forth for `half` [s] at `speed`, then back, from 0; and its first three derivatives. Shape (4, k)."""
    out = np.zeros((4, len(t)))
    out[0] = speed * half * (1.0 - np.abs(np.mod(t / half, 2.0) - 1.0))
    out[1] = np.where(np.mod(t / half + CORNER, 2.0) < 1.0, speed, -speed)
    return out


def zigzag(speed: float, sideways: float, half: float, lag: float) -> Plane:
    """Forth and back along x, and along y at another speed, `lag` [s] ahead."""

    def plane(t: FloatArray) -> FloatArray:
        return np.stack([triangle(speed, half, t), triangle(sideways, half, t + lag)], axis=-1)

    return plane


def swinging(turn: float, half: float, lag: float) -> Callable[[FloatArray], FloatArray]:
    """A heading that swings there and back [rad], `lag` [s] ahead."""
    return lambda t: triangle(turn, half, t + lag)[:3]
