"""Single channels: missing values, channels that never change, steps of quantisation, spikes."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.clocks import at_each_clock
from omnidyn.findings.signal.log_under_check import MIN_ROWS, SENSORS, LogUnderCheck
from omnidyn.findings.signal.reference import (
    CURRENT_AND_VOLTAGE,
    GEOMETRY,
    MEASUREMENTS,
    WHEELS,
    expected_wheel_speed,
    keys_behind,
)
from omnidyn.findings.signal.robust import HELD_HEADING, quantum, smooth, turned_by, white_noise
from omnidyn.findings.values.codes import check_codes
from omnidyn.findings.values.spikes import check_spikes
from omnidyn.findings.values.stuck import check_stuck
from omnidyn.logs.channels import place
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.logs.log import MAX_MISSING
from omnidyn.logs.read_log import driven_way
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.sensors import BEHIND_GEAR, OF_WHEELS
from omnidyn.statement import ERROR, NOTE, WARNING
from omnidyn.statistics import moving
from omnidyn.units import known_unit

TINY = 1e-9  # a step so small is what rounding leaves of a constant
SAME_SCALE = 0.03  # a scale so near 1 is 1, within what noise makes of it


def check_values(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """All findings on single channels, each at its own clock; what sticks, spikes or is dead is masked."""
    findings, work = at_each_clock(work, _at_its_clock)
    return findings, work if len(work) < MIN_ROWS else _with_dead_wheel(work, findings)


def _at_its_clock(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The same of the channels that were sampled in these rows."""
    findings = _missing(work)
    if len(work) < MIN_ROWS:
        return findings, work
    new_findings, work = check_codes(work)
    findings += new_findings + _quantised(work)
    for family in (_constant, check_stuck, check_spikes):
        new_findings, work = family(work)
        findings += new_findings
    return findings, work


def _with_dead_wheel(work: LogUnderCheck, findings: list[Finding]) -> LogUnderCheck:
    """The speed of one dead wheel as the other channels say it, on the scale of the other wheels.

    Else it hides what is wrong with them: neither floor nor circuit can be held against a robot with a wheel missing.
    """
    dead = [
        at[1]
        for finding in findings
        if finding.code == "dead" and (at := place(finding.subject)) and at[0] == "wheel_speed"
    ]
    expected = expected_wheel_speed(work, without="wheel_speed")
    if len(dead) != 1 or expected is None or expected[0] not in MEASUREMENTS or expected[1].shape[1] != work.wheels:
        return work
    speed = work.channels["wheel_speed"].copy()
    width = work.width(0.2)  # noise of what tells the speed would make it look larger
    logged, predicted = (
        np.delete(smooth(speed, width), dead, axis=1),
        np.delete(smooth(expected[1], width), dead, axis=1),
    )
    finite = np.isfinite(logged) & np.isfinite(predicted)
    size, turned = float((predicted[finite] ** 2).sum()), float((logged[finite] ** 2).sum())
    if not size > 0.0 or not turned > 0.0:
        return work
    ratio = float(np.sqrt(turned / size))
    speed[:, dead[0]] = expected[1][:, dead[0]] * (ratio if abs(ratio - 1.0) > SAME_SCALE else 1.0)
    return work.replace(wheel_speed=speed).knowing(dead_wheel=dead[0])


def _missing(work: LogUnderCheck) -> list[Finding]:
    findings: list[Finding] = []
    if work.log.own_clocks:  # a topic has nothing to say before its first message and behind its last
        return findings
    for channel in work.channels:
        alike: dict[bytes, list[str]] = {}  # components that miss the same rows: one finding
        for component, values in work.sampled_columns(channel):
            alike.setdefault((~np.isfinite(values)).tobytes(), []).append(component)
        for rows, components in alike.items():
            mask = np.frombuffer(rows, dtype=bool)
            share = float(mask.mean())
            if share > 0.0:
                grave = share > MAX_MISSING and channel not in ("pose", "twist", "supply")
                severity, numbers = WARNING if grave else NOTE, {"share": share}
                subject, count = " ".join(components), int(mask.sum())
                findings.append(Finding("missing", severity, subject, numbers, rows=work.lines(mask), count=count))
    return findings


