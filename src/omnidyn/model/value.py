"""Value: the frozen, checked type that every part of a robot is. Each parameter is declared once.

A field carries its name in Python, its key in a robot file (the alias, with the unit in its name), its range and
its meaning. Construction checks it, from a file or from Python, and raises InputError with the path of the key.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    Strict,
    Tag,
    ValidationError,
)
from pydantic_core import CoreSchema

from omnidyn.errors import InputError, did_you_mean


class Value(BaseModel):
    """A frozen value type; `replace` makes a changed, checked copy.

    Raises InputError when a field is missing, unknown, of the wrong type or out of its range.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_by_name=True, validate_by_alias=True, validate_default=False
    )

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise from_validation(error, type(self)) from None

    # pydantic would call an __init__ of our own for nested values too, and the path of the key would be lost.
    __init__.__pydantic_base_init__ = True  # pyright: ignore[reportFunctionMemberAccess]

    def replace(self, **changes: Any) -> Self:
        """The same value with some fields changed, checked again."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **changes})


def to_list(value: Any) -> Any:
    """A NumPy array or number as plain Python; anything else as it is."""
    return value.tolist() if hasattr(value, "tolist") else value


def _shape_of(value: Any) -> str:
    return "many" if isinstance(value, list | tuple) else "one"


@dataclass(frozen=True)
class FieldType:
    """What a field may hold, for use in `Annotated`: the type that pydantic checks instead of the plain one."""

    type: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(self.type)


def number(low: float, high: float, *, above: bool = False) -> FieldType:
    """A finite number in [low, high], or (low, high] when `above`; a bool or a string is refused."""
    bound = Field(gt=low, le=high, allow_inf_nan=False) if above else Field(ge=low, le=high, allow_inf_nan=False)
    return FieldType(Annotated[float, Strict(), bound, BeforeValidator(to_list)])


def per_wheel_number(low: float, high: float) -> FieldType:
    """A number, or a tuple with one number per wheel."""
    single = number(low, high).type
    return FieldType(
        Annotated[
            Annotated[single, Tag("one")] | Annotated[tuple[single, ...], Tag("many")],
            Discriminator(_shape_of),
            BeforeValidator(to_list),
        ]
    )


def per_axis_number(low: float, high: float) -> FieldType:
    """Three numbers: along x, along y, about yaw."""
    single = number(low, high).type
    return FieldType(Annotated[tuple[single, single, single], BeforeValidator(to_list)])


def points(bound: float) -> FieldType:
    """Pairs of numbers within 0 to `bound`, each with its standard deviation or without."""
    single = number(0.0, bound).type
    return FieldType(tuple[Annotated[tuple[single, ...], Field(min_length=2, max_length=3)], ...])


def place(bound: float) -> FieldType:
    """Two numbers within -`bound` to `bound`: along x, along y."""
    single = number(-bound, bound).type
    return FieldType(Annotated[tuple[single, single], BeforeValidator(to_list)])


def word_of(*words: str) -> FieldType:
    """One of some words."""
    choices: Any = Literal
    return FieldType(choices[words])


PerWheel = float | tuple[float, ...]
"""One number for all wheels, or one per wheel."""

Levels = tuple[float, float, float]
"""One number per axis: along x, along y, about yaw."""

Text = Annotated[str, Strict(), Field(max_length=400)]
Flag = Annotated[bool, Strict()]


def from_validation(error: ValidationError, model: type[BaseModel]) -> InputError:
    """The first fault of a pydantic check as an InputError: where, what, got, expected, remedy."""
    faults = error.errors(include_url=False)
    # A key that is not known before one that is missing: often it is the same one, spelled right.
    first = faults[0]
    if first["type"] == "missing":
        first = next((fault for fault in faults if fault["type"] == "extra_forbidden"), first)
    path = [part for part in first["loc"] if part not in ("one", "many")]
    kind, remark = first["type"], f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    location = key_path(path)
    if kind == "extra_forbidden":
        return InputError(f"unknown key{remark}", got=str(path[-1]), remedy=_nearest(path, model), where=location)
    if kind == "missing" and isinstance(path[-1], int):
        return InputError(f"too few values{remark}", got=f"{path[-1]}", expected="more", where=key_path(path[:-1]))
    if kind == "missing":
        return InputError(f"a key is missing{remark}", expected=str(path[-1]), remedy="add it", where=location)
    if kind == "value_error":  # one of our own checks: its words are complete
        return InputError(first["msg"].removeprefix("Value error, ") + remark, where=location)
    expected, got, remedy = first["msg"].removeprefix("Input should be "), first["input"], ""
    if kind in _LENGTHS:
        bounds = first.get("ctx", {})
        expected = f"{_LENGTHS[kind]} {bounds.get('min_length', bounds.get('max_length'))} values"
    elif kind == "tuple_type":
        expected = "a list"
    elif kind == "float_type" and isinstance(got, str):
        got, remedy = f'the text "{got}"', "write numbers without quotes"
    return InputError(f"cannot use this value{remark}", got=got, expected=expected, remedy=remedy, where=location)


_LENGTHS = {"too_short": "at least", "too_long": "at most"}


def key_path(path: list[Any] | tuple[Any, ...]) -> str:
    """A key as one finds it in the file: [motor] resistance_ohm, [friction.axes] coulomb[0]."""
    names = [part for part in path if not isinstance(part, int)]
    index = "".join(f"[{part}]" for part in path if isinstance(part, int))
    if not names:
        return index
    table = f"[{'.'.join(map(str, names[:-1]))}] " if len(names) > 1 else ""
    return f"{table}{names[-1]}{index}"


def _nearest(path: list[Any], model: type[BaseModel]) -> str:
    """The known keys at the place of an unknown one, the nearest name first."""
    keys = sorted(keys_of(model, path[:-1]))
    return did_you_mean(str(path[-1]), keys, f"known keys: {', '.join(keys)}")


def table_at(model: type[BaseModel], path: Sequence[Any]) -> type[BaseModel] | None:
    """The model of the table at `path` below `model`, None where there stands no table."""
    any_name = False  # of the next part: what stands in the values of a dict has a name of its own
    for part in path:
        if any_name:
            any_name = False
            continue
        inner: list[type[BaseModel]] = []
        for name, field in model.model_fields.items():
            if part in (name, field.alias):
                inner = [t for t in _types_in(field.annotation) if issubclass(t, BaseModel)]
                any_name = getattr(field.annotation, "__origin__", None) is dict
        if not inner:
            return None
        model = inner[0]
    return None if any_name else model


def keys_of(model: type[BaseModel], path: Sequence[Any]) -> Mapping[str, str]:
    """File key -> field name of the table at `path` below `model`."""
    table = table_at(model, path)
    return {} if table is None else {field.alias or name: name for name, field in table.model_fields.items()}


def _types_in(annotation: Any) -> list[type]:
    parts = getattr(annotation, "__args__", ())
    return [annotation] if isinstance(annotation, type) and not parts else [t for p in parts for t in _types_in(p)]
