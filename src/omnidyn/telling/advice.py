"""What to measure, to mend or to ask for next, after a fit to whole logs; and what a ladder came to."""

from __future__ import annotations

from omnidyn.document import all_of, short
from omnidyn.identification.lack_of_fit import ONE_LOG
from omnidyn.model.keys import find_key, in_words, unit
from omnidyn.statement import Statement
from omnidyn.telling.causes import changes, named
from omnidyn.telling.fit import MEASURED
from omnidyn.telling.sentence import Sentence

LONGEST_FACTOR = 100.0  # times as long as now: nobody records more
WAYS = {  # what to do about a cause
    ONE_LOG["mass"]: "fit that log apart from the others, both times with the mass that the robot had",
    ONE_LOG["friction"]: (
        "leave that log out, or fit the logs in groups (`per`), each with friction of its own; where no voltage of the "
        "battery is logged, a lower one looks much the same"
    ),
    ONE_LOG["supply"]: "log the voltage of the battery in every log, or leave that log out",
    "look": "look what happened there; fit the parts as logs of their own",
    "limit": 'put about that value into the robot file, {name} = {{ value = .., origin = "guess" }}, and fit again',
    "measure": "measure it and put it into the robot file",
    "put": "put {key} into the robot file, and fit again",
}


def _bounded(statement: Statement) -> str:
    """The friction of an axis that never moved is only bounded."""
    name, axis = statement.subject, statement.numbers["axis"]
    level = f"{statement.numbers['bound']:.3g} {unit(name)}"
    return f"drive {axis or name} harder than {level}: it never moved, so its friction is only bounded"


def _not_told(statement: Statement) -> str:
    """A number is not identifiable, and the robot file knows nothing of it."""
    axis = statement.numbers["axis"]
    how = (
        f"drive {axis} both ways, at several speeds"
        if axis
        else "fix it (`fixed`), or record what depends on it: currents, or another load"
    )
    return f"{statement.subject} is not identifiable from these logs: {how}"


def _cause(statement: Statement) -> str:
    """The best cause of a misfit: what it would change, what the logs cannot distinguish from it, what to do."""
    numbers = statement.numbers
    alike = f"; these logs cannot tell it from {', '.join(map(str, numbers['alike']))}" if numbers["alike"] else ""
    change = f" ({words})" if (words := changes(statement)) else ""
    return f"{numbers['cause']} would explain what the model leaves out{change}{alike}: {_how_to(statement)}"


def _how_to(statement: Statement) -> str:
    """What to do about a cause."""
    key, kind = statement.subject, statement.numbers["way"]
    if kind == "distinguish":
        group = {place.name if (place := find_key(name)) else name for name in (key, *statement.numbers["same_as"])}
        ways = [words for name, words in MEASURED.items() if name in group] or ["measure one of them"]
        return f"{' or '.join(ways)}, or record what tells them apart (currents, another load)"
    if kind == "fit":  # with what is fitted already: an option that names one nuisance leaves out all others
        names = [*statement.numbers["nuisances"], key]
        return f"fit it ({' '.join(f'`nuisances` {name}' for name in names)})"
    return WAYS[kind].format(key=key, name=key.rpartition(".")[2])


def _guesses(statement: Statement) -> str:
    """Numbers of the robot file are guesses, and the model leaves something out."""
    keys = statement.numbers["keys"]
    free = " ".join(f"`free` {key}" for key in statement.numbers["freeable"])
    are = "is a guess" if len(keys) == 1 else "are guesses"
    fit = f", or fit what shows in the logs (`free` friction {free})" if free else ""
    return f"{', '.join(keys)} {are} of the robot file, and the model leaves something out: measure it{fit}"


def _held(statement: Statement) -> str:
    """The model does not follow, and the robot file gives numbers as exact."""
    keys = statement.numbers["keys"]
    free = " ".join(f"`free` {key}" for key in keys)
    return (
        f"the fit holds {', '.join(keys)}, which the robot file gives as exact: fit them too (`free` friction {free})"
    )


def _together(statement: Statement) -> str:
    """Pairs of numbers are strongly correlated, and wide for it."""
    numbers = statement.numbers
    pairs = [
        f"{first} and {second} (correlation {value:+.2f})"
        for first, second, value in zip(numbers["first"], numbers["second"], numbers["correlation"], strict=True)
    ]
    one = "one of them" if len(pairs) == 1 else "one of each pair"
    return f"{', '.join(pairs)} move together: measure {one} otherwise, or drive at more different speeds"


def _wide(statement: Statement) -> str:
    """Intervals are wide; how much longer a log would have to be."""
    longer, goal = statement.numbers["longer"], 100.0 * statement.numbers["goal"]
    enough = f"a log {longer:.0f} times as long" if longer <= LONGEST_FACTOR else "no log of a usual length"
    them = "it" if len(statement.numbers["keys"]) == 1 else "all of them"
    return (
        f"{_known_roughly(statement)}: {enough} would bring {them} to {goal:.0f} %; more motion where it matters would "
        "do so sooner"
    )


