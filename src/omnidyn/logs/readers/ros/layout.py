"""Where the numbers of a message lie: CDR (ROS 2) and the plain form of ROS 1.

A message is walked through once, field by field; what follows with the same lengths and words is then read by numpy,
thousands at a time. Nothing of a definition is run as a program, and no length in a message is believed before the
bytes behind it are there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

MAX_DEPTH, MAX_NESTED, MAX_NUMBERS = 16, 500, 4000
MAX_ARRAY = 64  # a longer row of numbers is no column each: a scan, a picture
CDR_HEAD = 4
SIZES = {"u1": 1, "i1": 1, "u2": 2, "i2": 2, "u4": 4, "i4": 4, "f4": 4, "u8": 8, "i8": 8, "f8": 8}


class Leaf(NamedTuple):
    """A number in a message: where it begins [bytes], and its numpy code."""

    offset: int
    code: str


class BadMessageError(ValueError):
    """Bytes that are no message of their type."""


@dataclass
class MessageLayout:
    """Of all messages of `size` bytes that agree in the `fixed` stretches, which hold their lengths and words.

    numbers: path ("pose.position.x", "velocity[2]") -> Leaf. words: path -> text.
    """

    size: int
    fixed: list[tuple[int, int]] = field(default_factory=list)
    numbers: dict[str, Leaf] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    sample: bytes = b""

    def fits(self, data: bytes) -> bool:
        """Whether a message has this layout."""
        if len(data) != self.size:
            return False
        sample = self.sample
        for a, b in self.fixed:  # noqa: SIM110 - a loop, as this is what reading a long bag waits for
            if data[a:b] != sample[a:b]:
                return False
        return True


def layout_of(types: Types, name: str, data: bytes, ros1: bool = False) -> MessageLayout:
    """The layout of one message. Raises BadMessageError."""
    walk = _FieldWalk(types, bytes(data), ros1)
    walk.message(name, "", 0)
    if len(data) - walk.at >= 8 and not ros1:  # a writer may pad; more is another type
        raise BadMessageError(f"{len(data) - walk.at} bytes too many")
    if ros1 and walk.at != len(data):
        raise BadMessageError(f"{len(data) - walk.at} bytes too many")
    walk.layout.fixed = _merged(walk.layout.fixed)
    return walk.layout


def column(block: np.ndarray, leaf: Leaf) -> np.ndarray:
    """The numbers of a leaf in messages of one layout. block: (messages, size) of bytes. Shape (messages,)."""
    size = SIZES[leaf.code[1:]]
    return np.ascontiguousarray(block[:, leaf.offset : leaf.offset + size]).view(leaf.code)[:, 0]


class _FieldWalk:
    def __init__(self, types: Types, data: bytes, ros1: bool):
        self.types, self.data, self.ros1 = types, data, ros1
        self.base = self.at = 0 if ros1 else CDR_HEAD
        self.order = "<"
        self.layout = MessageLayout(len(data), sample=data)
        if not ros1:
            if len(data) < CDR_HEAD or data[0] != 0 or data[1] > 1:
                raise BadMessageError("no plain CDR")
            self.order = "<" if data[1] else ">"
            self.layout.fixed.append((0, 2))

    def message(self, name: str, path: str, depth: int) -> None:
        """A message and all of its fields. Raises BadMessageError where it is not defined, or has no end."""
        if depth > MAX_DEPTH:
            raise BadMessageError("messages within messages without end")
        fields = self.types.get(name)
        if fields is None:
            raise BadMessageError(f"{name} is not defined")
        if not fields and not self.ros1:
            self.take(1)  # C++ has no empty structures: one byte stands for nothing
        for member in fields:
            self.field(member.type, member.length, f"{path}{member.name}", depth)

    def field(self, kind: str, length: int | None, path: str, depth: int) -> None:
        """A field: a value, an array of so many, or a sequence. Raises BadMessageError for too many."""
        if length is None:
            self.value(kind, path, depth)
            return
        count = self.count() if length == SEQUENCE else length
        if kind in PRIMITIVES:
            self.numbers(PRIMITIVES[kind], count, path)
            return
        if count > MAX_NESTED:
            raise BadMessageError(f"{count} elements in {path}")
        for k in range(count):
            self.value(kind, f"{path}[{k}]", depth)

    def value(self, kind: str, path: str, depth: int) -> None:
        """A number or a text where it stands, or the message that it is."""
        if kind in PRIMITIVES:
            code = PRIMITIVES[kind]
            self.leaf(path, self.take(SIZES[code], SIZES[code]), code)
        elif kind in STAMPS:
            self.leaf(f"{path}.sec", self.take(4, 4), "i4" if kind == "duration" else "u4")
            self.leaf(f"{path}.nanosec", self.take(4, 4), "i4" if kind == "duration" else "u4")
        elif kind in WORDS:
            self.text(kind, path)
        else:
            self.message(kind, f"{path}.", depth + 1)

    def numbers(self, code: str, count: int, path: str) -> None:
        size = SIZES[code]
        if not count:
            return
        first = self.take(size * count, size)
        if count <= MAX_ARRAY:
            for k in range(count):
                self.leaf(f"{path}[{k}]", first + k * size, code)

    def leaf(self, path: str, offset: int, code: str) -> None:
        if len(self.layout.numbers) >= MAX_NUMBERS:
            raise BadMessageError(f"more than {MAX_NUMBERS} numbers")
        self.layout.numbers[path] = Leaf(offset, self.order + code)

    def count(self) -> int:
        """A length in the message, which all messages of this layout have."""
        at = self.take(4, 4)
        self.layout.fixed.append((at, at + 4))
        return int.from_bytes(self.data[at : at + 4], "little" if self.order == "<" else "big")

    def text(self, kind: str, path: str) -> None:
        size = self.count() * (1 if kind == "string" else 4)
        at = self.take(size)
        self.layout.fixed.append((at, at + size))
        if kind == "string":
            self.layout.words[path] = self.data[at : at + size].rstrip(b"\0").decode("utf-8", "replace")

    def take(self, size: int, align: int = 1) -> int:
        """Where the next `size` bytes begin, which have to be there."""
        if not self.ros1 and align > 1:
            self.at += -(self.at - self.base) % align
        at, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise BadMessageError(f"{len(self.data)} bytes, at least {self.at} needed")
        return at


def _merged(stretches: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Stretches that touch, but for padding, as one."""
    merged: list[tuple[int, int]] = []
    for a, b in stretches:
        if merged and a == merged[-1][1]:
            merged[-1] = (merged[-1][0], b)
        else:
            merged.append((a, b))
    return merged


# Message definitions as bags carry them: text to fields. Nothing in them is ever run, and nothing grows by itself

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
