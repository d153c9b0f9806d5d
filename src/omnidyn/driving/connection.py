"""The protocol between a program and a robot: five methods, whatever carries them.

Who writes one for a robot of another kind must keep to this; `SimulatedRobot` is the example.

1. `send` and `receive` return at once, and raise OSError where the line is broken.
2. A command acts for `hold` seconds after it was sent, measured by the robot's own clock, and no longer: then the
   motors are off. `DeadMan` is that rule, for Python; the C that `omnidyn drive` writes for Arduino has it too.
3. A command whose number is not above the last one is dropped, and one of another session unless its number is 0.
   Commands of number 0 move nothing: they begin a session.
4. What is measured says the number of the last command that was taken.
5. `stop` may be called at any time and more than once; `close` stops first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from omnidyn.arrays import FloatArray


class Command(NamedTuple):
    """What the motors get.

    session: tells one drive from the next. number: 0 begins it, then 1, 2, .. sent: when, on the clock of the sender
    [s]. hold: for how long it may act after that [s]. inputs: of each wheel: volts, duties, or rad/s of a speed loop.
    """

    session: int
    number: int
    sent: float
    hold: float
    inputs: tuple[float, ...]


class Measured(NamedTuple):
    """What a robot measured at one moment.

    t: on its own clock [s]. session, number: of the last command that it took; -1 before the first. channels: by the
    names of a Run, such as wheel_speed (wheels,) [rad/s], twist (3,), pose (3,), supply (1,) [V]; SI units.
    """

    t: float
    session: int
    number: int
    channels: Mapping[str, FloatArray]


class RobotConnection(Protocol):
    """A robot that takes commands and says what it measures; the numbered list of `omnidyn.driving.connection`."""

    def open(self) -> None:
        """Connect; the motors are off. Raises InputError where there is no robot."""
        ...

    def send(self, command: Command) -> None:
        """Hand over a command."""
        ...

    def receive(self) -> Sequence[Measured]:
        """All that came since the last call, the oldest first."""
        ...

    def stop(self) -> None:
        """Motors off, as soon as the line allows."""
        ...

    def close(self) -> None:
        """Stop, and let go of the line."""
        ...
