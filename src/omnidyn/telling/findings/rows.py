"""What `check` says of the columns, the rows and the time of a log."""

from __future__ import annotations

from omnidyn.document import all_of
from omnidyn.statement import ERROR, Statement
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.small_words import by_number, counted

COARSE_CLOCK = "do not sort the rows: look at how the time is written (milliseconds without leading zeros?), and \
whether another column is the clock (`column` t=NAME:UNIT)"
SPLIT = "split the file where two logs were joined (`convert` with `split`); where rows were written out of order, \
sort them, or give identify and compare `sort`"


def _no_channel(statement: Statement) -> str:
    """No column but the time is known."""
    unused = statement.numbers["unused"]
    of = f" of {', '.join(unused[:6])}{', ...' * (len(unused) > 6)}" if unused else ""
    return f"no column but the time is known: nothing was checked{of}"


def _time_repeats(statement: Statement) -> str:
    """Rows with the time of the row before."""
    coarse = statement.severity == ERROR
    why = ": the clock is too coarse for this rate, or the time stands still" if coarse else ""
    return f"{vars(statement)['count']} rows have the same time as the row before{why}"


def _counter(statement: Statement) -> str:
    """A counter of a wheel was set to another value."""
    n = statement.numbers
    if statement.remedy:
        over = f" and starts over after {n['period_rad']:.6g} rad" if "period_rad" in n else ""
        return f"{statement.subject} jumps farther than a wheel turns{over}"
    before = f" from {n['before']:.10g}" if "before" in n else ""
    return f"{all_of(n['columns'])} {by_number(n['columns'], 'jumps', 'jump')} farther than a wheel turns,{before} to \
{n['after']:.10g} in line {n['line']}: the count goes on behind a gap there, the rows beside it are left out"


def _counter_full(statement: Statement) -> str:
    """A counter starts over after a period."""
    n = statement.numbers
    if statement.remedy:
        return f"{statement.subject} starts over after {n['period_rad']:.6g} rad"
    return f"{n['column']} starts over after {n['period']:.6g} {n['unit']}: it is taken to go on"


def _overflow(statement: Statement) -> str:
    """A speed leaves its 16 bits."""
    n = statement.numbers
    done = ": 2^16 was added or taken off there" if statement.severity != ERROR else ", too fast to be followed"
    return f"{n['column']} leaves its 16 bits {counted(n['jumps'], 'time')} (2^15 - 1 is followed by -2^15, or 0 by \
2^16 - 1){done}"


def _overflow_remedy(statement: Statement) -> str:
    """What to do about a speed that cannot be followed."""
    return "log 32 bits, or faster" if statement.severity == ERROR else ""


SENTENCES = {
    "no_channel": Sentence(_no_channel, "say which column is what: `column` w1=NAME:rad/s, or `map` FILE"),
    "not_taken": Sentence("{doubt}", "{doubt.remedy_text}"),
    "not_used": Sentence("columns not used: {columns}"),
    "reading": Sentence("{note}"),
    "wheel_count": Sentence(
        "the log has {wheels} {wheels:wheel or motor|wheels or motors}, the robot {of_robot}: what needs the "
        "robot was not checked",
        "give the robot that the log is of",
    ),
    "same_data": Sentence(
        "it holds the same numbers as {other}", "leave one of them out: they are one recording, not two"
    ),
    "empty_rows": Sentence(
        "{count} of {of_rows} rows hold no time or no number", "they are left out; repair the recording"
    ),
    "padding": Sentence(
        "{count} rows at the end all repeat one row, at an earlier time: the recorder filled its buffer up",
        "they are left out; cut them off",
    ),
    "time_back": Sentence(
        "time goes back {count} {count:time|times}, by up to {farthest_s:.4g} s", SPLIT, {"often": COARSE_CLOCK}
    ),
    "time_repeats": Sentence(
        _time_repeats, "only the first of them is used", {"often": "only the first of them is used; log a finer clock"}
    ),
    "speed_from_angle": Sentence("no speed of wheels was logged: w1, .. are differences of their angles"),
    "gap": Sentence(
        "{count} {count:gap|gaps}, about {lost_rows:.0f} rows lost; the longest lasts {longest_s:.4g} s, at t = "
        "{at_s:.6g} s",
        "nothing is integrated across a gap: the pieces count as separate runs",
    ),
    "jitter": Sentence(
        "the steps of time vary: usually {step_s:m.4g} ms, 90 % between {low_s:m.4g} and {high_s:m.4g} ms",
        "the times as logged are used, not a fixed rate",
    ),
    "few_rows": Sentence(
        "{rows:.0f} {rows:row|rows} with a time: too few to judge noise, wiring or scale from",
        "log longer, 10 s or more",
    ),
    "clock_restart": Sentence(
        "the time begins again in line {line}, at {behind_s:.6g} s after {before_s:.6g} s: a recording of its own "
        "behind a gap",
        "`convert` with `split` writes them apart",
    ),
    "counter_restart": Sentence(_counter, "", {"of_run": "split the run there"}),
    "counter_full": Sentence(_counter_full, "", {"of_run": "unwrap the angle"}),
    "speed_overflow": Sentence(_overflow, _overflow_remedy),
    "episode": Sentence("another recording begins in line {line}"),
}
