"""Variations of a robot: loads, floors, slopes and batteries that its file knows by name, and how they change it.

[variations.payload.2kg]                  mass_kg = 2.0, inertia_kg_m2 = 0.01
    [variations.floor.carpet.friction.axes]   viscous = .., coulomb = ..
    [variations.tilt.ramp]                    tilt_deg = 2.0, downhill_deg = 90.0
    [variations.battery.low]                  supply_V = 10.5

varied/vary.py makes the robot that carries, stands on and is fed by them.
"""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import Field, model_validator

from omnidyn.model.friction import Friction
from omnidyn.model.surroundings import Floor
from omnidyn.model.value import PerWheel, Value, number, per_wheel_number, place

_NAME = re.compile(r"[\w-]{1,60}", re.ASCII)
FARTHEST_LOAD = 100.0  # [m]


class Payload(Value):
    """What a robot carries, fixed to it. mass [kg]; inertia [kg m^2] about the vertical axis through its own centre;
    offset [m]: of its centre from that of the wheels, along x and y."""

    mass: Annotated[Annotated[float, number(0.0, 1e5)], Field(alias="mass_kg")]
    inertia: Annotated[
        Annotated[float, number(0.0, 1e6)], Field(alias="inertia_kg_m2", description="about its own vertical axis")
    ] = 0.0
    offset: Annotated[
        Annotated[tuple[float, float], place(FARTHEST_LOAD)],
        Field(alias="offset_m", description="of its centre, x and y"),
    ] = (0.0, 0.0)


class Surface(Value):
    """A floor by the friction that a robot has on it. [friction.axes] and [friction.direction] are both replaced, by
    nothing where they are absent; [friction.wheels] is the robot's own unless it is given. traction_mu: of its
    wheels there."""

    friction: Friction
    traction_mu: Annotated[
        Annotated[PerWheel, per_wheel_number(1e-3, 100.0)] | None, Field(description="of [wheels], on this floor")
    ] = None

    @model_validator(mode="after")
    def _says_something(self) -> Surface:
        if not self.friction.model_fields_set:
            raise ValueError("a floor without friction: give its [friction.axes] or [friction.direction]")
        return self


class Battery(Value):
    """supply [V]: duties are shares of it, and no motor gets more."""

    supply: Annotated[Annotated[float, number(1e-3, 1e5)], Field(alias="supply_V")]


class Variations(Value):
    """What a robot file knows by name: kind -> name -> what it is."""

    payload: dict[str, Payload] = Field(default_factory=dict)
    floor: dict[str, Surface] = Field(default_factory=dict)
    tilt: dict[str, Floor] = Field(default_factory=dict)
    battery: dict[str, Battery] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _names_can_be_asked_for(self) -> Variations:
        for kind in KINDS:
            strange = [name for name in getattr(self, kind) if not _NAME.fullmatch(name)]
            if strange:
                raise ValueError(
                    f"[variations.{kind}] {strange[0]!r} is not a name that can be asked for; expected letters, "
                    "digits, - and _"
                )
        return self

    @property
    def names(self) -> dict[str, tuple[str, ...]]:
        """The names of each kind that there are."""
        return {kind: tuple(table) for kind in KINDS if (table := getattr(self, kind))}


KINDS = ("payload", "floor", "tilt", "battery")
