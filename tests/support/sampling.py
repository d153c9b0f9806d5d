"""Without --long some cases of a test that tries one rule on many near-equal ones: `@pytest.mark.some(5)`.

With --long, as in CI, all of them run.
"""

from collections.abc import Sequence
from typing import Protocol

MARK = "some"


class Case(Protocol):
    """Of a pytest.Item what is asked here."""

    nodeid: str

    def get_closest_marker(self, name: str): ...


def spread(count: int, number: int) -> set[int]:
    """`number` of the places 0 .. count - 1: the first, the last, and others evenly between."""
    if number >= count:
        return set(range(count))
    return {round(k * (count - 1) / max(number - 1, 1)) for k in range(number)}


def left_out(items: Sequence[Case]) -> list[Case]:
    """The cases that do not run without --long, of each test by itself."""
    tests: dict[str, list[Case]] = {}
    for item in items:
        if item.get_closest_marker(MARK):
            tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    left = []
    for cases in tests.values():
        kept = spread(len(cases), cases[0].get_closest_marker(MARK).args[0])
        left += [case for k, case in enumerate(cases) if k not in kept]
    return left
