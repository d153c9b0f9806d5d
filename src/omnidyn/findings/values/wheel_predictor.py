"""What a wheel did, predicted from all other columns of the same log: no robot, unit or sign is needed for it."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import ground

FOLDS = 10  # of the log; each is predicted by what the others taught
MEMORY = (0.05, 0.15, 0.5)  # [s] over which a robot forgets what its motors were given
ROWS_PER_COLUMN = 20  # fewer teach nothing


class WheelPredictor:
    """Predicts the speed of a wheel linearly from the other wheels, the floor, currents and what drives the motors.

    Every fold of the log is predicted by coefficients from the other folds, so that a stretch under suspicion and all
    others are predicted alike.
    """

    def __init__(self, work: LogUnderCheck) -> None:
        self.work = work

    @cached_property
    def _shared(self) -> FloatArray:
        """Columns that tell of every wheel. Shape (rows, columns)."""
        work, parts = self.work, [np.ones((len(self.work), 1))]
        driven = work.get("voltage")
        driven = work.get("duty") if driven is None else driven
        if driven is not None and work.step > 0.0:
            parts += [_remembered(np.nan_to_num(driven), work.step / seconds) for seconds in MEMORY] + [driven]
        current, floor_motion = work.get("current"), ground(work)
        parts += [] if current is None else [current]
        parts += [] if floor_motion is None else [floor_motion.twist]
        return np.hstack(parts)

    def wheel_speed(self, k: int, without: BoolArray) -> FloatArray:
        """Speed of wheel k by the other columns, shape (rows,); NaN where they do not tell.

        Nothing is taken from the rows `without`.
        """
        speed = self.work.channels["wheel_speed"]
        x = np.hstack([self._shared, np.delete(speed, k, axis=1)])
        x = x[:, np.isfinite(x).mean(axis=0) > 0.5]
        finite = np.isfinite(x).all(axis=1)
        taught = finite & np.isfinite(speed[:, k]) & ~without
        out = np.full(len(x), np.nan)
        if taught.sum() < ROWS_PER_COLUMN * x.shape[1]:
            return out
        x = x / np.maximum(np.abs(x[finite]).max(axis=0), 1e-300)
        edges = np.linspace(0, len(x), FOLDS + 1).astype(int)
        folds = [slice(a, b) for a, b in pairwise(edges)]
        grams, sides = zip(*(_normal(x[p][taught[p]], speed[p, k][taught[p]]) for p in folds), strict=True)
        gram, side = sum(grams), sum(sides)
        ridge = 1e-9 * np.trace(gram) * np.eye(x.shape[1])
        for fold, fold_gram, of_own in zip(folds, grams, sides, strict=True):
            out[fold] = x[fold] @ np.linalg.solve(gram - fold_gram + ridge, side - of_own)
        return np.where(finite, out, np.nan)


def _normal(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(x' x, x' y), in the thread of the caller: for so few columns a product in threads costs more than it saves."""
    return np.einsum("ki,kj->ij", x, x), np.einsum("ki,k->i", x, y)


def _remembered(values: FloatArray, share: float) -> FloatArray:
    """What is left of each column by a first-order memory; share: of a step in the time it lasts."""
    keep = float(np.exp(-share))
    from scipy.signal import lfilter  # takes a second to import, and most logs never come here

    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, axis=0))
