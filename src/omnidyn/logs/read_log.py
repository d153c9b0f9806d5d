"""Logs of any kind: a file, its columns guessed or given, in SI and by channel."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, overload

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.clocks import is_staggered
from omnidyn.errors import InputError, did_you_mean
from omnidyn.logs.channels import TIME, components, place
from omnidyn.logs.clock.clock import Clock
from omnidyn.logs.clock.counted_columns import Counters
from omnidyn.logs.clock.restarts import EPISODE, Restart
from omnidyn.logs.clock.row_rate import timed
from omnidyn.logs.clock.stamps import with_joined_stamp
from omnidyn.logs.column import Column
from omnidyn.logs.columns.frame_of import turn_to_body, with_frames
from omnidyn.logs.columns.guess import guess_columns, refuse_doubtful
from omnidyn.logs.columns.guess_time import refuse_second_time
from omnidyn.logs.columns.mapping import ColumnMap, component_channel, load_map, parse_column
from omnidyn.logs.joined_files import joined_table
from omnidyn.logs.log import Log
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.readers.reader import ReadOptions
from omnidyn.logs.table.dialect import split_unit
from omnidyn.logs.table.table import ROWS, FileTable
from omnidyn.model.frames import unwrapped
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import MIN_WHEELS, wheel_speed
from omnidyn.progress import Progress, silent
from omnidyn.run import CHANNELS, SCALAR, WHEEL, Run
from omnidyn.sensors import BEHIND_GEAR, COUNTED, TABLE
from omnidyn.statement import NOTE, Statement, statements

STANDSTILL_SPEED = 1e-6  # [rad/s] a commanded speed below counts as none


@dataclass(frozen=True)
class LogOptions:
    """How to read a log.

    columns: a map, used instead of a guess. overrides: component -> "COLUMN:UNIT[@motor]", on top of either.
    assume: column or letter of a component -> unit, where the file gives none. latency: component, or its letter, ->
    how late it was recorded [s]. header: whether there is one. skip_bad_rows: leave out rows that cannot be read.
    current_unsigned: currents are |i|; they get the sign of the commanded speed, or of the voltage. max_bytes: of what
    is held at once; None: a quarter of the memory. variables: of a MATLAB file, those to read; none: all.
    beside: other files of the same experiment, of one clock: joined by their stamps. rate: rows per second [1/s] of a
    file that has no time. gear_ratio: of a robot that has no file yet, for what was logged at the motor shaft.
    """

    columns: ColumnMap | None = None
    overrides: tuple[str, ...] = ()
    assume: Mapping[str, str] = field(default_factory=dict)
    latency: Mapping[str, float] = field(default_factory=dict)
    header: bool = True
    skip_bad_rows: bool = False
    current_unsigned: bool = False
    max_bytes: int | None = None
    variables: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    rate: float | None = None
    gear_ratio: float | None = None

    @property
    def of_tables(self) -> dict[str, Any]:
        """What the readers of tables are told."""
        return {
            "header": self.header,
            "skip_bad_rows": self.skip_bad_rows,
            "max_bytes": self.max_bytes,
            "variables": self.variables,
        }


@overload
def read_log(
    path: str | os.PathLike, robot: Robot | None = None, *, recorded: Literal[True], **options: Any
) -> Log: ...
@overload
def read_log(
    path: str | os.PathLike, robot: Robot | None = None, *, recorded: Literal[False] = False, **options: Any
) -> Run: ...
def read_log(  # pyright: ignore[reportInconsistentOverload]  it has the options by name
    path: str | os.PathLike,
    robot: Robot | None = None,
    *,
    recorded: bool = False,
    columns: ColumnMap | str | os.PathLike | Mapping[str, str] | None = None,
    assume: Mapping[str, str] | None = None,
    latency: Mapping[str, float] | None = None,
    sort: bool = False,
    header: bool = True,
    skip_bad_rows: bool = False,
    current_unsigned: bool = False,
    max_bytes: int | None = None,
    variables: Sequence[str] = (),
    beside: Sequence[str | os.PathLike] = (),
    rate: float | None = None,
) -> Run | Log:
    """Read a log as a Run, to fit, simulate and compare with; or as recorded, faults and all, for `check`.

    Columns are guessed from names and units, and what was guessed stands in the warnings of the Run.

    Args:
        path: The file, or the folder of a bag.
        robot: Settles what names leave open, and is needed for speeds of the motor shaft.
        recorded: Whether to return the Log, in SI and by channel: its time may repeat, go back or be missing, and
            `to_run` makes the Run of it.
        columns: A ColumnMap, the path of one (TOML), or overrides such as {"u1": "motor_1_volts:V"}.
        assume: Unit by column or letter of a component, where the file gives none, such as {"d": "duty/255"}.
        latency: How late components were recorded, by their letter [s].
        sort: Whether rows whose time goes back are sorted instead of refused.
        header: Whether there is one.
        skip_bad_rows: Whether to leave out rows that cannot be read.
        current_unsigned: Currents are |i|; they get the sign of the commanded speed, or of the voltage.
        max_bytes: Of what is held at once; None: a quarter of the memory.
        variables: Of a MATLAB file, those to read.
        beside: Other files of the same experiment, stamped by one clock: their topics and columns are joined by time.
        rate: Rows per second [1/s] of a file that has no time.

    Raises InputError for what cannot be read or is doubtful, with file, line and remedy.

    >>> import pathlib, tempfile
    >>> import omnidyn
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "log.csv")
    ...     _ = file.write_text("t_s,u1_V,u2_V,u3_V,vx_m_s\\n0.00,0,3,-3,0.00\\n0.02,0,3,-3,0.06\\n0.04,0,3,-3,0.12\\n")
    ...     run = omnidyn.read_log(file, omnidyn.load_robot("axebot"))
    >>> run.voltage.shape, run.twist[:, 0].tolist()
    ((3, 3), [0.0, 0.06, 0.12])
    """
    for name, given, example in (("assume", assume, {"d": "duty/255"}), ("latency", latency, {"w": 0.02})):
        if given is not None and not isinstance(given, Mapping):
            raise InputError("not a dictionary", got=repr(given), expected=f"one such as {example}", where=name)
    column_map = columns if isinstance(columns, ColumnMap) else None
    overrides: tuple[str, ...] = ()
    if isinstance(columns, Mapping):
        overrides = tuple(f"{component}={text}" for component, text in columns.items())
    elif columns is not None and column_map is None:
        column_map = load_map(columns)  # type: ignore[arg-type]
    options = LogOptions(
        column_map,
        overrides,
        assume or {},
        latency or {},
        header,
        skip_bad_rows,
        current_unsigned,
        max_bytes,
        tuple(variables),
        tuple(str(file) for file in beside),
        rate,
    )
    log = recorded_log(path, robot, options)
    if recorded:
        return log
    run = log.to_run(sort=sort)
    return run.replace(warnings=(*run.warnings, *log.columns.doubts))


def recorded_log(path: str | os.PathLike, robot: Robot | None = None, options: LogOptions | None = None) -> Log:
    """A log as recorded, faults and all, which is what `check` needs; `read_log` makes a Run of it, to work with.

    In SI and by channel; its time may repeat, go back or be missing. Raises InputError.
    """
    check_order("read_log(path, robot)", (path, (str, os.PathLike)), (robot, (Robot, type(None))))
    options = options or LogOptions()
    if options.beside and options.rate is not None:
        raise InputError("files without time cannot be joined by time", got="`rate` with files beside", expected="one")
    if options.beside:
        read_options = ReadOptions(
            options.header, options.skip_bad_rows, options.max_bytes, variables=options.variables
        )
        options_of_file = replace(options, overrides=())  # columns of the whole, which one file alone need not have
        table = joined_table(
            [path, *options.beside], read_options, lambda part: map_columns(part, None, options_of_file)
        )
    else:
        table = read_table(path, **options.of_tables)
        table = next(timed([with_joined_stamp(table)], options.rate, options.skip_bad_rows))
    return log_from_table(table, map_columns(table, robot, options), robot, options)


def map_columns(table: FileTable, robot: Robot | None, options: LogOptions) -> ColumnMap:
    """The map of a table: given or guessed, with the overrides on top. Raises InputError for a column it lacks."""
    columns, overrides = options.columns, dict(parse_column(text, table.names) for text in options.overrides)
    if options.rate is not None:
        refuse_second_time(table, options.assume, columns, overrides)
    if columns is None:
        columns = guess_columns(table, robot, options.assume, {column.name: key for key, column in overrides.items()})
    else:
        used_names = {column.name for column in columns.columns.values()}
        columns = replace(columns, unused=tuple(name for name in table.names if name not in used_names))
    columns = _delayed(_called_as_in(table, columns.with_columns(overrides)), options.latency)
    columns = with_frames(columns, options.assume)
    for component, column in columns.columns.items():
        if column.name not in table.names:
            raise InputError(
                f"the log has no column {column.name} for {component}",
                got=", ".join(table.names),
                expected="one of its columns",
                remedy=did_you_mean(f'"{column.name}"', [f'"{name}"' for name in table.names]),
                where=table.source,
            )
    refuse_doubtful(columns, table)
    return columns


def _called_as_in(table: FileTable, columns: ColumnMap) -> ColumnMap:
    """The map with columns called as in the table, where a name in it holds the unit of the header too: "x (in)"."""
    short = {
        key: replace(column, name=bare)
        for key, column in columns.columns.items()
        if column.name not in table.names and (bare := split_unit(column.name)[0]) in table.names
    }
    return columns.with_columns(short) if short else columns


def _delayed(columns: ColumnMap, latency: Mapping[str, float]) -> ColumnMap:
    """The map with latencies; "w" means every wheel's."""
    late: dict[str, Column] = {}
    for name, seconds in latency.items():
        keys = [key for key in columns.columns if name in (key, key.rstrip("0123456789"), component_channel(key))]
        if not keys or keys == [TIME]:
            raise InputError("no such channel to delay", got=name, expected=", ".join(columns.columns))
        late |= {key: replace(columns.columns[key], latency=seconds) for key in keys}
    return replace(columns, columns={**columns.columns, **late}) if late else columns


