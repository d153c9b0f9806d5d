"""Single values far away from both neighbours, judged by the rows in which a channel was recorded."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import INPUTS, MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.robust import quantum, sample, spread
from omnidyn.logs.channels import place
from omnidyn.sensors import SENSORS
from omnidyn.statement import WARNING
from omnidyn.statistics import robust_std

SPIKE = 10.0  # a single value so many times the noise away from both its neighbours


def check_spikes(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Single values (or two) far away from both neighbours, which agree with each other."""
    findings = []
    changes = _spikes_changed(work)
    for channel in (*SENSORS, "supply"):
        for component, values in work.sampled_columns(channel):
            k = place(component)[1]  # type: ignore[index]
            recorded_rows = work.recorded(channel, k)
            mask = np.zeros(len(work), dtype=bool)
            mask[recorded_rows] = _isolated(values[recorded_rows]) & ~_kicked(changes[recorded_rows])
            if not mask.any() or mask.mean() > 0.2:
                continue
            worst = int(np.flatnonzero(mask)[np.argmax(np.abs(values[mask] - np.nanmedian(values)))])
            findings.append(
                Finding(
                    "spike",
                    WARNING,
                    component,
                    {"farthest": float(values[worst]), "share": float(mask.mean()), "at_s": float(work.t[worst])},
                    rows=work.lines(mask),
                    count=int(mask.sum()),
                )
            )
            work = work.masked(channel, k, mask)
    return findings, work


def _spikes_changed(work: LogUnderCheck) -> IntArray:
    """How often a command has changed up to each row."""
    steps = np.zeros(len(work), dtype=bool)
    for channel in INPUTS:
        values = work.get(channel)
        if values is not None:
            steps[1:] |= (np.diff(values, axis=0) != 0.0).any(axis=1)
    return np.cumsum(steps)


def _kicked(changes: IntArray) -> BoolArray:
    """Rows just after a change of a command, where a kick is no error; none where commands change all the time."""
    kicks = np.diff(changes, prepend=changes[:1]) > 0
    if kicks.mean() > 0.2:
        return np.zeros(len(kicks), dtype=bool)
    for _ in range(3):
        kicks[1:] |= kicks[:-1]
    kicks[:-1] |= kicks[1:]
    return kicks


def _isolated(values: FloatArray) -> BoolArray:
    n = len(values)
    mask = np.zeros(n, dtype=bool)
    if n < MIN_ROWS:
        return mask
    before, after = values[:-2], values[2:]
    jump = np.abs(values[1:-1] - 0.5 * (before + after))
    apart = np.abs(after - before)
    small = sample(jump)
    small = small[np.isfinite(small)]
    if not small.size:
        return mask
    scale = max(float(robust_std(small, 0.0)), quantum(values), 1e-3 * spread(values), 1e-12)
    # Heavy tails are no spikes: what is far must be far beyond the usual largest as well.
    scale = max(scale, float(np.quantile(small, 0.99)) / 3.0)
    with np.errstate(invalid="ignore"):
        mask[1:-1] = (jump > SPIKE * scale) & (apart < 0.25 * jump)
    return mask
