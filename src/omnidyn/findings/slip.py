"""Slip in some stretch: where the robot covers less of the path that its wheels roll than it does elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import ground, wheels_twist
from omnidyn.findings.signal.robust import products, slope, smooth
from omnidyn.logs.channels import components
from omnidyn.model.motor import settled_current, traction
from omnidyn.simulation.slip.plant import grips
from omnidyn.statement import WARNING
from omnidyn.statistics import robust_std

WINDOW, SHORTEST_STRETCH = 0.15, 0.4  # [s]
LEAST_DEVIATION, SURE_ERRORS = 0.025, 5.5  # of the ratio; standard errors, over all stretches that are looked at
STAND_IN = 0.1  # the least where one wheel is dead and another channel stands in for it
APART = 0.03  # of the ratio, between two axes
MANY_WINDOWS = 12  # windows in motion along an axis
STRETCHES = 3
FASTER = 12.0  # mean square of the speed in one part of the log over that in the other, at most
SPINS = 0.25  # of the path: less is no slip but a wheel that spins
LAG = 1.5  # rows by which the channels may lag each other
MAX_WINDOWS = 400


def check_slip(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on stretches that slip; the motion over the floor is masked there."""
    findings: list[Finding] = []
    for _ in range(STRETCHES):
        stretch = _worst(work)
        if stretch is None:
            break
        mask, inside, outside, error = stretch
        floor_motion = ground(work)
        assert floor_motion is not None
        names = " ".join(components("wheel_speed", work.wheels))
        rows = np.flatnonzero(mask)
        findings.append(
            Finding(
                "slip",
                WARNING,
                names,
                {
                    "ratio": inside / outside,
                    "error": error,
                    "from_s": float(work.t[rows[0]]),
                    "to_s": float(work.t[rows[-1]]),
                    "inside": inside,
                    "outside": outside,
                    **_against_the_limit(work, mask),
                },
                rows=work.lines(mask),
                count=int(mask.sum()),
            )
        )
        values = work.channels[floor_motion.name].copy()
        values[mask] = np.nan
        work = work.replace(**{floor_motion.name: values})
    return findings, work


def _against_the_limit(work: LogUnderCheck, mask: BoolArray) -> dict[str, Any]:
    """What the motors push with in those rows, and what the floor of the robot file takes of a wheel [N]."""
    robot = work.robot
    if robot is None or robot.wheels.traction_mu is None:
        return {}
    current, voltage, speed = (work.full(name) for name in ("current", "voltage", "wheel_speed"))
    if current is None and voltage is not None and speed is not None:
        current = settled_current(robot.motor, voltage, speed)
    limit = grips(robot)
    floor: dict[str, Any] = {"grips_N": sorted(set(np.round(limit, 6).tolist()))}
    if current is None or not np.isfinite(pushes := np.abs(traction(robot.motor, robot.wheels, current[mask]))).any():
        return floor
    beyond = float((pushes > limit).any(axis=1).mean())
    return floor | {"push_N": float(np.nanmax(pushes)), "beyond": beyond}


def _worst(work: LogUnderCheck) -> tuple[BoolArray, float, float, float] | None:
    """(rows, ratio inside, ratio outside, error of their quotient) of the stretch that differs most, if it is sure."""
    speed, floor_motion = work.full("wheel_speed"), ground(work)
    if speed is None or floor_motion is None or work.geometry is None or len(work) < 3 * MIN_ROWS:
        return None
    wheel_motion = wheels_twist(work, speed, floor_motion.width)
    assert wheel_motion is not None
    length = np.array([1.0, 1.0, float(np.mean(work.geometry.wheels.robot_radius))])
    if not _witness(wheel_motion * length, floor_motion.axes):
        return None
    for weights in (length, _levelled(work, floor_motion.twist, wheel_motion, length)):
        # An axis with a scale of its own is no slip: the contrast has to be there without it as well.
        stretch = _contrast(work, floor_motion.twist * weights, wheel_motion * length, floor_motion.axes)
        if stretch is None:
            return None
    return stretch


def _witness(wheel_motion: FloatArray, axes: list[int]) -> bool:
    """Whether the axes that were measured hold a fair part of the motion."""
    size = np.sqrt(np.nanmean(wheel_motion**2, axis=0))
    return bool(np.sqrt((size[axes] ** 2).sum()) > 0.3 * np.sqrt((size**2).sum()))


def _levelled(work: LogUnderCheck, floor: FloatArray, wheel_motion: FloatArray, length: FloatArray) -> FloatArray:
    """Weights that give floor and wheels the same slope along x, along y and about yaw."""
    ids, count = work.windows()
    linear = slope(floor[:, :2], wheel_motion[:, :2], ids, count)
    weights = length.copy()
    for k in range(3):
        axis = slope(floor[:, k], wheel_motion[:, k], ids, count)
        apart = abs(linear.value - axis.value)
        if apart > APART and apart > 5.0 * np.hypot(linear.error, axis.error) and min(linear.value, axis.value) > 0.1:
            weights[k] *= linear.value / axis.value
    return weights