def log_from_table(
    table: FileTable, columns: ColumnMap, robot: Robot | None, options: LogOptions, clock: Clock | None = None
) -> Log:
    """The Log of a table under a map; `clock` has seen the blocks before this one.

    Raises InputError for text where numbers are needed, and for a robot with another number of wheels.
    """
    notes: list[Statement | str] = [*table.notes, *columns.notes]
    wheels = _wheel_count(columns, robot, table.source)
    if robot is not None and wheels > 1:
        wheels = robot.wheels.count
    clock = clock or Clock()
    restart_count = len(clock.restarts)
    t = clock.times(table, columns.columns[TIME], notes)
    episodes = [Restart(EPISODE, TIME, line) for line in table.begins]
    counters = Counters(table, t, [*episodes, *clock.restarts[restart_count:]])
    channels: dict[str, FloatArray] = {}
    for key, column in columns.columns.items():
        location = place(key)
        if location is None:
            continue
        values = table.measured(column.name, missing=True, skip=options.skip_bad_rows)
        if location[0] in COUNTED:
            values = counters.angle(key, column, values)
        if TABLE[location[0]].integral in COUNTED:
            values = counters.speed(key, column, values)
        values = values * column.factor
        if location[0] in BEHIND_GEAR:
            values = values / _divisor(column, key, robot or options.gear_ratio, location[1], table.source)
        width = len(components(location[0], wheels))
        channels.setdefault(location[0], np.full((len(table), width), np.nan))[:, location[1]] = values
    notes += _side_notes(columns, robot or options.gear_ratio)
    if "pose" in channels:
        channels["pose"][:, 2] = unwrapped(channels["pose"][:, 2])
    for name in [name for name in channels if CHANNELS[name] == SCALAR]:
        channels[name] = channels[name][:, 0]
    notes += turn_to_body(t, channels, columns, table.source)
    restarts = counters.restarts()
    notes += [restart.statement for restart in restarts if restart.where != TIME]
    log = Log(
        t,
        channels,
        table.lines,
        columns,
        table.source,
        table.sha256,
        False,
        statements(notes),
        table.own_clocks,
        tuple(restarts),
    )
    restart_rows = counters.beside_restarts()
    log = log.rows(~restart_rows) if restart_rows.any() else log
    log = _without_other_topics(log).joined()
    log = replace(log, own_clocks=log.own_clocks or is_staggered(log.t, log.channels.values()))
    return _signed(log, robot) if options.current_unsigned else log


