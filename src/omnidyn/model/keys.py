"""Keys: the names of numbers in a robot file, such as "body.mass_kg" and "friction.axes.coulomb[0]".

One number has one name, and this is it: for what is free or fixed, in an Estimate, in a plan and in a sweep. Elsewhere
a key is plain text; what it means is asked here: nobody else takes one apart.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from pydantic import BaseModel

from omnidyn.errors import InputError, did_you_mean
from omnidyn.model.friction.kinds import NUMBERS
from omnidyn.model.layout import YAW
from omnidyn.model.robot import Prior, Robot
from omnidyn.model.value import keys_of

TABLES = ("body", "wheels", "motor", "drive", "friction", "floor")
FRICTION = "friction"  # stands for all friction that a robot has
BODY_AXES, DIRECTION, WHEELS = "friction.axes", "friction.direction", "friction.wheels"
VISCOUS, COULOMB, BREAKAWAY = "viscous", "coulomb", "breakaway"
BOX = tuple(f"{BODY_AXES}.{level}[{axis}]" for level in (VISCOUS, COULOMB) for axis in range(3))
"""The six numbers of friction on the body axes, the paper's."""
TORQUE, EMF = "motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad"
ROTOR, WHEEL = "motor.rotor_inertia_kg_m2", "wheels.inertia_kg_m2"
CENTRE = "body.centre_m"
GAINS = ("drive.kp_V_s_rad", "drive.ki_V_rad")
DEAD_BAND, LATENCY = "drive.dead_band_V", "drive.latency_s"

_UNITS = {
    "_kg": "kg",
    "_kg_m2": "kg m^2",
    "_m": "m",
    "_deg": "deg",
    "_ohm": "ohm",
    "_H": "H",
    "_Nm_A": "N m/A",
    "_Vs_rad": "V s/rad",
    "_V": "V",
    "_A": "A",
    "_V_s_rad": "V s/rad",
    "_V_rad": "V/rad",
    "_Hz": "Hz",
    "_s": "s",
}
_FORM = re.compile(r"(\w+(?:\.\w+)*)(?:\[(\d{1,9})\])?", re.ASCII)
_FRICTIONS = {
    COULOMB: "Coulomb friction",
    VISCOUS: "viscous friction",
    BREAKAWAY: "breakaway friction",
}
_LETTERS = {COULOMB: "C", VISCOUS: "B", BREAKAWAY: "S", "yaw_coulomb": "C yaw", "yaw_viscous": "B yaw"}


