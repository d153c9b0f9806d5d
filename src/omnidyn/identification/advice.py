"""What to measure, to mend or to ask for next, after a fit to whole logs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from omnidyn.identification.lack_of_fit import CHANGE, OF_LOGS, ONE_LOG, Remedy
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.problem.nuisances import NUISANCES
from omnidyn.identification.validation import Validation
from omnidyn.identification.verdict import fit_failure
from omnidyn.model.frames import AXES
from omnidyn.model.keys import BOX, EMF, TORQUE, Key, find_key
from omnidyn.model.robot import GUESSES
from omnidyn.statement import NOTE, Statement

LIMIT = "motor.current_limit_A"
SIMILAR_SHARE = 0.7  # of what the first remedy explains, from which one behind it is worth a word
WIDE_SHARE, GOAL_SHARE = 0.2, 0.1  # half width of the 95 % interval over the value: worth a word, and what it could be
CORRELATED = 0.95  # two numbers that move together
# Guesses worth a fit, where a log has voltages. Of K_t, the EMF constant and the gear only one number shows.
GOES_WITH_TORQUE = (EMF, "motor.gear_ratio")
FREEABLE = (TORQUE, "motor.resistance_ohm", "body.inertia_kg_m2")


def advice(fit: OutputErrorEstimate, validation: Validation | None) -> list[Statement]:
    """What to measure or to ask for next, gravest first."""
    held = [*_held(fit)] if fit_failure(fit, validation) is not None else []
    missing = [statement for statement in _missing(fit) if not held or statement.code != "try_ladder"]
    statements = [*held, *missing, *_not_seen(fit), *_guesses(fit), *_together(fit), *_wide(fit)]
    statements += [replace(statement, severity=NOTE) for statement in fit.robot.pose_lag_of_log]
    if validation is not None and validation.held_out is None:
        statements.append(Statement("hold_out_log", NOTE))
    return list(dict.fromkeys(statements))


def _not_seen(fit: OutputErrorEstimate) -> Iterator[Statement]:
    for name, bound in fit.lower_bound.items():
        yield Statement("friction_bounded", NOTE, name, {"axis": _axis(name), "bound": bound})
    for name in fit.unidentifiable:
        if math.isinf(fit.std.get(name, 0.0)):
            yield Statement("number_not_told", NOTE, name, {"axis": _axis(name) if name in BOX else ""})
    known_names = tuple(name for name in fit.unidentifiable if math.isfinite(fit.std.get(name, math.inf)))
    if known_names:
        yield Statement("known_by_file_only", NOTE, numbers={"keys": known_names})
    for direction in fit.blind:
        yield Statement("measure_or_fix", NOTE, numbers={"direction": direction})


def _axis(name: str) -> str:
    """The axis along which a number acts, "" for one of no axis."""
    key = find_key(name)
    return "" if key is None or key.axis is None else AXES[key.axis]


def _missing(fit: OutputErrorEstimate) -> Iterator[Statement]:
    """What would mend a model that leaves something out: the best remedy, and how to ask for it.

    One, with those that the logs cannot tell from it: a confident remedy explains most of what is missing, so another
    one explains the same in another way, and both together would be one too many.
    """
    lack = fit.lack_of_fit
    if lack is None or not lack.found or lack.is_small or fit.not_followed:
        return
    near_causes = (
        cause for cause in lack.causes if cause.confident and cause.chi2 >= SIMILAR_SHARE * lack.causes[0].chi2
    )
    remedy = next(near_causes, None)
    if remedy is not None:
        numbers = {
            "cause": remedy.cause,
            "same_as": remedy.same_as,
            "alike": lack.alike(remedy),
            "way": next_action(remedy),
            "nuisances": tuple(fit.nuisances),
        }
        yield Statement("missing_cause", NOTE, remedy.key, numbers | remedy.largest_changes())
    best = next(iter(lack.causes), None)
    if fit.ladder is None and (best is None or (best.offered and best.key not in OF_LOGS)):
        yield Statement("try_ladder", NOTE)


def next_action(remedy: Remedy) -> str:
    """What to do about a remedy: "distinguish" it from others, "fit" a nuisance, "look", "limit", "measure", "put", or
    what differs in one log."""
    if remedy.same_as:
        return "distinguish"
    if remedy.key.partition(".")[0] in NUISANCES:
        return "fit"
    if remedy.key in ONE_LOG.values():
        return remedy.key
    if remedy.key in (CHANGE, LIMIT):
        return "look" if remedy.key == CHANGE else "limit"
    key = find_key(remedy.key)
    measured = key is not None and key.part in ("body", "wheels") and key.field != "rotating_frame"
    return "measure" if measured else "put"


def _guesses(fit: OutputErrorEstimate) -> Iterator[Statement]:
    """What the robot file only guesses, where the model misses something: no friction makes up for a wrong motor."""
    guessed_keys = [
        key
        for key, prior in fit.robot.priors.items()
        if prior.origin in GUESSES and key not in fit.value and Key.parse(key).part in ("motor", "body")
    ]
    if FREEABLE[0] in fit.value:
        guessed_keys = [key for key in guessed_keys if key not in GOES_WITH_TORQUE]
    freeable = tuple(key for key in FREEABLE if key in guessed_keys)
    if guessed_keys and _misses(fit):
        yield Statement("guessed_numbers", NOTE, numbers={"keys": tuple(guessed_keys), "freeable": freeable})


def _held(fit: OutputErrorEstimate) -> Iterator[Statement]:
    """What the robot file gives as exact, of a model that does not follow: a number copied from elsewhere is rarely."""
    known_numbers = {Key.parse(key).name for key in (*fit.robot.priors, *fit.value) if find_key(key)}
    freeable = tuple(key for key in FREEABLE if key not in known_numbers)
    if freeable:
        yield Statement("held_numbers", NOTE, numbers={"keys": freeable})


def _together(fit: OutputErrorEstimate) -> Iterator[Statement]:
    """Numbers that move together, and are wide for it: where both are known well, it does no harm."""
    names, matrix = fit.correlation.names, fit.correlation.matrix
    pairs = [
        (first, names[j], matrix[i, j])
        for i, first in enumerate(names)
        for j in range(i + 1, len(names))
        if abs(matrix[i, j]) > CORRELATED
        and not {first, names[j]} & set(fit.unidentifiable)
        and max(fit.half_width(name) if name in fit.value else 0.0 for name in (first, names[j])) > GOAL_SHARE
    ]
    if pairs:
        first, second, correlations = zip(*pairs, strict=True)
        numbers = {"first": first, "second": second, "correlation": correlations}
        yield Statement("correlated_numbers", NOTE, numbers=numbers)


def _wide(fit: OutputErrorEstimate) -> Iterator[Statement]:
    """What is known too roughly. A longer log helps against noise only: not where the model itself misses something."""
    shares = {
        name: fit.half_width(name) for name in fit.value if name not in fit.unidentifiable and name not in fit.at_bound
    }
    wide_shares = {name: share for name, share in shares.items() if share > WIDE_SHARE}
    if wide_shares:
        numbers = {
            "keys": tuple(wide_shares),
            "shares": tuple(wide_shares.values()),
            "known": tuple(fit.is_known(name) for name in wide_shares),
            "longer": (max(wide_shares.values()) / GOAL_SHARE) ** 2,
            "goal": GOAL_SHARE,
        }
        yield Statement("wide_by_misfit" if _misses(fit) else "wide_intervals", NOTE, numbers=numbers)


def _misses(fit: OutputErrorEstimate) -> bool:
    """Whether the model leaves out more than noise."""
    lack = fit.lack_of_fit
    return lack is not None and lack.found and not lack.is_small
