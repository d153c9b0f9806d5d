"""The ladder: from a fit that leaves something out to the robot that leaves least, one remedy at a time.

A step fits the logs anew with each of the best remedies of the diagnosis, and with what is the same as the first of
them. Where none of these leaves only noise, it tries what a diagnosis near the best point tells little of: other shapes
of friction, a usual fall, a limit; and, once it has found the best, the same without the step before. Of those that
predict blocks of the logs which they were not fitted to better than what stands, by more than a standard error, and
that BIC prefers though they are the best of many, the simplest within a standard error of the best is taken, unless BIC
prefers the best by far. Then the fit is diagnosed again. What no robot file holds is never taken; nor is what explains
less than such a cause would. Before all this, where there are outliers, is a loss that bears them; and so it is later,
where only what is left beside a cause shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from omnidyn.identification.lack_of_fit import LOSS, OF_LOGS, LackOfFit, Remedy
from omnidyn.identification.ladder import STANDS, Ladder, Rung
from omnidyn.identification.output_error.begin import ALL_LOGS
from omnidyn.identification.output_error.conclusion import unexplained
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.driven_motion import motions
from omnidyn.identification.output_error.linear.free_run import margins_of
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.structure.diagnosis import Examined, examine
from omnidyn.identification.structure.ladder.held_out import Errors, errors
from omnidyn.identification.structure.ladder.models import Model, Move, Untried, can, moves, moves_apart, tried
from omnidyn.identification.structure.ladder.robust_step import calmed
from omnidyn.identification.structure.ladder.slip_budget import Purse, quick_first
from omnidyn.identification.structure.missing.candidates import cause, sized
from omnidyn.identification.structure.missing.computed_twist import hidden_by
from omnidyn.identification.structure.missing.laws import USUAL_FALL, USUAL_SPEED, other_laws
from omnidyn.identification.structure.missing.switches import EACH_WHEEL, FALLS, LIMIT, as_fitted, simpler_first
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS
from omnidyn.model.layout import N_AXES
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement

STEPS = 4  # at most
TRIED_REMEDIES = 3  # remedies that are fitted in a step
BIC_MARGIN = 10.0  # of BIC, from which one of two models is the better one: very strong (Kass & Raftery, 1995)
ROUGH_SHARE = 0.05  # of a first step's chi squared, which is that rough
LIMITS = (0.5, 0.9)  # quantiles of the largest current, from which a limit is looked for
CLEAR_BIC_MARGIN = (
    50.0  # of BIC, from which a richer model is the better one though a few blocks scatter more than it gains
)
Fits = Callable[
    [Move, Model, Statement | None], list[Model | Untried]
]  # of a move from a model, and in the place of which step


def climb(
    fit: Fit, solution: Solution, runs: Sequence[Run], progress: FitProgress, names: Sequence[str] | None = None
) -> tuple[Fit, Solution, Ladder]:
    """The best fit of some runs, its solution, and the way to it. fit, solution: of the robot as it was given. names:
    of the group of each run, where there are groups."""
    base_model, rungs, is_calm = Model.first(fit, solution), list[Rung](), False
    examinations: dict[str, Examined] | None = None

    def fits(move: Move, start_model: Model, replaced_step: Statement | None) -> list[Model | Untried]:
        return tried(move, start_model, runs, names, progress, replaced_step)

    purse, step, step_limit = Purse(), 0, STEPS
    while (step := step + 1) <= step_limit:
        progress.enter(f"step {step} of the ladder: looking for what the model leaves out")
        examinations = examinations or _examined(base_model)
        if not is_calm:
            calm_model, new_rungs = calmed(step, base_model, examinations, runs, names, progress)
            rungs, is_calm = [*rungs, *new_rungs], bool(new_rungs)
            if calm_model is not base_model:
                base_model, examinations, step_limit = calm_model, None, step_limit + 1
                continue
        if unexplained(base_model.solution.solver, base_model.solution):
            return _ended(base_model, rungs, "mend_first")
        lack_by_group = _lacks(examinations)
        if not lack_by_group:
            drifts = any(examination.diagnosis.lack_of_fit.drifts for examination in examinations.values())
            return _ended(base_model, rungs, "slow_errors" if drifts else "only_noise")
        new_rungs, best, next_examinations = _climbed(step, base_model, examinations, lack_by_group, fits, purse)
        rungs += [rung for rung in new_rungs if rung.step or not rungs]
        rungs += [_untried(step, examination) for examination in purse.untried()]
        if best is None:
            calm_model, new_rungs = (
                (base_model, [])
                if is_calm
                else calmed(step, base_model, examinations, runs, names, progress, gave_up=True)
            )
            rungs, is_calm = [*rungs, *(rung for rung in new_rungs if rung.step)], True
            if calm_model is base_model:
                return _ended(base_model, rungs, "nothing_pays", **_untaken(lack_by_group))
            best, next_examinations, step_limit = calm_model, None, step_limit + 1
        base_model, examinations = best, next_examinations
    return _ended(base_model, rungs, "step_limit", steps=STEPS)


def _climbed(
    step: int,
    base_model: Model,
    examinations: Mapping[str, Examined],
    lack_by_group: Mapping[str, LackOfFit],
    fits: Fits,
    purse: Purse,
) -> tuple[list[Rung], Model | None, dict[str, Examined] | None]:
    """(the rungs of a step, the model to go on from, None where nothing pays, and its diagnosis, where it is made)."""
    tried_models, new_rungs, best, next_examinations = list[Model | Untried](), list[Rung](), None, None
    first = {group: offered(lack) for group, lack in lack_by_group.items()}
    unseen_by_group = {group: unseen(lack, base_model, group) for group, lack in lack_by_group.items()}
    quick, slow = quick_first(moves(first, base_model), base_model)
    for candidate_moves in (quick, slow, moves_apart(first, base_model), moves(unseen_by_group, base_model)):
        if (
            best is not None and next_examinations is not None and not _lacks(next_examinations)
        ):  # what rivals it, and no more
            candidate_moves = purse.rivals(candidate_moves, best) if candidate_moves is slow else []
        new_models = [fit for move in purse.pays(candidate_moves, base_model) for fit in fits(move, base_model, None)]
        if not new_models:
            continue
        tried_models += new_models
        new_rungs, best = judged(step, base_model, tried_models, examinations)
        next_examinations = _examined(best) if best is not None else None
    if best is not None and best.move is not None and base_model.base_model is not None:  # may the step before go?
        repeated_moves = purse.pays([best.move], base_model.base_model)
        tried_models += [fit for move in repeated_moves for fit in fits(move, base_model.base_model, base_model.cause)]
        new_rungs, best = judged(step, base_model, tried_models, examinations)
        next_examinations = _examined(best) if best is not None and best.replaced_step else next_examinations
    return new_rungs, best, next_examinations


def _examined(model: Model) -> dict[str, Examined]:
    """What a model leaves out, of each group. Of the fit that counts errors as white, for a memory takes up slips; and
    where that finds nothing, as its answer would say: no ladder ends calm on a fit that its answer finds wrong."""
    examinations = {group: examine(group_fit) for group, group_fit in model.alone.items()}
    return (
        examinations
        if _lacks(examinations)
        else {group: examine(group_fit) for group, group_fit in model.answered().items()}
    )


def _lacks(examinations: Mapping[str, Examined]) -> dict[str, LackOfFit]:
    """The groups in which something is left out, and what."""
    lack_by_group = {group: examination.diagnosis.lack_of_fit for group, examination in examinations.items()}
    return {group: lack for group, lack in lack_by_group.items() if lack.found}


def offered(lack: LackOfFit) -> list[Remedy]:
    """The remedies that are worth a fit, best first: those that a robot file or a fit can hold, and nothing else is the
    same as; and what the first of them cannot be told from."""
    usable_remedies = simpler_first(
        [r for r in lack.remedies if r.offered and r.key not in (*OF_LOGS, LOSS) and not r.rivals]
    )
    rival_remedies = [r for r in usable_remedies[TRIED_REMEDIES:] if r.key in usable_remedies[0].same_as]
    return [*usable_remedies[:TRIED_REMEDIES], *rival_remedies[: TRIED_REMEDIES - 1]]


def unseen(lack: LackOfFit, base_model: Model, group: str) -> list[Remedy]:
    """What is far from the fit however little of it there is, and was not among the first remedies of a group."""
    first = {remedy.key for remedy in offered(lack)}
    problem, point = base_model.alone[group].solver.problem, base_model.alone[group].state.point
    robot = base_model.robot(group)
    boxed, limit = any(robot.friction.axes.coulomb), robot.motor.current_limit
    shape = DIRECTION if boxed else BODY_AXES
    extra_remedies = [Remedy(shape, cause("other_shape", shape), 0.0, 0.0)]
    extra_remedies.append(Remedy(WHEELS, cause("friction_at_wheels"), 0.0, 0.0))
    extra_remedies.append(Remedy(EACH_WHEEL, cause("friction_at_each_wheel"), 0.0, 0.0))
    usual_fall = Remedy("", cause("stribeck"), 0.0, 0.0, size=(USUAL_FALL - 1.0,) * N_AXES, at=USUAL_SPEED)
    extra_remedies += [replace(usual_fall, key=key) for key in other_laws(robot.friction) if key in FALLS]
    if limit is None:
        largest_currents = np.concatenate([np.abs(motion.current).max(axis=1) for motion in motions(problem, point)])
        levels = (
            np.quantile(largest_currents[largest_currents > 0.0], LIMITS).tolist() if largest_currents.any() else []
        )
        extra_remedies += [
            Remedy(
                LIMIT,
                sized("current_limit_from", "", limit=lambda _, at_value: at_value)(0.0, limit_value),
                0.0,
                0.0,
                at=limit_value,
            )
            for limit_value in levels
        ]
    return [remedy for remedy in extra_remedies if remedy.key not in first and can(remedy.key, robot)]


def judged(
    step: int, base_model: Model, tried_models: Sequence[Model | Untried], examinations: Mapping[str, Examined]
) -> tuple[list[Rung], Model | None]:
    """(the rungs of a step, that of the model before first; the model to go on from, None where nothing pays).

    examinations: of each group what the model before leaves out; its memory is of what is left beside all that
    residuals follow.
    """
    models = [tried_model for tried_model in tried_models if isinstance(tried_model, Model)]
    count, memory = (
        sum(examination.cause_count for examination in examinations.values()),
        {group: examination.memory for group, examination in examinations.items()},
    )
    margins = margins_of([model_here.solution for model_here in (base_model, *models)])
    base_errors = errors(base_model.solution, memory, margins, base_model.numbers)
    errors_by_model = [errors(model.solution, memory, margins, model.numbers) for model in models]
    reasons = [
        _why_not(model, errors_k, base_errors, count, _beyond(model, examinations))
        for model, errors_k in zip(models, errors_by_model, strict=True)
    ]
    paying = [k for k, reason in enumerate(reasons) if reason is None]
    # Of those that pay the least error in all: what shows in few blocks is no smaller for that.
    best = min(paying, key=lambda k: errors_by_model[k].size, default=None)
    similar_models = [
        k
        for k in paying
        if best is not None
        and (
            _is_alike(errors_by_model[best], errors_by_model[k]) or _is_same(errors_by_model[best], errors_by_model[k])
        )
    ]
    best_index = min(
        similar_models,
        key=lambda k: (
            errors_by_model[k].numbers,
            models[k].shapes,
            not models[k].replaced_step,
            errors_by_model[k].bic(count),
        ),
        default=None,
    )
    rungs = []
    for k, (model, model_errors) in enumerate(zip(models, errors_by_model, strict=True)):
        equal_models = [
            o
            for o in paying
            if best_index in (k, o) and o != k and k in paying and _is_same(errors_by_model[k], errors_by_model[o])
        ]
        reason = reasons[k] or Statement(_why_other(k, best_index, similar_models, equal_models), NOTE)
        rival_names = [models[o].key for o in equal_models] + _not_fitted(
            models, model, model_errors, base_errors, examinations
        )
        rival_names += hidden_by(model.key, model.solution.solver.problem.columns)
        rungs.append(
            _rung(step, model, model_errors, base_errors, count, k == best_index, reason, rival_names, base_model)
        )
    rungs.sort(key=lambda rung: (not rung.taken, -rung.gain))
    rungs = [*{_mark(rung): rung for rung in reversed(rungs)}.values()][::-1]  # a limit found twice is one
    rungs += [_untried(step, tried_model) for tried_model in tried_models if isinstance(tried_model, Untried)]
    first = (
        [Rung(0, "", STANDS, base_errors.numbers, base_errors.size, taken=True, value=base_model.value)]
        if step == 1
        else []
    )
    return [*first, *rungs], None if best_index is None else models[best_index]


def _mark(rung: Rung) -> tuple[Any, ...]:
    """What two rungs have in common that found the same: their key and cause, its numbers to three digits."""

    def rounded(value: Any) -> Any:
        if isinstance(value, Statement):
            return value.code, value.subject, *map(rounded, value.numbers.values())
        return (
            tuple(map(rounded, value))
            if isinstance(value, tuple)
            else (f"{value:.3g}" if isinstance(value, float) else value)
        )

    return rung.key, rounded(rung.cause)


def _untried(step: int, untried_model: Untried) -> Rung:
    no_number, move = np.nan, untried_model.move
    return Rung(
        step,
        move.key,
        untried_model.cause,
        0,
        no_number,
        no_number,
        no_number,
        no_number,
        why=untried_model.reason,
        groups=move.groups,
    )


def _why_not(
    model: Model, model_errors: Errors, base_errors: Errors, count: int, untaken_gain: tuple[float, Statement | None]
) -> Statement | None:
    """Why a model is no step up, None where it is one."""
    comparison = model_errors.beside(base_errors)
    if not comparison.is_better:
        return Statement("predicts_no_better", NOTE, numbers=comparison.counts)
    if model_errors.bic(count) >= base_errors.bic():
        return Statement("costs_more_than_it_explains", NOTE)
    at_least, untaken_cause = untaken_gain
    noise = model_errors.square / max(model_errors.rows, 1)
    if (base_errors.square - model_errors.square) / noise - np.log(max(model_errors.rows, 2)) * (
        model_errors.numbers - base_errors.numbers
    ) < at_least:
        return Statement("other_explains_more", NOTE, numbers={"cause": untaken_cause})
    if unexplained(model.solution.solver, model.solution):
        return Statement("step_does_not_follow", NOTE)
    return None


def _why_other(k: int, best_index: int | None, similar_models: Sequence[int], equal_models: Sequence[int]) -> str:
    """The code of why a model that pays is taken or not."""
    if k == best_index:
        return "pays"
    if equal_models:
        return "not_distinguishable"
    return "as_good_not_simpler" if k in similar_models else "pays_less"


def _is_alike(best: Errors, best_errors: Errors) -> bool:
    """Whether held-out blocks do not tell another model from the best one, and it is about as likely."""
    return best is best_errors or (
        not best.beside(best_errors).is_better and best_errors.bic() - best.bic() < CLEAR_BIC_MARGIN
    )


def _is_same(left_errors: Errors, right_errors: Errors) -> bool:
    """Whether the logs cannot tell two apart: as likely, with as many numbers."""
    return abs(left_errors.bic() - right_errors.bic()) < BIC_MARGIN


def _not_fitted(
    models: Sequence[Model],
    model: Model,
    model_errors: Errors,
    base_errors: Errors,
    examinations: Mapping[str, Examined],
) -> list[str]:
    """What the diagnosis could not tell from a model, was not fitted, and might explain as much as the model does."""
    assert model.move is not None
    fitted, noise = {model_k.key for model_k in models}, model_errors.square / max(model_errors.rows, 1)
    least_chi2 = (1.0 - ROUGH_SHARE) * (base_errors.square - model_errors.square) / noise - BIC_MARGIN
    return [
        r.key
        for group, remedy in model.move.remedies.items()
        for r in examinations[group].diagnosis.lack_of_fit.remedies
        if r.key in remedy.same_as and r.key not in fitted and r.chi2 >= least_chi2
    ]


def _rung(
    step: int,
    model: Model,
    model_errors: Errors,
    base_errors: Errors,
    count: int,
    is_taken: bool,
    reason: Statement,
    equal_keys: Sequence[str],
    base_model: Model,
) -> Rung:
    comparison = model_errors.beside(base_errors)
    rival_keys = dict.fromkeys(key for key in equal_keys if is_taken and key != model.key)
    shown_cause = as_fitted(model.cause, base_model.value, model.value)
    if model.replaced_step is not None:
        shown_cause = Statement("instead_of", NOTE, numbers={"cause": shown_cause, "step": model.replaced_step})
    return Rung(
        step,
        model.key,
        shown_cause,
        model_errors.numbers,
        model_errors.size,
        comparison.gain,
        comparison.std,
        model_errors.bic(count) - base_errors.bic(),
        is_taken,
        reason,
        tuple(rival_keys),
        model.replaced_step is not None,
        model.value,
        model.move.groups if model.move else (),
    )


def _beyond(model: Model, examinations: Mapping[str, Examined]) -> tuple[float, Statement | None]:
    """(what the best cause explains that is never taken, less what its numbers cost, in chi squared; that cause): of
    all groups in which something was switched on."""
    assert model.move is not None
    gains_and_causes = [_beyond_one(examinations[group]) for group in model.move.remedies]
    positive_gains = [value for value, _ in gains_and_causes if value > 0.0]
    largest_gain, best = max(gains_and_causes, key=lambda pair: pair[0])
    return (sum(positive_gains), best) if positive_gains else (largest_gain, best)


def _beyond_one(examination: Examined) -> tuple[float, Statement | None]:
    lack = examination.diagnosis.lack_of_fit
    unusable_remedies = [r for r in lack.remedies if not r.offered or r.key in OF_LOGS]
    gains_and_causes = [(r.chi2 - np.log(max(examination.rows, 2)) * r.numbers, r.cause) for r in unusable_remedies]
    return max(gains_and_causes, key=lambda pair: pair[0], default=(-np.inf, None))


def _untaken(lack_by_group: Mapping[str, LackOfFit]) -> dict[str, Any]:
    """What was not taken because no robot file holds it, of each group."""
    untaken_by_group = {
        group: statement for group, lack in lack_by_group.items() if (statement := _looks_like(lack)) is not None
    }
    groups = ("" if group == ALL_LOGS else group for group in untaken_by_group)
    return {"groups": tuple(groups), "causes": tuple(untaken_by_group.values())}


def _looks_like(lack: LackOfFit) -> Statement | None:
    first = next(iter(lack.causes), None)
    if first is None:
        return None
    if first.key in OF_LOGS:
        return Statement("looks_like_change", NOTE, numbers={"cause": first.cause})
    if not first.offered:
        return Statement("looks_like", NOTE, numbers={"causes": (first.cause,)})
    if first.rivals:
        return Statement("looks_like", NOTE, numbers={"causes": tuple(cause("cause", key) for key in first.rivals)})
    return None


def _ended(base_model: Model, rungs: Sequence[Rung], reason: str, **numbers: Any) -> tuple[Fit, Solution, Ladder]:
    return base_model.fit, base_model.solution, Ladder(tuple(rungs), Statement(reason, NOTE, numbers=numbers))
