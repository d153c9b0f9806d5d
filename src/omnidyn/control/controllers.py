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
from omnidyn.errors import InputError, did_you_mean
from omnidyn.files import parse_toml, read_text, write_atomic
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import toml_literal

SCHEMA = 1
POLICY, POLICY_SUFFIX = "policy", ".npz"
# Name -> where its class is defined. Its arguments are the robot, then options by name.
NAMES = {
    "feedforward": "omnidyn.control.feedforward:Feedforward",
    "speed": "omnidyn.control.speed_loop:SpeedController",
    "pid": "omnidyn.control.pid:Pid",
    "mpc": "omnidyn.control.mpc.controller:Mpc",
}
# The same, of those that need a file beside a robot.
UNLISTED_NAMES = {POLICY: "omnidyn.control.policy:Policy"}
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
        kind, names = controller_class(self.controller), options_of(self.controller)
        arguments = {**{key: value for key, value in options.items() if key in names}, **self.options}
        settings_type = settings_of(kind)
        if settings_type is None:
            return kind(robot, **arguments)
        settings = {spec.name: arguments.pop(spec.name) for spec in fields(settings_type) if spec.name in arguments}
        return kind(
            robot, settings=settings_type(**{key: _tuple(value) for key, value in settings.items()}), **arguments
        )

    def to_toml(self) -> str:
        """The text of its file."""
        head = {"schema": SCHEMA, "controller": self.controller, "source": self.source}
        lines = [[f"{key} = {toml_literal(value)}" for key, value in table.items()] for table in (head, self.options)]
        return "\n".join([*lines[0], "", "[options]", *lines[1], ""])


def controller_class(name: str) -> type[Any]:
    """The class of a controller. Raises InputError for a name that none has."""
    places = NAMES | UNLISTED_NAMES
    if name not in places:
        raise InputError(
            "unknown controller",
            got=name,
            expected=f"{', '.join(places)}, or a controller file (.toml, .npz)",
            remedy=did_you_mean(name, places),
            where="controller",
        )
    module, _, class_name = places[name].partition(":")
    return getattr(importlib.import_module(module), class_name)


def options_of(name: str) -> dict[str, Any]:
    """What a controller can be told beside its robot -> what it is by default; the fields of its settings too."""
    kind = controller_class(name)
    parameters = inspect.signature(kind.__init__).parameters.values()
    defaults = {
        parameter.name: parameter.default
        for parameter in parameters
        if parameter.kind == inspect.Parameter.KEYWORD_ONLY
    }
    settings_type = settings_of(kind)
    if settings_type is not None:
        defaults |= {spec.name: spec.default for spec in fields(settings_type)}
        del defaults[SETTINGS]
    return defaults


def settings_of(kind: type[Any]) -> type[Any] | None:
    """The value type that a controller takes as `settings`, where it does."""
    hint = get_type_hints(kind.__init__).get(SETTINGS)
    return next(
        (candidate for candidate in (hint, *get_args(hint)) if isinstance(candidate, type) and is_dataclass(candidate)),
        None,
    )


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Raises InputError for an option that the controller does not have, or a value of another kind."""
    names = [key for key in options_of(name) if key not in OF_THE_CALL]
    for key, value in options.items():
        if key not in names:
            raise unknown_option(name, key, names, f"options.{key}")
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
        return len(value) <= LONGEST_LIST and all(_plain(item) and not isinstance(item, list | tuple) for item in value)
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
    name are told apart by their files, else by a number. Raises InputError where no controller has an option given.
    """
    specs = [_spec(name, no_friction, no_observer) for name in names]
    keys = [*(key for key in options if key not in OF_THE_CALL), *(["observer"] if no_observer else [])]
    for key in keys:
        if not any(key in options_of(spec.controller) for spec in specs):
            raise InputError(
                "none of these controllers has that",
                got=", ".join(names),
                expected=f"one with the option {key}",
                where=f"no_{key}" if key == "observer" else key,
            )
    return told_apart([spec.make(robot, **options) for spec in specs], names)


def told_apart(controllers: list[Controller], sources: Sequence[Any]) -> list[Controller]:
    """The controllers, those of one name told apart by the file they come from, else by a number.

    sources: what each was made of, a name or a path of a file among them.
    """
    names = [controller.name for controller in controllers]
    paths = [os.fspath(source) if isinstance(source, str | os.PathLike) else "" for source in sources]
    paths = [path if path.endswith((".toml", POLICY_SUFFIX)) else "" for path in paths]
    short = [os.path.basename(path) for path in paths]
    taken = list[str]()
    for k, controller in enumerate(controllers):
        if controller in controllers[:k]:
            continue
        name = names[k]
        if paths[k] and names.count(name) > 1:
            name = paths[k] if len({path for path in paths if os.path.basename(path) == short[k]}) > 1 else short[k]
        before = sum(other.partition(" ")[0] == name for other in taken)
        taken.append(f"{name} {before + 1}" if before else name)
        controller.name = taken[-1]  # pyright: ignore[reportAttributeAccessIssue]
    return controllers


def _spec(text: str, no_friction: bool, no_observer: bool) -> ControllerFile:
    """A controller by name or file, without what it shall do without."""
    name, without = text, set[str]()
    for key in ("friction", "observer"):
        if not text.endswith((".toml", POLICY_SUFFIX)) and name.endswith(f"_no_{key}"):
            name, without = name.removesuffix(f"_no_{key}"), without | {key}
    spec = load_controller(text) if text.endswith((".toml", POLICY_SUFFIX)) else ControllerFile(name)
    if no_friction or "friction" in without:
        without |= {"friction", "observer"}
    if no_observer:
        without.add("observer")
    names = options_of(spec.controller)
    return replace(spec, options={**spec.options, **{key: False for key in sorted(without) if key in names}})


def load_controller(path: str | os.PathLike) -> ControllerFile:
    """Read a controller file, or a trained policy (.npz). Raises InputError, with the nearest key for one unknown."""
    file_name = os.fspath(path)
    if file_name.endswith(POLICY_SUFFIX):
        from omnidyn.control.policy import load_policy  # as every controller: imported where it is needed

        load_policy(file_name)  # says now what is wrong with it
        return ControllerFile(POLICY, {POLICY: file_name}, "trained")
    table = parse_toml(read_text(path), file_name)
    keys = ("schema", "controller", "source", "options")
    for key in table:
        if key not in keys:
            raise InputError(
                "unknown key",
                got=key,
                expected=", ".join(keys),
                remedy=did_you_mean(key, keys),
                where=file_name,
            )
    if table.get("schema") != SCHEMA:
        raise InputError(
            "not a controller file",
            got=f"schema = {table.get('schema')}",
            expected=f"schema = {SCHEMA}",
            where=file_name,
        )
    name, options, source = table.get("controller"), table.get("options", {}), table.get("source", "")
    if not isinstance(name, str) or not isinstance(options, dict) or not isinstance(source, str):
        raise InputError(
            "not a controller file",
            got="controller, options or source of another kind",
            expected='controller = "name", source = "words", and a table [options]',
            where=file_name,
        )
    try:
        return ControllerFile(name, options, source)
    except InputError as error:
        raise error.at(file_name) from None


def save_controller(spec: ControllerFile, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a controller file. Raises InputError where it exists, unless `force`."""
    return write_atomic(path, spec.to_toml(), force)
