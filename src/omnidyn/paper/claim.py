"""Claim: one thing the paper says, our number beside it, and a verdict.

What counts as reproduced:

    an equation             agrees with the model within ROUNDING
    a number of Table 2     within one unit of its last printed digit
    a speed                 within SPEED_TOLERANCE of the printed one; a robot printed at rest is at rest
    "about" so many volts   within ABOUT of the printed number
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

ROUNDING = 1e-12
SPEED_TOLERANCE = 0.05
ABOUT = 0.15

Numbers = dict[str, float | list]


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced after a correction"
    NOT_REPRODUCED = "cannot be reproduced"

    @property
    def short(self) -> str:
        """The verdict in a word: yes, mended or no."""
        return {Verdict.REPRODUCED: "yes", Verdict.CORRECTED: "mended", Verdict.NOT_REPRODUCED: "no"}[self]


@dataclass(frozen=True)
class Claim:
    """One thing the paper says.

    key: short name. place: where it stands in the paper. statement: what it says, in plain words.
    printed and ours: its number and our computed one, as text. verdict: what became of it. why: the reason, in numbers.
    numbers: all that stands behind, computed: name -> number or list of numbers, fit for JSON.
    """

    key: str
    place: str
    statement: str
    printed: str
    ours: str
    verdict: Verdict
    why: str
    numbers: Numbers = field(default_factory=dict)


def judge(as_printed: bool, as_corrected: bool = False) -> Verdict:
    """The verdict on a claim that holds as printed, or only after a correction, or in neither form."""
    if as_printed:
        return Verdict.REPRODUCED
    return Verdict.CORRECTED if as_corrected else Verdict.NOT_REPRODUCED


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
