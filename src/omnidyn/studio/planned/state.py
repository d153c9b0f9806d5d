"""The state of a plan that is driven, which all pages share, and what its buttons and its key do."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omnidyn.studio import calls
from omnidyn.studio.parts import BARS, COURSE, DRIVE, PLAN
from omnidyn.studio.planned.job import END, PROGRAM
from omnidyn.studio.session import Session
from omnidyn.studio.task import Task
from omnidyn.studio.worker import CancelledError, JobError

AREA, SECONDS, WITHIN = 3.0, 60.0, 2.0  # [m], [s], [%] where nobody says
SIMULATED, FAST, AT_ADDRESS = "simulated", "simulated, 10 times as fast", "at an address"
PACES = {SIMULATED: 1.0, FAST: 10.0}  # times real time
READY, RUNNING, STOPPED, DONE = "ready", "running", "stopped", "done"  # of the program that was planned


@dataclass
class Planned:
    """A plan, and what was driven of it.

    area [m], seconds [s]: that a plan may take. within: half an interval that is enough [%]. which, address: of the
    robot that drives it. last: the plan. robot: it is made for, by name and path. stage: of its program. course: what
    is driven, or comes next. frame: rows that were sent, and place. result: of the last drive. logs: files of what was
    driven. status: what they tell. holder: the page that holds the key. driven: how many drives there were.
    """

    session: Session
    area: list[float] = field(default_factory=lambda: [AREA, AREA])
    seconds: float = SECONDS
    within: float = WITHIN
    which: str = SIMULATED
    address: str = ""
    last: Task = field(default_factory=Task)
    robot: tuple[str, str] = ("", "")
    stage: str = READY
    course: dict[str, Any] | None = None
    frame: list[float] = field(default_factory=list)
    result: dict[str, Any] | None = None
    logs: list[str] = field(default_factory=list)
    status: dict[str, Any] | None = None
    trouble: str = ""
    holder: object = None
    driven: int = 0
    fresh: set[asyncio.Event] = field(default_factory=set)

    @property
    def is_planned(self) -> bool:
        """Whether there is a plan for the robot that is chosen."""
        return self.last.result is not None and self.robot == (self.session.robot, self.session.robot_path)

    @property
    def to(self) -> str:
        """Where the robot is, "" for a simulated one."""
        return self.address.strip() if self.which == AT_ADDRESS else ""

    def why_not(self) -> str:
        """What keeps from a plan, in words; "" for nothing."""
        return "" if self.session.robot_path else "Choose a robot first."

    def want(self, **wanted: Any) -> None:
        """Take what a page wants, where it is one. Not while it is driven."""
        if self.stage != RUNNING:
            for name, value in wanted.items():
                if isinstance(value, str) or (isinstance(value, int | float) and 0.0 < value < 1e4):
                    setattr(self, name, value)
        self.session.changed(PLAN)

    def want_side(self, axis: int, size: Any) -> None:
        """Take a side of the room [m]."""
        if isinstance(size, int | float) and 0.0 < size < 1e4:
            self.area[axis] = float(size)
        self.session.changed(PLAN)

    async def plan(self) -> None:
        """Plan a drive."""
        session = self.session
        if self.last.running or self.stage == RUNNING or self.why_not():
            return
        self.robot, self.logs = (session.robot, session.robot_path), []
        self.result, self.status, self.trouble, self.course, self.stage = None, None, "", None, READY
        command, python = calls.plan(session.robot_path, self.area, self.seconds, self.to, "planned-1.csv")
        self.last = last = Task(command=command, python=python)
        session.start(session.workers["drive"].start())  # what drives is there when the key is pressed
        request = {"robot": session.robot_path, "area": [*self.area], "seconds": self.seconds}
        await last.run(session, PLAN, PLAN, "plan", request)
        if last.result is not None:
            self.course = last.result["course"]
        session.changed(PLAN, COURSE, BARS)

    def why_no_drive(self) -> str:
        """What keeps from driving the plan, in words; "" for nothing."""
        if self.session.workers["drive"].busy:
            return "The robot is driven by hand: stop that first."
        return "Type the address of the robot first." if self.which == AT_ADDRESS and not self.to else ""

    def press(self, page: object) -> None:
        """A page pressed the key: begin to drive, where all is ready."""
        if self.stage == READY and self.is_planned and not self.why_no_drive():
            self.holder, self.stage = page, RUNNING
            self.session.start(self._drive())

    def hold(self, page: object, held: bool) -> None:
        """The page that began says whether it still holds the key."""
        if self.stage == RUNNING and page is self.holder:
            self.session.workers["drive"].command({"held": held})

    def stop(self) -> None:
        """Any page may stop it."""
        if self.stage == RUNNING:
            self.session.workers["drive"].command({"held": False})

    @property
    def can_go_on(self) -> bool:
        """Whether something is left of what was stopped."""
        return self.result is None or bool(self.result["left"])

    def go_on(self) -> None:
        """The robot stands in the middle again: what is left comes next."""
        if self.stage == STOPPED and self.can_go_on:
            self.course = self.result["left"] if self.result else self.course
            self.stage, self.result, self.trouble = READY, None, ""
            self.session.changed(PLAN, COURSE)

    async def _drive(self) -> None:
        """Drive while the key is held; what it tells is worked out beside it."""
        session, planned, folder = self.session, self.last.result, self.last.folder
        assert planned is not None
        assert folder is not None
        self.result, self.trouble, self.frame = None, "", []
        session.changed(PLAN, COURSE)
        telling = asyncio.ensure_future(self._follow(planned["learnt"]))
        self.driven += 1
        request = {
            "robot": self.robot[1],
            "program": str(folder / PROGRAM),
            "area": planned["course"]["area"],
            "logs": [*self.logs],
            "to": self.to,
            "pace": PACES.get(self.which, 1.0),
            "noise": planned["noise"],
            "log": str(session.new_folder() / f"planned-{self.driven}.csv"),
        }
        try:
            result = await session.workers["drive"].run("drive_plan", request, self._listen)
            self._ended(session.without_paths(result), request["log"])
        except JobError as error:
            self.trouble = session.shown(str(error))
        except CancelledError:
            pass
        self.stage = DONE if self.result and self.result["complete"] else STOPPED
        self.holder = None
        session.workers[PLAN].command(END)
        session.changed(PLAN, COURSE, DRIVE)
        await telling

    def _listen(self, kind: str, value: Any) -> None:
        """What the drive says of itself."""
        if kind == "frame":
            self.frame = value
            for fresh in self.fresh:
                fresh.set()
        elif kind == "rows":
            self.session.workers[PLAN].command(value)
        elif kind == "course":
            self.course = value
            self.session.changed(COURSE)

    def _ended(self, result: dict[str, Any], path: str) -> None:
        """A drive is over: its log is one of the session, with what the plan promised."""
        self.result = result
        if result["log"]:
            self.logs.append(path)
            log = self.session.add_log(path, Path(path).name)
            self.session.made.add(log.key)
            assert self.last.result is not None
            self.session.promises[log.key] = self.last.result["promises"]

    async def _follow(self, free: list[str]) -> None:
        """Let the rows of the drive tell what they do."""
        session = self.session

        def listen(kind: str, value: Any) -> None:
            self.status = session.without_paths(value)
            session.changed(BARS)

        request = {"robot": self.robot[1], "free": free, "within": self.within / 100.0, "logs": [*self.logs]}
        try:
            listen("live", await session.workers[PLAN].run("follow", request, listen))
        except JobError as error:
            self.trouble = session.shown(str(error))
            session.changed(PLAN)
        except CancelledError:
            pass