def _quantised(work: LogUnderCheck) -> list[Finding]:
    """Steps of a sensor that matter: 2 % of what it usually reads, or more; sensors of one step in one finding."""
    findings: list[Finding] = []
    command = work.get("wheel_speed_command")
    expected = ("wheel_speed_command", command) if command is not None else expected_wheel_speed(work)
    groups: dict[tuple[str, float], list[tuple[str, float, float]]] = {}
    for channel in SENSORS:
        for component, values in work.sampled_columns(channel):
            k = place(component)[1]  # type: ignore[index]
            recorded_values = values[work.recorded(channel, k)]
            step = quantum(recorded_values)
            busy = np.abs(recorded_values[np.isfinite(recorded_values) & moving(recorded_values)])
            usual = float(np.median(busy)) if busy.size else 0.0
            if not step or step < max(0.02 * usual, TINY):
                continue
            key = next(
                (group for group in groups if group[0] == channel and abs(group[1] / step - 1.0) < 0.01),
                (channel, step),
            )
            groups.setdefault(key, []).append((component, step / usual, white_noise(recorded_values)))
            if channel == "wheel_speed" and expected is not None and expected[1].shape[1] > k:
                findings += _reads_zero(work, component, values, step, expected[0], expected[1][:, k])
    for (_, step), members in groups.items():
        names = [name for name, _, _ in members]
        share, noise = max(steps for _, steps, _ in members), max(noises for _, _, noises in members)
        findings.append(
            Finding(
                "quantised",
                NOTE,
                " ".join(names),
                {"step": step, "share": share, "noise": noise, **_in_column(work, names[0], step)},
            )
        )
    return findings


def _reads_zero(
    work: LogUnderCheck, component: str, values: FloatArray, step: float, source: str, reference: FloatArray
) -> list[Finding]:
    """A wheel slower than its encoder can say."""
    width = work.width(0.1)
    # What lies between two measurements is no measurement, and a mean over such rows no better than they are.
    source_rows = _told(work, source)
    turning = np.abs(smooth(reference, width))
    noise_level = 5.0 * white_noise(reference[source_rows]) / np.sqrt(max(1.0, width * len(source_rows) / len(work)))
    slow = ~moving(values) & np.isfinite(values) & (turning > max(0.3 * step, noise_level)) & (turning < 2.0 * step)
    if slow.mean() < 0.2:
        return []
    return [
        Finding(
            "reads_zero",
            WARNING,
            component,
            {"step": step, "share": float(slow.mean()), "source": source},
            rows=work.lines(slow),
            count=int(slow.sum()),
        )
    ]


def _in_column(work: LogUnderCheck, component: str, step: float) -> dict[str, object]:
    """The step as it stands in the file, where its unit is another."""
    column = work.log.columns.columns.get(component)
    unit = known_unit(column.unit) if column is not None else None
    if column is None or unit is None:
        return {}
    size = unit.size
    if work.robot is not None and component_channel(component) in BEHIND_GEAR:
        size /= column.divisor(work.robot, place(component)[1])  # type: ignore[index]
    details = {"step_in_column": step / size, "unit": unit.text, "column": column.name}
    return {} if abs(size - 1.0) < 1e-9 else details


