"""Remedies that are a matter of reading: the map or the option under which a log has a finding no more.

The sentence of a remedy (telling/findings) and what is done here come from the same code and numbers of the finding.
What asks for another recording, or for a look at the robot, has no place here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from omnidyn.findings.finding import Finding
from omnidyn.logs.channels import components
from omnidyn.logs.column import MOTOR_SIDE, ROOM, Column
from omnidyn.logs.columns.mapping import ColumnMap, component_channel, unit_and_side
from omnidyn.logs.read_log import LogOptions
from omnidyn.model.wheels import MAX_WHEELS
from omnidyn.sensors import OF_MOTORS
from omnidyn.statement import ERROR, Statement
from omnidyn.units import DUTY, known_unit

POSE_OF_TWIST = {"vx": "x", "vy": "y", "omega": "heading"}

Columns = dict[str, Column]


def remedied(finding: Finding, options: LogOptions, columns: ColumnMap) -> LogOptions | None:
    """The options under which the log is read without the fault; None for a remedy that is no matter of reading.

    options, columns: how the log was read, and which column it took for what.
    """
    if finding.code == "unsigned":
        of_current = finding.severity == ERROR and finding.numbers["channel"] == "current"
        return replace(options, current_unsigned=True) if of_current else None
    mend = MENDS.get(finding.code)
    changed = None if mend is None else mend(finding, columns.columns)
    if not changed or changed == columns.columns:
        return None
    return replace(options, columns=ColumnMap(changed), overrides=(), assume={}, latency={})


def _unit(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """The columns in the unit that they likely have; a duty that was read as a voltage is one."""
    if not finding.numbers["mistake"]:
        return None
    actual, wrong = finding.numbers["mistake"]
    (unit, side), (read, _) = unit_and_side(actual), unit_and_side(wrong)
    changed = dict(columns)
    for name in finding.subject.split():
        column = columns.get(name)
        before = known_unit(column.unit) if column is not None else None
        if column is None or before is None or (before.quantity, before.size) != (read.quantity, read.size):
            return None
        del changed[name]
        as_duty = unit.quantity == DUTY and read.quantity != DUTY
        mended = replace(column, unit=unit.text, side=MOTOR_SIDE if side == MOTOR_SIDE else column.side)
        changed[f"d{name[1:]}" if as_duty else name] = mended
    return changed


def _inverted(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """The columns with the opposite sign."""
    numbers = finding.numbers
    if "wiring" in numbers:
        return _wired(finding, columns)
    if finding.remedy == "mixed" or ("position" in numbers and not numbers["blamed"]):
        return None
    return _turned_about(finding.subject.split(), columns)


def _turned_about(names: list[str], columns: Mapping[str, Column]) -> Columns | None:
    if any(name not in columns for name in names):
        return None
    return {**columns, **{name: replace(columns[name], invert=not columns[name].invert) for name in names}}


def _wired(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """The columns in their places, with their signs: of a channel, of whole motors, of the pose beside the twist."""
    numbers, wiring = finding.numbers, finding.numbers["wiring"]
    changed = _placed(wiring, columns, lambda name: name)
    if numbers.get("blamed") == "motors":
        for channel in OF_MOTORS:
            names = components(channel, MAX_WHEELS)
            if changed is not None and channel != "wheel_speed" and any(name in columns for name in names):
                changed = _placed(wiring, changed, lambda name, names=names: names[int(name[1:]) - 1])
    if numbers.get("of_pose") and changed is not None:
        changed = _placed(wiring, changed, lambda name: POSE_OF_TWIST[name])
    return changed


def _placed(wiring: Statement, columns: Mapping[str, Column], named: Callable[[str], str]) -> Columns | None:
    changed = dict(columns)
    for slot, origin, sign in zip(*(wiring.numbers[name] for name in ("slots", "columns", "signs")), strict=True):
        column = columns.get(named(origin))
        if column is None:
            return None
        changed[named(slot)] = replace(column, invert=column.invert != (sign < 0.0))
    return changed


def _framed(names: tuple[str, ...], frame: str, columns: Mapping[str, Column]) -> Columns | None:
    if any(name not in columns or columns[name].frame for name in names):
        return None
    return {**columns, **{name: replace(columns[name], frame=frame) for name in names}}


def _marker(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """The heading of a marker that is mounted at an angle."""
    return _framed(("heading",), f"{finding.numbers['angle_deg']:.1f}deg", columns)


def _pose_frame(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """A pose that is mirrored, or turned against its heading."""
    if finding.remedy == "turned":
        return _framed(("heading",), f"{-finding.numbers['angle_deg']:.1f}deg", columns)
    return None if finding.remedy else _turned_about(finding.subject.split(), columns)


def _twist_frame(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """A twist in the frame of the room, or of a sensor that is mounted at an angle."""
    turned = finding.remedy == "turned"
    return _framed(("vx", "vy"), f"{finding.numbers['angle_deg']:.1f}deg" if turned else ROOM, columns)


def _lag(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """The later of two channels at the times when it happened; poses stay: how late they are, a controller needs."""
    if finding.numbers["late"] == "pose":
        return None
    late = finding.numbers["late"].split()
    return _later(
        [n for n in columns if n in late or component_channel(n) in late], abs(finding.numbers["seconds"]), columns
    )


def _filtered(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """Speeds that are late by what their differences reach back."""
    if finding.remedy != "backward":
        return None
    return _later(finding.subject.split(), finding.numbers["seconds_late"], columns)


def _later(names: list[str], seconds: float, columns: Mapping[str, Column]) -> Columns | None:
    if not names or any(name not in columns for name in names):
        return None
    delayed = {name: replace(columns[name], latency=round(columns[name].latency + seconds, 6)) for name in names}
    return {**columns, **delayed}


def _dead(finding: Finding, columns: Mapping[str, Column]) -> Columns | None:
    """Without a channel that was not recorded."""
    if finding.numbers.keys() & {"value", "source"}:  # a sensor to look at
        return None
    names = finding.subject.split()
    return {name: column for name, column in columns.items() if name not in names}


MENDS: Mapping[str, Callable[[Finding, Mapping[str, Column]], Columns | None]] = {
    "unit": _unit,
    "time_unit": lambda finding, columns: _unit(finding, columns) if "mistake" in finding.numbers else None,
    "inverted": _inverted,
    "swapped": _wired,
    "marker_angle": _marker,
    "pose_frame": _pose_frame,
    "twist_frame": _twist_frame,
    "lag": _lag,
    "filtered": _filtered,
    "dead": _dead,
}
