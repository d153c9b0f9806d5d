"""Elasto-plastic bristles: LuGre's, but up to a share of its bend a bristle is a spring, which does not drift.

    z' = s (1 - alpha(w) w),  w = sigma0 z sgn(s)/g(s),   F = sigma0 z + sigma1(s) z' (+ viscous s), as LuGre's
    alpha = 0 up to w = b, 1 from w = 1 on, between them (1 + sin(pi (w - (1 + b)/2)/(1 - b)))/2

b = `elastic_share`, 0 <= b < 1. Source: Dupont, Hayward, Armstrong & Altpeter 2002.

Along the direction of travel, in units of the ellipse, Z_a = sigma0 z_a/C_a: what slips does so along the normal of the
ellipse, the more of it the nearer z is to the edge, and none while v and z point apart,

    z_a' = v_a - L Z_a/C_a,   L = alpha(|Z|) |Z| max(sum_a Z_a v_a/C_a, 0)/sum_a Z_a^2/C_a^2

For a motion along an axis it is the law of one axis; a disc is the same along any direction. At a constant level |Z|
stays below 1, where v turns too, and comes to the force of maximum dissipation. With the storage W = sigma0 |z|^2/2
it takes energy: F . v - W' = L sigma0 |Z|^2 >= 0, what damping gives apart.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import part, plain
from omnidyn.model.friction import lugre
from omnidyn.model.friction.dahl import ROUNDS, rate_of
from omnidyn.model.friction.law import LawKind, Number
from omnidyn.model.friction.newton import ROOT_TOLERANCE, newton

STEPS = 20  # of a slow way of one bend


@part
def psi(record, w):
    """(z'/s, how steeply it falls with w)."""
    if w <= record.elastic:
        return 1.0, 0.0
    if w >= 1.0:
        return 1.0 - w, 1.0
    angle = math.pi * (w - 0.5 * (1.0 + record.elastic)) / (1.0 - record.elastic)
    alpha = 0.5 * (1.0 + math.sin(angle))
    return 1.0 - alpha * w, alpha + 0.5 * w * math.cos(angle) * math.pi / (1.0 - record.elastic)


rate = rate_of(psi)


@part
def _slip(record, zx, zy, speed, levels):
    """(L, its slopes by Zx and Zy, by v_x and v_y at that Z, by Cx and Cy at that Z)."""
    cx, cy = levels[0], levels[1]
    size = math.hypot(zx, zy)
    along = zx * speed[0] / cx + zy * speed[1] / cy
    if along <= 0.0 or size <= record.elastic:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    remainder, steep = psi(record, size)
    share, below = 1.0 - remainder, (zx / cx) ** 2 + (zy / cy) ** 2
    relative, quotient = share / below, along / below
    x, y = steep * quotient * zx / size, steep * quotient * zy / size
    return (
        share * quotient,
        x + relative * (speed[0] / cx - 2.0 * quotient * zx / cx**2),
        y + relative * (speed[1] / cy - 2.0 * quotient * zy / cy**2),
        relative * zx / cx,
        relative * zy / cy,
        relative * zx / cx**2 * (2.0 * quotient * zx / cx - speed[0]),
        relative * zy / cy**2 * (2.0 * quotient * zy / cy - speed[1]),
    )


@part
def _slip_within(record, trial, speed, tau, levels):
    """L at the end of a stage whose Z without slip is `trial`: then Z_a = trial_a/(1 + L tau sigma0/C_a^2).

    L less the slip there rises with L: Newton within a bracket.
    """
    ex, ey = tau * record.stiffness / levels[0] ** 2, tau * record.stiffness / levels[1] ** 2
    low, slip_rate = 0.0, _slip(record, trial[0], trial[1], speed, levels)[0]
    high, fits = slip_rate, False
    for _ in range(ROUNDS if slip_rate > 0.0 and tau > 0.0 else 0):
        zx, zy = trial[0] / (1.0 + ex * slip_rate), trial[1] / (1.0 + ey * slip_rate)
        slip, by_x, by_y = _slip(record, zx, zy, speed, levels)[:3]
        off = slip_rate - slip
        fits |= off >= 0.0
        high = high if fits else 2.0 * slip_rate
        before, slope = (
            slip_rate,
            1.0 + by_x * zx * ex / (1.0 + ex * slip_rate) + by_y * zy * ey / (1.0 + ey * slip_rate),
        )
        slip_rate, low, high = newton(slip_rate, off, slope, low, high)
        if abs(slip_rate - before) <= ROOT_TOLERANCE * slip_rate:
            break
    return slip_rate


@part
def plane(record, aimed, speed, tau, levels):
    """(zx', zy', their slopes by v_x and v_y); see LAWS of bristle.py."""
    (x, y), (cx, cy, dx, dy, size), stiff = speed, levels, record.stiffness
    trial = (stiff * (aimed[0] + tau * x) / cx, stiff * (aimed[1] + tau * y) / cy)
    slip = _slip_within(record, trial, speed, tau, levels)
    zx, zy = trial[0] / (1.0 + tau * stiff * slip / cx**2), trial[1] / (1.0 + tau * stiff * slip / cy**2)
    _, by_zx, by_zy, by_x, by_y, by_cx, by_cy = _slip(record, zx, zy, speed, levels)
    fall = (by_cx - by_zx * zx / cx) * dx + (by_cy - by_zy * zy / cy) * dy  # of L by |v|, at that z
    nx, ny, stiff = x / max(size, 1e-150), y / max(size, 1e-150), tau * stiff
    fall_x, fall_y = fall * zx / cx - 2.0 * slip * zx * dx / cx**2, fall * zy / cy - 2.0 * slip * zy * dy / cy**2
    by = lugre.within(
        (
            1.0 + stiff * (by_zx * zx + slip) / cx**2,
            stiff * by_zy * zx / (cx * cy),
            stiff * by_zx * zy / (cx * cy),
            1.0 + stiff * (by_zy * zy + slip) / cy**2,
        ),
        (
            1.0 - zx / cx * by_x - fall_x * nx,
            -zx / cx * by_y - fall_x * ny,
            -zy / cy * by_x - fall_y * nx,
            1.0 - zy / cy * by_y - fall_y * ny,
        ),
    )
    return x - slip * zx / cx, y - slip * zy / cy, by[0], by[1], by[2], by[3]


def slow(record: Any, remainder: float, distance: float) -> float:
    """What is left of the way to slipping, on a slow way: dw = psi(w) d far, by the rule of the middle."""
    w, count = 1.0 - remainder, max(math.ceil(STEPS * distance), 1)
    for _ in range(count):
        half = w + 0.5 * distance / count * plain(psi)(record, w)[0]
        w += distance / count * plain(psi)(record, half)[0]
    return 1.0 - w


TAKES = {"stiffness": lugre.STIFFNESS, **lugre.DAMPED, "elastic_share": Number("elastic")}
KIND = LawKind("elastoplastic", "elasto-plastic", TAKES, bends=True, drifts=False, usual={"damping": lugre.critical})
