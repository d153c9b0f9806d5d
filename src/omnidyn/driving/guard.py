"""When a drive must stop: what is measured beside what the program leads to."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.driving.connection import Measured
from omnidyn.driving.odometry import Odometry
from omnidyn.driving.program import DriveProgram
from omnidyn.errors import InputError
from omnidyn.statement import WARNING, Statement

WINDOW = 0.3  # [s] of travel that is compared
FOLLOWS_WITHIN = 0.2  # [s] later than predicted, at the latest
MOVING = 0.25  # of the longest travel of a wheel in a window of the program: what slips is judged against it
SURELY_MOVING = 0.06  # of the same: a wheel that a robot hindered by friction would turn less is not judged
ONE_WAY = 0.9  # of the predicted travel of a wheel, to and fro: else it turns round in the window, and is not judged
FOLLOWS = 0.2  # of the travel of a hindered robot: a wheel that turns less does not follow
SLIPS_FOR = 0.15  # [s]: a slip that ends sooner is noise of a sensor
SLIPS = 0.5  # of the travel: by so much wheels and body may differ
LEAST_SUPPLY = 0.75  # of the supply in the robot file
DEAD_MAN_RANGE = (0.02, 10.0)  # [s]


@dataclass(frozen=True)
class Limits:
    """When to stop.

    dead_man [s]: no motor gets anything longer than that after a stop, or after the line broke. silence [s]: without a
    measurement. supply [V]: the least; default: 0.75 of that in the robot file.
    """

    dead_man: float = 0.25
    silence: float = 0.25
    supply: float | None = None

    def __post_init__(self) -> None:
        least, most = DEAD_MAN_RANGE
        for name in ("dead_man", "silence"):
            value = getattr(self, name)
            if not is_number(value) or not least <= value <= most:
                raise InputError("out of range", got=value, expected=f"{least:g} to {most:g} s", where=name)
        if self.supply is not None and (not is_number(self.supply) or not 0.0 <= self.supply < np.inf):
            raise InputError("not a voltage", got=self.supply, expected="volts, 0 or more", where="supply")


class DriveGuard:
    """Watches a drive: `sent` and `take` say what happened, `fault` whether to stop now.

    start: of the program, on the clock of the drive [s], which all times here are on.
    """

    def __init__(self, program: DriveProgram, limits: Limits, start: float) -> None:
        self.program, self.limits, self.start = program, limits, start
        self.odometry = Odometry(program.robot)
        self._first_fault: Statement | None = None
        self._heard = start
        self._last: Measured | None = None
        self._unanswered = deque[tuple[int, float]]()
        delay = program.robot.sensor_model.pose_delay
        self._travel = {"encoders": _Travel(WINDOW + delay), "body": _Travel(WINDOW)}
        speed = np.asarray(program.predicted.wheel_speed)
        self._slips_since = np.full(program.robot.wheels.count, np.inf)  # time of each wheel [s]
        self._predicted = _added(speed, program.dt)
        self._hindered = [_added(np.asarray(run.wheel_speed), program.dt) for run in program.hindered]
        self._distance = np.zeros_like(speed)
        np.cumsum(0.5 * program.dt * np.abs(speed[1:] + speed[:-1]), axis=0, out=self._distance[1:])
        self._back = max(round(WINDOW / program.dt), 1)
        farthest = np.abs(self._way(np.arange(len(speed)))).max(axis=0)
        self._judged, self._surely = MOVING * farthest, SURELY_MOVING * farthest
        supply = program.robot.drive.supply
        of_file = LEAST_SUPPLY * supply if supply else 0.0
        self._least_supply = of_file if limits.supply is None else limits.supply

    def sent(self, now: float, number: int) -> None:
        """A command was sent."""
        self._unanswered.append((number, now))

    def take(self, now: float, t: float, measured: Measured) -> None:
        """What came now, and was measured at t. The first fault counts."""
        self._first_fault = self._first_fault or self._of_supply(measured)
        while self._unanswered and self._unanswered[0][0] <= measured.number:
            self._unanswered.popleft()
        self._last, self._heard = measured, now
        self.odometry.take(t, measured.channels)
        self._travel["encoders"].add(t, self.odometry.encoders)
        self._travel["body"].add(t - self.odometry.age, self.odometry.body)

    def fault(self, now: float) -> Statement | None:
        """Why to stop now; None for nothing."""
        return self._first_fault or self._of_line(now) or self._of_place() or self._of_wheels()

    def clock_fault(self, now: float, measured: Measured) -> Statement | None:
        """A robot that began anew, or whose clock jumped."""
        before = self._last
        if before is None:
            return None
        if measured.session != before.session or measured.number < before.number:
            return _stop("drive_reset")
        jump = (measured.t - before.t) - (now - self._heard)
        return _stop("drive_clock", jump=jump) if abs(jump) > self.limits.silence else None

    def _of_supply(self, measured: Measured) -> Statement | None:
        supply = float(measured.channels["supply"][0]) if "supply" in measured.channels else np.inf
        return _stop("drive_supply", volts=supply, least=self._least_supply) if supply < self._least_supply else None

    def _of_line(self, now: float) -> Statement | None:
        """Silence, and commands that do not arrive."""
        if now - self._heard > self.limits.silence:
            return _stop("drive_silent", seconds=now - self._heard)
        is_heard = now - self._heard < 0.5 * self.limits.silence  # else it is silence, if it lasts
        if is_heard and self._unanswered and now - self._unanswered[0][1] > self.limits.dead_man:
            return _stop("drive_late", seconds=now - self._unanswered[0][1])
        return None

    def _of_place(self) -> Statement | None:
        """The border: where it will be when the motors are off."""
        ahead = self.odometry.place[:2] + (self.odometry.age + self.limits.dead_man) * self.odometry.speed
        for axis, place, size in zip("xy", ahead.tolist(), self.program.area, strict=True):
            if abs(place) > 0.5 * size:
                return _stop("drive_border", axis, place=place, border=0.5 * size)
        return None

    def _of_wheels(self) -> Statement | None:
        """Wheels that do not turn as predicted, and a body that does not go as its wheels."""
        went = {name: turned for name, travel in self._travel.items() if (turned := travel.turned()) is not None}
        if not went:
            return None
        if (slipping := self._slipping(went)) is not None:
            return _stop("drive_slip", wheel=slipping)
        turned = next(iter(went.values()))
        row = round((self._travel[next(iter(went))].time - self.start) / self.program.dt)
        rows = np.arange(row - round(FOLLOWS_WITHIN / self.program.dt), row + 1)
        rows = np.clip(rows, 0, len(self._predicted) - 1)
        wanted = self._way(rows)
        distance = self._distance[rows] - self._distance[np.maximum(rows - self._back, 0)]
        one_way = np.abs(np.sign(wanted).sum(axis=0)) == len(rows)
        one_way &= (np.abs(wanted) >= ONE_WAY * distance).all(axis=0)
        least = np.abs(wanted).min(axis=0) * np.sign(wanted[-1])
        along, surely = turned * np.sign(least), self._surely_turned(rows, np.sign(least))
        bad = np.flatnonzero(one_way & (surely > self._surely) & (along < FOLLOWS * surely))
        if not bad.size:
            return None
        wheel = int(bad[np.argmin(along[bad])])
        code = "drive_wrong_way" if along[wheel] < -FOLLOWS * abs(least[wheel]) else "drive_stuck"
        return _stop(code, wheel=wheel + 1)

    def _slipping(self, went: Mapping[str, FloatArray]) -> int | None:
        """The number of a wheel that turns otherwise than the body moves, for longer than noise does. went: by what
        wheels measure, and by the body, which may be seen late."""
        body = self._travel["body"]
        encoders = self._travel["encoders"].turned(body.time) if len(went) == 2 else None
        if encoders is None:
            return None
        far = np.maximum(np.abs(encoders), np.abs(went["body"]))
        slips = np.abs(encoders - went["body"]) > SLIPS * np.maximum(far, 2.0 * self._judged)
        self._slips_since = np.where(slips, np.minimum(self._slips_since, body.time), np.inf)
        wheels = np.flatnonzero(body.time - self._slips_since >= SLIPS_FOR)
        return int(wheels[0]) + 1 if wheels.size else None

    def _surely_turned(self, rows: np.ndarray, signs: FloatArray) -> FloatArray:
        """How far each wheel turns at least, with these signs, in the window before any of these rows, however friction
        hinders it [rad]. Shape (wheels,)."""
        return np.min([(signs * self._way(rows, angle)).min(axis=0) for angle in self._hindered], axis=0)

    def _way(self, rows: np.ndarray, angle: FloatArray | None = None) -> FloatArray:
        """How far each wheel turns in the window before these rows [rad], by an angle of each row, as predicted by
        default. Shape (rows, wheels)."""
        angle = self._predicted if angle is None else angle
        return angle[rows] - angle[np.maximum(rows - self._back, 0)]


def _added(speed: FloatArray, dt: float) -> FloatArray:
    """Angles [rad] of speeds [rad/s]. Shape (rows, wheels)."""
    angle = np.zeros_like(speed)
    np.cumsum(0.5 * dt * (speed[1:] + speed[:-1]), axis=0, out=angle[1:])
    return angle


class _Travel:
    """How far wheels turned over WINDOW. kept [s]: for which it is known."""

    def __init__(self, kept: float) -> None:
        self._kept = kept
        self._rows = deque[tuple[float, FloatArray]]()

    def add(self, t: float, angle: FloatArray | None) -> None:
        if angle is None or (self._rows and angle is self._rows[-1][1]):
            return
        self._rows.append((t, angle))
        while len(self._rows) > 2 and t - self._rows[1][0] >= self._kept:
            self._rows.popleft()

    @property
    def time(self) -> float:
        """Of the last angle."""
        return self._rows[-1][0]

    def turned(self, until: float = np.inf) -> FloatArray | None:
        """Over the window that ends then; None while it was not watched that long."""
        rows = [row for row in self._rows if row[0] <= until]
        if not rows or rows[-1][0] - rows[0][0] < 0.9 * WINDOW:
            return None
        first = next((angle for t, angle in reversed(rows) if rows[-1][0] - t >= WINDOW), rows[0][1])
        return rows[-1][1] - first


def _stop(code: str, subject: str = "", **numbers: float) -> Statement:
    return Statement(code, WARNING, subject, numbers)