@dataclass(frozen=True)
class Key:
    """The name of a number of the robot file. name: of the number, or of the list it stands in; index: in that list.

    A list without an index is a key too (what is known may be known of a whole list), but has no value.
    """

    name: str
    index: int | None = None

    @classmethod
    def parse(cls, text: str) -> Key:
        """The key that a text names. Raises InputError where it names no number of a robot file."""
        if not isinstance(text, str):
            raise InputError("not a key", got=text, expected=f'text such as "body.mass_kg", "{BODY_AXES}.coulomb[1]"')
        return _parsed(text)

    def __str__(self) -> str:
        return self.name if self.index is None else f"{self.name}[{self.index}]"

    @property
    def table(self) -> str:
        """The table of the file it stands in: "motor", "friction.axes"."""
        return self.name.rpartition(".")[0]

    @property
    def part(self) -> str:
        """The part of the robot it belongs to: "motor", "friction"."""
        return self.name.partition(".")[0]

    @property
    def field(self) -> str:
        """Its name in the table: "resistance_ohm", "coulomb"."""
        return self.name.rpartition(".")[2]

    @property
    def level(self) -> str:
        """Of friction: VISCOUS, COULOMB or BREAKAWAY, which may be 0. Of any other number: ""."""
        if self.part != FRICTION:
            return ""
        return next((level for level in (VISCOUS, COULOMB, BREAKAWAY) if level in self.field), "")

    @property
    def axis(self) -> int | None:
        """The body axis (x, y, yaw: 0, 1, 2) along which this number alone acts; None for all other numbers."""
        if self.table == BODY_AXES:
            return self.index
        return YAW if self.field.startswith("yaw_") else None

    @property
    def wheel(self) -> int | None:
        """The wheel it belongs to, counted from 0; None for what belongs to none, or to all."""
        return self.index if _places()[self.name].per_wheel else None

    @property
    def unit(self) -> str:
        """Its unit: of friction where it acts says which, of other keys the end of their name; "" for a pure number.

        A list as a whole has the unit of its first entry.
        """
        if self.level:
            yaw = self.axis == YAW
            return ("N m s" if yaw else "N s/m") if self.level == VISCOUS else "N m" if yaw else "N"
        if self.part == FRICTION:
            return self._unit_of_law()
        endings = [ending for ending in _UNITS if self.field.endswith(ending)]
        return _UNITS[max(endings, key=len)] if endings else ""

    def _unit_of_law(self) -> str:
        """The unit of what a law beyond Coulomb's takes."""
        return NUMBERS[self.field.removeprefix("yaw_")].units[self.axis == YAW]

    @property
    def words(self) -> str:
        """What people call the number: "torque constant", "Coulomb friction forward", "resistance of motor 2"."""
        if self.level:
            return f"{_FRICTIONS[self.level]}{self._acts()}"
        name = _places()[self.name].path[-1].removesuffix("_deg").replace("_", " ")
        if self.part == FRICTION:
            return f"{name.removeprefix('yaw ').replace('stribeck', 'Stribeck').replace('dahl', 'Dahl')}{self._acts()}"
        name = f"{name} of the speed loop" if self.name in GAINS else name
        if self.name == CENTRE:
            return "centre of mass" if self.index is None else f"centre of mass{(' forward', ' sideways')[self.index]}"
        if self.wheel is None:
            return name
        return f"{name} of {'motor' if self.part == 'motor' else 'wheel'} {self.wheel + 1}"

    def _acts(self) -> str:
        """Where a friction acts, in words: " forward", " turning", " of wheel 2"; "" for that of a whole list."""
        if self.table == WHEELS:
            back = " backward" if self.field.endswith("_backward") else ""
            return f"{back} at the wheels" if self.index is None else f"{back} of wheel {self.index + 1}"
        if self.axis == YAW:
            return " turning"
        if self.index is None:
            return " along travel" if self.table == DIRECTION and self.level == VISCOUS else ""
        return (" forward", " sideways")[self.index]

    @property
    def symbol(self) -> str:
        """A level of friction as people write it: "Cx", "B yaw", "C of wheel 1"; other numbers by their key."""
        if not self.level:
            return str(self)
        letter = _LETTERS.get(self.field, self.field)
        if self.table == WHEELS:
            return f"{letter} at the wheels" if self.index is None else f"{letter} of wheel {self.index + 1}"
        return letter if self.index is None else f"{letter}{'xyw'[self.index]}"

    def get(self, robot: Robot) -> float:
        """The number of a robot. Raises InputError where it has none of this name."""
        content = self._content(robot)
        return content if self.index is None or not isinstance(content, tuple) else content[self.index]

    def set(self, robot: Robot, value: float, checked: bool = True) -> Robot:
        """The robot with this number changed. What stands once for all wheels can be changed for one of them too.

        Not `checked` is quick, and takes values that no robot file may have. Raises InputError for a number that the
        robot does not have, or a value out of range.
        """
        content, path = self._content(robot), _places()[self.name].path
        tables: list[Any] = [robot]
        for field in path[:-1]:
            tables.append(getattr(tables[-1], field))
        new: Any = value
        if self.index is not None:
            many = list(content) if isinstance(content, tuple) else [content] * robot.wheels.count
            many[self.index] = value
            new = tuple(many)
        try:
            for table, field in zip(reversed(tables), reversed(path), strict=True):
                change = {field: new}
                new = table.replace(**change) if checked else table.model_copy(update=change)
        except InputError as error:
            raise InputError(
                error.what, got=error.got or None, expected=error.expected, remedy=error.remedy, where=str(self)
            ) from None
        return new

    def _content(self, robot: Robot) -> Any:
        """What the robot has there, a number or a list, of which this names one number."""
        place = _places()[self.name]
        content: Any = reduce(getattr, place.path, robot)
        if content is None:
            raise InputError(
                "not a number of this robot",
                expected="a number that it has",
                remedy="enter a first value in the robot file",
                where=str(self),
            )
        if self.index is None and isinstance(content, tuple):
            raise InputError(
                "needs an index", got=str(self), expected=f"an entry, such as {self.name}[{len(content) - 1}]"
            )
        if self.index is not None and place.per_wheel and self.index >= robot.wheels.count:
            raise _no_entry(str(self), robot.wheels.count)
        return content


