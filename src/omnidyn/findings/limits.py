"""Limits of driver and battery: saturation, sag, a duty whose supply nobody knows, currents without a sign."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.clocks import at_each_clock
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.robust import quantum, smooth, white_noise
from omnidyn.logs.channels import components
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.model.wheels import per_wheel
from omnidyn.statement import ERROR, NOTE, WARNING

AT_LIMIT = 0.003  # of the limit
LEAST_SHARE = 0.005  # of the rows
SAG = 0.03  # of the highest supply
BOTH_WAYS = 0.05  # of the rows, each way: more than a wheel goes on against what drives it
TOO_FAST = 0.1  # of the rows


def check_limits(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on saturation, supply and signs; the work without what has lost its sign."""
    if len(work) < MIN_ROWS:
        return [], work
    findings: list[Finding] = []
    for channel in ("voltage", "duty", "current"):
        findings += _saturated(work, channel)
    findings += at_each_clock(work, _too_fast)[0] + _sag(work) + _no_supply(work)
    for channel in ("voltage", "duty"):
        new_findings = _one_way_drive(work, channel)
        work, findings = work.replace(**{channel: None}) if new_findings else work, findings + new_findings
    new_findings = _unsigned(work)
    return findings + new_findings, work.replace(current=None) if any(
        finding.severity == ERROR for finding in new_findings
    ) else work


def _one_way_drive(work: LogUnderCheck, channel: str) -> list[Finding]:
    """A voltage or duty that is never negative, though one wheel under it turns both ways for long."""
    driven, speed = work.get(channel), work.get("wheel_speed")
    if driven is None or speed is None or driven.shape != speed.shape:
        return []
    high = float(np.nanmax(driven))
    with np.errstate(invalid="ignore"):
        if high <= 0.0 or (driven < -0.01 * high).any():
            return []
        width = work.width(0.2)
        mean, noise = smooth(speed, width), np.array([white_noise(column) for column in speed.T])
        usual = np.maximum(0.3 * np.nanquantile(np.abs(mean), 0.9), 5.0 * noise / np.sqrt(width))
        pushed = driven > 0.2 * high
        back, ahead = ((side * mean > usual) & pushed for side in (-1.0, 1.0))
        shares = np.minimum(back.mean(axis=0), ahead.mean(axis=0))
    names = [
        name for name, share in zip(components(channel, driven.shape[1]), shares, strict=True) if share > BOTH_WAYS
    ]
    if not names:
        return []
    share = float(back.mean())
    return [Finding("unsigned", ERROR, " ".join(names), {"share": share, "channel": channel})]


def _limit(work: LogUnderCheck, channel: str) -> tuple[FloatArray | float | None, str]:
    """What a channel cannot exceed, and what limits it: "duty", "supply" or a key of the robot file."""
    robot, supply = work.geometry, work.get("supply")
    if channel == "duty":
        return 1.0, "duty"
    if robot is None:
        if channel == "voltage" and supply is not None:
            return 0.985 * smooth(supply, 9)[:, None], "supply"
        return None, ""
    if channel == "current":
        limit = robot.motor.current_limit
        return (None, "") if limit is None else (per_wheel(limit, work.wheels), "motor.current_limit_A")
    return per_wheel(robot.motor.voltage_limit, work.wheels), "motor.voltage_limit_V"


def _saturated(work: LogUnderCheck, channel: str) -> list[Finding]:
    values = work.get(channel)
    limit, owner = _limit(work, channel)
    if values is None or limit is None:
        return []
    tolerance = np.array(
        [max(AT_LIMIT * float(np.max(limit)), 0.5 * quantum(column), 2.5 * white_noise(column)) for column in values.T]
    )
    tolerance = np.minimum(tolerance, 0.03 * np.max(limit))
    with np.errstate(invalid="ignore"):
        at = np.abs(values) >= limit - tolerance
    mask = np.asarray(at.any(axis=1))
    share = float(mask.mean())
    if share < LEAST_SHARE:
        return []
    names = [
        name
        for name, column in zip(components(channel, values.shape[1]), at.T, strict=True)
        if column.mean() > 0.2 * LEAST_SHARE
    ]
    level = float(np.mean(limit))
    return [
        Finding(
            "saturation",
            WARNING,
            " ".join(names),
            {"share": share, "limit": level, "limited_by": owner},
            rows=work.lines(mask),
            count=int(mask.sum()),
        )
    ]


def _too_fast(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Inputs that change more from row to row than the rows can tell."""
    name = next((channel for channel in ("voltage", "duty") if work.get(channel) is not None), "")
    columns = work.sampled_columns(name) if name else []
    if not columns:
        return [], work
    fast = np.array([unresolved_rows(column) for _, column in columns]).T
    mask = np.asarray(fast.any(axis=1))
    if mask.mean() < TOO_FAST:
        return [], work
    names = [name for (name, _), column in zip(columns, fast.T, strict=True) if column.any()]
    return [
        Finding(
            "too_fast",
            NOTE,
            " ".join(names),
            {"share": float(mask.mean())},
            rows=work.lines(mask),
            count=int(mask.sum()),
        )
    ], work


def _sag(work: LogUnderCheck) -> list[Finding]:
    supply = work.get("supply")
    if supply is None or not np.isfinite(supply).any():
        return []
    width = work.width(0.1)
    level = smooth(supply, width)
    high = float(np.nanquantile(level, 0.98))
    noise = white_noise(supply) / np.sqrt(width)
    if high <= 0.0:
        return []
    low = float(np.nanmin(level)) + 3.0 * noise
    drop = (high - low) / high
    if drop < SAG or high - low < 4.0 * noise:
        return []
    mask = level < high - 0.5 * (high - low)
    return [
        Finding(
            "sag",
            WARNING,
            "supply",
            {"drop": drop, "high_V": high, "low_V": low, "lowest_at_s": float(work.t[int(np.nanargmin(level))])},
            "of_duty" if work.get("duty") is not None else "",
            rows=work.lines(mask),
            count=int(mask.sum()),
        )
    ]


def _no_supply(work: LogUnderCheck) -> list[Finding]:
    if work.get("duty") is None or work.get("supply") is not None or work.get("voltage") is not None:
        return []
    nominal = work.geometry.drive.supply if work.geometry is not None else None
    return [Finding("no_supply", NOTE, "supply", {"nominal_V": nominal} if nominal else {})]


def _unsigned(work: LogUnderCheck) -> list[Finding]:
    """Currents that are never negative though the motors turn both ways."""
    current = work.get("current")
    if current is None:
        return []
    names = " ".join(components("current", current.shape[1]))
    if work.log.current_unsigned:
        return [Finding("unsigned", NOTE, names)]
    turning = next(
        (
            values
            for name in ("wheel_speed", "wheel_speed_command", "voltage", "duty")
            if (values := work.get(name)) is not None and values.shape == current.shape
        ),
        None,
    )
    noise = np.array([max(white_noise(column), quantum(column)) for column in current.T])
    with np.errstate(invalid="ignore"):
        if turning is None or (current < -2.0 * noise).mean() > 1e-3:
            return []
        usual = np.nanquantile(np.abs(turning), 0.9)
        backward = (turning < -0.3 * usual) & (current > 3.0 * noise)
    share = float(backward.mean())
    if usual <= 0.0 or share < 0.05:
        return []
    return [Finding("unsigned", ERROR, names, {"share": share, "channel": "current"})]
