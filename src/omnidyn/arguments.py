"""Arguments in each other's place, or of another kind: said in one sentence, before anything fails further inside."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Iterator

from omnidyn.errors import InputError

# What to call instead, by the name of the type that is wanted.
MADE_BY = {
    "Robot": 'omnidyn.load_robot("axebot"), or of a file, makes one',
    "Run": "omnidyn.read_log(path) makes one",
    "Log": "omnidyn.load_log(path) makes one",
    "PathLike": "what stands in a file is read by its path; a Run is ready to use",
    "SteadyTable": "omnidyn.read_steady_table(path) makes one",
    "OutputErrorEstimate": "omnidyn.identify(logs, robot) makes one",
}

Kinds = type | tuple[type, ...]


_FRAMES = ("pandas", "polars", "xarray")


def is_frame(value: object) -> bool:
    """Whether a value is a data frame of pandas or polars, or an xarray Dataset; none of them is imported for this."""
    kind = type(value)
    return kind.__module__.partition(".")[0] in _FRAMES and kind.__name__ in ("DataFrame", "Dataset")


def check_order(call: str, *places: tuple[object, Kinds]) -> None:
    """Refuse arguments that stand in each other's place, and those of a wrong kind.

    call: as it is written, "compare(robot, run)". places: (what was given, what belongs there) of each argument, in
    that order; a list stands for what it holds, an empty one for anything.
    Raises InputError, which names both where two were swapped.
    """
    wrong = [k for k, (given, wanted) in enumerate(places) if not _is(given, wanted)]
    if not wrong:
        return
    for one in wrong:
        for other, (_, wanted) in enumerate(places):
            if other != one and _is(places[one][0], wanted) and _is(places[other][0], places[one][1]):
                first, second = sorted((one, other))
                raise InputError(
                    "two arguments stand in each other's place",
                    got=f"{_kind(places[first][0])} before {_kind(places[second][0])}",
                    expected=call,
                )
    given, wanted = places[wrong[0]]
    kinds = wanted if isinstance(wanted, tuple) else (wanted,)
    names = [kind.__name__ for kind in kinds if kind is not type(None)]
    raise InputError(
        f"an argument is no {' or '.join(names)}",
        got=_kind(given),
        expected=call,
        remedy=next((MADE_BY[name] for name in names if name in MADE_BY), ""),
    )


def unknown_option(owner: str, option: str, known: Iterable[str], where: str) -> InputError:
    """The error of an option that something does not have, with the nearest that it has."""
    near = difflib.get_close_matches(option, list(known), 1, 0.4)
    return InputError(
        f"{owner} has no such option",
        got=option,
        expected=", ".join(known),
        remedy=f"did you mean {near[0]}?" if near else "",
        where=where,
    )


def _is(value: object, wanted: Kinds) -> bool:
    """Whether a value, or every item of a list, is of a kind. A table in memory stands for a Run."""
    if isinstance(value, list | tuple):
        return all(isinstance(each, wanted) or _stands_for(each, wanted) for each in value)
    known = isinstance(value, Iterator) or isinstance(value, wanted)  # noqa: SIM101  what an iterator holds is not known
    return known or _stands_for(value, wanted)


def _stands_for(value: object, wanted: Kinds) -> bool:
    """Whether a table in memory stands where a Run is wanted."""
    kinds = wanted if isinstance(wanted, tuple) else (wanted,)
    return is_frame(value) and any(each.__name__ == "Run" for each in kinds)


def _kind(value: object) -> str:
    """What a value is, for a message: "a Run", "a list of Robot"."""
    if isinstance(value, str | os.PathLike):
        return f"the text {os.fspath(value)!r}"
    if isinstance(value, list | tuple) and value:
        kinds = dict.fromkeys(type(each).__name__ for each in value)
        return f"a {type(value).__name__} of {' and '.join(kinds)}"
    name = type(value).__name__
    return "nothing" if value is None else f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