def friction_keys(robot: Robot) -> tuple[str, ...]:
    """The numbers of friction that a robot has: those of every part that is not off, but for breakaway."""
    axes, direction, wheels = robot.friction.axes, robot.friction.direction, robot.friction.wheels
    keys = [*BOX] if any(axes.viscous) or any(axes.coulomb) else []
    on = [f"{DIRECTION}.coulomb"] if any(direction.coulomb) else []
    on += [f"{DIRECTION}.{name}" for name in (VISCOUS, "yaw_coulomb", "yaw_viscous") if getattr(direction, name)]
    on += [f"{WHEELS}.{name}" for name in (COULOMB, VISCOUS) if np.any(getattr(wheels, name))]
    return (*keys, *(key for name in on for key in expand(name, robot)))


def gain_keys(robot: Robot) -> tuple[str, ...]:
    """The gains of the speed loop, one for all wheels or one each, as far as they are not 0."""
    gains = (key for name in GAINS for key in expand(name, robot))
    return tuple(key for key in gains if Key.parse(key).get(robot) > 0.0)


def expand(name: str, robot: Robot) -> tuple[str, ...]:
    """The keys that a name stands for: "friction" for what the robot has, a list for its entries; else the name itself.

    Whether the robot has what is named is not asked here: Key.parse and Key.get do that.
    """
    if name == FRICTION:
        return friction_keys(robot)
    place = _places().get(name)
    if place is None:
        return (name,)
    content: Any = reduce(getattr, place.path, robot)
    count = len(content) if isinstance(content, tuple) else place.entries
    return tuple(f"{name}[{k}]" for k in range(count)) or (name,)


def all_keys(robot: Robot) -> tuple[str, ...]:
    """Every number that the file of a robot writes, in its order: not what is off, or has its default, unasked."""
    tables = ((table, getattr(robot, table)) for table in TABLES)
    return tuple(key for table, value in tables for key in _written(table, value, robot.priors))


def is_told(path: str, priors: Mapping[str, Prior]) -> bool:
    """Whether something is known of a key, of an entry of its list, or of a key in the table of that name."""
    return any(key == path or key.startswith((f"{path}[", f"{path}.")) for key in priors)


def with_priors(robot: Robot, new_priors: Mapping[str, Prior]) -> Robot:
    """The robot with what is now known about some numbers, by their keys.

    What was known of a list as a whole goes to all its entries where more is known of one of them.
    """
    if not new_priors:
        return robot
    priors = dict(robot.priors)
    for key in map(Key.parse, new_priors):
        if key.index is not None and key.name in priors:
            list_prior = priors.pop(key.name)
            priors |= dict.fromkeys(expand(key.name, robot), list_prior)
    return robot.replace(priors=priors | dict(new_priors))


@lru_cache(maxsize=4096)
def find_key(name: str) -> Key | None:
    """The key that a name is; None where it is none, such as the name of a nuisance."""
    try:
        return _parsed(name)
    except InputError:
        return None


def name_of(key: str) -> str:
    """The name of a number without its index, also of one that is not the robot's own, such as of a variation."""
    return key.partition("[")[0]


def unit(name: str) -> str:
    """The unit of a number by its key; "" for a name that is no key."""
    key = find_key(name)
    return key.unit if key else ""


def in_words(name: str) -> str:
    """What people call a number, by its key; the name itself where it is no key."""
    key = find_key(name)
    return key.words if key else name


