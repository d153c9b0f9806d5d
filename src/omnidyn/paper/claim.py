"""Claim: one thing the paper says, our number beside it, and a verdict.

What counts as reproduced is one rule, RULE, for every row; `same` is the part of it on numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import BoolArray

ROUNDING = 1e-12
TOLERANCE = 0.05
RULE = (
    f"The rule, the same on every row: an equation is reproduced where the model agrees with it to rounding; a number "
    f"where ours is within {100.0 * TOLERANCE:g} % of it, or the same in the digits that are printed; a robot printed "
    'at rest where it is at rest. A row of several numbers is reproduced where all of them are. "About" gives no '
    f"digits: there the {100.0 * TOLERANCE:g} % alone count."
)

Numbers = dict[str, float | list]


class ClaimVerdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced after a correction"
    NOT_REPRODUCED = "cannot be reproduced"
    NOT_IN_TEXT = "not in the text we have"
    OTHER_PAPER = "about another paper"

    @property
    def short(self) -> str:
        """The verdict in a word: yes, mended or no; absent or other where there was nothing to judge."""
        return dict(zip(ClaimVerdict, ("yes", "mended", "no", "absent", "other"), strict=True))[self]

    @property
    def judged(self) -> bool:
        """Whether there was anything to judge."""
        return self in (ClaimVerdict.REPRODUCED, ClaimVerdict.CORRECTED, ClaimVerdict.NOT_REPRODUCED)


@dataclass(frozen=True)
class Claim:
    """One thing the paper says.

    key: short name. place: where it stands in the paper. statement: what it says, in plain words.
    printed and ours: its number and our computed one, as text. verdict: what became of it. why: the reason, in numbers.
    numbers: all that stands behind, computed: name -> number or list of numbers, fit for JSON. subject: of the paper,
    under which the claim stands among others.
    """

    key: str
    place: str
    statement: str
    printed: str
    ours: str
    verdict: ClaimVerdict
    why: str
    numbers: Numbers = field(default_factory=dict)
    subject: str = ""


def same(ours: ArrayLike, printed: ArrayLike, digit: float = 0.0) -> BoolArray:
    """Whether numbers are the printed ones, by RULE. digit: one unit of the last digit that is printed.

    Shapes: any, as NumPy joins them.
    """
    ours, printed = np.asarray(ours, dtype=float), np.asarray(printed, dtype=float)
    off = np.abs(ours - printed)
    return (off <= TOLERANCE * np.abs(printed)) | (off < 0.5 * digit)


def judge(as_printed: bool, as_corrected: bool = False) -> ClaimVerdict:
    """The verdict on a claim that holds as printed, or only after a correction, or in neither form."""
    if as_printed:
        return ClaimVerdict.REPRODUCED
    return ClaimVerdict.CORRECTED if as_corrected else ClaimVerdict.NOT_REPRODUCED


def listed(values: Iterable[float], form: str = ".3g") -> str:
    """Numbers as text with commas: "0.37, 0.74, 1.08"."""
    return ", ".join(format(float(value), form) for value in values)


def tiny(error: float, unit: str = "") -> str:
    """An error as text; rounding, which differs from machine to machine, only by its limit."""
    return f"{ROUNDING:g} {unit}".strip() if error < ROUNDING else f"{error:.1e} {unit}".strip()


def plain(**values: object) -> Numbers:
    """Numbers and arrays as Python floats and lists, by name."""
    return {name: _plain(value) for name, value in values.items()}


def _plain(value: object) -> float | list:
    array = np.asarray(value, dtype=float)
    return float(array) if array.ndim == 0 else array.tolist()
