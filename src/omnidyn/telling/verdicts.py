"""What an identification came to: whether the model follows, how well its numbers are known, what makes it fail."""

from __future__ import annotations

import math

from omnidyn.document import all_of, short
from omnidyn.model.keys import in_words
from omnidyn.sensors import COUNTED
from omnidyn.statement import Statement
from omnidyn.telling.causes import NUISANCE_UNITS
from omnidyn.telling.lack_of_fit import names_of
from omnidyn.telling.sentence import Sentence

WHERE = {"fitted": "on the fitted logs", "held out": "on logs held out"}
NAMED = 4  # shapes that a sentence names

EXPLANATIONS = {  # that are no numbers of a robot file
    "gain": "the gain of the voltages",
    "dead_band": "a dead band",
    "fade": "a fading supply",
    "tilt": "a tilted floor",
    "push": "a push on the body",
}
LIMIT_UNITS = {"current": " A", "heat": " W", "traction": ""}
LEFT_OUT = {  # why a plan leaves out moves
    "room": "would leave the room",
    "rest": "do not come to rest in 2 s",
    "traction": "ask too much grip",
    "current": "draw too much current",
    "still": "do not move it",
}
SHORTEST_WAY = 0.01  # [m] that a plan is said to go


def _numbers_known(statement: Statement) -> str:
    """ "all 6 numbers are known, the widest (viscous friction forward) within 9 %"; what is not known is named."""
    numbers = statement.numbers
    count, missing, widest = numbers["count"], numbers["missing"], numbers["widest"]
    if len(missing) == count:
        return f"no number is known{f': not {names_of(missing)}' if missing else ''}"
    share = f"{count - len(missing)} of" if missing else "all"
    within = f"within {short(max(0.1, 100.0 * numbers['share']))} %"
    if count == 1:
        return f"{in_words(widest)} is known {within}"
    words = f"{share} {count} numbers are known, the widest ({in_words(widest)}) {within}"
    return f"{words}; not known: {names_of(missing)}" if missing else words


def _planned(statement: Statement) -> str:
    """ "60 s of driving tell 5 of 6 numbers of axebot, the widest (viscous friction forward) within 2.5 %" """
    numbers = statement.numbers
    count, missing, widest = numbers["count"], numbers["missing"], numbers["widest"]
    begin = f"{numbers['seconds']:.3g} s of driving tell"
    if len(missing) == count:
        return f"{begin} no number of {statement.subject}: not {names_of(missing)}"
    shown = f"{count - len(missing)} of {count} numbers" if missing else f"all {count} numbers"
    words = f"{begin} {shown} of {statement.subject}, the widest ({in_words(widest)}) within "
    words += f"{short(max(0.1, 100.0 * numbers['share']))} %"
    return f"{words}; not {names_of(missing)}" if missing else words


def _planned_rig(statement: Statement) -> str:
    """ "60 s on the bench tell all 9 numbers of a motor of axebot, the widest (first motion backward) within 4 %" """
    numbers = statement.numbers
    begin = f"{numbers['seconds']:.3g} s on the bench tell"
    if not numbers["told"]:
        return f"{begin} no number of a motor of {statement.subject}"
    share = "all" if not numbers["missing"] else f"{numbers['told']} of"
    words = (
        f"{begin} {share} {numbers['count']} numbers of a motor of {statement.subject}, the widest "
        f"({numbers['widest']}) within {_within(numbers['share'])}"
    )
    return f"{words}; not {all_of([*numbers['missing']])}" if numbers["missing"] else words


def _planned_next(statement: Statement) -> str:
    """ "58 s more of driving bring the widest interval of axebot from 27 % (viscous friction turning) to 6 % (..)", or
    leave it as wide as it is."""
    numbers = statement.numbers
    before, after = (_within(numbers[share]) for share in ("known", "share"))
    if before == after or numbers["share"] >= numbers["known"]:
        return (
            f"{numbers['seconds']:.3g} s more of driving do not narrow the widest interval of {statement.subject}, "
            f"{before} ({in_words(numbers['before'])}): plan for more time, a larger room or another sensor"
        )
    return (
        f"{numbers['seconds']:.3g} s more of driving bring the widest interval of {statement.subject} from {before} "
        f"({in_words(numbers['before'])}) to {after} ({in_words(numbers['widest'])})"
    )


def _within(share: float) -> str:
    """ "2.9 %", or what is not known."""
    return f"{short(max(0.1, 100.0 * share))} %" if math.isfinite(share) else "unknown"


