"""From commands to what the motors get: volts, a duty of the supply, or set points of a speed loop in the firmware."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.model.actuation import clip_voltage, voltage_of_duty
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.statement import WARNING, Statement

MIN_DT, MAX_DT = 1e-9, 3600.0
SAME_TIME = 1e-4  # of a tick: times that are nearer are one, for the times of a log have six decimals or so


class Commands(NamedTuple):
    """What is applied, row by row; each row holds for its dt. Shapes (n,), (n, wheels).

    voltage: None while a speed loop makes it. open_circuit: motors that coast. set_point: wheel speeds [rad/s] of a
    speed loop. duty, twist, supply: what was commanded, for the record.
    """

    dt: FloatArray
    voltage: FloatArray | None
    open_circuit: BoolArray | None = None
    set_point: FloatArray | None = None
    duty: FloatArray | None = None
    twist: FloatArray | None = None
    supply: FloatArray | None = None
    warnings: tuple[Statement, ...] = ()


def commands(
    robot: Robot,
    voltage: ArrayLike | None,
    dt: ArrayLike | None,
    duty: ArrayLike | None,
    wheel_speed_command: ArrayLike | None,
    twist_command: ArrayLike | None,
    supply: ArrayLike | None,
) -> Commands:
    """Check what was asked for and bring it into one form. Exactly one kind of command must be given.

    Raises InputError for wrong shapes, values that are not finite, dt out of range, or a kind the drive cannot take.
    """
    inputs = {
        "voltage": voltage,
        "duty": duty,
        "wheel_speed_command": wheel_speed_command,
        "twist_command": twist_command,
    }
    name = only_command(inputs, dt)
    assert dt is not None
    width = 3 if name == "twist_command" else robot.wheels.count
    rows = as_floats(name, inputs[name])
    if rows.ndim != 2 or rows.shape[1] != width or not len(rows):
        raise InputError("wrong shape", got=rows.shape, expected=f"(n, {width}), n >= 1", where=name)
    bad_rows = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if bad_rows.size:
        raise InputError(
            "not a finite number", got=rows[bad_rows[0]].tolist(), expected="numbers", where=f"{name} row {bad_rows[0]}"
        )
    steps = _steps(dt, len(rows))
    if name == "voltage":
        applied = clip_voltage(robot.motor, rows)
        return Commands(steps, applied, warnings=_clipped("voltage", rows != applied))
    if name == "duty":
        return _from_duty(robot, rows, steps, supply)
    if robot.drive.kind != SPEED:
        raise InputError(
            f"the drive of {robot.name} takes no {name}",
            got=f'[drive] kind = "{robot.drive.kind}"',
            expected='kind = "speed"',
            remedy="add the gains and the rate of its speed loop to the robot file",
        )
    if name == "twist_command":
        return Commands(steps, None, set_point=wheel_speed(robot.wheels, rows), twist=rows)
    return Commands(steps, None, set_point=rows)


def only_command(inputs: Mapping[str, ArrayLike | None], dt: ArrayLike | None) -> str:
    """The name of the one command that was given. Raises InputError for none, for several, and without dt."""
    names = [name for name, value in inputs.items() if value is not None]
    if len(names) != 1 or dt is None:
        raise InputError(
            "cannot tell what to apply",
            got=" and ".join(names) or "no command",
            expected=f"one of {', '.join(inputs)}, and dt",
        )
    return names[0]


def _from_duty(robot: Robot, rows: FloatArray, steps: FloatArray, supply: ArrayLike | None) -> Commands:
    """voltage = duty * supply; a duty of 0 shorts the motor, or opens it where the drive coasts."""
    if supply is None:
        supply = robot.drive.supply
    if supply is None:
        raise InputError(
            "a duty needs a supply",
            got="no supply",
            expected="supply= or [drive] supply_V",
            remedy='add [drive] kind = "duty" and supply_V to the robot file',
        )
    battery = as_floats("supply", supply)
    if battery.shape not in ((), (len(rows),)) or not np.all(np.isfinite(battery) & (battery > 0.0)):
        raise InputError("cannot use this supply", got=supply, expected=f"positive volts, one or {len(rows)}")
    battery = np.broadcast_to(battery, (len(rows),))
    duty = np.clip(rows, -1.0, 1.0)
    applied = voltage_of_duty(duty, battery)
    limited = clip_voltage(robot.motor, applied)
    coasts = (duty == 0.0) if robot.drive.coasts else None
    warnings = _clipped("duty", rows != duty) + _clipped("voltage", applied != limited)
    return Commands(steps, limited, open_circuit=coasts, duty=duty, supply=battery, warnings=warnings)


def on_ticks(
    robot: Robot, held_commands: Commands, now: float = 0.0
) -> tuple[FloatArray, FloatArray, BoolArray, NDArray[np.intp]]:
    """A speed loop's own time grid: rows that begin `now` [s] after a tick, cut at its ticks.

    Returns (dt, set point, whether the loop runs at the start of the row, index where each original row begins, and
    the end). A command counts from the first tick at or after its start, as in a firmware that polls.
    """
    assert held_commands.set_point is not None
    if len(held_commands.dt) == 1:
        return _one_on_ticks(robot, held_commands.set_point, now, float(held_commands.dt[0]))
    edges = row_edges(held_commands.dt)
    period = 1.0 / (robot.drive.rate or np.inf)
    first, end = (math.ceil(time / period - SAME_TIME) for time in (now, now + float(edges[-1])))
    ticks = np.arange(first, end) * period - now
    after = np.minimum(np.maximum(edges.searchsorted(ticks), 1), len(edges) - 1)
    nearest = np.where(np.abs(edges[after] - ticks) < np.abs(edges[after - 1] - ticks), after, after - 1)
    snapped = np.where(np.abs(edges[nearest] - ticks) <= SAME_TIME * period, edges[nearest], ticks)
    times = np.sort(np.concatenate((edges, snapped)))
    grid = times[np.concatenate(([True], times[1:] != times[:-1]))]
    keep, begins = grid.searchsorted(edges), np.zeros(len(grid), np.bool_)
    begins[grid.searchsorted(snapped)] = True
    return np.diff(grid), held_commands.set_point.repeat(np.diff(keep), axis=0), begins[:-1], keep


def _one_on_ticks(
    robot: Robot, set_point: FloatArray, now: float, length: float
) -> tuple[FloatArray, FloatArray, BoolArray, NDArray[np.intp]]:
    """`on_ticks` of a single row, in a tenth of the time: a live robot asks for it at every step."""
    period = 1.0 / (robot.drive.rate or np.inf)
    first, end = (math.ceil(time / period - SAME_TIME) for time in (now, now + length))
    ticks = [tick * period - now for tick in range(first, end)]
    at_once = bool(ticks) and abs(ticks[0]) <= SAME_TIME * period
    times = [0.0, *(ticks[1:] if at_once else ticks), length]
    begins = np.ones(len(times) - 1, np.bool_)
    begins[0] = at_once
    grid = np.array(times)
    return grid[1:] - grid[:-1], set_point.repeat(len(begins), axis=0), begins, np.array([0, len(begins)])


def row_edges(dt: FloatArray) -> FloatArray:
    """When rows of these lengths [s] begin, and the last one ends. Equal rows do not add up their rounding errors."""
    if len(dt) and (dt == dt[0]).all():
        return np.arange(len(dt) + 1) * dt[0]
    return np.concatenate(([0.0], np.cumsum(dt)))


def phase(robot: Robot, now: float) -> float:
    """How long ago a speed loop last ticked [s], `now` after any of its ticks: no rounding errors add up."""
    period = 1.0 / (robot.drive.rate or np.inf)
    return now - math.floor(now / period + SAME_TIME) * period


def loop_gains(robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(kp [V s/rad], ki [V/rad], voltage limit [V], wheel radius [m]) of each wheel. Shape (wheels,) each."""
    n, drive = robot.wheels.count, robot.drive
    return per_wheel(drive.kp, n), per_wheel(drive.ki, n), per_wheel(robot.motor.voltage_limit, n), robot.wheels.radii


