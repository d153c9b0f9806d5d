"""What a study of motors says: lines, dead bands, starts, and what becomes of them in a robot file."""

from __future__ import annotations

import math

from omnidyn.document import all_of
from omnidyn.identification.motors.input_between_rows import WORDS
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either

NOT_IDENTIFIABLE = "dead band not identifiable here"
NOT_WRITTEN = {
    "viscous_explains_slope": "friction.wheels.viscous of the file explains all of the slope",
    "drop_explains_dead_band": "motor.voltage_drop_V and drive.dead_band_V of the file explain all of the dead band",
    "loop": 'a map behind drive.kind = "speed" is not simulated: give kind = "duty" or "voltage"',
    "straight": "not all motors have a curve, and the driver has one map: look at the wiring of the others",
    "unsettled": "the lowest inputs reached no steady speed: hold them longer",
    "negative": "",
    "no_dead_band": "no dead band is seen",
    "no_inertia": "the logs do not determine an inertia",
}


def _motor_line(statement: Statement) -> str:
    """Slope, lag, latencies and dead band of the line of a motor."""
    numbers = statement.numbers
    spread = f" +- {numbers['slope_std']:.2g}" if math.isfinite(numbers["slope_std"]) else ""
    words = f"{statement.subject}: slope {numbers['slope']:.5g}{spread} {numbers['unit']} s/{numbers['travel']}"
    if not numbers["lag_known"]:
        words += ", lag not determined"
    elif numbers["lag_seen"]:
        words += f", lag {1e3 * numbers['lag']:.3g} ms"
    for channel, late, std in numbers["late"]:
        accuracy = "ms (the end of what was searched: not determined)" if std is None else f"+- {1e3 * std:.2g} ms"
        words += f", {channel} late by {1e3 * late:.3g} {accuracy}"
    if rows := numbers["left_out"]:
        words += f" ({rows} rows left out: their input changes too much from row to row)"
    return "; ".join(map(str, [words, numbers["dead_band"], *([numbers["offset"]] if numbers["offset"] else [])]))


def _band(statement: Statement) -> str:
    """ "0.6 +- 0.1 V, 95 % [0.4, 0.8]" """
    numbers = statement.numbers
    return "{:.3g} +- {:.2g} {}, 95 % [{:.3g}, {:.3g}]".format(
        numbers["value"], numbers["std"], numbers["unit"], *numbers["ci95"]
    )


def _offset_as_friction(statement: Statement) -> str:
    """An offset of the input, and the friction that is unequal by direction that it is the same as."""
    numbers = statement.numbers
    return "offset {}: the same as friction of {:.3g} {} forward and {:.3g} {} backward".format(
        _band(statement), numbers["forward"], numbers["unit"], numbers["backward"], numbers["unit"]
    )


def _offset_of_input(statement: Statement) -> str:
    """An offset of the input that no friction can stand for."""
    return f"offset {_band(statement)}"


def _held_out_blocks(statement: Statement) -> str:
    """How far free runs miss held-out blocks: that of the motor that is written, and the plain one."""
    numbers = statement.numbers
    written, plain = (f"{numbers[name]:.2%}" for name in ("written", "plain"))
    words = f"{statement.subject}: on held-out blocks its free run misses {written} of the spread of what was measured"
    words += f", that of slope and lag alone {plain}"
    if "blocks" in numbers:
        words += f"; {numbers['better']} of {numbers['blocks']} blocks are predicted better"
    names = [name.replace("_", " ") for name in numbers["rejected"]]
    return f"{words}; {all_of(names)} {'is' if len(names) == 1 else 'are'} no help and not kept" if names else words


def _slopes_differ_by_direction(statement: Statement) -> str:
    """The slope of a motor in each direction, where they differ."""
    numbers = statement.numbers
    both = [
        f"{slope:.4g} [{low:.4g}, {high:.4g}] ({direction})"
        for slope, (low, high), direction in zip(numbers["slopes"], numbers["ci95"], numbers["directions"], strict=True)
    ]
    return (
        f"{statement.subject}: the slope differs by direction, {both[0]} and {both[1]} {numbers['unit']}: one"
        " viscous friction for both fits neither"
    )


def _line_meets_zero(statement: Statement) -> str:
    """Where the line of a motor meets speed 0, whose starts from rest were seen."""
    line = "its line" if statement.numbers["one_way"] else "its line, both ways together,"
    return f"{line} meets speed 0 at {_band(statement)}"


