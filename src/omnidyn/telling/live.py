"""What is said of a drive while it lasts."""

from __future__ import annotations

from omnidyn.document import all_of, short
from omnidyn.model.keys import in_words
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence

LOOKS_LIKE = {"floor": "another floor", "payload": "another payload", "wear": "wear, or a part that was changed"}


def _not_yet(statement: Statement) -> str:
    """How many numbers are known, and which one is missing most."""
    numbers = statement.numbers
    half = numbers["half"]
    width = "unknown" if half is None else "not within 100 %" if half > 1.0 else f"within {short(100.0 * half)} %"
    words = f"not yet: after {numbers['seconds']:.0f} s {numbers['known']} of {numbers['count']} numbers are known"
    return f"{words}; {in_words(numbers['widest'])} is {width}, wanted {short(100.0 * numbers['within'])} %"


def _not_predicted(statement: Statement) -> str:
    """All numbers are known, but no stretch has shown it."""
    numbers = statement.numbers
    if numbers["missed"]:
        return f"not yet: the numbers are known, but do not predict {all_of(numbers['missed'])} of the last stretch"
    return "not yet: the numbers are known, and wait for a stretch of driving that they predict"


def _not_explained(statement: Statement) -> str:
    """A stretch in which something happened that the model does not have."""
    numbers = statement.numbers
    stretch = f"{numbers['start']:.0f} s to {numbers['end']:.0f} s"
    return f"not yet: the numbers are known, but do not explain {all_of(numbers['missed'])} from {stretch}"


def _changed(statement: Statement) -> str:
    """What changed since a fit, and what that looks like."""
    pairs = zip(statement.numbers["keys"], statement.numbers["shares"], strict=True)
    words = all_of([f"{in_words(key)} {100.0 * share:+.0f} %" for key, share in pairs])
    return f"this looks like {LOOKS_LIKE[statement.subject]}: {words} beside the fit before"


def _misfit(statement: Statement) -> str:
    """What the residuals follow."""
    follows = all_of(statement.numbers["follows"])
    return f"the model leaves something out (its errors follow {follows}): numbers and intervals may be wrong"


SENTENCES = {
    "live_waiting": Sentence("no numbers yet after {seconds:.0f} s and {rows} rows: {why}"),
    "live_not_yet": Sentence(_not_yet),
    "live_not_predicted": Sentence(_not_predicted, "drive on; where it stays so, fit the log with identify"),
    "live_not_explained": Sentence(
        _not_explained, "look what happened then, such as a lifted wheel; begin a new log without it"
    ),
    "live_not_this_model": Sentence(
        "not yet: the numbers are known, but the model leaves something out",
        "fit the log with identify: it looks for what",
    ),
    "live_misfit": Sentence(_misfit, "fit the log with identify: it looks for what"),
    "live_enough": Sentence(
        "enough: after {at:.0f} s all numbers are known, and a stretch that was held out was predicted"
    ),
    "live_changed": Sentence(_changed, "stop, and look; drive a new log where the change is meant to stay"),
    "live_restarts": Sentence("time began anew {restarts} times: what followed counts on"),
    "live_gap": Sentence("rows are missing for up to {gap:.1f} s: the motion in them is not used"),
    "live_used_until": Sentence(
        "nothing after the gap at {at:.1f} s is used: the voltages of a speed loop are not logged, and it remembers "
        "what happened in the gap",
        "let the robot rest, and begin a new log",
    ),
}
