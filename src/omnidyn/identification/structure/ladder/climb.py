"""The ladder: from a fit that leaves something out to the robot that leaves least, one remedy at a time.

A step fits the logs anew with each of the best remedies of the diagnosis, and with what is the same as the first of
them. Where none of these leaves only noise, it tries what a diagnosis near the best point tells little of: other shapes
of friction, a usual fall, a limit; and, once it has found the best, the same without the step before. Of those that
predict blocks of the logs which they were not fitted to better than what stands, by more than a standard error, and
that BIC prefers though they are the best of many, the simplest within a standard error of the best is taken, unless BIC
prefers the best by far. Then the fit is diagnosed again. What no robot file holds is never taken; nor is what explains
less than such a cause would. Before all this, where samples are wild, is a loss that bears them; and so it is later,
where only what is left beside a cause shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from omnidyn.identification.lack_of_fit import CHANGE, LOSS, LackOfFit, Remedy
from omnidyn.identification.ladder import STANDS, Ladder, Rung
from omnidyn.identification.output_error.begin import WHOLE
from omnidyn.identification.output_error.conclusion import unexplained
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.free_run import margins_of
from omnidyn.identification.output_error.linear.motion import motions
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.structure.diagnosis import Examined, examine
from omnidyn.identification.structure.ladder.held_out import CLEAR, Errors, errors
from omnidyn.identification.structure.ladder.models import (
    Model,
    Move,
    Purse,
    Untried,
    can,
    moves,
    moves_apart,
    quick_first,
    tried,
)
from omnidyn.identification.structure.missing.candidates import cause, sized
from omnidyn.identification.structure.missing.laws import USUAL_FALL, USUAL_SPEED, other_laws
from omnidyn.identification.structure.missing.remedies import hidden_by
from omnidyn.identification.structure.missing.switches import EACH_WHEEL, FALLS, LIMIT, as_fitted, simpler_first
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS
from omnidyn.model.layout import N_AXES
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement

STEPS = 4  # at most
TRIED = 3  # remedies that are fitted in a step
TOLD_APART = 10.0  # of BIC, from which one of two models is the better one: very strong (Kass & Raftery, 1995)
ROUGHLY = 0.05  # of a first step's chi squared, which is that rough
LIMITS = (0.5, 0.9)  # quantiles of the largest current, from which a limit is looked for
BY_FAR = 50.0  # of BIC, from which a richer model is the better one though a few blocks scatter more than it gains
Fits = Callable[
    [Move, Model, Statement | None], list[Model | Untried]
]  # of a move from a model, and in the place of which step


def climb(
    fit: Fit, solution: Solution, runs: Sequence[Run], progress: FitProgress, names: Sequence[str] | None = None
) -> tuple[Fit, Solution, Ladder]:
    """The best fit of some runs, its solution, and the way to it. fit, solution: of the robot as it was given. names:
    of the group of each run, where there are groups."""
    stands, rungs, calm = Model.first(fit, solution), list[Rung](), False
    seen: dict[str, Examined] | None = None

    def fits(move: Move, before: Model, instead: Statement | None) -> list[Model | Untried]:
        return tried(move, before, runs, names, progress, instead)

    purse, step, most = Purse(), 0, STEPS
    while (step := step + 1) <= most:
        progress.enter(f"step {step} of the ladder: looking for what the model leaves out")
        seen = seen or _examined(stands)
        if not calm:
            made, found = calmed(step, stands, seen, runs, names, progress)
            rungs, calm = [*rungs, *found], bool(found)
            if made is not stands:
                stands, seen, most = made, None, most + 1
                continue
        if unexplained(stands.solution.solver, stands.solution):
            return _ended(stands, rungs, "mend_first")
        lacks = _lacks(seen)
        if not lacks:
            drifts = any(each.diagnosis.lack_of_fit.drifts for each in seen.values())
            return _ended(stands, rungs, "slow_errors" if drifts else "only_noise")
        found, best, after = _climbed(step, stands, seen, lacks, fits, purse)
        rungs += [rung for rung in found if rung.step or not rungs]
        rungs += [_untried(step, each) for each in purse.told()]
        if best is None:
            made, found = (stands, []) if calm else calmed(step, stands, seen, runs, names, progress, gave_up=True)
            rungs, calm = [*rungs, *(rung for rung in found if rung.step)], True
            if made is stands:
                return _ended(stands, rungs, "nothing_pays", **_untaken(lacks))
            best, after, most = made, None, most + 1
        stands, seen = best, after
    return _ended(stands, rungs, "step_limit", steps=STEPS)


def _climbed(
    step: int, stands: Model, seen: Mapping[str, Examined], lacks: Mapping[str, LackOfFit], fits: Fits, purse: Purse
) -> tuple[list[Rung], Model | None, dict[str, Examined] | None]:
    """(the rungs of a step, the model to go on from, None where nothing pays, and its diagnosis, where it is made)."""
    every, found, best, after = list[Model | Untried](), list[Rung](), None, None
    first = {group: offered(lack) for group, lack in lacks.items()}
    far = {group: unseen(lack, stands, group) for group, lack in lacks.items()}
    quick, slow = quick_first(moves(first, stands), stands)
    for asked in (quick, slow, moves_apart(first, stands), moves(far, stands)):
        if best is not None and after is not None and not _lacks(after):  # what rivals it, and no more
            asked = purse.rivals(asked, best) if asked is slow else []
        more = [fit for move in purse.pays(asked, stands) for fit in fits(move, stands, None)]
        if not more:
            continue
        every += more
        found, best = judged(step, stands, every, seen)
        after = _examined(best) if best is not None else None
    if best is not None and best.move is not None and stands.before is not None:  # may the step before go?
        again = purse.pays([best.move], stands.before)
        every += [fit for move in again for fit in fits(move, stands.before, stands.cause)]
        found, best = judged(step, stands, every, seen)
        after = _examined(best) if best is not None and best.instead else after
    return found, best, after


def _examined(model: Model) -> dict[str, Examined]:
    """What a model leaves out, of each group. Of the fit that counts errors as white, for a memory takes up slips; and
    where that finds nothing, as its answer would say: no ladder ends calm on a fit that its answer finds wrong."""
    seen = {group: examine(alone) for group, alone in model.alone.items()}
    return seen if _lacks(seen) else {group: examine(alone) for group, alone in model.answered().items()}


def _lacks(seen: Mapping[str, Examined]) -> dict[str, LackOfFit]:
    """The groups in which something is left out, and what."""
    every = {group: each.diagnosis.lack_of_fit for group, each in seen.items()}
    return {group: lack for group, lack in every.items() if lack.found}


def offered(lack: LackOfFit) -> list[Remedy]:
    """The remedies that are worth a fit, best first: those that a robot file or a fit can hold, and nothing else is the
    same as; and what the first of them cannot be told from."""
    able = simpler_first([r for r in lack.remedies if r.offered and r.key not in (CHANGE, LOSS) and not r.rivals])
    same = [r for r in able[TRIED:] if r.key in able[0].same_as]
    return [*able[:TRIED], *same[: TRIED - 1]]


def unseen(lack: LackOfFit, stands: Model, group: str) -> list[Remedy]:
    """What is far from the fit however little of it there is, and was not among the first remedies of a group."""
    first = {remedy.key for remedy in offered(lack)}
    problem, point = stands.alone[group].solver.problem, stands.alone[group].state.point
    robot = stands.robot(group)
    boxed, limit = any(robot.friction.axes.coulomb), robot.motor.current_limit
    shape = DIRECTION if boxed else BODY_AXES
    found = [Remedy(shape, cause("other_shape", shape), 0.0, 0.0)]
    found.append(Remedy(WHEELS, cause("friction_at_wheels"), 0.0, 0.0))
    found.append(Remedy(EACH_WHEEL, cause("friction_at_each_wheel"), 0.0, 0.0))
    usual = Remedy("", cause("stribeck"), 0.0, 0.0, size=(USUAL_FALL - 1.0,) * N_AXES, at=USUAL_SPEED)
    found += [replace(usual, key=key) for key in other_laws(robot.friction) if key in FALLS]
    if limit is None:
        most = np.concatenate([np.abs(motion.current).max(axis=1) for motion in motions(problem, point)])
        levels = np.quantile(most[most > 0.0], LIMITS).tolist() if most.any() else []
        found += [
            Remedy(LIMIT, sized("current_limit_from", "", limit=lambda _, at: at)(0.0, at), 0.0, 0.0, at=at)
            for at in levels
        ]
    return [remedy for remedy in found if remedy.key not in first and can(remedy.key, robot)]


def judged(
    step: int, stands: Model, every: Sequence[Model | Untried], seen: Mapping[str, Examined]
) -> tuple[list[Rung], Model | None]:
    """(the rungs of a step, that of the model before first; the model to go on from, None where nothing pays).

    seen: of each group what the model before leaves out; its memory is of what is left beside all that residuals
    follow.
    """
    models = [each for each in every if isinstance(each, Model)]
    count, memory = sum(each.tried for each in seen.values()), {group: each.memory for group, each in seen.items()}
    margins = margins_of([each.solution for each in (stands, *models)])
    before = errors(stands.solution, memory, margins, stands.numbers)
    by = [errors(model.solution, memory, margins, model.numbers) for model in models]
    why = [_why_not(model, own, before, count, _beyond(model, seen)) for model, own in zip(models, by, strict=True)]
    paying = [k for k, reason in enumerate(why) if reason is None]
    best = max(paying, key=lambda k: by[k].gain(before)[0], default=None)
    alike = [k for k in paying if best is not None and (_is_alike(by[best], by[k]) or _is_same(by[best], by[k]))]
    taken = min(
        alike, key=lambda k: (by[k].numbers, models[k].shapes, not models[k].instead, by[k].bic(count)), default=None
    )
    rungs = []
    for k, (model, own) in enumerate(zip(models, by, strict=True)):
        same = [o for o in paying if taken in (k, o) and o != k and k in paying and _is_same(by[k], by[o])]
        reason = why[k] or Statement(_why_other(k, taken, alike, same), NOTE)
        others = [models[o].key for o in same] + _not_fitted(models, model, own, before, seen)
        others += hidden_by(model.key, model.solution.solver.problem.columns)
        rungs.append(_rung(step, model, own, before, count, k == taken, reason, others, stands))
    rungs.sort(key=lambda rung: (not rung.taken, -rung.gain))
    rungs = [*{_mark(rung): rung for rung in reversed(rungs)}.values()][::-1]  # a limit found twice is one
    rungs += [_untried(step, each) for each in every if isinstance(each, Untried)]
    first = [Rung(0, "", STANDS, before.numbers, before.size, taken=True, value=stands.value)] if step == 1 else []
    return [*first, *rungs], None if taken is None else models[taken]


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


def _untried(step: int, each: Untried) -> Rung:
    nothing, move = np.nan, each.move
    return Rung(step, move.key, each.cause, 0, nothing, nothing, nothing, nothing, why=each.why, groups=move.groups)


def _why_not(
    model: Model, own: Errors, before: Errors, count: int, beyond: tuple[float, Statement | None]
) -> Statement | None:
    """Why a model is no step up, None where it is one."""
    gain, std = own.gain(before)
    if not gain > CLEAR * std:
        return Statement("predicts_no_better", NOTE)
    if own.bic(count) >= before.bic():
        return Statement("costs_more_than_it_explains", NOTE)
    at_least, other = beyond
    noise = own.left / max(own.rows, 1)
    if (before.left - own.left) / noise - np.log(max(own.rows, 2)) * (own.numbers - before.numbers) < at_least:
        return Statement("other_explains_more", NOTE, numbers={"cause": other})
    if unexplained(model.solution.solver, model.solution):
        return Statement("step_does_not_follow", NOTE)
    return None


def _why_other(k: int, taken: int | None, alike: Sequence[int], same: Sequence[int]) -> str:
    """The code of why a model that pays is taken or not."""
    if k == taken:
        return "pays"
    if same:
        return "not_distinguishable"
    return "as_good_not_simpler" if k in alike else "pays_less"


def _is_alike(best: Errors, other: Errors) -> bool:
    """Whether another model predicts as well as the best one, within a standard error, and is about as likely."""
    gain, std = best.gain(other)
    return best is other or (gain <= CLEAR * std and other.bic() - best.bic() < BY_FAR)


def _is_same(one: Errors, other: Errors) -> bool:
    """Whether the logs cannot tell two apart: as likely, with as many numbers."""
    return abs(one.bic() - other.bic()) < TOLD_APART


def _not_fitted(
    models: Sequence[Model], model: Model, own: Errors, before: Errors, seen: Mapping[str, Examined]
) -> list[str]:
    """What the diagnosis could not tell from a model, was not fitted, and might explain as much as the model does."""
    assert model.move is not None
    fitted, noise = {tried.key for tried in models}, own.left / max(own.rows, 1)
    enough = (1.0 - ROUGHLY) * (before.left - own.left) / noise - TOLD_APART
    return [
        r.key
        for group, remedy in model.move.remedies.items()
        for r in seen[group].diagnosis.lack_of_fit.remedies
        if r.key in remedy.same_as and r.key not in fitted and r.chi2 >= enough
    ]


def _rung(
    step: int,
    model: Model,
    own: Errors,
    before: Errors,
    count: int,
    taken: bool,
    why: Statement,
    same: Sequence[str],
    stands: Model,
) -> Rung:
    gain, std = own.gain(before)
    others = dict.fromkeys(key for key in same if taken and key != model.key)
    found = as_fitted(model.cause, stands.value, model.value)
    if model.instead is not None:
        found = Statement("instead_of", NOTE, numbers={"cause": found, "step": model.instead})
    return Rung(
        step,
        model.key,
        found,
        own.numbers,
        own.size,
        gain,
        std,
        own.bic(count) - before.bic(),
        taken,
        why,
        tuple(others),
        model.instead is not None,
        model.value,
        model.move.groups if model.move else (),
    )


def _beyond(model: Model, seen: Mapping[str, Examined]) -> tuple[float, Statement | None]:
    """(what the best cause explains that is never taken, less what its numbers cost, in chi squared; that cause): of
    all groups in which something was switched on."""
    assert model.move is not None
    found = [_beyond_one(seen[group]) for group in model.move.remedies]
    worth = [value for value, _ in found if value > 0.0]
    most, best = max(found, key=lambda one: one[0])
    return (sum(worth), best) if worth else (most, best)


def _beyond_one(seen: Examined) -> tuple[float, Statement | None]:
    lack = seen.diagnosis.lack_of_fit
    others = [r for r in lack.remedies if not r.offered or r.key == CHANGE]
    worth = [(r.chi2 - np.log(max(seen.rows, 2)) * r.numbers, r.cause) for r in others]
    return max(worth, key=lambda one: one[0], default=(-np.inf, None))


def _untaken(lacks: Mapping[str, LackOfFit]) -> dict[str, Any]:
    """What was not taken because no robot file holds it, of each group."""
    found = {group: looks for group, lack in lacks.items() if (looks := _looks_like(lack)) is not None}
    groups = ("" if group == WHOLE else group for group in found)
    return {"groups": tuple(groups), "causes": tuple(found.values())}


def _looks_like(lack: LackOfFit) -> Statement | None:
    first = next(iter(lack.causes), None)
    if first is None:
        return None
    if first.key == CHANGE:
        return Statement("looks_like_change", NOTE, numbers={"cause": first.cause})
    if not first.offered:
        return Statement("looks_like", NOTE, numbers={"causes": (first.cause,)})
    if first.rivals:
        return Statement("looks_like", NOTE, numbers={"causes": tuple(cause("cause", key) for key in first.rivals)})
    return None


def _ended(stands: Model, rungs: Sequence[Rung], why: str, **numbers: Any) -> tuple[Fit, Solution, Ladder]:
    return stands.fit, stands.solution, Ladder(tuple(rungs), Statement(why, NOTE, numbers=numbers))


# A step where samples are wild: a fit that counts them little, before any other, for they hide causes


def calmed(
    step: int,
    stands: Model,
    seen: Mapping[str, Examined],
    runs: Sequence[Run],
    names: Sequence[str] | None,
    progress: FitProgress,
    gave_up: bool = False,
) -> tuple[Model, list[Rung]]:
    """(the model to go on from, the rungs of a step): of Student's t where that predicts better, by more than a
    standard error, what is not wild; as it stands, and no rungs, where no sample is wild, or a cause gains more.
    gave_up: no such cause paid. It counts as no number of the fit."""
    own = {
        group: remedy
        for group, each in seen.items()
        for remedy in each.diagnosis.lack_of_fit.remedies
        if remedy.key == LOSS and (gave_up or remedy.gain > _best_cause(each.diagnosis.lack_of_fit))
    }
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
