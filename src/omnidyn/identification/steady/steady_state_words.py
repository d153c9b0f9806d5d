"""Warnings of steady points and the lines through them, in words that a reader can act on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr

from omnidyn.arrays import FloatArray
from omnidyn.document import short
from omnidyn.identification.steady.line import Line
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.dynamics import drive_wrench, frame_wrench, wrench_from_currents
from omnidyn.model.frames import AXES
from omnidyn.model.keys import unit
from omnidyn.model.motor import back_emf
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed

FEW_DEGREES = 2
AGREEMENT = 0.05  # forces that differ by less than this share of their size agree
UNLIKELY = 0.01  # probability below which the scatter contradicts the std given

ORIGIN = {
    "table": "the table",
    "current": "motor currents, eqs (7)-(10)",
    "voltage": "voltage and speed, eq (11)",
}


def about_line(axis: int, line: Line, names: tuple[str, str], weighted: bool, absolute_std: bool) -> list[str]:
    """What is weak about one fitted line. `names`: keys of B and C."""
    words: list[str] = []
    head = f"axis {AXES[axis]}"
    if line.degrees_of_freedom <= FEW_DEGREES and not absolute_std:
        words.append(
            f"{head}: {_count(line.degrees_of_freedom, 'degree')} of freedom ({line.rows} rows, 2 parameters): the "
            f"95 % interval reaches {line.quantile:.3g} standard errors to each side, 1.96 with many rows"
        )
    for k, name in enumerate(names):
        low, high = line.ci95[k]
        if line.at_bound[k]:
            words.append(
                f"{name} is at bound: the best line has {line.free[k]:.4g} {unit(name)}, friction cannot be negative, "
                f"0 is taken; it may be up to {high:.3g}"
            )
        elif low <= 0.0 <= high:
            words.append(
                f"{name}: the 95 % interval [{low:.3g}, {high:.3g}] {unit(name)} contains zero: the data do not show it"
            )
    if not line.converged:
        words.append(f"{head}: the iteration for speed_std did not settle; the numbers are of its last step")
    return words + (_about_scatter(head, line, absolute_std) if weighted else [])


def _about_scatter(head: str, line: Line, absolute_std: bool) -> list[str]:
    """Whether the residuals fit the std that came with the data."""
    degrees = line.degrees_of_freedom
    if degrees < 1:
        return []
    share = chdtr(degrees, line.reduced_chi2 * degrees)
    if UNLIKELY / 2 <= share <= 1.0 - UNLIKELY / 2:
        return []
    used = "the std given" if absolute_std else "the scatter itself"
    return [
        f"{head}: the points scatter {short(np.sqrt(line.reduced_chi2))} times as much as their std says; "
        f"the intervals follow {used}"
    ]


def about_points(robot: Robot, points: SteadyTable) -> list[str]:
    """What is odd about the points, whatever line is drawn through them."""
    words = [*points.notes]
    for axis in range(len(AXES)):
        rows = np.flatnonzero(points.axis_index == axis)
        if rows.size:
            words += _against_motion(axis, points, rows)
            words += _beyond_no_load(robot, axis, points, rows)
            words += _disagreements(robot, axis, points, rows)
    return words


def _against_motion(axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[str]:
    wrong = int((points.force[rows] * points.speed[rows] < 0.0).sum())
    if not wrong:
        return []
    return [
        f"axis {AXES[axis]}: in {_count(wrong, 'row')} of {rows.size} the force points against the motion, as if "
        f"friction drove the robot: a sign is lost (an unsigned current sensor?) or a motor constant is wrong"
    ]


def _beyond_no_load(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[str]:
    """Rows in which the wheels outrun the voltage: at the no-load speed the back-EMF has eaten all of it."""
    if points.voltage is None:
        return []
    ratio = no_load_ratio(robot, points.twists[rows], points.voltage[rows])
    moving = int((points.speed[rows] != 0.0).sum())
    beyond = ratio[ratio > 1.0]
    if not beyond.size:
        return []
    excess = 100.0 * (beyond[np.isfinite(beyond)] - 1.0)
    by = f" ({excess.min():.0f} to {excess.max():.0f} % faster)" if excess.size else ""
    return [
        f"axis {AXES[axis]}: {beyond.size} of {moving} moving rows are faster than the no-load speed{by}: the "
        "back-EMF is above the voltage, so no motor drives; the speed, the voltage, the EMF constant, the gear "
        "ratio or a radius is wrong"
    ]


def no_load_ratio(robot: Robot, twist: FloatArray, voltage: FloatArray) -> FloatArray:
    """Speed over no-load speed, |e|^2 / (e . u) with the back-EMF e of all wheels. Shape (rows,).

    Above 1 the motors brake as a whole. Infinite where the voltage opposes the motion, NaN at rest or without voltage.
    """
    emf = back_emf(robot.motor, wheel_speed(robot.wheels, twist))
    own, against = (emf * emf).sum(axis=1), (emf * voltage).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(against > 0.0, own / against, np.inf)
    return np.where((own > 0.0) & np.isfinite(against), ratio, np.nan)


def _disagreements(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[str]:
    """The same force from different measurements, in numbers, where they disagree."""
    forces = {points.force_from: points.force[rows], **_recomputed(robot, axis, points, rows)}
    names = [name for name in ORIGIN if name in forces]
    words = []
    for k, first in enumerate(names):
        for second in names[k + 1 :]:
            words += _compare(axis, first, forces[first], second, forces[second])
    return words


def _recomputed(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> dict[str, FloatArray]:
    twist = points.twists[rows]
    extra = frame_wrench(robot, twist)[:, axis]
    forces: dict[str, FloatArray] = {}
    if points.current is not None and points.force_from != "current":
        forces["current"] = wrench_from_currents(robot, points.current[rows])[:, axis] + extra
    if points.voltage is not None and points.force_from != "voltage":
        forces["voltage"] = drive_wrench(robot, twist, points.voltage[rows])[:, axis] + extra
    return forces


def _compare(axis: int, first: str, a: FloatArray, second: str, b: FloatArray) -> list[str]:
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    size = float(np.sqrt(np.mean(a**2))) if a.size else 0.0
    if size == 0.0:
        return []
    difference = float(np.sqrt(np.mean((a - b) ** 2)))
    if difference <= AGREEMENT * size:
        return []
    ratio = float(a @ b / (a @ a))
    measure = "N m" if AXES[axis] == "yaw" else "N"
    return [
        f"axis {AXES[axis]}: the force from {ORIGIN[second]} is {ratio:.3g} times the force from {ORIGIN[first]} "
        f"({a.size} rows, rms difference {difference:.3g} {measure}): check R, K_t, the gear and the units"
    ]


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
