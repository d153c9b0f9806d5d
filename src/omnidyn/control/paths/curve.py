"""Closed curves that a robot goes round for ever, and what its heading does meanwhile.

    eight    (A sin wt, A sin wt cos wt)            circle   (r cos wt - r, r sin wt)
    square   corners (0, 0) (L, 0) (L, L) (0, L)    zigzag   forward and back, each axis a moment later

Heading: "held" stays, "turning" turns evenly, "along" points where the curve goes; a zigzag swings it by itself.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.errors import InputError
from omnidyn.model.frames import unwrapped
from omnidyn.run import Run

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


# Rows joined by straight lines: a path from a CSV file `t_s,x_m,y_m,heading_rad`, from a Run, or from an array

COLUMNS = ("t_s", "x_m", "y_m", "heading_rad")
SLOWEST, FASTEST = 1e-3, 100.0  # [m/s] on a path drawn by hand
LARGEST_PLACE, NEAREST = 1e4, 1e-9  # [m] of its points; apart, where two are not one


@dataclass(frozen=True, eq=False, repr=False)
class Polyline(Path):
    """t [s], shape (rows,), from 0 on; pose [m, m, rad], shape (rows, 3)."""

    name: str
    t: FloatArray
    pose: FloatArray

    @property
    def duration(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Until the last row [s]."""
        return float(self.t[-1])

    @property
    def end(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The last row [s]: it stays there."""
        return float(self.t[-1])

    def at(self, t: ArrayLike) -> Reference:
        """See Path. On a row, the velocity is that of the line after it."""
        time = np.asarray(t, dtype=float)
        now = time.reshape(-1)
        line = np.clip(np.searchsorted(self.t, now * (1.0 + 1e-12), side="right") - 1, 0, len(self.t) - 2)
        span = np.diff(self.t)[line][:, None]
        share = np.clip((now - self.t[line])[:, None] / span, 0.0, 1.0)
        step = self.pose[line + 1] - self.pose[line]
        moving = ((now >= 0.0) & (now < self.t[-1]))[:, None]
        parts = self.pose[line] + share * step, np.where(moving, step / span, 0.0), np.zeros((len(now), 3))
        return Reference(*(part.reshape(*time.shape, 3) for part in parts))


def lines(t: ArrayLike, pose: ArrayLike, name: str) -> Polyline:
    """A path through poses [m, m, rad], shape (rows, 3), at times t [s], shape (rows,); the first is its t = 0.

    Headings within half a turn of 0 that jump by more than half a turn are taken to be wrapped.
    Raises InputError for fewer than two rows, other shapes, values that are not finite, or times that do not increase.
    """
    time, place = np.asarray(t, dtype=float), np.array(pose, dtype=float)
    if time.ndim != 1 or place.shape != (len(time), 3) or len(time) < 2:
        raise InputError(
            "no path",
            got=f"{time.shape} times and {place.shape} poses",
            expected="(rows,) and (rows, 3), rows >= 2",
            where=name,
        )
    bad_rows = np.flatnonzero(~np.isfinite(np.column_stack([time, place])).all(axis=1))
    if bad_rows.size:
        raise InputError(
            "not a finite number",
            got=place[bad_rows[0]].tolist(),
            expected="numbers",
            where=f"{name}, row {bad_rows[0]}",
        )
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        raise InputError(
            "time does not increase",
            got=f"{time[back[0] + 1]:.12g} after {time[back[0]]:.12g}",
            expected="increasing times",
            remedy="sort the rows by time and keep one of each",
            where=f"{name}, row {back[0] + 1}",
        )
    if np.abs(place[:, 2]).max() <= np.pi + 1e-6:
        place[:, 2] = unwrapped(place[:, 2])
    return Polyline(name, time - time[0], place)


def through(points: ArrayLike, speed: float, closed: bool, name: str) -> Polyline:
    """A path drawn by hand: lines through points in the plane [m], shape (points, 2), at one speed [m/s].

    Its heading is held at 0. closed: back to where it began.
    Raises InputError for fewer than two different points, or a number out of range.
    """
    try:
        place = np.array(points, dtype=float)
    except (TypeError, ValueError):
        place: FloatArray = np.empty(0)
    if place.ndim != 2 or place.shape[1:] != (2,) or not (np.abs(place) <= LARGEST_PLACE).all():
        got = f"{len(place)} points"
        raise InputError("no drawn path", got=got, expected=f"points (x, y) up to {LARGEST_PLACE:g} m", where=name)
    if not SLOWEST <= speed <= FASTEST:
        raise InputError("out of range", got=speed, expected=f"{SLOWEST:g} to {FASTEST:g} m/s", where="speed")
    place = np.concatenate([place, place[:1]]) if closed else place
    lengths = np.hypot(*np.diff(place, axis=0).T)
    if not (lengths > NEAREST).any():
        raise InputError(
            "no drawn path", got="no two different points", expected="a line", remedy="draw one", where=name
        )
    place = np.concatenate([place[:1], place[1:][lengths > NEAREST]])
    t = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))]) / speed
    return lines(t, np.column_stack([place, np.zeros(len(place))]), name)


def path_of_run(run: Run) -> Polyline:
    """The path that a Run went: its poses. Raises InputError for a Run without, or with gaps in them."""
    if run.pose is None:
        raise InputError(
            "this run has no poses to follow",
            got=", ".join(run.channels) or "no channel",
            expected="x, y and heading",
            remedy="take a run of a simulation, or a log with a pose",
            where=run.source,
        )
    finite = np.isfinite(run.pose).all(axis=1)
    return lines(run.t[finite], run.pose[finite], run.source or "a run")


def path_of_file(path: str | os.PathLike) -> Polyline:
    """A path from a table with the columns t_s, x_m, y_m and heading_rad; others, of a run file, are not looked at."""
    from omnidyn.logs.readers.read_table import read_table  # imported lazily: named paths need no reader

    table = read_table(path)
    absent = [name for name in COLUMNS if name not in table.names]
    if absent:
        raise InputError(
            "no path in this file",
            got=", ".join(table.names),
            expected=", ".join(COLUMNS),
            remedy=f"add {', '.join(absent)}",
            where=table.source,
        )
    t, *pose = (table.measured(name) for name in COLUMNS)
    return lines(t, np.column_stack(pose), str(table.source))
