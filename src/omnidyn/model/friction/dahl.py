"""Dahl's bristles: a spring before it slips, and one level.

    z' = s |w|^a sgn w,  w = 1 - sigma0 z sgn(s)/C,   F = sigma0 z

a = 1 usual, below 1 brittle, above 1 ductile. It never gives energy back. Source: Dahl 1976. a = 1 is LuGre's rate.

Along the direction of travel, in units of the ellipse: Z_a = sigma0 z_a/C_a, D n_a = C_a v_a, |n| = 1,

    C_a z_a' = D |n - Z|^(a-1) (n_a - Z_a)

For a motion along an axis it is the law of one axis; of a disc it is the same along any direction. With the storage
W = sigma0 |z|^2/2 it takes energy for every a > 0 and every Z: F . v - W' = D (Z . n - |n - Z|^(a-1) Z . (n - Z)) >= 0.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import part
from omnidyn.model.friction import lugre
from omnidyn.model.friction.law import LawKind, Number
from omnidyn.model.friction.newton import ROOT_TOLERANCE, newton

LEAST_SHARE = 1e-30  # of the way to slipping: below it there is nothing left
ROUNDS = 60  # of Newton's steps for a general exponent; bisection needs no more


def rate_of(psi: Any) -> Any:
    """The rate z' = s psi(w), w = sigma0 z sgn(s)/g, of a law whose psi falls with w.

    psi(record, w) -> (psi, -psi'), a part. r(z') = z' - s psi(w(z* + tau z')) rises with z': Newton within a bracket.
    """

    def rate(record, aimed, speed, tau, level, slope):
        """(z', dz'/ds); see LAWS of bristle.py."""
        stiffness = record.stiffness
        if speed == 0.0:
            return 0.0, psi(record, stiffness * aimed / level)[0]
        side = 1.0 if speed > 0.0 else -1.0
        start = speed * psi(record, stiffness * aimed * side / level)[0]
        low, high, bristle_rate = min(start, 0.0), max(start, 0.0), 0.5 * start
        bend = tau * abs(speed) * stiffness / level
        for _ in range(ROUNDS):
            value, steep = psi(record, stiffness * (aimed + tau * bristle_rate) * side / level)
            before = bristle_rate
            bristle_rate, low, high = newton(bristle_rate, bristle_rate - speed * value, 1.0 + bend * steep, low, high)
            if abs(bristle_rate - before) <= ROOT_TOLERANCE * abs(start):
                break
        w = stiffness * (aimed + tau * bristle_rate) * side / level
        value, steep = psi(record, w)
        return bristle_rate, (value + speed * steep * w * slope / level) / (1.0 + bend * steep)

    return part(rate)


@part
def _psi(record, w):
    remainder, a = 1.0 - w, record.dahl_exponent
    size = abs(remainder) ** a
    return math.copysign(size, remainder), a * size / max(abs(remainder), 1e-300)


@part
def _left_of_way(aimed, bend_x, bend_y, a):
    """q = |Y| with Y_a (1 + bend_a q^(a-1)) = aimed_a: what is left of the way to slipping. 0 where nothing was left.

    q/|Y(q)| - 1 rises with q: Newton within a bracket.
    """
    low, high = 0.0, math.hypot(aimed[0], aimed[1])
    root = high
    for _ in range(ROUNDS if high > 0.0 else 0):
        power = root ** (a - 1.0)
        below_x, below_y = 1.0 + bend_x * power, 1.0 + bend_y * power
        x, y = aimed[0] / below_x, aimed[1] / below_y
        size = max(math.hypot(x, y), 1e-300)
        rises = (a - 1.0) * power * (bend_x * x * x / below_x + bend_y * y * y / below_y) / (size * size)
        before = root
        root, low, high = newton(root, root - size, 1.0 + rises, low, high)
        if abs(root - before) <= ROOT_TOLERANCE * root:
            break
    return root


@part
def _plane_by_newton(record, aimed, speed, tau, levels):
    """As `plane`, for a general exponent."""
    (x, y), cx, cy, a = speed, levels[0], levels[1], record.dahl_exponent
    work = math.hypot(cx * x, cy * y)
    if work == 0.0:
        return 0.0, 0.0, 1.0, 0.0, 0.0, 1.0
    n, stiff = (cx * x / work, cy * y / work), tau * record.stiffness * work
    start = (record.stiffness * aimed[0] / cx - n[0], record.stiffness * aimed[1] / cy - n[1])
    power = max(_left_of_way(start, stiff / (cx * cx), stiff / (cy * cy), a), LEAST_SHARE) ** (a - 1.0)
    u, v = start[0] / (1.0 + stiff * power / (cx * cx)), start[1] / (1.0 + stiff * power / (cy * cy))
    q, extra_power = max(math.hypot(u, v), 1e-300), (a - 1.0) * power
    xx, xy, yy = (
        power + extra_power * (u / q) ** 2,
        extra_power * (u / q) * (v / q),
        power + extra_power * (v / q) ** 2,
    )  # |Y|^(a-1) Y by Y
    turn_x, turn_y = xx * n[0] + xy * n[1] + power * u, xy * n[0] + yy * n[1] + power * v
    by = lugre.within(
        (1.0 + stiff * xx / (cx * cx), stiff * xy / (cx * cy), stiff * xy / (cx * cy), 1.0 + stiff * yy / (cy * cy)),
        (xx - turn_x * n[0], (xy - turn_x * n[1]) * cy / cx, (xy - turn_y * n[0]) * cx / cy, yy - turn_y * n[1]),
    )
    return -work / cx * power * u, -work / cy * power * v, by[0], by[1], by[2], by[3]


_linear, _by_newton = lugre.rate, rate_of(_psi)
_linear_plane = lugre.plane


@part
def rate(record, aimed, speed, tau, level, slope):
    """(z', dz'/ds); see LAWS of bristle.py."""
    if record.dahl_exponent == 1.0:
        return _linear(record, aimed, speed, tau, level, slope)
    return _by_newton(record, aimed, speed, tau, level, slope)


@part
def plane(record, aimed, speed, tau, levels):
    """(zx', zy', their slopes by v_x and v_y); see LAWS of bristle.py."""
    if record.dahl_exponent == 1.0:
        return _linear_plane(record, aimed, speed, tau, levels)
    return _plane_by_newton(record, aimed, speed, tau, levels)


def slow(record: Any, remainder: float, distance: float) -> float:
    """What is left of the way to slipping, on a slow way: it decays by a power, for a = 1 by exp."""
    a = float(record.dahl_exponent)
    if a == 1.0:
        return lugre.slow(record, remainder, distance)
    if remainder <= 0.0:
        return remainder
    below = remainder ** (1.0 - a) + (a - 1.0) * distance
    return below ** (1.0 / (1.0 - a)) if below > 0.0 else 0.0


TAKES = {"stiffness": lugre.STIFFNESS, "dahl_exponent": Number("dahl_exponent")}
KIND = LawKind("dahl", "Dahl", TAKES, falls=False, bends=True)
