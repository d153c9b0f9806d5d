"""What reading a log leaves open (doubts) and what it decides (notes)."""

from __future__ import annotations

from collections.abc import Callable

from omnidyn.document import all_of
from omnidyn.logs.columns.doubt import Doubt
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, Wording, by_number


def _turns_in_degrees(statement: Statement) -> str:
    """but its angle jumps by 360 as degrees do"""
    if statement.numbers.get("unit"):
        return "but it jumps by 360 as degrees do, not radians"
    return "but no unit is given, and it jumps by 360 as degrees do"


def _too_much_duty(statement: Statement) -> str:
    """but its values are beyond a full duty"""
    n = statement.numbers
    return f"but up to {n['largest']:.3g} {n['unit'] or 'as a duty'} cannot be: a full duty is 1"


def _turn_rate_too_large(statement: Statement) -> str:
    """but it is too large for a turn rate in rad/s"""
    n = statement.numbers
    given = "its format means rad/s" if n["unit"] else "no unit is given"
    return f"but {given}, and up to {n['largest']:.3g} is no turn rate of a robot in rad/s"


def _command_without_unit(statement: Statement) -> str:
    """but it may be volts or a duty"""
    largest, units = statement.numbers["largest"], _units(statement)
    scale = units[-1].partition("/")[2]
    looks = "a duty" if largest <= 1.0 else "percent" if largest <= 100.0 else f"a PWM value, of 0..{scale}"
    return f"but no unit is given, and up to {largest:.3g} may be {'volts or ' * ('V' in units)}{looks}"


def _unit_of_other(statement: Statement) -> str:
    """but its unit is of another quantity"""
    unit, quantity = statement.numbers["unit"], statement.numbers["quantity"]
    article = "" if quantity == "time" else "an " if quantity[0] in "aeiou" else "a "
    return f"but {unit} is no unit of {article}{quantity}"


def _wheel_unknown(statement: Statement) -> str:
    """but nothing says which wheel it is"""
    n = statement.numbers
    declared = f"the motion says `column` {n['order']}" if n["order"] else f"say `column` {n['first']} and so on"
    return f"but no number says which wheel each is ({declared})"


REASONS: dict[str, Wording] = {
    "component_taken": "which is {by} already",
    "unit_unknown": "but the unit {unit} is unknown",
    "cells_not_numbers": "but cells such as {cell} are no numbers",
    "cells_not_dates": "but cells such as {cell} are no numbers and no known dates",
    "volts_or_speeds": "which may be voltages or speeds (say `column` u1={first}:V and so on)",
    "counts_per_turn_unknown": "but counts per turn are not known",
    "unit_of_other": _unit_of_other,
    "rim_without_robot": "but {unit} is the speed of its rim: name the robot, whose radius of the wheels makes rad/s "
    "of it",
    "wheel_unknown": _wheel_unknown,
    "places_against_motion": "but the motion is another one than that of wheels at these places (the motion says "
    "`column` {order})",
    "turns_in_degrees": _turns_in_degrees,
    "too_many_volts": "but up to {largest:.3g} {unit} cannot be: a motor gets {most_V:.3g} V at the most",
    "too_much_duty": _too_much_duty,
    "turn_rate_too_large": _turn_rate_too_large,
    "servo_pulses": "but {least:.4g} to {largest:.4g} look like widths of servo pulses: log (width - 1500) / 500, a "
    "duty",
    "command_without_unit": _command_without_unit,
    "clock_unit_unknown": "but its name and unit do not say how long one count is",
    "time_without_unit": "but no unit is given and rows are {step:.4g} apart",
    "more_currents": "but there are {currents} beside {motors} motors (say `column` i1={first} and so on)",
    "no_number": "but no message holds a number for it",
    "no_heading_number": "but no message holds a number for it (a quaternion of zeros?)",
    "several_topics": "and so do those of others ({topics})",
}  # fmt: skip

SETTLED_BY_UNIT, NO_UNIT = ("command_without_unit", "turns_in_degrees", "turn_rate_too_large"), "no unit is given"


def _units(statement: Statement) -> tuple[str, ...]:
    return statement.units if isinstance(statement, Doubt) else ()


def _looks(doubt: Doubt) -> str:
    """What columns look like, and why they are not taken."""
    looks = by_number(doubt.columns, "looks", "look")
    reason = Sentence(REASONS[doubt.code]).of(doubt)
    return f"{', '.join(doubt.columns)} {looks} like {', '.join(doubt.components)}, {reason}"


def _doubt(reason: Wording) -> Callable[[Statement], str]:
    """The sentence of a doubt for one reason."""

    def sentence(statement: Statement) -> str:
        assert isinstance(statement, Doubt)
        return f"{_looks(statement)}: not taken"

    why = reason.__doc__ if callable(reason) else reason
    sentence.__doc__ = f"{{columns}} look like {{components}}, {why}: not taken"
    return sentence


