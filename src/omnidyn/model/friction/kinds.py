"""The kinds of law that a friction table may choose, and how their numbers get into a plant.

    coulomb   C in motion, S >= C at rest; with stribeck_speed the level falls from S to C (stribeck.py)
    karnopp   the same, at rest below a speed Dv (karnopp_speed, 1e-4 m/s): a device of solvers that cannot stick. It
              has no meaning of its own: momentum gathers while the drive exceeds S, and motion begins at Dv. Here for
              comparison with such solvers; stick_slip/band.py has the law. Source: Karnopp 1985
    dahl, lugre, ...  bristles, which bend before they slip: LAWS of bristle.py

Which law a table has is one word; what it takes, and what goes with what, is checked here for all tables.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.friction import bristle
from omnidyn.model.friction.law import SPEED, LawKind, Number
from omnidyn.model.friction.stribeck import SHAPES

AXES, DIRECTION, WHEELS = "axes", "direction", "wheels"
COULOMB, KARNOPP, LUGRE = "coulomb", "karnopp", "lugre"
_STICKING = (
    LawKind(COULOMB, "Coulomb"),
    LawKind(KARNOPP, "Karnopp", takes={"karnopp_speed": Number("band", -1, units=SPEED)}, falls=False),
)
KINDS = {kind.word: kind for kind in (*_STICKING, *(law.KIND for law in bristle.LAWS))}


FALL = {
    "stribeck_speed": Number("fall", -1, True, SPEED),
    "stribeck_exponent": Number("exponent"),
    "stribeck_shape": Number("form"),
}
OF_LAWS = {key: number for kind in KINDS.values() for key, number in kind.takes.items()}
NUMBERS = FALL | OF_LAWS
"""Every number that a law takes, by its key without "yaw_"."""


def words_of(place: str) -> tuple[str, ...]:
    """The words of the laws that a table knows: "axes", "direction" or "wheels"."""
    return tuple(kind.word for kind in KINDS.values() if place in kind.places)


def spread_on(
    table: Any,
    rows: Any,
    slide: FloatArray,
    hold: FloatArray,
    mass: FloatArray | float,
    viscous: Any,
    units: FloatArray | float = 1.0,
    yaw: str = "",
) -> None:
    """Add the law of a table to records of a plant, in place: to elements, or to the ellipse.

    slide, hold: levels of each pair, shape (rows, 2), of the ellipse (2,). mass [kg]: what each moves; viscous [N s/m]:
    what resists it too. units: the length [m] by which each is yaw, else 1. yaw: how keys about yaw begin.
    """
    kind = KINDS[table.law]
    rows["bristle_coulomb" if kind.bends else "coulomb"] += slide
    rows["bristle_breakaway" if kind.bends else "breakaway"] += hold
    _take(kind, table, rows, np.any((slide if kind.bends else hold) > 0.0, axis=-1), mass, viscous, units, yaw)
    if getattr(table, f"{yaw}stribeck_speed") is not None:
        falls = np.any(hold > slide, axis=-1)
        for key, number in FALL.items():
            _put(rows, falls, number.field, _number(table, yaw, key, number, units))


def _take(
    kind: LawKind, table: Any, rows: Any, rows_in_use: Any, mass: Any, viscous: Any, units: FloatArray | float, yaw: str
) -> None:
    """The numbers of a law."""
    for key, number in kind.takes.items():
        value = _number(table, yaw, key, number, units)
        if value is None and key in kind.usual:
            value = kind.usual[key](_number(table, yaw, "stiffness", kind.takes["stiffness"], units), mass, viscous)
        _put(rows, rows_in_use, number.field, value)
    _put(rows, rows_in_use, "law", bristle.NUMBER_OF.get(kind.word))


def _number(table: Any, yaw: str, key: str, number: Number, units: FloatArray | float) -> Any:
    """A number of a table in the units of a plant; None where it has none."""
    value = getattr(table, f"{yaw}{key}", getattr(table, key, None))
    if value is None:
        return None
    if isinstance(value, str):
        return list(SHAPES).index(value)
    if number.power:
        value = np.asarray(value) / units**number.power
    return 1.0 / value if number.inverse else value


def _put(rows: Any, mask: Any, field: str, value: Any) -> None:
    """One number, or one per row, into a field of some rows."""
    if value is not None:
        rows[field] = np.where(mask, value, rows[field])


def refuse_mixtures(table: Any, yaw: str = "") -> None:
    """Raises ValueError for numbers that the law of a table does not take, or lacks. yaw: how keys about yaw begin."""
    kind, fields = KINDS[table.law], type(table).model_fields
    law, coulomb, breakaway = f'law = "{kind.word}"', f"{yaw}coulomb", f"{yaw}breakaway"
    speed, stiffness = f"{yaw}stribeck_speed", f"{yaw}stiffness"
    for name in () if yaw else fields:
        plain = name.removeprefix("yaw_")
        if plain in OF_LAWS and plain not in kind.takes and getattr(table, name) != fields[name].default:
            takers = " or ".join(f'"{kind.word}"' for kind in KINDS.values() if plain in kind.takes)
            raise ValueError(f"{name} is of law = {takers}; this table has {law}")
    if kind.bends and np.any(getattr(table, coulomb)) and getattr(table, stiffness) is None:
        words = "the Coulomb level over the distance it bends before it slips"
        raise ValueError(f"{law} needs {stiffness} beside {coulomb}: {words}")
    holds, falls = getattr(table, breakaway) is not None, getattr(table, speed) is not None
    if kind.bends and not kind.falls and (holds or falls):
        alternative = " or ".join(f'law = "{kind.word}"' for kind in KINDS.values() if kind.bends and kind.falls)
        raise ValueError(f"{law} has one level, {coulomb}: no {breakaway} and no {speed}; {alternative} has both")
    if kind.bends and holds and not falls:
        raise ValueError(f"{law} with a {breakaway} needs {speed}: how fast the level falls from it")
    if not kind.falls and falls:
        raise ValueError(f"{law} slides with {coulomb} at once: leave {speed} out, or the law")
