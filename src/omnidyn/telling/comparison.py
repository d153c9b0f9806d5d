"""What a comparison of models with logs says, and one of fits (`drift`)."""

from __future__ import annotations

import math

from omnidyn.document import all_of
from omnidyn.model.drive import DUTY, VOLTAGE
from omnidyn.model.keys import in_words
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence

NAMED = 4  # numbers that a sentence names


def _applied(statement: Statement) -> str:
    """Which logged input drove the model, and what of the robot file and of the fit of this log acted on it."""
    numbers = statement.numbers
    words = _input(statement)
    words += f", behind a dead band of {numbers['dead_band']:.3g} V" if numbers["dead_band"] else ""
    words += f", {numbers['latency']:.3g} s later" if numbers["latency"] else ""
    return words + (f", and what the fit found of this log: {numbers['effects']}" if numbers["effects"] else "")


def _input(statement: Statement) -> str:
    numbers = statement.numbers
    if statement.subject == VOLTAGE:
        return "the logged voltage"
    if statement.subject == DUTY:
        supply = numbers["supply"]
        battery = "the logged supply" if supply is None else f"the supply of the robot file, {supply:g} V"
        return f"the logged duty times {battery}"
    speeds = "wheel speeds" if statement.subject == "wheel_speed_command" else "body speeds"
    gains = ("/".join(f"{gain:g}" for gain in numbers[name]) for name in ("kp", "ki"))
    return (
        "the logged set {}, through the speed loop of the robot file (kp {} V s/rad, ki {} V/rad, {:g} Hz): no voltage "
        "was applied as logged"
    ).format(speeds, *gains, numbers["rate"])


def _signal_followed(statement: Statement) -> str:
    """How a model follows one kind of measurement: *level* is "well", "noise", "roughly", "hardly" or "not"."""
    numbers = statement.numbers
    percent = f"{max(1.0, round(100.0 * numbers['share'])):.0f} %"
    how = {
        "well": f"within {percent}",
        "noise": f"as far as the noise allows ({percent})",
        "roughly": f"roughly ({percent})",
        "hardly": f"hardly ({percent})",
        "not": f"not at all (rms error {numbers['error']:.2g} {numbers['unit']})",
    }
    if _is_mere_noise(statement):
        return f"there is mere noise in {statement.subject} (rms error {numbers['error']:.2g} {numbers['unit']})"
    return f"{statement.subject} {how[numbers['level']]}"


def _is_mere_noise(statement: Statement) -> bool:
    """Whether errors that are white are larger than what is to be followed, as of a position that hardly moves."""
    return statement.numbers["level"] == "noise" and statement.numbers["share"] >= 1.0


def _follows(statement: Statement) -> str:
    """A model follows some of what was measured; what it hardly follows, or not at all, is named too, and where there
    is nothing but noise to follow."""
    signals, noises = (
        [signal for signal in statement.numbers["signals"] if _is_mere_noise(signal) is mere] for mere in (False, True)
    )
    good, bad = (
        [str(signal) for signal in signals if (signal.numbers["level"] in ("hardly", "not")) is poor]
        for poor in (False, True)
    )
    words = f"{statement.subject} follows {all_of(good or bad)}{f', but {all_of(bad)}' if good and bad else ''}"
    parts = [words] if signals else [f"{statement.subject} has nothing to follow"]
    return "; ".join([*parts, *map(str, noises)])


def _does_not_follow(statement: Statement) -> str:
    """Measured signals change, and the model follows none of them even roughly."""
    return f"{statement.subject} does not follow: {', '.join(map(str, statement.numbers['signals']))}"


def _models_compared(statement: Statement) -> str:
    """Two models: which is surely nearer in what, then how each follows the logs."""
    nearer = statement.numbers["nearer"] or ("neither is surely nearer",)
    return "; ".join(map(str, (*nearer, *statement.numbers["models"])))


def _numbers_changed(statement: Statement) -> str:
    """Numbers changed between fits by more than their errors allow, the surest first."""
    changed = statement.numbers["changed"]
    names = [str(one) for one in changed[:NAMED]]
    more = [f"{len(changed) - NAMED} more"] if len(changed) > NAMED else []
    count = statement.numbers["count"]
    return f"{len(changed)} of {count} numbers changed by more than errors allow: {all_of([*names, *more])}"


