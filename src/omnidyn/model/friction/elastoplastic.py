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
from omnidyn.model.friction.law import Kind, Number
from omnidyn.model.friction.newton import SETTLED, newton

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


@part
def _slip(own, zx, zy, speed, levels):
    """(L, its slopes by Zx and Zy, by v_x and v_y at that Z, by Cx and Cy at that Z)."""
    cx, cy = levels[0], levels[1]
    size = math.hypot(zx, zy)
    along = zx * speed[0] / cx + zy * speed[1] / cy
    if along <= 0.0 or size <= own.elastic:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    left, steep = psi(own, size)
    share, below = 1.0 - left, (zx / cx) ** 2 + (zy / cy) ** 2
    each, most = share / below, along / below
    x, y = steep * most * zx / size, steep * most * zy / size
    return (
        share * most,
        x + each * (speed[0] / cx - 2.0 * most * zx / cx**2),
        y + each * (speed[1] / cy - 2.0 * most * zy / cy**2),
        each * zx / cx,
        each * zy / cy,
        each * zx / cx**2 * (2.0 * most * zx / cx - speed[0]),
        each * zy / cy**2 * (2.0 * most * zy / cy - speed[1]),
    )


@part
def _slip_within(own, trial, speed, tau, levels):
    """L at the end of a stage whose Z without slip is `trial`: then Z_a = trial_a/(1 + L tau sigma0/C_a^2).

    L less the slip there rises with L: Newton within a bracket.
    """
    ex, ey = tau * own.stiffness / levels[0] ** 2, tau * own.stiffness / levels[1] ** 2
    low, found = 0.0, _slip(own, trial[0], trial[1], speed, levels)[0]
    high, fits = found, False
    for _ in range(ROUNDS if found > 0.0 and tau > 0.0 else 0):
        zx, zy = trial[0] / (1.0 + ex * found), trial[1] / (1.0 + ey * found)
        slip, by_x, by_y = _slip(own, zx, zy, speed, levels)[:3]
        off = found - slip
        fits |= off >= 0.0
        high = high if fits else 2.0 * found
        before, slope = found, 1.0 + by_x * zx * ex / (1.0 + ex * found) + by_y * zy * ey / (1.0 + ey * found)
        found, low, high = newton(found, off, slope, low, high)
        if abs(found - before) <= SETTLED * found:
            break
    return found


@part
def plane(own, aimed, speed, tau, levels):
    """(zx', zy', their slopes by v_x and v_y); see LAWS of bristle.py."""
    (x, y), (cx, cy, dx, dy, size), stiff = speed, levels, own.stiffness
    trial = (stiff * (aimed[0] + tau * x) / cx, stiff * (aimed[1] + tau * y) / cy)
    slip = _slip_within(own, trial, speed, tau, levels)
    zx, zy = trial[0] / (1.0 + tau * stiff * slip / cx**2), trial[1] / (1.0 + tau * stiff * slip / cy**2)
    _, by_zx, by_zy, by_x, by_y, by_cx, by_cy = _slip(own, zx, zy, speed, levels)
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


def slow(own: Any, left: float, far: float) -> float:
    """What is left of the way to slipping, on a slow way: dw = psi(w) d far, by the rule of the middle."""
    w, count = 1.0 - left, max(math.ceil(STEPS * far), 1)
    for _ in range(count):
        half = w + 0.5 * far / count * plain(psi)(own, w)[0]
        w += far / count * plain(psi)(own, half)[0]
    return 1.0 - w


TAKES = {"stiffness": lugre.STIFFNESS, **lugre.DAMPED, "elastic_share": Number("elastic")}
KIND = Kind("elastoplastic", "elasto-plastic", TAKES, bends=True, drifts=False, usual={"damping": lugre.critical})
