"""The state of the tab Fit, which all pages share, and what its buttons do."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from omnidyn.model.robot_file import toml_literal
from omnidyn.studio import calls
from omnidyn.studio.calls import MAX_NAME, LogFile, safe_name
from omnidyn.studio.parts import FIT, FITTED, FREE, HELD_OUT, LEFT_OUT, ROBOT, ROBOT_FILE
from omnidyn.studio.robot.rename import rename_robot
from omnidyn.studio.session import ROBOT_SUFFIX, Session
from omnidyn.studio.task import Task
from omnidyn.studio.worker import CancelledError, JobError

MAX_NOTE, MAX_GROUP = 500, 40  # characters
NAME = re.compile(r"^name = .*$", re.MULTILINE)
NOT_IN_GROUPS = re.compile(r"[^\w .-]+")  # of the name of a group, which stands in commands and names of files


@dataclass(frozen=True)
class Recipe:
    """What a fit was made of: logs as they were read then, those held out, the robot's name and file, what was free.

    groups: key of a log -> its group; empty where there are none.
    """

    logs: tuple[LogFile, ...]
    held_out: tuple[LogFile, ...]
    robot: str
    path: str
    free: tuple[str, ...]
    groups: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Kept:
    """A robot of the history. fit: that gave it. file: of the robot, in the folder of the fit. group: whose it is.

    note: of a user. recipe: None for a fit that was opened with a workspace.
    """

    fit: Task
    file: str = ROBOT_FILE
    group: str = ""
    note: str = ""
    recipe: Recipe | None = None


class Fitting:
    """The fit that is shown, and the history: all that gave a robot, by the name of its file."""

    def __init__(self, session: Session) -> None:
        self.session, self.last = session, Task()
        self.fits: dict[str, Kept] = {}
        self._held_out, self._left_out, self._groups = list[str](), list[str](), dict[str, str]()
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

    def group_of(self, key: str) -> str:
        """The group of a log, "" for none."""
        return self._groups.get(key, "")

    def name_group(self, key: str, name: str) -> None:
        """Let a log be of a group, "" for none: logs of a group share their friction, such as those of one floor."""
        self._groups[key] = NOT_IN_GROUPS.sub("", name)[:MAX_GROUP].strip()
        self.session.changed(FIT)

    @property
    def groups(self) -> dict[str, str]:
        """Key of each log that is fitted or predicted -> its group; empty where no log has one."""
        groups = {log.key: self.group_of(log.key) for log in self.logs}
        return groups if any(groups.values()) else {}

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
        if len(self.held_out) == len(self.logs):
            return "all_held_out", ""
        return self._why_no_groups()

    def _why_no_groups(self) -> tuple[str, str]:
        """What keeps from a fit of these groups, as `why_not` has it."""
        groups, held_out = self.groups, self.held_out
        if without := [key for key, group in groups.items() if not group]:
            return "no_group", self.session.logs[without[0]].label
        fitted = {group for key, group in groups.items() if key not in held_out}
        if len(fitted) == 1:
            return "one_group", ""
        return ("group_held_out", "") if {*groups.values()} - fitted else ("", "")

    async def run(self, added: str = "") -> None:
        """Fit the robot to the logs. added: a number that is free beside the others."""
        if self.last.running or self.why_not()[0]:
            return
        if added and added not in self.free:
            self.free.append(added)
            if all(key != added for key, _ in self.choices["others"]):
                self.choices["others"].append([added, added])
            self.session.changed(FREE)
        free, groups = self.free_keys, self.groups
        logs, held_out = self.logs, [self.session.logs[key] for key in self.held_out]
        command, python = calls.fit(logs, held_out, self.session.robot_path, free, groups)
        recipe = Recipe(
            tuple(replace(log) for log in logs),
            tuple(replace(log) for log in held_out),
            self.session.robot,
            self.session.robot_path,
            free,
            groups,
        )
        took = self.last.spent if self.last.result is not None else self.last.before
        self.last = fit = Task(command=command, python=python, before=took or None)
        request = {
            "robot": self.session.robot_path,
            "logs": [log.request for log in logs],
            "hold_out": [log.request["name"] for log in held_out],
            "free": free,
            "groups": [*groups.values()],
            "promises": next((self.session.promises[log.key] for log in logs if log.key in self.session.promises), {}),
            "command": command,
        }
        self.session.workers["fit"].command("fit")  # what warms up makes way
        await fit.run(self.session, FIT, "fit", "fit", request)
        if fit.result is not None:
            self.keep(fit, recipe=recipe)

    def keep(self, fit: Task, name: str = "", recipe: Recipe | None = None) -> list[str]:
        """Let all tabs take the robots of a fit, one for each group, under this name or the next free ones."""
        count = len({id(kept.fit) for kept in self.fits.values()})
        stem, names = (name or f"fit-{count + 1}").removesuffix(ROBOT_SUFFIX), []
        for group, file in ((fit.result or {}).get("robots") or {"": ROBOT_FILE}).items():
            name = self.session.free_name(safe_name(f"{stem}{'-' * bool(group)}{group}{ROBOT_SUFFIX}"))
            self.fits[name] = kept = Kept(fit, file, group, recipe=recipe)
            path = self.session.new_folder() / name
            _write_robot(kept, path)
            self.session.robots[name] = str(path)
            self.session.made.add(name)
            names.append(name)
        self.session.changed(ROBOT)
        return names

    def names_of(self, fit: Task) -> list[str]:
        """The names under which the robots of a fit are kept."""
        return [name for name, kept in self.history.items() if kept.fit is fit]

    @property
    def history(self) -> dict[str, Kept]:
        """All fits whose robot is there, by its name, the oldest first."""
        return {name: kept for name, kept in self.fits.items() if name in self.session.robots}

    def show(self, name: str) -> None:
        """Show a fit of the history."""
        if name in self.fits and not self.last.running:
            self.last = self.fits[name].fit
            self.session.changed(FIT)

    def note(self, name: str, text: str) -> None:
        """Keep a note to a fit."""
        self.fits[name].note = text[:MAX_NOTE]

    def rename(self, name: str, other: str) -> str:
        """Give a fit another name; an error in words, or ""."""
        words = rename_robot(self.session, name, other)
        if not words:
            new = next(reversed(self.session.robots))
            self.fits[new] = self.fits.pop(name)
            _write_robot(self.fits[new], Path(self.session.robots[new]))
            self.session.changed(FIT)
        return words

    def remove(self, name: str) -> None:
        """Take a fit and its robot away; it can be brought back."""
        self.session.remove_robot(name)


def _write_robot(kept: Kept, path: Path) -> None:
    """Write the robot of a fit, with the name of the file in its own."""
    assert kept.fit.folder is not None
    text = (kept.fit.folder / kept.file).read_text("utf-8")
    path.write_text(NAME.sub(lambda line: _named(line[0], path.stem), text, count=1), "utf-8")


def _named(line: str, stem: str) -> str:
    """The line of a robot file that names the robot: two fits of one robot are told apart by their names."""
    try:
        before = tomllib.loads(line)["name"].partition(", fit-")[0]
    except (tomllib.TOMLDecodeError, AttributeError):
        return line
    return f"name = {toml_literal(f'{before[:MAX_NAME]}, {stem}')}"
