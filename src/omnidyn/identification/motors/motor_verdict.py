"""What a study of motors came to: its first line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.start import MotorStart
from omnidyn.identification.motors.steady_curve import (
    SteadyCurve,
)
from omnidyn.statement import ERROR, NOTE, WARNING, Statement

if TYPE_CHECKING:
    pass
from omnidyn.identification.motors.estimate import BAND, OFFSET
from omnidyn.identification.motors.start import START


def motors_verdict(
    motors: Sequence[MotorEstimate], starts: Sequence[MotorStart] = (), curves: Sequence[SteadyCurve] = ()
) -> Statement:
    """Which motors answer to their input, and at which input they start: from rest where that was seen, else by the
    dead band of the line; and whose speed is no line.
    """
    lines = [motor for motor in motors if motor.motor is not None] or list(motors)  # else that of all together
    levels = {line.name: _levels(line, starts) for line in lines}
    curve_by_motor = {curve.motor: curve.straight for curve in curves}
    blind_names = [
        line.name for line in lines if not (line.answers or levels[line.name] or line.motor in curve_by_motor)
    ]
    if len(blind_names) == len(lines):
        return Statement("no_motor_answers", ERROR, numbers={"motors": blind_names})
    started_motors = [line for line in lines if levels[line.name]]
    missed_names = [line.name for line in lines if "line_misses" in {warning.code for warning in line.warnings}]
    straight = [line.name for line in lines if line.motor not in curve_by_motor and line.name not in missed_names]
    names_without_start = [name for name in straight if not levels[name] and name not in blind_names]
    parts = [_starts(started_motors, levels, starts, len(lines))] if started_motors else []
    if unsure_names := [line.name for line in lines if line.name in names_without_start and line.dead_band_needed]:
        names_without_start = [name for name in names_without_start if name not in unsure_names]
        parts.append(Statement("dead_bands_hardly_known", NOTE, numbers={"motors": unsure_names}))
    if names_without_start:
        numbers = {"motors": names_without_start, "too": bool(started_motors), "total": len(lines)}
        parts.append(Statement("motors_without_dead_band", NOTE, numbers=numbers))
    if curve_by_motor:
        numbers = {"motors": [line.name for line in lines if line.motor in curve_by_motor], "unit": lines[0].unit}
        low, high = curves[0].straight if len(curve_by_motor) == 1 else (0.0, 0.0)
        parts.append(Statement("motors_no_line", WARNING, numbers=numbers | {"low": low, "high": high}))
    if missed_names := [name for name in missed_names if name not in blind_names]:
        parts.append(Statement("motors_line_misses", WARNING, numbers={"motors": missed_names}))
    if blind_names:
        parts.append(Statement("motors_not_answering", WARNING, numbers={"motors": blind_names}))
    return Statement(
        "motors_answer", WARNING if blind_names or curve_by_motor or missed_names else NOTE, numbers={"parts": parts}
    )


def _levels(motor: MotorEstimate, starts: Sequence[MotorStart]) -> list[float]:
    """The inputs at which a motor starts; none where that is not known."""
    start_levels = [start.value[START] for start in starts if start.motor == motor.motor and start.sharp]
    if start_levels or not motor.dead_band_seen:
        return start_levels
    offset = motor.value[OFFSET] if motor.offset_seen else 0.0
    return list(dict.fromkeys([motor.value[BAND] + offset, motor.value[BAND] - offset]))


def _starts(
    started_motors: Sequence[MotorEstimate], levels: dict[str, list[float]], starts: Sequence[MotorStart], total: int
) -> Statement:
    """At which inputs motors start; of a motor alone, in each direction."""
    sharp_starts = [start for start in starts if start.sharp]
    unit = {"unit": started_motors[0].unit}
    if total == 1 and len(sharp_starts) == 2 and sharp_starts[0].motor == started_motors[0].motor:
        ways = {
            "levels": [start.value[START] for start in sharp_starts],
            "directions": [start.direction for start in sharp_starts],
        }
        return Statement("starts_both_ways", NOTE, started_motors[0].name, ways | unit)
    numbers = {
        "motors": [line.name for line in started_motors],
        "total": total,
        "levels": [level for line in started_motors for level in levels[line.name]],
    }
    return Statement("motors_start", NOTE, numbers=numbers | unit)
