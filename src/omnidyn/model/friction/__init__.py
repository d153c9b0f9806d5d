"""Friction between robot and floor: a contract (law.py) and one file per place where it acts. The parts add up.

Where it acts: axes, direction, wheels. How it falls with the speed: stribeck, and a file per shape (exponential,
lorentzian). What bends: bristle, and a file per law (dahl, lugre, elastoplastic); newton solves for it. kinds: what a
table may choose.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from omnidyn.model.friction.axes import AxesFriction
from omnidyn.model.friction.direction import DirectionFriction
from omnidyn.model.friction.kinds import COULOMB, KARNOPP, KINDS
from omnidyn.model.friction.law import FrictionLaw
from omnidyn.model.friction.wheels import WheelFriction
from omnidyn.model.value import Value

__all__ = ["AxesFriction", "DirectionFriction", "Friction", "FrictionLaw", "WheelFriction"]

NO_FRICTION = (0.0, 0.0, 0.0)


class Friction(Value):
    """All friction of a robot, by where it acts; what is absent is off. A field is all that a new place needs here."""

    axes: Annotated[AxesFriction, Field(description="on the body axes, eqs (4)-(6)")] = AxesFriction(
        viscous=NO_FRICTION, coulomb=NO_FRICTION
    )
    direction: Annotated[DirectionFriction, Field(description="along the direction of travel")] = DirectionFriction()
    wheels: Annotated[WheelFriction, Field(description="at the wheels")] = WheelFriction()

    @property
    def laws(self) -> tuple[FrictionLaw, ...]:
        """The parts, which add up: axes first."""
        return tuple(getattr(self, name) for name in type(self).model_fields)

    @property
    def only_axes(self) -> bool:
        """Whether all friction is the paper's: on the body axes, the same both ways, with levels that never fall."""
        return not self.beyond_axes and self.axes.is_plain

    @property
    def beyond_axes(self) -> bool:
        """Whether there is friction along the direction of travel or at the wheels."""
        return self.laws[1:] != _OFF.laws[1:]

    @property
    def only_direction(self) -> bool:
        """Whether all that can hold the robot follows the direction of travel."""
        return not any((*self.axes.levels[2], *self.axes.hold_backward)) and self.wheels == WheelFriction()

    @property
    def rigid(self) -> Friction:
        """The same levels without bristles or Karnopp's band: what these laws are where they are stiff or narrow."""
        bends = {name: law for name in type(self).model_fields if (law := getattr(self, name)).law != "coulomb"}
        if not bends:
            return self
        return self.model_copy(update={n: law.model_copy(update={"law": "coulomb"}) for n, law in bends.items()})

    @model_validator(mode="after")
    def _one_law_about_yaw(self) -> Friction:
        axes, direction = self.axes, self.direction
        both_act = axes.coulomb[2] > 0.0 and direction.yaw_coulomb > 0.0
        falls = axes.stribeck_speed is not None or direction.yaw_stribeck_speed is not None
        if both_act and (falls or axes.law != "coulomb" or direction.law != "coulomb"):
            raise ValueError(
                "friction about yaw stands in [friction.axes] and in [friction.direction], and one of them has another "
                "law than coulomb: put all of it into one table"
            )
        laws = {table: getattr(self, table).law for table in type(self).model_fields}
        bends = [table for table, law in laws.items() if KINDS[law].bends]
        if KARNOPP in laws.values() and bends:
            raise ValueError(
                f'law = "{KARNOPP}" rests in its band, and the bristles of [friction.{bends[0]}] never rest: it stands '
                f'in for a law that sticks. Take law = "{COULOMB}" beside bristles'
            )
        return self


_OFF = Friction()
