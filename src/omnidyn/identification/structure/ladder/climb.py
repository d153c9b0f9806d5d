"""The ladder: from a fit that leaves something out to the robot that leaves least, one remedy at a time.

A step fits the logs anew with each of the best remedies of the diagnosis, and with what is the same as the first of
them. Where none of these leaves only noise, it tries what a diagnosis near the best point tells little of: other shapes
of friction, a usual fall, a limit; and, once it has found the best, the same without the step before. Of those that
predict blocks of the logs which they were not fitted to better than what stands, by more than a standard error, and
that BIC prefers though they are the best of many, the simplest within a standard error of the best is taken, unless BIC
prefers the best by far. Then the fit is diagnosed again. What no robot file holds is never taken; nor is what explains
less than such a cause would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.document import all_of
from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import UNOFFERED, LackOfFit, Remedy
from omnidyn.identification.ladder import STANDS, Ladder, Rung
from omnidyn.identification.output_error.conclusion import unexplained
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.solve.progress import Progress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.question import Question
from omnidyn.identification.structure.candidates import CHANGE
from omnidyn.identification.structure.diagnosis import Examined, examine
from omnidyn.identification.structure.ladder.held_out import Errors, errors, margins_of
from omnidyn.identification.structure.laws import FALL, FALL_WORDS, USUAL_FALL, USUAL_SPEED, may_fall
from omnidyn.identification.structure.motion import motions
from omnidyn.identification.structure.switches import LIMIT, Switch, simpler_first, switches, told
from omnidyn.model.friction import WheelFriction
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.run import Run

STEPS = 4  # at most
TRIED = 3  # remedies that are fitted in a step
TOLD_APART, ROUGHLY = 6.0, 0.05  # of BIC, from which one of two models is the better one; of a first step's chi squared
LIMITS = (0.5, 0.9)  # quantiles of the largest current, from which a limit is looked for
CLEAR = 1.0  # standard errors of its gain by which a step must pay
BY_FAR = 50.0  # of BIC, from which a richer model is the better one though a few blocks scatter more than it gains


@dataclass(frozen=True, eq=False)
class Model:
    """A fit, what it came to, and the robot and question it began from. numbers: see `Switch`. before: what stood when
    it was tried; instead: of which step it is in the place, in words."""

    fit: Fit
    solution: Solution
    robot: Robot
    question: Question
    remedy: Remedy | None = None
    words: str = STANDS
    numbers: int = 0
    before: Model | None = None
    instead: str = ""

    @property
    def key(self) -> str:
        """Of what was switched on last."""
        return self.remedy.key if self.remedy else ""

    @property
    def value(self) -> dict[str, float]:
        """What was fitted."""
        problem, values = self.solution.solver.problem, self.solution.state.point.values
        return dict(zip(problem.names, values.tolist(), strict=True))


def climb(fit: Fit, solution: Solution, runs: Sequence[Run], progress: Progress) -> tuple[Fit, Solution, Ladder]:
    """The best fit of some runs, its solution, and the way to it. fit, solution: of the robot as it was given."""
    stands, rungs = Model(fit, solution, fit.groups[0].robot, fit.question), list[Rung]()
    seen: Examined | None = None
    for step in range(1, STEPS + 1):
        if unexplained(stands.solution.solver, stands.solution):
            return _ended(
                stands, rungs, "the model does not follow the logs: first mend signs, units, the order of wheels"
            )
        progress.doing(f"step {step} of the ladder: looking for what the model leaves out")
        seen = seen or examine(stands.solution)
        lack = seen.diagnosis.lack_of_fit
        if not lack.found:
            return _ended(stands, rungs, "the residuals hold nothing but noise")
        count, beyond = seen.tried, _beyond(lack, seen.rows)
        tried, found, best, after = [], list[Rung](), None, None
        for worth in (offered(lack), unseen(lack, stands)):
            tried += [each for remedy in worth for each in _tried(remedy, stands, runs, progress)]
            if tried:
                found, best = judged(step, stands, tried, seen.memory, count, beyond, lack)
            after = examine(best.solution) if best is not None else None
            if after is not None and not after.diagnosis.lack_of_fit.found:
                break
        if best is not None and best.remedy is not None and stands.before is not None:  # may the step before go?
            tried += _tried(best.remedy, stands.before, runs, progress, stands.words)
            found, best = judged(step, stands, tried, seen.memory, count, beyond, lack)
            after = examine(best.solution) if best is not None and best.instead else after
        rungs += found
        if best is None:
            return _ended(stands, rungs, f"nothing that was tried pays{_said(lack)}")
        stands, seen = best, after
    return _ended(stands, rungs, f"{STEPS} steps are the most that it takes")


def offered(lack: LackOfFit) -> list[Remedy]:
    """The remedies that are worth a fit, best first: those that a robot file or a fit can hold, and nothing else is the
    same as; and what the first of them cannot be told from."""
    able = simpler_first([r for r in lack.remedies if r.offered and r.key != CHANGE and not r.rivals])
    same = [r for r in able[TRIED:] if r.key in able[0].same_as]
    return [*able[:TRIED], *same[: TRIED - 1]]


def unseen(lack: LackOfFit, stands: Model) -> list[Remedy]:
    """What is far from the fit however little of it there is, and was not among the first remedies."""
    first = {remedy.key for remedy in offered(lack)}
    problem, point = stands.solution.solver.problem, stands.solution.state.point
    robot = problem.robot_at(point.values)
    boxed, limit = any(robot.friction.axes.coulomb), robot.motor.current_limit
    shape = (DIRECTION, "an ellipse") if boxed else (BODY_AXES, "a box")
    found = [Remedy(shape[0], f"Coulomb friction of another shape, {shape[1]}", 0.0, 0.0)]
    if robot.friction.wheels == WheelFriction():
        found.append(Remedy(WHEELS, "friction at the wheels", 0.0, 0.0))
    usual = Remedy("", FALL_WORDS, 0.0, 0.0, size=(USUAL_FALL - 1.0,) * N_AXES, at=USUAL_SPEED)
    found += [replace(usual, key=f"{table}.{FALL}") for table in may_fall(robot.friction)]
    if limit is None:
        most = np.concatenate([np.abs(motion.current).max(axis=1) for motion in motions(problem, point)])
        levels = np.quantile(most[most > 0.0], LIMITS).tolist() if most.any() else []
        found += [Remedy(LIMIT, f"a current limit, from {at:.2g} A", 0.0, 0.0, at=at) for at in levels]
    return [remedy for remedy in found if remedy.key not in first]


def _tried(
    remedy: Remedy, stands: Model, runs: Sequence[Run], progress: Progress, instead: str = ""
) -> list[Model | tuple[Remedy, Switch, str]]:
    """A remedy, fitted in every way in which it can be switched on; (remedy, way, why not) where it cannot."""
    found: list[Model | tuple[Remedy, Switch, str]] = []
    for way in switches(remedy, stands.robot, stands.question, stands.solution):
        aside = progress.aside(f"the ladder tries {way.words}")
        try:
            fit = Fit.of(runs, way.robot, way.question, progress=aside)
            solution, _ = fit.with_levels(fit.solve(aside))
        except OmnidynError as error:
            found.append((remedy, way, str(error)))
            continue
        numbers = stands.numbers + way.numbers
        found.append(Model(fit, solution, way.robot, way.question, remedy, way.words, numbers, stands, instead))
    return found


def judged(
    step: int, stands: Model, tried: Sequence[Model | tuple[Remedy, Switch, str]], memory: Sequence[AutoRegression],
    count: int, beyond: tuple[float, str], lack: LackOfFit,
) -> tuple[list[Rung], Model | None]:  # fmt: skip
    """(the rungs of a step, that of the model before first; the model to go on from, None where nothing pays).

    memory: of each column, of what is left beside all that residuals follow. count: of causes that were looked at.
    beyond: (what the best cause explains that no robot file holds, less what its numbers cost; its words).
    """
    models = [each for each in tried if isinstance(each, Model)]
    margins = margins_of([each.solution for each in (stands, *models)])
    before = errors(stands.solution, memory, margins, stands.numbers)
    seen = [errors(each.solution, memory, margins, each.numbers) for each in models]
    why = [_why_not(each, own, before, count, beyond) for each, own in zip(models, seen, strict=True)]
    paying = [k for k, words in enumerate(why) if not words]
    best = max(paying, key=lambda k: seen[k].gain(before)[0], default=None)
    alike = [
        k for k in paying
        if best is not None and (_is_alike(seen[best], seen[k]) or _is_same(seen[best], seen[k]))
    ]  # fmt: skip
    taken = min(alike, key=lambda k: (seen[k].numbers, not models[k].instead, seen[k].bic(count)), default=None)
    rungs = []
    for k, (each, own) in enumerate(zip(models, seen, strict=True)):
        same = [o for o in paying if taken in (k, o) and o != k and k in paying and _is_same(seen[k], seen[o])]
        words = why[k] or _why_other(k, taken, alike, same)
        others = [models[o].key for o in same] + _not_fitted(models, each, own, before, lack)
        rungs.append(_rung(step, each, own, before, count, k == taken, words, others, stands))
    rungs.sort(key=lambda rung: (not rung.taken, -rung.gain))
    rungs = [*{(rung.key, rung.words): rung for rung in reversed(rungs)}.values()][::-1]  # a limit found twice is one
    rungs += [
        Rung(step, remedy.key, way.words, 0, np.nan, np.nan, np.nan, np.nan, why=f"cannot be fitted: {words}")
        for each in tried if isinstance(each, tuple) for remedy, way, words in [each]
    ]  # fmt: skip
    first = [Rung(0, "", STANDS, before.numbers, before.size, taken=True, value=stands.value)] if step == 1 else []
    return [*first, *rungs], None if taken is None else models[taken]


def _why_not(model: Model, own: Errors, before: Errors, count: int, beyond: tuple[float, str]) -> str:
    """Why a model is no step up, "" where it is one."""
    gain, std = own.gain(before)
    if not gain > CLEAR * std:
        return "predicts what it was not fitted to no better"
    if own.bic(count) >= before.bic():
        return "explains less than its numbers cost"
    at_least, words = beyond
    noise = own.left / max(own.rows, 1)
    if (before.left - own.left) / noise - np.log(max(own.rows, 2)) * (own.numbers - before.numbers) < at_least:
        return f"{words} would explain more"
    if unexplained(model.solution.solver, model.solution):
        return "does not follow the logs"
    return ""


def _why_other(k: int, taken: int | None, alike: Sequence[int], same: Sequence[int]) -> str:
    if k == taken:
        return "pays"
    if same:
        return "the same to these logs"
    return "as good within a standard error, not simpler" if k in alike else "pays less"


def _is_alike(best: Errors, other: Errors) -> bool:
    """Whether another model predicts as well as the best one, within a standard error, and is about as likely."""
    gain, std = best.gain(other)
    return best is other or (gain <= CLEAR * std and other.bic() - best.bic() < BY_FAR)


def _is_same(one: Errors, other: Errors) -> bool:
    """Whether the logs cannot tell two apart: as likely, with as many numbers."""
    return abs(one.bic() - other.bic()) < TOLD_APART


def _not_fitted(models: Sequence[Model], model: Model, own: Errors, before: Errors, lack: LackOfFit) -> list[str]:
    """What the diagnosis could not tell from a model, was not fitted, and might explain as much as the model does."""
    assert model.remedy is not None
    fitted, noise = {each.key for each in models}, own.left / max(own.rows, 1)
    enough = (1.0 - ROUGHLY) * (before.left - own.left) / noise - TOLD_APART
    return [
        r.key for r in lack.remedies
        if r.key in model.remedy.same_as and r.key not in fitted and r.chi2 >= enough
    ]  # fmt: skip


def _rung(
    step: int, model: Model, own: Errors, before: Errors, count: int, taken: bool, why: str, same: Sequence[str],
    stands: Model,
) -> Rung:  # fmt: skip
    gain, std = own.gain(before)
    others = dict.fromkeys(key for key in same if taken and key != model.key)
    words = told(model.words, stands.value, model.value)
    words += f" in the place of {model.instead}" if model.instead else ""
    return Rung(
        step, model.key, words, own.numbers, own.size, gain, std,
        own.bic(count) - before.bic(), taken, why, tuple(others), bool(model.instead),
        model.value,
    )  # fmt: skip


def _beyond(lack: LackOfFit, rows: int) -> tuple[float, str]:
    """(what the best cause explains that is never taken, less what its numbers cost, in chi squared; its words)."""
    others = [r for r in lack.remedies if not r.offered or r.key == CHANGE]
    worth = [(r.chi2 - np.log(max(rows, 2)) * r.numbers, r.words) for r in others]
    return max(worth, default=(-np.inf, ""))


def _why_none(lack: LackOfFit) -> str:
    if not lack.remedies:
        return "no cause that is known here explains what is left"
    return f"nothing can be switched on for what is left{_said(lack)}"


def _said(lack: LackOfFit) -> str:
    """What was not taken because no robot file holds it."""
    first = next(iter(lack.remedies), None)
    if first is None:
        return ""
    if first.key == CHANGE:
        return f"; it looks like {first.words}: fit the parts as logs of their own"
    if not first.offered:
        return f"; it looks like {first.words}, which no law that is known here holds"
    if first.rivals:
        return f"; it may be {all_of([UNOFFERED[key] for key in first.rivals])}, which no law that is known here holds"
    return ""


def _ended(stands: Model, rungs: Sequence[Rung], why: str) -> tuple[Fit, Solution, Ladder]:
    return stands.fit, stands.solution, Ladder(tuple(rungs), why)
