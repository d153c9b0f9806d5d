"""Message definitions as bags carry them: text to fields. Nothing in them is ever run, and nothing grows by itself."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

MAX_TEXT, MAX_FIELDS = 2**20, 2000
SEQUENCE = -1  # as a length: of any

# name -> the numpy code of what lies in the message. ROS 1 calls a signed byte `byte` and an unsigned one `char`.
PRIMITIVES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "octet": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
WORDS = ("string", "wstring")
STAMPS = ("time", "duration")  # of ROS 1: secs and nsecs

_ARRAY = re.compile(r"([\w/]+)(?:<=\d+)?(\[(?:<=)?(\d{0,18})\])?", re.ASCII)
_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_RULE = re.compile(r"^={10,}\s*$", re.MULTILINE)


class Field(NamedTuple):
    """One field: `type` is a primitive, "string", or "package/Type"; `length` None, a number, or SEQUENCE."""

    name: str
    type: str
    length: int | None = None


Types = Mapping[str, tuple[Field, ...]]


class BadDefinitionError(ValueError):
    """A definition that cannot be read; the message says what stands in it."""


def plain(name: str) -> str:
    """ "sensor_msgs/JointState" of "sensor_msgs/msg/JointState"."""
    return name.replace("/msg/", "/")


def parse_definition(name: str, text: str) -> Types:
    """The types of a definition: that of `name`, and those that follow it under lines of ===.

    Raises BadDefinitionError.
    """
    if len(text) > MAX_TEXT:
        raise BadDefinitionError(f"a definition of {len(text)} characters")
    first, *definitions = _RULE.split(text)
    types = {plain(name): _fields(plain(name), first)}
    for part in definitions:
        head, _, body = part.strip("\n").partition("\n")
        if not head.startswith("MSG:"):
            raise BadDefinitionError(head[:60])
        type_name = plain(head.removeprefix("MSG:").strip())
        types.setdefault(type_name, _fields(type_name, body))
    return types


def _fields(owner: str, text: str) -> tuple[Field, ...]:
    fields = []
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if not words:
            continue
        if len(words) < 2:
            raise BadDefinitionError(line.strip()[:60])
        if "=" in words[1] or (len(words) > 2 and words[2].startswith("=")):
            continue  # a constant
        fields.append(_field(owner, *words[:2]))
        if len(fields) > MAX_FIELDS:
            raise BadDefinitionError(f"more than {MAX_FIELDS} fields")
    return tuple(fields)


def _field(owner: str, kind: str, name: str) -> Field:
    match = _ARRAY.fullmatch(kind)
    if match is None or not _NAME.fullmatch(name):
        raise BadDefinitionError(f"{kind} {name}"[:60])
    length = None if match[2] is None else SEQUENCE if "<=" in match[2] or not match[3] else int(match[3])
    return Field(name, _type_name(owner, match[1]), length)


def _type_name(owner: str, name: str) -> str:
    if name in PRIMITIVES or name in WORDS or name in STAMPS:
        return name
    if name == "Header":
        return "std_msgs/Header"
    return plain(name) if "/" in name else f"{owner.rpartition('/')[0]}/{name}"


_HEADER = "std_msgs/Header header"
_BASICS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Pose2D": "float64 x\nfloat64 y\nfloat64 theta",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/PoseStamped": f"{_HEADER}\ngeometry_msgs/Pose pose",
    "geometry_msgs/PoseWithCovarianceStamped": f"{_HEADER}\ngeometry_msgs/PoseWithCovariance pose",
    "geometry_msgs/TwistStamped": f"{_HEADER}\ngeometry_msgs/Twist twist",
    "geometry_msgs/TwistWithCovarianceStamped": f"{_HEADER}\ngeometry_msgs/TwistWithCovariance twist",
    "geometry_msgs/TransformStamped": f"{_HEADER}\nstring child_frame_id\ngeometry_msgs/Transform transform",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/Odometry": f"{_HEADER}\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist",
    "sensor_msgs/JointState": f"{_HEADER}\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    "sensor_msgs/Imu": f"{_HEADER}\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    "sensor_msgs/BatteryState": f"{_HEADER}\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\n"
    "float32 capacity\nfloat32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\n"
    "uint8 power_supply_health\nuint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
    "float32[] cell_temperature\nstring location\nstring serial_number",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/Float32MultiArray": "std_msgs/MultiArrayLayout layout\nfloat32[] data",
    "std_msgs/Float64MultiArray": "std_msgs/MultiArrayLayout layout\nfloat64[] data",
}

# The usual messages of ROS 2, for bags that carry no definitions. Facts of its interfaces (common_interfaces).
USUAL_TYPES: Types = {name: _fields(name, text) for name, text in _BASICS.items()}


def definition_of(name: str) -> str:
    """The whole definition of a usual message, with all that it is made of, as a bag carries it."""
    type_name, types = plain(name), [plain(name)]
    parts = [_BASICS[type_name]]
    for used_type in types:
        for part in USUAL_TYPES[used_type]:
            if part.type in _BASICS and part.type not in types:
                types.append(part.type)
                parts.append(f"{'=' * 80}\nMSG: {part.type}\n{_BASICS[part.type]}")
    return "\n".join(parts) + "\n"
