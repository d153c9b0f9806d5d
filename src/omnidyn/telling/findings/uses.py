"""What a log can be used for, and why not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from omnidyn.document import all_of, short
from omnidyn.findings.needs import LOOP_REMEDY
from omnidyn.statement import SEVERITIES, Statement
from omnidyn.telling.logs import in_brief
from omnidyn.telling.sentence import Sentence, either
from omnidyn.telling.small_words import by_number, counted

OF_ROBOT = {
    "": "",
    "robot": "; with a robot file",
    "supply": "; with a robot file that has supply_V",
    "speed_loop": '; with a robot file that has the speed loop of the firmware, [drive] kind = "speed"',
}


def usable_for(uses: tuple[str, ...], others: tuple[str, ...] = ()) -> str:
    """ "usable for whole logs and motors, not for steady state and geometry"; "not usable"."""
    if not uses:
        return "not usable"
    return f"usable for {all_of(uses)}{f', not for {all_of(others)}' if others else ''}"


def _usable(statement: Statement) -> str:
    """A log without errors."""
    n = statement.numbers
    warnings = counted(n["warnings"], "warning") if n["warnings"] else "no warning"
    return f"{usable_for(n['uses'], n['not']) if n['uses'] or n['not'] else 'no row to judge by'}; {warnings}"


def _faulty(statement: Statement) -> str:
    """A log with errors."""
    n = statement.numbers
    more = f" (and {counted(n['errors'] - 1, 'other error')})" if n["errors"] > 1 else ""
    rest = f"; once corrected, {usable_for(n['uses'], n['not'])}" if n["uses"] or n["not"] else ""
    return f"not usable as it stands: {n['first']}{more}{rest}"


def _summary(statement: Statement) -> str:
    """One line about a log."""
    n = statement.numbers
    rate = f" at {n['rate_Hz']:.4g} Hz" if n["rate_Hz"] > 0.0 else ""
    duration = f", {short(n['duration_s'], '.4g')} s{rate}" if n["duration_s"] > 0.0 else ""
    return f"{statement.subject or 'log'}: {counted(n['rows'], 'row')}{duration}: {severities(n)}"


def severities(counts: Mapping[str, Any]) -> str:
    """ "1 error, 3 warnings, 2 notes": those that there are; "no findings"."""
    counts_in_words = [counted(counts[severity], severity) for severity in SEVERITIES if counts[severity]]
    return ", ".join(counts_in_words) or "no findings"


def _lacking(text: str) -> Callable[[Statement], str]:
    """A sentence with the columns that look like what is missing behind it."""

    def sentence(statement: Statement) -> str:
        doubts = [in_brief(doubt) for doubt in statement.numbers.get("doubts", ())]
        return f"{text.format(**statement.numbers)}{': ' if doubts else ''}{'; '.join(doubts)}"

    sentence.__doc__ = text
    return sentence


def _whole(statement: Statement) -> str:
    """A fit of whole logs is possible."""
    n = statement.numbers
    return f"{n['input']} in, {all_of(n['outputs'])} out{OF_ROBOT[n['needs']]}"


def _steady(statement: Statement) -> str:
    """Friction from steady states is possible."""
    n = statement.numbers
    many = (
        f"{n['stretches']} or more stretches"
        if n["more"]
        else f"{n['stretches']} \
{by_number(n['stretches'], 'stretch', 'stretches')}"
    )
    return f"{many} of constant speed, the force from {n['force_from']}{OF_ROBOT[n['needs']]}"


def _geometry(statement: Statement) -> str:
    """The wheels' places can be identified."""
    n = statement.numbers
    angles = all_of([f"{angle:.0f}" for angle in n["azimuth_deg"]])
    return f"the wheels push as omni wheels at {angles} degrees do ({n['source']})"


SENTENCES = {
    "usable": Sentence(_usable),
    "faulty": Sentence(_faulty),
    "not_usable": Sentence("not usable: {reason}"),
    "log_summary": Sentence(_summary),
    "no_two_rows": Sentence("it holds no two rows"),
    "too_few_rows": Sentence(
        "{rows} rows, too few to tell motion from noise: {least} or more are needed, 10 s are better"
    ),
    "robot_rests": Sentence("the robot never moves: drive it beyond its dead zone"),
    "refused": Sentence(either("remedy", "{what}; {remedy}", "{what}")),
    "set_speeds_only": Sentence(f"holds set speeds only; to fit it whole, {LOOP_REMEDY}"),
    "no_input": Sentence(_lacking("holds no voltage and no duty")),
    "no_output": Sentence(_lacking("holds no speed, angle, current or pose")),
    "other_robot": Sentence("the log is of {wheels} wheels, {robot} has {of_robot}"),
    "no_battery": Sentence(
        _lacking("a duty needs its battery: a column supply, or [drive] supply_V in the robot file")
    ),
    "input_incomplete": Sentence(
        either("missing", "no {channel} of wheel {missing}", "hardly a row has the {channel} of all wheels")
    ),
    "no_force": Sentence(_lacking("no current and no motor input")),
    "no_wheel_motion": Sentence(_lacking("no speed or angle of the wheels")),
    "lossy_gear": Sentence("the robot file has a lossy gear, which a steady state does not know"),
    "no_steady_stretch": Sentence(
        either(
            "at_rest",
            "no stretch of constant speed, only at rest: hold commands for {hold_s:g} s or more",
            "no stretch of constant speed: hold commands for {hold_s:g} s or more",
        )
    ),
    "no_motor_input": Sentence(_lacking("no motor input")),
    "no_motor_motion": Sentence(_lacking("no speed or angle of the motors")),
    "no_two_motions": Sentence("no motion of both the body and the wheels"),
    "speeds_beyond_robots": Sentence("the speeds are beyond all numbers of a robot"),
    "serves_whole": Sentence(_whole),
    "serves_steady": Sentence(_steady),
    "serves_motors": Sentence("{input} against {speeds}, if the wheels were off the ground"),
    "serves_geometry": Sentence(_geometry),
}
