"""kS, kV, kA with standard errors as CSV; and how the snippets spell one."""

from __future__ import annotations

import math

from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import AXES, NAMES, GainRow, rows
from omnidyn.export.feedforward.guessed_gains import check_ticks
from omnidyn.export.spelling import hash_comment, number
from omnidyn.model.robot import Robot


def gains_csv(robot: Robot, ticks_per_turn: float | None = None) -> Export:
    """kS, kV and kA of each axis and of each wheel on it. A std that nothing is known of is an empty cell.

    ticks_per_turn: of the encoder, in a turn of the wheel; the gains of the wheels are then per tick, else per rad.
    """
    refuse("gains", robot)
    check_ticks(ticks_per_turn)
    omissions = left_out("gains", robot)
    lines = ["place,gain,value,std,unit"]
    found = [row if row.place in AXES else in_ticks(row, ticks_per_turn) for row in rows(robot)]
    lines += [f"{row.place},{row.name},{number(row.value)},{_std(row)},{row.unit}" for row in found]
    head = hash_comment(
        [f"{robot.name}: volts of the most loaded motor, by omnidyn", *(f"not in it: {words}" for words in omissions)]
    )
    return Export("gains", robot.name, {"gains.csv": head + "\n".join(lines) + "\n"}, omissions)


def in_ticks(row: GainRow, ticks_per_turn: float | None) -> GainRow:
    """A gain per rad/s of a wheel as one per tick/s; as it is where the ticks are not known, or of kS."""
    if ticks_per_turn is None or row.name == NAMES[0]:
        return row
    size = 2.0 * math.pi / ticks_per_turn
    return row._replace(value=row.value * size, std=row.std * size, unit=row.unit.replace("/rad", "/tick"))


def _std(row: GainRow) -> str:
    return number(row.std) if math.isfinite(row.std) else ""


def spread(row: GainRow) -> str:
    """How sure a gain is, in words for a comment: "+- 0.02 V", or that nothing is known."""
    return f"+- {row.std:.2g} {row.unit}" if math.isfinite(row.std) else f"{row.unit}, std not known"
