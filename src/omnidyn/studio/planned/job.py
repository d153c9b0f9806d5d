"""Jobs of a plan that is driven: the plan, the drive while a key is held, and what the rows of it tell so far."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.document import plain, sentence
from omnidyn.driving.clock import PacedClock
from omnidyn.driving.connection import RobotConnection
from omnidyn.driving.drive import DriveMoment
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.program_file import read_program
from omnidyn.driving.resume import rest_of
from omnidyn.driving.senders import STDOUT, sender
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.live.live import Live
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH
from omnidyn.model.keys import in_words, unit
from omnidyn.report.figures.robot import wheel_lines, wheel_places
from omnidyn.run import Run
from omnidyn.studio.job import Tell, robot_of, timed
from omnidyn.studio.job import shown as shown_document
from omnidyn.studio.live.job import shown

PROGRAM = "plan.csv"
FRAME, ROWS = 0.08, 0.5  # [s] between two places that a page gets; between two pieces of the log
POINTS = 1500  # of the way that a page draws
LOST, LOST_IN_SIMULATION = 0.3, 3.0  # [s] without a word of the page that holds the key, after which it is let go
END = "end"  # of the rows
EXPECTED = ("live_restarts", "live_gap")  # of a drive that goes on after a stop


def plan(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn plan` says; writes the program. request: "robot", "area" [m, m], "seconds", "folder"."""
    folder, robot = Path(request["folder"]), robot_of(request)
    assert robot is not None
    folder.mkdir(parents=True)
    with timed(tell) as listen:
        made = omnidyn.plan(robot, request["area"], request["seconds"], progress=listen)
    omnidyn.write_run(made.commands(), folder / PROGRAM)
    program = read_program(folder / PROGRAM, robot, made.area)
    return {
        **shown_document(made.document()),
        "promises": plain({key: [number.half, number.worst] for key, number in made.predicted.items()}),
        "learnt": list(made.learnt),
        "numbers": [
            {"key": key, "name": in_words(key), "unit": unit(key), "value": made.predicted[key].value, "half": None}
            for key in made.learnt
        ],
        "noise": {channel: std.tolist() for channel, std in made.noise.items()},
        "course": course(program),
    }


def course(program: DriveProgram) -> dict[str, Any]:
    """What a page shows of a program before and while it is driven: room, way, legs, the robot to scale."""
    pose = np.asarray(program.predicted.pose)
    rows = np.unique(np.linspace(0, len(pose) - 1, min(len(pose), POINTS)).astype(int))
    return plain(
        {
            "area": program.area,
            "seconds": program.seconds,
            "row_s": program.dt,
            "rows": rows,
            "way": np.round(pose[rows, :2], 4),
            "legs": [[leg.first, leg.end, leg.words, leg.pose] for leg in program.legs],
            "wheels": wheel_lines(program.robot.wheels),
            "reach": float(np.linalg.norm(wheel_places(program.robot.wheels), axis=1).max()),
        }
    )


def drive_plan(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Drive a program, or what is left of it, while a page holds its key; what came of it, and what is left.

    request: "robot", "program" (its file), "area", "logs" (files of what was driven of it), "to" (as `omnidyn drive`
    takes it; "" for a simulated robot, "pace" times as fast as real time, that measures with "noise"), "log" (file to
    write). commands: {"held": whether the key is}.
    """
    robot = robot_of(request)
    assert robot is not None
    whole = read_program(request["program"], robot, request["area"])
    program = rest_of(whole, [omnidyn.read_log(path, robot) for path in request["logs"]])
    held = _Held(commands, LOST if request["to"] else LOST_IN_SIMULATION)
    tell("course", course(program))
    connection, teller = _connection(request, program), _Teller(tell)
    record = omnidyn.drive(program, connection, held=held, follow=teller.hear)
    result = {
        "verdict": record.document().verdict_text,
        "severity": record.verdict.severity,
        "complete": record.is_complete,
    }
    result |= {
        "remedy": "" if record.stopped is None else sentence(record.stopped.remedy_text),
        "log": "",
        "left": None,
    }
    if record.run is not None and record.rows:
        omnidyn.write_run(record.run, request["log"])
        result["log"] = request["log"]
    if not record.is_complete:
        try:
            result["left"] = course(rest_of(program, [record.run] if record.run is not None and result["log"] else []))
        except (InputError, InsufficientDataError) as error:  # the log is written all the same
            result["remedy"] = str(error)
    return result


def follow(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What a drive tells so far: rows come as commands, until END.

    request: "robot", "free" (keys), "within" (half an interval that is enough, as a share of its number), "logs" (of
    the same plan, driven before).
    """
    robot = robot_of(request)
    assert robot is not None
    method = OutputError(free=tuple(request["free"]), nuisances=(LATENCY, PUSH))
    live = Live(robot, method, within=request["within"])
    for path in request["logs"]:
        live.add(omnidyn.read_log(path, robot))
    while (rows := commands.get()) != END:
        for status in live.answers(_run(rows)):
            tell("live", shown(status, EXPECTED))
    return shown(live.status, EXPECTED)


class _Held:
    """Whether the key is held: until a page says that it is not, or says nothing for so long [s]; then never again."""

    def __init__(self, commands: Any, lost: float) -> None:
        self._commands, self._lost, self._until = commands, lost, time.monotonic() + lost
        self._released = False

    def __call__(self) -> bool:
        now = time.monotonic()
        self._released = self._released or now >= self._until
        while not self._commands.empty():
            command = self._commands.get()
            self._released = self._released or not (isinstance(command, dict) and command.get("held") is True)
            self._until = now + self._lost
        return not self._released


class _Teller:
    """Tells a page where a drive is, and what it recorded, both now and then."""

    def __init__(self, tell: Tell) -> None:
        self._tell, self._shown, self._recorded, self._rows = tell, 0.0, time.monotonic(), -1

    def hear(self, moment: DriveMoment) -> None:
        """Where it is; the same rows as before are its end."""
        now, is_end = time.monotonic(), moment.rows == self._rows
        self._rows = moment.rows
        if is_end or now - self._shown > FRAME:
            self._shown = now
            self._tell("frame", [moment.rows, *moment.place.tolist()])
        if (is_end or now - self._recorded > ROWS) and (run := moment.new_rows()) is not None:
            self._recorded = now
            self._tell("rows", {"t": run.t.tolist()} | {name: v.tolist() for name, v in run.channels.items()})


def _run(rows: Mapping[str, Any]) -> Run:
    channels: dict[str, Any] = {name: np.array(values, dtype=float) for name, values in rows.items()}
    return Run(source="drive", **channels)


def _connection(request: Mapping[str, Any], program: DriveProgram) -> RobotConnection:
    """To the robot that a request names."""
    if request["to"] == STDOUT:
        raise InputError("not a robot of this page", got=STDOUT, expected="udp:HOST:PORT or serial:PORT")
    if request["to"]:
        return sender(request["to"], program.robot.wheels.count)
    noise = {channel: np.array(std) for channel, std in request["noise"].items()}
    clock = PacedClock(request["pace"])
    return SimulatedRobot(program.robot, noise, clock=clock, rate=1.0 / program.dt, seed=len(request["logs"]))
