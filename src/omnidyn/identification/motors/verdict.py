"""What a study of motors came to, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.document import all_of, sentence
from omnidyn.identification.motors.estimate import BAND, SLOPE, MotorEstimate


def motors_verdict(motors: Sequence[MotorEstimate]) -> str:
    """Which motors answer to their input, and at which input they start."""
    each = [one for one in motors if one.motor is not None] or list(motors)
    blind = [one.name for one in each if not one.ci95[SLOPE][0] > 0.0]
    if len(blind) == len(each):
        return f"No motor is seen to answer to its input: the slope of {all_of(blind)} may as well be 0."
    seen = [one for one in each if one.dead_band_seen]
    parts = [_starts(seen, len(each))] if seen else []
    without = [one.name for one in each if not one.dead_band_seen and one.name not in blind]
    if without:
        who = f"all {len(each)} motors" if len(without) == len(each) > 1 else all_of(without)
        one = len(without) == 1
        too = " too" if seen else ""
        parts.append(f"{who} answer{'s' * one}{too}, and show{'s' * one} no dead band")
    if blind:
        parts.append(f"{all_of(blind)} {'is' if len(blind) == 1 else 'are'} not seen to answer to the input")
    return sentence("; ".join(parts))


def _starts(seen: Sequence[MotorEstimate], total: int) -> str:
    """ "all 3 motors start at 0.52 to 0.61 V" """
    levels = sorted(one.value[BAND] for one in seen)
    span = f"{levels[0]:.3g}" if len(levels) == 1 else f"{levels[0]:.3g} to {levels[-1]:.3g}"
    if total == 1:
        return f"{seen[0].name} starts at {span} {seen[0].unit}"
    if len(seen) == total:
        return f"all {total} motors start at {span} {seen[0].unit}"
    return f"{all_of([one.name for one in seen])} start{'s' * (len(seen) == 1)} at {span} {seen[0].unit}"
