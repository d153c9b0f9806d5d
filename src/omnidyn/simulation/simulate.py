"""simulate: robot and voltages in, Run out."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.motor import clip_voltage
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.exact import simulate_exact, why_not_exact

FloatArray = NDArray[np.float64]
MIN_DT, MAX_DT = 1e-9, 3600.0


def simulate(
    robot: Robot,
    voltage: ArrayLike,
    dt: ArrayLike,
    *,
    twist: ArrayLike = (0.0, 0.0, 0.0),
    pose: ArrayLike = (0.0, 0.0, 0.0),
) -> Run:
    """Simulate a robot exactly under voltages held from step to step, eqs (1)-(14).

    voltage: one row per step [V], shape (n, wheels); what exceeds the motor's limit is clipped, with a warning.
    dt: length of the steps [s], a number or shape (n,). twist, pose: where it starts, shape (3,).
    Returns a Run of n + 1 samples: t, voltage (the last row repeats), current, wheel_speed, twist, pose.
    A robot at rest within its dead zone has a twist of exactly 0.0.
    Raises InputError for wrong shapes, NaN or infinite values, or dt outside 1e-9..3600 s, and UnsupportedError,
    by name, for what this version has no engine for.
    """
    refuse_unsupported(robot)
    wanted, dt = _checked_inputs(robot, voltage, dt)
    applied = clip_voltage(robot.motor, wanted)
    twists, poses = simulate_exact(robot, applied, dt, _start("twist", twist), _start("pose", pose))
    return _run(robot, applied, dt, twists, poses, _clipping(wanted, applied))


def refuse_unsupported(robot: Robot) -> None:
    """Raises UnsupportedError when no engine can simulate this robot; it names every reason."""
    reasons = why_not_exact(robot)
    if reasons:
        raise UnsupportedError(
            f"cannot simulate {robot.name} yet", got="; ".join(reasons),
            expected="what the exact engine can do", remedy="switch it off in the robot file, or use a later version",
        )


def _checked_inputs(robot: Robot, voltage: ArrayLike, dt: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Voltage of shape (n, wheels) and dt of shape (n,), finite and in range."""
    volts, steps = as_floats("voltage", voltage), as_floats("dt", dt)
    if volts.ndim != 2 or volts.shape[1] != robot.wheels.count or not len(volts):
        raise InputError("wrong shape", got=volts.shape, expected=f"(n, {robot.wheels.count}), n >= 1", where="voltage")
    if steps.ndim > 1 or (steps.ndim == 1 and len(steps) != len(volts)):
        raise InputError("wrong shape", got=steps.shape, expected=f"a number or ({len(volts)},)", where="dt")
    bad = np.flatnonzero(~np.isfinite(volts).all(axis=1))
    if bad.size:
        raise InputError("not a finite number", got=list(volts[bad[0]]), expected="volts", where=f"voltage row {bad[0]}")
    steps = np.ascontiguousarray(np.broadcast_to(steps, (len(volts),)))
    bad = np.flatnonzero(~((steps >= MIN_DT) & (steps <= MAX_DT)))
    if bad.size:
        raise InputError(
            "step out of range", got=float(steps[bad[0]]), expected=f"{MIN_DT:g} to {MAX_DT:g} s",
            where=f"dt row {bad[0]}",
        )
    return volts, steps


def as_floats(name: str, value: ArrayLike) -> FloatArray:
    """A float64 array; raises InputError for what is not numbers."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError("not numbers", got=value, expected="an array of numbers", where=name) from None


def _start(name: str, value: ArrayLike) -> FloatArray:
    array = as_floats(name, value)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError("cannot start there", got=value, expected="three finite numbers", where=name)
    return array


def _clipping(wanted: FloatArray, applied: FloatArray) -> tuple[str, ...]:
    rows = np.flatnonzero((wanted != applied).any(axis=1))
    if not rows.size:
        return ()
    return (f"voltage beyond the limit was clipped in {rows.size} of {len(wanted)} rows, first in row {rows[0]}",)


def _run(
    robot: Robot, applied: FloatArray, dt: FloatArray, twists: FloatArray, poses: FloatArray, warnings: tuple[str, ...]
) -> Run:
    """The Run of a simulation: what the instruments of an ideal robot would have recorded."""
    equal = bool(np.all(dt == dt[0]))
    t = np.arange(len(dt) + 1) * dt[0] if equal else np.concatenate([[0.0], np.cumsum(dt)])
    held = np.concatenate([applied, applied[-1:]])
    return Run(
        t=t,
        voltage=held,
        current=settled_currents(robot, twists, held),
        wheel_speed=wheel_speed(robot.wheels, twists),
        twist=twists,
        pose=poses,
        source=f"simulated: {robot.name}, exact engine",
        warnings=warnings,
    )
