"""What a plan promised, beside what the fit of its log gave."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from omnidyn.arguments import is_number
from omnidyn.errors import InputError
from omnidyn.files import MAX_TEXT_BYTES, read_bytes
from omnidyn.statement import WARNING, Statement

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate


WIDER = 5.0  # times the planned interval: nuisances of a fit alone make it up to 3 times as wide


class Got(NamedTuple):
    """Half the 95 % interval of a number, as a share of it: as planned, in the middle of the robots drawn and in the
    worst of them, and as the fit has it. Infinite where it was not to be learnt, or is not known."""

    planned: float
    worst: float
    got: float


Promises = Mapping[
    str, tuple[float, float]
]  # key -> half an interval, in the middle and in the worst of the robots drawn


def read_plan(path: str | os.PathLike[str]) -> Promises:
    """What a plan promised: the JSON file that `omnidyn plan` wrote beside its program.

    Raises InputError for another file.
    """
    try:
        numbers = json.loads(read_bytes(path, MAX_TEXT_BYTES))["predicted"]
        return {name: (_share(number["half"]), _share(number["worst"])) for name, number in numbers.items()}
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise InputError(
            "no plan in this file",
            got=str(path),
            expected="what omnidyn plan -o plan.csv wrote beside its program, plan.json",
        ) from None


def beside(promises: Promises, estimate: Estimate) -> dict[str, Got]:
    """Key -> what a plan promised and what the fit has, of the numbers that both know."""
    return {
        name: Got(*shares, estimate.half_width(name)) for name, shares in promises.items() if name in estimate.value
    }


def wider_than_planned(got: Mapping[str, Got]) -> list[Statement]:
    """A warning about the number whose interval is wider than planned by the largest factor, beyond `WIDER`."""
    times = {name: one.got / one.planned for name, one in got.items() if one.planned > 0.0 and math.isfinite(one.got)}
    name = max(times, key=times.__getitem__, default="")
    if not name or times[name] <= WIDER:
        return []
    return [Statement("wider_than_planned", WARNING, name, {"times": times[name], "got": got[name].got})]


def wider_of_groups(planned: Mapping[str, Mapping[str, Got]]) -> list[Statement]:
    """What is known much less well than planned, by group; the group is named where there are several."""
    from omnidyn.identification.verdict import of_group  # imported lazily: slow to load

    warnings = [(group, statement) for group, got in planned.items() for statement in wider_than_planned(got)]
    return [statement if len(planned) == 1 else of_group(group, statement) for group, statement in warnings]


def _share(value: Any) -> float:
    if value is None:
        return math.inf
    if not is_number(value) or not value >= 0.0:
        raise ValueError(value)
    return float(value)
