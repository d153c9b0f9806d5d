"""What a plan promised, beside what the fit of its log gave."""

from __future__ import annotations

import json
import math
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from omnidyn.arguments import is_number
from omnidyn.errors import InputError
from omnidyn.files import MAX_TEXT_BYTES, read_bytes

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate


class Got(NamedTuple):
    """Half the 95 % interval of a number, as a share of it: as planned, in the middle of the robots drawn and in the
    worst of them, and as the fit has it. Infinite where it was not to be learnt, or is not known."""

    planned: float
    worst: float
    got: float


def beside(path: str | os.PathLike[str], estimate: Estimate) -> dict[str, Got]:
    """Key -> what the plan promised and what the fit has, of the JSON file that `omnidyn plan` wrote with its program.

    Raises InputError for another file, and for a plan that shares no number with the fit.
    """
    try:
        numbers = json.loads(read_bytes(path, MAX_TEXT_BYTES))["predicted"]
        planned = {name: (_share(number["half"]), _share(number["worst"])) for name, number in numbers.items()}
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise InputError(
            "no plan in this file",
            got=str(path),
            expected="what omnidyn plan -o plan.csv wrote beside its program, plan.json",
        ) from None
    found = {
        name: Got(*shares, estimate.half_width(name)) for name, shares in planned.items() if name in estimate.value
    }
    if not found:
        raise InputError(
            "this plan is for other numbers",
            got=", ".join(planned) or "none",
            expected=", ".join(estimate.value),
            remedy="give the plan of this drive; its `free` and those of this fit agree",
        )
    return found


def _share(value: Any) -> float:
    if value is None:
        return math.inf
    if not is_number(value) or not value >= 0.0:
        raise ValueError(value)
    return float(value)
