"""What to measure, to mend or to ask for next, after a fit to whole logs."""

from __future__ import annotations

import math
from collections.abc import Iterator

from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.problem.nuisances import NUISANCES
from omnidyn.identification.output_error.trust.cures import MEASURED
from omnidyn.identification.structure.missing.candidates import CHANGE
from omnidyn.identification.validation import Validation
from omnidyn.model.frames import AXES
from omnidyn.model.keys import BOX, EMF, TORQUE, Key, find_key, unit
from omnidyn.model.robot import GUESS

LIMIT = "motor.current_limit_A"
NEARLY = 0.7  # of what the first remedy explains, from which one behind it is worth a word
WIDE, GOAL = 0.2, 0.1  # half width of the 95 % interval over the value: worth a word, and what it could be
LONGEST = 100.0  # times as long as now: nobody records more
TOGETHER = 0.95  # correlation of two numbers that move together
# Guesses worth a fit, where a log has voltages. Of K_t, the EMF constant and the gear only one number shows.
GOES_WITH_TORQUE = (EMF, "motor.gear_ratio")
FREEABLE = (TORQUE, "motor.resistance_ohm", "body.inertia_kg_m2")


def advice(fit: OutputErrorEstimate, validation: Validation | None) -> list[str]:
    """What to measure or to ask for next, gravest first."""
    words = [*_not_seen(fit), *_missing(fit), *_guesses(fit), *_together(fit), *_wide(fit)]
    words += _from_validation(validation)
    return list(dict.fromkeys(words))


def _not_seen(fit: OutputErrorEstimate) -> Iterator[str]:
    for name, bound in fit.lower_bound.items():
        axis = _axis(name) or name
        yield f"drive {axis} harder than {bound:.3g} {unit(name)}: it never moved, so its friction is only bounded"
    for name in fit.unidentifiable:
        if math.isinf(fit.std.get(name, 0.0)):
            yield f"{name} cannot be told from these logs: {_remedy(name)}"
    known = [name for name in fit.unidentifiable if math.isfinite(fit.std.get(name, math.inf))]
    if known:
        yield (
            f"the logs do not tell {', '.join(known)}: what you measure or read off a label (with its std), or a log "
            "with currents, says more than a longer log"
        )
    for words in fit.blind:
        yield f"{words}; what is measured goes into the robot file, with its std, or is fixed (`fixed`)"


def _remedy(name: str) -> str:
    if name in BOX:
        return f"drive {_axis(name)} both ways, at several speeds"
    return "fix it (`fixed`), or record what depends on it: currents, or another load"


def _axis(name: str) -> str:
    """The axis along which a number acts, "" for one of no axis."""
    key = find_key(name)
    return "" if key is None or key.axis is None else AXES[key.axis]


def _missing(fit: OutputErrorEstimate) -> Iterator[str]:
    """What would mend a model that leaves something out: the best remedy, and how to ask for it.

    One, with those that the logs cannot tell from it: a confident remedy explains most of what is missing, so another
    one explains the same in another way, and both together would be one too many.
    """
    lack = fit.lack_of_fit
    if lack is None or not lack.found or fit.not_followed:
        return
    near = (each for each in lack.causes if each.confident and each.chi2 >= NEARLY * lack.causes[0].chi2)
    remedy = next(near, None)
    if remedy is not None:
        alike = f"; these logs cannot tell it from {lack.alike(remedy)}" if remedy.same_as else ""
        change = f" ({words})" if (words := remedy.would_change()) else ""
        yield f"{remedy.words} would explain what the model leaves out{change}{alike}: {how_to(remedy)}"
    best = next(iter(lack.causes), None)
    if fit.ladder is None and (best is None or (best.offered and best.key != CHANGE)):
        yield "let `ladder` fit the logs with each of the best causes, step by step: it keeps what predicts better"


