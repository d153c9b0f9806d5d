"""What the numbers of a channel can be, and in which unit numbers beyond that make sense.

A range is wide: a false question costs more than a missing one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.columns.doubts import UNIT, Doubt, doubt, letter_of
from omnidyn.units import Unit, parse_unit

USUAL_SHARE = 0.99  # of the distinct values: some are outliers, or codes of a driver, however often they are repeated


class UsualRange(NamedTuple):
    """What is usual of a channel, in SI.

    most: what its usual size can be. likely: low and high end of what it mostly is, which tells the unit. units: those
    in which it is logged too, the likeliest first. counts: how a unit of counts is written, "" where none is logged.
    most_counts: the largest of them.
    """

    most: float
    likely: tuple[float, float]
    units: tuple[str, ...]
    counts: str = ""
    most_counts: float = 4095.0  # of the usual converters, 12 bits


MOST_VOLTS = 100.0  # [V] of a motor's driver, or of a battery; more are other units, or steps of a converter
VOLTS = UsualRange(MOST_VOLTS, (3.0, 60.0), ("mV", "cV", "dV"), "V/COUNTS_PER_VOLT")
SPEED = UsualRange(20.0, (0.05, 6.0), ("mm/s", "cm/s", "in/s"))
LENGTH = UsualRange(500.0, (0.3, 50.0), ("mm", "cm", "in"))
RANGES = {
    "supply": VOLTS,
    "i": UsualRange(200.0, (0.05, 60.0), ("mA",), "A/COUNTS_PER_AMPERE"),
    "w": UsualRange(3000.0, (1.0, 500.0), ("rpm", "deg/s"), "ticks/COUNTS_PER_TURN/s", math.inf),
    "vx": SPEED,
    "vy": SPEED,
    "x": LENGTH,
    "y": LENGTH,
}
FAR_SUPPLY = 8.0  # times the voltage limit of a robot: more is no supply of its driver


def likely_units(limits: UsualRange, largest: float) -> tuple[str, ...]:
    """The units in which numbers of this size make sense, and how one of counts is written, for counts."""
    low, high = limits.likely
    units = [unit for unit in limits.units if low <= parse_unit(unit).size * largest <= high]
    if limits.counts and (largest <= limits.most_counts or not units):
        units.append(limits.counts)
    return tuple(units) or UNIT


def beyond_range(
    component: str, unit: Unit, values: FloatArray, limit: float | None = None, is_given: bool = True
) -> Doubt | None:
    """The doubt, of no column yet, about values that a component cannot have in their unit; None where it can.

    limit: the most that a driver of the robot gives [V], where it is known. is_given: whether the file gives the unit.
    Of a position the span counts, for its origin may be anywhere; one in a unit that is given may be far away. Whether
    a unit that is given is right, a robot says better than a range (`check`), but for its supply.
    """
    letter = letter_of(component.removesuffix("_cmd"))
    limits, values = RANGES.get(letter), np.unique(values[np.isfinite(values)])
    judged = limits is LENGTH or (limit is not None and letter != "supply")
    if limits is None or not values.size or (is_given and judged):
        return None
    if limits is LENGTH:
        size = float(np.diff(np.quantile(values, [1.0 - USUAL_SHARE, USUAL_SHARE]))[0])
    else:
        size = float(np.quantile(np.abs(values), USUAL_SHARE))
    most = limits.most if limit is None or letter != "supply" else min(limits.most, FAR_SUPPLY * limit)
    if size * unit.size <= most:
        return None
    return doubt("", component, "beyond_range", likely_units(limits, size), size=size, unit=unit.text, of=letter)
