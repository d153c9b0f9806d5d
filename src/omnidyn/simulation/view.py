"""View: how commands reach the motors, and how a log shows what the robot does. From both a simulation is seen.

    u = left gain (|u| - dead)+ sgn u

A robot has a dead band and a latency of its own; a log may add a gain, a fade, a push, channels that are late, and a
tilt: a force that stays in the room.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.actuation import Driver, at_motors, mapped
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot import Robot
from omnidyn.sensors import OUTPUTS
from omnidyn.simulation.commands import Commands
from omnidyn.simulation.delays import StepGrid, clock

DIGITS = 12  # of a second: latenesses that differ by less are one


@dataclass(frozen=True, eq=False)
class View:
    """clock: None, where nothing is late. late: channel -> which of the latenesses of the clock it has.

    driver, share (rows,): what becomes of voltages. held: whether the first command acted before it was given, as in a
    log that begins in motion; else nothing did. room: a constant force there [N]; push: a constant wrench on the body
    [N, N, N m].
    """

    clock: StepGrid | None = None
    late: Mapping[str, int] = field(default_factory=dict)
    driver: Driver = Driver()  # noqa: RUF009
    share: FloatArray | None = None
    push: tuple[float, float, float] | None = None
    held: bool = False
    room: tuple[float, float] | None = None

    def acting(self, robot: Robot, held_commands: Commands) -> Commands:
        """The commands as they reach the motors, or the speed loop, over each step of the simulation.

        The dead band behind a speed loop is the loop's own affair.
        """
        voltage = None if held_commands.voltage is None else mapped(robot, held_commands.voltage)
        if voltage is not None and self.driver != Driver():
            share = np.zeros(len(held_commands.dt)) if self.share is None else self.share
            voltage = at_motors(np.ascontiguousarray(voltage), np.ascontiguousarray(share), self.driver)[0]
        if self.clock is not None:
            held_commands = held_commands._replace(
                dt=self.clock.dt,
                set_point=self._stepped(held_commands.set_point),
                open_circuit=self._open(held_commands),
            )
            voltage = self._stepped(voltage)
        return held_commands if voltage is held_commands.voltage else held_commands._replace(voltage=voltage)

    def of(self, channel: str, samples: FloatArray) -> FloatArray:
        """What a channel shows at the rows, of all samples of the simulation. Shape (rows + 1, columns)."""
        return samples if self.clock is None else samples[self.clock.at[self.late.get(channel, 0)]]

    def _stepped(self, rows: FloatArray | None) -> FloatArray | None:
        """Commands of rows, over each step; what acted before the first is itself, or nothing."""
        if rows is None or self.clock is None:
            return rows
        stepped = rows[np.maximum(self.clock.row, 0)]
        if not self.held:
            stepped[self.clock.row < 0] = 0.0
        return stepped

    def _open(self, held_commands: Commands) -> BoolArray | None:
        if held_commands.open_circuit is None or self.clock is None:
            return held_commands.open_circuit
        is_open = held_commands.open_circuit[np.maximum(self.clock.row, 0)]
        return is_open if self.held else np.where((self.clock.row < 0)[:, None], True, is_open)


PLAIN = View()


def seen_at_once(robot: Robot, held_commands: Commands, held: bool = False) -> View:
    """What instruments that are never late show of a robot."""
    latency, driver = robot.drive.latency, Driver(dead_band=robot.drive.dead_band)
    return View(clock(held_commands.dt, latency) if latency else None, {}, driver, held=held)


def seen_through(
    robot: Robot,
    held_commands: Commands,
    log: LogEffects,
    late: Mapping[str, float] | None = None,
    share: FloatArray | None = None,
    start: float | None = None,
) -> View:
    """What a log shows. late: channel -> by how much it is late [s]; None: as the log says. share (rows,): of the log
    that had gone by at each row; None: it is all of the log.

    start: by how much the channel that tells the start is late [s], for a log that begins in motion; None: it rests.
    """
    dt, drive, row = held_commands.dt, robot.drive.latency, float(np.median(held_commands.dt))
    if share is None:
        share = np.concatenate([[0.0], np.cumsum(dt[:-1])]) / float(np.sum(dt))
    late = late or {name: log.latency.of(name, drive, row) for name in OUTPUTS}
    main = drive if start is None else start
    late = {name: round(delay - main, DIGITS) for name, delay in late.items()}
    apart = sorted({0.0, *late.values()})
    time = clock(dt, main, apart) if main or any(apart) else None
    at = {"voltage": apart.index(0.0)} | {name: apart.index(delay) for name, delay in late.items()}
    driver, room = Driver(log.gain, robot.drive.dead_band, log.fade), log.tilt if any(log.tilt) else None
    return View(time, at, driver, share, log.push if any(log.push) else None, start is not None, room)
