"""Claims on the identification of friction: eqs (15)-(17) and Table 2 from the forces and speeds of Table 1."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.estimate import Estimate
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.paper.claim import ROUNDING, Claim, judge, plain, same, tiny
from omnidyn.paper.steady import settled_twist
from omnidyn.paper.tables import (
    PAPER_AXES,
    TABLE_1,
    TABLE_2_COULOMB,
    TABLE_2_VISCOUS,
    TABLE_3_UNIT_OF_B_W,
    TABLE_4,
)

LAST_DIGIT = {"viscous": (0.01, 0.01, 0.01), "coulomb": (0.1, 0.1, 0.001)}  # one unit of it, as Table 2 prints
PRINTED = {"viscous": TABLE_2_VISCOUS, "coulomb": TABLE_2_COULOMB}
LETTER = {"viscous": "B", "coulomb": "C"}
UNIT = {"viscous": ("N s/m", "N s/m", "N m s"), "coulomb": ("N", "N", "N m")}


def friction_claims(robot: Robot) -> tuple[Claim, ...]:
    """The claims of this file."""
    data = table_1_points()
    line, bound = (fit_steady_state(robot, data, rest_use=rest) for rest in ("line", "bound"))
    table_2 = [_table_2(kind, axis, line, bound) for axis in range(len(AXES)) for kind in ("viscous", "coulomb")]
    return (_steady_law(robot), *table_2, _rows_at_rest(line, bound), _unit_of_b_w(robot, line))


def table_1_points() -> SteadyTable:
    """The twelve rows of Table 1 as steady points, with their voltages."""
    rows = [(axis, row) for axis in AXES for row in TABLE_1[axis]]
    return SteadyTable(
        axis=[axis for axis, _ in rows],
        speed=np.array([row.speed for _, row in rows]),
        force=np.array([row.force for _, row in rows]),
        voltage=np.array([row.voltage for _, row in rows]),
        source="Table 1",
    )


def _steady_law(robot: Robot) -> Claim:
    """At the settled speeds of Table 4 the driving force is B v + C; a line through them gives B and C back."""
    steps = [(axis, volts) for axis in AXES for volts in TABLE_4[axis]]
    volts = np.array([step for _, step in steps])
    twist = settled_twist(robot, volts)
    column = np.array([AXES.index(axis) for axis, _ in steps])
    row = np.arange(len(steps))
    force = drive_wrench(robot, twist, volts)[row, column]
    data = SteadyTable([axis for axis, _ in steps], twist[row, column], force, source="the model under Table 4")
    axes = fit_steady_state(robot, data).robot.friction.axes
    true = robot.friction.axes
    pairs = zip((*axes.viscous, *axes.coulomb), (*true.viscous, *true.coulomb), strict=True)
    error = max(abs(ours / expected - 1.0) for ours, expected in pairs)
    return Claim(
        key="steady-law",
        place="eqs (15)-(17)",
        statement="At constant speed the force of the motors is B v + C sgn(v): a line through steady points.",
        printed="F = B v + C sgn(v)",
        ours=f"B and C come back within {tiny(error)}",
        verdict=judge(error < 1e3 * ROUNDING),
        why=f"{len(steps)} steady points of the model under Table 4 give the six friction numbers back that made them.",
        numbers=plain(speeds=twist[row, column], forces=force, relative_error=error),
    )


def _table_2(kind: str, axis: int, line: Estimate, bound: Estimate) -> Claim:
    name, letter, unit = (
        _name(kind, axis),
        f"{LETTER[kind]}_{PAPER_AXES[AXES[axis]].replace('_', '')}",
        UNIT[kind][axis],
    )
    printed, ours, (low, high) = PRINTED[kind][axis], line.value[name], line.ci95[name]
    half, off = (high - low) / 2.0, ours - printed
    moving, (moving_low, moving_high) = bound.value[name], bound.ci95[name]
    inside = "inside" if low <= printed <= high else "outside"
    digits = ", the same in the digit that is printed," if same(ours, printed, LAST_DIGIT[kind][axis]) else ","
    digits = digits if not same(ours, printed) else ","
    return Claim(
        key=f"table-2-{kind}-{AXES[axis]}",
        place="Table 2",
        statement=f"{letter} from Table 1 by least squares.",
        printed=f"{printed:g} {unit}",
        ours=f"{ours:.4g} +- {half:.2g} {unit}",
        verdict=judge(bool(same(ours, printed, LAST_DIGIT[kind][axis]))),
        why=f"All four rows give {ours:.4g}, {100.0 * off / printed:+.1f} % from the printed number{digits} "
        f"which is {inside} the 95 % interval, "
        f"{low:.3g} to {high:.3g}: {line.degrees_of_freedom[name]} degrees of freedom leave "
        f"+-{100 * half / abs(ours):.0f} %. The moving rows alone give {moving:.4g}, {moving_low:.3g} to "
        f"{moving_high:.3g}.",
        numbers=plain(
            printed=printed,
            ours=ours,
            half_interval=half,
            interval=(low, high),
            moving_rows=moving,
            moving_rows_interval=(moving_low, moving_high),
            off=off,
        ),
    )


def _rows_at_rest(line: Estimate, bound: Estimate) -> Claim:
    viscous, coulomb = ([_name(kind, axis) for axis in range(len(AXES))] for kind in ("viscous", "coulomb"))
    changes = {name: bound.value[name] / line.value[name] - 1.0 for name in (*viscous, *coulomb)}
    first = [TABLE_1[axis][0] for axis in AXES]
    resting = all(row.at_rest for row in first)
    words = "; ".join(
        f"{PAPER_AXES[AXES[k]]} {bound.value[b]:.4g} / {bound.value[c]:.4g}"
        for k, (b, c) in enumerate(zip(viscous, coulomb, strict=True))
    )
    return Claim(
        key="row-at-rest",
        place="eqs (15)-(17), Tables 1, 2",
        statement="The row at rest of each axis is a point of the sliding line.",
        printed="four rows per axis",
        ours="three rows, and a lower bound of breakaway",
        verdict=judge(not resting, bool(bound.lower_bound)),
        why=f"At rest friction only balances the drive: the row says that breakaway is at least {_forces(first)}. "
        f"Without it B / C are {words}: B changes by {_percent(changes, viscous)}, C by {_percent(changes, coulomb)}.",
        numbers=plain(
            viscous=[bound.value[name] for name in viscous],
            coulomb=[bound.value[name] for name in coulomb],
            breakaway_at_least=[row.force for row in first],
            relative_change=list(changes.values()),
        ),
    )


def _unit_of_b_w(robot: Robot, line: Estimate) -> Claim:
    """With the torque of Table 1 in N m the slope is in N m s; as a force at the wheels it would be the slope / b."""
    torque, lever = line.value[_name("viscous", 2)], float(np.mean(robot.wheels.robot_radius))
    printed = TABLE_2_VISCOUS[2]
    as_torque, as_force = (
        bool(same(torque, printed, LAST_DIGIT["viscous"][2])),
        bool(same(torque / lever, printed, LAST_DIGIT["viscous"][2])),
    )
    return Claim(
        key="unit-of-b-w",
        place="Table 3",
        statement=f"The unit of B_w is {TABLE_3_UNIT_OF_B_W}.",
        printed=TABLE_3_UNIT_OF_B_W,
        ours="N m/(rad/s)",
        verdict=judge(as_force, as_torque),
        why=f"Table 1 gives {torque:.4f} N m/(rad/s), the printed {printed:g}; as a force at the wheels it would be "
        f"{torque / lever:.3f} N/(rad/s). Eq (6) adds it to a torque.",
        numbers=plain(as_torque=torque, as_force=torque / lever, printed=printed),
    )


def _name(kind: str, axis: int) -> str:
    return f"friction.axes.{kind}[{axis}]"


def _forces(rows: list) -> str:
    units = (unit for unit in UNIT["coulomb"])
    return ", ".join(f"{row.force:g} {unit}" for row, unit in zip(rows, units, strict=True))


def _percent(changes: dict[str, float], names: list[str]) -> str:
    return ", ".join(f"{100 * changes[name]:+.0f}" for name in names) + " %"
