"""Replay: what a model does under the inputs of a log. A free run, started once per piece, never set back.

1. The input is the logged voltage; else the logged duty times the supply; else, where only set speeds were logged,
   what the speed loop of the robot file makes of them. It holds from its row to the next.
2. A log is replayed in pieces: nothing is integrated across a gap, nor where an input is missing for long. Each
   piece starts from the measured state (start.py).
3. Between the start and the end of a piece the model never sees what was measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.comparison.start import REST, start_of
from omnidyn.errors import InputError, InsufficientDataError, OmnidynError, did_you_mean
from omnidyn.logs.channels import components
from omnidyn.logs.segments import segments
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.sensors import CHANNELS, OUTPUTS, SHOWN, STARTS, WHEEL
from omnidyn.simulation.commands import Commands, commands
from omnidyn.simulation.engine import TOLERANCE
from omnidyn.simulation.simulate import simulate_seen
from omnidyn.simulation.view import View, seen_at_once, seen_through
from omnidyn.statement import NOTE, Statement
from omnidyn.statistics import stretches

INPUTS = ("voltage", "duty", "wheel_speed_command", "twist_command")
SET_SPEEDS = INPUTS[2:]
HOLD = 0.2  # [s] a missing input keeps its last value for so long
FEWEST_ROWS = 3  # rows of a piece
SHOWN_WARNINGS = 3  # warnings of one kind
FINEST, MOST_PARTS = 2.5e-3, 20  # [s] rows over which the angles of wheels are summed, and half their number in a row


@dataclass(frozen=True, eq=False)
class Replay:
    """A model under the inputs of a log.

    run: what it does, at the times of the log; NaN in the rows that no piece covers. pieces: the rows of each free run.
    applied: which channel drove it. driver: the same with its numbers. warnings: what a reader should know.
    """

    run: Run
    pieces: tuple[slice, ...]
    applied: str
    driver: Statement
    warnings: tuple[Statement, ...] = ()


def replay(
    robot: Robot,
    run: Run,
    *,
    apply: str | None = None,
    hold: float = HOLD,
    tol: float | None = TOLERANCE,
    log: LogEffects | None = None,
) -> Replay:
    """Simulate `robot` under what was applied in `run`, at the same times.

    apply: the channel to apply (voltage, duty, wheel_speed_command, twist_command); by default the first of these that
    was logged. hold: how long a missing input keeps its last value [s]; then the piece ends. tol: as in `simulate`.
    log: what the log does beside the robot; None: what the file of the robot says of this very log (`effects_of`).
    Raises InputError when the log does not fit the robot (number of wheels, no input, set speeds but no speed loop),
    InsufficientDataError when no stretch of it can be replayed.
    """
    try:
        refuse_other_robot(robot, run)
        applied = choose_input(robot, run, apply)
        pieces, inputs, supply, warnings = _prepared(run, applied, hold)
        log, notes = (log, []) if log is not None else effects_of(robot, run)
        parts = [_free_run(robot, run, rows, applied, inputs, supply, tol, log) for rows in pieces]
    except OmnidynError as error:
        raise error.at(run.source) if run.source else error from None
    warnings += [*_from_simulation(parts), *_loop_warnings(robot, run, applied, parts)]
    whole = _assembled(run, robot, pieces, [part for part, _ in parts])
    driver = _driver(robot, applied, supply is not None, log.words if log is not None else "")
    return Replay(whole, tuple(pieces), applied, driver, tuple([*warnings, *notes]))


def effects_of(robot: Robot, run: Run) -> tuple[LogEffects | None, list[Statement]]:
    """(what the file of the robot says of this log, None where it is another one; what is to be said of that)."""
    log = robot.log
    if log is None or log.is_of(run):
        return log, []
    if not log.words:
        return None, []
    return None, [Statement("effects_of_other_log", subject=robot.name, numbers={"effects": log.words})]


def refuse_other_robot(robot: Robot, run: Run) -> None:
    """Raises InputError when the log is of a robot with another number of wheels."""
    for name, values in run.channels.items():
        count = values.shape[1] if CHANNELS[name] == WHEEL else robot.wheels.count
        if count == 1:
            raise InputError(
                "a log of one motor cannot be compared with a robot",
                got=f"{name} of 1 motor",
                expected=f"{robot.wheels.count} wheels, as {robot.name} has",
                remedy="this is a motor bench: compare the log of the whole robot",
            )
        if count != robot.wheels.count:
            raise InputError(
                "the log is of another robot",
                got=f"{name} of {count} wheels",
                expected=f"{robot.wheels.count} wheels, as {robot.name} has",
                remedy="choose the robot of this log, or map the columns of its wheels",
            )


def choose_input(robot: Robot, run: Run, apply: str | None = None) -> str:
    """Which logged channel drives the model. Raises InputError when there is none that this robot takes."""
    inputs = [name for name in INPUTS if (values := getattr(run, name)) is not None and np.isfinite(values).any()]
    if apply is not None:
        _refuse_apply(apply, inputs)
    if not inputs:
        raise InputError(
            "the log has no input to replay",
            got=", ".join(run.channels) or "no channels",
            expected=" or ".join(INPUTS),
            remedy="map the columns of the motor voltages, duties or set speeds",
        )
    complete_inputs = [name for name in inputs if not _blank_components(run, name)]
    # A duty of 0 that coasts is an open circuit, which its voltage of 0 does not tell.
    choice = apply or (DUTY if robot.drive.coasts and DUTY in complete_inputs else [*complete_inputs, *inputs][0])
    blank = _blank_components(run, choice)
    if blank:
        raise InputError(
            f"{', '.join(blank)} was not recorded",
            got=f"{choice} without it",
            expected=f"an input for all {robot.wheels.count} wheels and axes of {robot.name}",
            remedy="choose the robot of this log, or map the columns that are missing",
        )
    if choice in SET_SPEEDS and robot.drive.kind != SPEED:
        raise InputError(
            "the log has set speeds only, and the robot no speed loop to follow them",
            got=f'[drive] kind = "{robot.drive.kind}" of {robot.name}',
            expected="a logged voltage or duty, or the speed loop of the firmware",
            remedy='map the voltages, or add [drive] kind = "speed", kp_V_s_rad, ki_V_rad, rate_Hz to the robot file',
        )
    return choice


def _refuse_apply(apply: str, inputs: list[str]) -> None:
    if apply in inputs:
        return
    problem = "the log does not hold this input" if apply in INPUTS else "no such input"
    remedy = did_you_mean(apply, inputs or INPUTS)
    raise InputError(problem, got=apply, expected=" or ".join(inputs or INPUTS), remedy=remedy, where="apply")


def _blank_components(run: Run, channel: str) -> list[str]:
    """The components of a channel that hold no number at all."""
    values = np.asarray(getattr(run, channel))
    names = components(channel, values.shape[1])
    return [name for name, column in zip(names, values.T, strict=True) if not np.isfinite(column).any()]


def _prepared(
    run: Run, applied: str, hold: float
) -> tuple[list[slice], FloatArray, FloatArray | None, list[Statement]]:
    """The pieces to run, the inputs and the supply with what is missing held, and what had to be left out."""
    inputs, no_supply = np.asarray(getattr(run, applied)), applied != DUTY or run.supply is None
    supply = None if no_supply or not np.isfinite(run.supply).any() else run.supply  # type: ignore[arg-type]
    table = inputs if supply is None else np.column_stack([inputs, supply])
    stretches = segments(run.t, usual=run.step)
    held_table, usable = np.empty_like(table), np.zeros(len(run), dtype=bool)
    for rows in stretches:
        held_table[rows], usable[rows] = held_inputs(run.t[rows], table[rows], hold)
    pieces = [piece for rows in stretches for piece in _usable_pieces(rows, usable)]
    long_pieces = [piece for piece in pieces if piece.stop - piece.start >= FEWEST_ROWS]
    if not long_pieces:
        raise InsufficientDataError(
            "nothing can be replayed",
            got=f"{len(pieces)} stretches with inputs, the longest too short",
            expected=f"{FEWEST_ROWS} rows in a row without a gap",
            remedy="look at the log with omnidyn check",
        )
    omitted = len(run) - sum(piece.stop - piece.start for piece in long_pieces)
    warnings = []
    if len(stretches) > 1:
        warnings.append(Statement("restarts_at_gaps", numbers={"gaps": len(stretches) - 1}))
    if omitted:
        warnings.append(Statement("rows_not_replayed", numbers={"left": omitted, "rows": len(run), "hold": hold}))
    width = inputs.shape[1]
    return long_pieces, held_table[:, :width], held_table[:, width] if supply is not None else None, warnings


def held_inputs(t: FloatArray, values: FloatArray, hold: float) -> tuple[FloatArray, BoolArray]:
    """Inputs with missing values (NaN) held, and which rows may be simulated from their start to the next row.

    A value holds over its row, and after that for at most `hold` [s] until another is known. t [s], shape (n,);
    values, shape (n, columns). Returns the same shape, and shape (n,); NaN stays where nothing is known.
    """
    rows = np.arange(len(t))
    finite_rows = np.where(np.isfinite(values), rows[:, None], -1)
    last = np.maximum.accumulate(finite_rows, axis=0)
    filled = np.where(last >= 0, np.take_along_axis(values, np.maximum(last, 0), axis=0), np.nan)
    ends = np.append(t[1:], t[-1])
    age = ends[:, None] - ends[last]
    return filled, ((last >= 0) & ((last == rows[:, None]) | (age <= hold))).all(axis=1)


def _usable_pieces(rows: slice, usable: BoolArray) -> Iterator[slice]:
    """The longest runs of rows whose inputs are known; the row after the last one belongs to it as its end."""
    inside = usable[rows.start : max(rows.start, rows.stop - 1)]
    for first, end in stretches(inside) + rows.start:
        yield slice(int(first), int(end) + 1)


def _free_run(
    robot: Robot,
    run: Run,
    rows: slice,
    applied: str,
    inputs: FloatArray,
    supply: FloatArray | None,
    tol: float | None,
    log: LogEffects | None,
) -> tuple[Run, str]:
    """One piece: simulated from its measured start to its end. Also returns where the start came from."""
    start = start_of(run, robot, rows)
    steps = slice(rows.start, rows.stop - 1)
    extra = {} if supply is None else {"supply": supply[steps]}
    current = None
    if run.current is not None and np.isfinite(run.current[rows.start]).all():
        current = run.current[rows.start]
    dt, twist = np.diff(run.t[rows]), start.twist
    applied_commands = _commands(robot, dt, applied, inputs[steps], extra)
    view = _view(robot, run, steps, applied_commands, log)
    simulated = simulate_seen(robot, applied_commands, view, twist=twist, pose=start.pose, current=current, tol=tol)
    if run.wheel_angle is not None:
        parts = 2 * min(int(np.ceil(dt.max() / (2.0 * FINEST))), MOST_PARTS)
        many = {name: np.repeat(values, parts, axis=0) for name, values in extra.items()}
        applied_commands = _commands(
            robot, np.repeat(dt / parts, parts), applied, np.repeat(inputs[steps], parts, axis=0), many
        )
        view = _view(robot, run, steps, applied_commands, log, parts, of_angles=True)
        fine = simulate_seen(robot, applied_commands, view, twist=twist, pose=np.zeros(3), current=current, tol=tol)
        simulated = simulated.replace(wheel_angle=start.angle + _turned(fine, parts))
    return simulated, start.source


def _commands(robot: Robot, dt: FloatArray, applied: str, inputs: FloatArray, extra: dict[str, FloatArray]) -> Commands:
    """The logged inputs as commands."""
    channels = dict.fromkeys((*INPUTS, "supply")) | {applied: inputs} | extra
    return commands(
        robot,
        channels["voltage"],
        dt,
        channels["duty"],
        channels["wheel_speed_command"],
        channels["twist_command"],
        channels["supply"],
    )


def _view(
    robot: Robot,
    run: Run,
    steps: slice,
    applied_commands: Commands,
    log: LogEffects | None,
    parts: int = 1,
    of_angles: bool = False,
) -> View:
    """What a log shows of a piece, whose rows are `steps`. parts: steps of the simulation in a row.

    The start was measured by the first of the channels in OUTPUTS: the run begins by so much earlier as that is late.
    of_angles: wheel speeds are wanted as late as the angles that they add up to.
    """
    moving = applied_commands.set_point is None  # a speed loop rests before its first command
    if log is None:
        return seen_at_once(robot, applied_commands, held=moving)
    t, drive, row = run.t, robot.drive.latency, run.step
    late = {name: log.latency.of(name, drive, row) for name in OUTPUTS}
    if of_angles:
        late["wheel_speed"] = late["wheel_angle"]
    share = np.repeat((t[steps] - t[0]) / (t[-1] - t[0]), parts)
    return seen_through(robot, applied_commands, log, late, share, late[_first(run)] if moving else None)


def _first(run: Run) -> str:
    """The channel that tells where a free run of this log starts."""
    channels = {name for name in OUTPUTS if getattr(run, name, None) is not None}
    if run.pose is not None:
        channels |= {"heading"} if np.isfinite(run.pose[:, 2]).any() else {"position"}
    return next((name for name in STARTS if name in channels), STARTS[0])


def _turned(fine: Run, parts: int) -> FloatArray:
    """Angles that the wheels turn by [rad], by Simpson's rule over `parts` rows for one of the log. Shape (rows, n)."""
    assert fine.wheel_speed is not None
    rule = np.where(np.arange(parts + 1) % 2, 4.0, 2.0) / 3.0
    rule[[0, -1]] = 1.0 / 3.0
    first = np.arange(0, len(fine) - 1, parts)
    speeds = fine.wheel_speed[first[:, None] + np.arange(parts + 1)]
    steps = np.einsum("p,kpw->kw", rule, speeds) * np.diff(fine.t)[first, None]
    return np.vstack([np.zeros(speeds.shape[2]), np.cumsum(steps, axis=0)])


