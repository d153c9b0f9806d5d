"""Session: what all pages of one server share: files, the robot, the last fit, the drive. A reload shows the same.

Files come from the command line, from uploads, from recordings. An upload lies in a folder of its own under a name made
of plain letters, and goes away with the session.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import itertools
import shutil
import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import omnidyn
from omnidyn.errors import InputError
from omnidyn.model.presets import robot_path
from omnidyn.progress import Report
from omnidyn.studio.calls import LogFile, safe_name
from omnidyn.studio.parts import COMPARE, FIT, LOGS, PLAN, PROGRESS, ROBOT, TRACK, WATCH
from omnidyn.studio.removed import Removed
from omnidyn.studio.series import META, Series
from omnidyn.studio.words import each_text, in_page_names, without_folders
from omnidyn.studio.worker import CancelledError, EndedError, JobError, Worker

MAX_FILES, MAX_FILE_BYTES, MAX_BYTES = 50, 2**30, 4 * 2**30  # of uploads
TOO_LARGE = (
    f"too large: {MAX_FILE_BYTES // 2**30} GiB each and {MAX_BYTES // 2**30} GiB in all are the most. "
    "Name it on the command line instead."
)
ROBOT_SUFFIX = ".toml"


class RefusedError(Exception):
    """An upload that is not taken, and why."""


class Session:
    """The state of the server, and what can be done with it."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="omnidyn-studio-")
        self.folder = Path(self._folder.name)
        self.logs: dict[str, LogFile] = {}
        self.robots = {name: name for name in omnidyn.preset_names()}  # shown name -> preset or path
        self.presets = (*self.robots,)
        self.robot = ""
        self.series: dict[str, Series] = {}
        self.listeners: set[Callable[[str], None]] = set()
        self.workers = {name: Worker() for name in ("log", "fit", "drive", TRACK, COMPARE, WATCH, PLAN, "warm")}
        self.others = 0  # files that are neither logs nor robots
        self.made = set[str]()  # keys of logs and names of robots that were made here, not brought: no edit takes them
        # key of a log -> key of a number -> what the plan of its drive promised, in the middle and at the worst
        self.promises: dict[str, dict[str, list[float | None]]] = {}
        self.removed: Removed | None = None
        self.takers: dict[str, Callable[[str, str], object]] = {"": self.add_log, ROBOT_SUFFIX: self.take_robot}
        self.count, self._bytes, self._tasks = 0, 0, set[asyncio.Task[Any]]()

    def changed(self, *parts: str) -> None:
        """Tell all pages which parts of them are old."""
        for listener in [*self.listeners]:
            for part in parts:
                listener(part)

    def changed_all(self) -> None:
        """Tell all pages that files, robots and fits are others."""
        self.changed(LOGS, ROBOT, FIT)

    def start(self, work: Any) -> None:
        """Let something go on beside the pages."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End all processes and remove all files."""
        for worker in self.workers.values():
            await worker.stop()
        self._folder.cleanup()

    # Files

    def new_folder(self) -> Path:
        """A folder for one upload or one result."""
        self.count += 1
        folder = self.folder / str(self.count)
        folder.mkdir()
        return folder

    def open(self, paths: list[str]) -> None:
        """Take files that the command line names: logs, and robot files by their suffix."""
        for path in paths:
            if path.lower().endswith(ROBOT_SUFFIX):
                name = self.free_name(Path(path).name)
                self.robots[name], self.robot = path, name
            else:
                taken = self.taker(Path(path).suffix.lower())(path, path)
                if inspect.isawaitable(taken):
                    self.start(taken)

    def add_log(self, path: str, name: str) -> LogFile:
        """Take a log and check it."""
        self.count += 1
        if any(other.name == name and other.path != path for other in self.logs.values()):
            name = f"{Path(name).stem}-{self.count}{Path(name).suffix}"  # calls name a log by its file
        log = LogFile(f"log{self.count}", name, path)
        if any(other.stem == log.stem for other in self.logs.values()):
            log.stem = f"{log.stem}-{self.count}"
        self.logs[log.key] = log
        self.start(self.check(log))
        self.changed(LOGS, FIT)
        return log

    async def upload(self, name: str, body: AsyncIterator[bytes], kind: str = "") -> str:
        """Take an upload, and return the name it got. Raises RefusedError for one too many or too large.

        kind: what it is, one of `takers`; "" where its suffix says it.
        """
        if self.brought >= MAX_FILES:
            raise RefusedError(self.room)
        safe = safe_name(name)
        path, size = self.new_folder() / safe, 0
        try:
            with path.open("xb") as file:
                async for block in body:
                    size += len(block)
                    if self._bytes + size > MAX_BYTES:
                        self._forget_removed()
                    if size > MAX_FILE_BYTES or self._bytes + size > MAX_BYTES:
                        raise RefusedError(TOO_LARGE)
                    file.write(block)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        self._bytes += size
        taken = self.taker(kind or path.suffix.lower())(str(path), safe)
        if inspect.isawaitable(taken):
            try:
                await taken
            finally:  # what it held lies elsewhere now, or was refused
                self._bytes -= size
                path.unlink(missing_ok=True)
        return safe

    def without_paths(self, result: Any) -> Any:
        """A result of a job, its words as pages show them."""
        return each_text(result, self.shown, self.without_folders)

    def make_room(self, count: int, size: int) -> None:
        """Count files that lie in the folder of the session [bytes]. Raises RefusedError for too many."""
        if self.brought + count > MAX_FILES or self._bytes + size > MAX_BYTES:
            raise RefusedError(f"{count} files more. {self.room}")
        self._bytes += size

    @property
    def brought(self) -> int:
        """How many files the user brought."""
        return len({*self.logs} - self.made) + sum(map(self.is_editable, self.robots)) + self.others

    @property
    def room(self) -> str:
        """How many files there may be, in words."""
        count, each = f"{self.brought} of at most {MAX_FILES} files", f"{MAX_FILE_BYTES // 2**30} GiB each"
        return f"{count}, {each}.{' Remove one first.' * (self.brought >= MAX_FILES)}"

    def taker(self, kind: str) -> Callable[[str, str], object]:
        """What takes a file of a kind, by its path and the name that pages show; what is no other kind is a log."""
        return self.takers.get(kind, self.add_log)

    def shown(self, words: str) -> str:
        """Words as pages have them, without folders."""
        return in_page_names(self.without_folders(words))

    def without_folders(self, words: str) -> str:
        """Words without folders of uploads, of results, and of files that the command line named."""
        return without_folders(words, self.folder, [log.path for log in self.logs.values()] + [*self.robots.values()])

    def remove(self, log: LogFile) -> None:
        """Take a log away; one that was uploaded is deleted when something else is removed, and can be brought back."""
        if self.logs.pop(log.key, None) is None:  # by another click already
            return

        def restore() -> None:
            self.logs[log.key] = log

        def discard() -> None:
            path = Path(log.path)
            if self.folder in path.parents:
                self._bytes -= path.stat().st_size if path.exists() else 0
                path.unlink(missing_ok=True)

        self._remove(Removed(log.label, restore, discard))

    def _remove(self, removed: Removed) -> None:
        self._forget_removed()
        self.removed = removed
        self.changed(LOGS, ROBOT, FIT)

    def _forget_removed(self) -> None:
        """Delete the file of what was removed last: it cannot come back any more."""
        removed, self.removed = self.removed, None
        if removed is not None:
            removed.discard()

    def undo(self) -> None:
        """Bring back what was removed last."""
        removed, self.removed = self.removed, None
        if removed is not None:
            removed.restore()
            self.changed(LOGS, ROBOT, FIT)

    async def example(self) -> str:
        """A simulated log to begin with; an error in words, or ""."""
        path = self.new_folder() / "example.csv"
        try:
            await self.workers["log"].ask("example", {"path": str(path)})
        except (JobError, CancelledError) as error:
            return str(error)
        self.robot = self.robot or "axebot"
        self.made.add(self.add_log(str(path), path.name).key)
        self.changed(LOGS, ROBOT)
        return ""

    async def check(self, log: LogFile) -> None:
        """Read and check a log again."""
        log.version += 1
        version = log.version
        folder = self.new_folder() / "series"
        log.error, log.ended, log.result, log.progress = "", False, None, str(Report(f"reading {log.label}"))
        self.changed(LOGS, FIT)

        def listen(kind: str, value: Any) -> None:
            log.progress = value["text"]
            if value.get("drawn"):
                self._take_series(log, folder)
            self.changed(PROGRESS)

        request = {**log.request, "robot": self.robot_path, "folder": str(folder)}
        try:
            result = await self.workers["log"].run("check", request, listen)
        except JobError as error:
            result, log.error, log.ended = None, self.shown(str(error)), isinstance(error, EndedError)
        except CancelledError as error:
            result, log.error, log.ended = None, str(error), True
        if version == log.version:
            log.result, log.progress = self.without_paths(result), ""
            self.changed(LOGS, FIT)

    def _take_series(self, log: LogFile, folder: Path) -> None:
        self.series.pop(log.series, None)
        if (folder / META).exists():
            log.series = f"{log.key}-{log.version}"
            self.series[log.series] = Series(folder)
            self.changed(LOGS)

    async def map_columns(self, log: LogFile, rows: list[dict[str, Any]]) -> str:
        """Read a log by a table of columns; an error in words, or ""."""
        path = self.new_folder() / "columns.toml"
        try:
            await self.workers["log"].ask("save_columns", {"rows": rows, "path": str(path)})
        except (JobError, CancelledError) as error:
            return str(error)
        log.map = str(path)
        await self.check(log)
        return ""

    async def remedy(self, log: LogFile, remedy: dict[str, Any]) -> None:
        """Read a log as the remedy of a finding says: with a map, or with currents that get a sign."""
        if remedy["map"]:
            path = self.new_folder() / "columns.toml"
            path.write_text(remedy["map"], "utf-8")
            log.map = str(path)
        log.unsigned = log.unsigned or remedy["unsigned"]
        await self.check(log)

    async def align(self, log: LogFile) -> None:
        """Put the other log on the clock of a log, by what both recorded."""
        request = {"robot": self.robot_path, "logs": [one.request for one in (log, self.logs[log.other])]}
        try:
            aligned = self.without_paths(await self.workers["log"].ask("align", request))
        except (JobError, CancelledError) as error:
            aligned = {"severity": "error", "verdict": self.shown(str(error))}
        log.aligned, log.offset = aligned, float(aligned.get("offset", log.offset))
        self.changed(LOGS)

    async def warm(self) -> None:
        """Load what the first log and the first fit need, while nobody waits for it."""
        await self.workers["log"].start()
        with contextlib.suppress(CancelledError, JobError):
            done = await self.workers["fit"].run("warm", {"all": False}, lambda kind, value: None)
            if not done["is_warm"]:
                await self.workers["fit"].start()  # after a fit that came in between
                await self.workers["warm"].run("warm", {"all": True}, lambda kind, value: None)
                await self.workers["warm"].stop()

    # Robot

    @property
    def robot_path(self) -> str:
        """The preset or the path of the robot; "" for none."""
        return self.robots.get(self.robot, "")

    def is_file(self, name: str) -> bool:
        """Whether a robot is a file, not a preset."""
        return self.robots.get(name, name) not in self.presets

    def is_editable(self, name: str) -> bool:
        """Whether an edit may take the place of a robot: no preset, no fit."""
        return self.is_file(name) and name not in self.made

    def robot_text(self, name: str) -> str:
        """The file of a robot."""
        return Path(robot_path(self.robots[name])).read_text("utf-8", "replace")

    def add_robot(self, path: str, name: str) -> None:
        """Take a robot file, and choose it; logs are checked with it, also where one of this name was chosen before."""
        name = self.free_name(name) if name in self.made else name
        self.robots[name], self.robot = path, ""
        self.choose(name)

    async def take_robot(self, path: str, name: str, *, choose: bool = True) -> None:
        """Take a copy of a robot file that was dropped. Raises InputError for what is none."""
        try:
            await self.workers["log"].ask("check_robot", {"path": path})
        except (JobError, CancelledError) as error:
            raise InputError(self.shown(str(error).removeprefix(f"{path}: "))) from None
        kept = shutil.copyfile(path, self.new_folder() / name)
        self._bytes += kept.stat().st_size
        if choose:
            self.add_robot(str(kept), name)
        else:
            self.robots[self.free_name(name)] = str(kept)
            self.changed(ROBOT)

    async def keep_robot(self, text: str, name: str, of: str) -> str:
        """Keep a text as a robot file; an error in words, or "". of: the robot it was made of, which gets this name."""
        name = f"{safe_name(name.removesuffix(ROBOT_SUFFIX))}{ROBOT_SUFFIX}"
        if (name != of or of in self.made) and name in self.robots:
            return str(InputError("there is a robot of this name", got=name, remedy="use another name"))
        path = self.new_folder() / name
        path.write_text(text, "utf-8")
        try:
            await self.take_robot(str(path), name)
        except InputError as error:
            return str(error)
        if name != of and self.is_editable(of):
            self.robots.pop(of)
            self.changed(ROBOT)
        return ""

    def remove_robot(self, name: str) -> None:
        """Take a robot file away; it can be brought back."""
        if name not in self.robots:  # by another click already
            return
        path, chosen = self.robots.pop(name), self.robot == name
        self.robot = self.robot * (not chosen)

        def restore() -> None:
            self.robots[back := self.free_name(name) if name in self.robots else name] = path
            self.robot = back if chosen and not self.robot else self.robot

        self._remove(Removed(name, restore, lambda: None))

    def free_name(self, name: str) -> str:
        """The name, or the next one that no robot has yet, and no fit had: it may come back."""
        stem, _, suffix = name.rpartition(".")
        others = (f"{stem}-{k}.{suffix}" for k in itertools.count(2))
        return next(free for free in itertools.chain((name,), others) if free not in (self.robots.keys() | self.made))

    def choose(self, name: str) -> None:
        """Choose a robot; logs are checked with it."""
        if name in self.robots and name != self.robot:
            self.robot = name
            for log in self.logs.values():
                self.start(self.check(log))
            self.changed(ROBOT, FIT)
