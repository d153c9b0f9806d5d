"""The state of the tab Compare, which all pages share, and what its buttons do."""

from __future__ import annotations

import shlex
from pathlib import Path

import omnidyn
from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.parts import COMPARE, COMPARE_START, DRIFT
from omnidyn.studio.session import Session
from omnidyn.studio.task import Task

FIT = "fit"  # the kind of an upload that is not chosen as the robot of the session


class Comparing:
    """Robots over the same logs, fits beside each other, and what was said of them.

    robots: names of one or two. left_out: keys of logs that are not compared. fits: names, the oldest first.
    """

    def __init__(self, session: Session) -> None:
        self.session, self.last, self.last_drift = session, Task(), Task()
        self._robots, self._fits, self.left_out = ["", ""], list[str](), list[str]()
        session.takers[FIT] = self.add_fit

    async def add_fit(self, path: str, name: str) -> None:
        """Take a robot file that was dropped, under a name that no other has. Raises InputError for what is none."""
        await self.session.take_robot(path, name, choose=False)

    @property
    def robots(self) -> list[str]:
        """Names of the robots to compare, "" where none is chosen: the first is that of the session otherwise."""
        first, second = (name if name in self.session.robots else "" for name in self._robots)
        return [first or self.session.robot, second]

    def choose(self, place: int, name: str) -> None:
        """Choose the first or the second robot."""
        self._robots[place] = name or ""
        self.session.changed(COMPARE_START)

    @property
    def files(self) -> list[str]:
        """Names of the robots that are files, as a fit is."""
        presets = omnidyn.preset_names()
        return [name for name in self.session.robots if name not in presets]

    @property
    def fits(self) -> list[str]:
        """Names of the fits to compare, the oldest first."""
        return [name for name in self._fits if name in self.session.robots]

    def choose_fits(self, names: list[str]) -> None:
        """Choose fits, in this order."""
        self._fits = names
        self.session.changed(COMPARE_START)

    @property
    def logs(self) -> list[LogFile]:
        """The logs to compare with."""
        return [log for key, log in self.session.logs.items() if key not in self.left_out]

    def choose_logs(self, keys: list[str]) -> None:
        """Compare with these logs."""
        self.left_out = [key for key in self.session.logs if key not in keys]
        self.session.changed(COMPARE_START)

    def why_not(self) -> str:
        """What keeps from comparing: a code that the page has words for; "" for nothing."""
        if not self.robots[0]:
            return "no_robot"
        return "" if self.logs else "no_log"

    def calls(self) -> tuple[str, str]:
        """The command line and the Python call that compare robots with logs."""
        return calls.compare(self.logs, [self.session.robots[name] for name in self.robots if name])

    async def run(self) -> None:
        """Compare the robots with the logs."""
        if self.last.running or self.why_not():
            return
        self.last.end(self.session)
        command, python = self.calls()
        robots = [self.session.robots[name] for name in self.robots if name]
        files = {Path(robot).name: robot for robot in robots} | {log.map_name: log.map for log in self.logs if log.map}
        self.last = Task(command=command, python=python, files=files)
        request = {
            "robots": robots,
            "logs": [log.request for log in self.logs],
        }
        await self.last.run(self.session, COMPARE, COMPARE, "compare", request)

    def drift_calls(self) -> tuple[str, str]:
        """The command line and the Python call that compare the fits with each other."""
        names = [Path(name).name for name in self.fits]
        return shlex.join(["omnidyn", "drift", *names]), f"omnidyn.drift({names!r})"

    async def run_drift(self) -> None:
        """Compare the fits with each other."""
        if self.last_drift.running:
            return
        command, python = self.drift_calls()
        fits = [self.session.robots[name] for name in self.fits]
        self.last_drift = Task(command=command, python=python, files={Path(fit).name: fit for fit in fits})
        request = {"fits": fits, "names": self.fits}
        await self.last_drift.run(self.session, DRIFT, COMPARE, "drift", request)
