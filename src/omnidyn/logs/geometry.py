"""Where the wheels stand, from logs in which the motion of the body and of the wheels are both known.

Eq (3), G of an omni wheel at azimuth phi, with s = 1/r for speeds behind the gear, l/r for those of the motor shaft:

    w_i = s (-sin phi_i v_x + cos phi_i v_y + b omega)

is linear in (-s sin phi_i, s cos phi_i, s b): least squares per wheel gives phi_i, s and, where the robot turned, b.
Beside a pose, whose noise is that of a camera, the twist is fitted to the wheels instead, and that is solved for them:
noise in what a fit takes for exact makes its numbers small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import sampled, samples, usual_step
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.read_log import STANDSTILL_SPEED
from omnidyn.logs.segments import GAP
from omnidyn.model.frames import unwrapped
from omnidyn.run import Run
from omnidyn.sensors import OF_WHEELS

MAX_CONDITION = 50.0  # of the directions driven: beyond it, one of them is only noise
MAX_RESIDUAL = 0.2  # share of the wheel speeds that the fit may leave: beyond it these are not omni wheels
AS_OMNI = (45.0, 315.0, 135.0, 225.0)  # where mecanum wheels FL, FR, RL, RR would stand if they were omni wheels
MAX_TURNED = 15.0  # [degree] that they may seem to stand elsewhere
COMMANDS = ("twist_command", "wheel_speed_command")
SOURCES = (
    COMMANDS,
    *((body, wheels) for body in ("twist", "pose") for wheels in OF_WHEELS),
)
WINDOWS = (
    0.4,
    0.8,
    1.6,
    3.2,
)  # [s] over which ways are compared: noise of a pose asks for long ones, turns for short ones
LEAST_WINDOWS = 20
AT_EDGE = 0.25  # of a window: over so much before and behind its edge the place there is a mean
TOGETHER = 0.5  # of the samples of the wheels that stand in a row with one of the body: then rows are compared


@dataclass(frozen=True)
class Geometry:
    """What logs say of the wheels.

    azimuth_deg and its std: counter-clockwise from forward [degree], one per wheel. per_metre: wheel speed over rim
    speed [rad/m]: 1/r behind the gear, l/r at the motor. robot_radius [m]: None where the robot never turned.
    residual: rms of what the fit leaves over rms of the wheel speeds. source: which channels it is from. measured:
    whether they were measured, and not commanded. at_motor: whether the log says that the speeds are those of the motor
    shaft, and nobody which gear is behind it. arms: b of each wheel, below 0 where one counts clockwise; () where
    robot_radius is None.
    """

    azimuth_deg: tuple[float, ...]
    azimuth_std: tuple[float, ...]
    per_metre: float
    robot_radius: float | None
    residual: float
    source: str
    measured: bool = False
    at_motor: bool = False
    arms: tuple[float, ...] = ()

    @property
    def wheels(self) -> str:
        """The channel of the wheels that it is from."""
        return self.source.rpartition(" ")[2]


def wheel_geometry(runs: Sequence[Run], instead: str = "`azimuth`") -> Geometry:
    """Fit the geometry to commands of body and wheels where both are logged, else to what was measured.

    Of measured channels those count that leave least unexplained. Each channel by its own clock. instead: what says
    what these logs cannot; of mecanum wheels the radius, for where they stand is known.
    Raises InputError where no run has such a pair of channels or wheels do not follow an omni wheel's law, and
    InsufficientDataError where the runs go in one direction only.
    """
    first: InputError | InsufficientDataError | None = None
    fits: list[Geometry] = []
    for body, wheels in SOURCES:
        try:
            fits += _fits(runs, body, wheels, instead)
        except (InputError, InsufficientDataError) as error:
            first = first or error
        if fits and not fits[0].measured:
            return fits[0]
    if fits:
        return min(fits, key=lambda fit: fit.residual)
    raise first or InputError(
        "cannot tell where the wheels stand",
        got=", ".join(runs[0].channels) if runs else "no log",
        expected="twist_command and wheel_speed_command, or twist or pose with "
        f"{' or '.join(OF_WHEELS)}, all components of them",
        remedy=f"say which columns they are (`column` w1=NAME), or leave the logs out and give {instead}",
    )


def _fits(runs: Sequence[Run], body: str, wheels: str, instead: str) -> list[Geometry]:
    """The geometry by two channels, over the windows that tell it best; [] where no run has both."""
    runs = [run for run in runs if _has_both(run, body, wheels)]
    best: tuple[float, Geometry] | None = None
    first: InputError | InsufficientDataError | None = None
    for window in WINDOWS:
        usable = [_moving(*_compared(run, body, wheels, window)) for run in runs]
        usable = [pair for pair in usable if len(pair[0])]
        count = sum(len(twist) for twist, _ in usable)
        if not usable or (window > WINDOWS[0] and count < LEAST_WINDOWS):
            break
        twist, speed = (np.concatenate(parts) for parts in zip(*usable, strict=True))
        try:
            fit = _fit(twist, speed, f"{body} and {wheels}", instead)
        except (InputError, InsufficientDataError) as error:
            first = first or error
            continue
        if best is None or fit.residual / np.sqrt(count) < best[0]:
            best = float(fit.residual / np.sqrt(count)), fit
    if best is None and first is not None:
        raise first
    return [] if best is None else [best[1]]


def shows_both(run: Run) -> bool:
    """Whether a run has the motion of the body and of the wheels."""
    return any(_has_both(run, body, wheels) for body, wheels in SOURCES)


def _has_both(run: Run, body: str, wheels: str) -> bool:
    return getattr(run, body) is not None and getattr(run, wheels) is not None


def _compared(run: Run, body: str, wheels: str, window: float) -> tuple[FloatArray, FloatArray]:
    """(twist, wheel speeds): row by row where they share rows, else means over windows. Shapes (n, 3), (n, wheels)."""
    if (body, wheels) in SOURCES[:2]:
        twist, speed = getattr(run, body), getattr(run, wheels)
        if np.isnan(twist[:, 2]).all():  # a turn rate that was never logged counts as none
            twist = np.column_stack([twist[:, :2], np.zeros(len(twist))])
        keep = np.isfinite(twist).all(axis=1) & np.isfinite(speed).all(axis=1)
        if keep.sum() > TOGETHER * min(len(sampled(twist)), len(sampled(speed))):
            return twist[keep], speed[keep]
    return mean_speeds(run, body, wheels, window)


def as_mecanum(geometry: Geometry) -> Geometry:
    """The same wheels as mecanum wheels with rollers at 45 degrees: front left, front right, rear left, rear right.

    Every wheel counts counter-clockwise about the robot, those on the left backward: w_i = (-+ v_x +- v_y + b omega)/r
    is an omni wheel's law with sqrt(2)/r for 1/r and b/sqrt(2) for b, b being half track + half wheelbase. Wheels that
    count the other way are turned. Raises
    InputError where they do not push in these directions.
    """
    counted_back = turned_wheels(geometry)
    angle = [
        round((azimuth + 180.0 * (k + 1 in counted_back)) % 360.0, 1) for k, azimuth in enumerate(geometry.azimuth_deg)
    ]
    off = _off(angle)
    if len(angle) != len(AS_OMNI) or max(map(abs, off)) > MAX_TURNED:
        raise InputError(
            "the wheels do not push as mecanum wheels in an X do",
            got=f"directions {angle} degree",
            expected=f"{list(AS_OMNI)}: front left, front right, rear left, rear right, counter-clockwise positive",
            remedy="name the columns in this order, a left wheel that counts forward with a minus: `column` w1=-LEFT",
        )
    arms = [-arm if k + 1 in counted_back else arm for k, arm in enumerate(geometry.arms)]
    radius = float(np.sqrt(2.0) * np.mean(arms)) if arms else None
    return replace(
        geometry, azimuth_deg=AS_OMNI, per_metre=geometry.per_metre / float(np.sqrt(2.0)), robot_radius=radius
    )


def turned_wheels(geometry: Geometry) -> tuple[int, ...]:
    """The wheels, from 1, that count clockwise about the robot: their speed falls where it turns counter-clockwise.

    None where all do: then it is the heading that counts the other way.
    """
    counted_back = tuple(k + 1 for k, arm in enumerate(geometry.arms) if arm < 0.0)
    return (
        counted_back if len(counted_back) < len(geometry.arms) or max(map(abs, _off(geometry.azimuth_deg))) > 90 else ()
    )


def _off(angle: Sequence[float]) -> list[float]:
    """How far wheels are from where mecanum wheels seem to stand [degree]."""
    return [(azimuth - expected + 180.0) % 360.0 - 180.0 for azimuth, expected in zip(angle, AS_OMNI, strict=False)]


def _moving(twist: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Only the rows in motion."""
    keep = (np.abs(speed) > STANDSTILL_SPEED).any(axis=1)
    return twist[keep], speed[keep]


