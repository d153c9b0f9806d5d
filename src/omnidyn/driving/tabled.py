"""TabledConnection: a robot whose wheels do not turn as asked, behind the table that makes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from omnidyn.driving.connection import Command, Measured, RobotConnection
from omnidyn.logs.wheel_table import WheelTable


class TabledConnection:
    """A `RobotConnection` that asks for what makes the wheels turn with the speeds of a command.

    connection: to the robot. table: of its wheels, of `wheel_table`.
    """

    def __init__(self, connection: RobotConnection, table: WheelTable) -> None:
        self._connection, self._table = connection, table

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)  # such as the clock of a simulated robot

    def open(self) -> None:
        """Connect."""
        self._connection.open()

    def send(self, command: Command) -> None:
        """A command by the table."""
        self._connection.send(command._replace(inputs=tuple(self._table.command(command.inputs).tolist())))

    def receive(self) -> Sequence[Measured]:
        """All that came since the last call."""
        return self._connection.receive()

    def stop(self) -> None:
        """Motors off."""
        self._connection.stop()

    def close(self) -> None:
        """Stop, and let go of the line."""
        self._connection.close()
