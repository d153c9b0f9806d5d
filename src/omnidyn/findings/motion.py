"""What the robot did with its commands: never moved, was blocked, did not reach the commanded speed."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import ground, volts
from omnidyn.findings.signal.robust import quantum, slope, smooth, white_noise
from omnidyn.logs.channels import components
from omnidyn.model.dynamics import acceleration
from omnidyn.model.wheels import wheel_speed
from omnidyn.statement import ERROR, NOTE, WARNING
from omnidyn.statistics import stretches

SETTLE, HOLD_TIME = 0.4, 0.3  # [s]
DROOP = 0.05
NOISE_QUANTILE = 0.99  # of noise at rest: a row in some thousands is beyond its level,
NOISE_FACTOR = 1.5  # none beyond so many times that
LONGER = 2  # times the window before, each window over which something may move
SURE = 4.5  # standard errors of a mean over such a window, of which there are some hundreds
REST_SPEED = 0.05  # [rad/s, m/s] that a mean over a long window may have at rest: an offset of a sensor
REST_WAY = 0.05  # [m, rad] by which a pose may wander at rest
MOMENT = 0.15  # [s]
SAFETY = 1.6  # a robot that stands although its voltages are so many times those that move it was held


def check_motion(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on motion; that the robot rests throughout is passed on as `known["at_rest"]`."""
    if len(work) < MIN_ROWS or work.step <= 0.0:
        return [], work
    still = _still(work)
    if still is None:
        return [], work
    if still.mean() > NOISE_QUANTILE and np.all(_still(work, NOISE_FACTOR)) and not _moves_anywhere(work):
        return [_never_moved(work)], work.knowing(at_rest=True)
    return _start_up(work, still) + _blocked(work, still) + _droop(work), work


def _start_up(work: LogUnderCheck, still: BoolArray) -> list[Finding]:
    """A log that begins with its command already set: the first rows are the start, not the motion asked for."""
    rows = int(np.argmin(still))
    if rows < 2:
        return []
    for channel in ("wheel_speed_command", "twist_command"):
        command = work.get(channel)
        if command is not None and np.nanmax(np.abs(command[0])) > 0.0 and not np.diff(command[:rows], axis=0).any():
            first = np.arange(len(work)) < rows
            return [
                Finding(
                    "start_up",
                    NOTE,
                    channel,
                    {"rows": rows, "seconds": float(work.t[rows] - work.t[0])},
                    rows=work.lines(first),
                    count=rows,
                )
            ]
    return []


def _still(work: LogUnderCheck, times: float = 1.0) -> BoolArray | None:
    """Rows in which nothing moves beyond so many times its noise; None where no motion was recorded."""
    speed, floor_motion = work.get("wheel_speed"), ground(work)
    if speed is None and floor_motion is not None and len(floor_motion.axes) == 3:
        speed = floor_motion.twist
    if speed is None:  # a gyro alone does not know
        return None
    width = work.width(0.1)
    still = np.asarray(np.isfinite(speed).any(axis=1))  # what is not known is no rest
    for column in speed.T:
        if np.isfinite(column).any():
            with np.errstate(invalid="ignore"):
                still &= ~(np.abs(smooth(column, width)) > times * _rest_level(column, width))
    return still


