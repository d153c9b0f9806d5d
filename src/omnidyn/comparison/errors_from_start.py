"""Errors as the test of whiteness sees them: without what the start of a free run was off by.

A start is measured, hence off by noise. Off in speed, it is forgotten within a few time constants: that stretch is
left out. Off in pose, it stays: a shift and a turn of the whole path, which are taken off, as a shift is off the
angle of a wheel. rmse and its kin keep both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.traces import Trace, counts_from_start

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
