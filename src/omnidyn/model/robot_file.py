"""Robot files: TOML in and out, and the presets that come with omnidyn."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from omnidyn.arguments import check_order
from omnidyn.errors import InputError
from omnidyn.files import MAX_TOML_BYTES, parse_toml, read_text, write_atomic
from omnidyn.model.first_guess import with_spread
from omnidyn.model.keys import TABLES, is_told
from omnidyn.model.known.told import correlation_of, refuse_strange_keys
from omnidyn.model.presets import PRESETS as PRESETS
from omnidyn.model.presets import preset_names as preset_names
from omnidyn.model.presets import robot_path
from omnidyn.model.robot import GIVEN, GUESS, IDENTIFIED, JOINT, SCHEMA, WITH_THE_FIT, Origin, Prior, Robot
from omnidyn.model.value import from_validation, key_path, keys_of, table_at

TOGETHER = "correlation"


def load_robot(robot: str | os.PathLike) -> Robot:
    """A robot by the name of a preset, such as "axebot", or by the path of its TOML file.

    Raises InputError when there is no such preset or file, or when the file breaks the schema (the path of the key,
    what was got, what is expected).
    """
    name = os.fspath(robot)
    if not isinstance(name, str):
        raise InputError("not a robot", got=robot, expected="the name of a preset or the path of a TOML file")
    return parse_robot(read_text(robot_path(name), MAX_TOML_BYTES), name)


def parse_robot(text: str, where: str = "robot") -> Robot:
    """A robot from the text of a robot file; `where` names it in messages."""
    document = parse_toml(text, where)
    try:
        return robot_from_dict(document)
    except InputError as error:
        raise error.at(where) from None
    except RecursionError:
        raise InputError("tables nested too deeply", expected="the schema of a robot file", where=where) from None


def robot_from_dict(document: dict[str, Any]) -> Robot:
    """A robot from the content of a robot file as nested dictionaries; schema in the documentation."""
    document = dict(document)
    schema = document.pop("schema", None)
    if type(schema) is not int or schema != SCHEMA:
        raise InputError(
            "unknown schema",
            got=schema if schema is not None else "none",
            expected=f"schema = {SCHEMA}",
            where="schema",
        )
    priors: dict[str, Prior] = {}
    plain = _without_priors(document, (), priors)
    if "priors" in plain:  # a field of Robot, not a key of the file
        raise InputError("unknown key", got="priors", expected="{ value, std, source, origin } at the number itself")
    try:
        robot = Robot.model_validate({**plain, "priors": priors}, by_alias=True, by_name=False)
    except ValidationError as error:
        raise from_validation(error, Robot) from None
    refuse_strange_keys(robot)
    return with_spread(robot)


def _without_priors(node: Any, path: tuple[str | int, ...], priors: dict[str, Prior]) -> Any:
    """The same tree with every { value, std, source, origin } replaced by its value; its rest goes to `priors`."""
    known_of = isinstance(node, dict) and "value" in node and table_at(Robot, path) is None
    if known_of and path[0] != TOGETHER:  # nothing is known of a correlation
        fields = {key: value for key, value in node.items() if key != "value"}
        try:
            prior = Prior(**{"origin": _origin_in(fields.get("source")), **fields})
        except InputError as error:
            raise error.at(key_path(path)) from None
        joint = prior.guessed and prior.source.startswith(WITH_THE_FIT)  # as files say it from before "joint"
        priors[_dotted(path)] = prior.replace(origin=JOINT) if joint else prior
        return node["value"]
    if isinstance(node, dict):
        return {key: _without_priors(value, (*path, key), priors) for key, value in node.items()}
    if isinstance(node, list):
        return [_without_priors(value, (*path, index), priors) for index, value in enumerate(node)]
    return node


def _origin_in(source: Any) -> Origin:
    """What the words of a source say in a file that gives no origin, as none did before there were origins."""
    words = source if isinstance(source, str) else ""
    for origin in (GUESS, IDENTIFIED):
        if words == origin or words.startswith(f"{origin}:"):
            return origin
    return GIVEN


def _dotted(path: tuple[str | int, ...]) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def save_robot(robot: Robot, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a robot file. Raises InputError when it exists (unless `force`) or cannot be written."""
    check_order("save_robot(robot, path)", (robot, Robot), (path, (str, os.PathLike)))
    return write_atomic(path, robot_to_toml(robot), force)


