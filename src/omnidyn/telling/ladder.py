"""What a ladder came to: its steps, why it took no other, and what the logs cannot tell from the robot taken."""

from __future__ import annotations

from omnidyn.document import all_of
from omnidyn.model.keys import in_words, unit
from omnidyn.statement import Statement
from omnidyn.telling.causes import named
from omnidyn.telling.sentence import Sentence


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
    return f"nothing that was tried pays{''.join(looks)}"


SENTENCES = {
    "as_given": Sentence("as it is"),
    "ladder_no_step": Sentence("the ladder took no step: {end}"),
    "ladder_steps": Sentence("the ladder took {steps}; then {end}"),
    "step_with_others": Sentence(_with_others),
    "ladder_alternatives": Sentence(_alternatives),
    "mend_first": Sentence(
        "the model does not follow the logs: first mend signs, units, the order of wheels, dead sensors"
    ),
    "nothing_pays": Sentence(_nothing_pays),
    "step_limit": Sentence("{steps} steps are the most that it takes"),
    "looks_like_change": Sentence("it looks like {cause}: fit the parts as logs of their own"),
    "looks_like": Sentence("it looks like {causes}, which no law of a robot file holds"),
    "pays": Sentence("pays"),
    "pays_less": Sentence("pays less"),
    "not_distinguishable": Sentence("not distinguishable with these logs"),
    "as_good_not_simpler": Sentence("as good within a standard error, not simpler"),
    "predicts_no_better": Sentence("predicts held-out blocks no better"),
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
