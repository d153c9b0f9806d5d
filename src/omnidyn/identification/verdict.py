"""What an identification came to: whether the model follows, and how well its numbers are known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.comparison.verdict import followed, follows, nothing_followed
from omnidyn.findings.finding import Verdict
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.steady.choice import ShapeScore
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.identification.validation import FITTED, HELD_OUT, Score, Validation, output_name
from omnidyn.statement import ERROR, NOTE, WARNING, Statement

MISSES = 0.5  # of the force: a shape that leaves more explains nothing


def fit_verdict(fit: OutputErrorEstimate, validation: Validation | None = None) -> Statement:
    """A fit to whole logs. Where logs were held out, these say whether the model follows."""
    if validation is None:
        return Statement("not_compared", NOTE, numbers={"known": fit.numbers_known()})
    logs_key = HELD_OUT if HELD_OUT in validation.scores else FITTED
    followed_outputs = followed(validation.scores[logs_key])
    numbers = {"logs": logs_key, "follows": follows("the model", followed_outputs)}
    if fit.not_followed or nothing_followed(followed_outputs):
        return Statement("model_outcome", ERROR, numbers=numbers | {"known": None})
    if logs_key == HELD_OUT:
        numbers["held_out"] = validation.statement()
    return Statement("model_outcome", NOTE, numbers=numbers | {"known": fit.numbers_known()})


def fits_verdict(
    fits: Mapping[str, OutputErrorEstimate],
    validations: Mapping[str, Validation],
    verdicts: Sequence[Verdict] = (),
    cut: bool = False,
) -> list[Statement]:
    """Fits of all groups. verdicts: of `check` on the logs. cut: whether an interrupt cut the fit off."""
    statements = [Statement("cut_short", WARNING)] if cut else []
    faults = [finding for verdict in verdicts for finding in verdict.findings if finding.severity == ERROR]
    if faults:
        logs = {"logs": sum(verdict.has_errors for verdict in verdicts), "of": len(verdicts), "first": faults[0]}
        statements.append(Statement("logs_with_errors", ERROR, numbers=logs))
    statements += [fit.ladder.statement() for fit in [*fits.values()][:1] if fit.ladder]  # all have the same
    for group, fit in fits.items():
        lack = fit.lack_of_fit.statement() if fit.lack_of_fit is not None and not fit.not_followed else None
        outcome = fit_verdict(fit, validations.get(group))
        group_statements = [lack, outcome] if lack and lack.severity != NOTE else [outcome, *([lack] if lack else [])]
        statements += (
            group_statements if len(fits) == 1 else [of_group(group, statement) for statement in group_statements]
        )
    return statements


def of_group(group: str, statement: Statement) -> Statement:
    """A statement of one of several groups."""
    return Statement("of_group", statement.severity, group, {"statement": statement})


def fit_failure(fit: OutputErrorEstimate, validation: Validation | None = None) -> Statement | None:
    """What a fit misses; None where it follows what it was fitted to."""
    missed_outputs = {} if validation is None else validation.not_followed(fit.noise)
    missed_names = {output_name(name) for name in missed_outputs}
    names = missed_outputs | dict.fromkeys(name for name in fit.not_followed if name not in missed_names)
    if names:
        return Statement("outputs_missed", ERROR, numbers={"names": tuple(names), "percents": tuple(names.values())})
    followed_outputs = followed(_judged(validation)) if validation is not None else []
    failure = Statement("nothing_followed", ERROR, numbers={"follows": follows("the model", followed_outputs)})
    return failure if nothing_followed(followed_outputs) else None


def _judged(validation: Validation) -> Mapping[str, Score]:
    """The scores that say whether a model follows: those of logs held out, where there are any."""
    return validation.scores[HELD_OUT if HELD_OUT in validation.scores else FITTED]


def steady_failure(study: SteadyStudy) -> Statement | None:
    """What no shape of friction explains; None where one does."""
    score, size, share = _best_shape(study)
    if share <= MISSES:
        return None
    return Statement("forces_unexplained", ERROR, score.name, {"error": study.choice.error, "size": size})


def _best_shape(study: SteadyStudy) -> tuple[ShapeScore, float, float]:
    """(score of the best shape, size of the forces [N], share of it that this shape misses)."""
    score, forces = study.choice.score, study.points.wrench[:, :2]
    size = float(np.sqrt(np.mean((forces**2).sum(axis=1))))
    error = study.choice.error
    return score, size, error / size if size > 0.0 and math.isfinite(error) else math.inf


def steady_verdict(study: SteadyStudy) -> list[Statement]:
    """Friction from steady windows."""
    if failure := steady_failure(study):
        return [failure]
    score, _, share = _best_shape(study)
    lacks_found = [group_lack for group_lack in study.lack_of_fit.values() if group_lack.found]
    own_groups = [*study.estimates] if study.choice.own else []
    shapes = {
        "names": tuple(study.choice.of(group) for group in own_groups) or (study.choice.chosen,),
        "groups": tuple(own_groups) or ("",),
    }
    friction = Statement(
        "steady_friction",
        WARNING if lacks_found else NOTE,
        numbers={
            "levels": tuple(travel.mean for travel in study.travel.values()),
            "groups": tuple(study.travel),
            "shapes": Statement("shapes", NOTE, numbers=shapes),
            "share": share,
            "ties": tuple(
                other_score.name
                for other_score in study.choice.scores
                if not other_score.told_apart and other_score.name != score.name
            ),
            "misfit": bool(lacks_found),
            "cause": next((str(r.cause) for lack in lacks_found for r in lack.remedies), ""),
            "untested": bool(study.untested),
            "known": lines_verdict(study.estimates)[0],
        },
    )
    changes = tuple(moment.short() for moment in study.moments)
    change_notes = [Statement("force_changes_in_run", WARNING, numbers={"changes": changes})] if changes else []
    return [*change_notes, friction]


def lines_verdict(estimates: Mapping[str, Estimate]) -> list[Statement]:
    """The paper's line on each axis."""
    known_counts = tuple(estimate.numbers_known() for estimate in estimates.values())
    return [Statement("numbers_of_groups", NOTE, numbers={"groups": tuple(estimates), "known": known_counts})]
