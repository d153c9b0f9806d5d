"""json: the robot itself, with the covariance of its numbers. `omnidyn import json` gives the same robot back.

The tree under "robot" is that of the robot file (docs/robot-file.md); docs/robot-export-1.schema.json is its schema.
The covariance is the same knowledge once more, for who has no omnidyn: std and correlation multiplied out.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from pydantic import BaseModel

from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.files import parse_toml
from omnidyn.model.keys import TABLES, unit
from omnidyn.model.known.told import uncertainty_of
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import robot_to_toml
from omnidyn.model.value import keys_of

FORMAT, VERSION = "omnidyn robot", 1
SCHEMA_FILE = f"robot-export-{VERSION}.schema.json"


def robot_json(robot: Robot) -> Export:
    """The robot as JSON: the tree of its file, and the covariance of the numbers that have a std."""
    refuse("json", robot)
    uncertain = uncertainty_of(robot)
    covariance = uncertain.std[:, None] * uncertain.correlation * uncertain.std[None, :]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "robot": parse_toml(robot_to_toml(robot), robot.name),
        "covariance": {
            "keys": list(uncertain.keys),
            "units": [unit(key) for key in uncertain.keys],
            "matrix": np.asarray(covariance).reshape(len(uncertain.keys), len(uncertain.keys)).tolist(),
        },
    }
    text = json.dumps(document, indent=1, ensure_ascii=True, allow_nan=False) + "\n"
    return Export("json", robot.name, {"robot.json": text}, left_out("json", robot))


def json_schema() -> dict[str, Any]:
    """The schema of the file (JSON Schema 2020-12), from the fields of the model."""
    uncertain_schema = {
        "type": "object",
        "required": ["value"],
        "additionalProperties": False,
        "properties": {
            "value": {"type": ["number", "array", "string", "boolean"]},
            "std": {"type": "number", "exclusiveMinimum": 0},
            "source": {"type": "string"},
            "origin": {"enum": ["guess", "joint", "given", "datasheet", "measured", "identified", "imported"]},
        },
    }
    entry = {"anyOf": [{"type": ["number", "string", "boolean"]}, {"$ref": "#/$defs/known"}]}
    point = {"type": "array", "items": {"type": "number"}}
    value = {"anyOf": [entry, {"type": "array", "items": {"anyOf": [entry, point]}}]}
    tables = {name: _table_schema(Robot, name) for name in TABLES}
    matrix = {"type": "array", "items": {"type": "array", "items": {"type": "number"}}}
    texts = {"type": "array", "items": {"type": "string"}}
    together = {
        "type": "object",
        "required": ["keys", "matrix"],
        "additionalProperties": False,
        "properties": {"keys": texts, "matrix": matrix, "std": {"type": "array", "items": {"type": "number"}}},
    }
    robot = {
        "type": "object",
        "required": ["schema", "name", "body", "wheels", "motor"],
        "additionalProperties": False,
        "properties": {
            "schema": {"const": 1},
            "name": {"type": "string", "minLength": 1},
            "source": {"type": "string"},
            **tables,
            "correlation": together,
            "log": {"type": "object"},
            "variations": {"type": "object"},
        },
    }
    covariance = {
        "type": "object",
        "required": ["keys", "units", "matrix"],
        "additionalProperties": False,
        "properties": {"keys": texts, "units": texts, "matrix": matrix},
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A robot, as omnidyn exports it",
        "type": "object",
        "required": ["format", "version", "robot", "covariance"],
        "additionalProperties": False,
        "properties": {
            "format": {"const": FORMAT},
            "version": {"const": VERSION},
            "robot": robot,
            "covariance": covariance,
        },
        "$defs": {"known": uncertain_schema, "value": value},
    }


def _table_schema(model: type[BaseModel], name: str) -> dict[str, Any]:
    """The schema of one table of the robot file: its keys, and the tables in it."""
    inner = model.model_fields[name].annotation
    assert isinstance(inner, type)
    assert issubclass(inner, BaseModel)
    properties: dict[str, Any] = {}
    for key, field in keys_of(inner, []).items():
        field_info = inner.model_fields[field]
        if isinstance(field_info.annotation, type) and issubclass(field_info.annotation, BaseModel):
            properties[key] = _table_schema(inner, field)
        else:
            properties[key] = {"$ref": "#/$defs/value"} | (
                {"description": field_info.description} if field_info.description else {}
            )
    return {"type": "object", "additionalProperties": False, "properties": properties}