def _moves_anywhere(work: LogUnderCheck) -> bool:
    """Whether any channel moves over any window that its noise allows: a speed in the mean, a pose by its way."""
    narrow = work.width(0.1)
    for channel in ("wheel_speed", "twist"):
        for component, column in work.columns(channel):
            if component == "omega":  # a gyroscope has an offset
                continue
            noise, count, width = white_noise(column), 1.01 * quantum(column) * narrow, narrow * LONGER
            while width <= len(column):
                level = max(SURE * noise / np.sqrt(width), count / width, REST_SPEED)
                whole = slice(width // 2, len(column) - (width - 1) // 2)  # windows at the ends are shorter
                if np.nanmax(np.abs(smooth(column, width)[whole]), initial=0.0) > level:
                    return True
                width *= LONGER
    for _, column in work.columns("pose"):
        means = smooth(column[np.isfinite(column)], work.width(0.5))
        level = max(12.0 * white_noise(column), 3.0 * quantum(column), REST_WAY)
        if len(means) and np.ptp(means) > level:
            return True
    return False


def _rest_level(column: FloatArray, width: int) -> float:
    """What a mean over `width` rows has to exceed to be motion."""
    return max(4.0 * white_noise(column) / np.sqrt(width), 1.01 * quantum(column), 1e-9)


def _level(work: LogUnderCheck) -> float:
    """The same as a speed of wheels [rad/s]."""
    speed, robot = work.get("wheel_speed"), work.geometry
    floor_motion = ground(work)
    if speed is None and floor_motion is not None and robot is not None:
        speed = wheel_speed(robot.wheels, floor_motion.twist)
    width = work.width(0.1)
    return np.inf if speed is None else max(_rest_level(column, width) for column in speed.T)


def _never_moved(work: LogUnderCheck) -> Finding:
    driven = any(
        work.get(name) is not None and np.nanmax(np.abs(work.channels[name])) > 0.0
        for name in ("voltage", "duty", "wheel_speed_command", "twist_command")
    )
    return Finding("never_moved", ERROR, "", {"driven": driven}, rows=work.lines(work.everywhere), count=len(work))


def _blocked(work: LogUnderCheck, still: BoolArray) -> list[Finding]:
    """At rest although the motors are driven as they are elsewhere where the robot moves."""
    voltage, robot = volts(work), work.geometry
    current = work.get("current")
    if voltage is not None and robot is not None and voltage.shape[1] == work.wheels:
        mask = np.zeros(len(work), dtype=bool)
        rest = np.flatnonzero(still & np.isfinite(voltage).all(axis=1))
        if rest.size:
            levels, back = np.unique(np.round(voltage[rest], 3), axis=0, return_inverse=True)
            if len(levels) <= 2000:
                # It would have to be seen: a speed after a moment that is well above what counts as rest.
                grips = robot.replace(wheels=robot.wheels.replace(traction_mu=None))  # as all wheels do at rest
                start = acceleration(grips, np.zeros((len(levels), 3)), levels / SAFETY)
                soon = np.abs(wheel_speed(robot.wheels, MOMENT * start)).max(axis=1)
                mask[rest] = (soon > 3.0 * _level(work))[back.ravel()]
    elif current is not None:
        load = np.nansum(np.abs(smooth(current, 9)), axis=1)
        moving = load[~still]
        mask = still & (load > 2.0 * np.quantile(moving, 0.99)) if moving.size > MIN_ROWS else np.zeros(len(work), bool)
    else:
        return []
    mask = _long(mask, round(SETTLE / work.step))
    if not mask.any():
        return []
    return [
        Finding(
            "blocked",
            WARNING,
            "",
            {"seconds": float(mask.sum() * work.step)},
            rows=work.lines(mask),
            count=int(mask.sum()),
        )
    ]


def _long(mask: BoolArray, least_rows: int) -> BoolArray:
    """Only the stretches of at least so many rows, without their first half second of starting."""
    out = np.zeros_like(mask)
    for a, b in stretches(mask):
        if b - a >= max(least_rows, 5):
            out[a:b] = True
    return out


def held(work: LogUnderCheck, command: FloatArray, seconds: float = HOLD_TIME) -> BoolArray:
    """Rows whose command has been the same for so long. Shape (rows,)."""
    change = np.concatenate([[True], (np.diff(command, axis=0) != 0.0).any(axis=1)])
    last = np.maximum.accumulate(np.where(change, np.arange(len(change)), 0))
    return work.t - work.t[last] >= seconds


def _droop(work: LogUnderCheck) -> list[Finding]:
    """Commanded against measured wheel speed, where the command has been held."""
    speed, command = work.get("wheel_speed"), work.get("wheel_speed_command")
    name = "wheel_speed_command"
    if command is None and work.geometry is not None and work.full("twist_command") is not None:
        command, name = wheel_speed(work.geometry.wheels, work.channels["twist_command"]), "twist_command"
    if speed is None or command is None or speed.shape != command.shape:
        return []
    settled = held(work, command, SETTLE)
    if settled.sum() < MIN_ROWS:
        return []
    ids, count = work.windows()
    w = np.where(settled[:, None], speed, np.nan)
    line = slope(w, command, ids, count)
    if not line.differs(1.0, DROOP, 5.0) or line.windows < 4 or line.value <= 0.0:
        return []
    return [
        Finding(
            "droop",
            WARNING,
            " ".join(components("wheel_speed", speed.shape[1])),
            {"ratio": line.value, "error": line.error, "command": name},
            rows=work.lines(settled),
            count=int(settled.sum()),
        )
    ]
