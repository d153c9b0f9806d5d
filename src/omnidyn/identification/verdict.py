"""What an identification came to, in a sentence: whether the model follows, and how well its numbers are known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.comparison.verdict import followed, follows, nothing_followed
from omnidyn.document import all_of, sentence
from omnidyn.findings.finding import FATAL, Verdict
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.steady.choice import ShapeScore
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.identification.validation import FITTED, HELD_OUT, Score, Validation, output_name

NAMED = 4  # shapes that are named
WHERE = {FITTED: "on the fitted logs", HELD_OUT: "on logs held out"}
MISSES = 0.5  # of the force: a shape that leaves more explains nothing


def fit_verdict(fit: OutputErrorEstimate, validation: Validation | None = None) -> str:
    """A fit to whole logs. Where logs were held out, these say whether the model follows."""
    if validation is None:
        return f"{fit.verdict[:-1]}; no log was compared with the model."
    which = HELD_OUT if HELD_OUT in validation.scores else FITTED
    found = followed(validation.scores[which])
    words = f"{WHERE[which]} {follows('the model', found)}"
    if fit.not_followed or nothing_followed(found):
        return sentence(f"{words}: its numbers mean nothing until it does")
    return sentence(f"{words}; {fit.numbers_known()}")


def fits_verdict(
    fits: Mapping[str, OutputErrorEstimate], validations: Mapping[str, Validation], verdicts: Sequence[Verdict] = (),
    cut: str = "",
) -> str:  # fmt: skip
    """Fits of all groups. verdicts: of `check` on the logs. cut: what an interrupt cut off, in words."""
    words = [sentence(f"cut short: {cut}")] if cut else []
    faults = [finding for each in verdicts for finding in each.findings if finding.level == FATAL]
    if faults:
        logs = sum(each.fatal for each in verdicts)
        of = "the log has" if len(verdicts) == 1 else f"{logs} of {len(verdicts)} logs have"
        words.append(sentence(f"{of} a fatal fault, to be mended first: {faults[0].message}"))
    words += [sentence(fit.ladder.words()) for fit in [*fits.values()][:1] if fit.ladder]  # all have the same
    told = {group: _led_by_misfit(fit, fit_verdict(fit, validations.get(group))) for group, fit in fits.items()}
    return " ".join([*words, *(each if len(told) == 1 else f"{group}: {each}" for group, each in told.items())])


def _led_by_misfit(fit: OutputErrorEstimate, words: str) -> str:
    """The verdict of a fit, led by what it leaves out."""
    lack = fit.lack_of_fit
    if lack is not None and lack.words() and not fit.not_followed:
        return f"{sentence(lack.words())} {words}"
    return words


def fit_failure(fit: OutputErrorEstimate, validation: Validation | None = None) -> str:
    """What a fit misses, in words; "" where it follows what it was fitted to."""
    missed = {} if validation is None else validation.not_followed(fit.noise)
    words = [f"{name} (fit {percent:.0f} %)" for name, percent in missed.items()]
    named = {output_name(name) for name in missed}
    words += [name for name in fit.not_followed if name not in named]
    if words:
        return f"the model does not follow {', '.join(words)}"
    found = followed(_judged(validation)) if validation is not None else []
    return follows("the model", found) if nothing_followed(found) else ""


def _judged(validation: Validation) -> Mapping[str, Score]:
    """The scores that say whether a model follows: those of logs held out, where there are any."""
    return validation.scores[HELD_OUT if HELD_OUT in validation.scores else FITTED]


def steady_failure(study: SteadyStudy) -> str:
    """What no shape of friction explains, in words; "" where one does."""
    score, size, share = _best_shape(study)
    if share <= MISSES:
        return ""
    return (
        f"no shape of friction explains the forces: the best, {score.name}, misses {study.choice.error:.2g} N of "
        f"{size:.2g} N in a direction that was left out"
    )


def _best_shape(study: SteadyStudy) -> tuple[ShapeScore, float, float]:
    """(score of the best shape, size of the forces [N], share of it that this shape misses)."""
    score, forces = study.choice.score, study.points.wrench[:, :2]
    size = float(np.sqrt(np.mean((forces**2).sum(axis=1))))
    error = study.choice.error
    return score, size, error / size if size > 0.0 and math.isfinite(error) else math.inf


def steady_verdict(study: SteadyStudy) -> str:
    """Friction from steady windows."""
    score, _, share = _best_shape(study)
    several = len(study.travel) > 1
    levels = all_of([f"{each.mean:.3g} N{f' ({name})' * several}" for name, each in study.travel.items()])
    if failure := steady_failure(study):
        return sentence(failure)
    ties = [each.name for each in study.choice.scores if not each.told_apart and each.name != score.name]
    alike = f"; as good, as far as these data tell: {all_of(ties[:NAMED])}" if ties else ""
    lacks = [each for each in study.lack_of_fit.values() if each.found]
    if lacks:
        best = next((remedy.words for each in lacks for remedy in each.remedies), "")
        alike = f"; but no offered shape fits: {f'it takes {best} beside it' if best else 'the errors repeat'}"
    known = _of_groups({group: each.numbers_known() for group, each in study.estimates.items()})
    shift = all_of([each.short() for each in study.moments])
    lead = sentence(f"the force of friction changes within a run ({shift}): the levels lie between both") + " "
    return (lead if shift else "") + (
        f"Friction along travel is {levels}; its shape, {_shapes(study)}, predicts "
        f"the force in a direction that was left out within {max(1.0, round(100.0 * share)):.0f} %{alike}; {known}."
    )


def _shapes(study: SteadyStudy) -> str:
    """The shape of all groups, or of each."""
    if not study.choice.own:
        return f"{study.choice.chosen} ({study.choice.score.words.partition(';')[0]})"
    return all_of([f"{study.choice.of(group)} ({group})" for group in study.estimates])


def lines_verdict(estimates: Mapping[str, Estimate]) -> str:
    """The paper's line on each axis."""
    return sentence(_of_groups({group: each.numbers_known() for group, each in estimates.items()}))


def _of_groups(told: Mapping[str, str]) -> str:
    return "; ".join(each if len(told) == 1 else f"{group}: {each}" for group, each in told.items())