def _assembled(run: Run, robot: Robot, pieces: list[slice], parts: list[Run]) -> Run:
    """One Run at the times of the log, NaN between the pieces."""
    channels: dict[str, Any] = {}
    for name in SHOWN:
        if getattr(parts[0], name) is None:
            continue
        width = robot.wheels.count if CHANNELS[name] == WHEEL else 3
        column = np.full((len(run), width), np.nan)
        for rows, part in zip(pieces, parts, strict=True):
            column[rows] = getattr(part, name)
        channels[name] = column
    return Run(t=run.t, **channels, source=f"replay of {run.source or 'a run'}: {parts[0].source}")


def _from_simulation(parts: list[tuple[Run, str]]) -> list[Statement]:
    """What the simulations warned of, by piece, and starts that were assumed."""
    warnings = [
        warning.of(f"piece {k + 1}") if len(parts) > 1 else warning
        for k, (part, _) in enumerate(parts)
        for warning in part.warnings
    ]
    surplus = len(warnings) - SHOWN_WARNINGS
    ellipsis = [Statement("more_warnings", numbers={"more": surplus})] if surplus > 0 else []
    assumed = sum(source == REST for _, source in parts)
    starts = [Statement("start_assumed", numbers={"assumed": assumed, "pieces": len(parts)})] if assumed else []
    return [*warnings[:SHOWN_WARNINGS], *ellipsis, *starts]


