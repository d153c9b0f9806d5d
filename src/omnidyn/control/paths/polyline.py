"""Rows joined by straight lines: a path from a CSV file `t_s,x_m,y_m,heading_rad`, from a Run, or from an array."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.errors import InputError
from omnidyn.model.frames import unwrapped
from omnidyn.run import Run

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
            "not a path",
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
        raise InputError("not a drawn path", got=got, expected=f"points (x, y) up to {LARGEST_PLACE:g} m", where=name)
    if not SLOWEST <= speed <= FASTEST:
        raise InputError("out of range", got=speed, expected=f"{SLOWEST:g} to {FASTEST:g} m/s", where="speed")
    place = np.concatenate([place, place[:1]]) if closed else place
    lengths = np.hypot(*np.diff(place, axis=0).T)
    if not (lengths > NEAREST).any():
        raise InputError(
            "not a drawn path", got="no two different points", expected="a line", remedy="draw one", where=name
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
    table.require(COLUMNS, what="no path in this file")
    t, *pose = (table.measured(name) for name in COLUMNS)
    return lines(t, np.column_stack(pose), str(table.source))
