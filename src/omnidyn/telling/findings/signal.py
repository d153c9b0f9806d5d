"""What `check` says of single channels: values, limits, motion, excitation."""

from __future__ import annotations

from omnidyn.document import all_of
from omnidyn.statement import NOTE, Statement
from omnidyn.telling.sentence import Sentence, either
from omnidyn.telling.small_words import SOURCES, by_number, names

LIMITS = {
    "duty": "full duty",
    "supply": "the supply",
    "motor.current_limit_A": "current_limit_A of the robot file",
    "motor.voltage_limit_V": "voltage_limit_V of the robot file",
}


def _quantised(statement: Statement) -> str:
    """A sensor that counts in steps of 2 % of its usual value, or more."""
    n = statement.numbers
    unit = {"i": " A", "w": " rad/s"}.get(statement.subject[:1], "")
    cells = f" ({n['step_in_column']:.4g} {n['unit']} in column {n['column']})" if "unit" in n else ""
    hidden = f", hidden in a noise of {n['noise']:.3g}" if n["noise"] > n["step"] else ""
    return f"{names(statement)} {by_number(statement.subject, 'counts', 'count')} in steps of {n['step']:.4g}{unit}\
{cells}, up to {100 * n['share']:.0f} % of the usual value{hidden}"


EQUAL_REASONS = {
    "voltage": "their motors get different voltages",
    "duty": "their motors get different duties",
    "wheel_speed_command": "they were asked for different speeds",
    "noise": "noise is never the same twice",
}


def _echo(statement: Statement) -> str:
    """A measurement that is the command of rows before."""
    rows = int(statement.numbers["rows"])
    row = {0: "the same row", 1: "the row before"}.get(rows, f"{rows} rows before")
    return f"{statement.numbers['channel'].replace('_', ' ')} is the command of {row}, to the last digit: no sensor \
measured it"


def _equal(statement: Statement) -> str:
    """Two components that hold the same numbers."""
    reason = statement.numbers["reason"]
    why = EQUAL_REASONS.get(reason) or f"{SOURCES[reason]} says that they turn differently" if reason else ""
    return f"{' and '.join(statement.subject.split())} are equal to the last digit in every row" + (
        f", while {why}: one was logged in the place of the other" if reason else ""
    )


def _unsigned(statement: Statement) -> str:
    """A voltage, duty or current without its sign."""
    n = statement.numbers
    if statement.severity == NOTE:
        return "the sensor gives the size of the current only; its sign was taken from the commanded speed"
    if n["channel"] == "current":
        return f"the currents are never negative, though the motors are driven backward in {100 * n['share']:.0f} % of \
the \
values: the sensor gives their size only"
    return f"{names(statement)} {by_number(statement.subject, 'is', 'are')} never negative, though the wheels turn \
backward under it in {100 * n['share']:.0f} % of the values: a size without its direction, or counted from an offset"


def _unsigned_remedy(statement: Statement) -> str:
    """What to do about a missing sign."""
    if statement.severity == NOTE:
        return "a mean of it has a floor where the current changes sign within its ripple"
    if statement.numbers["channel"] == "current":
        return "say so: `current_unsigned` takes the sign from the commanded speed"
    return f"log the signed {statement.numbers['channel']}: times the bit of direction, or less the value of standstill"


def _saturation(statement: Statement) -> str:
    """A drive at its limit."""
    n = statement.numbers
    return f"{names(statement)} {by_number(statement.subject, 'is', 'are')} at the limit ({n['limit']:.4g}, \
{LIMITS[n['limited_by']]}) in {100 * n['share']:.2g} % of the rows"


def _droop(statement: Statement) -> str:
    """Settled wheels that do not turn as commanded."""
    n = statement.numbers
    reached = "is not reached" if n["ratio"] < 1.0 else "is exceeded"
    return (
        f"the commanded speed ({n['command']}) {reached}: settled wheels turn {n['ratio']:.3g} (+-{n['error']:.2g}) of \
it"
    )


def _burst(statement: Statement) -> str:
    """A speed over the floor that is far too high for a moment."""
    n = statement.numbers
    return f"{statement.subject} goes up to {n['farthest']:.3g} at t = {n['at_s']:.5g} s for less than \
{n['longest_s']:g} s, \
{abs(n['farthest']) / n['usual']:.0f} times what it stays below in 90 % of the rows"


def _filtered(statement: Statement) -> str:
    """A speed that the recorder made of positions."""
    n = statement.numbers
    rows = 2 * n["rows_late"]
    how = {
        "centred": "centred differences, from the row before to the row after,",
        "backward": "differences to the row before" if rows == 1 else f"differences over {rows:.0f} rows back",
        "low_pass": f"low-passed differences (time constant {1e3 * n['time_constant_s']:.2g} ms)",
    }[n["filter"]]
    are = by_number(statement.subject, "is", "are")
    return f"{names(statement)} {are} {how} of {all_of(' '.join(n['positions']).split())}"


def _not_excited(statement: Statement) -> str:
    """An axis along which the robot hardly moves."""
    axis, turns = statement.subject, statement.subject == "yaw"
    return f"the robot hardly moves {'about' if turns else 'along'} {axis} ({statement.numbers['rms']:.3g} \
{'rad/s' if turns else 'm/s'} rms)"


def _not_excited_remedy(statement: Statement) -> str:
    """A run that moves along the axis."""
    add = "turns" if statement.subject == "yaw" else f"drives along {statement.subject}"
    return f"friction and inertia of {statement.subject} cannot be told from this log; add a run that {add}"


