"""Single values far away from both neighbours, judged by the rows in which a channel was recorded."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import INPUTS, MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.robust import quantum, sample, spread
from omnidyn.logs.channels import place
from omnidyn.statement import WARNING
from omnidyn.statistics import robust_std

MEASURED = ("current", "wheel_speed", "wheel_angle", "twist", "pose", "supply")
SPIKE = 10.0  # a single value so many times the noise away from both its neighbours


def check_spikes(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Single values (or two) far away from both neighbours, which agree with each other."""
    found = []
    changed = _changed(work)
    for channel in MEASURED:
        for component, values in work.sampled_columns(channel):
            k = place(component)[1]  # type: ignore[index]
            own = work.recorded(channel, k)
            bad = np.zeros(len(work), dtype=bool)
            bad[own] = _isolated(values[own]) & ~_kicked(changed[own])
            if not bad.any() or bad.mean() > 0.2:
                continue
            worst = int(np.flatnonzero(bad)[np.argmax(np.abs(values[bad] - np.nanmedian(values)))])
            found.append(Finding(
                "spike", WARNING, component,
                {"farthest": float(values[worst]), "share": float(bad.mean()), "at_s": float(work.t[worst])},
                rows=work.lines(bad), count=int(bad.sum()),
            ))  # fmt: skip
            work = work.masked(channel, k, bad)
    return found, work


def _changed(work: LogUnderCheck) -> IntArray:
    """How often a command has changed up to each row."""
    changed = np.zeros(len(work), dtype=bool)
    for channel in INPUTS:
        values = work.get(channel)
        if values is not None:
            changed[1:] |= (np.diff(values, axis=0) != 0.0).any(axis=1)
    return np.cumsum(changed)


def _kicked(changed: IntArray) -> BoolArray:
    """Rows just after a change of a command, where a kick is no error; none where commands change all the time."""
    near = np.diff(changed, prepend=changed[:1]) > 0
    if near.mean() > 0.2:
        return np.zeros(len(near), dtype=bool)
    for _ in range(3):
        near[1:] |= near[:-1]
    near[:-1] |= near[1:]
    return near


def _isolated(values: FloatArray) -> BoolArray:
    n = len(values)
    bad = np.zeros(n, dtype=bool)
    if n < MIN_ROWS:
        return bad
    before, after = values[:-2], values[2:]
    jump = np.abs(values[1:-1] - 0.5 * (before + after))
    apart = np.abs(after - before)
    small = sample(jump)
    small = small[np.isfinite(small)]
    if not small.size:
        return bad
    scale = max(float(robust_std(small, 0.0)), quantum(values), 1e-3 * spread(values), 1e-12)
    # Heavy tails are no spikes: what is far must be far beyond the usual largest as well.
    scale = max(scale, float(np.quantile(small, 0.99)) / 3.0)
    with np.errstate(invalid="ignore"):
        bad[1:-1] = (jump > SPIKE * scale) & (apart < 0.25 * jump)
    return bad
