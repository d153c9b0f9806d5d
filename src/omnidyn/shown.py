"""Displayable: what `print`, a notebook and `plot` make of a result, all from its one Document.

Pages, pictures and tables of other tools stand on floors above every result, and nothing imports from above itself. The
public package stands above them all, and is imported before anything in it: `omnidyn/__init__.py` hands down, once,
who makes HTML and sentences, draws and fills data frames, each a function that imports its part when it is first
called.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from omnidyn.errors import InputError
from omnidyn.files import write_atomic

if TYPE_CHECKING:
    from omnidyn.document import Document

HTML, FIGURE, ANIMATION, FRAME, DATASET, RUN = "html", "figure", "animation", "frame", "dataset", "run"
SYSTEM = "system"
SENTENCE, REMEDY, DOCUMENT = "sentence", "remedy", "document"

_MAKERS: dict[str, Callable[..., Any]] = {}


def made_by(**makers: Callable[..., Any]) -> None:
    """Who makes what: html(document), figure(result, **options), animation(run, robot=), frame(result), dataset(run),
    run(table), sentence(statement), remedy(statement), document(verdict), system(state space)."""
    _MAKERS.update(makers)


def make(what: str, value: Any, /, **options: Any) -> Any:
    """What the maker of it makes of a value."""
    return _MAKERS[what](value, **options)


class Displayable:
    """A result that has a `document()`: it prints as text, and as tables in a notebook. Its `repr` stays a line."""

    __slots__ = ()

    def document(self) -> Document:
        """What the result says."""
        raise NotImplementedError

    def __str__(self) -> str:
        return self.document().to_text()

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return make(HTML, self.document())


@dataclass(frozen=True)
class Animation:
    """A moving picture. gif: the bytes of a GIF that repeats. A notebook shows it."""

    gif: bytes = field(repr=False)

    def save(self, path: str | os.PathLike, force: bool = False) -> None:
        """Write it as a file `.gif`. Raises InputError for another ending, or where it exists, unless `force`."""
        if not os.fspath(path).lower().endswith(".gif"):
            raise InputError("another kind of file", got=os.fspath(path), expected="a name that ends in .gif")
        write_atomic(path, self.gif, force)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f'<img alt="animation" src="data:image/gif;base64,{base64.b64encode(self.gif).decode()}">'