def _number_changed(statement: Statement) -> str:
    """Between which two fits a number differs most, and by how much."""
    (first, last), (one, other) = statement.numbers["values"], statement.numbers["fits"]
    change = (last - first) / abs(first) if first else math.inf
    percent = f": {100.0 * change:+.0f} %" if math.isfinite(change) else ""
    return f"{in_words(statement.subject)} ({first:.3g} in {one}, {last:.3g} in {other}{percent})"


def _taken_differently(statement: Statement) -> str:
    """A number was not fitted, and the fits took different values for it."""
    numbers = statement.numbers
    values = (", ".join(f"{value:.4g}" for value in values) for values in numbers["values"])
    taken = ", ".join(f"{value} in {fit}" for value, fit in zip(values, numbers["fits"], strict=True))
    return f"{in_words(statement.subject)} was taken as {taken}: fitted numbers that rest on it differ for that too"


SENTENCES = {
    "logs_aligned": Sentence(
        "with {offset:+.4f} s added to its times {subject} shows the motion of {first}: correlation "
        "{correlation:.2f} of {components} over {overlap:.4g} s"
    ),
    "logs_aligned_in_several_ways": Sentence(
        "the motion of {subject} repeats itself: it is that of {first} with {offset:+.4f} s added to its times "
        "(correlation {correlation:.2f}), and nearly as well with {rival_offset:+.4f} s ({rival:.2f})",
        "align logs of a drive that does not repeat itself, or choose the offset by hand",
    ),
    "logs_unlike": Sentence(
        "the logs {subject} and {first} hardly show one motion: correlation {correlation:.2f} of {components} at best, "
        "with {offset:+.4f} s added to the times of {subject}",
        "give two recordings of one drive",
    ),
    "applied": Sentence(_applied),
    "effects_of_other_log": Sentence(
        "{subject} was fitted together with effects of its own logs ({effects}); they are not applied to this other log"
    ),
    "restarts_at_gaps": Sentence("{gaps} {gaps:gap|gaps} in time: each piece starts anew from the measured state"),
    "rows_not_replayed": Sentence(
        "{left} of {rows} rows are not replayed: inputs missing for more than {hold:g} s, or alone"
    ),
    "more_warnings": Sentence("and {more} more warnings of the simulation"),
    "start_assumed": Sentence("no speed was logged: {assumed} of {pieces} pieces start from rest"),
    "integral_not_logged": Sentence(
        "the integral of the speed loop was not logged: it starts at 0 in {pieces} pieces that start moving"
    ),
    "loop_faster_than_log": Sentence(
        "the speed loop sets the voltage every {loop_period:m.3g} ms, the log has one every {log_period:m.3g} ms:"
        " between its rows the voltage is taken as held"
    ),
    "currents_never_negative": Sentence(
        "no measured current is negative: the sensor may have no sign (`current_unsigned`)"
    ),
    "no_band": Sentence("{subject} has no band: no number of its file has a std"),
    "band_rests_on_guesses": Sentence("the band of {subject} rests on guesses: {guesses}"),
    "signal_followed": Sentence(_signal_followed),
    "follows": Sentence(_follows),
    "model_does_not_follow": Sentence(_does_not_follow),
    "nothing_changes": Sentence("nothing that was measured changes: how well {subject} follows is not identifiable"),
    "nearer": Sentence("{subject} is surely nearer in {components}"),
    "models_compared": Sentence(_models_compared),
    "numbers_changed": Sentence(_numbers_changed),
    "number_changed": Sentence(_number_changed),
    "no_number_changed": Sentence("no number of {count} changed by more than its errors allow"),
    "fits_differ_together": Sentence(
        "the {fits} fits differ, though no number by itself by more than its errors allow"
    ),
    "fits_of_one_log": Sentence("{fits} were fitted to the same log ({subject}): they are not independent"),
    "taken_differently": Sentence(_taken_differently),
}
