"""What a study of motors came to."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.motors.estimate import BAND, SLOPE, MotorEstimate
from omnidyn.identification.motors.start import START, MotorStart
from omnidyn.statement import ERROR, NOTE, WARNING, Statement


def motors_verdict(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> Statement:
    """Which motors answer to their input, and at which input they start: from rest where that was seen, else by the
    dead band of the line.
    """
    lines, blind = _own(motors), unanswering(motors, starts)
    if len(blind) == len(lines):
        return Statement("no_motor_answers", ERROR, numbers={"motors": blind})
    levels = {line.name: _levels(line, starts) for line in lines}
    seen = [line for line in lines if levels[line.name]]
    without = [line.name for line in lines if not levels[line.name] and line.name not in blind]
    total = {"total": len(lines)}
    parts = [_starts(seen, levels, starts, len(lines))] if seen else []
    if without:
        numbers = {"motors": without, "too": bool(seen), **total}
        parts.append(Statement("motors_without_dead_band", NOTE, numbers=numbers))
    if blind:
        parts.append(Statement("motors_not_answering", WARNING, numbers={"motors": blind}))
    return Statement("motors_answer", WARNING if blind else NOTE, numbers={"parts": parts})


def unanswering(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> list[str]:
    """Names of the motors that are not seen to answer to their input: their slope may be 0, and no start was seen."""
    return [one.name for one in _own(motors) if not one.ci95[SLOPE][0] > 0.0 and not _levels(one, starts)]


def none_answers(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> bool:
    """Whether no motor is seen to answer to its input."""
    return len(unanswering(motors, starts)) == len(_own(motors))


def _own(motors: Sequence[MotorEstimate]) -> list[MotorEstimate]:
    """The motors without the line of all together, where they have lines of their own."""
    return [one for one in motors if one.motor is not None] or list(motors)


def _levels(motor: MotorEstimate, starts: Sequence[MotorStart]) -> list[float]:
    """The inputs at which a motor starts; none where that is not known."""
    sharp = [each.value[START] for each in starts if each.motor == motor.motor and each.sharp]
    return sharp or ([motor.value[BAND]] if motor.dead_band_seen else [])


def _starts(
    seen: Sequence[MotorEstimate], levels: dict[str, list[float]], starts: Sequence[MotorStart], total: int
) -> Statement:  # fmt: skip
    """At which inputs motors start; of a motor alone, in each direction."""
    both = [start for start in starts if start.sharp]
    unit = {"unit": seen[0].unit}
    if total == 1 and len(both) == 2 and both[0].motor == seen[0].motor:
        ways = {"levels": [start.value[START] for start in both], "directions": [start.direction for start in both]}
        return Statement("starts_both_ways", NOTE, seen[0].name, ways | unit)
    numbers = {"motors": [line.name for line in seen], "total": total,
               "levels": [level for line in seen for level in levels[line.name]]}  # fmt: skip
    return Statement("motors_start", NOTE, numbers=numbers | unit)
