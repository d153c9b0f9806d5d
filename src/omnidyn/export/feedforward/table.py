"""gains: kS, kV, kA with standard errors as CSV; and how the snippets spell one."""

from __future__ import annotations

import math

from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import Row, rows
from omnidyn.export.spelling import hash_comment, number
from omnidyn.model.robot import Robot


def gains_csv(robot: Robot) -> Export:
    """kS, kV and kA of each axis and of each wheel on it. A std that nothing is known of is an empty cell."""
    refuse("gains", robot)
    missing = left_out("gains", robot)
    lines = ["place,gain,value,std,unit"]
    lines += [f"{row.place},{row.name},{number(row.value)},{_std(row)},{row.unit}" for row in rows(robot)]
    head = hash_comment([f"{robot.name}: volts of the most loaded motor, by omnidyn",
                         *(f"not in it: {words}" for words in missing)])  # fmt: skip
    return Export("gains", robot.name, {"gains.csv": head + "\n".join(lines) + "\n"}, missing)


def _std(row: Row) -> str:
    return number(row.std) if math.isfinite(row.std) else ""


def spread(row: Row) -> str:
    """How sure a gain is, in words for a comment: "+- 0.02 V", or that nothing is known."""
    return f"+- {row.std:.2g} {row.unit}" if math.isfinite(row.std) else f"{row.unit}, std not known"
