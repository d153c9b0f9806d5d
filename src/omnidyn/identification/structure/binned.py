"""Residuals in bins, for the eye: against the speed, the acceleration, the time in the log, the heading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.lack_of_fit import Binned
from omnidyn.identification.output_error.linear.motion import Motion
from omnidyn.identification.output_error.linear.rows import Rows
from omnidyn.run import UNITS

BINS, LEAST = 16, 5  # of a picture; rows of a bin that is shown


def binned(rows: Rows, motions: Sequence[Motion], column: int) -> tuple[Binned, ...]:
    """The residuals of one column of the problem."""
    name, i = rows.problem.columns[column]
    residual, against = [], {}
    for k, motion in enumerate(motions):
        if column not in rows.column[k]:
            continue
        c = rows.column[k].index(column)
        there = rows.there[k][c]
        level = motion.shown(motion.twist[:, None, :])[c, :, 0]
        residual.append(rows.residual[k][c][there])
        every = {
            f"{name}[{i}] of the model": level,
            "its change in a second": np.gradient(level, motion.t),
            "share of the log that has gone by": motion.share,
            "heading [rad]": np.mod(motion.pose[:, 2], 2.0 * np.pi),
        }
        for words, values in every.items():
            against.setdefault(words, []).append(values[there])
    error = np.concatenate(residual) if residual else np.zeros(0)
    found = (
        _bins(error, np.concatenate(values), f"{name}[{i}]", unit_of(name, i), words)
        for words, values in against.items()
    )
    return tuple(each for each in found if len(each.at) > 1)


def _bins(error: FloatArray, values: FloatArray, output: str, unit: str, against: str) -> Binned:
    """Bins of as many rows each."""
    order = np.array_split(np.argsort(values, kind="stable"), BINS)
    own = [rows for rows in order if len(rows) >= LEAST]
    mean = np.array([error[rows].mean() for rows in own])
    std = np.array([2.0 * error[rows].std(ddof=1) / np.sqrt(len(rows)) for rows in own])
    return Binned(output, unit, against, np.array([values[rows].mean() for rows in own]), mean, std)


def unit_of(name: str, i: int) -> str:
    """The unit of an output: of a channel of a run, or of a part of the pose."""
    units = UNITS.get(name) or {"position": "m", "heading": "rad"}[name]
    return units.split(", ")[i] if "," in units else units
