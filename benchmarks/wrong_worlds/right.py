"""Right worlds: how often a misfit is found where there is none, whatever memory the noise has."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from benchmarks.wrong_worlds.log import AR, COUNTS, FILTERED, SPEEDS, TICKS, TWIST, logged, right_case, robot_of, truths
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.score import is_sure
from omnidyn.errors import OmnidynError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError

FIRST_SEED, SEEDS_EACH = 60_000, 1000
# Name of a noise -> the sensor, and the correlation of its noise from row to row.
NOISES = {
    "white speeds": (SPEEDS, 0.0),
    "white twist": (TWIST, 0.0),
    "AR .5": (AR, 0.5),
    "AR .9": (AR, 0.9),
    "AR .95": (AR, 0.95),
    "AR .98": (AR, 0.98),
    "mean of 5": (FILTERED, 0.0),
    "differenced counts": (COUNTS, 0.0),
    "counts": (TICKS, 0.0),
}


@dataclass
class Calm:
    """Of one log. held: intervals with the truth. sure: a confident remedy where nothing is wrong; words: why not."""

    found: bool = False
    sure: bool = False
    held: list[bool] = field(default_factory=list)
    words: str = ""


def score_right(noise: str, number: int) -> Calm:
    """A log of a right world with one noise."""
    sensor, memory = NOISES[noise]
    seed = FIRST_SEED + SEEDS_EACH * list(NOISES).index(noise) + number
    case = right_case(seed).setup_but(sensor=sensor, memory=memory)
    try:
        estimate = identify(logged(case, seed), robot_of(case.told), OutputError(free=FRICTION)).estimate
    except OmnidynError as error:
        return Calm(words=str(error))
    lack = getattr(estimate, "lack_of_fit", None)
    remedies = list(getattr(lack, "remedies", ()) or ())
    out = Calm(bool(getattr(lack, "found", False)), bool(remedies) and is_sure(remedies[0]))
    for name, true in truths(case.told, case.told.shape).items():
        low, high = estimate.ci95[name]
        if name not in estimate.unidentifiable and np.isfinite(low + high):
            out.held.append(bool(low <= true <= high))
    return out