def _wide_by_misfit(statement: Statement) -> str:
    """Intervals are wide because the model misses something."""
    them = "it" if len(statement.numbers["keys"]) == 1 else "them"
    return f"{_known_roughly(statement)}: what the model misses widens {them}, and a longer log does not help"


def _known_roughly(statement: Statement) -> str:
    numbers = statement.numbers
    return ", ".join(
        f"{name} is known within {short(100.0 * share, '.0f')} % only" if determined else f"{name} is not known"
        for name, share, determined in zip(numbers["keys"], numbers["shares"], numbers["known"], strict=True)
    )


def _with_others(statement: Statement) -> str:
    """A step, and what the logs cannot tell from it."""
    same = all_of([*map(named, statement.numbers["same_as"])])
    return f"{statement.numbers['cause']} (or, not distinguishable with these logs, {same})"


def _alternatives(statement: Statement) -> str:
    """The logs do not tell other robots from the one taken; the friction that differs most between them."""
    numbers = statement.numbers
    by = ""
    if name := numbers["number"]:
        key, _, group = name.partition("@")
        low, high = numbers["between"]
        by = f", with {in_words(key)}{f' in {group}' if group else ''} from {low:.3g} to {high:.3g} {unit(key)}"
    return (
        f"the ladder took {numbers['cause']}; these logs cannot tell it from "
        f"{all_of([*map(named, numbers['same_as'])])}{by}: measure one of them, and put it into the robot file"
    )


def _nothing_pays(statement: Statement) -> str:
    """No step pays; what a misfit looks like that no robot file holds."""
    groups, causes = statement.numbers["groups"], statement.numbers["causes"]
    looks = [f"; {group}: {cause}" if group else f"; {cause}" for group, cause in zip(groups, causes, strict=True)]
    return f"nothing that was tried improves the prediction{''.join(looks)}"


SENTENCES = {
    "friction_bounded": Sentence(_bounded),
    "number_not_told": Sentence(_not_told),
    "known_by_file_only": Sentence(
        "the logs do not tell {keys}: a measurement or a data sheet (with its std), or a log with currents, says more "
        "than a longer log"
    ),
    "measure_or_fix": Sentence(
        "{direction}; what is measured goes into the robot file, with its std, or is fixed (`fixed`)"
    ),
    "missing_cause": Sentence(_cause),
    "try_ladder": Sentence(
        "let `ladder` fit the logs with each of the best causes, step by step: it keeps what predicts better"
    ),
    "guessed_numbers": Sentence(_guesses),
    "held_numbers": Sentence(_held),
    "correlated_numbers": Sentence(_together),
    "wide_intervals": Sentence(_wide),
    "wide_by_misfit": Sentence(_wide_by_misfit),
    "hold_out_log": Sentence(
        "record one more log, of other drives, and hold it out (`hold_out`): only that shows what it is worth"
    ),
    "held_out_is_fitted": Sentence(
        "{subject} is held out, and the same recording as {fitted}, which is fitted: hold out another"
    ),
    "mend_log": Sentence("{subject}: {finding}: {what}"),
    "of_group": Sentence("{subject}: {statement}"),
    "as_given": Sentence("as it is"),
    "ladder_no_step": Sentence("the ladder took no step: {end}"),
    "ladder_steps": Sentence("the ladder took {steps}; then {end}"),
    "step_with_others": Sentence(_with_others),
    "ladder_alternatives": Sentence(_alternatives),
    "mend_first": Sentence(
        "the model does not follow the logs: first correct signs, units, the order of wheels and dead sensors"
    ),
    "nothing_pays": Sentence(_nothing_pays),
    "step_limit": Sentence("{steps} steps are the most that it takes"),
    "looks_like_change": Sentence("it looks like {cause}: fit the parts as logs of their own"),
    "looks_like": Sentence("it looks like {causes}, which no law of a robot file holds"),
    "pays": Sentence("pays"),
    "pays_less": Sentence("pays less"),
    "not_distinguishable": Sentence("not distinguishable with these logs"),
    "as_good_not_simpler": Sentence("as good within a standard error, not simpler"),
    "predicts_no_better": Sentence("predicts held-out blocks no better than by chance ({better} of {blocks} better)"),
    "costs_more_than_it_explains": Sentence("explains less than its numbers cost"),
    "other_explains_more": Sentence("{cause} would explain more"),
    "step_does_not_follow": Sentence("does not follow the logs"),
    "not_fittable": Sentence("cannot be fitted: {error}"),
    "slow_and_not_needed": Sentence(
        "not tried: it explains less than what leaves nothing but noise without it, and its fit takes long"
    ),
    "slow_fits_spent": Sentence(
        "not tried: of fits with wheels that slip, which take long, the ladder makes {fits} at most"
    ),
}
