"""Robot: body, wheels, motor and friction, with what is known about each number."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from omnidyn.model.correlation import KeyCorrelation
from omnidyn.model.drive import Drive
from omnidyn.model.friction import Friction
from omnidyn.model.motor import Motor
from omnidyn.model.value import Flag, Text, Value, number
from omnidyn.model.wheels import Wheels, check_count

SCHEMA = 1


class Body(Value):
    """The rigid body: mass M [kg], inertia I_n about the vertical axis [kg m^2].

    rotating_frame: keep the terms M omega v of a turning body frame, which eqs (4) (5) leave out.
    """

    mass: Annotated[float, number(1e-4, 1e5), Field(alias="mass_kg", description="M")]
    inertia: Annotated[
        float, number(1e-9, 1e6), Field(alias="inertia_kg_m2", description="I_n, about the vertical axis")
    ]
    rotating_frame: Annotated[Flag, Field(description="terms M omega v of a turning body")] = False


Origin = Literal["guess", "given", "datasheet", "measured", "identified", "imported"]
"""Where a number comes from. given: by whoever wrote the file; imported: from another robot or another file."""

GUESS: Origin = "guess"
GIVEN: Origin = "given"
MEASURED: Origin = "measured"
IDENTIFIED: Origin = "identified"
IMPORTED: Origin = "imported"


class Prior(Value):
    """What is known about one number: its standard deviation, and where it comes from, in words and as a value."""

    std: Annotated[
        Annotated[float, number(0.0, 1e9, above=True)] | None, Field(description="standard deviation, same unit")
    ] = None
    source: Text = ""
    origin: Annotated[Origin, Field(description="where it comes from")] = GIVEN


class Robot(Value):
    """A robot: all that eqs (1)-(14) need. Frozen; `replace` makes a changed copy.

    priors: key of the robot file, such as "motor.resistance_ohm" or "friction.axes.coulomb[0]", -> Prior.
    correlation: which of these numbers are off together; numbers that a change took away have no part in it.
    """

    name: Annotated[Text, Field(min_length=1)]
    source: Text = ""
    body: Body
    wheels: Wheels
    motor: Motor
    drive: Drive = Drive()
    friction: Friction = Friction()
    correlation: Annotated[KeyCorrelation | None, Field(description="which numbers are off together")] = None
    priors: Annotated[dict[str, Prior], Field(exclude=True, default_factory=dict)]

    @model_validator(mode="after")
    def _one_value_per_wheel(self) -> Robot:
        tables = {"motor": self.motor, "drive": self.drive, "friction.wheels": self.friction.wheels}
        for table, value in tables.items():
            for name in type(value).model_fields:
                check_count(f"[{table}] {name}", getattr(value, name), self.wheels.count)
        return self
