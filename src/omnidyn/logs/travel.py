"""How far the body and the wheels went in windows of time, each by the samples of its own sensor.

Distances add up whatever the sensors' stamps, rates and jitter are: nothing has to be measured at one time.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.clocks import samples, usual_step
from omnidyn.logs.segments import GAP
from omnidyn.model.frames import unwrapped
from omnidyn.run import Run

WINDOW = 0.4  # [s]
STEPS = 4.0  # steps of the slowest sensor that a window lasts at least
SPEEDS = ("twist", "wheel_speed")  # the others are positions


def mean_speeds(run: Run, body: str, wheels: str) -> tuple[FloatArray, FloatArray]:
    """(twist of the body, speeds of the wheels), means over windows; shapes (windows, 3) and (windows, wheels).

    body: "twist" or "pose". wheels: "wheel_speed" or "wheel_angle". Windows that a sensor was out in are left out; a
    turn rate that was never logged counts as none.
    """
    tracks = [*_body_tracks(run, body), *_tracks(*run.samples(wheels), wheels in SPEEDS)]
    if len(tracks) < 4 or min(len(t) for t, _ in tracks) < 3:
        return np.zeros((0, 3)), np.zeros((0, max(len(tracks) - 3, 0)))
    longest = max(WINDOW, STEPS * max(usual_step(t) for t, _ in tracks))
    first, last = max(t[0] for t, _ in tracks), min(t[-1] for t, _ in tracks)
    edges = np.arange(first, last, longest)
    ways = np.column_stack([_between(t, way, edges) for t, way in tracks]) / longest
    ways = ways[np.isfinite(ways).all(axis=1)]
    return ways[:, :3], ways[:, 3:]


Track = tuple[FloatArray, FloatArray]  # times of the samples of one component, how far it had gone by then


def _tracks(t: FloatArray, values: FloatArray, speed: bool) -> list[Track]:
    """The way of each component by its own samples: the integral of a speed, or the position itself."""
    tracks = []
    for column in values.T:
        own, known = samples(t, column)
        means = 0.5 * (known[1:] + known[:-1]) * np.diff(own)
        tracks.append((own, np.append(0.0, np.cumsum(means))[: len(own)] if speed else known))
    return tracks


def _body_tracks(run: Run, body: str) -> list[Track]:
    """The way along x, along y and about yaw of the body itself.

    A step of a pose is the chord of an arc: turned back by the mean heading, dx / sinc(dtheta/2) of way.
    """
    t, values = run.samples(body)
    if body in SPEEDS:
        if values.size and np.isnan(values[:, 2]).all():
            values = np.column_stack([values[:, :2], np.zeros(len(values))])
        return _tracks(t, values, True)
    whole = np.isfinite(values).all(axis=1) if values.ndim == 2 else np.zeros(len(t), dtype=bool)
    t, pose = t[whole], values[whole]
    if len(t) < 2:
        return []
    heading = unwrapped(pose[:, 2])
    turn, middle = np.diff(heading), 0.5 * (heading[1:] + heading[:-1])
    steps = np.diff(pose[:, 0] + 1j * pose[:, 1]) * np.exp(-1j * middle) / np.sinc(turn / (2.0 * np.pi))
    way = np.append(0.0, np.cumsum(steps))
    return [(t, np.real(way)), (t, np.imag(way)), (t, heading)]


def _between(t: FloatArray, way: FloatArray, edges: FloatArray) -> FloatArray:
    """How far a component went from each edge to the next, shape (edges - 1,); NaN across a gap of its samples."""
    gone = np.diff(np.interp(edges, t, way))
    gaps = np.append(0, np.cumsum(np.diff(t) > GAP * usual_step(t)))
    crossed = gaps[_after(t, edges[1:])] - gaps[_before(t, edges[:-1])]
    return np.where(crossed > 0, np.nan, gone)


def _before(t: FloatArray, at: FloatArray) -> IntArray:
    return np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 1)


def _after(t: FloatArray, at: FloatArray) -> IntArray:
    return np.clip(np.searchsorted(t, at), 0, len(t) - 1)
