"""Positions against the speeds of the same thing: their ratio is 1, or a unit, a sign, a scale or the time is wrong.

Which of the two is wrong a third channel says, where one tells the same; else the units in which they were read do: a
column that was read in rad/s cannot be "rad/s read as rpm".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.scale.mistakes import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    SPEED_UNITS,
    TIME_UNITS,
    TURN_UNITS,
    Mistakes,
    possible,
    unit_finding,
    unit_of,
)
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import expected_wheel_speed, pose_twist, wheels_twist
from omnidyn.findings.signal.robust import Slope, central_rate, slope, smooth, windowed
from omnidyn.findings.time_base import LONGEST_STEP, SHORTEST_STEP
from omnidyn.logs.channels import components
from omnidyn.model.frames import unwrapped
from omnidyn.sensors import FROM_START
from omnidyn.statement import ERROR, WARNING

LEAST_DEVIATION, SURE_ERRORS = 0.03, 6.0  # of the ratio; standard errors
LEAST_LIKENESS = 0.95  # likeness of window means, from which one channel is taken for a multiple of the other
HALF_WIDTH = 0.05  # [s] to either side, over which rates are taken
SAME_RATIO = 0.03  # ratios that differ by less are one
SPEED_SIDE, POSITION_SIDE = "speed", "position"


class SpeedPair(NamedTuple):
    """A speed and the rate of its position, shapes (rows, k), means over the same rows. kind: turn, wheels or path.

    of: channel and columns of the speed; on: those of the position. witness: another channel that says the same.
    """

    kind: str
    speed: str
    position: str
    value: FloatArray
    rate: FloatArray
    of: tuple[str, tuple[int, ...]]
    on: tuple[str, tuple[int, ...]]
    witness: tuple[str, FloatArray] | None
    speed_units: Mistakes
    position_units: Mistakes


def check_derivatives(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on positions and their speeds; the work with the wrong one of them put right."""
    if len(work) < MIN_ROWS or not SHORTEST_STEP <= work.step <= LONGEST_STEP:
        return [], work
    if all(work.get(name) is None for name in FROM_START):
        return [], work
    lines = [line for pairs in PAIRS for line in _lines(work, pairs)]
    ratios = np.array([line.value for _, line in lines])
    kinds = {pair.kind for pair, _ in lines}
    if len(kinds) > 1 and np.ptp(ratios) < SAME_RATIO * np.abs(ratios).mean():
        return [_of_time(lines[0])], replace(work, t=work.t * ratios.mean(), step=work.step * float(ratios.mean()))
    findings: list[Finding] = []
    for pairs in PAIRS:
        for pair, line in _joined(_lines(work, pairs)):
            finding, work = _judged(work, pair, line)
            findings.append(finding)
    return findings, work


def _lines(work: LogUnderCheck, pairs: Callable[[LogUnderCheck], Iterator[SpeedPair]]) -> list[tuple[SpeedPair, Slope]]:
    """The pairs that are surely not 1."""
    return [(pair, line) for pair in pairs(work) if (line := _off(work, pair)) is not None]


def _off(work: LogUnderCheck, pair: SpeedPair) -> Slope | None:
    """rate = slope * speed, where that is surely not 1 and the two are alike otherwise."""
    ids, count = work.windows()
    line = slope(pair.rate, pair.value, ids, count)
    clear_cut = line.value != 0.0 and line.differs(1.0, LEAST_DEVIATION, SURE_ERRORS) and line.windows >= 4
    return line if clear_cut and _likeness(pair.rate, pair.value, ids, count) >= LEAST_LIKENESS else None