def _constant(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Channels that never change, while something says they should."""
    findings = []
    for channel in work.channels:
        columns = work.columns(channel)
        flat = {name: bool(np.nanmax(values) == np.nanmin(values)) for name, values in columns}
        for component, values in work.sampled_columns(channel):
            if not flat[component] or channel in ("supply",):
                continue
            k = place(component)[1]  # type: ignore[index]
            reason = _should_move(work, channel, k, all(flat.values()))
            if reason:
                findings.append(
                    Finding(
                        "dead",
                        ERROR if channel not in ("pose", "twist_command", "wheel_speed_command") else WARNING,
                        component,
                        {"value": float(np.nanmax(values)), "reason": reason},
                        rows=work.lines(work.everywhere),
                        count=len(work),
                        rests_on=_behind(work, channel),
                    )
                )
                work = work.masked(channel, k, work.everywhere)
    return findings, work


def _should_move(work: LogUnderCheck, channel: str, k: int, all_flat: bool) -> str:
    """Why a constant component should change, by what else moves: a reason of `telling`; "" where nothing says so."""
    if channel in ("voltage", "duty"):
        current, speed = work.get("current"), work.get("wheel_speed")
        driven = current is not None and k < current.shape[1] and _moves(current[:, k])
        turned = speed is not None and k < speed.shape[1] and _moves(speed[:, k])
        return "motor" if driven and turned and not all_flat else ""
    if channel == "current":
        if work.log.current_unsigned and not _driven(work, k):
            return ""  # 0 is what it was given for a sign
        for drive in ("voltage", "duty"):
            values = work.get(drive)
            if values is not None and k < values.shape[1] and _moves(values[:, k]):
                return drive
        return "other_motors" if not all_flat and _wheel_moves(work, k) else ""
    if channel in OF_WHEELS:
        return _wheel_reason(work, channel, k)
    if channel == "twist" and not all_flat:
        speed, robot = work.full("wheel_speed"), work.geometry
        if speed is None or robot is None:
            return ""
        wheel_motion = twist_from_wheel_speed(robot.wheels, speed)[:, k]
        scale = float(np.nanstd(twist_from_wheel_speed(robot.wheels, speed), axis=0).max())
        return WHEELS if float(np.nanstd(wheel_motion)) > 0.1 * scale and _moves(wheel_motion) else ""
    if channel == "pose" and k == 2:
        twist, speed, robot = work.get("twist"), work.full("wheel_speed"), work.geometry
        if twist is not None and _moves(twist[:, 2]):
            return "omega" if turned_by(twist[:, 2], work.t) > HELD_HEADING else ""
        if speed is None or robot is None:
            return ""
        wheel_motion = smooth(twist_from_wheel_speed(robot.wheels, speed), work.width(0.3))
        turning = spread_of_motion(wheel_motion[:, 2]) * float(np.mean(robot.wheels.robot_radius))
        straight = max(spread_of_motion(wheel_motion[:, 0]), spread_of_motion(wheel_motion[:, 1]))
        if turning > 0.3 * straight and turned_by(wheel_motion[:, 2], work.t) > HELD_HEADING:
            return "turning_wheels"
    return ""


def _behind(work: LogUnderCheck, channel: str) -> tuple[str, ...]:
    """The keys of the robot file behind a reason of `_should_move`."""
    if channel in OF_WHEELS:
        expected = expected_wheel_speed(work, without=channel)
        return () if expected is None else keys_behind(expected[0])
    return GEOMETRY if channel in ("twist", "pose") and work.get("wheel_speed") is not None else ()


def _wheel_reason(work: LogUnderCheck, channel: str, k: int) -> str:
    expected = expected_wheel_speed(work, without=channel)
    if expected is None or k >= expected[1].shape[1]:
        return ""
    expected_speed = expected[1][:, k]
    rest_speeds = np.delete(expected[1], k, axis=1)
    sizes = [spread_of_motion(column) for column in rest_speeds.T]
    usual = max(sizes) if sizes else 0.0
    return expected[0] if spread_of_motion(expected_speed) > 0.1 * usual and _moves(expected_speed) else ""


def spread_of_motion(values: FloatArray) -> float:
    """How far a channel gets from 0, without its outliers."""
    values = values[np.isfinite(values)]
    return float(np.quantile(np.abs(values), 0.95)) if values.size else 0.0


def _driven(work: LogUnderCheck, k: int) -> bool:
    """Whether what gives an unsigned current its sign ever drives motor k."""
    distance, _ = driven_way(work.log, work.geometry)
    return distance is None or k >= distance.shape[1] or bool((np.abs(distance[:, k]) > 0.0).any())


def _wheel_moves(work: LogUnderCheck, k: int) -> bool:
    speed = work.get("wheel_speed")
    return speed is not None and k < speed.shape[1] and _moves(speed[:, k])


def _moves(values: FloatArray) -> bool:
    """Whether a channel does more than its noise and one step of quantisation."""
    noise = max(white_noise(values), quantum(values))
    return spread_of_motion(values) > 5.0 * noise and float(np.nanstd(values)) > 0.0


def _told(work: LogUnderCheck, source: str) -> IntArray:
    """Rows in which what tells the speed of a wheel was recorded."""
    if source not in MEASUREMENTS:
        return np.arange(len(work))
    return work.recorded("current" if source == CURRENT_AND_VOLTAGE else source, 0)
