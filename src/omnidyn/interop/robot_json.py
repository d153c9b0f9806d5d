"""import json: the robot that `omnidyn export json` wrote, equal to the last bit."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from omnidyn.errors import InputError
from omnidyn.export.robot_json import FORMAT, VERSION
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import robot_from_dict

KEYS = {"format", "version", "robot", "covariance"}


def robot_of_json(text: str, where: str = "robot.json") -> Robot:
    """The robot of a file that `export json` wrote.

    The covariance is not read: it is what std and correlation of the robot say already. Raises InputError for another
    file, a newer version, numbers that are not finite, and whatever a robot file may not hold.
    """
    document = _parsed(text, where)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(
            "not a robot exported by omnidyn",
            got="another JSON document",
            expected=f'"format": "{FORMAT}"',
            remedy="write it with: omnidyn export json ROBOT",
            where=where,
        )
    version = document.get("version")
    if type(version) is not int or version != VERSION:
        raise InputError(
            "unknown version of the format",
            got=version,
            expected=str(VERSION),
            remedy="read it with the omnidyn that wrote it, or a later one",
            where=where,
        )
    unknown = sorted(set(document) - KEYS)
    if unknown or not isinstance(document.get("robot"), dict):
        raise InputError(
            "not the schema of an exported robot",
            got=", ".join(unknown) or "no robot",
            expected="format, version, robot, covariance",
            where=where,
        )
    try:
        return robot_from_dict(document["robot"])
    except InputError as error:
        raise error.at(where) from None
    except RecursionError:
        raise _nested(where) from None


def _parsed(text: str, where: str) -> Any:
    """The document of a JSON text. Raises InputError for none, for NaN and for a key that stands twice."""

    def refuse(word: str) -> NoReturn:
        raise InputError("not a finite number", got=word, expected="a number", where=where)

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(pairs)
        if len(table) < len(pairs):
            keys = set[str]()
            twice = next(key for key, _ in pairs if key in keys or keys.add(key))
            raise InputError("a key stands twice", got=twice, expected="once", where=where)
        return table

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=once)
    except RecursionError:
        raise _nested(where) from None
    except ValueError as error:  # JSONDecodeError, or an integer of thousands of digits
        raise InputError("not valid JSON", got=str(error), remedy="export it again", where=where) from None


def _nested(where: str) -> InputError:
    return InputError("nested too deeply", expected="the schema of an exported robot", where=where)