def _loop_warnings(robot: Robot, run: Run, applied: str, parts: list[tuple[Run, str]]) -> list[Statement]:
    """What a log does not tell about the speed loop in the firmware."""
    warnings, drive = [], robot.drive
    if drive.kind != SPEED:
        return warnings
    moving = sum(bool(np.any(part.twist[0])) for part, _ in parts if part.twist is not None)
    if applied in SET_SPEEDS and moving and np.any(np.asarray(drive.ki) > 0.0):
        warnings.append(Statement("integral_not_logged", numbers={"pieces": moving}))
    if applied == "voltage" and run.step * (drive.rate or 0.0) > 1.5:
        periods = {"loop_period": 1.0 / (drive.rate or 1.0), "log_period": run.step}
        warnings.append(Statement("loop_faster_than_log", numbers=periods))
    return warnings


def _driver(robot: Robot, applied: str, supply_logged: bool, effects: str) -> Statement:
    """What was applied, and what the driver of the robot file does to it. effects: of the log, in words of the fit."""
    drive = robot.drive
    numbers: dict[str, Any] = {"dead_band": drive.dead_band, "latency": drive.latency, "effects": effects}
    if applied == DUTY:
        numbers |= {"supply": None if supply_logged else drive.supply}
    if applied in SET_SPEEDS:
        numbers |= {"kp": np.atleast_1d(drive.kp), "ki": np.atleast_1d(drive.ki), "rate": drive.rate}
    return Statement("applied", NOTE, applied, numbers)