def _dead_band_bounded(statement: Statement) -> str:
    """The line tells no dead band; what is known of it by an input under which the motor turned steadily."""
    numbers = statement.numbers
    (low, high), unit, value = numbers["ci95"], numbers["unit"], numbers["value"]
    between = f"between {low:.3g} and {high:.3g}" if low > 0.0 else f"at most {high:.3g}"
    bound = f"; it is {between} {unit}, because it turned steadily at that input" if math.isfinite(high) else ""
    if math.isfinite(value):
        return f"{NOT_IDENTIFIABLE}: {value:.3g} {unit} is no estimate{bound}"
    reason = "with one speed or one input only they are not distinguishable"
    return f"{NOT_IDENTIFIABLE}, and any dead band is part of the slope: {reason}{bound}"


def _dead_band_seen(statement: Statement) -> str:
    """The dead band of a motor."""
    offset = " or offset (it turned one way only)" if statement.numbers["one_way"] else ""
    return f"dead band{offset} {_band(statement)}"


def _dead_band_hardly_known(statement: Statement) -> str:
    """Held-out blocks need a dead band, and its interval reaches 0, or that of the slope does."""
    words = f"dead band {_band(statement)}: held-out rows are predicted better with one"
    return f"{words}, but it and the slope are hardly known apart; hold more inputs"


def _dead_band_negative(statement: Statement) -> str:
    """The line of a motor meets speed 0 below 0."""
    return (
        f"{NOT_IDENTIFIABLE}: the line meets speed 0 at {_band(statement)}, below 0, and no friction does that; the "
        "input has an offset, speed is no line of it, or the speeds are wrong"
    )


def _slope_may_be_zero(statement: Statement) -> str:
    """The slope of a motor may be 0."""
    return f"{NOT_IDENTIFIABLE}: the slope may as well be 0 ({_band(statement)})"


def _dead_band_not_needed(statement: Statement) -> str:
    """The interval of a dead band contains 0."""
    high, unit = max(statement.numbers["ci95"][1], 0.0), statement.numbers["unit"]
    return f"{NOT_IDENTIFIABLE}: {_band(statement)} contains 0; it is at most {high:.3g} {unit}, and none is needed"


def _speed_no_line(statement: Statement) -> str:
    """The steady speeds of a motor that are no line of its input, and where one holds."""
    numbers, unit = statement.numbers, statement.numbers["unit"]
    words = (
        f"{statement.subject}: speed is no line of the input: levels left out are missed by {numbers['line']:.3g} "
        f"rad/s by a line, by {numbers['neighbours']:.3g} by the way between neighbours"
    )
    low, high = numbers["straight"]
    words += f"; a line holds from {low:.3g} to {high:.3g} {unit}" if high > low else ""
    if numbers["unsettled"]:
        words += f"; at {numbers['unsettled']:.3g} {unit} no steady speed was reached: hold low inputs longer"
    return words


def _motors_no_line(statement: Statement) -> str:
    """Motors whose speed is no line of their input, and where a line holds."""
    low, high = statement.numbers["low"], statement.numbers["high"]
    words = f"the speed of {all_of(statement.numbers['motors'])} is no line of the input"
    return f"{words}, except from {low:.3g} to {high:.3g} {statement.numbers['unit']}" if high > low else words


def _dead_bands_apart(statement: Statement) -> str:
    """Free run and windows of one log tell dead bands that exclude each other."""
    numbers = statement.numbers
    ends = ("between {:.3g} and {:.3g}".format(*numbers[name]) for name in ("free_run", "windows"))
    return "{}: the dead band is {} {unit} by free runs, {} {unit} by windows: trust neither".format(
        statement.subject, *ends, unit=numbers["unit"]
    )


def _start_not_seen(statement: Statement) -> str:
    """No start from rest was seen; where the line meets speed 0, if that is known."""
    numbers = statement.numbers
    words = f"{statement.subject}: no start from rest was seen"
    if not numbers["offset_known"]:
        return words
    ends = "[{:.3g}, {:.3g}]".format(*numbers["offset_ci95"])
    return f"{words}; its line meets speed 0 at {numbers['offset']:.3g} {numbers['unit']}, 95 % {ends}"


def _start_seen(statement: Statement) -> str:
    """Where a motor sets off, where it comes to rest, and whether its line says something else."""
    numbers = statement.numbers
    (low, high), unit = numbers["ci95"], numbers["unit"]
    words = f"{statement.subject}: it sets off between {low:.3g} and {high:.3g} {unit}"
    if numbers["sharp"]:
        words = f"{statement.subject}: the dead band is {numbers['start']:.3g} {unit}, 95 % [{low:.3g}, {high:.3g}]"
    if math.isfinite(numbers["stop"]):
        words += "; on the way down it comes to rest at {:.3g} [{:.3g}, {:.3g}]".format(
            numbers["stop"], *numbers["stop_ci95"]
        )
    if numbers["line_elsewhere"]:
        words += (
            f"; the line of its whole range meets speed 0 at {numbers['offset']:.3g} instead, which is no start: the "
            "line bends, or rest holds the motor harder than motion"
        )
    return words


