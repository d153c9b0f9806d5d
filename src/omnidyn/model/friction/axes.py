"""Friction on the body axes, eqs (4)-(6): the paper's box, with breakaway, and any law of kinds.py.

sliding:  F = -(B v + C sgn v)      per axis; C may differ forward and backward
at rest:  F = -applied while -S_backward <= applied <= S,  S >= C the breakaway level
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.friction.kinds import AXES, refuse_mixtures, spread_on, words_of
from omnidyn.model.friction.stribeck import LARGEST_EXPONENT, LEAST_EXPONENT, SHAPES, USUAL_EXPONENT
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.model.value import Levels, Value, number, per_axis_number, word_of

Level = Annotated[Levels, per_axis_number(0.0, 1e6)]
Speeds = Annotated[Levels, per_axis_number(1e-7, 1e3)]
Stiffness = Annotated[Levels, per_axis_number(1e-3, 1e12)]


class AxesFriction(Value):
    """Friction along x [N], along y [N] and about yaw [N m], each axis for itself.

    viscous: B [N s/m, N s/m, N m s]. coulomb: C [N, N, N m], of motion forward (to the left, counter-clockwise), and
    backward too unless coulomb_backward says otherwise. breakaway, breakaway_backward: S >= C, None means S = C. law
    and the numbers that it takes: kinds.py.
    """

    viscous: Annotated[Level, Field(description="B [N s/m, N s/m, N m s]")]
    coulomb: Annotated[Level, Field(description="C [N, N, N m]")]
    breakaway: Annotated[Level | None, Field(description="S >= C [N, N, N m]")] = None
    coulomb_backward: Annotated[Level | None, Field(description="C backward [N, N, N m]")] = None
    breakaway_backward: Annotated[Level | None, Field(description="S backward [N, N, N m]")] = None
    law: Annotated[Annotated[str, word_of(*words_of(AXES))], Field(description="what kind of law")] = "coulomb"
    stribeck_speed: Annotated[Speeds | None, Field(description="v_s [m/s, m/s, rad/s]")] = None
    stribeck_exponent: Annotated[Annotated[float, number(LEAST_EXPONENT, LARGEST_EXPONENT)], Field(description="d")] = (
        USUAL_EXPONENT
    )
    stribeck_shape: Annotated[Annotated[str, word_of(*SHAPES)], Field(description="f of the fall")] = "exponential"
    karnopp_speed: Annotated[Speeds, Field(description="Dv [m/s, m/s, rad/s]")] = (1e-4, 1e-4, 1e-4)
    stiffness: Annotated[Stiffness | None, Field(description="sigma0 [N/m, N/m, N m/rad]")] = None
    damping: Annotated[Level | None, Field(description="sigma1 [N s/m, N s/m, N m s]")] = None
    damping_speed: Annotated[Speeds | None, Field(description="v_d [m/s, m/s, rad/s]")] = None
    dahl_exponent: Annotated[Annotated[float, number(0.5, 4.0)], Field(description="a")] = 1.0
    elastic_share: Annotated[Annotated[float, number(0.0, 0.99)], Field(description="b")] = 0.7

    @model_validator(mode="after")
    def _levels_in_order(self) -> AxesFriction:
        if self.breakaway is not None and any(s < c for s, c in zip(self.breakaway, self.coulomb, strict=True)):
            raise ValueError(f"breakaway {list(self.breakaway)} is below coulomb {list(self.coulomb)}")
        if any(s < c for s, c in zip(self.hold_backward, self.backward, strict=True)):
            raise ValueError(f"breakaway_backward {list(self.hold_backward)} is below coulomb {list(self.backward)}")
        refuse_mixtures(self)
        return self

    @property
    def backward(self) -> Levels:
        """Coulomb level of motion backward."""
        return self.coulomb if self.coulomb_backward is None else self.coulomb_backward

    @property
    def hold_backward(self) -> Levels:
        """Level up to which an axis at rest resists being moved backward."""
        if self.breakaway_backward is not None:
            return self.breakaway_backward
        return self.backward if self.breakaway is None or self.coulomb_backward is not None else self.breakaway

    @property
    def is_plain(self) -> bool:
        """Whether it is the paper's: Coulomb, breakaway and viscous, the same both ways, falling with no speed."""
        if self.law != "coulomb" or self.hold_backward != (self.breakaway or self.coulomb):
            return False
        falls = self.stribeck_speed is not None and self.breakaway not in (None, self.coulomb)
        return self.backward == self.coulomb and not falls

    @property
    def levels(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(viscous, coulomb, breakaway) forward. Shape (3,) each; breakaway = coulomb where none is given."""
        coulomb = np.array(self.coulomb)
        return np.array(self.viscous), coulomb, coulomb if self.breakaway is None else np.array(self.breakaway)

    def add_to(self, plant: Plant, length: float) -> None:
        """Add the levels of the three axes; see FrictionLaw."""
        viscous, coulomb, breakaway = self.levels
        units = np.array([1.0, 1.0, length])
        rows = plant.element[:N_AXES]
        rows["viscous"] += viscous / units**2
        slide, hold = np.stack([coulomb, self.backward], 1), np.stack([breakaway, self.hold_backward], 1)
        slide, hold = slide / units[:, None], hold / units[:, None]
        spread_on(self, rows, slide, hold, float(plant.body.mass), rows["viscous"], units)

    def sliding_wrench(self, twist: ArrayLike) -> FloatArray:
        """-(B v + C sgn v) of the axes that move; 0 for an axis at rest. Shape (*batch, 3)."""
        viscous, coulomb, _ = self.levels
        twist = np.asarray(twist, dtype=float)
        return -(viscous * twist + coulomb * np.sign(twist))

    def wrench(self, twist: ArrayLike, applied: ArrayLike) -> FloatArray:
        """Friction under an applied wrench: slides, holds, or gives way to C against the drive; where it is plain."""
        _, coulomb, _ = self.levels
        twist, applied = np.asarray(twist, dtype=float), np.asarray(applied, dtype=float)
        at_rest = np.where(self.holds(applied), -applied, -coulomb * np.sign(applied))
        return np.where(twist == 0.0, at_rest, self.sliding_wrench(twist))

    def holds(self, applied: ArrayLike) -> BoolArray:
        """|applied| <= S, per axis; where it is plain. Shape (*batch, 3)."""
        return np.abs(np.asarray(applied, dtype=float)) <= self.levels[2]