def _fit(twist: FloatArray, speed: FloatArray, source: str, instead: str) -> Geometry:
    turned = bool(np.any(np.abs(twist[:, 2]) > STANDSTILL_SPEED))
    design = twist if turned else twist[:, :2]
    size = np.sqrt(np.mean(design**2, axis=0))
    if (size == 0.0).any() or np.linalg.cond(design / size) > MAX_CONDITION:
        raise InsufficientDataError(
            "the logs do not show where the wheels stand",
            got=f"{len(twist)} rows in motion, all alike",
            expected="motion along x and along y",
            remedy=f"add logs in other directions, or leave the logs out and give {instead}",
        )
    rows = _rows(design, speed, source.startswith("pose"))
    rest = speed - design @ rows
    residual = float(np.sqrt(np.mean(rest**2) / np.mean(speed**2)))
    if residual > MAX_RESIDUAL:
        raise InputError(
            "the wheels do not follow the body as omni wheels do",
            got=f"{residual:.0%} of the wheel speeds unexplained",
            expected=f"at most {MAX_RESIDUAL:.0%}",
            remedy=f"check the columns with omnidyn check, or leave the logs out and give {instead}"
            if turned
            else "a turn rate is not in the "
            "logs, or 0: where the robot turned say which column it is (`column` omega=NAME:UNIT)",
        )
    scale = np.hypot(rows[0], rows[1])
    if (scale == 0.0).any():
        raise InputError(
            "a wheel never turned", got=f"wheel {int(np.argmin(scale)) + 1}", expected="all wheels in motion"
        )
    inverse = np.linalg.inv(design.T @ design)
    spread = np.sqrt(np.mean(rest**2, axis=0) * max(inverse[0, 0], inverse[1, 1])) / scale
    azimuth = np.degrees(np.arctan2(-rows[0], rows[1])) % 360.0
    return Geometry(
        azimuth_deg=tuple(azimuth.tolist()),
        azimuth_std=tuple(np.degrees(spread).tolist()),
        per_metre=float(np.mean(scale)),
        robot_radius=float(np.mean(rows[2] / scale)) if turned else None,
        arms=tuple((rows[2] / scale).tolist()) if turned else (),
        residual=residual,
        source=source,
        measured=source != " and ".join(COMMANDS),
    )