def _motors_answer(statement: Statement) -> str:
    """Which motors start at which input, which show no dead band, and which do not answer."""
    return "; ".join(map(str, statement.numbers["parts"]))


def _starts_both_ways(statement: Statement) -> str:
    """A motor whose starts were seen in both directions."""
    numbers = statement.numbers
    unit, ways = numbers["unit"], zip(numbers["levels"], numbers["directions"], strict=True)
    return f"{statement.subject} starts at {all_of([f'{level:.3g} {unit} ({direction})' for level, direction in ways])}"


def _motors_start(statement: Statement) -> str:
    """At which inputs motors start."""
    numbers, (names, total) = statement.numbers, _counted(statement)
    levels = list(dict.fromkeys(f"{level:.3g}" for level in sorted(numbers["levels"])))
    span = levels[0] if len(levels) == 1 else f"{levels[0]} to {levels[-1]}"
    who = f"all {total} motors" if len(names) == total > 1 else all_of(names)
    return f"{who} start{'s' * (len(names) == 1)} at {span} {numbers['unit']}"


def _motors_without_dead_band(statement: Statement) -> str:
    """Motors that answer and show no dead band."""
    names, total = _counted(statement)
    one = len(names) == 1
    who = f"all {total} motors" if len(names) == total > 1 else all_of(names)
    too = " too" if statement.numbers["too"] else ""
    return f"{who} answer{'s' * one}{too}, and show{'s' * one} no dead band"


def _counted(statement: Statement) -> tuple[tuple[str, ...], int]:
    return statement.numbers["motors"], statement.numbers["total"]


def _other_reading(statement: Statement) -> str:
    """The logs are met as well, or better, with another reading of the input between its rows."""
    numbers = statement.numbers
    verb = "better" if numbers["better"] else "as well"
    errors = f"error {numbers['other_error']:.3g} {numbers['travel']}/s, {numbers['error']:.3g}"
    return (
        f"the logs are fitted {verb} where the input is {WORDS[numbers['other']]} ({errors} where it is "
        f"{WORDS[numbers['between']]}): the intervals span both"
    )


def _speed_is_mean(statement: Statement) -> str:
    """The speed of motors is a mean over rows, and what that does to the fit."""
    names, rows = statement.numbers["motors"], statement.numbers["rows"]
    allowed = "the input is averaged alike; breakaway is not seen sharply"
    rest = allowed if statement.numbers["allowed"] else "the dead band may be too small"
    return f"the speed of motor {all_of(names)} is a mean of {rows} rows: {rest}"


def _not_written(statement: Statement) -> str:
    """A number of the robot file that the motors do not determine, and why."""
    return f"{statement.subject} is not written: {NOT_WRITTEN[statement.numbers['why']]}"


