"""One recording given twice is one recording: counted twice it would make every interval narrower by sqrt(2)."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.model.log_effects import log_mark
from omnidyn.run import Run
from omnidyn.statement import NOTE, WARNING, Statement


def count_once(runs: Sequence[Run], groups: Sequence[str]) -> tuple[list[int], tuple[Statement, ...]]:
    """(places of the runs to use, what is to be said of the others). groups: of each run.

    Runs are the same where their marks are (`log_mark`), whatever they are called. The
    first of a group is used. One that two groups have stays in both, with a word: their difference is no evidence then.
    """
    if len(runs) == 1:
        return [0], ()
    first_place: dict[str, int] = {}
    kept_places, repeat_notes = [], list[Statement]()
    for place, run in enumerate(runs):
        first = first_place.setdefault(log_mark(run), place)
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


def _name(run: Run, place: int) -> str:
    return run.source or f"run {place}"
