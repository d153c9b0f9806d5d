"""Robot: body, wheels, motor and friction, with what is known about each number."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from omnidyn.document import Document
from omnidyn.errors import printable
from omnidyn.model.correlation import KeyCorrelation
from omnidyn.model.drive import Drive
from omnidyn.model.friction import Friction
from omnidyn.model.log_effects import LogEffects, Sensors, sensors_of
from omnidyn.model.motor import Motor, mass_at_rim
from omnidyn.model.surroundings import Floor
from omnidyn.model.value import Flag, Text, Value, number, place
from omnidyn.model.variations import FARTHEST_LOAD, Variations
from omnidyn.model.wheels import Wheels, check_count
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import Statement

if TYPE_CHECKING:
    from matplotlib.figure import Figure


from omnidyn.model.robot_table import robot_table

SCHEMA = 1
MOST_OFF = 1000.0  # times the radius of gyration: beyond, a push has no turning that digits could tell
MOST_SPINNING = 1000.0  # times the body, at the rim: more is a unit that was mistaken


class Body(Value):
    """The rigid body: mass M [kg], inertia I_n about the vertical axis [kg m^2].

    Of all there is, wheels and motors included, as if no wheel turned about its axle: what their spin adds is the
    motor's rotor_inertia and the wheels' wheel_inertia. The axis is that through the centre of mass, as in URDF.
    centre: of mass, from that of the wheels, along x and y [m]; twist and pose are of the centre of the wheels.
    rotating_frame: keep the terms M omega v of a turning body frame, which eqs (4) (5) leave out.
    centre_height: of the centre of mass above the floor [m]; it shifts the loads of wheels that may slip.
    """

    mass: Annotated[float, number(1e-4, 1e5), Field(alias="mass_kg", description="M")]
    inertia: Annotated[
        float, number(1e-9, 1e6), Field(alias="inertia_kg_m2", description="I_n, about the vertical axis")
    ]
    centre: Annotated[
        Annotated[tuple[float, float], place(FARTHEST_LOAD)],
        Field(alias="centre_m", description="of mass, from that of the wheels"),
    ] = (0.0, 0.0)
    rotating_frame: Annotated[Flag, Field(description="terms M omega v of a turning body")] = False
    centre_height: Annotated[
        Annotated[float, number(0.0, 100.0)],
        Field(alias="centre_height_m", description="of the centre of mass, for wheels that slip"),
    ] = 0.0


Origin = Literal["guess", "joint", "given", "datasheet", "measured", "identified", "imported"]
"""Where a number comes from. given: by whoever wrote the file; imported: from another robot or another file; joint: a
guess that a fit has changed together with others, right as the sum or product that answers take."""

GUESS: Origin = "guess"
JOINT: Origin = "joint"
GUESSES = (GUESS, JOINT)
GIVEN: Origin = "given"
MEASURED: Origin = "measured"
IDENTIFIED: Origin = "identified"
IMPORTED: Origin = "imported"


WITH_THE_FIT = "goes with a fit"  # how the source of a joint number begins


class Prior(Value):
    """What is known about one number: its standard deviation, and where it comes from, in words and as a value."""

    std: Annotated[
        Annotated[float, number(0.0, 1e9, above=True)] | None, Field(description="standard deviation, same unit")
    ] = None
    source: Text = ""
    origin: Annotated[Origin, Field(description="where it comes from")] = GIVEN

    @property
    def guessed(self) -> bool:
        """Whether an answer that takes this number rests on a guess."""
        return self.origin == GUESS


class Robot(Displayable, Value):
    """A robot: all that eqs (1)-(14) need. Frozen; `replace` makes a changed copy.

    priors: key of the robot file, such as "motor.resistance_ohm" or "friction.axes.coulomb[0]", -> Prior.
    correlation: which of these numbers are off together; numbers that a change took away have no part in it.
    log: what the logs of the fit that wrote the robot did beside it, and which logs these are.
    """

    name: Annotated[Text, AfterValidator(printable), Field(min_length=1, max_length=400)]
    source: Text = ""
    body: Body
    wheels: Wheels
    motor: Motor
    drive: Drive = Drive()
    friction: Friction = Friction()
    floor: Floor = Floor()
    sensors: Annotated[Sensors | None, Field(description="what speeds and poses are to a controller")] = None
    variations: Annotated[Variations, Field(description="what it can be varied by, by name")] = Variations()
    correlation: Annotated[KeyCorrelation | None, Field(description="which numbers are off together")] = None
    log: Annotated[LogEffects | None, Field(description="what the logs of its fit did beside the robot")] = None
    priors: Annotated[dict[str, Prior], Field(exclude=True, default_factory=dict)]

    @model_validator(mode="after")
    def _one_value_per_wheel(self) -> Robot:
        tables = {"motor": self.motor, "drive": self.drive, "friction.wheels": self.friction.wheels}
        for table, value in tables.items():
            for name in type(value).model_fields.keys() - {"voltage_map"}:
                check_count(f"[{table}] {name}", getattr(value, name), self.wheels.count)
        return self

    @model_validator(mode="after")
    def _spins_no_more_than_it_can(self) -> Robot:
        spinning = float(mass_at_rim(self.motor, self.wheels).max())
        if spinning > MOST_SPINNING * self.body.mass:
            raise ValueError(
                f"[motor] rotor_inertia_kg_m2 and [wheels] inertia_kg_m2 weigh {spinning:.3g} kg at the rim of a "
                f"wheel; expected at most {MOST_SPINNING:g} times the mass of the robot. Data sheets give a rotor in "
                "g cm2: 1 g cm2 = 1e-7 kg m2"
            )
        return self

    @model_validator(mode="after")
    def _stands_on_its_wheels(self) -> Robot:
        off, widest = math.hypot(*self.body.centre), max(np.atleast_1d(self.wheels.robot_radius).tolist())
        if off > widest:
            raise ValueError(
                f"[body] centre_m lies {off:.3g} m from the centre of the wheels, beyond all of them ({widest:.3g} m): "
                "the robot would tip over. centre_m is in metres"
            )
        if off**2 * self.body.mass > MOST_OFF**2 * self.body.inertia:
            raise ValueError(
                f"[body] centre_m lies {off:.3g} m off, inertia_kg_m2 stands for masses "
                f"{math.sqrt(self.body.inertia / self.body.mass):.3g} m about that; expected at most {MOST_OFF:g} "
                "times as far. inertia_kg_m2 is about the centre of mass, in kg m2"
            )
        return self

    @property
    def sensor_model(self) -> Sensors:
        """What its speeds and poses are to a controller: as its file says, else as the fit found of its logs."""
        return sensors_of(self.sensors, self.log, self.drive.latency)

    @property
    def pose_lag_of_log(self) -> tuple[Statement, ...]:
        """What to know where controllers take poses for as late as in the logs of a fit: no table [sensors] says it."""
        sensors = self.sensor_model
        if self.sensors is not None or sensors.pose_delay <= 0.0:
            return ()
        return (Statement("pose_lag_of_log", subject=self.name, numbers=sensors.model_dump()),)

    @property
    def rigid(self) -> Robot:
        """The robot with friction that neither bends nor has a band: what holds it, and what it slides with."""
        rigid = self.friction.rigid
        return self if rigid is self.friction else self.model_copy(update={"friction": rigid})

    def __repr__(self) -> str:
        return f"<Robot {self.name}: {self.wheels.count} wheels, {self.body.mass:.6g} kg>"

    __str__ = Displayable.__str__  # pydantic's own would come first in a subclass

    def document(self) -> Document:
        """Its numbers, and where each comes from."""
        table = robot_table(self, self.priors)
        keys = ("key", "value", "std", "origin")
        numbers = [dict(zip(keys, row, strict=False)) for row in table.rows]
        head = [f"{self.name}: {self.wheels.count} wheels", *([self.source] if self.source else []), ""]
        variation_names = self.variations.names
        variation_lines = [f"can be varied by {kind}: {', '.join(names)}" for kind, names in variation_names.items()]
        data = {"name": self.name, "source": self.source, "numbers": numbers}
        data |= (
            {"variations": {kind: list(names) for kind, names in variation_names.items()}} if variation_names else {}
        )
        return Document([*head, table, *(["", *variation_lines] if variation_lines else [])], data)

    def plot(self, what: Literal["layout", "dead zone", "friction"] = "layout") -> Figure:
        """A picture of it, as a matplotlib Figure.

        layout: from above, to scale. dead zone: what sets it in motion, over the direction of travel. friction: the
        force of friction over speed, along x, along y and about yaw.
        """
        return make(FIGURE, self, what=what)
