"""Codes of statements: what a test asks for instead of words."""

from collections.abc import Iterable

from omnidyn.statement import Statement


def codes(statements: Iterable[Statement]) -> list[str]:
    """The code of each statement."""
    return [statement.code for statement in statements]