SENTENCES = {
    "wrapped": Sentence(
        "{subject} is near 0 or near 2^{bits} in the units of the file, and never between: negative numbers of "
        "{bits} bits, read as unsigned",
        "take 2^{bits} off those cells",
    ),
    "placeholder": Sentence(
        "{subject} is {cell:.10g} in {count} rows, {times:.3g} times what it is otherwise: it stands for no value",
        "leave those cells blank",
    ),
    "missing": Sentence(
        "{share:%.3g} % of {subject!w} {subject:is|are} missing",
        "rows without {subject:it|them} are not used where {subject:it is|they are} needed",
    ),
    "quantised": Sentence(_quantised, "average over longer windows; a sample alone says little"),
    "reads_zero": Sentence(
        "{subject} reads 0 in {share:%.0f} % of the rows while {source!t} says that it turns, slower than two "
        "steps of its encoder ({step:.4g} rad/s)",
        "take its speed from counts over a longer time, or from the other wheels",
    ),
    "spike": Sentence(
        "{count} {count:value|values} of {subject} alone, far from the rows before and after, the farthest "
        "{farthest:.4g} at t = {at_s:.6g} s",
        "they are left out where a mean is taken",
    ),
    "stuck": Sentence(
        "{subject} repeats one value to the last digit {times} {times:time|times}, for up to {longest_s:~.3g} s, "
        "while the robot moves",
        "those rows of it are not used; look at the encoder and its cable",
    ),
    "echo": Sentence(
        _echo,
        "log what the encoders, the gyroscope or a camera measure; of a robot whose software does not, leave the "
        "column out",
    ),
    "equal": Sentence(
        _equal, "look at what the program writes into these columns: each wheel has a counter of its own"
    ),
    "unsigned": Sentence(_unsigned, _unsigned_remedy),
    "saturation": Sentence(
        _saturation, "what was asked for beyond it was not applied: fit from what was applied, or drive with less"
    ),
    "too_fast": Sentence(
        "{subject!w} {subject:changes|change} so much from row to row in {share:%.2g} % of the rows that what the"
        " motors got between them is not in the log",
        "log faster, or drive more slowly; a fit of the motors leaves these rows out",
    ),
    "sag": Sentence(
        "the supply drops by {drop:%.3g} %, from {high_V:.4g} to {low_V:.4g} V, at its lowest at t = "
        "{lowest_at_s:.5g} s",
        "use the supply row by row (the voltage applied), never one number for it",
        {"of_duty": "use the supply row by row (voltage = duty x supply), never one number for it"},
    ),
    "no_supply": Sentence(
        either(
            "nominal_V",
            "duty was logged, the supply was not: the {nominal_V:g} V of the robot file are taken, and a sag cannot "
            "be seen",
            "duty was logged, the supply was not: no voltage can be made of it, and a sag cannot be seen",
        ),
        "log the battery voltage; give its nominal value as [drive] supply_V",
    ),
    "never_moved": Sentence(
        either(
            "driven",
            "the robot never moves beyond the noise of its sensors: it was driven, but never beyond its dead zone, or"
            " it was blocked",
            "the robot never moves beyond the noise of its sensors: nothing drove it",
        ),
        "drive with a higher voltage; such a log bounds friction from below and says nothing else",
    ),
    "blocked": Sentence(
        "for {seconds:~.3g} s the robot stands still although it is driven hard enough to move: something held it, "
        "or its friction is far above that of the robot file",
        "if something held it, delete these rows from the file; if nothing did, keep them: they tell its friction",
    ),
    "droop": Sentence(_droop, "fit friction against measured speed, not against the commanded one"),
    "start_up": Sentence(
        "the command is set from the first row, the wheels rest for {rows} rows ({seconds:.2g} s) and then speed up",
        "leave the first half second out of steady values",
    ),
    "burst": Sentence(
        _burst, "a tracker that loses its target shows this; leave those rows out if the robot cannot move like that"
    ),
    "last_row": Sentence(
        "{subject} is 0 in the last row, and not before: the end of the recording", "leave the last row out"
    ),
    "averaged": Sentence(
        "{subject!w} {subject:is a mean|are means} over {rows} rows ({seconds:m.3g} ms): {late_s:m.3g} ms late, "
        "and slow to show a start",
        "log the speed of a shorter window (a setting of many motor controllers), or the position; `what` motors of "
        "identify takes the mean into account, other fits may find too small a dead band",
    ),
    "filtered": Sentence(
        _filtered,
        "",
        {
            "centred": "they show a motion a row before it begins: where that matters, fit to the positions, without "
            "the speeds",
            "backward": "they are {seconds_late:m.3g} ms late: latency in the mapping",
            "low_pass": "they lag and hide what is fast: log the speed without the filter, or fit to the positions, "
            "without the speeds",
        },
    ),
    "energy": Sentence(
        "the motors would take up to {worst_W:.3g} W out of the robot while it does not slow down: the back-EMF is "
        "{emf_over_voltage:.3g} times the voltage applied",
        "these rows cannot be of this robot file: check K, gear ratio, wheel and robot radius, the units of voltage "
        "and speed, and how late a voltage acts (drive.latency_s)",
    ),
    "not_excited": Sentence(_not_excited, _not_excited_remedy),
    "one_way": Sentence(
        "{subject} moves one way only",
        "friction that differs forward and backward, and an offset of a sensor, cannot be told from this log; drive "
        "both ways",
    ),
    "one_speed": Sentence(
        "while it moves, the speed varies by a factor of {speeds:.2g} only",
        "viscous and Coulomb friction cannot be told apart from this log alone; drive at several speeds",
    ),
    "judged_again": Sentence(
        "with the fitted robot this is no longer found ({finding}): it rested on the guess of {guesses}"
    ),
}
