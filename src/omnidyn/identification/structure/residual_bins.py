"""Residuals in bins, for the eye: against the speed, the acceleration, the time in the log, the heading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.lack_of_fit import Binned
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.rows import FitRows
from omnidyn.run import UNITS

BINS, LEAST_BIN_ROWS = 16, 5  # of a picture; rows of a bin that is shown


def binned(rows: FitRows, motions: Sequence[DrivenMotion], column: int) -> tuple[Binned, ...]:
    """The residuals of one column of the problem."""
    name, i = rows.problem.columns[column]
    residual, values_by_label = [], {}
    for k, motion in enumerate(motions):
        if column not in rows.column[k]:
            continue
        c = rows.column[k].index(column)
        mask = rows.masks[k][c]
        level = motion.shown(motion.twist[:, None, :])[c, :, 0]
        residual.append(rows.residual[k][c][mask])
        values_by_name = {
            f"{name}[{i}] of the model": level,
            "its change in a second": np.gradient(level, motion.t),
            "share of the log that has gone by": motion.share,
            "heading [rad]": np.mod(motion.pose[:, 2], 2.0 * np.pi),
        }
        for words, values in values_by_name.items():
            values_by_label.setdefault(words, []).append(values[mask])
    error = np.concatenate(residual) if residual else np.zeros(0)
    bins = (
        _bins(error, np.concatenate(values), f"{name}[{i}]", unit_of(name, i), words)
        for words, values in values_by_label.items()
    )
    return tuple(curve for curve in bins if len(curve.at) > 1)


def _bins(error: FloatArray, values: FloatArray, output: str, unit: str, label: str) -> Binned:
    """Bins of as many rows each."""
    order = np.array_split(np.argsort(values, kind="stable"), BINS)
    bin_rows = [rows for rows in order if len(rows) >= LEAST_BIN_ROWS]
    mean = np.array([error[rows].mean() for rows in bin_rows])
    std = np.array([2.0 * error[rows].std(ddof=1) / np.sqrt(len(rows)) for rows in bin_rows])
    return Binned(output, unit, label, np.array([values[rows].mean() for rows in bin_rows]), mean, std)


def unit_of(name: str, i: int) -> str:
    """The unit of an output: of a channel of a run, or of a part of the pose."""
    units = UNITS.get(name) or {"position": "m", "heading": "rad"}[name]
    return units.split(", ")[i] if "," in units else units
