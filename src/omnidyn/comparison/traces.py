"""Traces: measured and model side by side, one per piece of a log and component of a channel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.replay import SET_SPEEDS
from omnidyn.logs.channels import components, place, si_suffix
from omnidyn.run import Run
from omnidyn.sensors import COUNTED, FROM_START, PREDICTED

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
    channels = (*PREDICTED, "voltage") if applied in SET_SPEEDS else PREDICTED
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
    return location is not None and location[0] in FROM_START


def is_counted(component: str) -> bool:
    """Whether a component is an angle of a wheel, as encoders count it."""
    location = place(component)
    return location is not None and location[0] in COUNTED


def unit(component: str) -> str:
    """SI unit of a component, such as rad/s."""
    return si_suffix(component).replace("_", "/")
