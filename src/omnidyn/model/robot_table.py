"""The numbers of a robot as a short table: one row per key of its file, with what is known about each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from pydantic import BaseModel

from omnidyn.document import Table
from omnidyn.model.value import keys_of

HEAD = ("key", "value", "std", "origin", "what it is")
TABLES = ("body", "wheels", "motor", "drive", "friction", "floor")


class Known(Protocol):
    """What is known about a number."""

    @property
    def std(self) -> float | None: ...

    @property
    def origin(self) -> str: ...


def robot_table(robot: BaseModel, priors: Mapping[str, Known]) -> Table:
    """Every number that the robot does not leave off; a list takes one row."""
    rows = [row for table in TABLES for row in _rows(table, getattr(robot, table), priors)]
    return Table(HEAD, rows, "<<", name="numbers")


def _rows(path: str, value: BaseModel, priors: Mapping[str, Known]) -> Iterator[tuple[str, ...]]:
    for name, attribute in keys_of(type(value), []).items():
        key, content, field = f"{path}.{name}", getattr(value, attribute), type(value).model_fields[attribute]
        if content is None or content == field.default:
            continue
        if isinstance(content, BaseModel):
            yield from _rows(key, content, priors)
        else:
            count = len(content) if isinstance(content, tuple) else 0
            key_priors = [priors[entry] for entry in (key, *(f"{key}[{k}]" for k in range(count))) if entry in priors]
            stds = ", ".join(f"{prior.std:.3g}" for prior in key_priors if prior.std is not None)
            origins = ", ".join(dict.fromkeys(prior.origin for prior in key_priors))
            yield key, _text(content), stds, origins, field.description or ""


def _text(content: object) -> str:
    """A number, a list of them, or a word, as a person reads it."""
    if isinstance(content, tuple):
        return ", ".join(map(_text, content))
    return f"{content:.5g}" if isinstance(content, float) else str(content)
