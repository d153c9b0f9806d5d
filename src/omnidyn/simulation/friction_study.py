"""What the friction of a robot does, along each axis: force against speed, presliding loop, breakaway against rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Points, Table, plain
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.dynamics import drive_wrench, frame_wrench
from omnidyn.model.frames import AXES
from omnidyn.model.friction.bristle import LAWS
from omnidyn.model.friction.kinds import COULOMB, KINDS
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import sliding_wrench, top_speeds
from omnidyn.model.stick_slip.plant import plant
from omnidyn.simulation.simulate import simulate
from omnidyn.statement import NOTE, Statement

if TYPE_CHECKING:
    from collections.abc import Sequence

UNITS = ("N", "N", "N m")
POINTS = 200  # of a curve, both ways
SLOWEST = 1e-4  # of the top speed: where a curve begins
BENT = 4.0  # times the way a bristle bends before it slips: how far a loop goes
RAMPS = (10.0, 1.0, 0.1, 0.01)  # [s] from no force to RAMP_END times breakaway
RAMP_END, RAMP_ROWS = 1.5, 400
AFTER, AFTER_ROWS = 0.2, 100  # [s] the force then stays: a bristle takes its time to give way


@dataclass(frozen=True, eq=False)
class AxisFriction:
    """Friction along one axis of the body, all tables of the file together.

    law: in words. speed [m/s or rad/s], force [N or N m]: of motion along the axis alone, shape (k,). holds: at rest,
    forward and backward. way [m or rad], loop: a slow presliding loop, force against displacement, shape (k,); empty
    where nothing bends. rate [N/s or N m/s], breakaway: the most that resists a force that rises so fast, shape (4,).
    """

    axis: str
    unit: str
    law: str
    speed: FloatArray
    force: FloatArray
    holds: tuple[float, float]
    bends: float
    travel: FloatArray
    loop: FloatArray
    rate: FloatArray
    breakaway: FloatArray


@dataclass(frozen=True, eq=False)
class FrictionStudy:
    """The friction of a robot, along x, along y and about yaw. notes: what a reader must know."""

    robot: Robot
    axes: tuple[AxisFriction, ...]
    notes: tuple[Statement, ...]

    def document(self) -> Document:
        """What it says: a table, and words."""
        head = ("axis", "law", "holds", "slides slowly", "at top speed", "bends", "breakaway, slow to fast ramp")
        table = Table(head, [_row(axis) for axis in self.axes], "<<", name="axes")
        data = {"robot": self.robot.name, "axes": [_told(axis) for axis in self.axes], "notes": plain(self.notes)}
        return Document([f"friction of {self.robot.name}", "", table, "", Points(self.notes)], data)


def friction_study(robot: Robot) -> FrictionStudy:
    """What friction does along each axis; of a robot whose motors can break it loose, at which rate it does, too.

    The ramps are simulated, with the motors of the robot; everything else is the law itself. A loop is slow: levels are
    those of the least speed. Wheels that may slip roll here: what slips is the floor's friction, not the robot's.
    Raises InputError for what is no robot.
    """
    check_order("friction_study(robot)", (robot, Robot))
    rolls = robot.replace(wheels=robot.wheels.replace(traction_mu=None))
    numbers, top = plant(rolls), top_speeds(rolls)
    patterns = axis_patterns(rolls)
    volts = breakaway_voltage(rolls, patterns)
    axes = tuple(_axis(rolls, numbers, k, float(top[k]), patterns[k], float(volts[k])) for k in range(N_AXES))
    return FrictionStudy(robot, axes, tuple(_notes(robot, axes)))


def _axis(robot: Robot, numbers: Plant, k: int, top: float, pattern: FloatArray, volts: float) -> AxisFriction:
    side = np.geomspace(SLOWEST, 1.0, POINTS // 2) * top
    speed = np.concatenate([-side[::-1], side])
    force = -sliding_wrench(robot, speed[:, None] * np.eye(N_AXES)[k])[:, k]
    unit = float(numbers.body.length) if k == 2 else 1.0
    travel, loop, bends = _loop(numbers, k, unit)
    rate, breakaway = _ramps(robot, numbers, k, pattern, volts, bends > 0.0)
    return AxisFriction(
        AXES[k], UNITS[k], _law(robot, k), speed, force, _holds(numbers, k, unit), bends, travel, loop, rate, breakaway
    )


def _parts(numbers: Plant, k: int) -> list[tuple[float, FloatArray, Any, Any]]:
    """(lever, level at the least speed forward and backward [N], record, its law) of what acts along k.

    As a plant counts them: a torque over rho.
    """
    parts = []
    for row in numbers.element:
        g = float(row.g[k])
        if g == 0.0:
            continue
        level = _slowest(row, row.stiffness > 0.0)
        parts.append((g, level if g > 0.0 else level[::-1], row, LAWS[int(row.law)]))
    if k < 2:
        body = numbers.body
        level = _slowest(body, body.stiffness > 0.0)[k]
        parts.append((1.0, np.array([level, level]), body, LAWS[int(body.law)]))
    return [part for part in parts if part[1].any()]


def _slowest(row: Any, bends: bool) -> FloatArray:
    """The pair of levels [N] at the least speed, of a record of an element or of the body."""
    if bends:
        return row.bristle_breakaway if row.fall > 0.0 else row.bristle_coulomb
    return row.breakaway if row.fall > 0.0 else row.coulomb


def _loop(numbers: Plant, k: int, unit: float) -> tuple[FloatArray, FloatArray, float]:
    """(way, force, the way that bristles bend before they slip) of a slow loop along axis k; empty where none bends."""
    parts = _parts(numbers, k)
    bent = [float(level.max() / record.stiffness) / abs(g) for g, level, record, _ in parts if record.stiffness > 0.0]
    bends = max(bent, default=0.0)
    if bends == 0.0:
        return np.zeros(0), np.zeros(0), 0.0
    reach, step = BENT * bends, np.linspace(0.0, 1.0, POINTS)
    travel = np.concatenate([reach * step, reach * (1.0 - 2.0 * step), reach * (2.0 * step - 1.0)])
    force = np.zeros(len(travel))
    for g, level, record, law in parts:
        force += abs(g) * _slow(travel * abs(g), level, record, law)
    return travel / unit, force * unit, bends / unit


def _slow(travel: FloatArray, level: FloatArray, record: Any, law: Any) -> FloatArray:
    """Force [N] of one part along a slow travel [m], by the closed form of its law for each half loop."""
    out, z, before, stiff = np.zeros(len(travel)), 0.0, travel[0], float(record.stiffness)
    for j, x in enumerate(travel):
        distance = x - before
        limit = level[0] if distance >= 0.0 else level[1]
        side = 1.0 if distance >= 0.0 else -1.0
        if stiff == 0.0:
            out[j] = side * limit if distance != 0.0 else 0.0
        else:
            remainder, relative_distance = 1.0 - stiff * z * side / limit, stiff * abs(distance) / limit
            z = (1.0 - law.slow(record, remainder, relative_distance)) * side * limit / stiff
            out[j] = stiff * z
        before = x
    return out


def _holds(numbers: Plant, k: int, unit: float) -> tuple[float, float]:
    """What resists being moved along axis k from rest, forward and backward; the direction of travel and wheels too."""
    total = np.zeros(2)
    for row in numbers.element:
        g = float(row.g[k])
        level = row.breakaway + row.bristle_breakaway
        total += abs(g) * (level if g > 0.0 else level[::-1])
    if k < 2:
        total += numbers.body.breakaway[k] + numbers.body.bristle_breakaway[k]
    return float(total[0] * unit), float(total[1] * unit)


def _ramps(
    robot: Robot, numbers: Plant, k: int, pattern: FloatArray, volts: float, bends: bool
) -> tuple[FloatArray, FloatArray]:
    """(rate, the most that dry friction resists) of forces that rise; NaN where the motors cannot break it loose."""
    unit = float(numbers.body.length)
    reach = RAMP_END * volts * float(np.abs(pattern).max())
    limit = float(np.min(robot.motor.voltage_limit))
    if not np.isfinite(reach) or reach > limit:
        return np.full(len(RAMPS), np.nan), np.full(len(RAMPS), np.nan)
    full = float(drive_wrench(robot, np.zeros(3), RAMP_END * volts * pattern)[k])
    breakaways, per_speed = [], float(numbers.element["g"][:, k] ** 2 @ numbers.element["viscous"])
    viscous = per_speed * (1.0 if k < 2 else unit**2)
    for length in RAMPS if bends else ():
        rise = (np.arange(RAMP_ROWS) + 0.5) / RAMP_ROWS
        voltage = np.outer(np.append(rise, np.ones(AFTER_ROWS)) * RAMP_END * volts, pattern)
        dt = np.repeat([length / RAMP_ROWS, AFTER / AFTER_ROWS], [RAMP_ROWS, AFTER_ROWS])
        run = simulate(robot, voltage, dt, tol=1e-5)
        assert run.twist is not None
        middle = 0.5 * (run.twist[1:] + run.twist[:-1])
        gained = np.diff(run.twist, axis=0) / dt[:, None] @ mass_matrix(robot)
        dry = (drive_wrench(robot, middle, voltage) + frame_wrench(robot, middle) - gained)[:, k] - viscous * middle[
            :, k
        ]
        breakaways.append(float(dry.max()))
    rest = float(drive_wrench(robot, np.zeros(3), volts * pattern)[k])
    return full / np.array(RAMPS), np.array(breakaways) if bends else np.full(len(RAMPS), rest)


def _law(robot: Robot, k: int) -> str:
    """The laws that act along an axis, in words."""
    friction, law_names = robot.friction, []
    for name in type(friction).model_fields:
        part = getattr(friction, name)
        turning = name == "direction" and k == 2
        level = part.yaw_coulomb if turning else (part.coulomb[k] if name == "axes" else part.coulomb)
        if not np.any(level):
            continue
        hold = part.yaw_breakaway if turning else part.breakaway
        speed = part.yaw_stribeck_speed if turning else part.stribeck_speed
        holds_more = hold is not None and np.any(
            np.asarray(hold) > np.asarray(part.yaw_coulomb if turning else part.coulomb)
        )
        falls = "Stribeck" if holds_more and speed is not None else ("breakaway" if holds_more else "")
        words = falls if part.law == COULOMB else ""
        law_names.append(f"{words or KINDS[part.law].name} ({name})")
    return " + ".join(law_names) or "viscous only"


def _notes(robot: Robot, axes: Sequence[AxisFriction]) -> list[Statement]:
    codes = ["holds_exactly"]
    kinds = [KINDS[getattr(robot.friction, name).law] for name in type(robot.friction).model_fields]
    codes += ["creeps"] if any(kind.bends and kind.drifts for kind in kinds) else []
    codes += ["bristles_damp"] if any(kind.bends for kind in kinds) else []
    codes += ["wheels_roll"] if robot.wheels.traction_mu is not None else []
    weak = [axis.axis for axis in axes if np.isnan(axis.rate).any()]
    too_weak = [Statement("motors_too_weak", NOTE, numbers={"axes": weak})] if weak else []
    return [*(Statement(code, NOTE) for code in codes), *too_weak]


def _row(axis: AxisFriction) -> tuple[str, ...]:
    middle, unit = len(axis.speed) // 2, axis.unit
    bend = "" if axis.bends == 0.0 else f"{axis.bends * 1e3:.3g} {'mrad' if unit == 'N m' else 'mm'}"
    holds = f"{axis.holds[0]:.4g}" + ("" if axis.holds[0] == axis.holds[1] else f", back {axis.holds[1]:.4g}")
    ramps = ", ".join(f"{value:.4g}" for value in axis.breakaway) if np.isfinite(axis.breakaway).all() else "-"
    return (
        axis.axis,
        axis.law,
        f"{holds} {unit}",
        f"{axis.force[middle]:.4g}",
        f"{axis.force[-1]:.4g}",
        bend,
        ramps,
    )


def _told(axis: AxisFriction) -> dict[str, Any]:
    finite = np.isfinite(axis.rate).all()
    return {
        "axis": axis.axis,
        "unit": axis.unit,
        "law": axis.law,
        "speed": axis.speed.tolist(),
        "force": axis.force.tolist(),
        "holds": list(axis.holds),
        "bends": axis.bends,
        "way": axis.travel.tolist(),
        "loop": axis.loop.tolist(),
        "rate": axis.rate.tolist() if finite else None,
        "breakaway": axis.breakaway.tolist() if finite else None,
    }
