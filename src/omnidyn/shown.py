"""Displayable: what `print`, a notebook and `plot` make of a result, all from its one Document.

Pages, pictures and tables of other tools stand on floors above every result, and nothing imports from above itself. The
public package stands above them all, and is imported before anything in it: `omnidyn/__init__.py` hands down, once,
who makes HTML and sentences, draws and fills data frames, each a function that imports its part when it is first
called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

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
