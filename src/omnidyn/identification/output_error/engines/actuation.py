"""What a driver makes of the voltages of a log, and how that changes with its gain, dead band and fade.

The formula is `driven` of kernel/march.py, with the gain that is left at the time: gain (1 - fade share of the run).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from omnidyn.compiled.kernel import kernel
from omnidyn.identification.output_error.kernel.march import DEAD, FADE, GAIN, driven

FloatArray = NDArray[np.float64]


def through_driver(
    voltage: FloatArray, share: FloatArray, gain: float, dead: float, fade: float
) -> tuple[FloatArray, FloatArray]:
    """(voltages at the motors, their derivatives by gain, dead band and fade). Shapes (rows, n), (3, rows, n).

    voltage [V]: (rows, n); share (rows,): of the run that has passed, 0 to 1. dead [V].
    """
    out, by = np.empty_like(voltage), np.empty((3, *voltage.shape))
    _driven(np.ascontiguousarray(voltage), share, gain, dead, fade, out, by)
    return out, by


@kernel
def _driven(voltage, share, gain, dead, fade, out, by):
    for k in range(len(voltage)):
        left = 1.0 - fade * share[k]
        for w in range(voltage.shape[1]):
            out[k, w], size, by[DEAD, k, w] = driven(voltage[k, w], gain * left, dead)
            by[GAIN, k, w], by[FADE, k, w] = left * size, -gain * share[k] * size
