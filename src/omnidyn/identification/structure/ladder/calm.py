"""A step where samples are wild: a fit that counts them little, before any other, for they hide causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnidyn.identification.lack_of_fit import LOSS, LackOfFit
from omnidyn.identification.ladder import STANDS, Rung
from omnidyn.identification.output_error.conclusion import unexplained
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.structure.diagnosis import Examined
from omnidyn.identification.structure.ladder.models import Model, Move, tried
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement


def calmed(
    step: int, stands: Model, seen: Mapping[str, Examined], runs: Sequence[Run], names: Sequence[str] | None,
    progress: FitProgress, gave_up: bool = False,
) -> tuple[Model, list[Rung]]:  # fmt: skip
    """(the model to go on from, the rungs of a step): of Student's t where that predicts better, by more than a
    standard error, what is not wild; as it stands, and no rungs, where no sample is wild, or a cause gains more.
    gave_up: no such cause paid. It counts as no number of the fit."""
    own = {
        group: remedy for group, each in seen.items() for remedy in each.diagnosis.lack_of_fit.remedies
        if remedy.key == LOSS and (gave_up or remedy.gain > _best_cause(each.diagnosis.lack_of_fit))
    }  # fmt: skip
    if not own:
        return stands, []
    best = max(own.values(), key=lambda remedy: remedy.gain - remedy.gain_std)
    made = tried(Move(dict.fromkeys(stands.begins, best)), stands, runs, names, progress)[0]
    count, nothing = len(stands.value), np.nan
    rung = Rung(step, LOSS, best.cause, count, nothing, best.gain, best.gain_std, nothing)
    first = [Rung(0, "", STANDS, count, nothing, taken=True, value=stands.value)] if step == 1 else []
    if isinstance(made, Model) and unexplained(made.solution.solver, made.solution):
        return stands, []
    if not isinstance(made, Model):
        return stands, [*first, replace(rung, why=made.why)]
    if not best.gain > best.gain_std:
        return stands, [*first, replace(rung, why=Statement("predicts_no_better", NOTE), value=made.value)]
    taken = replace(rung, why=Statement("pays", NOTE), value=made.value, taken=True)
    return replace(made, before=None), [*first, taken]


def _best_cause(lack: LackOfFit) -> float:
    """What the best cause of a misfit gains in held-out error; minus infinity where there is none."""
    return max((remedy.gain for remedy in lack.causes if lack.found and remedy.offered), default=-np.inf)