def robot_to_toml(robot: Robot) -> str:
    """The robot as the text of a robot file; `parse_robot` gives the same robot back, to the last bit.

    A guess without a std gets one, see `with_spread`.
    """
    head = [f"schema = {SCHEMA}", f"name = {toml_literal(robot.name)}"]
    if robot.source:
        head.append(f"source = {toml_literal(robot.source)}")
    tables = [_table(name, getattr(robot, name), robot.priors) for name in TABLES]
    tables += [_of_sensors(robot), _by_name(robot), _of_logs(robot), _together(robot)]
    return "\n".join(head) + "\n" + "".join(tables)


def _table(name: str, value: BaseModel, priors: dict[str, Prior]) -> str:
    """One table of the file, its sub-tables after it; what equals its default and has no prior is left out."""
    lines, inner = [], ""
    for key, field in keys_of(type(value), []).items():
        content = getattr(value, field)
        path, default = f"{name}.{key}", type(value).model_fields[field].default
        if content == default and not is_told(path, priors) and field != "rotating_frame":
            continue
        if isinstance(content, BaseModel):
            inner += _table(path, content, priors)
        else:
            note = type(value).model_fields[field].description
            lines.append(f"{key} = {_with_prior(content, path, priors)}" + (f"  # {note}" if note else ""))
    return ("\n[" + name + "]\n" + "\n".join(lines) + "\n" if lines else "") + inner


def _by_name(robot: Robot) -> str:
    """The tables of what the robot can be varied by."""
    variations = robot.variations
    tables = (
        (f"variations.{kind}.{name}", getattr(variations, kind)[name])
        for kind in variations.names
        for name in variations.names[kind]
    )
    return "".join(_table(path, value, robot.priors) or f"\n[{path}]\n" for path, value in tables)


def _of_sensors(robot: Robot) -> str:
    """The table of its sensors; one that says nothing is kept, for it goes before what a fit found."""
    return "" if robot.sensors is None else _table("sensors", robot.sensors, {}) or "\n[sensors]\n"


def _of_logs(robot: Robot) -> str:
    """The table of what the logs of a fit did beside the robot."""
    return "" if robot.log is None else _table("log", robot.log, {})


def _together(robot: Robot) -> str:
    """The table of correlations, of the numbers that the robot has; a key and a row each on a line of its own."""
    correlation = correlation_of(robot)
    if correlation is None:
        return ""
    keys = "".join(f"  {toml_literal(key)},\n" for key in correlation.keys)
    rows = "".join(f"  {toml_literal(row)},\n" for row in correlation.matrix)
    std = "" if correlation.std is None else f"std = {toml_literal(correlation.std)}  # of the fit\n"
    return f"\n[correlation]  # which numbers are off together\nkeys = [\n{keys}]\nmatrix = [\n{rows}]\n{std}"


def _with_prior(content: Any, path: str, priors: dict[str, Prior]) -> str:
    if isinstance(content, tuple) and path not in priors:
        return "[" + ", ".join(_with_prior(item, f"{path}[{i}]", priors) for i, item in enumerate(content)) + "]"
    if path not in priors:
        return toml_literal(content)
    prior = priors[path]
    parts = [f"value = {toml_literal(content)}"]
    if prior.std is not None:
        parts.append(f"std = {toml_literal(prior.std)}")
    if prior.source:
        parts.append(f"source = {toml_literal(prior.source)}")
    parts.append(f"origin = {toml_literal(prior.origin)}")
    return "{ " + ", ".join(parts) + " }"


def toml_literal(value: Any) -> str:
    """A TOML literal. Floats keep every bit; JSON's string escapes are a subset of TOML's."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(toml_literal, value)) + "]"
    if isinstance(value, str):  # half of a surrogate pair is no character, and no TOML has a word for it
        value = value.encode("utf-8", "backslashreplace").decode("utf-8")
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
