"""The state of the tab Drive, which all pages share, and what its buttons do."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omnidyn.studio.parts import DRIVE, NUMBERS, VIEW
from omnidyn.studio.session import Session
from omnidyn.studio.worker import CancelledError, JobError


@dataclass
class Driving:
    """The drive. robot: what a page must know of it. frame: the newest. recorded: keys of logs."""

    session: Session
    running: bool = False
    robot: dict[str, Any] | None = None
    trouble: str = ""
    recording: bool = False
    frame: list[float] = field(default_factory=list)
    fresh: set[asyncio.Event] = field(default_factory=set)

    async def run(self) -> None:
        """Drive the robot until it is stopped."""
        if self.running or not self.session.robot_path:
            return
        if self.session.workers["drive"].busy:
            self.trouble = "A plan is driven now: let its key go first."
            self.session.changed(DRIVE)
            return
        folder = self.session.new_folder()
        self.running, self.robot, self.trouble = True, None, ""
        self.session.changed(DRIVE, VIEW)

        def listen(kind: str, value: Any) -> None:
            if kind == "frame":
                self.frame = value
                for fresh in self.fresh:
                    fresh.set()
                return
            if kind == "robot":
                self.robot = value
                self.session.changed(VIEW)
            elif kind == "numbers" and self.robot is not None:
                self.robot |= value
            elif kind == "trouble":
                self.trouble = self.session.shown(value)
            elif kind == "recorded":
                self.session.made.add(self.session.add_log(value["path"], Path(value["path"]).name).key)
            self.session.changed(NUMBERS if kind == "numbers" else DRIVE)

        try:
            await self.session.workers["drive"].run(
                "drive", {"robot": self.session.robot_path, "folder": str(folder)}, listen
            )
        except JobError as error:
            self.trouble = self.session.shown(str(error))
        except CancelledError:
            pass
        self.running = self.recording = False
        self.session.changed(DRIVE, VIEW)

    def send(self, command: dict[str, Any]) -> None:
        """Give a command of a page to the drive."""
        if self.running:
            if "record" in command:
                self.recording = bool(command["record"])
            self.session.workers["drive"].command(command)
            if "record" in command:
                self.session.changed(DRIVE)
