"""How sure a fitted friction line is along its length: the pointwise 95 % band."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.statistics import t_quantile


def confidence_band(estimate: Estimate, axis: int, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fitted force B v + C and half its 95 % interval, q sqrt(s_B^2 v^2 + 2 rho s_B s_C v + s_C^2).

    `speed` [m/s or rad/s], shape (n,). Returns (force, half) [N or N m], shape (n,) each.
    """
    slope, level = f"friction.axes.viscous[{axis}]", f"friction.axes.coulomb[{axis}]"
    of_slope, of_level = estimate.std[slope] * speed, estimate.std[level]
    joint = 2.0 * estimate.correlation.between(slope, level) * of_slope * of_level
    spread = np.sqrt(of_slope**2 + joint + of_level**2)
    middle = estimate.value[slope] * speed + estimate.value[level]
    return middle, t_quantile(estimate.degrees_of_freedom[slope]) * spread
