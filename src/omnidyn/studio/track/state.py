"""The state of the tab Track, which all pages share, and what its buttons do."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import Any

from omnidyn.control.controllers import NAMES, POLICY_SUFFIX
from omnidyn.control.paths.path import OPTIONS
from omnidyn.studio.parts import PATH, TRACK, TRACK_START
from omnidyn.studio.session import ROBOT_SUFFIX, Session
from omnidyn.studio.task import Task
from omnidyn.studio.track.job import DRAWN

SPEED = 0.3  # [m/s] on a path drawn by hand, where nobody says


class Tracks:
    """The path that is chosen, the controllers, and what they did.

    path: a name, a dropped file, or DRAWN. options: of each named path, as text. points: drawn by hand [m].
    """

    def __init__(self, session: Session) -> None:
        self.session, self.last = session, Task()
        self.path, self.options = next(iter(OPTIONS)), {name: dict[str, str]() for name in OPTIONS}
        self.points: list[Any] = []
        self.speed, self.closed = str(SPEED), False
        self.smoothing: float | None = None  # [s]; None for as much as the robot needs
        self.controllers, self.sensors, self.plant = ["pid", "mpc"], "", ""
        self.path_files, self.controller_files = dict[str, str](), dict[str, str]()
        session.takers[TRACK] = self.add_file

    @property
    def paths(self) -> list[str]:
        """All paths that can be chosen."""
        return [*OPTIONS, *self.path_files, DRAWN]

    @property
    def controller_names(self) -> list[str]:
        """All controllers that can be chosen."""
        return [*NAMES, *self.controller_files]

    def add_file(self, path: str, name: str) -> None:
        """Take a file that was dropped: a controller by its suffix, else a path."""
        self.session.others += 1
        if name.lower().endswith((ROBOT_SUFFIX, POLICY_SUFFIX)):
            self.controller_files[name] = path
            self.controllers = [*self.controllers, name]
        else:
            self.path_files[name] = path
            self.path = name
        self.session.changed(PATH)

    def choose(self, path: str) -> None:
        """Choose a path."""
        self.path = path
        self.session.changed(PATH)

    def control(self, names: list[str]) -> None:
        """Choose controllers."""
        self.controllers = names
        self.session.changed(TRACK_START)

    def draw(self, points: Any) -> None:
        """Take the points that were drawn."""
        self.points = points if isinstance(points, list) else []
        self.session.changed(TRACK_START)

    @property
    def path_text(self) -> str:
        """The path as the command line has it."""
        given = self.options.get(self.path, {})
        words = ",".join(f"{name}={text.strip()}" for name, text in given.items() if text.strip())
        return f"{self.path}:{words}" if words else self.path

    def why_not(self) -> str:
        """What keeps from tracking: a code that the page has words for; "" for nothing."""
        if not self.session.robot_path:
            return "no_robot"
        if not self.controllers:
            return "no_controller"
        return "no_line" if self.path == DRAWN and len(self.points) < 2 else ""

    def calls(self) -> tuple[str, str]:
        """The command line and the Python call that do the same."""
        robot, plant = Path(self.session.robot_path).name, Path(self.session.robots.get(self.plant, "")).name
        words = ["omnidyn", "track", robot, "--path", self.path_text]
        words += [word for name in self.controllers for word in ("--controller", name)]
        words += ["--plant", plant] * bool(plant) + ["--sensors", self.sensors] * bool(self.sensors)
        more = f", plant=omnidyn.load_robot({plant!r})" * bool(plant) + f", sensors={self.sensors!r}" * bool(
            self.sensors
        )
        python = f"omnidyn.track(omnidyn.load_robot({robot!r}), {self.path_text!r}, {self.controllers!r}{more})"
        return shlex.join(words), python

    async def run(self) -> None:
        """Drive the robot along the path with each controller."""
        if self.last.running or self.why_not():
            return
        self.last.end(self.session)
        command, python = self.calls()
        robots = [self.session.robot_path, *filter(None, [self.session.robots.get(self.plant, "")])]
        files = {Path(robot).name: robot for robot in robots}
        given = {name: path for name, path in self.controller_files.items() if name in self.controllers}
        files |= {name: path for name, path in given.items() if name.lower().endswith(ROBOT_SUFFIX)}  # text
        self.last = task = Task(command=command, python=python, files=files)
        file = self.path_files.get(self.path, "")
        request = {
            "robot": self.session.robot_path,
            "plant": self.session.robots.get(self.plant, ""),
            "path": file or self.path_text,
            "file": self.path if file else "",
            "points": self.points if self.path == DRAWN else [],
            "speed": _number(self.speed),
            "closed": self.closed,
            "smoothing": self.smoothing,
            "controllers": [self.controller_files.get(name, name) for name in self.controllers],
            "sensors": self.sensors.strip(),
        }
        await task.run(self.session, TRACK, TRACK, "track", request)
        if request["points"] and task.folder is not None and task.result is not None:
            task.files[DRAWN] = str(task.folder / DRAWN)


def _number(text: str) -> float:
    """A number that a page sent; what is none is refused by the job."""
    try:
        return float(text)
    except ValueError:
        return math.inf
