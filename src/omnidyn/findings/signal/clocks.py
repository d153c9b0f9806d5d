"""The clocks of a log under check: its rows are the samples of one, and single channels are judged at their own.

Sensors that share no time stamps leave blanks in each other's rows: a row of the merged log is a sample of one sensor
only, and neither its steps nor its number say anything about a channel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck, Merged, SensorClock
from omnidyn.logs.channels import components, place
from omnidyn.logs.log import NEVER_MADE_UP, Log
from omnidyn.logs.segments import segments
from omnidyn.model.robot import Robot
from omnidyn.run import SENSORS

SHARED = 0.8  # of the samples of a clock: a component that has so many of them, and no others, is on it


def clocks_of(log: Log) -> tuple[SensorClock, ...]:
    """The clocks of a log in order of time, that of the wheels first; one where no component has its own."""
    groups: list[tuple[BoolArray, set[str]]] = []
    for name, column in _columns(log):
        row_mask = np.isfinite(column) if log.now_and_then(column) else np.ones(len(log), dtype=bool)
        index = next((k for k, (rows, _) in enumerate(groups) if _alike(rows, row_mask)), None)
        if index is None:
            groups.append((row_mask, {name}))
        else:
            groups[index] = (groups[index][0] | row_mask, {*groups[index][1], name})
    if not groups:
        return (SensorClock(np.arange(len(log)), frozenset()),)
    first = _leading(groups)
    ordered = [groups[first], *(group for k, group in enumerate(groups) if k != first)]
    # An input that a Run holds in every row keeps no stamps of its own: it is judged where the wheels were sampled.
    continuous = {
        name
        for rows, names in ordered[1:]
        if rows.all()
        for name in names
        if (at := place(name)) is not None and at[0] in NEVER_MADE_UP
    }
    ordered = [(rows, names | continuous if k == 0 else names - continuous) for k, (rows, names) in enumerate(ordered)]
    return tuple(SensorClock(np.flatnonzero(rows), frozenset(names)) for rows, names in ordered if names)


def _columns(log: Log) -> Iterator[tuple[str, FloatArray]]:
    """(component, values) of all that hold any number."""
    for channel, values in log.channels.items() if len(log) else ():
        columns = values.reshape(len(log), -1)
        for name, column in zip(components(channel, columns.shape[1]), columns.T, strict=True):
            if np.isfinite(column).any():
                yield name, column


def _alike(first: BoolArray, second: BoolArray) -> bool:
    """Whether the rows of one clock are those of another, a few missing ones apart."""
    common, fewer, longer = int((first & second).sum()), *sorted((int(first.sum()), int(second.sum())))
    return common == fewer >= SHARED * longer


def _leading(groups: list[tuple[BoolArray, set[str]]]) -> int:
    """The clock of the wheels' speeds, else of the next sensor, else the one with most rows."""
    for channel in SENSORS:
        for k, (rows, names) in enumerate(groups):
            if rows.sum() >= MIN_ROWS and any(place(name)[0] == channel for name in names):  # type: ignore[index]
                return k
    return int(np.argmax([rows.sum() for rows, _ in groups]))


def leading(log: Log, robot: Robot | None, rows: IntArray) -> LogUnderCheck:
    """A log in the rows of its leading clock. rows: of the log, in order of time, each time once."""
    merged = Merged(in_order := log.rows(rows), rows, clocks_of(in_order))
    return _in_rows(LogUnderCheck(log, robot, rows, in_order.t, 0.0, (), {}, merged=merged), merged.clocks[0])


def at_clock(work: LogUnderCheck, clock: SensorClock) -> LogUnderCheck:
    """The work in the rows of a clock; what is not on it is held, or on the line between two measurements."""
    return with_speed(_in_rows(work, clock))


def _in_rows(work: LogUnderCheck, clock: SensorClock) -> LogUnderCheck:
    assert work.merged is not None
    log, rows, clocks = work.merged
    t = log.t[clock.rows]
    # As in a Run: what is recorded on change is filled in, latencies that are known are taken out.
    filled = log.channels.items() if len(t) else ()
    channels = {name: log.aligned(name, values, [])[clock.rows] for name, values in filled}
    return replace(
        work,
        rows=rows[clock.rows],
        t=t,
        step=float(np.clip(usual_step(t), 1e-9, 1e9)) if len(t) > 1 else 0.0,
        segments=tuple(segments(t)) if len(t) else (),
        channels=channels,
        sampled=clock.components if len(clocks) > 1 else None,
    )


