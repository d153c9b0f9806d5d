"""What is to be driven: rows of inputs, and the legs that they make. Words, pictures and commands come from these rows.

A leg is a stretch of rows in which some motor gets something, with the rest behind it. Where it leads is what the robot
of the file does under the same rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Table
from omnidyn.errors import InputError
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.keys import BREAKAWAY, COULOMB, Key, all_keys
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.run import Run
from omnidyn.shown import Displayable
from omnidyn.simulation.commands import as_floats
from omnidyn.simulation.simulate import simulate
from omnidyn.statement import NOTE, Statement, as_verdict

CHANNELS = {DUTY: "duty", SPEED: "wheel_speed_command"}  # kind of drive -> channel of its input; else voltage
UNITS = {"voltage": "V", "duty": "duty", "wheel_speed_command": "rad/s"}
STILL = (0.005, np.radians(1.0))  # [m], [rad]: less is no way
BACK = 0.2  # of its farthest way: a leg that comes back by more says so
ROUNDING = 1e-9  # of a duty, of a limit
MOST_SPEED = 3.0  # of the speed without load: a set point beyond it is no speed of that wheel
HINDERED = 1.7  # times the dry friction of a robot file: 30 % more of it, and 30 % less force of the motors
LARGEST = 1000.0  # [m] of a side of a room
TURN_ONLY = 0.1  # [m] a rad: less way beside a turn is not named


class Leg(NamedTuple):
    """One way from rest to rest.

    first, end: its rows, the rest behind it included. displacement, farthest: from where it began, in the frame of the
    body there (forward, left, counter-clockwise) [m, m, rad], to its end and to where it is farthest. pose: of its
    end, in the room.
    """

    first: int
    end: int
    displacement: tuple[float, float, float]
    farthest: tuple[float, float, float]
    pose: tuple[float, float, float]

    @property
    def words(self) -> str:
        """Where it leads, in words: "forward 0.52 m, left 0.10 m", "turn left 35 deg and back by 27 deg"."""
        back = np.subtract(self.displacement, self.farthest).tolist()
        if _size(back) < BACK * _size(self.farthest):
            return in_words(self.displacement)
        return f"{in_words(self.farthest)}, then {in_words(back)}"

    @property
    def cells(self) -> tuple[str, str, str]:
        """Its end as text: x [m], y [m], heading [deg]; no -0."""
        x, y = np.round(self.pose[:2], 2) + 0.0
        return f"{x:.2f}", f"{y:.2f}", f"{np.round(np.degrees(self.pose[2])) + 0.0:.0f}"


def _rougher(robot: Robot, keys: Sequence[Key]) -> Robot:
    """The robot with HINDERED times as much of these levels of friction."""
    for key in keys:
        robot = key.set(robot, HINDERED * key.get(robot), checked=False)
    return robot


@dataclass(frozen=True, eq=False)
class DriveProgram(Displayable):
    """Rows to drive.

    robot: that drives them. dt [s]: of a row. inputs (rows, wheels): volts, duties, or rad/s of its speed loop. area
    [m]: free floor along x and y; it begins in the middle, along x. source: where the rows come from.
    """

    robot: Robot
    dt: float
    inputs: FloatArray
    area: tuple[float, float] = (3.0, 3.0)
    source: str = ""

    def __post_init__(self) -> None:
        rows = as_floats("inputs", self.inputs)
        wheels = self.robot.wheels.count
        if rows.ndim != 2 or not len(rows) or rows.shape[1] != wheels or not np.isfinite(rows).all():
            raise InputError("wrong rows", got=rows.shape, expected=f"numbers, shape (rows, {wheels})", where="inputs")
        object.__setattr__(self, "inputs", rows)
        if not is_number(self.dt) or not 0.0 < self.dt < np.inf:
            raise InputError("wrong length of a row", got=self.dt, expected="seconds above 0", where="dt")
        if len(self.area) != 2 or not all(is_number(size) and 0.0 < size <= LARGEST for size in self.area):
            raise InputError("wrong room", got=self.area, expected=f"two sizes, above 0 to {LARGEST:g} m", where="area")
        if not rows.any():
            raise InputError("nothing to drive", got="all inputs are 0", expected="a row that moves", where="inputs")
        if self.channel == "duty" and np.abs(rows).max() > 1.0 + ROUNDING:
            largest = f"{np.abs(rows).max():g}"
            raise InputError("a duty beyond the supply", got=largest, expected="-1 to 1", where="inputs")
        if self.channel == "voltage":
            self._check_volts(rows)
        if self.channel == "wheel_speed_command":
            self._check_speeds(rows)

    def _check_volts(self, rows: FloatArray) -> None:
        limit = np.broadcast_to(np.asarray(self.robot.motor.voltage_limit, dtype=float), rows.shape[1])
        beyond = np.abs(rows).max(axis=0) - limit
        wheel = int(np.argmax(beyond))
        if beyond[wheel] > ROUNDING * limit[wheel]:
            raise InputError(
                "volts beyond the limit of the motor",
                got=f"{np.abs(rows[:, wheel]).max():g} V at wheel {wheel + 1}",
                expected=f"at most {limit[wheel]:g} V, motor.voltage_limit_V of {self.robot.name}",
                remedy="take smaller volts, or correct the limit in the robot file",
                where="inputs",
            )

    def _check_speeds(self, rows: FloatArray) -> None:
        wheels = rows.shape[1]
        volts = per_wheel(self.robot.motor.voltage_limit, wheels)
        most = MOST_SPEED * no_load_speed(self.robot.motor, volts)
        beyond = np.abs(rows).max(axis=0) / most
        wheel = int(np.argmax(beyond))
        if beyond[wheel] > 1.0 + ROUNDING:
            raise InputError(
                "speeds beyond what the motor reaches",
                got=f"{np.abs(rows[:, wheel]).max():g} rad/s at wheel {wheel + 1}",
                expected=f"at most {most[wheel]:.4g} rad/s, {MOST_SPEED:g} times its speed without load",
                remedy="take smaller speeds, check their unit, or correct the motor in the robot file",
                where="inputs",
            )

    @property
    def channel(self) -> str:
        """The channel of a Run that its inputs are."""
        return CHANNELS.get(self.robot.drive.kind, "voltage")

    @property
    def unit(self) -> str:
        """Of the inputs."""
        return UNITS[self.channel]

    @property
    def seconds(self) -> float:
        """How long it lasts [s]."""
        return len(self.inputs) * self.dt

    def commands(self) -> Run:
        """Its rows, as `read_commands` takes them."""
        t = np.asarray(self.dt * np.arange(len(self.inputs)), dtype=float)
        inputs: dict[str, Any] = {self.channel: self.inputs}
        return Run(t=t, source=self.source, **inputs)

    @cached_property
    def predicted(self) -> Run:
        """What the robot of the file does under these rows, from the middle of the room."""
        given: dict[str, Any] = {self.channel: self.inputs}
        if self.channel == "duty":
            given["supply"] = self.robot.drive.supply
        return simulate(self.robot, dt=self.dt, **given)

    @cached_property
    def hindered(self) -> tuple[Run, ...]:
        """What it does where dry friction is HINDERED times that of the file, in all its numbers and in each alone."""
        groups: dict[str, list[Key]] = {}
        for key in map(Key.parse, all_keys(self.robot)):
            if key.level in (COULOMB, BREAKAWAY) and key.get(self.robot):
                groups.setdefault(str(key).replace(BREAKAWAY, COULOMB), []).append(key)
        changes = [[key for keys in groups.values() for key in keys], *groups.values()]
        return tuple(replace(self, robot=_rougher(self.robot, keys)).predicted for keys in changes)

    @cached_property
    def legs(self) -> tuple[Leg, ...]:
        """The ways from rest to rest."""
        moves = (self.inputs != 0.0).any(axis=1)
        starts = np.flatnonzero(moves & ~np.concatenate([[False], moves[:-1]]))
        ends = [*starts[1:].tolist(), len(self.inputs)]
        pose = np.asarray(self.predicted.pose)
        return tuple(
            Leg(
                first,
                end,
                way_between(pose[first], pose[end]),
                _farthest(pose[first : end + 1]),
                tuple(pose[end].tolist()),
            )
            for first, end in zip(starts.tolist(), ends, strict=True)
        )

    @property
    def returns(self) -> tuple[bool, ...]:
        """Of each leg, whether it is the mirror image of the one before, and leads back."""
        rows = [self.inputs[leg.first : leg.end] for leg in self.legs]
        mirrors = [False]
        for before, after in pairwise(rows):
            mirrors.append(not mirrors[-1] and np.array_equal(before, -after))
        return tuple(mirrors[: len(rows)])

    @property
    def verdict(self) -> Statement:
        """What is to be driven, and how far it goes."""
        reach = np.abs(np.asarray(self.predicted.pose)[:, :2]).max(axis=0)
        numbers = {"legs": len(self.legs), "seconds": self.seconds, "reach": reach.tolist(), "area": self.area}
        return Statement("drive_program", NOTE, self.robot.name, numbers)

    def document(self) -> Document:
        """Its legs."""
        rows = [(f"{k}", f"{leg.first * self.dt:.1f}", leg.words, *leg.cells) for k, leg in enumerate(self.legs, 1)]
        table = Table(
            ("leg", "starts s", "leads, as predicted", "ends x m", "y m", "heading deg"), rows, "><<>>>", name="legs"
        )
        return Document([table], as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, but for the rows."""
        legs = [
            {"start_s": leg.first * self.dt, "end_s": leg.end * self.dt, "words": leg.words, "pose": list(leg.pose)}
            for leg in self.legs
        ]
        return {
            "robot": self.robot.name,
            "seconds": self.seconds,
            "row_s": self.dt,
            "unit": self.unit,
            "area_m": list(self.area),
            "legs": legs,
        }

    def from_leg(self, number: int) -> DriveProgram:
        """The program from a leg on, counted from 0, after half a second of rest."""
        if not 0 <= number < len(self.legs):
            raise InputError("no such leg", got=number, expected=f"0 to {len(self.legs) - 1}", where="leg")
        left = self.inputs[self.legs[number].first :]  # what is before it may be the end of the leg before
        return replace(self, inputs=np.concatenate([np.zeros((round(0.5 / self.dt), left.shape[1])), left]))


