"""Controllers by name: a table, so that a new one is one line; and as files, which `tune` writes and `track` reads.

    schema = 1
    controller = "pid"
    source = "tuned on the path eight"

    [options]
    faster = 2.4
    integral = 0.1

An option is a keyword argument of the controller; those of a file come before those of a call, `dt` and `supply` apart.
"""

from __future__ import annotations

import difflib
import importlib
import inspect
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

from omnidyn.arguments import unknown_option
from omnidyn.control.controller import Controller
from omnidyn.errors import InputError
from omnidyn.files import parse_toml, read_text, write_atomic
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import toml_literal

SCHEMA = 1
# Name -> where its class is defined. Its arguments are the robot, then options by name.
NAMES = {
    "feedforward": "omnidyn.control.feedforward:Feedforward",
    "speed": "omnidyn.control.speed_loop:SpeedController",
    "pid": "omnidyn.control.pid:Pid",
    "mpc": "omnidyn.control.mpc.controller:Mpc",
}
# The same, for comparison alone: each needs a package of its own.
BESIDE = {"araujo": "omnidyn.control.araujo:Araujo"}
OF_THE_CALL = ("dt", "supply", "delay")  # what the loop says, not the file
SETTINGS = "settings"  # an argument of some controllers: a value type, whose fields are options here
LONGEST_LIST = 16


@dataclass(frozen=True)
class ControllerFile:
    """A controller and its options, without a robot. source: where it comes from, in words."""

    controller: str
    options: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        check_options(self.controller, self.options)

    def make(self, robot: Robot, **options: Any) -> Controller:
        """The controller for a robot; what it does not know of the options is left out."""
        kind, known = controller_class(self.controller), options_of(self.controller)
        every = {**{key: value for key, value in options.items() if key in known}, **self.options}
        kept = settings_of(kind)
        if kept is None:
            return kind(robot, **every)
        own = {each.name: every.pop(each.name) for each in fields(kept) if each.name in every}
        return kind(robot, settings=kept(**{key: _tuple(value) for key, value in own.items()}), **every)

    def to_toml(self) -> str:
        """The text of its file."""
        head = {"schema": SCHEMA, "controller": self.controller, "source": self.source}
        lines = [[f"{key} = {toml_literal(value)}" for key, value in each.items()] for each in (head, self.options)]
        return "\n".join([*lines[0], "", "[options]", *lines[1], ""])


def controller_class(name: str) -> type[Any]:
    """The class of a controller. Raises InputError for a name that none has."""
    every = NAMES | BESIDE
    if name not in every:
        near = difflib.get_close_matches(name, every, 1)
        raise InputError(
            "unknown controller",
            got=name,
            expected=f"{', '.join(every)}, or a controller file (.toml)",
            remedy=f"did you mean {near[0]}?" if near else "",
            where="controller",
        )
    module, _, own = every[name].partition(":")
    return getattr(importlib.import_module(module), own)


def options_of(name: str) -> dict[str, Any]:
    """What a controller can be told beside its robot -> what it is by default; the fields of its settings too."""
    kind = controller_class(name)
    parameters = inspect.signature(kind.__init__).parameters.values()
    known = {each.name: each.default for each in parameters if each.kind == inspect.Parameter.KEYWORD_ONLY}
    kept = settings_of(kind)
    if kept is not None:
        known |= {each.name: each.default for each in fields(kept)}
        del known[SETTINGS]
    return known