def with_speed(work: LogUnderCheck) -> LogUnderCheck:
    """Where angles of wheels were logged and no speed, the work with their differences as speed."""
    angle = work.get("wheel_angle")
    if angle is None or work.get("wheel_speed") is not None or len(work) < MIN_ROWS:
        return work
    speed = np.full(angle.shape, np.nan)
    for segment in work.segments:
        if segment.stop - segment.start > 2:
            speed[segment] = np.gradient(angle[segment], work.t[segment], axis=0)
    return work.replace(wheel_speed=speed)


def sampled_with(work: LogUnderCheck, channel: str, companions: Sequence[str]) -> LogUnderCheck:
    """The work in the rows of the clock of a channel; as it is where there is one clock, or some of the channels were
    mended since, and now differ from what was logged. companions: channels that are wanted beside it."""
    if work.merged is None or len(work.merged.clocks) == 1:
        return work
    first, *clocks = work.merged.clocks
    clocks_of_channel = [clock for clock in clocks if any(place(name)[0] == channel for name in clock.components)]  # type: ignore[index]
    logged, now = at_clock(work, first).channels, work.channels
    names = [name for name in (channel, *companions) if name in now]
    if not clocks_of_channel or not all(
        name in logged and np.array_equal(now[name], logged[name], True) for name in names
    ):
        return work
    return at_clock(work, clocks_of_channel[0])


def at_each_clock(
    work: LogUnderCheck, family: Callable[[LogUnderCheck], tuple[list[Finding], LogUnderCheck]]
) -> tuple[list[Finding], LogUnderCheck]:
    """The findings of a family that judges single channels, each at its own clock; the work without their faults."""
    findings, after = family(work)
    if work.merged is None or len(work.merged.clocks) == 1:
        return findings, after
    first, *other_clocks = work.merged.clocks
    log, _ = _put(work.merged.log, first, work, after)
    for clock in other_clocks:
        clock_work = at_clock(replace(after, merged=work.merged._replace(log=log)), clock)
        clock_work = clock_work.replace(
            **{name: None for name in clock_work.channels if name not in after.channels}
        )  # taken out before
        new_findings, judged = family(clock_work)
        log, changed_names = _put(log, clock, clock_work, judged)
        findings, after = findings + new_findings, _again(after, log, first, changed_names)
    return findings, replace(after, merged=work.merged._replace(log=log))


def _put(log: Log, clock: SensorClock, before: LogUnderCheck, after: LogUnderCheck) -> tuple[Log, frozenset[str]]:
    """(the log of all clocks with what a family changed in the components of one of them, those components)."""
    channels, changed_names = dict(log.channels), set()
    for name in clock.components:
        channel, k = place(name)  # type: ignore[misc]
        if channel not in before.channels or channel not in after.channels:
            continue
        old, new = (_column(work.channels, channel, k) for work in (before, after))
        if not np.array_equal(old, new, equal_nan=True):
            channels[channel] = channels[channel].copy()
            _column(channels, channel, k)[clock.rows] += new - old
            changed_names.add(name)
    return replace(log, channels=channels), frozenset(changed_names)


def _again(work: LogUnderCheck, log: Log, clock: SensorClock, changed_names: frozenset[str]) -> LogUnderCheck:
    """The work in the rows of its clock with some components of other clocks as they now are."""
    for channel, k in (place(name) for name in changed_names):  # type: ignore[misc]
        values = work.channels[channel].copy()
        now = log.aligned(channel, log.channels[channel], [])[clock.rows]
        _column({channel: values}, channel, k)[:] = _column({channel: now}, channel, k)
        work = work.replace(**{channel: values})
    return work


def _column(channels: Mapping[str, FloatArray], channel: str, k: int) -> FloatArray:
    """One component of a channel, a view into it."""
    values = channels[channel]
    return values if values.ndim == 1 else values[:, k]