def way_between(start: FloatArray, end: FloatArray) -> tuple[float, float, float]:
    """From one pose to another, in the frame of the body at the first."""
    dx, dy, turn = (np.asarray(end) - np.asarray(start)).tolist()
    cosine, sine = np.cos(start[2]), np.sin(start[2])
    return float(cosine * dx + sine * dy), float(cosine * dy - sine * dx), float(turn)


def _farthest(pose: FloatArray) -> tuple[float, float, float]:
    """The way to where a leg is farthest from where it began."""
    far = np.hypot(*(pose[:, :2] - pose[0, :2]).T) + TURN_ONLY * np.abs(pose[:, 2] - pose[0, 2])
    return way_between(pose[0], pose[int(np.argmax(far))])


def _size(displacement: Sequence[float]) -> float:
    return float(np.hypot(displacement[0], displacement[1]) + TURN_ONLY * abs(displacement[2]))


def in_words(displacement: Sequence[float]) -> str:
    """A way in words, its largest part first."""
    forward, left, turn = displacement
    far = np.hypot(forward, left) > TURN_ONLY * abs(turn)
    parts = [
        (abs(forward), f"{'forward' if forward > 0 else 'back'} {abs(forward):.2f} m", far and abs(forward) > STILL[0]),
        (abs(left), f"{'left' if left > 0 else 'right'} {abs(left):.2f} m", far and abs(left) > STILL[0]),
        (
            0.0 if far else 10.0,
            f"turn {'left' if turn > 0 else 'right'} {abs(np.degrees(turn)):.0f} deg",
            abs(turn) > STILL[1],
        ),
    ]
    said = [words for _, words, is_way in sorted(parts, key=lambda part: -part[0]) if is_way]
    return ", ".join(said) or "hardly moves"
