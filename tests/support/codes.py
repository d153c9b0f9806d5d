"""Codes of statements: what a test asks for instead of words."""

from collections.abc import Iterable

from omnidyn.logs.columns.doubts import Doubt
from omnidyn.statement import Statement


def codes(statements: Iterable[Statement]) -> list[str]:
    """The code of each statement."""
    return [statement.code for statement in statements]


def said(notes: Iterable[Statement | str]) -> tuple[str, ...]:
    """Each note or doubt with the declaration that settles it, for tests of what a reader says of odd files."""
    return tuple(note.with_remedy if isinstance(note, Doubt) and note.units else str(note) for note in notes)
