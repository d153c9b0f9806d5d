"""Struct values of WPILib: their schemas, which the log carries as text, and where their numbers lie.

A schema is "double x;double y" or "Translation2d translation;Rotation2d rotation"; packed, little endian.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from omnidyn.logs.readers.ros.layout import Leaf

MAX_DEPTH, MAX_LEAVES, MAX_SCHEMA, MAX_DIGITS = 8, 500, 65536, 4
CODES = {
    "bool": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_FIELD = re.compile(r"(?:enum\s*)?(?:\{[^}]*\}\s*)?([\w:]+)\s+(\w+)\s*(?:\[(\d+)\])?", re.ASCII)

# The usual ones, for logs that lost their schemas. Facts of WPILib.
KNOWN_SCHEMAS = {
    "Translation2d": "double x;double y",
    "Rotation2d": "double value",
    "Pose2d": "Translation2d translation;Rotation2d rotation",
    "Twist2d": "double dx;double dy;double dtheta",
    "ChassisSpeeds": "double vx;double vy;double omega",
}


class BadSchemaError(ValueError):
    """A schema that cannot be read, with the reason."""


def leaves_of(name: str, schemas: Mapping[str, str]) -> tuple[dict[str, Leaf], int]:
    """(path of each number -> where it lies, size of the whole [bytes]). Raises BadSchemaError."""
    leaves: dict[str, Leaf] = {}
    return leaves, _walk(name, schemas, "", 0, leaves, 0)


def _walk(name: str, schemas: Mapping[str, str], path: str, at: int, leaves: dict[str, Leaf], depth: int) -> int:
    text = schemas.get(name, KNOWN_SCHEMAS.get(name))
    if text is None or len(text) > MAX_SCHEMA or depth > MAX_DEPTH:
        raise BadSchemaError(f"no schema of {name}" if text is None else f"the schema of {name} does not end")
    for declaration in filter(None, (part.strip() for part in text.split(";"))):
        match = _FIELD.fullmatch(declaration)
        if match is None:  # a bit field, and what else there may be
            raise BadSchemaError(f"{declaration[:40]} in {name}")
        kind, field, count = match[1], match[2], match[3]
        if len(count or "") > MAX_DIGITS:
            raise BadSchemaError(f"an array of more than {MAX_LEAVES} in {name}")
        for k in range(int(count or 1)):
            leaf_path = f"{path}{field}{f'[{k}]' if count else ''}"
            if len(leaves) >= MAX_LEAVES:
                raise BadSchemaError(f"more than {MAX_LEAVES} numbers in {name}")
            if kind in CODES:
                leaves[leaf_path] = Leaf(at, f"<{CODES[kind]}")
                at += int(CODES[kind][1])
            else:
                at = _walk(kind, schemas, f"{leaf_path}/", at, leaves, depth + 1)
    return at
