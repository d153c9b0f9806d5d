"""LuGre's bristles: a level that falls with the speed, and a damping.

    z' = s - sigma0 |s| z / g(s),   F = sigma0 z + sigma1(s) z' (+ viscous s),   g: Coulomb or Stribeck level
    sigma1(s) = sigma1 exp(-(s/v_d)^2) where `damping_speed` v_d is given, else constant

sigma1 about 2 sqrt(sigma0 m) - viscous (critical, the default). Sources: Canudas de Wit, Olsson, Astrom & Lischinsky
1995 (example: 1e5 N/m, sqrt(1e5), 0.4, 1, 1.5, 1e-3); sigma1 that fades: Olsson 1996, who shows that LuGre with a
constant sigma1 gives energy back at some speeds.

A stage of length tau from z* is solved for z' beforehand, so a stiff bristle is no matter:
z' = (s - k z*)/(1 + tau k), k = sigma0 |s|/g.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import part
from omnidyn.model.friction.law import SPEED, LawKind, Number


@part
def rate(record, aimed, speed, tau, level, slope):
    """(z', dz'/ds); see LAWS of bristle.py."""
    side = 1.0 if speed >= 0.0 else -1.0
    k = record.stiffness * abs(speed) / level
    dk = (record.stiffness * side - k * slope) / level
    bristle_rate = (speed - k * aimed) / (1.0 + tau * k)
    return bristle_rate, (1.0 - dk * (aimed + tau * bristle_rate)) / (1.0 + tau * k)


@part
def within(matrix, right_side):
    """matrix^-1 right_side, both of two rows, (xx, xy, yx, yy): slopes of what is solved for, from outside."""
    a, b, c, d = matrix
    below = a * d - b * c
    return (
        (d * right_side[0] - b * right_side[2]) / below,
        (d * right_side[1] - b * right_side[3]) / below,
        (a * right_side[2] - c * right_side[0]) / below,
        (a * right_side[3] - c * right_side[1]) / below,
    )


@part
def plane(record, aimed, speed, tau, levels):
    """(zx', zy', their slopes by v_x and v_y); see LAWS of bristle.py. z_a' = v_a - sigma0 D(v) z_a/C_a^2.

    D^2 = Cx^2 vx^2 + Cy^2 vy^2: sliding, sigma0 z is the force of maximum dissipation.
    """
    x_rate, x_x, x_y = _one_of_plane(record, 0, aimed[0], speed, tau, levels)
    y_rate, y_x, y_y = _one_of_plane(record, 1, aimed[1], speed, tau, levels)
    return x_rate, y_rate, x_x, x_y, y_x, y_y


@part
def _one_of_plane(record, a, aimed, speed, tau, levels):
    """(z', its slopes by v_x and v_y) of axis a."""
    (x, y), (cx, cy, dx, dy, size) = speed, levels
    work = max(math.hypot(cx * x, cy * y), 1e-150)
    along = (cx * dx * x * x + cy * dy * y * y) / (work * max(size, 1e-150))  # dD/d|v| over |v|
    by_x, by_y = cx * cx * x / work + along * x, cy * cy * y / work + along * y
    level, falls = (cx, dx) if a == 0 else (cy, dy)
    k, steep = record.stiffness * work / level**2, 2.0 * falls / (level * max(size, 1e-150))
    k_x, k_y = record.stiffness * by_x / level**2 - k * steep * x, record.stiffness * by_y / level**2 - k * steep * y
    bristle_rate, below = ((x if a == 0 else y) - k * aimed) / (1.0 + tau * k), 1.0 + tau * k
    bent = aimed + tau * bristle_rate
    return (
        bristle_rate,
        ((1.0 if a == 0 else 0.0) - k_x * bent) / below,
        ((1.0 if a == 1 else 0.0) - k_y * bent) / below,
    )


def slow(record: Any, remainder: float, distance: float) -> float:
    """What is left of the way to slipping, on a slow way."""
    return remainder * np.exp(-distance)


def critical(stiffness: Any, mass: FloatArray | float, viscous: Any) -> Any:
    """2 sqrt(sigma0 m) - viscous: the damping with which a bristle and the body on it do not swing."""
    return None if stiffness is None else np.maximum(2.0 * np.sqrt(stiffness * mass) - viscous, 0.0)


STIFFNESS = Number("stiffness", 2, units=("N/m", "N m/rad"))
DAMPED = {"damping": Number("damping", 2, units=("N s/m", "N m s")), "damping_speed": Number("fade", -1, True, SPEED)}
KIND = LawKind("lugre", "LuGre", {"stiffness": STIFFNESS, **DAMPED}, bends=True, usual={"damping": critical})
