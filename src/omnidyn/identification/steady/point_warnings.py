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
LEAST_PROBABILITY = 0.01  # probability below which the scatter contradicts the std given
ORIGINS = ("table", "current", "voltage")  # of forces


def line_statements(axis: int, line: Line, weighted: bool) -> list[Statement]:
    """What is weak about one fitted line. weighted: by std that came with the data."""
    weak_points: list[Statement] = []
    head = AXES[axis]
    if line.degrees_of_freedom <= FEW_DEGREES and not line.absolute_std:
        numbers = {"degrees": line.degrees_of_freedom, "rows": line.rows, "quantile": line.quantile}
        weak_points.append(Statement("few_degrees", subject=head, numbers=numbers))
    for k, name in enumerate(line.keys):
        low, high = line.ci95[k]
        if line.at_bound[k]:
            weak_points.append(
                Statement("coefficient_at_bound", subject=name, numbers={"free": line.free[k], "high": high})
            )
        elif low <= 0.0 <= high:
            weak_points.append(Statement("interval_contains_zero", subject=name, numbers={"ci95": (low, high)}))
    if not line.converged:
        weak_points.append(Statement("speed_std_not_settled", subject=head))
    degrees = line.degrees_of_freedom
    if weighted and degrees >= 1:
        share = chdtr(degrees, line.reduced_chi2 * degrees)
        if not LEAST_PROBABILITY / 2 <= share <= 1.0 - LEAST_PROBABILITY / 2:
            numbers = {"times": np.sqrt(line.reduced_chi2), "absolute_std": line.absolute_std}
            weak_points.append(Statement("scatter_contradicts_std", subject=head, numbers=numbers))
    return weak_points


def point_statements(robot: Robot, points: SteadyTable) -> list[Statement]:
    """What is odd about the points, whatever line is drawn through them."""
    odd_points = [*statements(points.notes)]
    for axis in range(len(AXES)):
        rows = np.flatnonzero(points.axis_index == axis)
        if rows.size:
            wrong = int((points.force[rows] * points.speed[rows] < 0.0).sum())
            sign_statement = Statement(
                "axis_against_motion", subject=AXES[axis], numbers={"wrong": wrong, "rows": rows.size}
            )
            odd_points += [sign_statement] if wrong else []
            odd_points += _beyond_no_load(robot, axis, points, rows)
            forces = {points.force_from: points.force[rows], **_recomputed(robot, axis, points, rows)}
            for pair in combinations([name for name in ORIGINS if name in forces], 2):
                odd_points += _compare(axis, pair, forces[pair[0]], forces[pair[1]])
    return odd_points


def _beyond_no_load(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> list[Statement]:
    """Rows in which the wheels outrun the voltage: at the no-load speed the back-EMF has eaten all of it."""
    if points.voltage is None:
        return []
    ratio = no_load_ratio(robot, points.twists[rows], points.voltage[rows])
    excess_ratios = ratio[ratio > 1.0]
    if not excess_ratios.size:
        return []
    excess = 100.0 * (excess_ratios[np.isfinite(excess_ratios)] - 1.0)
    numbers = {
        "beyond": excess_ratios.size,
        "moving": int((points.speed[rows] != 0.0).sum()),
        "excess": (excess.min(), excess.max()) if excess.size else None,
    }
    return [Statement("beyond_no_load", subject=AXES[axis], numbers=numbers)]


def no_load_ratio(robot: Robot, twist: FloatArray, voltage: FloatArray) -> FloatArray:
    """Speed over no-load speed, |e|^2 / (e . u) with the back-EMF e of all wheels. Shape (rows,).

    Above 1 the motors brake as a whole. Infinite where the voltage opposes the motion, NaN at rest or without voltage.
    """
    emf = back_emf(robot.motor, wheel_speed(robot.wheels, twist))
    emf_square, emf_by_voltage = (emf * emf).sum(axis=1), (emf * voltage).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(emf_by_voltage > 0.0, emf_square / emf_by_voltage, np.inf)
    return np.where((emf_square > 0.0) & np.isfinite(emf_by_voltage), ratio, np.nan)


def _recomputed(robot: Robot, axis: int, points: SteadyTable, rows: NDArray[np.intp]) -> dict[str, FloatArray]:
    """The same forces from other measurements."""
    twist = points.twists[rows]
    extra = frame_wrench(robot, twist)[:, axis]
    forces: dict[str, FloatArray] = {}
    if points.current is not None and points.force_from != "current":
        forces["current"] = wrench_from_currents(robot, points.current[rows])[:, axis] + extra
    if points.voltage is not None and points.force_from != "voltage":
        forces["voltage"] = drive_wrench(robot, twist, points.voltage[rows])[:, axis] + extra
    return forces


def _compare(axis: int, origins: tuple[str, str], a: FloatArray, b: FloatArray) -> list[Statement]:
    known_rows = np.isfinite(a) & np.isfinite(b)
    a, b = a[known_rows], b[known_rows]
    size = float(np.sqrt(np.mean(a**2))) if a.size else 0.0
    if size == 0.0:
        return []
    difference = float(np.sqrt(np.mean((a - b) ** 2)))
    if difference <= AGREEMENT * size:
        return []
    numbers = {"origins": origins, "ratio": a @ b / (a @ a), "rows": a.size, "difference": difference}
    return [Statement("forces_disagree", subject=AXES[axis], numbers=numbers)]


def rest_statements(axis: int, resting: int, rest_use: str) -> list[Statement]:
    """How rows at rest were used, where that matters."""
    codes = {"line": ("rest_as_sliding", "warning"), "ignore": ("rest_not_used", NOTE)}
    code, severity = codes.get(rest_use, ("", ""))
    return [Statement(code, severity, AXES[axis], {"rows": resting})] if resting and code else []