def _rows(twist: FloatArray, speed: FloatArray, of_wheels: bool) -> FloatArray:
    """The wheel speeds of each axis of the twist, shape (axes, wheels), by least squares.

    of_wheels: the twist is fitted to the wheels, along the directions in which they turn together, and that is solved.
    """
    if of_wheels and speed.shape[1] >= twist.shape[1]:
        *_, together = np.linalg.svd(speed, full_matrices=False)
        together = together[: twist.shape[1]]
        travel, *_ = np.linalg.lstsq(speed @ together.T, twist, rcond=None)
        if np.linalg.cond(travel) < 1.0 / np.finfo(float).eps:
            return np.asarray(np.linalg.inv(travel) @ together, dtype=float)
    return np.asarray(np.linalg.lstsq(twist, speed, rcond=None)[0], dtype=float)


# How far the body and the wheels went in windows of time, each by the samples of its own sensor
#
# Distances add up whatever the sensors' stamps, rates and jitter are: nothing has to be measured at one time.

STEPS = 4.0  # steps of the slowest sensor that a window lasts at least
SPEEDS = ("twist", "wheel_speed")  # the others are positions


def mean_speeds(run: Run, body: str, wheels: str, window: float = WINDOWS[0]) -> tuple[FloatArray, FloatArray]:
    """(twist of the body, speeds of the wheels), means over windows; shapes (windows, 3) and (windows, wheels).

    body: "twist" or "pose". wheels: one of OF_WHEELS. Windows that a sensor was out in are left out; a
    turn rate that was never logged counts as none.
    """
    tracks = [*_body_tracks(run, body), *_tracks(*run.samples(wheels), wheels in SPEEDS)]
    if len(tracks) < 4 or min(len(t) for t, _ in tracks) < 3:
        return np.zeros((0, 3)), np.zeros((0, max(len(tracks) - 3, 0)))
    longest = max(window, STEPS * max(usual_step(t) for t, _ in tracks))
    first, last = max(t[0] for t, _ in tracks), min(t[-1] for t, _ in tracks)
    half = AT_EDGE * longest
    edges = np.arange(first + half, last - half, longest)
    ways = np.column_stack([_between(t, travel, edges, half) for t, travel in tracks]) / longest
    ways = ways[np.isfinite(ways).all(axis=1)]
    return ways[:, :3], ways[:, 3:]


