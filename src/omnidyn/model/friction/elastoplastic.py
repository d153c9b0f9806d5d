"""Elasto-plastic bristles: LuGre's, but up to a share of its bend a bristle is a spring, which does not drift.

    z' = s (1 - alpha(w) w),  w = sigma0 z sgn(s)/g(s),   F = sigma0 z + sigma1(s) z' (+ viscous s), as LuGre's
    alpha = 0 up to w = b, 1 from w = 1 on, between them (1 + sin(pi (w - (1 + b)/2)/(1 - b)))/2

b = `elastic_share`, 0 <= b < 1. Source: Dupont, Hayward, Armstrong & Altpeter 2002.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import part, plain
from omnidyn.model.friction import lugre
from omnidyn.model.friction.dahl import rate_of
from omnidyn.model.friction.law import Kind, Number

STEPS = 20  # of a slow way of one bend


@part
def psi(own, w):
    """(z'/s, how steeply it falls with w)."""
    if w <= own.elastic:
        return 1.0, 0.0
    if w >= 1.0:
        return 1.0 - w, 1.0
    angle = math.pi * (w - 0.5 * (1.0 + own.elastic)) / (1.0 - own.elastic)
    alpha = 0.5 * (1.0 + math.sin(angle))
    return 1.0 - alpha * w, alpha + 0.5 * w * math.cos(angle) * math.pi / (1.0 - own.elastic)


rate = rate_of(psi)


def slow(own: Any, left: float, far: float) -> float:
    """What is left of the way to slipping, on a slow way: dw = psi(w) d far, by the rule of the middle."""
    w, count = 1.0 - left, max(math.ceil(STEPS * far), 1)
    for _ in range(count):
        half = w + 0.5 * far / count * plain(psi)(own, w)[0]
        w += far / count * plain(psi)(own, half)[0]
    return 1.0 - w


TAKES = {"stiffness": lugre.STIFFNESS, **lugre.DAMPED, "elastic_share": Number("elastic")}
KIND = Kind(
    "elastoplastic", "elasto-plastic", TAKES, bends=True, drifts=False, usual={"damping": lugre.critical},
    places=("axes", "wheels"),
)  # fmt: skip