def _side_notes(columns: ColumnMap, robot: Robot | float | None) -> list[Statement]:
    """What it means that speeds are those of the motor shaft, where neither a robot nor a number says the gear."""
    if robot is not None or not any(column.at_motor for column in columns.columns.values()):
        return []
    return [Statement("motor_side_without_robot", NOTE)]


def _without_other_topics(log: Log) -> Log:
    """The log without the rows of messages of topics that nobody took."""
    empty = log.empty_rows() if log.own_clocks else np.zeros(len(log), dtype=bool)
    return log.rows(~empty) if empty.any() and not empty.all() else log


def _wheel_count(columns: ColumnMap, robot: Robot | None, where: str) -> int:
    """Number of wheels that a log has columns of. Raises InputError where the robot has another number of wheels.

    Columns of wheels 1 to N, three or more, are those of a robot of N wheels; one or two may be motors on a bench, and
    currents those of some sensors.
    """
    located = [
        (location, key) for key in columns.columns if (location := place(key)) and CHANNELS[location[0]] == WHEEL
    ]
    count = max((index + 1 for (_, index), _ in located), default=0)
    if robot is None or not located:
        return count
    turning = {index for (channel, index), _ in located if channel != "current"}
    fewer = MIN_WHEELS <= len(turning) == count < robot.wheels.count
    if count > robot.wheels.count or fewer:
        raise InputError(
            f"the log has {'more' if count > robot.wheels.count else 'fewer'} wheels than the robot",
            got=f"{count} wheels",
            expected=f"{robot.wheels.count}, as {robot.name} has",
            where=where,
            remedy="name the robot of this log, or make its file with `omnidyn init`"
            + (
                "; where columns of a wheel were not found, say which they are: `column` "
                f"{located[-1][1][0]}{robot.wheels.count}=NAME:UNIT"
            )
            * fewer,
        )
    return count