def _joined(lines: list[tuple[SpeedPair, Slope]]) -> list[tuple[SpeedPair, Slope]]:
    """Wheels that are off by one ratio as one pair."""
    wheels, ratios = lines, np.array([line.value for _, line in lines])
    if len(wheels) < 2 or np.ptp(ratios) > SAME_RATIO * np.abs(ratios).mean():
        return lines
    columns = tuple(k for pair, _ in wheels for k in pair.of[1])
    first = wheels[0][0]
    witness = [pair.witness for pair, _ in wheels]
    joined = first._replace(
        speed=" ".join(pair.speed for pair, _ in wheels),
        position=" ".join(pair.position for pair, _ in wheels),
        value=np.hstack([pair.value for pair, _ in wheels]),
        rate=np.hstack([pair.rate for pair, _ in wheels]),
        of=(first.of[0], columns),
        on=(first.on[0], columns),
        witness=None if None in witness else (witness[0][0], np.hstack([channel[1] for channel in witness])),  # type: ignore[index]
    )
    line = Slope(float(ratios.mean()), max(line.error for _, line in wheels), wheels[0][1].windows)
    return [(joined, line)]


def _judged(work: LogUnderCheck, pair: SpeedPair, line: Slope) -> tuple[Finding, LogUnderCheck]:
    """What is wrong, and the work with it put right."""
    ratio = line.value  # the speed is 1/ratio times too large, or the position ratio times
    by, side = _blamed(work, pair, ratio)
    units = {
        SPEED_SIDE: unit_of(1.0 / ratio, possible(pair.speed_units, work, _component(pair.of))),
        POSITION_SIDE: unit_of(ratio, possible(pair.position_units, work, _component(pair.on))),
    }
    if not side:
        side = POSITION_SIDE if any(units[POSITION_SIDE]) and not any(units[SPEED_SIDE]) else SPEED_SIDE
    name, counterpart = (pair.speed, pair.position) if side == SPEED_SIDE else (pair.position, pair.speed)
    compared = {"position": pair.position, "speed": pair.speed, "source": by, "agrees_with": counterpart if by else ""}
    clock = unit_of(1.0 / ratio, TIME_UNITS)
    if any(units[side]):
        factor = 1.0 / ratio if side == SPEED_SIDE else ratio
        finding = unit_finding(name, factor, units[side], (), shown_by="derivative", ratio=ratio, **compared)
    elif any(clock):
        finding = _of_time((pair, line))
    elif ratio < 0.0:
        finding = Finding(
            "inverted",
            ERROR,
            name if by else f"{pair.speed} {pair.position}",
            {"ratio": ratio, "error": line.error, **compared, "blamed": name if by else ""},
        )
    else:
        finding = Finding(
            "scale", WARNING, name, {"ratio": ratio, "error": line.error, **compared, "blamed": name if by else ""}
        )
    return finding, _scaled(
        work, *(pair.of if side == SPEED_SIDE else pair.on), ratio if side == SPEED_SIDE else 1 / ratio
    )


def _blamed(work: LogUnderCheck, pair: SpeedPair, ratio: float) -> tuple[str, str]:
    """(what else was measured, which of the two it contradicts); "" and "" where nothing else tells."""
    if pair.witness is None:
        return "", ""
    name, values = pair.witness
    ids, count = work.windows()
    line = slope(values, pair.value, ids, count)  # 1 where the speed is right, the ratio where its position is
    if not np.isfinite(line.error) or line.windows < 4 or _likeness(values, pair.value, ids, count) < LEAST_LIKENESS:
        return "", ""
    off_speed, off_position = abs(line.value - 1.0), abs(line.value / ratio - 1.0)
    if min(off_speed, off_position) > 0.5 * max(off_speed, off_position):
        return "", ""
    return name, POSITION_SIDE if off_speed < off_position else SPEED_SIDE


def _of_time(mismatch: tuple[SpeedPair, Slope]) -> Finding:
    pair, line = mismatch
    clock = unit_of(1.0 / line.value, TIME_UNITS)
    return Finding(
        "time_unit",
        ERROR,
        "t",
        {"ratio": line.value, "position": pair.position, "speed": pair.speed, "mistake": clock if any(clock) else ()},
    )


