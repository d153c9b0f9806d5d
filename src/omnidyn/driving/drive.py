"""drive: a program, sent to a robot row by row, while a guard watches what comes back."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.driving.clock import DriveClock, RealClock
from omnidyn.driving.connection import Command, RobotConnection
from omnidyn.driving.guard import DriveGuard, Limits
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.record import DriveRecord
from omnidyn.driving.recording import DriveRecording
from omnidyn.driving.tabled import TabledConnection
from omnidyn.errors import InputError, Terminated, printable, shortened, told_by
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.statement import ERROR, WARNING, Statement

ANSWERS_WITHIN = 3.0  # [s] for the first answer of a robot
GREETING = 0.3  # [s] in which the line is tried before the first row
REST = 0.5  # [s] that are recorded after the last row
MESSAGE = 200  # characters of an error that are told


def drive(
    program: DriveProgram,
    connection: RobotConnection,
    *,
    limits: Limits | None = None,
    clock: DriveClock | None = None,
    held: Callable[[], bool] | None = None,
    progress: Progress = silent,
    follow: Callable[[DriveMoment], None] | None = None,
) -> DriveRecord:
    """Drive a robot through a program, and record it.

    It stops where the robot is silent, late, begins anew or has a clock that jumps; at the border of the room; where a
    wheel does not turn as predicted or slips; where the supply is low; and where `held` says no. Ctrl-C stops it too,
    and so does an error of `held`, `progress`, `follow` or the connection: what was driven so far is in the record,
    which names the error and has it as `error`. No motor gets anything later than `limits.dead_man` after that: each
    command ends by itself, on the robot's side.

    Args:
        program: What is to be driven; `read_program` reads what `omnidyn plan` wrote.
        connection: To the robot, such as `SimulatedRobot`.
        limits: When to stop.
        clock: Default: that of a simulated robot, else real time.
        held: Whether a key that must be held down still is.
        progress: Hears what is done.
        follow: Hears where it is with each row, and at the end; it must return at once.

    Raises InputError for rows that are longer than half the dead-man time, for which a command acts, and for a
    `TabledConnection` whose table is not for this program; and any error that comes before something was driven.

    >>> import omnidyn
    >>> robot = omnidyn.load_robot("axebot")
    >>> forward = [[0.0, 3.0, -3.0]] * 50 + [[0.0, 0.0, 0.0]] * 25
    >>> program = omnidyn.DriveProgram(robot, 0.02, forward)
    >>> print(program.legs[0].words)
    forward 0.71 m
    >>> omnidyn.drive(program, omnidyn.SimulatedRobot(robot)).is_complete
    True
    """
    check_order("drive(program, connection)", (program, DriveProgram), (connection, object))
    for name, listener in (("held", held), ("progress", progress), ("follow", follow)):
        if listener is not None and not callable(listener):
            raise InputError(
                "not a function", got=listener, expected=f"a function that is called, or no `{name}`", where=name
            )
    limits = limits or Limits()
    most = 0.5 * limits.dead_man
    if program.dt > most:  # the motors would be off before the next row
        raise InputError(
            "rows are longer than a command acts",
            got=f"{program.dt:g} s",
            expected=f"at most {most:g} s, half the dead-man time",
            remedy="take shorter rows, or a longer `dead_man`",
            where="program",
        )
    if isinstance(connection, TabledConnection):
        connection.check(program)
    held, progress = _named("held", held or (lambda: True)), _named("progress", progress)
    driver = _Driver(program, connection, limits, clock or _clock_of(connection), held, progress)
    driver.follow = _named("follow", follow or (lambda moment: None))
    return driver.run()


class _CallError(Exception):
    """A function of the caller failed: its name, and its error as the cause."""


def _named(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function; its errors carry its name."""

    def named(*args: Any) -> Any:
        try:
            return function(*args)
        except Exception as error:
            raise _CallError(name) from error

    return named


def _clock_of(connection: object) -> DriveClock:
    return getattr(connection, "clock", None) or RealClock()


class DriveMoment(NamedTuple):
    """Where a drive is, for who looks on.

    rows: of the program that were sent. place (3,): in the room, by what is measured [m, m, rad]. new_rows: gives what
    was recorded since it was asked last, None for nothing.
    """

    rows: int
    place: FloatArray
    new_rows: Callable[[], Run | None]