def _divisor(column: Column, component: str, robot: Robot | float | None, wheel: int, where: str) -> float:
    """`Column.divisor` of a robot, or of its gear ratio alone; 1 before an unknown gear.

    Raises InputError for a rim without a robot.
    """
    if isinstance(robot, Robot):
        return column.divisor(robot, wheel)
    if column.of_rim:
        raise InputError(
            f"{component} is that of a rim: without its radius it is no angle",
            got=f"{column}, and no robot",
            expected="rad/s or rad, or a robot",
            remedy="name the robot, whose file has the radius",
            where=where,
        )
    return robot if robot is not None and column.at_motor else 1.0


def _signed(log: Log, robot: Robot | None) -> Log:
    """Currents of a sensor without sign, with the sign of the commanded speed, else of the voltage or duty."""
    if "current" not in log.channels:
        return log
    sign, origin = driven_way(log, robot)
    if sign is None or sign.shape != log.channels["current"].shape:
        raise InputError(
            "cannot give unsigned currents a sign",
            got=", ".join(log.channels),
            expected="a commanded speed of the wheels or of the body, a voltage or a duty",
            where=log.source,
        )
    current = np.abs(log.channels["current"]) * sign
    note = Statement("current_sign_taken", NOTE, "current", {"origin": origin})
    channels = {**log.channels, "current": current}
    return replace(log, channels=channels, current_unsigned=True, notes=(*log.notes, note))


def driven_way(log: Log, robot: Robot | None) -> tuple[FloatArray | None, str]:
    """(which way each motor is driven, -1, 0 or 1, shape (rows, wheels); what says so); (None, "") if nothing does."""
    speed = log.channels.get("wheel_speed_command")
    if speed is None and robot is not None and "twist_command" in log.channels:
        twist = log.channels["twist_command"]
        if np.isfinite(twist).any(axis=0).all():
            speed = wheel_speed(robot.wheels, twist)
    if speed is not None:
        return np.where(np.abs(speed) < STANDSTILL_SPEED, 0.0, np.sign(speed)), "commanded speed"
    for name in ("voltage", "duty"):
        if name in log.channels:
            return np.sign(log.channels[name]), name
    return None, ""


def iter_logs(
    path: str | os.PathLike,
    robot: Robot | None = None,
    options: LogOptions | None = None,
    *,
    rows: int = ROWS,
    progress: Progress = silent,
) -> Iterator[Log]:
    """The blocks of a log too long for memory, at most `rows` rows each, all under the map of the first.

    progress: hears how many bytes are done. Time counts from the first block. Raises InputError.
    """
    options, columns, clock = options or LogOptions(), None, Clock()
    tables = map(with_joined_stamp, iter_tables(path, rows, progress=progress, **options.of_tables))
    for table in timed(tables, options.rate, options.skip_bad_rows):
        columns = columns or map_columns(table, robot, options)
        yield log_from_table(table, columns, robot, options, clock)