def settings_of(kind: type[Any]) -> type[Any] | None:
    """The value type that a controller takes as `settings`, where it does."""
    hint = get_type_hints(kind.__init__).get(SETTINGS)
    return next((each for each in (hint, *get_args(hint)) if isinstance(each, type) and is_dataclass(each)), None)


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Raises InputError for an option that the controller does not have, or a value of another kind."""
    known = [key for key in options_of(name) if key not in OF_THE_CALL]
    for key, value in options.items():
        if key not in known:
            raise unknown_option(name, key, known, f"options.{key}")
        if not _plain(value):
            raise InputError(
                "not a value of an option",
                got=value,
                expected="a finite number, a word, true or false, or a list",
                where=f"options.{key}",
            )


def _plain(value: Any) -> bool:
    """Whether a value is a flag, a word, a finite number, or a short list of such."""
    if isinstance(value, list | tuple):
        return len(value) <= LONGEST_LIST and all(_plain(each) and not isinstance(each, list | tuple) for each in value)
    return isinstance(value, bool | str) or (isinstance(value, int | float) and math.isfinite(value))


def controller_named(what: str | os.PathLike, robot: Robot, **options: Any) -> Controller:
    """A controller by name, or from a controller file (a name that ends in .toml).

    options: what the controller does not have of them is left out; a file has its own, `dt` and `supply` apart.
    Raises InputError for an unknown name, a file that cannot be used, or an option out of range.
    """
    return controller_spec(what).make(robot, **options)


def controller_spec(what: str | os.PathLike) -> ControllerFile:
    """A controller by name or from a file, without a robot. Raises InputError as `controller_named` does."""
    return _spec(os.fspath(what), False, False)


def several(
    names: Sequence[str], robot: Robot, no_friction: bool = False, no_observer: bool = False, **options: Any
) -> list[Controller]:
    """Controllers for one robot, each by name or file; "pid_no_friction" and "mpc_no_observer" are names too.

    no_friction: none of them knows of dry friction, or has an observer; no_observer: none has an observer. Two of one
    name are told apart by a number. Raises InputError where an option given is none of any of them.
    """
    specs = [_spec(name, no_friction, no_observer) for name in names]
    wanted = [*(key for key in options if key not in OF_THE_CALL), *(["observer"] if no_observer else [])]
    for key in wanted:
        if not any(key in options_of(spec.controller) for spec in specs):
            raise InputError(
                "none of these controllers has that",
                got=", ".join(names),
                expected=f"one with the option {key}",
                where=f"no_{key}" if key == "observer" else key,
            )
    made = [spec.make(robot, **options) for spec in specs]
    for k, each in enumerate(made):
        before = sum(other.name.partition(" ")[0] == each.name for other in made[:k])
        if before:
            each.name = f"{each.name} {before + 1}"  # pyright: ignore[reportAttributeAccessIssue]
    return made


def _spec(text: str, no_friction: bool, no_observer: bool) -> ControllerFile:
    """A controller by name or file, without what it shall do without."""
    name, without = text, set[str]()
    for key in ("friction", "observer"):
        if not text.endswith(".toml") and name.endswith(f"_no_{key}"):
            name, without = name.removesuffix(f"_no_{key}"), without | {key}
    spec = load_controller(text) if text.endswith(".toml") else ControllerFile(name)
    if no_friction or "friction" in without:
        without |= {"friction", "observer"}
    if no_observer:
        without.add("observer")
    known = options_of(spec.controller)
    return replace(spec, options={**spec.options, **{key: False for key in sorted(without) if key in known}})


def load_controller(path: str | os.PathLike) -> ControllerFile:
    """Read a controller file. Raises InputError, which names the nearest key for one that is unknown."""
    where = os.fspath(path)
    table = parse_toml(read_text(path), where)
    known = ("schema", "controller", "source", "options")
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1, 0.4)
            raise InputError(
                "unknown key",
                got=key,
                expected=", ".join(known),
                remedy=f"did you mean {near[0]}?" if near else "",
                where=where,
            )
    if table.get("schema") != SCHEMA:
        raise InputError(
            "not a controller file", got=f"schema = {table.get('schema')}", expected=f"schema = {SCHEMA}", where=where
        )
    name, options, source = table.get("controller"), table.get("options", {}), table.get("source", "")
    if not isinstance(name, str) or not isinstance(options, dict) or not isinstance(source, str):
        raise InputError(
            "not a controller file",
            got="controller, options or source of another kind",
            expected='controller = "name", source = "words", and a table [options]',
            where=where,
        )
    try:
        return ControllerFile(name, options, source)
    except InputError as error:
        raise error.at(where) from None


def save_controller(spec: ControllerFile, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a controller file. Raises InputError where it exists, unless `force`."""
    return write_atomic(path, spec.to_toml(), force)
