"""The kinds of law that a friction table may choose, and how their numbers get into a plant.

    coulomb   C in motion, S >= C at rest; with stribeck_speed the level falls from S to C (stribeck.py)
    karnopp   the same, at rest below a speed Dv (karnopp_speed, 1e-4 m/s): a device of solvers that cannot stick. It
              has no meaning of its own: momentum gathers while the drive exceeds S, and motion begins at Dv. Here for
              comparison with such solvers; on the body axes only. Source: Karnopp 1985
    dahl      a spring before it slips: stiffness, dahl_exponent (bristle.py)
    lugre     bristles that bend, with damping and a Stribeck level: stiffness, damping, damping_speed (bristle.py)

Which law a table has is one word; what it takes, and what goes with what, is checked here for all tables.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray

Kind = Literal["coulomb", "karnopp", "dahl", "lugre"]
COULOMB, KARNOPP, DAHL, LUGRE = "coulomb", "karnopp", "dahl", "lugre"
BENDING = (DAHL, LUGRE)
Numbers = FloatArray | tuple[float, ...] | float | None


class Spread(NamedTuple):
    """The numbers of a law in the units of a plant, one or one per row; None where it has none."""

    law: str
    stribeck_speed: Numbers
    stribeck_exponent: float
    stiffness: Numbers
    damping: Numbers
    damping_speed: Numbers
    dahl_exponent: float


def spread_on(mass: float, rows: Any, law: Spread, slide: FloatArray, hold: FloatArray) -> None:
    """Add a law to elements of a plant, in place. slide, hold: levels forward and backward, shape (rows, 2)."""
    used = np.any(hold > 0.0, axis=1)
    if law.law in BENDING:
        rows["bristle_coulomb"] += slide
        rows["bristle_breakaway"] += hold
        put(rows, used, "stiffness", law.stiffness)
        rows["dahl_exponent"][used] = law.dahl_exponent if law.law == DAHL else 1.0
        if law.law == LUGRE and used.any():
            put(rows, used, "damping", critical(mass, rows, law) if law.damping is None else law.damping)
            put(rows, used, "fade", _inverse(law.damping_speed))
    else:
        rows["coulomb"] += slide
        rows["breakaway"] += hold
    falls = used & np.any(hold > slide, axis=1)
    if law.stribeck_speed is not None and falls.any():
        put(rows, falls, "fall", _inverse(law.stribeck_speed))
        rows["exponent"][falls] = law.stribeck_exponent


def put(rows: Any, where: Any, field: str, value: Numbers) -> None:
    """One number, or one per row, into a field of some rows."""
    if value is not None:
        rows[field][where] = np.broadcast_to(value, len(rows))[where]


def critical(mass: float, rows: Any, law: Spread) -> FloatArray:
    """2 sqrt(sigma0 m) - viscous: the damping with which a bristle and the body on it do not swing."""
    seen = mass / np.maximum((rows["g"] ** 2).sum(axis=1), 1e-300)
    assert law.stiffness is not None
    return np.maximum(2.0 * np.sqrt(np.asarray(law.stiffness) * seen) - rows["viscous"], 0.0)


def _inverse(value: Numbers) -> Numbers:
    return None if value is None else 1.0 / np.asarray(value)


TAKES = {
    COULOMB: frozenset[str](), KARNOPP: frozenset({"karnopp_speed"}), DAHL: frozenset({"stiffness", "dahl_exponent"}),
    LUGRE: frozenset({"stiffness", "damping", "damping_speed"}),
}  # fmt: skip
OF_LAWS = frozenset().union(*TAKES.values())


def refuse_mixtures(table: Any) -> None:
    """Raises ValueError for numbers that the law of a table does not take, or lacks."""
    law, fields = table.law, type(table).model_fields
    for name in fields:
        plain = name.removeprefix("yaw_")
        if plain in OF_LAWS and plain not in TAKES[law] and getattr(table, name) != fields[name].default:
            wanted = " or ".join(f'"{each}"' for each in TAKES if plain in TAKES[each])
            raise ValueError(f'{name} is of law = {wanted}; this table has law = "{law}"')
    bends = law in BENDING and any(np.ravel(table.coulomb))
    if bends and table.stiffness is None:
        raise ValueError(f'law = "{law}" needs stiffness: the Coulomb level over the distance it bends before it slips')
    if law == DAHL and (table.breakaway is not None or table.stribeck_speed is not None):
        raise ValueError(
            'law = "dahl" has one level, coulomb: no breakaway and no stribeck_speed; law = "lugre" has both'
        )
    if law == LUGRE and table.breakaway is not None and table.stribeck_speed is None:
        raise ValueError('law = "lugre" with a breakaway needs stribeck_speed: how fast the level falls from it')
    if law == KARNOPP and table.stribeck_speed is not None:
        raise ValueError('law = "karnopp" slides with coulomb at once: leave stribeck_speed out, or the law')
