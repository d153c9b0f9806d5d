"""What `identify` says of a log, as its public record has it, and what of that record a twin asks for."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.twins.worlds import WORLDS
from omnidyn.errors import OmnidynError
from omnidyn.identification.default_method import default_motor_method
from omnidyn.identification.identification import Identification
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import Method, MotorLine
from omnidyn.logs.read_log import read_log
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot
from omnidyn.progress import silent
from omnidyn.run import Run

BY_DEFAULT, WINDOWS = MOTOR_METHODS = ("by default", "windows")
NO_ANSWER = "no_motor_answers"
NO_LINE = "speed_no_line"


@dataclass(frozen=True)
class Answer:
    """record: of the result, as `--json` writes it, {} where the call failed: `error` says why. found: the result.
    seconds: of processor time."""

    record: Mapping[str, Any] = field(default_factory=dict)
    found: Identification | None = None
    error: str = ""
    seconds: float = 0.0

    @property
    def motor(self) -> dict[str, Any]:
        """The record of the first motor."""
        return next(iter(self.record.get("motors", ())), {})

    @property
    def numbers(self) -> dict[str, dict[str, Any]]:
        """Of the first motor or group: name -> value, std, ci95."""
        group = next(iter(self.record.get("groups", {}).values()), self.record)
        return self.motor.get("parameters") or group.get("parameters", {})

    def value(self, name: str) -> float | None:
        """A number; None where it is not there."""
        return self.numbers.get(name, {}).get("value")

    def holds(self, name: str, truth: float) -> bool:
        """Whether the interval of a number is there and holds the truth."""
        low, high = self.numbers.get(name, {}).get("ci95") or (None, None)
        return low is not None and high is not None and low <= truth <= high

    def codes(self) -> list[str]:
        """Codes of all statements, of those inside others too."""
        return list(_codes(self.record))


def _codes(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        yield from (value[name] for name in ("code", "verdict_code") if isinstance(value.get(name), str))
        for inner in value.values():
            yield from _codes(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _codes(inner)


def ask(runs: Sequence[Run], robot: Robot | None, method: Method | None = None, *, quick: bool = False) -> Answer:
    """What `identify` says of logs."""
    begin = time.process_time()
    try:
        found = identify(runs, robot, method, quick=quick)
        record = found.document().data
    except OmnidynError as error:
        return Answer(error=str(error), seconds=time.process_time() - begin)
    return Answer(record, found, "", time.process_time() - begin)


@dataclass(frozen=True)
class Examined:
    """A twin's logs, the first of which was fitted, and the answer. robot: as a user has it, None for a motor."""

    truth: Mapping[str, float]
    robot: Robot | None
    runs: Sequence[Run]
    answer: Answer


@cache
def examined(name: str, seed: int, way: str = "") -> Examined:
    """What `identify` says of the first log of a twin. way: of a motor."""
    with tempfile.TemporaryDirectory() as folder:
        twin = WORLDS[name](Path(folder), seed)
        robot = parse_robot(twin.robot) if twin.robot else None
        runs = [read_log(path, robot) for path in twin.logs]
    return Examined(twin.truth, robot, runs, ask(runs[:1], robot, motor_method(way, runs[:1]) if way else None))


def motor_method(way: str, runs: Sequence[Run]) -> Method:
    """The method that `omnidyn identify --what motors` takes by default for these logs, or the line of windows."""
    return MotorLine() if way == WINDOWS else default_motor_method(runs, "", silent)


def dead_bands(answer: Answer) -> list[tuple[float, float]]:
    """The intervals of all claims about where the first motor starts, of its line and of each direction."""
    line = [answer.numbers["dead_band"]["ci95"]] if answer.motor.get("dead_band_seen") else []
    offset = answer.value("offset") or 0.0
    starts = [
        [bound - sign * offset for bound in start["parameters"]["start"]["ci95"]]
        for start in answer.record.get("starts", ())
        for sign in ({"+": 1.0, "-": -1.0}.get(start["direction"], 0.0),)
        if None not in start["parameters"]["start"]["ci95"]
    ]
    return [(low, high) for low, high in (*line, *starts) if low is not None and high is not None]


def contradictions(answer: Answer) -> list[str]:
    """Claims of one answer that exclude each other, or that no motor can have."""
    claims, codes = dead_bands(answer), answer.codes()
    apart = max((low for low, _ in claims), default=0.0) > min((high for _, high in claims), default=0.0)
    found = ["dead bands that exclude each other"] if apart else []
    value = answer.value("dead_band")
    found += ["a dead band below 0"] if value is not None and value < 0.0 and not driver_map(answer) else []
    found += ["a motor that turns does not answer"] if NO_ANSWER in codes else []
    return found


def driver_map(answer: Answer, motor: int = 0) -> list[tuple[float, float]]:
    """(input, steady speed) of a motor whose speed is no line of its input, as sizes; none where it is one."""
    curve = next((curve for curve in answer.record.get("curves", ()) if curve["motor"] == motor + 1), None)
    if curve is None:
        return []
    rest = [(curve["rest"], 0.0)] if curve["rest"] else []
    return [(0.0, 0.0), *rest, *zip(curve["level"], curve["speed"], strict=True)]