def how_to(remedy: Remedy) -> str:
    """What to do about a remedy, in words."""
    if remedy.same_as:
        group = {Key.parse(each).name if find_key(each) else each for each in (remedy.key, *remedy.same_as)}
        ways = [words for key, words in MEASURED.items() if key in group] or ["measure one of them"]
        return f"{' or '.join(ways)}, or record what tells them apart (currents, another load)"
    if remedy.key.partition(".")[0] in NUISANCES:
        return f"fit it (`nuisances` {remedy.key})"
    if remedy.key == CHANGE:
        return "look what happened there; fit the parts as logs of their own"
    key = find_key(remedy.key)
    if remedy.key == LIMIT:
        return f"put about that value into the robot file, and let the fit find it (`free` friction {LIMIT})"
    if key is not None and key.part in ("body", "wheels") and key.field != "rotating_frame":
        return "measure it and put it into the robot file"
    return f"put {remedy.key} into the robot file, and fit again"


def _guesses(fit: OutputErrorEstimate) -> Iterator[str]:
    """What the robot file only guesses, where the model misses something: no friction makes up for a wrong motor."""
    guessed = [
        key for key, prior in fit.robot.priors.items()
        if prior.origin == GUESS and key not in fit.value and Key.parse(key).part in ("motor", "body")
    ]  # fmt: skip
    if FREEABLE[0] in fit.value:
        guessed = [key for key in guessed if key not in GOES_WITH_TORQUE]
    if guessed and _misses(fit):
        free = " ".join(f"`free` {key}" for key in FREEABLE if key in guessed)
        are = "is a guess" if len(guessed) == 1 else "are guesses"
        yield (
            f"{', '.join(guessed)} {are} of the robot file, and the model leaves something out: put in what you can "
            f"measure{f', or fit what shows in the logs (`free` friction {free})' if free else ''}"
        )


def _together(fit: OutputErrorEstimate) -> Iterator[str]:
    """Numbers that move together, and are wide for it: where both are known well, it does no harm."""
    names, matrix = fit.correlation.names, fit.correlation.matrix
    pairs = [
        f"{first} and {names[j]} move together (correlation {matrix[i, j]:+.2f})"
        for i, first in enumerate(names) for j in range(i + 1, len(names))
        if abs(matrix[i, j]) > TOGETHER and not {first, names[j]} & set(fit.unidentifiable)
        and max(fit.half_width(name) if name in fit.value else 0.0 for name in (first, names[j])) > GOAL
    ]  # fmt: skip
    if pairs:
        one = "one of them" if len(pairs) == 1 else "one of each pair"
        yield f"{', '.join(pairs)}: measure {one} otherwise, or drive at more different speeds"


def _wide(fit: OutputErrorEstimate) -> Iterator[str]:
    """What is known too roughly. A longer log helps against noise only: not where the model itself misses something."""
    shares = {
        name: fit.half_width(name) for name in fit.value
        if name not in fit.unidentifiable and name not in fit.at_bound
    }  # fmt: skip
    wide = {name: share for name, share in shares.items() if share > WIDE}
    if wide:
        known = ", ".join(
            f"{name} is known within {100.0 * share:.0f} % only" if fit.is_known(name) else f"{name} is not known"
            for name, share in wide.items()
        )
        longer = (max(wide.values()) / GOAL) ** 2
        if _misses(fit):
            them = "it" if len(wide) == 1 else "them"
            yield f"{known}: what the model misses widens {them}, and no longer log mends that"
            return
        enough = f"a log {longer:.0f} times as long" if longer <= LONGEST else "no log of a usual length"
        yield (
            f"{known}: {enough} would bring {'it' if len(wide) == 1 else 'all of them'} to {100.0 * GOAL:.0f} %; more "
            "motion where it matters would do so sooner"
        )


def _misses(fit: OutputErrorEstimate) -> bool:
    """Whether the model leaves out more than noise."""
    return fit.lack_of_fit is not None and fit.lack_of_fit.found


def _from_validation(validation: Validation | None) -> Iterator[str]:
    if validation is not None and validation.held_out is None:
        yield "record one more log, of other drives, and hold it out (`hold_out`): only that shows what it is worth"
