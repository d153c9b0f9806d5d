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

from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import part
from omnidyn.model.friction.law import SPEED, Kind, Number


@part
def rate(own, aimed, speed, tau, level, slope):
    """(z', dz'/ds); see LAWS of bristle.py."""
    side = 1.0 if speed >= 0.0 else -1.0
    k = own.stiffness * abs(speed) / level
    dk = (own.stiffness * side - k * slope) / level
    found = (speed - k * aimed) / (1.0 + tau * k)
    return found, (1.0 - dk * (aimed + tau * found)) / (1.0 + tau * k)


def slow(own: Any, left: float, far: float) -> float:
    """What is left of the way to slipping, on a slow way."""
    return left * np.exp(-far)


def critical(stiffness: Any, mass: FloatArray | float, viscous: Any) -> Any:
    """2 sqrt(sigma0 m) - viscous: the damping with which a bristle and the body on it do not swing."""
    return None if stiffness is None else np.maximum(2.0 * np.sqrt(stiffness * mass) - viscous, 0.0)


STIFFNESS = Number("stiffness", 2, units=("N/m", "N m/rad"))
DAMPED = {"damping": Number("damping", 2, units=("N s/m", "N m s")), "damping_speed": Number("fade", -1, True, SPEED)}
KIND = Kind("lugre", "LuGre", {"stiffness": STIFFNESS, **DAMPED}, bends=True, usual={"damping": critical})
