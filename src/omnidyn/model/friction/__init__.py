"""Friction between robot and floor: a contract (law.py) and one file per place where it acts. The parts add up."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from omnidyn.model.friction.axes import AxesFriction
from omnidyn.model.friction.direction import DirectionFriction
from omnidyn.model.friction.law import FrictionLaw
from omnidyn.model.friction.wheels import WheelFriction
from omnidyn.model.value import Value

__all__ = ["AxesFriction", "DirectionFriction", "Friction", "FrictionLaw", "WheelFriction"]

NONE = (0.0, 0.0, 0.0)


class Friction(Value):
    """All friction of a robot, by where it acts; what is absent is off. A field is all that a new law needs here."""

    axes: Annotated[AxesFriction, Field(description="on the body axes, eqs (4)-(6)")] = AxesFriction(
        viscous=NONE, coulomb=NONE
    )
    direction: Annotated[DirectionFriction, Field(description="along the direction of travel")] = DirectionFriction()
    wheels: Annotated[WheelFriction, Field(description="at the wheels")] = WheelFriction()

    @property
    def laws(self) -> tuple[FrictionLaw, ...]:
        """The parts, which add up: axes first."""
        return tuple(getattr(self, name) for name in type(self).model_fields)

    @property
    def only_axes(self) -> bool:
        """Whether all friction acts on the body axes, as in the paper."""
        return all(law == type(law)() for law in self.laws[1:])