@dataclass(frozen=True)
class _KeyLocation:
    """Where numbers stand in a robot. path: names of fields. entries: of a list of fixed length; 0: none is fixed."""

    path: tuple[str, ...]
    entries: int
    per_wheel: bool


@lru_cache(maxsize=1)
def _places() -> dict[str, _KeyLocation]:
    """Every number, and every list of numbers, of the schema."""
    places: dict[str, _KeyLocation] = {}
    for table in TABLES:
        annotation = Robot.model_fields[table].annotation
        assert isinstance(annotation, type)
        places |= _places_in(annotation, table, (table,))
    return places


def _places_in(model: type[BaseModel], table: str, path: tuple[str, ...]) -> dict[str, _KeyLocation]:
    places: dict[str, _KeyLocation] = {}
    for key, field in keys_of(model, []).items():
        name, annotation = f"{table}.{key}", model.model_fields[field].annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            places |= _places_in(annotation, name, (*path, field))
        elif lists := list(_lists(annotation)):
            if any(getattr(entry, "__origin__", None) is tuple for entry in lists[0]):
                continue  # a table of points is no number
            per_wheel = Ellipsis in lists[0]
            places[name] = _KeyLocation((*path, field), 0 if per_wheel else len(lists[0]), per_wheel)
        elif _has_float(annotation):
            places[name] = _KeyLocation((*path, field), 0, False)
    return places


def _lists(annotation: Any) -> Iterator[tuple[Any, ...]]:
    """What stands in the tuples of an annotation."""
    parts = getattr(annotation, "__args__", ())
    if getattr(annotation, "__origin__", None) is tuple:
        yield parts
    else:
        for part in parts:
            yield from _lists(part)


def _has_float(annotation: Any) -> bool:
    return annotation is float or any(map(_has_float, getattr(annotation, "__args__", ())))


@lru_cache(maxsize=4096)
def _parsed(text: str) -> Key:
    form = _FORM.fullmatch(text)
    if form is None:
        raise InputError("not a key", got=text, expected=f'such as "body.mass_kg", "{BODY_AXES}.coulomb[1]"')
    name, index = form[1], None if form[2] is None else int(form[2])
    place = _places().get(name)
    if place is None:
        raise _unknown(name, text)
    if index is not None and not (place.entries or place.per_wheel):
        raise InputError("has no index", got=text, expected=name)
    if index is not None and place.entries and index >= place.entries:
        raise _no_entry(text, place.entries)
    return Key(name, index)


def _unknown(name: str, text: str) -> InputError:
    """Why a name that may be misspelt is none of a number, with the nearest one that is."""
    key_names, (table, _, field) = list(_places()), name.rpartition(".")
    below = [key for key in key_names if key.startswith(f"{name}.")]
    if below:
        return InputError("a table, not a number", got=text, expected=f"a number in it, such as {below[0]}")
    if table and field in keys_of(Robot, table.split(".")):
        return InputError("not a number", got=text, expected="the key of a number")
    if remedy := did_you_mean(name, key_names):
        return InputError("unknown key", got=text, remedy=remedy)
    table_keys = [key for key in key_names if key.startswith(f"{table}.")] or ["a key such as body.mass_kg"]
    return InputError("unknown key", got=text, expected=" or ".join(table_keys))


def _no_entry(text: str, count: int) -> InputError:
    return InputError("no such entry", got=text, expected=f"an index from 0 to {count - 1}")


def _written(path: str, value: BaseModel, priors: Mapping[str, Prior]) -> Iterator[str]:
    for name, field in keys_of(type(value), []).items():
        key, content = f"{path}.{name}", getattr(value, field)
        if content == type(value).model_fields[field].default and not is_told(key, priors):
            continue
        if isinstance(content, BaseModel):
            yield from _written(key, content, priors)
        elif isinstance(content, tuple):
            yield from (f"{key}[{k}]" for k in range(len(content)) if not isinstance(content[k], tuple))
        elif isinstance(content, float):
            yield key
