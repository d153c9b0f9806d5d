"""What a study of motors came to, in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from omnidyn.document import all_of, sentence
from omnidyn.identification.motors.estimate import BAND, SLOPE, MotorEstimate
from omnidyn.identification.motors.start import START, MotorStart


def motors_verdict(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> str:
    """Which motors answer to their input, and at which input they start: from rest where that was seen, else by the
    dead band of the line.
    """
    each = _own(motors)
    levels, blind = {one.name: _levels(one, starts) for one in each}, unanswering(motors, starts)
    if len(blind) == len(each):
        return f"No motor is seen to answer to its input: the slope of {all_of(blind)} may as well be 0."
    seen = [one for one in each if levels[one.name]]
    both = [way for way in starts if way.sharp]
    if len(each) == 1 and len(both) == 2 and both[0].motor == each[0].motor:
        parts = [f"{each[0].name} starts at {' and '.join(_one_way(way) for way in both)}"]
    else:
        parts = [_starts(seen, len(each), levels)] if seen else []
    without = [one.name for one in each if not levels[one.name] and one.name not in blind]
    if without:
        who = f"all {len(each)} motors" if len(without) == len(each) > 1 else all_of(without)
        one = len(without) == 1
        too = " too" if seen else ""
        parts.append(f"{who} answer{'s' * one}{too}, and show{'s' * one} no dead band")
    if blind:
        parts.append(f"{all_of(blind)} {'is' if len(blind) == 1 else 'are'} not seen to answer to the input")
    return sentence("; ".join(parts))


def unanswering(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> list[str]:
    """Names of the motors that are not seen to answer to their input: their slope may be 0, and no start was seen."""
    return [one.name for one in _own(motors) if not one.ci95[SLOPE][0] > 0.0 and not _levels(one, starts)]


def none_answers(motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = ()) -> bool:
    """Whether no motor is seen to answer to its input."""
    return len(unanswering(motors, starts)) == len(_own(motors))


def _own(motors: Sequence[MotorEstimate]) -> list[MotorEstimate]:
    """The motors without the line of all together, where they have lines of their own."""
    return [one for one in motors if one.motor is not None] or list(motors)


def _one_way(start: MotorStart) -> str:
    return f"{start.value[START]:.3g} {start.unit} ({start.direction})"


def _levels(motor: MotorEstimate, starts: Sequence[MotorStart]) -> list[float]:
    """The inputs at which a motor starts; none where that is not known."""
    sharp = [each.value[START] for each in starts if each.motor == motor.motor and each.sharp]
    return sharp or ([motor.value[BAND]] if motor.dead_band_seen else [])


def _starts(seen: Sequence[MotorEstimate], total: int, of: Mapping[str, Sequence[float]]) -> str:
    """ "all 3 motors start at 0.52 to 0.61 V" """
    levels = sorted({f"{level:.3g}": level for one in seen for level in of[one.name]}.values())
    span = f"{levels[0]:.3g}" if len(levels) == 1 else f"{levels[0]:.3g} to {levels[-1]:.3g}"
    if total == 1:
        return f"{seen[0].name} starts at {span} {seen[0].unit}"
    if len(seen) == total:
        return f"all {total} motors start at {span} {seen[0].unit}"
    return f"{all_of([one.name for one in seen])} start{'s' * (len(seen) == 1)} at {span} {seen[0].unit}"