def _component(of: tuple[str, tuple[int, ...]]) -> str:
    return components(of[0], of[1][0] + 1 if of[0].startswith("wheel") else 0)[of[1][0]]


def _scaled(work: LogUnderCheck, channel: str, columns: tuple[int, ...], factor: float) -> LogUnderCheck:
    values = work.channels[channel].copy()
    values[:, list(columns)] *= factor
    return work.replace(**{channel: values})


def _likeness(y: FloatArray, x: FloatArray, ids, count: int) -> float:
    """Correlation, about 0, of window means: 1 where one is the other times a number. Shapes (rows, k)."""
    finite = np.isfinite(y) & np.isfinite(x)
    a, b = (
        np.concatenate([windowed(ids, count, column) for column in np.where(finite, columns, 0.0).T])
        for columns in (y, x)
    )
    return float(abs(a @ b) / max(np.sqrt((a @ a) * (b @ b)), 1e-300))


def _turn(work: LogUnderCheck) -> Iterator[SpeedPair]:
    """heading against omega."""
    half = max(1, round(HALF_WIDTH / work.step))
    pose, twist, speed = work.get("pose"), work.get("twist"), work.full("wheel_speed")
    if pose is None or twist is None or not np.isfinite(pose[:, 2]).any() or not np.isfinite(twist[:, 2]).any():
        return
    wheel_motion = None if speed is None else wheels_twist(work, speed, 2 * half + 1)
    rate = central_rate(unwrapped(pose[:, 2]), work.t, half)
    witness = None if wheel_motion is None else ("wheels", wheel_motion[:, 2:])
    yield SpeedPair(
        "turn",
        "omega",
        "heading",
        smooth(twist[:, 2:], 2 * half + 1),
        rate[:, None],
        ("twist", (2,)),
        ("pose", (2,)),
        witness,
        TURN_UNITS,
        ANGLE_UNITS,
    )


def _wheels(work: LogUnderCheck) -> Iterator[SpeedPair]:
    """The angle of each wheel against its speed."""
    half = max(1, round(HALF_WIDTH / work.step))
    angle, speed = work.get("wheel_angle"), work.get("wheel_speed")
    if angle is None or speed is None or angle.shape != speed.shape or "wheel_speed" not in work.log.channels:
        return
    expected = expected_wheel_speed(work)
    for k, name in enumerate(components("wheel_speed", speed.shape[1])):
        witness = None if expected is None else (expected[0], smooth(expected[1][:, [k]], 2 * half + 1))
        rate = central_rate(angle[:, k], work.t, half)[:, None]
        yield SpeedPair(
            "wheels",
            name,
            name.replace("w", "a"),
            smooth(speed[:, [k]], 2 * half + 1),
            rate,
            ("wheel_speed", (k,)),
            ("wheel_angle", (k,)),
            witness,
            TURN_UNITS,
            ANGLE_UNITS,
        )


def _path(work: LogUnderCheck) -> Iterator[SpeedPair]:
    """x and y against vx and vy."""
    pose, twist, speed = work.full("pose"), work.full("twist"), work.full("wheel_speed")
    if pose is None or twist is None or len(work) < 3 * MIN_ROWS:
        return
    body, width = pose_twist(work, pose)
    wheel_motion = None if speed is None else wheels_twist(work, speed, width)
    witness = None if wheel_motion is None else ("wheels", wheel_motion[:, :2])
    yield SpeedPair(
        "path",
        "vx vy",
        "x y",
        smooth(twist[:, :2], width),
        body[:, :2],
        ("twist", (0, 1)),
        ("pose", (0, 1)),
        witness,
        SPEED_UNITS,
        LENGTH_UNITS,
    )


PAIRS: tuple[Callable[[LogUnderCheck], Iterator[SpeedPair]], ...] = (_turn, _wheels, _path)