SENTENCES = {
    "motor_line": Sentence(_motor_line),
    "dead_band_not_asked": Sentence("no dead band asked for"),
    "line_meets_zero": Sentence(_line_meets_zero),
    "dead_band_bounded": Sentence(_dead_band_bounded),
    "dead_band_seen": Sentence(_dead_band_seen),
    "dead_band_of_starts": Sentence("its line tells no dead band, its starts do"),
    "dead_band_hardly_known": Sentence(_dead_band_hardly_known),
    "dead_band_negative": Sentence(_dead_band_negative),
    "slope_may_be_zero": Sentence(_slope_may_be_zero),
    "dead_band_not_needed": Sentence(_dead_band_not_needed),
    "held_out_no_better": Sentence(
        "{subject}: held-out logs are predicted no better with its dead band ({better} of {blocks} blocks are; error "
        "{written:.4g} {travel}/s, {plain:.4g} by slope and lag alone): it may be an effect of something else"
    ),
    "motor_held_out_blocks": Sentence(_held_out_blocks),
    "dead_band_rejected": Sentence(
        either(
            "blocks",
            "no dead band is kept: {better} of {blocks} held-out blocks are predicted better with one, no more than by "
            "chance; it is at most {high:.3g} {unit}",
            "no dead band is kept: these logs do not tell it from 0; it is at most {high:.3g} {unit}",
        )
    ),
    "offset_as_friction": Sentence(_offset_as_friction),
    "offset_of_input": Sentence(_offset_of_input),
    "slopes_differ_by_direction": Sentence(_slopes_differ_by_direction),
    "late_by_half_a_row": Sentence(
        "{subject} is late by {latency:m.3g} ms, which half a row explains: a speed that is the mean over the last row "
        "is so late by its sensor, not by its drive"
    ),
    "speed_no_line": Sentence(_speed_no_line),
    "straightness_not_tested": Sentence(
        "whether the speed of {motors} is a line of the input was not tested: of {held} inputs, at most {steady} gave "
        "a steady speed within 2 %; hold each longer"
    ),
    "line_misses": Sentence(
        "the line misses the mean speeds by {rmse:.3g} rad/s, {share:%.2g} % of the largest: speed is no line of the "
        "input, or something else turns the motor; hold each input until the speed is steady"
    ),
    "motors_line_misses": Sentence("no line describes the speed of {motors}"),
    "motors_no_line": Sentence(_motors_no_line),
    "dead_bands_apart": Sentence(_dead_bands_apart),
    "start_not_seen": Sentence(_start_not_seen),
    "never_sets_off": Sentence("{subject}: it rests up to {low:.3g} {unit}, and never sets off"),
    "sets_off_below": Sentence(
        "{subject}: it sets off at {high:.3g} {unit} or below; a slow ramp from rest tells more"
    ),
    "start_seen": Sentence(_start_seen),
    "starts_scatter": Sentence("its {subject}s scatter by more than their intervals: the interval spans them"),
    "no_motor_answers": Sentence("no motor is seen to answer to its input: the speed of {motors} does not go with it"),
    "answers_by_free_run": Sentence(
        "its free run predicts held-out rows, but block by block its speed is not seen to go with its input: step the "
        "input more often"
    ),
    "dead_bands_hardly_known": Sentence("the dead band of {motors} is hardly known"),
    "motors_answer": Sentence(_motors_answer),
    "starts_both_ways": Sentence(_starts_both_ways),
    "motors_start": Sentence(_motors_start),
    "motors_without_dead_band": Sentence(_motors_without_dead_band),
    "motors_not_answering": Sentence("{motors} {motors:is|are} not seen to answer to the input"),
    "at_its_bound": Sentence("{subject} is at its bound"),
    "errors_with_memory": Sentence("the intervals allow for autocorrelated errors"),
    "motor_fit_cut_short": Sentence("the fit was cut short: the numbers are of its last step"),
    "line_bends": Sentence(
        "the line of speed over input bends: with a smooth bend fitted too (error {left:.3g} of that without), the "
        "dead band is {value:.3g} +- {std:.2g} {unit}: the interval spans both, and the slope goes with it"
    ),
    "other_reading": Sentence(_other_reading),
    "speed_is_mean": Sentence(_speed_is_mean),
    "speeds_added_up": Sentence(
        "the speeds are differences of counts: they are added up to angles, which are not late by half a row"
    ),
    "rows_as_points": Sentence(
        "the rows are more than 0.1 s apart: each is a point of steady speed, and nothing is known of a lag"
    ),
    "windows_unresolved": Sentence(
        "{windows} windows were left out: their input changes so much from row to row that what the motor got is not "
        "in the log"
    ),
    "motor_windows_at_rest": Sentence("{windows} windows at rest, wholly or in part, were left out"),
    "windows_thinned": Sentence("the logs are long: one window in {every} was used"),
    "turned_one_way": Sentence(
        "a motor turned one way only: a dead band and an offset of the input are not distinguishable"
    ),
    "motors_and_floor": Sentence(
        "slope and dead band are those of motors and floor together: of the motors alone nothing is determined"
    ),
    "axis_not_wheel": Sentence("the log is of an axis, not of the wheels of a robot: nothing is written"),
    "supply_of_logs": Sentence("the supply is the mean of the logs, {supply:.4g} V"),
    "supply_of_file": Sentence("the supply is not logged: that of the file is taken, {supply:g} V"),
    "supply_unknown": Sentence(
        "a duty needs a supply to become volts: log it, or give drive.supply_V; nothing of the motors is written"
    ),
    "floor_friction_kept": Sentence(
        "the friction of the floor is as it was: if it was fitted with the friction of the wheels included, fit it "
        "again"
    ),
    "line_not_determined": Sentence("slope and dead band are not determined: nothing is written"),
    "not_written": Sentence(_not_written),
    "map_written": Sentence("{subject} is written, with {points} points: it holds what friction takes of the motors"),
    "map_holds_friction": Sentence(
        "{subject} takes the place of friction.wheels.coulomb and drive.dead_band_V, which are 0 now"
    ),
    "map_removed": Sentence("{subject} of the file is taken out: the speeds are a line of the input"),
    "lag_too_short": Sentence(
        "{subject} is not written: a lag of {lag:m.2g} ms is too short for windows, which blur {smear:m.2g} ms; "
        "`method` output-error fits it"
    ),
    "wheel_explains_inertia": Sentence(
        "{subject} is not written: the wheel of the file explains all of {inertia:.3g} kg m^2 there"
    ),
    "rotor_holds_wheel": Sentence("{subject} holds the wheel too, which the file gives no inertia"),
}