def _steps(dt: ArrayLike, count: int) -> FloatArray:
    """dt as one positive length per row."""
    steps = as_floats("dt", dt)
    if steps.ndim > 1 or (steps.ndim == 1 and len(steps) != count):
        raise InputError("wrong shape", got=steps.shape, expected=f"a number or ({count},)", where="dt")
    steps = np.array(np.broadcast_to(steps, (count,)))  # writable: kernels are compiled once for it
    bad_rows = np.flatnonzero(~((steps >= MIN_DT) & (steps <= MAX_DT)))
    if bad_rows.size:
        raise InputError(
            "step out of range",
            got=float(steps[bad_rows[0]]),
            expected=f"{MIN_DT:g} to {MAX_DT:g} s",
            where=f"dt row {bad_rows[0]}",
        )
    return steps


def as_floats(name: str, value: ArrayLike | None) -> FloatArray:
    """A float64 array; raises InputError for what is not real numbers."""
    try:
        given = np.asarray(value)
        if given.dtype.kind in "bc":
            raise TypeError
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError("not numbers", got=value, expected="an array of real numbers", where=name) from None


def _clipped(name: str, mask: BoolArray) -> tuple[Statement, ...]:
    """The warning that values were clipped; none where nothing changed."""
    rows = np.flatnonzero(mask.any(axis=1))
    if not rows.size:
        return ()
    return (Statement("clipped", WARNING, name, {"clipped": rows.size, "rows": len(mask), "first": int(rows[0])}),)


def current_bounds(robot: Robot, held_commands: Commands, rows: int) -> FloatArray:
    """What the current of each motor may not exceed [A]: its limit, or 0 while it coasts. Shape (rows, wheels)."""
    limit = robot.motor.current_limit
    bound = np.full((rows, robot.wheels.count), np.inf if limit is None else limit, dtype=float)
    if held_commands.open_circuit is not None:
        bound[held_commands.open_circuit] = 0.0
    return bound
