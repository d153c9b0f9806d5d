"""Coulomb and viscous friction on the body axes, eqs (4)-(6): the paper's box, with breakaway.

sliding:  F = -(B v + C sgn v)      per axis
at rest:  F = -applied while |applied| <= S,  S >= C the breakaway level
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.layout import HOLD, N_AXES, SLIDE, VISCOUS
from omnidyn.model.value import Levels, Value, per_axis_number


class AxesFriction(Value):
    """Friction along x [N], along y [N] and about yaw [N m], each axis for itself.

    viscous: B [N s/m, N s/m, N m s]. coulomb: C [N, N, N m]. breakaway: S >= C, None means S = C.
    """

    viscous: Annotated[Levels, per_axis_number(0.0, 1e6), Field(description="B [N s/m, N s/m, N m s]")]
    coulomb: Annotated[Levels, per_axis_number(0.0, 1e6), Field(description="C [N, N, N m]")]
    breakaway: Annotated[
        Annotated[Levels, per_axis_number(0.0, 1e6)] | None, Field(description="S >= C [N, N, N m]")
    ] = None

    @model_validator(mode="after")
    def _breakaway_at_least_coulomb(self) -> AxesFriction:
        if self.breakaway is not None and any(s < c for s, c in zip(self.breakaway, self.coulomb, strict=True)):
            raise ValueError(f"breakaway {list(self.breakaway)} is below coulomb {list(self.coulomb)}")
        return self

    @property
    def levels(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(viscous, coulomb, breakaway) as arrays. Shape (3,) each; breakaway = coulomb where none is given."""
        coulomb = np.array(self.coulomb)
        return np.array(self.viscous), coulomb, coulomb if self.breakaway is None else np.array(self.breakaway)

    def add_to(self, body: FloatArray, element: FloatArray, length: float) -> None:
        """Add the levels of the three axes; see FrictionLaw."""
        viscous, coulomb, breakaway = self.levels
        units = np.array([1.0, 1.0, length])
        element[:N_AXES, VISCOUS] += viscous / units**2
        for side in range(2):
            element[:N_AXES, SLIDE + side] += coulomb / units
            element[:N_AXES, HOLD + side] += breakaway / units

    def sliding_wrench(self, twist: ArrayLike) -> FloatArray:
        """-(B v + C sgn v) of the axes that move; 0 for an axis at rest. Shape (*batch, 3)."""
        viscous, coulomb, _ = self.levels
        twist = np.asarray(twist, dtype=float)
        return -(viscous * twist + coulomb * np.sign(twist))

    def wrench(self, twist: ArrayLike, applied: ArrayLike) -> FloatArray:
        """Friction under an applied wrench: slides, holds, or gives way to C against what drives it."""
        _, coulomb, _ = self.levels
        twist, applied = np.asarray(twist, dtype=float), np.asarray(applied, dtype=float)
        at_rest = np.where(self.holds(applied), -applied, -coulomb * np.sign(applied))
        return np.where(twist == 0.0, at_rest, self.sliding_wrench(twist))

    def holds(self, applied: ArrayLike) -> BoolArray:
        """|applied| <= S, per axis. Shape (*batch, 3)."""
        return np.abs(np.asarray(applied, dtype=float)) <= self.levels[2]
