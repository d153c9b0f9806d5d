"""TabledConnection: a robot whose wheels do not turn as asked, behind the table that makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from omnidyn.arguments import check_order
from omnidyn.driving.connection import Command, Measured, RobotConnection
from omnidyn.driving.program import DriveProgram
from omnidyn.errors import InputError
from omnidyn.logs.wheel_table import WheelTable


def check_table(program: DriveProgram, table: WheelTable) -> None:
    """Raises InputError where a table is not for the robot of a program, or asks for more than a program may."""
    robot, wheels = program.robot, len(table.lines) // 2
    if program.channel != "wheel_speed_command":
        raise InputError(
            "a table of wheels is for speeds that a firmware holds",
            got=f"a program of {program.channel} for {robot.name}",
            expected="a program of wheel_speed_command",
            remedy="leave it out",
            where="wheel_table",
        )
    if wheels != robot.wheels.count:
        raise InputError(
            "the table of another robot",
            got=f"{wheels} wheels",
            expected=f"{robot.wheels.count}, as {robot.name} has",
            remedy=f"write one from a log of {robot.name} with `wheel_table`",
            where="wheel_table",
        )
    try:
        replace(program, inputs=table.command(program.inputs))
    except InputError as error:
        raise error.at("wheel_table") from None


class TabledConnection:
    """A `RobotConnection` that asks for what makes the wheels turn with the speeds of a command.

    connection: to the robot. table: of its wheels, of `wheel_table`.
    """

    def __init__(self, connection: RobotConnection, table: WheelTable) -> None:
        check_order("TabledConnection(connection, table)", (connection, object), (table, WheelTable))
        self._connection, self._table = connection, table

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # of this class, before it is made
            raise AttributeError(name)
        return getattr(self._connection, name)  # such as the clock of a simulated robot

    def check(self, program: DriveProgram) -> None:
        """Raises InputError where the table is not for the robot of a program, or asks for more than it may."""
        check_table(program, self._table)

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