def _settle(statement: Statement) -> str:
    """The declaration that settles it."""
    assert isinstance(statement, Doubt)
    if statement.declarations:
        return f"say {' or '.join(_option(*declaration) for declaration in statement.declarations)}"
    if statement.code == "no_number":
        return "look at what fills in these messages"
    return "give the column another name, or say what it is: `column`"


def _option(option: str, text: str) -> str:
    return f'`column` "{text}"' if option == "column" else f"`{option}` {text}"


def _is_for_want_of_unit(doubt: Doubt) -> bool:
    """Whether a unit settles it, and none is given."""
    return doubt.code in SETTLED_BY_UNIT and not doubt.numbers.get("unit")


def in_brief(doubt: Doubt) -> str:
    """PWM1 .. PWM4, no unit is given (say `assume` d=V, duty, % or duty/255)."""
    columns = f"{doubt.columns[0]} .. {doubt.columns[-1]}" if len(doubt.columns) > 2 else all_of(doubt.columns)
    reason = NO_UNIT if _is_for_want_of_unit(doubt) else Sentence(REASONS[doubt.code]).of(doubt).removeprefix("but ")
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


def _taken_as_volts(statement: Statement) -> str:
    """A command without a unit that can only be volts."""
    n = statement.numbers
    why = f" (at most {n['largest']:.3g})" if "largest" in n else ", as its name says"
    return f"{n['column']} has no unit: taken as V{why}"


def _one_motor(statement: Statement) -> str:
    """A log of one motor."""
    some = "no wheel but the first has" if statement.numbers["numbered"] else "no wheel has"
    return f"{some} a number: taken as a log of one motor"


def _wheels_from_zero(statement: Statement) -> str:
    """Wheels counted from 0."""
    others = statement.numbers["from_one"]
    but = f" ({', '.join(others)} from 1)" if others else ""
    return f"wheels are numbered from 0 in the file: 0 is wheel 1{but}"


def _wheels_by_places(statement: Statement) -> str:
    """Wheels called by their places."""
    n = statement.numbers
    order = ", ".join(f"{name} is wheel {wheel}" for name, wheel in zip(n["columns"], n["wheels"], strict=True))
    return f"wheels are told by their places: {order}"


def _taken_as_si(statement: Statement) -> str:
    """Columns without a unit."""
    n = statement.numbers
    return f"no unit is given for {', '.join(n['columns'])}: taken as SI ({', '.join(n['units'])})"


def _on_change(statement: Statement) -> str:
    """A channel that was recorded when it changed."""
    n = statement.numbers
    how = "held" if n["held"] else "nothing is made up between"
    return f"{statement.subject} is recorded on change ({100 * n['blank']:.0f} % of its cells are blank): {how}"


SENTENCES = {
    **{code: Sentence(_doubt(reason), _settle) for code, reason in REASONS.items()},
    "assumption_unused": Sentence(
        "`assume` {assumption} is used for no column: there is none of this name or kind",
    ),
    "time_unclear": Sentence(_time_unclear),
    "taken_as_si": Sentence(_taken_as_si),
    "taken_as_duty": Sentence("{column} has no unit: taken as duty, -1..1"),
    "taken_as_volts": Sentence(_taken_as_volts),
    "time_unit_taken": Sentence("{column} has no unit: taken as {unit}, rows are {step_s:.4g} s apart"),
    "dates": Sentence("{column} holds dates: time begins at 0 with the first"),
    "speeds_of_rims": Sentence(
        "speeds of wheels in {unit} are those of their rims: divided by the radius of the wheels"
    ),
    "side_of_gear": Sentence(
        "speeds of wheels are on the {side} side: the commands are {ratio:.4g} times those of the body"
    ),
    "one_motor": Sentence(_one_motor),
    "wheels_from_zero": Sentence(_wheels_from_zero),
    "wheels_by_places": Sentence(_wheels_by_places),
    "motor_side_without_robot": Sentence(
        "speeds and angles are those of the motor shaft: no robot is given, so no gear is known"
    ),
    "current_sign_taken": Sentence(
        "currents are taken as unsigned: they get the sign of the {origin}, and 0 where that is 0"
    ),
    "rows_joined": Sentence("{joined} of {rows} rows fill the blanks of a row of the same time: joined to it"),
    "rows_empty": Sentence("{left_out} of {rows} rows hold no time or no number: left out, first in line {first}"),
    "rows_of_padding": Sentence(
        "{left_out} of {rows} rows at the end repeat one row with an earlier time (padding): left out, first in line "
        "{first}"
    ),
    "rows_repeated": Sentence(
        "{left_out} of {rows} rows repeat the time of the row before: left out, first in line {first}"
    ),
    "on_change": Sentence(_on_change),
    "rows_sorted": Sentence("time goes back {times} times: rows were sorted"),
    "latency_taken_out": Sentence("{subject} was moved back by its latency of {seconds:g} s"),
}  # fmt: skip
