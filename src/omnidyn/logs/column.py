"""Column: which column of a file is one component of a log, in which unit."""

from __future__ import annotations

from dataclasses import dataclass

from omnidyn.errors import InputError
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.units import ANGLE, LENGTH, SPEED, known_unit, parse_unit

WHEEL_SIDE, MOTOR_SIDE = "wheel", "motor"
MAX_LATENCY = 10.0  # [s]
ROOM = "room"  # a frame


@dataclass(frozen=True)
class Column:
    """One column as a component.

    name: of the column in the file. unit: as units.py writes it. side: "motor" for a speed or an angle before the
    gear, "wheel" behind it; a speed in m/s and a way in m are of the rim. invert: the column has the opposite sign.
    latency: how late it was recorded [s]; a value of row time t happened at t - latency. frame: of a velocity or a
    heading: "" that of the robot, "room", or the angle at which its sensor is mounted, such as "30 deg".
    Raises InputError for an unknown unit, side or frame, or a latency beyond 10 s.
    """

    name: str
    unit: str
    side: str = WHEEL_SIDE
    invert: bool = False
    latency: float = 0.0
    frame: str = ""

    def __post_init__(self) -> None:
        parse_unit(self.unit)
        if self.side not in (WHEEL_SIDE, MOTOR_SIDE):
            raise InputError("unknown side of the gear", got=self.side, expected="wheel or motor")
        if not abs(self.latency) <= MAX_LATENCY:
            raise InputError("not a latency", got=self.latency, expected=f"seconds, at most {MAX_LATENCY:g}")
        _ = self.mounted_at

    @property
    def mounted_at(self) -> float:
        """The angle at which its sensor is mounted on the robot, counter-clockwise from forward [rad]."""
        if self.frame in ("", ROOM):
            return 0.0
        unit = known_unit(self.frame.lstrip("+-"))
        if unit is None or unit.quantity != ANGLE:
            raise InputError("not a frame", got=self.frame, expected="room, or an angle such as 30deg")
        return -unit.size if self.frame.startswith("-") else unit.size

    @property
    def factor(self) -> float:
        """SI value = factor * cell, neither gear nor radius of the wheel in it: `divisor` has these."""
        return parse_unit(self.unit).size * (-1.0 if self.invert else 1.0)

    @property
    def at_motor(self) -> bool:
        """Whether what it says of a wheel is about the shaft of its motor, before the gear."""
        return self.side == MOTOR_SIDE

    @property
    def of_rim(self) -> bool:
        """Whether what it says of a wheel is about its rim: a speed in m/s, a way in m."""
        return parse_unit(self.unit).quantity in (SPEED, LENGTH)

    def divisor(self, robot: Robot, wheel: int) -> float:
        """What a number of a wheel, counted from 0, is divided by to be that of the wheel in rad/s or rad.

        The gear ratio before the gear, the radius [m] at the rim, else 1.
        """
        if self.at_motor:
            return float(per_wheel(robot.motor.gear_ratio, robot.wheels.count)[wheel])
        return float(per_wheel(robot.wheels.wheel_radius, robot.wheels.count)[wheel]) if self.of_rim else 1.0

    def __str__(self) -> str:
        side = f" at the {self.side}" if self.at_motor else ""
        late = f", {self.latency:g} s late" if self.latency else ""
        frame = (
            f", in the frame {self.frame}" if self.frame == ROOM else f", mounted at {self.frame}" * bool(self.frame)
        )
        return f"{'-' if self.invert else ''}{self.name} [{self.unit}{side}{late}{frame}]"
