"""Friction between robot and floor: a contract (law.py) and one file per family. The parts add up."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from omnidyn.model.friction.axes import AxesFriction
from omnidyn.model.friction.law import FrictionLaw
from omnidyn.model.value import Value

__all__ = ["AxesFriction", "Friction", "FrictionLaw"]


class Friction(Value):
    """All friction of a robot, by where it acts."""

    axes: Annotated[AxesFriction, Field(description="on the body axes, eqs (4)-(6)")]
