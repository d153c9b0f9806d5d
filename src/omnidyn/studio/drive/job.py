"""Drive: a simulated robot under the keys and sliders of a page, 60 times a second.

The page sends axes (-1..1 for x, y, yaw), a level (volts, a duty or m/s), an offset for each wheel, numbers of the
robot file that change while it moves, loads, floors and batteries (`vary_robot`), and begin and end of a recording. A
robot whose numbers change goes on from where it is.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.model.actuation import reaching
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.dynamics import friction_wrench, settled_currents
from omnidyn.model.keys import WHEELS, Key, friction_keys
from omnidyn.model.motor import traction
from omnidyn.model.robot import Robot
from omnidyn.model.variations import Battery, Payload
from omnidyn.model.vary import times_friction
from omnidyn.model.wheels import wheel_speed
from omnidyn.report.figures.robot import wheel_lines, wheel_places
from omnidyn.simulation.live import LiveRobot, check_supply
from omnidyn.studio.job import Tell, robot_of

DT = 1.0 / 60.0  # [s]
NOISE = (0.01, 0.01, 0.05)  # [m/s, m/s, rad/s] of the speed that a recording has
LATE = 0.25  # [s] behind the clock: the time that was lost is not made up
MAX_ROWS = 60 * 60 * 30  # of a recording: half an hour
CHANGED = ("body.mass_kg", "body.inertia_kg_m2")  # beside friction
TOP_SPEED = 1.5  # [m/s] that a page may ask of a robot with a speed loop
UNITS = {DUTY: "", SPEED: "m/s"}  # of the level; else volts
VARIED = {"floor": ("friction", "wheels"), "payload": ("body",), "tilt": ("floor",), "battery": ("motor", "drive")}
MOST_FLOOR, MOST_LOAD, LEAST_BATTERY = 4.0, 2.0, 0.1  # times the friction, the mass, the supply of the file


def as_measured(twist: FloatArray, seed: int) -> FloatArray:
    """A twist with the noise of a good sensor: without any, a fit would take every rounding for a law. Shape (n, 3)."""
    return twist + np.random.default_rng(seed).standard_normal(twist.shape) * NOISE


class DrivenRobot:
    """One robot on its way."""

    def __init__(
        self, robot: Robot, folder: Path, tell: Callable[[str, Any], None], commands: queue.Queue[Any]
    ) -> None:
        check_supply(robot, None)
        self.file, self.robot, self.varied = robot, robot, dict.fromkeys(VARIED, "")
        self.folder, self.tell, self.commands = folder, tell, commands
        self.patterns = axis_patterns(robot)
        self.axes, self.level, self.offset = np.zeros(3), 0.0, np.zeros(robot.wheels.count)
        self.live = LiveRobot(robot, DT)
        self.rows: list[tuple[FloatArray, ...]] | None = None
        self.count, self.recordings, self.stopped = 0, 0, False

    def run(self) -> dict[str, Any]:
        """Go on until the page says stop."""
        self.live.step(np.zeros(self.robot.wheels.count))  # what is compiled or loaded is not part of the drive
        self._friction(self.live.voltage)
        self.live = LiveRobot(self.robot, DT)
        self._introduce()
        due = time.perf_counter()
        while not self.stopped:
            while not self.commands.empty():
                self._take(self.commands.get())
            self._step()
            due += DT
            now = time.perf_counter()
            due = max(due, now - LATE)
            if due > now:
                time.sleep(due - now)
        return {}

    def _introduce(self) -> None:
        """What the page has to know of the robot before the first frame."""
        robot, kind = self.robot, self.robot.drive.kind
        self.tell(
            "robot",
            {
                "name": robot.name,
                "kind": kind,
                "unit": UNITS.get(kind, "V"),
                "limit": _limit(robot),
                "reach": float(np.linalg.norm(wheel_places(robot.wheels), axis=1).max()),
                "wheels": [
                    {"ends": ends.tolist(), "push": push.tolist()}
                    for ends, push in zip(wheel_lines(robot.wheels), robot.wheels.wrench_matrix[:2].T, strict=True)
                ],
                "names": robot.variations.names,
                "ranges": _ranges(robot),
                **self._numbers(),
            },
        )

    def _numbers(self) -> dict[str, Any]:
        """The numbers that can be changed, as they are now, and where the robot begins to move."""
        keys = [Key.parse(name) for name in (*friction_keys(self.robot), *CHANGED)]
        numbers = [
            {"key": str(key), "words": key.words, "unit": key.unit, "value": key.get(self.robot)} for key in keys
        ]
        return {"breakaway": self._breakaway(), "numbers": numbers, "varied": self.varied}

    def _take(self, command: Mapping[str, Any]) -> None:
        """One command of a page; what cannot be used is said, and the drive goes on."""
        try:
            if "axes" in command:
                self.axes = np.clip(_finite(command["axes"], 3), -1.0, 1.0)
                self.level = float(np.clip(_finite(command["level"], 1)[0], 0.0, _limit(self.robot)))
            if "offset" in command:
                self.offset = _finite(command["offset"], self.robot.wheels.count)
            for key, value in dict(command.get("set", {})).items():
                self._change(Key.parse(key).set(self.robot, float(value)))
            for kind, choice in dict(command.get("vary", {})).items():
                self._vary(kind, choice)
            if command.get("home"):
                self.live = LiveRobot(self.robot, DT)
            if "record" in command:
                self._record(bool(command["record"]))
            self.stopped = self.stopped or bool(command.get("stop"))
        except (OmnidynError, ValueError, TypeError, KeyError) as error:
            self.tell("trouble", str(error))

    def _change(self, robot: Robot) -> None:
        """Another robot goes on where this one is."""
        self.robot = robot
        self.live = LiveRobot(robot, DT, pose=self.live.pose, twist=self.live.twist)
        self.tell("numbers", self._numbers())

    def _vary(self, kind: str, choice: str | float) -> None:
        """Another floor, load, slope or battery: by a name of the robot file, or by size. "" is that of the file."""
        made = {"floor": lambda size: times_friction(self.file, size), "payload": lambda size: Payload(mass=size)}
        made["battery"] = lambda size: Battery(supply=size)
        value = choice if isinstance(choice, str) else made[kind](float(choice))
        robot = omnidyn.vary_robot(self.file, **{kind: value})
        self.varied = {**self.varied, kind: choice}
        self._change(self.robot.replace(**{part: getattr(robot, part) for part in VARIED[kind]}))

    def _breakaway(self) -> list[float | None]:
        """Volts of the pattern of each axis at which the robot begins to move; None where no voltage tells."""
        if self.robot.drive.kind == SPEED or self.robot.floor.tilt or self.robot.wheels.traction_mu is not None:
            return [None] * 3
        volts = breakaway_voltage(self.robot, self.patterns)
        return [float(value) if np.isfinite(value) else None for value in volts]

    def _command(self) -> FloatArray:
        """What the drives of the wheels get now: volts, a duty, or wheel speeds. Shape (wheels,)."""
        if self.robot.drive.kind == SPEED:
            reach = np.array([1.0, 1.0, 1.0 / float(np.mean(self.robot.wheels.robot_radius))])
            return wheel_speed(self.robot.wheels, self.level * self.axes * reach) + self.offset
        limit = _limit(self.robot)
        return np.clip(self.level * (self.axes @ self.patterns) + self.offset, -limit, limit)

    def _step(self) -> None:
        """One step, its frame, and its row of the recording."""
        live, command = self.live, self._command()
        before = live.twist.copy()
        live.step(command)
        if self.rows is not None:
            supply = self.robot.drive.supply or 0.0
            self.rows.append((command if self.robot.drive.kind != SPEED else live.voltage, before, np.array(supply)))
            if len(self.rows) >= MAX_ROWS:
                self._record(False)
        motors = reaching(self.robot, live.voltage)
        current = settled_currents(self.robot, live.twist, motors)
        self.count += 1
        wheels = [
            command,
            live.voltage,
            current,
            live.wheel_speed,
            traction(self.robot.motor, self.robot.wheels, current),
        ]
        head = [self.count * DT, *live.pose, *live.twist, float(self.rows is not None), *self._friction(motors)]
        self.tell("frame", [float(value) for value in np.concatenate([head, *wheels])])

    def _friction(self, motors: FloatArray) -> FloatArray:
        """The wrench of friction under these voltages of the motors; NaN on slopes and under wheels that slip."""
        if self.robot.floor.tilt or self.robot.wheels.traction_mu is not None:
            return np.full(3, np.nan)
        return friction_wrench(self.robot, self.live.twist, motors)

    def _record(self, begin: bool) -> None:
        """Begin a recording, or write it as a log."""
        if begin:
            self.rows = []
            return
        rows, self.rows = self.rows, None
        if not rows or len(rows) < 2:
            return
        command, twist, supply = (np.array(part) for part in zip(*rows, strict=True))
        self.recordings += 1
        path = self.folder / f"drive-{self.recordings}.csv"
        inputs: dict[str, Any] = {"duty" if self.robot.drive.kind == DUTY else "voltage": command}
        if self.robot.drive.kind == DUTY:
            inputs["supply"] = supply
        t = DT * np.arange(len(rows), dtype=np.float64)
        run = omnidyn.Run(t, twist=as_measured(twist, self.recordings), source=path.stem, **inputs)
        omnidyn.write_run(run, path, force=True)
        self.tell("recorded", {"path": str(path), "seconds": DT * len(rows)})


def _finite(values: Any, count: int) -> FloatArray:
    """So many numbers of a page. Raises ValueError or TypeError for anything else."""
    numbers = np.asarray(values, dtype=float).reshape(count)
    if not np.isfinite(numbers).all():
        raise ValueError(f"not finite: {values}")
    return numbers


def _limit(robot: Robot) -> float:
    """The largest level: volts, a duty, or m/s."""
    if robot.drive.kind == DUTY:
        return 1.0
    return TOP_SPEED if robot.drive.kind == SPEED else float(np.max(robot.motor.voltage_limit))


def _ranges(robot: Robot) -> dict[str, list[float]]:
    """Least, largest and present size of what a floor, a load and a battery can be chosen by."""
    supply = robot.drive.supply or float(np.max(robot.motor.voltage_limit))
    ranges = {"payload": [0.0, MOST_LOAD * robot.body.mass, 0.0], "battery": [LEAST_BATTERY * supply, supply, supply]}
    on_floor = any(not key.startswith(WHEELS) for key in friction_keys(robot))
    return ({"floor": [0.0, MOST_FLOOR, 1.0]} if on_floor else {}) | ranges


def drive(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Drive a robot until the page stops it. request: "robot", "folder" of recorded logs."""
    robot = robot_of(request)
    assert robot is not None
    return DrivenRobot(robot, Path(request["folder"]), tell, commands).run()