def _tells_apart(statement: Statement) -> str:
    """From what size on each of two explanations is told from the other."""
    one, other = (EXPLANATIONS.get(name, in_words(name)) for name in statement.numbers["explanations"])
    sizes = [
        f"{EXPLANATIONS.get(name.partition('.')[0], in_words(name))} {_size(name, size)}"
        for name, size in statement.numbers["sizes"].items()
    ]
    return f"it tells {one} from {other}, with all of both free: within {all_of(sizes)}"


def _size(name: str, size: float) -> str:
    """Half an interval: of a nuisance in its unit, else as a share."""
    unit = NUISANCE_UNITS.get(name)
    return f"{short(100.0 * size)} %" if unit is None else f"{name.partition('.')[2]} {short(size)} {unit}".strip()


def _asks(statement: Statement) -> str:
    """What a plan asks of battery, motors and wheels, and which moves were left out for what."""
    numbers = statement.numbers
    words = (
        f"the motors draw up to {short(numbers['current'])} A together, heat the hottest winding by "
        f"{short(numbers['heat'])} W on average, and a wheel pushes with up to {short(numbers['traction'])} times the "
        "weight on it"
    )
    reasons = [f"{numbers['left_out'][why]} that {LEFT_OUT[why]}" for why in LEFT_OUT if why in numbers["left_out"]]
    limits = {why: value for why, value in numbers["limits"].items() if math.isfinite(value)}
    if limits:
        words += f" (limits: {all_of([f'{why} {short(value)}{LIMIT_UNITS[why]}' for why, value in limits.items()])})"
    return f"{words}; of {numbers['tried']} moves it leaves out {all_of(reasons)}" if reasons else words


def _inside(statement: Statement) -> str:
    """How far a plan goes in its room."""
    (x, y), (width, depth) = statement.numbers["reach"], statement.numbers["area"]
    x, y = (length if length >= SHORTEST_WAY else 0.0 for length in (x, y))
    return (
        f"begin in the middle of {width:.3g} m x {depth:.3g} m, along its first side: {statement.numbers['robots']} "
        f"robots that may be meant went up to {x:.2g} m along it and {y:.2g} m to the side; stop it by hand if it "
        "comes near the border"
    )


def _records(statement: Statement) -> str:
    """What a plan expects in the log, and how noisy."""
    words = []
    for channel, std in statement.numbers["noise"].items():
        sizes = ", ".join(f"{size:.2g}" for size in dict.fromkeys(std.tolist()))
        words.append(f"{channel} in counts of {sizes} rad" if channel in COUNTED else f"{channel} +- {sizes}")
    return f"predicted for a log of {all_of(words)}, at {statement.numbers['rate']:.4g} Hz; log less, and it tells less"


def _finer(statement: Statement) -> str:
    """Where a plan promises what no model of a real robot holds."""
    numbers = statement.numbers
    names = "number is" if numbers["count"] == 1 else "numbers are"
    return (
        f"{numbers['count']} {names} predicted within less than {100.0 * numbers['limit']:.2g} %, the best within "
        f"{short(100.0 * numbers['finest'])} %: by these sensors alone, for a robot that is just as its model; a real "
        "one is not, so expect wider intervals (identify shows both: `planned`)"
    )


def _predicted(held_out: Statement | None) -> str:
    """How near noise the errors on logs held out are; "" where none was, or nothing is sure."""
    if held_out is None or held_out.code == "held_out_colour":
        return ""
    if held_out.code == "held_out_noise":
        return ", as well as the noise allows"
    why = ", on the fitted logs too" if held_out.numbers["fitted_too"] else ": something differs between the logs"
    return f", but its errors are {held_out.numbers['chi2'] ** 0.5:.2g} times the noise{why}"


def _outcome(statement: Statement) -> str:
    """How well the model follows the logs, and how well its numbers are known."""
    numbers = statement.numbers
    words = f"{WHERE[numbers['logs']]} {numbers['follows']}{_predicted(numbers.get('held_out'))}"
    return f"{words}; {numbers['known']}" if numbers["known"] else f"{words}: its numbers are not usable until it does"


def _outputs_missed(statement: Statement) -> str:
    """Outputs that the model does not follow."""
    parts = [
        name if percent is None else f"{name} (fit {percent:.0f} %)"
        for name, percent in zip(statement.numbers["names"], statement.numbers["percents"], strict=True)
    ]
    return f"the model does not follow {', '.join(parts)}"


def _failed(statement: Statement) -> str:
    """Why the numbers mean nothing."""
    failures = "; ".join(map(str, statement.numbers["failures"]))
    return f"failed: {failures}: the numbers are not usable until that is corrected"


