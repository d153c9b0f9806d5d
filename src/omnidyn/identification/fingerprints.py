"""One recording given twice is one recording: counted twice it would make every interval narrower by sqrt(2)."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from omnidyn.run import Run
from omnidyn.statement import NOTE, WARNING, Statement

SAME_TIME = 9  # decimals of a second to which times since the first row are compared


def count_once(runs: Sequence[Run], groups: Sequence[str]) -> tuple[list[int], tuple[Statement, ...]]:
    """(places of the runs to use, what is to be said of the others). groups: of each run.

    Runs are the same where all their channels are, and their times since the first row, whatever they are called. The
    first of a group is used. One that two groups have stays in both, with a word: their difference is no evidence then.
    """
    if len(runs) == 1:
        return [0], ()
    first_place: dict[str, int] = {}
    kept_places, repeat_notes = [], list[Statement]()
    for place, run in enumerate(runs):
        first = first_place.setdefault(fingerprint(run), place)
        if first == place:
            kept_places.append(place)
        elif groups[first] == groups[place]:
            first_name = {"first": _name(runs[first], first)}
            repeat_notes.append(Statement("counted_once", NOTE, _name(run, place), first_name))
        else:
            kept_places.append(place)
            names = {"group": groups[place], "first": _name(runs[first], first), "other": groups[first]}
            repeat_notes.append(Statement("in_two_groups", WARNING, _name(run, place), names))
    return kept_places, tuple(repeat_notes)


def fingerprint(run: Run) -> str:
    """SHA-256 of all channels of a run and its times since the first row."""
    digest = hashlib.sha256(np.round(run.t - run.t[0], SAME_TIME).tobytes())
    for name, values in run.channels.items():
        digest.update(name.encode())
        digest.update((np.ascontiguousarray(values) + 0.0).tobytes())  # 0 and -0 are one number
    return digest.hexdigest()


def _name(run: Run, place: int) -> str:
    return run.source or f"run {place}"
