"""Channels that are late: y(t) = a x(t - lag), found from channels that measure one thing twice."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.averaged import late_by
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.clocks import sampled_with
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import electric_speed, emf, ground, ohmic, volts, wheels_twist
from omnidyn.findings.signal.robust import Slope, central_rate, clusters, ratio, smooth, windowed
from omnidyn.model.frames import unwrapped
from omnidyn.statement import NOTE, WARNING

FARTHEST_ROWS = 8  # rows that are searched to either side
WARN_FROM, NOTE_FROM = 0.75, 0.35  # rows
MOST_ROWS = 60_000  # rows that tell a lag
SURE_ERRORS, VAGUE_ROWS = 5.0, 0.4  # standard errors; rows of error beyond which nothing is said


class LagPair(NamedTuple):
    """Two channels that should be the same. y, x: shape (rows, k). width: rows over which both are means already."""

    late: str
    against: str
    y: FloatArray
    x: FloatArray
    subject: str


def check_lag(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on lag between channels that are redundant; what follows a command is dynamics and no lag."""
    findings: list[Finding] = []
    if len(work) < 3 * MIN_ROWS or work.step <= 0.0:
        return findings, work
    for clock_work, pair in _pairs(work):
        line = lag(clock_work, pair.y, pair.x)
        if line is None or not line.error < VAGUE_ROWS:
            continue
        rows = line.value
        if abs(rows) < NOTE_FROM or abs(rows) < SURE_ERRORS * line.error:
            continue
        of_means = late_by(clock_work, pair.late) - late_by(clock_work, pair.against)
        if of_means and abs(rows - of_means) < 1.0:
            continue  # named already
        findings.append(_finding(clock_work, pair, line))
    return findings, work


def _finding(work: LogUnderCheck, pair: LagPair, line: Slope) -> Finding:
    late, early = (pair.late, pair.against) if line.value > 0.0 else (pair.against, pair.late)
    return Finding(
        "lag",
        NOTE if abs(line.value) < WARN_FROM else WARNING,
        pair.subject,
        {"rows": line.value, "error": line.error, "seconds": line.value * work.step, "late": late, "early": early},
    )


def _pairs(work: LogUnderCheck) -> Iterator[tuple[LogUnderCheck, LagPair]]:
    """What can be compared, and in which rows; `late` is the channel whose lag is positive."""
    speed = work.full("wheel_speed")
    floor_motion = ground(work)
    if speed is not None and floor_motion is not None and work.geometry is not None:
        wheel_motion = wheels_twist(work, speed, floor_motion.width)
        assert wheel_motion is not None
        length = np.array([1.0, 1.0, float(np.mean(work.geometry.wheels.robot_radius))])
        axes = floor_motion.axes
        pair = LagPair(
            "wheel_speed",
            floor_motion.name,
            wheel_motion[:, axes] * length[axes],
            floor_motion.twist[:, axes] * length[axes],
            f"wheel_speed {floor_motion.name}",
        )
        yield work, pair
    # A current jumps with the voltage, a speed does not: between samples of the current nothing is on a line.
    clock_work = sampled_with(work, "current", ("voltage", "duty", "supply", "wheel_speed"))
    speed = clock_work.full("wheel_speed")
    if speed is not None:
        yield from ((clock_work, pair) for pair in _of_motors(clock_work, speed))
    pose, twist = work.get("pose"), work.get("twist")
    if pose is not None and twist is not None and np.isfinite(pose[:, 2]).any() and np.isfinite(twist[:, 2]).any():
        rate = central_rate(unwrapped(pose[:, 2]), work.t, 1)
        yield work, LagPair("omega", "heading", smooth(twist[:, 2], 3)[:, None], rate[:, None], "omega heading")


def _of_motors(work: LogUnderCheck, speed: FloatArray) -> Iterator[LagPair]:
    """u = R i + K l w: late voltage, current or speed, each against the two others."""
    voltage, current = volts(work), work.full("current")
    if voltage is None or current is None or electric_speed(work) is None:
        return
    counter, ohmic_drop = emf(work, speed), ohmic(work, current)
    if counter is None or ohmic_drop is None or voltage.shape != ohmic_drop.shape:
        return
    names = "voltage" if work.get("voltage") is not None else "duty"
    yield LagPair("current", f"{names} wheel_speed", ohmic_drop, voltage - counter, "current")


def lag(work: LogUnderCheck, y: FloatArray, x: FloatArray) -> Slope | None:
    """Rows by which y is later than x, with its error; None where the two do not share motion enough to tell.

    A whole number of rows first, by the least residual; then the rest from the residual's part along the slope of x,
    with the slope of y beside it as instrument, so that noise of neither pulls it.
    """
    y, x = _filled(y)[:MOST_ROWS], _filled(x)[:MOST_ROWS]
    width = 3
    y, x = smooth(y, width), smooth(x, width)
    n = len(y)
    inside = slice(FARTHEST_ROWS + 4, n - FARTHEST_ROWS - 4)
    finite = np.asarray(np.isfinite(y).all(axis=1) & np.isfinite(x).all(axis=1))
    for segment in work.segments[1:]:
        if segment.start > n:
            break
        finite[max(0, segment.start - FARTHEST_ROWS - 4) : segment.start + FARTHEST_ROWS + 4] = False
    keep = finite[inside]
    if keep.sum() < MIN_ROWS:
        return None
    target = np.where(keep[:, None], y[inside], 0.0)

    def moved(values: FloatArray, by: int) -> FloatArray:
        part = values[inside.start - by : inside.stop - by]
        return np.where(keep[:, None] & np.isfinite(part), part, 0.0)

    best, least_misfit, at = 0, np.inf, {}
    for by in range(-FARTHEST_ROWS, FARTHEST_ROWS + 1):
        shifted = moved(x, by)
        size, along = float((shifted**2).sum()), float((target * shifted).sum())
        misfit = float((target**2).sum()) - along * (along / size) if size > 0.0 and along > 0.0 else np.inf
        at[by] = misfit
        if misfit < least_misfit:
            best, least_misfit = by, misfit
    total = float((target**2).sum())
    if not np.isfinite(least_misfit) or least_misfit > 0.5 * total or abs(best) == FARTHEST_ROWS:
        return None
    shifted = moved(x, best)
    a = float((target * shifted).sum() / (shifted**2).sum())
    # Slopes over +-k rows; the instrument stays clear of the rows that the residual's noise comes from.
    k = 3
    climb = (moved(x, best - 1) - moved(x, best + 1)) / 2.0
    instrument = moved(y, -k) - moved(y, k)
    residual = target - a * shifted
    ids, count = clusters(n, work.step)
    ids = ids[inside]
    top = windowed(ids, count, -(residual * instrument).sum(axis=1))
    below = windowed(ids, count, a * (climb * instrument).sum(axis=1))
    rest = ratio(top, below)
    if not np.isfinite(rest.error):
        return None
    return Slope(best + rest.value, rest.error, rest.windows)


def _filled(values: FloatArray) -> FloatArray:
    return values if values.ndim == 2 else values[:, None]
