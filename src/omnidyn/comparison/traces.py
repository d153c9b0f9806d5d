"""Traces: measured and model side by side, one per piece of a log and component of a channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.replay import SET_SPEEDS
from omnidyn.logs.channels import components, place, si_suffix
from omnidyn.run import Run

COMPARED = ("twist", "wheel_speed", "wheel_angle", "current", "pose")
SINCE_START = ("wheel_angle", "pose")  # channels that count from where a piece begins
TURN = 2.0 * np.pi


class Trace(NamedTuple):
    """One component over one piece. t [s], measured and model in SI, shape (n,) each; NaN where missing."""

    t: FloatArray
    measured: FloatArray
    model: FloatArray

    @property
    def error(self) -> FloatArray:
        """Model minus measured. Shape (n,)."""
        return self.model - self.measured


def compared_components(run: Run, applied: str) -> tuple[str, ...]:
    """Components of a log that a replay predicts and that hold a number: ("vx", ..., "w1", ..., "i1", ..., "x", ...).

    The voltage counts where the speed loop of the model had to make it.
    """
    channels = (*COMPARED, "voltage") if applied in SET_SPEEDS else COMPARED
    present = []
    for channel in channels:
        values = getattr(run, channel)
        if values is not None:
            names = components(channel, values.shape[1])
            present += [name for name, column in zip(names, values.T, strict=True) if np.isfinite(column).any()]
    return tuple(present)


def trace_of(component: str, measured: Run, model: Run, rows: slice, current_unsigned: bool = False) -> Trace:
    """One component over some rows; NaN where its log has it not. A heading is compared without its turns.

    current_unsigned: whether currents are compared by size.
    """
    location = place(component)
    if location is None:
        raise KeyError(component)
    channel, column = location
    ours = np.asarray(getattr(model, channel))[rows, column]
    values = getattr(measured, channel)
    real = np.full(ours.shape, np.nan) if values is None else np.asarray(values)[rows, column]
    if component == "heading":
        real = unwrapped(real, ours)
    if channel == "current" and current_unsigned:
        real, ours = np.abs(real), np.abs(ours)
    return Trace(measured.t[rows], real, ours)


def unwrapped(measured: FloatArray, model: FloatArray) -> FloatArray:
    """Measured headings [rad] with the turns that keep them nearest to the model's path, from row to row.

    What is unwrapped is the difference: it changes slowly even where the robot turns fast or rows are missing.
    Both shape (n,); NaN stays. Returns shape (n,).
    """
    result, finite = measured.copy(), np.isfinite(measured) & np.isfinite(model)
    if not finite.any():
        return result
    error = np.unwrap(model[finite] - measured[finite])
    result[finite] = model[finite] - (error - TURN * np.round(error[0] / TURN))
    return result


def counts_from_start(component: str) -> bool:
    """Whether a component counts from where a piece begins: its level there was given to the model."""
    location = place(component)
    return location is not None and location[0] in SINCE_START


def unit(component: str) -> str:
    """SI unit of a component, such as rad/s."""
    return si_suffix(component).replace("_", "/")


# Errors as the test of whiteness sees them: without what the start of a free run was off by
#
# A start is measured, hence off by noise. Off in speed, it is forgotten within a few time constants: that stretch is
# left out. Off in pose, it stays: a shift and a turn of the whole path, which are taken off, as a shift is off the
# angle of a wheel. rmse and its kin keep both.

FORGOTTEN_AFTER = 0.6  # [s] four time constants of the robots known, about 0.15 s
FORGOTTEN_SHARE = 0.25  # of a piece is left out at most
PATH = ("x", "y")


def errors_for_whiteness(component: str, traces: Mapping[str, Sequence[Trace]]) -> list[FloatArray]:
    """Errors of one component, an array per piece, NaN where missing. traces: component -> pieces, same order."""
    if component in PATH and all(name in traces for name in PATH):
        along, pairs = PATH.index(component), zip(*(traces[name] for name in PATH), strict=True)
        return [_without_pose(settled(x), settled(y))[along] for x, y in pairs]
    errors = [settled(trace).error for trace in traces[component]]
    return [_centred(error) for error in errors] if counts_from_start(component) else errors


def settled(trace: Trace) -> Trace:
    """What comes after the start is forgotten."""
    if not len(trace.t):
        return trace
    skip = min(FORGOTTEN_AFTER, FORGOTTEN_SHARE * float(trace.t[-1] - trace.t[0]))
    first = int(np.searchsorted(trace.t, trace.t[0] + skip))
    return Trace(trace.t[first:], trace.measured[first:], trace.model[first:])


def _without_pose(x: Trace, y: Trace) -> tuple[FloatArray, FloatArray]:
    """Errors of a path after the shift and the small turn of the model that take off most, by least squares."""
    if len(x.t) != len(y.t):
        return _centred(x.error), _centred(y.error)
    error = np.stack([x.error, y.error])
    finite = np.isfinite(error).all(axis=0)
    if not finite.any():
        return x.error, y.error
    error = error - error[:, finite].mean(axis=1, keepdims=True)
    path = np.stack([x.model, y.model])
    path = path - path[:, finite].mean(axis=1, keepdims=True)
    turned = np.stack([-path[1], path[0]])
    power = float((turned[:, finite] ** 2).sum())
    turn = float((turned[:, finite] * error[:, finite]).sum()) / power if power > 0.0 else 0.0
    error = error - turn * turned
    return error[0], error[1]


def _centred(error: FloatArray) -> FloatArray:
    finite = np.isfinite(error)
    return error - error[finite].mean() if finite.any() else error
