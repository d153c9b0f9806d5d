"""What is odd about steady points, and weak about the lines through them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr

from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.line import Line
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.dynamics import drive_wrench, frame_wrench, wrench_from_currents
from omnidyn.model.frames import AXES
from omnidyn.model.motor import back_emf
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.statement import NOTE, Statement, statements

FEW_DEGREES = 2
AGREEMENT = 0.05  # forces that differ by less than this share of their size agree
UNLIKELY = 0.01  # probability below which the scatter contradicts the std given
ORIGINS = ("table", "current", "voltage")  # of forces


def line_statements(
    axis: int, line: Line, names: tuple[str, str], weighted: bool, absolute_std: bool
) -> list[Statement]:
    """What is weak about one fitted line. names: keys of B and C."""
    found: list[Statement] = []
    head = AXES[axis]
    if line.degrees_of_freedom <= FEW_DEGREES and not absolute_std:
        numbers = {"degrees": line.degrees_of_freedom, "rows": line.rows, "quantile": line.quantile}
        found.append(Statement("few_degrees", subject=head, numbers=numbers))
    for k, name in enumerate(names):
        low, high = line.ci95[k]
        if line.at_bound[k]:
            found.append(Statement("coefficient_at_bound", subject=name, numbers={"free": line.free[k], "high": high}))
        elif low <= 0.0 <= high:
            found.append(Statement("interval_contains_zero", subject=name, numbers={"ci95": (low, high)}))
    if not line.converged:
        found.append(Statement("speed_std_not_settled", subject=head))
    return found + (_scatter(head, line, absolute_std) if weighted else [])


def _scatter(head: str, line: Line, absolute_std: bool) -> list[Statement]:
    """Whether the residuals fit the std that came with the data."""
    degrees = line.degrees_of_freedom
    if degrees < 1:
        return []
    share = chdtr(degrees, line.reduced_chi2 * degrees)
    if UNLIKELY / 2 <= share <= 1.0 - UNLIKELY / 2:
        return []
    numbers = {"times": np.sqrt(line.reduced_chi2), "absolute_std": absolute_std}
    return [Statement("scatter_contradicts_std", subject=head, numbers=numbers)]


def point_statements(robot: Robot, points: SteadyTable) -> list[Statement]:
    """What is odd about the points, whatever line is drawn through them."""
    found = [*statements(points.notes)]
    for axis in range(len(AXES)):
        rows = np.flatnonzero(points.axis_index == axis)
        if rows.size:
            found += _against_motion(axis, points, rows)
            found += _beyond_no_load(robot, axis, points, rows)
            found += _disagreements(robot, axis, points, rows)
    return found


def _against_motion(axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[Statement]:
    wrong = int((points.force[rows] * points.speed[rows] < 0.0).sum())
    numbers = {"wrong": wrong, "rows": rows.size}
    return [Statement("axis_against_motion", subject=AXES[axis], numbers=numbers)] if wrong else []


def _beyond_no_load(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[Statement]:
    """Rows in which the wheels outrun the voltage: at the no-load speed the back-EMF has eaten all of it."""
    if points.voltage is None:
        return []
    ratio = no_load_ratio(robot, points.twists[rows], points.voltage[rows])
    beyond = ratio[ratio > 1.0]
    if not beyond.size:
        return []
    excess = 100.0 * (beyond[np.isfinite(beyond)] - 1.0)
    numbers = {
        "beyond": beyond.size, "moving": int((points.speed[rows] != 0.0).sum()),
        "excess": (excess.min(), excess.max()) if excess.size else None,
    }  # fmt: skip
    return [Statement("beyond_no_load", subject=AXES[axis], numbers=numbers)]


def no_load_ratio(robot: Robot, twist: FloatArray, voltage: FloatArray) -> FloatArray:
    """Speed over no-load speed, |e|^2 / (e . u) with the back-EMF e of all wheels. Shape (rows,).

    Above 1 the motors brake as a whole. Infinite where the voltage opposes the motion, NaN at rest or without voltage.
    """
    emf = back_emf(robot.motor, wheel_speed(robot.wheels, twist))
    own, against = (emf * emf).sum(axis=1), (emf * voltage).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(against > 0.0, own / against, np.inf)
    return np.where((own > 0.0) & np.isfinite(against), ratio, np.nan)


def _disagreements(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[Statement]:
    """The same force from different measurements, in numbers, where they disagree."""
    forces = {points.force_from: points.force[rows], **_recomputed(robot, axis, points, rows)}
    pairs = combinations([name for name in ORIGINS if name in forces], 2)
    return [one for first, second in pairs for one in _compare(axis, (first, second), forces[first], forces[second])]


def _recomputed(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> dict[str, FloatArray]:
    twist = points.twists[rows]
    extra = frame_wrench(robot, twist)[:, axis]
    forces: dict[str, FloatArray] = {}
    if points.current is not None and points.force_from != "current":
        forces["current"] = wrench_from_currents(robot, points.current[rows])[:, axis] + extra
    if points.voltage is not None and points.force_from != "voltage":
        forces["voltage"] = drive_wrench(robot, twist, points.voltage[rows])[:, axis] + extra
    return forces


def _compare(axis: int, origins: tuple[str, str], a: FloatArray, b: FloatArray) -> list[Statement]:
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    size = float(np.sqrt(np.mean(a**2))) if a.size else 0.0
    if size == 0.0:
        return []
    difference = float(np.sqrt(np.mean((a - b) ** 2)))
    if difference <= AGREEMENT * size:
        return []
    numbers = {"origins": origins, "ratio": a @ b / (a @ a), "rows": a.size, "difference": difference}
    return [Statement("forces_disagree", subject=AXES[axis], numbers=numbers)]


def rest_statements(axis: int, resting: int, rest: str) -> list[Statement]:
    """How rows at rest were used, where that matters."""
    codes = {"line": ("rest_as_sliding", "warning"), "ignore": ("rest_not_used", NOTE)}
    code, severity = codes.get(rest, ("", ""))
    return [Statement(code, severity, AXES[axis], {"rows": resting})] if resting and code else []
