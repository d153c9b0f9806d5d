"""What expressions ask of the function that they stand in, and of the program that this belongs to."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any, Protocol

from omnidyn.export.code.c_types import Many, NumpyRecord, Struct, Type
from omnidyn.export.code.sources import Source


class Called(Protocol):
    """A translated function, see translate.py."""

    @property
    def name(self) -> str: ...
    @property
    def returns(self) -> Type: ...
    @property
    def writes(self) -> frozenset[int]: ...


class Whole(Protocol):
    """What expressions ask of the program that they belong to, see program.py."""

    single: bool

    @property
    def real(self) -> str: ...
    @property
    def fixed_fields(self) -> Mapping[tuple[str, str], Any]: ...
    @property
    def constants(self) -> Mapping[str, float]: ...
    def function(self, source: Source, arguments: tuple[Type, ...]) -> Called: ...
    def constant(self, name: str, value: Any) -> tuple[str, Type]: ...
    def struct(self, cls: type, *kinds: Type) -> Struct: ...
    def packed(self, kind: Many, items: list[str]) -> str: ...
    def use(self, record: NumpyRecord, name: str) -> None: ...


class Scope(Protocol):
    """The function that an expression stands in, see translate.py."""

    source: Source
    types: dict[str, Type]
    read: set[str]
    gathered: list[str]

    @property
    def program(self) -> Whole: ...
    def writes_to(self, node: ast.expr) -> None: ...
