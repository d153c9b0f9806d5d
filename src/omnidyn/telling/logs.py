"""What reading a log leaves open (doubts) and what it decides (notes)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from omnidyn.document import all_of
from omnidyn.logs.columns.doubts import Doubt
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either
from omnidyn.telling.small_words import by_number


@dataclass(frozen=True)
class Reason(Sentence):
    """Why columns are not taken: "PWM1 looks like d1, " + link + text."""

    link: str = "but "


def _turn_rate_too_large(statement: Statement) -> str:
    """it is too large for a turn rate in rad/s"""
    n = statement.numbers
    given = "its format means rad/s" if n["unit"] else "no unit is given"
    return f"{given}, and up to {n['largest']:.3g} is no turn rate of a robot in rad/s"


CHANNELS = {
    "supply": "supply of a robot",
    "u": "voltage of a motor",
    "i": "current of a motor",
    "w": "speed of a wheel",
    "vx": "speed of a robot",
    "vy": "speed of a robot",
    "x": "span of a robot's positions",
    "y": "span of a robot's positions",
}
SI = {"supply": "V", "u": "V", "i": "A", "w": "rad/s", "vx": "m/s", "vy": "m/s", "x": "m", "y": "m"}


def _beyond_range(statement: Statement) -> str:
    """no robot has so much of it"""
    n = statement.numbers
    size = float(f"{n['size']:.4g}")
    return f"about {size:.6g} {n['unit'] or SI[n['of']]} is no {CHANNELS[n['of']]}"


def _command_without_unit(statement: Statement) -> str:
    """it may be volts or a duty"""
    largest, units = statement.numbers["largest"], _units(statement)
    scale = units[-1].partition("/")[2]
    volts = "volts or " if "V" in units else "millivolts or " if "mV" in units else ""
    looks = "a duty" if largest <= 1.0 else "percent" if largest <= 100.0 else f"a PWM value, of 0..{scale}"
    return f"no unit is given, and up to {largest:.3g} may be {volts}{looks}"


def _unit_of_other(statement: Statement) -> str:
    """its unit is of another quantity"""
    unit, quantity = statement.numbers["unit"], statement.numbers["quantity"]
    article = "" if quantity == "time" else "an " if quantity[0] in "aeiou" else "a "
    return f"{unit} is no unit of {article}{quantity}"


REASONS = {
    "component_taken": Reason("which is {by} already", link=""),
    "unit_unknown": Reason("the unit {unit} is unknown"),
    "cells_not_numbers": Reason("cells such as {cell} are no numbers"),
    "cells_not_dates": Reason("cells such as {cell} are no numbers and no known dates"),
    "quantity_unknown": Reason("no word and no unit says what they measure"),
    "volts_or_speeds": Reason("which may be voltages or speeds (say `column` u1={first}:V and so on)", link=""),
    "volts_or_speeds_of_places": Reason("they may be voltages or speeds"),
    "counts_per_turn_unknown": Reason("counts per turn are not known"),
    "unit_of_other": Reason(_unit_of_other),
    "rim_without_robot": Reason(
        "{unit} is the speed of its rim: name the robot, whose radius of the wheels makes rad/s of it"
    ),
    "wheel_unknown": Reason(
        either(
            "order",
            "no number says which wheel each is (the motion says `column` {order})",
            "no number says which wheel each is (say `column` {first} and so on)",
        )
    ),
    "places_against_motion": Reason(
        "the motion is another one than that of wheels at these places (the motion says `column` {order})"
    ),
    "turns_in_degrees": Reason(
        either(
            "unit",
            "it jumps as degrees do, not radians",
            "no unit is given, and it jumps as degrees do",
        )
    ),
    "beyond_range": Reason(_beyond_range),
    "too_many_volts": Reason("up to {largest:.3g} {unit} cannot be: a motor gets {most_V:.3g} V at the most"),
    "too_much_duty": Reason(
        either(
            "unit",
            "up to {largest:.3g} {unit} cannot be: a full duty is 1",
            "up to {largest:.3g} as a duty cannot be: a full duty is 1",
        )
    ),
    "turn_rate_too_large": Reason(_turn_rate_too_large),
    "servo_pulses": Reason(
        "{least:.4g} to {largest:.4g} look like widths of servo pulses: log (width - 1500) / 500, a duty"
    ),
    "command_without_unit": Reason(_command_without_unit),
    "clock_unit_unknown": Reason("neither its name nor a unit says that it is a time"),
    "time_without_unit": Reason("no unit is given and rows are {step:.4g} apart"),
    "more_currents": Reason("there are {currents} beside {motors} motors (say `column` i1={first} and so on)"),
    "no_number": Reason("no message holds a number for it"),
    "no_heading_number": Reason("no message holds a number for it (a quaternion of zeros?)"),
    "several_topics": Reason("and so do those of others ({topics})", link=""),
}

SETTLED_BY_UNIT, NO_UNIT = ("command_without_unit", "turns_in_degrees", "turn_rate_too_large"), "no unit is given"


def _units(statement: Statement) -> tuple[str, ...]:
    return statement.units if isinstance(statement, Doubt) else ()


def _looks(doubt: Doubt) -> str:
    """What columns look like, and why they are not taken."""
    reason = REASONS[doubt.code]
    looks = f"{', '.join(doubt.columns)} {by_number(doubt.columns, 'looks', 'look')} like"
    kind = "columns of wheels" if doubt.stem else ", ".join(doubt.components)
    return f"{looks} {kind}, {reason.link}{reason.of(doubt)}"


def _doubt(reason: Reason) -> Callable[[Statement], str]:
    """The sentence of a doubt for one reason."""

    def sentence(statement: Statement) -> str:
        assert isinstance(statement, Doubt)
        return f"{_looks(statement)}: not taken"

    why = reason.text.__doc__ if callable(reason.text) else reason.text
    sentence.__doc__ = f"{{columns}} look like {{components}}, {reason.link}{why}: not taken"
    return sentence


def _settle(statement: Statement) -> str:
    """The declaration that settles it."""
    assert isinstance(statement, Doubt)
    if statement.stem:
        *others, last = statement.units
        return f"say what they are: `assume` {statement.stem}={', '.join(others)} or {last}"
    if statement.declarations:
        return f"say {' or '.join(_option(*declaration) for declaration in statement.declarations)}"
    if statement.code == "no_number":
        return "look at what fills in these messages"
    return "give the column another name, or say what it is: `column`"


def _option(option: str, text: str) -> str:
    return f'`column` "{text}"' if option == "column" else f"`{option}` {text}"


def in_brief(doubt: Doubt) -> str:
    """PWM1 .. PWM4, no unit is given (say `assume` d=V, duty, % or duty/255)."""
    columns = f"{doubt.columns[0]} .. {doubt.columns[-1]}" if len(doubt.columns) > 2 else all_of(doubt.columns)
    for_want_of_unit = doubt.code in SETTLED_BY_UNIT and not doubt.numbers.get("unit")
    reason = NO_UNIT if for_want_of_unit else REASONS[doubt.code].of(doubt)
    if not doubt.units:
        return f"{columns}, {reason}"
    *more, last = doubt.units
    option, text = doubt.declarations[0]
    first = text.removesuffix(doubt.units[0])
    units = f"{', '.join(more)} or {last}" if more else last
    return f"{columns}, {reason} (say {_option(option, first + units)})"


def _time_unclear(statement: Statement) -> str:
    """Columns that may be the time."""
    return _looks(statement.numbers["doubt"])


def _wheels_by_places(statement: Statement) -> str:
    """Wheels called by their places."""
    n = statement.numbers
    order = ", ".join(f"{name} is wheel {wheel}" for name, wheel in zip(n["columns"], n["wheels"], strict=True))
    return f"names say where the wheels stand: {order}"


SENTENCES = {
    "wheel_table": Sentence(
        "wheels turn {least:.2f} to {most:.2f} times as fast as asked, above a dead band of up to {dead_band:.2g} rad/s"
    ),
    "wheel_table_bent": Sentence(
        "a straight line misses {share:%.0f} % of the largest speed of {subject}",
        "hold more speeds, each until it is steady, or ask for less: a wheel at the limit of its supply stays behind",
    ),
    **{code: Sentence(_doubt(reason), _settle) for code, reason in REASONS.items()},
    "assumption_unused": Sentence(
        "`assume` {assumption} is used for no column: there is none of this name or kind",
    ),
    "time_unclear": Sentence(_time_unclear),
    "taken_as_si": Sentence("no unit is given for {columns:,}: taken as SI ({units:,})"),
    "taken_as_duty": Sentence("no unit is given for {columns:,}: taken as duty, -1..1"),
    "taken_as_volts": Sentence("no unit is given for {columns:,}: taken as V, as the name says"),
    "taken_as_volts_by_size": Sentence("no unit is given for {columns:,}: taken as V (at most {largest:.3g})"),
    "time_unit_taken": Sentence("{column} has no unit: taken as {unit}, rows are {step_s:.4g} s apart"),
    "dates": Sentence("{column} holds dates: time begins at 0 with the first"),
    "speeds_of_rims": Sentence(
        "speeds of wheels in {unit} are those of their rims: divided by the radius of the wheels"
    ),
    "side_of_gear": Sentence(
        "speeds of wheels are on the {side} side: the commands are {ratio:.4g} times those of the body"
    ),
    "side_by_name": Sentence(
        "{columns:,} are counts of a turn of the motor, before the gear, as their names say; those of a turn of the "
        "wheel are ticks/COUNTS@wheel"
    ),
    "one_motor": Sentence(
        either(
            "numbered",
            "no wheel but the first has a number: taken as a log of one motor",
            "no wheel has a number: taken as a log of one motor",
        )
    ),
    "wheels_from_zero": Sentence(
        either(
            "from_one",
            "wheels are numbered from 0 in the file: 0 is wheel 1 ({from_one:,} from 1)",
            "wheels are numbered from 0 in the file: 0 is wheel 1",
        )
    ),
    "wheels_by_places": Sentence(_wheels_by_places),
    "motor_side_without_robot": Sentence(
        "speeds and angles are those of the motor shaft: no robot is given, so no gear is known"
    ),
    "current_sign_taken": Sentence(
        "currents are taken as unsigned: they get the sign of the {origin}, and 0 where that is 0"
    ),
    "file_cut_short": Sentence("{text}"),
    "rows_joined": Sentence("{joined} of {rows} rows fill the blanks of a row of the same time: joined to it"),
    "rows_empty": Sentence("{left_out} of {rows} rows hold no time or no number: left out, first in line {first}"),
    "rows_of_padding": Sentence(
        "{left_out} of {rows} rows at the end repeat one row with an earlier time (padding): left out, first in line "
        "{first}"
    ),
    "rows_repeated": Sentence(
        "{left_out} of {rows} rows repeat the time of the row before: left out, first in line {first}"
    ),
    "on_change": Sentence(
        either(
            "held",
            "{subject} is recorded on change ({blank:%.0f} % of its cells are blank): held",
            "{subject} is recorded on change ({blank:%.0f} % of its cells are blank): nothing is made up between",
        )
    ),
    "rows_sorted": Sentence("time goes back {times} times: rows were sorted"),
    "latency_taken_out": Sentence("{subject} was moved back by its latency of {seconds:g} s"),
}
