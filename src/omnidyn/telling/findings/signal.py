"""What `check` says of single channels: values, limits, motion, excitation."""

from __future__ import annotations

from omnidyn.document import all_of, short
from omnidyn.statement import NOTE, Statement
from omnidyn.telling.sentence import SOURCES, Sentence, by_number, counted, names

LIMITS = {
    "duty": "full duty", "supply": "the supply", "motor.current_limit_A": "current_limit_A of the robot file",
    "motor.voltage_limit_V": "voltage_limit_V of the robot file",
}  # fmt: skip


def _missing(statement: Statement) -> str:
    """Values are missing."""
    return f"{100 * statement.numbers['share']:.3g} % of {statement.subject} is missing"


def _blocked(statement: Statement) -> str:
    """The robot stands although it is driven."""
    return f"for {short(statement.numbers['seconds'], '.3g')} s the robot stands although it is driven hard enough to \
move: it was held, stood against something, or its friction is far above that of the robot file"


def _quantised(statement: Statement) -> str:
    """A sensor that counts in steps of 2 % of its usual value, or more."""
    n = statement.numbers
    unit = {"i": " A", "w": " rad/s"}.get(statement.subject[:1], "")
    cells = f" ({n['step_in_column']:.4g} {n['unit']} in column {n['column']})" if "unit" in n else ""
    hidden = f", hidden in a noise of {n['noise']:.3g}" if n["noise"] > n["step"] else ""
    return f"{names(statement)} {by_number(statement.subject, 'counts', 'count')} in steps of {n['step']:.4g}{unit}\
{cells}, up to {100 * n['share']:.0f} % of the usual value{hidden}"


def _reads_zero(statement: Statement) -> str:
    """A wheel slower than its encoder can measure."""
    n = statement.numbers
    return (
        f"{statement.subject} reads 0 in {100 * n['share']:.0f} % of the rows while {SOURCES[n['source']]} says that \
it turns, \
slower than two steps of its encoder ({n['step']:.4g} rad/s)"
    )


def _spike(statement: Statement) -> str:
    """Single values far from both neighbours."""
    n, count = statement.numbers, vars(statement)["count"]
    return f"{counted(count, 'value')} of {statement.subject} alone, far from the rows before and after, the farthest \
{n['farthest']:.4g} at t = {n['at_s']:.6g} s"


def _stuck(statement: Statement) -> str:
    """A sensor repeats one value although it should change."""
    n = statement.numbers
    return f"{statement.subject} repeats one value to the last digit {counted(n['times'], 'time')}, for up to \
{short(n['longest_s'], '.3g')} s, while the robot moves"


def _echo(statement: Statement) -> str:
    """A measurement that is the command of rows before."""
    rows = int(statement.numbers["rows"])
    row = {0: "the same row", 1: "the row before"}.get(rows, f"{rows} rows before")
    return f"{statement.numbers['channel'].replace('_', ' ')} is the command of {row}, to the last digit: no sensor \
measured it"


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


def _too_fast(statement: Statement) -> str:
    """An input that changes more from row to row than the rows can show."""
    change = by_number(statement.subject, "changes", "change")
    return f"{names(statement)} {change} so much from row to row in {100 * statement.numbers['share']:.2g} % of the \
rows that what the motors got between them is not in the log"


def _sag(statement: Statement) -> str:
    """A supply that drops under load."""
    n = statement.numbers
    return f"the supply drops by {100 * n['drop']:.3g} %, from {n['high_V']:.4g} to {n['low_V']:.4g} V, at its lowest \
at t = {n['lowest_at_s']:.5g} s"


def _no_supply(statement: Statement) -> str:
    """A duty without its supply."""
    nominal = statement.numbers.get("nominal_V")
    taken = f"the {nominal:g} V of the robot file are taken" if nominal else "no voltage can be made of it"
    return f"duty was logged, the supply was not: {taken}, and a sag cannot be seen"


def _never_moved(statement: Statement) -> str:
    """The robot rests throughout."""
    driven = statement.numbers["driven"]
    why = "it was driven, but never beyond its dead zone, or it was blocked" if driven else "nothing drove it"
    return f"the robot never moves beyond the noise of its sensors: {why}"


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


def _averaged(statement: Statement) -> str:
    """A speed that is a mean over a window of rows."""
    n = statement.numbers
    mean = by_number(statement.subject, "is a mean", "are means")
    return f"{names(statement)} {mean} over {n['rows']} rows ({1e3 * n['seconds']:.3g} ms): {1e3 * n['late_s']:.3g} ms \
late, and slow to show a start"


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


def _late(statement: Statement) -> str:
    """A speed late by half its differences."""
    return f"they are {1e3 * statement.numbers['seconds_late']:.3g} ms late: latency in the mapping"


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
        _missing,
        "rows without it are not used where it is needed",
    ),
    "quantised": Sentence(_quantised, "average over longer windows; a sample alone says little"),
    "reads_zero": Sentence(_reads_zero, "take its speed from counts over a longer time, or from the other wheels"),
    "spike": Sentence(_spike, "they are left out where a mean is taken"),
    "stuck": Sentence(_stuck, "those rows of it are not used; look at the encoder and its cable"),
    "echo": Sentence(
        _echo,
        "log what the encoders, the gyroscope or a camera measure; of a robot whose software does not, leave the "
        "column out",
    ),
    "unsigned": Sentence(_unsigned, _unsigned_remedy),
    "saturation": Sentence(
        _saturation, "what was asked for beyond it was not applied: fit from what was applied, or drive with less"
    ),
    "too_fast": Sentence(_too_fast, "log faster, or drive more slowly; a fit of the motors leaves these rows out"),
    "sag": Sentence(
        _sag,
        "use the supply row by row (the voltage applied), never one number for it",
        {"of_duty": "use the supply row by row (voltage = duty x supply), never one number for it"},
    ),
    "no_supply": Sentence(_no_supply, "log the battery voltage; give its nominal value as [drive] supply_V"),
    "never_moved": Sentence(
        _never_moved, "drive with more; such a log bounds friction from below and says nothing else"
    ),
    "blocked": Sentence(
        _blocked,
        "leave those rows out",
    ),
    "droop": Sentence(_droop, "fit friction against measured speed, not against the commanded one"),
    "start_up": Sentence(
        "the command is set from the first row, the wheels rest for {rows} rows ({seconds:.2g} s) and then speed up",
        "leave the first half second out of steady values",
    ),
    "burst": Sentence(
        _burst, "a tracker that slips does so; leave those rows out if the robot cannot turn or drive like that"
    ),
    "last_row": Sentence(
        "{subject} is 0 in the last row, and not before: the end of the recording", "leave the last row out"
    ),
    "averaged": Sentence(
        _averaged,
        "log the speed of a shorter window (a setting of many motor controllers), or the position; `what` motors of "
        "identify takes the mean into account, other fits may find too small a dead band",
    ),
    "filtered": Sentence(
        _filtered,
        "",
        {
            "centred": "they show a motion a row before it begins: where that matters, fit to the positions, without "
            "the speeds",
            "backward": _late,
            "low_pass": "they lag and hide what is fast: log the speed without the filter, or fit to the positions, "
            "without the speeds",
        },
    ),
    "energy": Sentence(
        "the motors would take up to {worst_W:.3g} W out of the robot while it does not slow down: the back-EMF is "
        "{emf_over_voltage:.3g} times the voltage applied",
        "these rows cannot be of this robot file: check K, gear ratio, wheel and robot radius, and the units of "
        "voltage and speed",
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
    "judged_again": Sentence("with the fitted robot this is gone ({finding}): it rested on the guess of {guesses}"),
}
