"""A run as a fit has read it: what the nuisances say the log does to the model is undone, so as to compare it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.problem.nuisances import LATENCY, TILT
from omnidyn.identification.output_error.problem.primitives import primitives
from omnidyn.identification.output_error.problem.record import record
from omnidyn.logs.segments import segments
from omnidyn.model.actuation import Driver, at_motors
from omnidyn.model.frames import AXES
from omnidyn.model.keys import GAINS, Key
from omnidyn.model.robot import Robot
from omnidyn.run import Run

LATE = ("twist", "wheel_speed", "current", "heading", "position", "wheel_angle")  # the first late one sets the clock
POSE = ("heading", "position")


def as_fitted(run: Run, fit: OutputErrorEstimate) -> Run:
    """The run with the voltage that reached the motors and with channels moved back by their latency.

    Without nuisances it is the run itself. With a latency the clock is that of the first late channel, whose samples
    are left as they are; a voltage that changes within a row is the mean over it, and other channels are interpolated
    by what they differ. At 100 Hz the mean is off by less than 1 % of what one row changes. A tilt becomes the volts
    that push as hard; currents do not follow it. Speeds that were fitted as the angles that they add up to are means
    over the row before, which are half a row late.
    """
    values = {name: nuisance.value for name, nuisance in fit.nuisances.items()}
    late = _late(run, fit, values)
    if not values and not late:
        return run
    read = record(run, fit.robot, loop=any(Key.parse(key).name in GAINS for key in fit.value))
    if read.set_point is not None:
        return _set_points_as_fitted(run, read.set_point, late, fit)
    driver = Driver(**{name: values[name] for name in Driver._fields if name in values})
    voltage = at_motors(read.voltage, read.share, driver)[0] + pushing(fit.robot, values)
    if not any(late.values()):
        return run.replace(voltage=voltage, duty=None, supply=None)
    main = _main(late)
    parts = segments(run.t)
    moved = np.concatenate([mean_before(run.t[rows], voltage[rows], main) for rows in parts])
    return run.replace(
        t=run.t - main, voltage=moved, duty=None, supply=None, **_moved(run, late, main, parts),
        warnings=(*run.warnings, _note(main, run, fit)),
    )  # fmt: skip


def _late(run: Run, fit: OutputErrorEstimate, values: Mapping[str, float]) -> dict[str, float]:
    """Channel -> by how much it is late [s], as far as the fit tells."""
    late = {name: values[f"{LATENCY}.{name}"] for name in LATE if f"{LATENCY}.{name}" in values}
    if _added_up(run, fit):
        late["wheel_speed"] = late.get("wheel_angle", 0.0) + 0.5 * float(np.median(np.diff(run.t)))
    return late


def _added_up(run: Run, fit: OutputErrorEstimate) -> bool:
    """Whether the wheel speeds of such a run were fitted as the angles that they add up to."""
    as_angles = any(name.startswith("wheel_angle") for name in fit.noise)
    return as_angles and run.wheel_angle is None and run.wheel_speed is not None and len(run) > 1


def _main(late: Mapping[str, float]) -> float:
    """What the clock is late by."""
    return next(late[name] for name in LATE if name in late)


def _moved(run: Run, late: Mapping[str, float], main: float, parts: list[slice]) -> dict[str, FloatArray]:
    """The channels moved back by their latency, to rows that are `main` late."""
    found = {
        name: _shifted(run.t, own, late.get(name, 0.0) - main, parts)
        for name in LATE if name not in POSE and (own := getattr(run, name)) is not None
    }  # fmt: skip
    if run.pose is not None:
        by = [late.get(name, 0.0) - main for name in ("position", "position", "heading")]
        found["pose"] = np.hstack([_shifted(run.t, run.pose[:, [k]], each, parts) for k, each in enumerate(by)])
    return found


def _note(main: float, run: Run, fit: OutputErrorEstimate) -> str:
    words = f"channels were moved back by the fitted latency of {main:.4g} s"
    return f"{words}, which has half a row of speeds that are differences of counts" if _added_up(run, fit) else words


def pushing(robot: Robot, values: Mapping[str, float]) -> FloatArray:
    """The least volts that push as hard as the fitted tilt; shape (wheels,)."""
    now, force = primitives(robot), np.array([values.get(f"{TILT}.{axis}", 0.0) for axis in AXES])
    if not force.any():
        return np.zeros(robot.wheels.count)
    return np.asarray(np.linalg.lstsq(now.drive, now.per_force * force, rcond=None)[0], dtype=float)


def _set_points_as_fitted(run: Run, set_point: FloatArray, late: Mapping[str, float], fit: OutputErrorEstimate) -> Run:
    """The same where a speed loop makes the voltage: before the first row it had nothing to follow."""
    main = _main(late) if late else 0.0
    parts = segments(run.t)
    moved = np.concatenate([mean_before(run.t[rows], set_point[rows], main, 0.0) for rows in parts])
    return run.replace(
        t=run.t - main, voltage=None, duty=None, supply=None, twist_command=None, wheel_speed_command=moved,
        **_moved(run, late, main, parts), warnings=(*run.warnings, _note(main, run, fit)),
    )  # fmt: skip


def mean_before(t: FloatArray, voltage: FloatArray, late: float, before: float = 1.0) -> FloatArray:
    """Mean of a held voltage over each step of the clock t - late; before the first row its voltage, as after the last.

    t [s], shape (rows,); voltage, shape (rows, wheels). before: share of the first voltage that is held before it.
    """
    if len(t) < 2:
        return voltage
    edges = np.concatenate([t - late, [2.0 * t[-1] - t[-2] - late]])
    total = np.vstack([np.zeros(voltage.shape[1]), np.cumsum(voltage[:-1] * np.diff(t)[:, None], axis=0)])
    summed = np.stack(
        [_extended(edges, t, total[:, k], voltage[:, k], before) for k in range(voltage.shape[1])], axis=1
    )
    return np.diff(summed, axis=0) / np.diff(edges)[:, None]


def _extended(at: FloatArray, t: FloatArray, total: FloatArray, voltage: FloatArray, before: float) -> FloatArray:
    """The integral of a held voltage at any time."""
    inside = np.interp(at, t, total)
    return inside + np.minimum(at - t[0], 0.0) * before * voltage[0] + np.maximum(at - t[-1], 0.0) * voltage[-1]


def _shifted(t: FloatArray, values: FloatArray, by: float, parts: list[slice]) -> FloatArray:
    """values at t + by, between its rows on a line; NaN outside of each piece, and a row or more from what is known."""
    if not by:
        return values
    moved = np.full(values.shape, np.nan)
    for rows in parts:
        for k in range(values.shape[1]):
            known = np.isfinite(values[rows, k])
            if known.any():
                moved[rows, k] = _on_lines(t[rows], t[rows][known], values[rows, k][known], by)
    return moved


def _on_lines(t: FloatArray, at: FloatArray, values: FloatArray, by: float) -> FloatArray:
    """What was measured `at` some of the times t, at t + by; NaN inside of lines longer than a row."""
    after = np.clip(np.searchsorted(at, t + by), 1, max(len(at) - 1, 1))
    gap = at[np.minimum(after, len(at) - 1)] - at[after - 1]
    nearest = np.minimum(np.abs(t + by - at[after - 1]), np.abs(t + by - at[np.minimum(after, len(at) - 1)]))
    row = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    found = np.interp(t + by, at, values, left=np.nan, right=np.nan)
    return np.where((gap > 1.5 * row) & (nearest > 0.5 * row), np.nan, found)
