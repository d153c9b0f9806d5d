"""Arguments that are swapped, or of another kind: said in one sentence, before anything fails further inside."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from numbers import Integral, Real

import numpy as np

from omnidyn.errors import InputError, did_you_mean

# What to call instead, by the name of the type that is wanted.
MADE_BY = {
    "Robot": 'omnidyn.load_robot("axebot"), or of a file, makes one',
    "Run": "omnidyn.read_log(path) makes one",
    "Log": "omnidyn.read_log(path, recorded=True) makes one",
    "PathLike": "what stands in a file is read by its path; a Run is ready to use",
    "SteadyTable": "omnidyn.read_steady_table(path) makes one",
    "OutputErrorEstimate": "omnidyn.identify(logs, robot) makes one",
}

Kinds = type | tuple[type, ...]
Rng = int | np.random.Generator | np.random.SeedSequence | None  # as `numpy.random.default_rng` takes it


_FRAMES = ("pandas", "polars", "xarray")


def is_frame(value: object) -> bool:
    """Whether a value is a data frame of pandas or polars, or an xarray Dataset; none of them is imported for this."""
    kind = type(value)
    return kind.__module__.partition(".")[0] in _FRAMES and kind.__name__ in ("DataFrame", "Dataset")


def is_whole(value: object) -> bool:
    """Whether a value is a whole number, of Python or of NumPy; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def is_number(value: object) -> bool:
    """Whether a value is one real number, of Python or of NumPy; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def seed_of(rng: Rng) -> int:
    """A seed: the whole number given, or one drawn from a generator, a seed sequence, or, for None, at random.

    Raises InputError for anything else.
    """
    if is_whole(rng) and rng >= 0:  # pyright: ignore[reportOperatorIssue]
        return int(rng)  # pyright: ignore[reportArgumentType]
    if rng is None or isinstance(rng, np.random.Generator | np.random.SeedSequence):
        return int(np.random.default_rng(rng).integers(2**32))
    raise InputError(
        "not a source of random numbers",
        got=rng,
        expected="a whole number, 0 or more, or a numpy.random.Generator",
        where="rng",
    )


def check_order(call: str, *places: tuple[object, Kinds]) -> None:
    """Refuse arguments that are swapped, and those of a wrong kind.

    call: as it is written, "compare(robot, run)". places: (what was given, what belongs there) of each argument, in
    that order; a list stands for what it holds, an empty one for anything.
    Raises InputError, which names both where two were swapped.
    """
    misfits = [k for k, (value, kind) in enumerate(places) if not _is(value, kind)]
    if not misfits:
        return
    for place in misfits:
        for position, (_, kind) in enumerate(places):
            if position != place and _is(places[place][0], kind) and _is(places[position][0], places[place][1]):
                first, second = sorted((place, position))
                raise InputError(
                    "arguments swapped",
                    got=f"{_kind(places[first][0])} before {_kind(places[second][0])}",
                    expected=call,
                )
    value, kind = places[misfits[0]]
    kinds = kind if isinstance(kind, tuple) else (kind,)
    names = [kind.__name__ for kind in kinds if kind is not type(None)]
    raise InputError(
        f"an argument is not of the type {' or '.join(names)}",
        got=_kind(value),
        expected=call,
        remedy=next((MADE_BY[name] for name in names if name in MADE_BY), ""),
    )


def unknown_option(owner: str, option: str, options: Iterable[str], where: str) -> InputError:
    """The error of an option that something does not have, with the nearest that it has."""
    return InputError(
        f"{owner} has no such option",
        got=option,
        expected=", ".join(options),
        remedy=did_you_mean(option, options),
        where=where,
    )


def _is(value: object, kind: Kinds) -> bool:
    """Whether a value, or every item of a list, is of a kind. A table in memory stands for a Run."""
    if isinstance(value, list | tuple):
        return all(isinstance(item, kind) or _stands_for(item, kind) for item in value)
    matches = isinstance(value, Iterator) or isinstance(value, kind)  # noqa: SIM101  what an iterator holds is not known
    return matches or _stands_for(value, kind)


def _stands_for(value: object, kind: Kinds) -> bool:
    """Whether a table in memory stands where a Run is wanted."""
    kinds = kind if isinstance(kind, tuple) else (kind,)
    return is_frame(value) and any(wanted_kind.__name__ == "Run" for wanted_kind in kinds)


def _kind(value: object) -> str:
    """What a value is, for a message: "a Run", "a list of Robot"."""
    if isinstance(value, str | os.PathLike):
        return f"the text {os.fspath(value)!r}"
    if isinstance(value, list | tuple) and value:
        kinds = dict.fromkeys(type(item).__name__ for item in value)
        return f"a {type(value).__name__} of {' and '.join(kinds)}"
    name = type(value).__name__
    return "nothing" if value is None else f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
