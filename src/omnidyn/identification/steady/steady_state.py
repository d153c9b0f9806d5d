"""The paper's identification: friction from points at constant speed, eqs (15)-(17).

    force = B speed + C sgn(speed)        per body axis: v (15), v_n (16), w (17)

At constant speed the friction balances what drives the robot. The driving force comes from a table, from motor
currents or from voltages (points.py); B and C of each axis from weighted least squares (line.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.estimate import Estimate, identified
from omnidyn.identification.force_scale import scale_of_traction
from omnidyn.identification.steady.levels import estimate_of
from omnidyn.identification.steady.line import PARAMETERS, Line, fit_line
from omnidyn.identification.steady.point_warnings import line_statements, point_statements, rest_statements
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.frames import AXES
from omnidyn.model.friction import AxesFriction
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, Statement

REST = ("bound", "line", "ignore")
MAX_FRICTION = 1e6  # what a robot file takes
ONE_SPEED = 1e-4  # speeds that differ by less than this share are one speed


@dataclass
class _Findings:
    """What the axes gave so far: lines and bounds by axis, and warnings."""

    lines: dict[int, Line] = field(default_factory=dict)
    bounds: dict[int, float] = field(default_factory=dict)
    warnings: list[Statement] = field(default_factory=list)
    unfitted_notes: list[Statement] = field(default_factory=list)


def fit_steady_state(
    robot: Robot,
    data: SteadyTable,
    *,
    rest_use: str = "bound",
    rest_speed: Sequence[float] = (0.0, 0.0, 0.0),
    absolute_std: bool = False,
) -> Estimate:
    """Identify B and C of every axis in `data`, eqs (15)-(17).

    data: from `read_steady_table`, or `SteadyTable(axis, speed, force)`.
    rest_use: what a row at rest says. "bound": friction can hold that force, so breakaway is at least that; the line is
    fitted to the moving rows. "line": it is a point of the sliding line, force = C (the paper's way). "ignore": no more
    than that it is there.
    rest_speed: speeds up to this count as rest, per axis [m/s, m/s, rad/s].
    absolute_std: speed_std and force_std are exact; by default only their ratios count and the scatter sets the scale.

    Returns an Estimate; its robot has the new B and C. An axis without data, or with one speed only, keeps what the
    robot had, and a warning says so. A B or C that would be negative is 0, listed in `at_bound`. A bound from rest
    above C becomes the breakaway of the robot (the smallest one that agrees with the data), with a warning.
    Raises InsufficientDataError when an axis has one or two moving rows (a line with intervals needs three), or when no
    axis can be fitted; UnsupportedError for a robot with friction on the direction of travel or at the wheels, which
    would count twice; InputError for a wrong option.
    """
    check_order("fit_steady_state(robot, data)", (robot, Robot), (data, SteadyTable))
    limits = _options(rest_use, rest_speed, absolute_std, data)
    if not robot.friction.only_axes:
        raise UnsupportedError(
            "this fit knows friction on the body axes only",
            got=f"{robot.name} with friction elsewhere too",
            expected="[friction.axes] alone",
            remedy="remove [friction.direction] and [friction.wheels]",
        )
    findings = _Findings(warnings=point_statements(robot, data))
    for axis in range(len(AXES)):
        _study(axis, data, rest_use, limits[axis], absolute_std, findings)
    if not findings.lines:
        bound_notes = [
            Statement("holds_at_least", NOTE, AXES[axis], {"bound": bound, "key": _breakaway(axis)})
            for axis, bound in findings.bounds.items()
        ]
        raise InsufficientDataError(
            "; ".join(map(str, ["no axis can be fitted", *findings.unfitted_notes, *bound_notes])),
            expected="three rows in motion or more, at two speeds or more, per axis",
            where=data.source,
        )
    findings.warnings += findings.unfitted_notes
    if data.force_from == "voltage":
        findings.warnings.append(Statement("forces_from_voltage", NOTE))
    friction = _friction(robot.friction.axes, findings)
    name = f"{(Path(data.source).name if data.sha256 else data.source) or 'unnamed'}, {len(data)} points"
    name = f"{name}, sha256 {data.sha256}" if data.sha256 else name
    method = {
        "weighted": data.force_std is not None,
        "absolute_std": absolute_std,
        "force_from": data.force_from,
        "rest": rest_use,
    }
    return estimate_of(
        list(findings.lines.values()),
        robot.replace(friction=robot.friction.replace(axes=friction)),
        name,
        {
            _breakaway(axis): identified(None, f"lower bound from rest, {name}")
            for axis, bound in findings.bounds.items()
            if friction.breakaway is not None and friction.breakaway[axis] == bound
        },
        lower_bound={_breakaway(axis): bound for axis, bound in findings.bounds.items()},
        warnings=tuple(findings.warnings),
        method=str(Statement("line_method", NOTE, numbers=method)),
        scale="" if data.force_from == "table" else scale_of_traction(robot, data.force_from == "current"),
        points=data,
    )


def _options(rest_use: str, rest_speed: Sequence[float], absolute_std: bool, data: SteadyTable) -> FloatArray:
    if rest_use not in REST:
        raise InputError("unknown use of rows at rest", got=rest_use, expected=" or ".join(REST), where="rest")
    limits = np.asarray(rest_speed, dtype=float)
    if limits.shape != (3,) or not ((limits >= 0.0) & np.isfinite(limits)).all():
        raise InputError(
            "cannot tell rest from motion", got=rest_speed, expected="three speeds, 0 or above", where="rest_speed"
        )
    if absolute_std and data.force_std is None:
        raise InputError(
            "absolute_std needs the std of the forces", got="none", expected="a column force_std", where=data.source
        )
    return limits


def _study(axis: int, data: SteadyTable, rest_use: str, limit: float, absolute_std: bool, findings: _Findings) -> None:
    """One axis: its bound from rest, its line, its warnings."""
    axis_rows = data.axis_index == axis
    moving = axis_rows & (np.abs(data.speed) > limit)
    resting = axis_rows & ~moving
    if not axis_rows.any():
        findings.unfitted_notes.append(Statement("axis_without_data", NOTE, AXES[axis]))
        return
    findings.warnings += rest_statements(axis, int(resting.sum()), rest_use)
    if rest_use == "bound" and resting.any():
        findings.bounds[axis] = float(np.abs(data.force[resting]).max())
    used_rows = moving | (resting & (data.force != 0.0)) if rest_use == "line" else moving
    speed = np.where(moving, data.speed, 0.0)[used_rows]
    if not _identifiable(axis, speed, data.force[used_rows], absolute_std, findings, data.source):
        return
    spreads = [None if std is None else std[used_rows] for std in (data.speed_std, data.force_std)]
    keys = f"friction.axes.viscous[{axis}]", f"friction.axes.coulomb[{axis}]"
    line = fit_line(speed, data.force[used_rows], *spreads, absolute_std=absolute_std, keys=keys)
    if (line.level > MAX_FRICTION).any():
        excess_level = {"level": line.level.max()}
        findings.unfitted_notes.append(Statement("axis_beyond_any_robot", subject=AXES[axis], numbers=excess_level))
        return
    findings.lines[axis] = line
    findings.warnings += line_statements(axis, line, data.force_std is not None)


def _identifiable(
    axis: int, speed: FloatArray, force: FloatArray, absolute_std: bool, findings: _Findings, source: str
) -> bool:
    """Whether the rows determine a line; what is known instead goes to `findings`.

    Raises InsufficientDataError for too few rows: to leave such an axis out would hide the user's own points.
    """
    size = np.abs(speed)
    if not size.any():
        findings.unfitted_notes.append(Statement("axis_never_moved", subject=AXES[axis]))
        return False
    needed_rows = PARAMETERS if absolute_std else PARAMETERS + 1
    if len(speed) < needed_rows:
        raise InsufficientDataError(
            f"axis {AXES[axis]}: too few rows for a line with intervals",
            got=f"{len(speed)} usable rows",
            expected=f"{needed_rows} or more at two speeds or more",
            where=source,
            remedy="measure more points, or remove this axis from the data",
        )
    if np.ptp(size) > ONE_SPEED * size.max():
        return True
    total = float(np.mean(force * np.sign(speed)))
    numbers = {"speed": size.max(), "sum": total}
    findings.unfitted_notes.append(Statement("axis_at_one_speed", subject=AXES[axis], numbers=numbers))
    return False


def _breakaway(axis: int) -> str:
    return f"friction.axes.breakaway[{axis}]"


def _friction(old_friction: AxesFriction, findings: _Findings) -> AxesFriction:
    """The friction with the fitted B and C; breakaway raised only as far as C or a row at rest demands."""
    viscous, coulomb, breakaway = (level.copy() for level in old_friction.levels)
    for axis, line in findings.lines.items():
        viscous[axis], coulomb[axis] = line.level
        if old_friction.breakaway is None:
            breakaway[axis] = coulomb[axis]
        elif breakaway[axis] < coulomb[axis]:
            raised_level = {"before": breakaway[axis]}
            findings.warnings.append(Statement("breakaway_raised", subject=_breakaway(axis), numbers=raised_level))
            breakaway[axis] = coulomb[axis]
        else:
            findings.warnings.append(Statement("breakaway_kept", NOTE, _breakaway(axis), {"level": breakaway[axis]}))
    for axis, bound in findings.bounds.items():
        if bound > breakaway[axis]:
            numbers = {"bound": bound, "coulomb": coulomb[axis]}
            findings.warnings.append(Statement("breakaway_from_rest", subject=_breakaway(axis), numbers=numbers))
            breakaway[axis] = bound
    raised_level = old_friction.breakaway is not None or bool((breakaway > coulomb).any())
    return old_friction.replace(
        viscous=viscous.tolist(), coulomb=coulomb.tolist(), breakaway=breakaway.tolist() if raised_level else None
    )
