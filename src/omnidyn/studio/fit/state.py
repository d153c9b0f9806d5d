"""The state of the tab Fit, which all pages share, and what its buttons do."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, replace
from typing import Any

from omnidyn.model.robot_file import toml_literal
from omnidyn.studio import calls
from omnidyn.studio.calls import MAX_NAME, LogFile
from omnidyn.studio.parts import FIT, FITTED, FREE, HELD_OUT, LEFT_OUT, ROBOT
from omnidyn.studio.robot.rename import rename_robot
from omnidyn.studio.session import Session
from omnidyn.studio.task import Task
from omnidyn.studio.worker import CancelledError, JobError

MAX_NOTE = 500  # characters
NAME = re.compile(r"^name = .*$", re.MULTILINE)


@dataclass(frozen=True)
class Recipe:
    """What a fit was made of: logs as they were read then, those held out, the robot's name and file, what was free."""

    logs: tuple[LogFile, ...]
    held_out: tuple[LogFile, ...]
    robot: str
    path: str
    free: tuple[str, ...]


class Fitting:
    """The fit that is shown, and the history: all that gave a robot, by the name of its file.

    notes: of a user, by the same names. recipes: of those that were made here, not opened with a workspace.
    """

    def __init__(self, session: Session) -> None:
        self.session, self.last = session, Task()
        self.fits: dict[str, Task] = {}
        self.notes: dict[str, str] = {}
        self.recipes: dict[str, Recipe] = {}
        self._held_out, self._left_out = list[str](), list[str]()
        self.choices: dict[str, Any] = {"default": [], "others": []}  # what can be free of the robot `_choices_of`
        self.free: list[str] = []
        self._choices_of = ""

    @property
    def held_out(self) -> list[str]:
        """Keys of logs that are predicted, not fitted."""
        return [log.key for log in self.logs if log.key in self._held_out]

    def hold_out(self, keys: list[str]) -> None:
        """Predict these logs, do not fit them."""
        self._held_out = keys
        self.session.changed(FIT)

    @property
    def logs(self) -> list[LogFile]:
        """The logs that are fitted or predicted."""
        return [log for key, log in self.session.logs.items() if key not in self._left_out]

    def use_of(self, key: str) -> str:
        """What a log is used for: FITTED, HELD_OUT or LEFT_OUT."""
        return LEFT_OUT if key in self._left_out else HELD_OUT if key in self._held_out else FITTED

    def use(self, key: str, use: str) -> None:
        """Use a log so."""
        if use != self.use_of(key):
            self._held_out = [*(k for k in self._held_out if k != key), *[key] * (use == HELD_OUT)]
            self._left_out = [*(k for k in self._left_out if k != key), *[key] * (use == LEFT_OUT)]
            self.session.changed(FIT)

    def want_choices(self) -> None:
        """See to it that the choices are those of the robot that is chosen."""
        if self.session.robot_path and self.session.robot_path != self._choices_of:
            self._choices_of = self.session.robot_path
            self.session.start(self._choose(self._choices_of))

    async def _choose(self, robot: str) -> None:
        try:
            choices = await self.session.workers["log"].ask("free_keys", {"robot": robot})
        except (JobError, CancelledError):
            self._choices_of = ""  # asked again with the next change; until then `identify` chooses
            return
        if robot == self._choices_of:
            self.choices, self.free = choices, [key for key, _ in choices["default"]]
            self.session.changed(FREE, FIT)

    def set_free(self, keys: list[str]) -> None:
        """Fit these numbers, in the order in which they are offered."""
        offered = [key for group in ("default", "others") for key, _ in self.choices[group]]
        if (free := sorted(keys, key=offered.index)) != self.free:
            self.free = free
            self.session.changed(FIT)

    @property
    def free_keys(self) -> tuple[str, ...]:
        """The keys that are free; () for what `identify` frees of itself."""
        return () if self.free == [key for key, _ in self.choices["default"]] else tuple(self.free)

    def why_not(self) -> tuple[str, str]:
        """What keeps from a fit: a code that the page has words for, and the library's words; ("", "") for nothing."""
        if not self.session.logs:
            return "no_log", ""
        if not self.session.robot_path:
            return "no_robot", ""
        for log in self.logs:
            if log.error:
                return "unread", f"{log.label}: {log.error}"
            if log.result is None:
                return "checking", log.label
            fit_uses = [use for use in log.result["uses"] if use["name"] in ("whole logs", "steady state")]
            if log.result["has_errors"] or not any(use["good"] for use in fit_uses):
                return "unfit", f"{log.label}: {log.result['verdict']}"
        if not self.free and self.choices["default"]:
            return "nothing_free", ""
        return ("all_held_out", "") if len(self.held_out) == len(self.logs) else ("", "")

    async def run(self, added: str = "") -> None:
        """Fit the robot to the logs. added: a number that is free beside the others."""
        if self.last.running or self.why_not()[0]:
            return
        if added and added not in self.free:
            self.free.append(added)
            if all(key != added for key, _ in self.choices["others"]):
                self.choices["others"].append([added, added])
            self.session.changed(FREE)
        free = self.free_keys
        logs, held_out = self.logs, [self.session.logs[key] for key in self.held_out]
        command, python = calls.fit(logs, held_out, self.session.robot_path, free)
        recipe = Recipe(
            tuple(replace(log) for log in logs),
            tuple(replace(log) for log in held_out),
            self.session.robot,
            self.session.robot_path,
            free,
        )
        self.last = fit = Task(command=command, python=python)
        request = {
            "robot": self.session.robot_path,
            "logs": [log.request for log in logs],
            "hold_out": [log.request["name"] for log in held_out],
            "free": free,
            "command": command,
        }
        self.session.workers["fit"].send({"command": "fit"})  # what warms up makes way
        await fit.run(self.session, FIT, "fit", "fit", request)
        if fit.result is not None:
            self.recipes[self.keep(fit)] = recipe

    def keep(self, fit: Task, name: str = "") -> str:
        """Let all tabs take the robot of a fit, under this name or the next free one, which is returned."""
        assert fit.folder is not None
        name = self.session.free_name(name or f"fit-{len(self.fits) + 1}.toml")
        path, text = fit.folder / name, (fit.folder / "robot.toml").read_text("utf-8")
        path.write_text(NAME.sub(lambda line: _named(line[0], path.stem), text, count=1), "utf-8")
        self.fits[name] = fit
        self.session.robots[name] = str(path)
        self.session.made.add(name)
        self.session.changed(ROBOT)
        return name

    def name_of(self, fit: Task) -> str:
        """The name under which a fit is kept, "" for one that is not."""
        return next((name for name, kept in self.history.items() if kept is fit), "")

    @property
    def history(self) -> dict[str, Task]:
        """All fits whose robot is there, by its name, the oldest first."""
        return {name: fit for name, fit in self.fits.items() if name in self.session.robots}

    def show(self, name: str) -> None:
        """Show a fit of the history."""
        if name in self.fits and not self.last.running:
            self.last = self.fits[name]
            self.session.changed(FIT)

    def note(self, name: str, text: str) -> None:
        """Keep a note to a fit."""
        self.notes[name] = text[:MAX_NOTE]

    def rename(self, name: str, other: str) -> str:
        """Give a fit another name; an error in words, or ""."""
        words = rename_robot(self.session, name, other)
        if not words:
            new = next(reversed(self.session.robots))
            for table in (self.fits, self.notes, self.recipes):
                if name in table:
                    table[new] = table.pop(name)  # type: ignore[assignment]
            self.session.changed(FIT)
        return words

    def remove(self, name: str) -> None:
        """Take a fit and its robot away; it can be brought back."""
        self.session.remove_robot(name)


def _named(line: str, stem: str) -> str:
    """The line of a robot file that names the robot: two fits of one robot are told apart by their names."""
    try:
        before = tomllib.loads(line)["name"].partition(", fit-")[0]
    except (tomllib.TOMLDecodeError, AttributeError):
        return line
    return f"name = {toml_literal(f'{before[:MAX_NAME]}, {stem}')}"