class _Driver:
    """One drive on its way."""

    def __init__(
        self,
        program: DriveProgram,
        connection: RobotConnection,
        limits: Limits,
        clock: DriveClock,
        held: Callable[[], bool],
        progress: Progress,
    ) -> None:
        self.program, self.connection, self.limits = program, connection, limits
        self.clock, self.held, self.progress = clock, held, progress
        self.recording, self.guard = DriveRecording(program.robot.wheels.count), DriveGuard(program, limits, 0.0)
        self.session, self.number = secrets.randbelow(2**31 - 1) + 1, 0
        self.rows, self.start, self.driven_at = 0, 0.0, float("-inf")
        self.off = (0.0,) * program.robot.wheels.count
        self.error: BaseException | None = None
        self.follow: Callable[[DriveMoment], None] = lambda moment: None

    def run(self) -> DriveRecord:
        """All of it; whatever ends it, the robot is stopped, and what was recorded is kept."""
        try:
            stopped = self._kept(self._drive)
        finally:
            failed = self._stop()
        stopped = stopped or failed or self._kept(self._tell)
        run = self.recording.run(self.program.channel, self.program.source or self.program.robot.name)
        if run is None and self.error is not None:  # nothing to keep
            raise self.error
        return DriveRecord(self.program, run, self.rows, stopped, self.driven_at, self.error)

    def _kept(self, step: Callable[[], Statement | None]) -> Statement | None:
        """A step of the drive; what ends it by an error becomes the reason of the stop, so that the log is kept."""
        try:
            return step()
        except OSError as error:
            return Statement("drive_line_broke", WARNING, numbers={"error": str(error.strerror or error)})
        except (Exception, KeyboardInterrupt, Terminated) as raised:
            error = told_by(raised)
            if isinstance(error, KeyboardInterrupt):
                return Statement("drive_by_hand", WARNING)
            name, error = (error.args[0], error.__cause__) if isinstance(error, _CallError) else ("", error)
            self.error = self.error or error
            if isinstance(error, Terminated):
                return Statement("drive_terminated", WARNING)
            message = f"{type(error).__name__}: {error}".removesuffix(": ")
            code = "drive_call_failed" if name else "drive_failed"
            return Statement(code, ERROR, name, {"error": shortened(printable(message), MESSAGE)})

    def _drive(self) -> Statement | None:
        self.connection.open()
        stopped = self._greet() or self._rows()
        if stopped is None:
            self._rest()
        return stopped

    def _greet(self) -> Statement | None:
        """Begin a session: the robot answers, and commands and answers take half of the dead-man time at the most: the
        other half is theirs to act."""
        began, dt, answered, slowest = self.clock.now(), self.program.dt, 0, 0.0
        sent = {0: began}
        for k in range(round(ANSWERS_WITHIN / dt)):
            if not self.held():
                return Statement("drive_released", WARNING)
            now = self.clock.now()
            sent.setdefault(self.number, now)
            self.connection.send(Command(self.session, self.number, now, 0.5 * self.limits.dead_man, self.off))
            self.clock.sleep_until(began + (k + 1) * dt)
            for measured in self.connection.receive():
                if measured.session == self.session:
                    answered = answered or k + 1
                    slowest = max(slowest, self.clock.now() - sent.pop(measured.number, self.clock.now()))
            self.number += answered > 0
            if answered and k + 1 - answered >= round(GREETING / dt):
                break
        if not answered:
            return Statement("drive_no_answer", WARNING, numbers={"seconds": ANSWERS_WITHIN})
        if slowest > 0.5 * self.limits.dead_man:
            numbers = {"seconds": slowest, "most": 0.5 * self.limits.dead_man}
            return Statement("drive_slow_line", WARNING, numbers=numbers)
        return None

    def _rows(self) -> Statement | None:
        """Row by row. A loop that is late goes on from there, and no row is left out."""
        dt, inputs = self.program.dt, self.program.inputs.tolist()
        self.start = due = self.clock.now()
        self.guard = DriveGuard(self.program, self.limits, self.start)
        for k, row in enumerate(inputs):
            self.clock.sleep_until(due)
            late = self.clock.now() - due
            if late > 0.5 * dt:
                self.start += late
                self.guard.start += late
            stopped = self._listen() or self._of_this_side(late)
            if stopped is not None:
                return stopped
            self._send(tuple(row))
            self.rows, due = k + 1, self.start + (k + 1) * dt
            self._tell()
            if k % max(round(1.0 / dt), 1) == 0:
                self.progress(Report("driving", k, len(inputs)))
        return None

    def _rest(self) -> None:
        """What the robot does after the last row is recorded too."""
        begin, dt = self.start + len(self.program.inputs) * self.program.dt, self.program.dt
        for k in range(round(REST / dt)):
            self.clock.sleep_until(begin + k * dt)
            self._listen()
            self._send(self.off)

    def _listen(self) -> Statement | None:
        """Take what came, and say why to stop."""
        now = self.clock.now()
        for measured in self.connection.receive():
            fault = self.guard.clock_fault(now, measured)
            if fault is not None:
                return fault
            self.recording.measured(now, measured)
            self.guard.take(now, self.recording.time_of(measured), measured)
        return self.guard.fault(now)

    def _of_this_side(self, late: float) -> Statement | None:
        """A key that was released, and a loop that was held up."""
        if not self.held():
            return Statement("drive_released", WARNING)
        if late > self.limits.dead_man:
            return Statement("drive_slow_loop", WARNING, numbers={"seconds": late})
        return None

    def _tell(self) -> None:
        """Calls `follow` with where the drive is."""
        channel, source = self.program.channel, self.program.source or self.program.robot.name
        moment = DriveMoment(self.rows, self.guard.odometry.place, lambda: self.recording.new_rows(channel, source))
        self.follow(moment)

    def _send(self, inputs: tuple[float, ...]) -> None:
        now = self.clock.now()
        command = Command(self.session, self.number, now, 0.5 * self.limits.dead_man, inputs)
        self.connection.send(command)
        self.recording.sent(now, command)
        self.guard.sent(now, self.number)
        self.number += 1
        if any(inputs):
            self.driven_at = now

    def _stop(self) -> Statement | None:
        """Motors off, whatever the line makes of it: what was sent ends by itself. The error of a connection that does
        not even do that; a line that is broken already is none."""
        failed = [
            self._kept(lambda end=end: _without_line(end)) for end in (self.connection.stop, self.connection.close)
        ]
        return failed[0] or failed[1]


def _without_line(end: Callable[[], None]) -> None:
    with suppress(OSError):
        end()
