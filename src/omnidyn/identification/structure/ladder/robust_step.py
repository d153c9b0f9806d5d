"""A step where there are outliers: a fit that counts them little, before any other, for they hide causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnidyn.identification.lack_of_fit import LOSS, LackOfFit
from omnidyn.identification.ladder import STANDS, Rung
from omnidyn.identification.output_error.conclusion import unexplained
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.structure.diagnosis import Examined
from omnidyn.identification.structure.ladder.models import (
    Model,
    Move,
    tried,
)
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement


def calmed(
    step: int,
    base_model: Model,
    examinations: Mapping[str, Examined],
    runs: Sequence[Run],
    names: Sequence[str] | None,
    progress: FitProgress,
    gave_up: bool = False,
) -> tuple[Model, list[Rung]]:
    """(the model to go on from, the rungs of a step): of Student's t where that predicts better what is no outlier
    in held-out blocks; as it stands, and no rungs, where there is no outlier, or a cause gains more.
    gave_up: no such cause paid. It counts as no number of the fit."""
    remedy_by_group = {
        group: remedy
        for group, examination in examinations.items()
        for remedy in examination.diagnosis.lack_of_fit.remedies
        if remedy.key == LOSS and (gave_up or remedy.gain > _best_cause(examination.diagnosis.lack_of_fit))
    }
    if not remedy_by_group:
        return base_model, []
    best = max(remedy_by_group.values(), key=lambda remedy: remedy.gain - remedy.gain_std)
    calm_model = tried(Move(dict.fromkeys(base_model.begins, best)), base_model, runs, names, progress)[0]
    count, no_number = len(base_model.value), np.nan
    rung = Rung(step, LOSS, best.cause, count, no_number, best.gain, best.gain_std, no_number)
    first = [Rung(0, "", STANDS, count, no_number, taken=True, value=base_model.value)] if step == 1 else []
    if isinstance(calm_model, Model) and unexplained(calm_model.solution.solver, calm_model.solution):
        return base_model, []
    if not isinstance(calm_model, Model):
        return base_model, [*first, replace(rung, why=calm_model.reason)]
    if best.comparison is None or not best.comparison.is_better:
        counts = best.comparison.counts if best.comparison else {"better": 0, "blocks": 0}
        reason = Statement("predicts_no_better", NOTE, numbers=counts)
        return base_model, [*first, replace(rung, why=reason, value=calm_model.value)]
    taken_rung = replace(rung, why=Statement("pays", NOTE), value=calm_model.value, taken=True)
    return replace(calm_model, base_model=None), [*first, taken_rung]


def _best_cause(lack: LackOfFit) -> float:
    """What the best cause of a misfit gains in held-out error; minus infinity where there is none."""
    return max((remedy.gain for remedy in lack.causes if lack.found and remedy.offered), default=-np.inf)