Track = tuple[FloatArray, FloatArray]  # times of the samples of one component, how far it had gone by then


def _tracks(t: FloatArray, values: FloatArray, speed: bool) -> list[Track]:
    """The way of each component by its own samples: the integral of a speed, or the position itself."""
    tracks = []
    for column in values.T:
        times, column_values = samples(t, column)
        means = 0.5 * (column_values[1:] + column_values[:-1]) * np.diff(times)
        tracks.append((times, np.append(0.0, np.cumsum(means))[: len(times)] if speed else column_values))
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
    complete = np.isfinite(values).all(axis=1) if values.ndim == 2 else np.zeros(len(t), dtype=bool)
    t, pose = t[complete], values[complete]
    if len(t) < 2:
        return []
    heading = unwrapped(pose[:, 2])
    turn, middle = np.diff(heading), 0.5 * (heading[1:] + heading[:-1])
    steps = np.diff(pose[:, 0] + 1j * pose[:, 1]) * np.exp(-1j * middle) / np.sinc(turn / (2.0 * np.pi))
    travel = np.append(0.0, np.cumsum(steps))
    return [(t, np.real(travel)), (t, np.imag(travel)), (t, heading)]


def _between(t: FloatArray, travel: FloatArray, edges: FloatArray, half: float) -> FloatArray:
    """How far a component went from each edge to the next, shape (edges - 1,); NaN across a gap of its samples.

    Where it was at an edge is a mean over `half` [s] before and behind it, the same for body and wheels.
    """
    distances = np.diff(_integral(t, travel, edges + half) - _integral(t, travel, edges - half)) / (2.0 * half)
    gaps = np.append(0, np.cumsum(np.diff(t) > GAP * usual_step(t)))
    after = np.clip(np.searchsorted(t, edges[1:] + half), 0, len(t) - 1)
    before = np.clip(np.searchsorted(t, edges[:-1] - half, side="right") - 1, 0, len(t) - 1)
    crossed = gaps[after] - gaps[before]
    return np.where(crossed > 0, np.nan, distances)


def _integral(t: FloatArray, values: FloatArray, ends: FloatArray) -> FloatArray:
    """The integral from the first sample to each end, straight between samples. Shape of `ends`."""
    whole = np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t)))
    k = np.clip(np.searchsorted(t, ends, side="right") - 1, 0, len(t) - 2)
    return whole[k] + 0.5 * (values[k] + np.interp(ends, t, values)) * (ends - t[k])