def _not_usable(statement: Statement) -> str:
    """Logs with the same errors, by `check`."""
    one = statement.numbers["logs"] == 1
    faults = "; ".join(map(str, statement.numbers["findings"]))
    are, they = ("is", "it stands") if one else ("are", "they stand")
    return f"{statement.subject} {are} not usable as {they}: {faults}"


def _logs_with_errors(statement: Statement) -> str:
    """How many logs have an error, by `check`, and the first one."""
    logs, of = statement.numbers["logs"], statement.numbers["of"]
    have = "the log has" if of == 1 else f"{logs} of {of} logs have"
    return f"{have} an error that must be corrected first: {statement.numbers['first']}"


def _steady(statement: Statement) -> str:
    """Friction from steady stretches: its level, its shape, and what other shape is as good, or what none explains."""
    numbers = statement.numbers
    levels, groups = numbers["levels"], numbers["groups"]
    names = [f" ({name})" if len(groups) > 1 else "" for name in groups]
    level = all_of([f"{value:.3g} N{name}" for value, name in zip(levels, names, strict=True)])
    if numbers["misfit"]:
        untested = "whether the force changes within a run was not tested"
        repeats = untested if numbers["untested"] else "the errors repeat"
        cause = f"it takes {numbers['cause']} beside it" if numbers["cause"] else repeats
        alike = f"; but no offered shape fits: {cause}"
    else:
        ties = all_of([*numbers["ties"][:NAMED]])
        alike = f"; as good, as far as these data tell: {ties}" if ties else ""
    error = max(1.0, round(100.0 * numbers["share"]))
    return (
        f"friction along travel is {level}; its shape, {numbers['shapes']}, predicts the force in a direction that was "
        f"left out within {error:.0f} %{alike}; {numbers['known']}"
    )


def _force_changes(statement: Statement) -> str:
    """The force changes inside runs."""
    first, *others = map(str, statement.numbers["changes"])
    more = "".join(f"; also {change}" for change in others)
    return f"the force of friction changes within a run ({first}): the levels lie between both{more}"


def _shapes(statement: Statement) -> str:
    """Shapes of friction, each with its group."""
    pairs = zip(statement.numbers["names"], statement.numbers["groups"], strict=True)
    return all_of([f"{name} ({group})" if group else name for name, group in pairs])


def _of_groups(statement: Statement) -> str:
    """How well the numbers of each group are known."""
    groups, sentences = statement.numbers["groups"], statement.numbers["known"]
    return "; ".join(f"{g}: {k}" if len(sentences) > 1 else str(k) for g, k in zip(groups, sentences, strict=True))


SENTENCES = {
    "planned": Sentence(_planned),
    "planned_next": Sentence(_planned_next),
    "planned_rig": Sentence(_planned_rig),
    "rig_turns": Sentence(
        "one motor, its wheel off the ground, from rest; it turns at up to {top:.3g} rad/s, under {limit:.3g} {unit}; "
        "drive it once, log it from its first row on, and identify it as `what` motors"
    ),
    "plan_tells_apart": Sentence(_tells_apart),
    "plan_asks": Sentence(_asks),
    "plan_stays_inside": Sentence(_inside),
    "plan_records": Sentence(_records),
    "plan_finer_than_models": Sentence(_finer),
    "plan_begins": Sentence(
        "drive both programs from rest, log them apart, and give the second, of {held_out:.3g} s, to identify as "
        "`hold_out`"
    ),
    "numbers_known": Sentence(_numbers_known),
    "model_outcome": Sentence(_outcome),
    "not_compared": Sentence("{known}; no log was compared with the model"),
    "not_followed_at_all": Sentence("the model does not follow {outputs}: its numbers are not usable until it does"),
    "outputs_missed": Sentence(_outputs_missed),
    "nothing_followed": Sentence("{follows}"),
    "failed": Sentence(_failed),
    "cut_short": Sentence("cut short: the numbers are the best so far, not the final ones"),
    "log_not_usable": Sentence(_not_usable),
    "logs_with_errors": Sentence(_logs_with_errors),
    "not_made": Sentence("not made: {parts} ({reason})"),
    "force_changes_in_run": Sentence(_force_changes),
    "forces_unexplained": Sentence(
        "no shape of friction explains the forces: the best, {subject}, misses {error:.2g} N of {size:.2g} N in a "
        "direction that was left out"
    ),
    "steady_friction": Sentence(_steady),
    "shapes": Sentence(_shapes),
    "numbers_of_groups": Sentence(_of_groups),
}
