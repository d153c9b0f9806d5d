"""Ladder: what was switched on to mend a model that leaves something out, step by step, and whether it paid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from omnidyn.document import Part, Points, Table, plain, short
from omnidyn.model.keys import FRICTION
from omnidyn.statement import NOTE, WARNING, Statement

STANDS = Statement("as_given", NOTE)  # the cause of a model into which nothing was put


@dataclass(frozen=True)
class Rung:
    """A model that was fitted to all of the logs, on the way up.

    step: of the ladder, 0 for the robot as it was given. key: what was switched on, "" for nothing; cause: the same,
    with its fitted value. numbers: how many are fitted. held_out: root mean square of what it leaves of blocks that it
    was not fitted to, in those of the noise; gain: share of the squared one of the step before that it takes away, with
    its standard error. bic: less that of the step before, for the number of causes that were tried. taken: whether
    the ladder went on from here; why: or why not. same_as: keys that as good a model has in its place.
    instead: whether it is without what the step before had switched on. value: number of the robot, or of the log ->
    fitted. groups: in which it was switched on, where there are several and not in all.
    """

    step: int
    key: str
    cause: Statement
    numbers: int
    held_out: float
    gain: float = 0.0
    gain_std: float = 0.0
    bic: float = 0.0
    taken: bool = False
    why: Statement | None = None
    same_as: tuple[str, ...] = ()
    instead: bool = False
    value: Mapping[str, float] = field(default_factory=dict)
    groups: tuple[str, ...] = ()

    def step_taken(self) -> Statement:
        """What was switched on, and what the logs cannot tell from it."""
        numbers = {"cause": self.cause, "same_as": self.same_as}
        return Statement("step_with_others", NOTE, self.key, numbers) if self.same_as else self.cause

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {**asdict(self), "words": str(self.cause), "cause": self.cause, "why": self.why}


@dataclass(frozen=True)
class Ladder:
    """rungs: every model that was fitted, step by step, what was taken first. end: why it went no further."""

    rungs: tuple[Rung, ...]
    end: Statement

    @property
    def taken(self) -> tuple[Rung, ...]:
        """The steps that paid, and are still there at the end."""
        steps = [rung for rung in self.rungs if rung.taken and rung.step]
        replaced_steps = {rung.step - 1 for rung in steps if rung.instead}
        return tuple(rung for rung in steps if rung.step not in replaced_steps)

    def statement(self) -> Statement:
        """What it came to."""
        steps = tuple(rung.step_taken() for rung in self.taken)
        return Statement("ladder_steps" if steps else "ladder_no_step", NOTE, numbers={"steps": steps, "end": self.end})

    def warnings(self) -> list[Statement]:
        """What a reader of the numbers must know: other robots that these logs do not tell from the one taken."""
        statements = []
        for rung in self.taken:
            rival_rungs = [r for r in self.rungs if r.step == rung.step and not r.taken and r.key in rung.same_as]
            if rung.same_as:
                numbers = {"cause": rung.cause, "same_as": rung.same_as} | _spread([rung, *rival_rungs])
                statements.append(Statement("ladder_alternatives", WARNING, rung.key, numbers))
        return statements

    def table(self) -> Table:
        """Every model that was fitted, a row each."""
        rows = [
            (
                str(r.step),
                str(r.cause),
                r.key,
                str(r.numbers or ""),
                _cell(r.held_out, ".4g"),
                f"{short(100.0 * r.gain)} +- {short(100.0 * r.gain_std)} %" if r.step and math.isfinite(r.gain) else "",
                _cell(r.bic, "+.3g") if r.step else "",
                "taken" if r.taken else str(r.why or ""),
            )
            for r in self.rungs
        ]
        head = ("step", "with", "key", "numbers", "held-out error", "less by", "BIC", "")
        return Table(head, rows, "<<<>>>><")

    def parts(self) -> list[Part]:
        """As a point and a table."""
        return [Points([self.statement()]), *([self.table()] if self.rungs else [])]

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return plain({"rungs": self.rungs, "end": self.end})


def _cell(value: float, form: str) -> str:
    """A number in a table, "" for one that there is not."""
    return short(value, form) if math.isfinite(value) else ""


def _spread(rungs: Sequence[Rung]) -> dict[str, Any]:
    """The friction that differs most between models, and from where to where; "" where none is in all of them."""
    shared_names = [
        name for name in rungs[0].value if name.startswith(FRICTION) and all(name in r.value for r in rungs)
    ]
    if len(rungs) < 2 or not shared_names:
        return {"number": ""}
    values = {name: [rung.value[name] for rung in rungs] for name in shared_names}
    name = max(
        shared_names,
        key=lambda level_name: (
            (max(values[level_name]) - min(values[level_name])) / (abs(values[level_name][0]) or 1.0)
        ),
    )
    return {"number": name, "between": (min(values[name]), max(values[name]))}