def check_axes(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The finding on x or y, of which the robot covers another share of what the wheels roll than of the other axes."""
    speed, floor_motion = work.full("wheel_speed"), ground(work)
    wheel_motion = None if speed is None or floor_motion is None else wheels_twist(work, speed, floor_motion.width)
    if floor_motion is None or wheel_motion is None or len(work) < 3 * MIN_ROWS or floor_motion.axes[:2] != [0, 1]:
        return [], work
    rough = np.nansum(floor_motion.twist[:, :2] * wheel_motion[:, :2], axis=0) / np.nansum(
        wheel_motion[:, :2] ** 2, axis=0
    )
    if abs(rough[0] - rough[1]) < 0.5 * APART:
        return [], work
    ids, count = work.windows()
    lines = [slope(floor_motion.twist[:, k], wheel_motion[:, k], ids, count) for k in range(2)]
    k = int(np.argmax([abs(line.value - 1.0) for line in lines]))
    off, reference = lines[k], lines[1 - k]
    apart, error = abs(off.value - reference.value), float(np.hypot(off.error, reference.error))
    if min(line.windows for line in lines) < MANY_WINDOWS or not apart > max(APART, SURE_ERRORS * error):
        return [], work
    if not (min(off.value, reference.value) > 0.1 and abs(reference.value - 1.0) < 0.5 * apart):
        return [], work
    axis = ("x", "y")[k]
    finding = Finding("axis_ratio", WARNING, axis, {"ratio": off.value, "error": off.error, "other": reference.value})
    values = work.channels[floor_motion.name].copy()
    values[:, k] = values[:, k] / off.value if floor_motion.name == "twist" else np.nan
    return [finding], work.replace(**{floor_motion.name: values})


def _contrast(
    work: LogUnderCheck, floor: FloatArray, wheel_motion: FloatArray, axes: list[int]
) -> tuple[BoolArray, float, float, float] | None:
    ids, count = work.windows(WINDOW)
    top, below = products(floor[:, axes], wheel_motion[:, axes], ids, count)
    if count > MAX_WINDOWS or below.sum() <= 0.0:
        return None
    overall = top.sum() / below.sum()
    moving = below > 1e-2 * below.mean()
    if moving.sum() < 12:
        return None
    noise = min(_noise(top, below, overall, moving, size) for size in (1, 4))
    numbers = np.concatenate([[0.0], np.cumsum(top)]), np.concatenate([[0.0], np.cumsum(np.maximum(below, 0.0))])
    shortest = max(2, round(SHORTEST_STRETCH / (work.step * max(1, (ids == 0).sum()))))
    starts, ends = np.triu_indices(count + 1, shortest)
    n_in, d_in = numbers[0][ends] - numbers[0][starts], numbers[1][ends] - numbers[1][starts]
    n_out, d_out = numbers[0][-1] - n_in, numbers[1][-1] - d_in
    # Both parts have to move, and about as fast as each other: what is left of noise is no motion.
    busy = np.concatenate([[0.0], np.cumsum(moving)])
    b_in = np.maximum(busy[ends] - busy[starts], 1.0)
    b_out = np.maximum(busy[-1] - b_in, 1.0)
    alike = np.abs(np.log(np.maximum(d_in / b_in, 1e-300) / np.maximum(d_out / b_out, 1e-300))) < np.log(FASTER)
    usable = (d_in > 0.02 * numbers[1][-1]) & (d_out > 0.02 * numbers[1][-1]) & alike
    if not usable.any():
        return None
    # A lag of so many rows adds lag/2 times the change of x^2 over the stretch.
    square = _at_edges(np.nansum(wheel_motion[:, axes] ** 2, axis=1), ids, count)
    lagged = 0.5 * LAG * np.abs(square[ends] - square[starts])
    with np.errstate(divide="ignore", invalid="ignore"):
        away = n_in / d_in - n_out / d_out
        error = noise * np.sqrt(1.0 / d_in + 1.0 / d_out)
        significance = np.where(usable, (np.abs(away) - lagged * (1.0 / d_in + 1.0 / d_out)) / error, 0.0)
    k = int(np.argmax(significance))
    inside, outside = n_in[k] / d_in[k], n_out[k] / d_out[k]
    rows = (ids >= starts[k]) & (ids < ends[k])
    if inside > outside:  # then the rest is what slips
        inside, outside, rows = outside, inside, ~rows
    least_deviation = LEAST_DEVIATION if work.facts.get("dead_wheel") is None else STAND_IN
    if significance[k] < SURE_ERRORS or not 0.1 < outside < 2.0 or (outside - inside) / outside < least_deviation:
        return None
    if inside < SPINS * outside and not 0.5 < (d_in[k] / b_in[k]) / (d_out[k] / b_out[k]) < 2.0:
        return None  # wheels that are said to spin while the robot stands: then as fast as they turn elsewhere
    return rows, float(inside), float(outside), float(error[k] / outside)


def _noise(top: FloatArray, below: FloatArray, overall: float, moving: BoolArray, size: int) -> float:
    """Noise of the ratio for one unit of `below`, from groups of `size` windows.

    From one group to the next slip does not change, noise does; where the robot speeds up there is more of it. Errors
    of a pose cancel over longer groups.
    """
    t, b = top[moving], below[moving]
    groups = len(b) // size
    if groups < 12:
        return np.inf if size > 1 else 1.0
    t, b = (column[: groups * size].reshape(groups, size).sum(axis=1) for column in (t, b))
    changes = np.abs(np.diff((t - overall * b) / np.sqrt(b))) / np.sqrt(2.0)
    return max(float(robust_std(changes, 0.0)), float(np.quantile(changes, 0.9)) / 2.0)


def _at_edges(values: FloatArray, ids: IntArray, count: int) -> FloatArray:
    """Values where the windows begin, and at the end. Shape (count + 1,)."""
    first = np.searchsorted(ids, np.arange(count))
    return smooth(values[:, None], 3)[np.append(first, len(values) - 1), 0]
