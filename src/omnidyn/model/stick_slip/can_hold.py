"""Can the stuck elements hold? The exact, finite test of whether a force lies in the sum of friction sets.

Stuck elements can balance a residual r exactly when for every direction d

    phi(d) = r . d + sum over stuck e of support_e(d) >= 0,
    support_e(d) = hold_forward (g_e . d)+ + hold_backward (g_e . d)-,  and sqrt(Sx^2 dx^2 + Sy^2 dy^2) of the ellipse.

For scalar elements the set is a zonotope: only the normals of its facets need be tried, the cross products of pairs of
generators. With the ellipse the minimum of phi lies where some element's kink plane cuts it, and there on an arc of
the unit circle on which phi = 1 + m . p: a finite list again. The worst direction is the way the body gives way.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import ELLIPSE, GX, GY, GZ, HOLD, HOLD_X, HOLD_Y, LOSS, SIGN
from omnidyn.model.stick_slip.workspace import BASIS, RESIDUAL, WORST


@part
def gap(body, element, s, d0, d1, d2):
    """phi(d) of the stuck elements: negative where they cannot hold s[RESIDUAL] against a motion along d."""
    total = s[RESIDUAL, 0] * d0 + s[RESIDUAL, 1] * d1 + s[RESIDUAL, 2] * d2
    for e in range(len(element)):
        if element[e, SIGN] == 0.0:
            w = element[e, GX] * d0 + element[e, GY] * d1 + element[e, GZ] * d2
            if w > 0.0:
                total += (element[e, HOLD] + element[e, LOSS]) * w
            else:
                total -= (element[e, HOLD + 1] + element[e, LOSS + 1]) * w
    if body[ELLIPSE] == 0.0:
        total += math.sqrt((body[HOLD_X] * d0) ** 2 + (body[HOLD_Y] * d1) ** 2)
    return total


@part
def _keep_worst(body, element, s, d0, d1, d2, found):
    """Try the direction d as a unit vector; keep it in s[WORST] when it is the worst so far. Returns the worst phi."""
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    if size == 0.0:
        return found
    d0, d1, d2 = d0 / size, d1 / size, d2 / size
    value = gap(body, element, s, d0, d1, d2)
    if value < found:
        s[WORST, 0], s[WORST, 1], s[WORST, 2] = d0, d1, d2
        return value
    return found


@part
def _both_ways(body, element, s, d0, d1, d2, found):
    found = _keep_worst(body, element, s, d0, d1, d2, found)
    return _keep_worst(body, element, s, -d0, -d1, -d2, found)


@part
def _normal(body, element, s, u0, u1, u2, e, found):
    """Try the cross product of u and the direction of element e, both directions."""
    v0, v1, v2 = element[e, GX], element[e, GY], element[e, GZ]
    return _both_ways(body, element, s, u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0, found)


@part
def _scalar_worst(body, element, s, rank):
    """Worst direction where only scalar elements are stuck: facet normals of a zonotope of dimension `rank`."""
    found = 0.0
    for e in range(len(element)):
        if element[e, SIGN] != 0.0:
            continue
        if rank == 1:
            found = _both_ways(body, element, s, element[e, GX], element[e, GY], element[e, GZ], found)
        elif rank == 2:
            found = _normal(body, element, s, s[BASIS, 0], s[BASIS, 1], s[BASIS, 2], e, found)
        else:
            for f in range(e + 1, len(element)):
                if element[f, SIGN] == 0.0:
                    found = _normal(body, element, s, element[e, GX], element[e, GY], element[e, GZ], f, found)
    return found


@part
def _arc(body, element, s, plane, lift_x, lift_y, cut, along, px, py, found):
    """The arc of the unit circle that begins at p: element `cut` ends it and moves forward on it when `along`.

    Tried are the direction p itself and p = -m/|m|, where phi = 1 + m . p is least if it lies on this arc.
    """
    sx, sy = body[HOLD_X], body[HOLD_Y]
    mx = (s[RESIDUAL, 0] + lift_x * s[RESIDUAL, 2]) / sx
    my = (s[RESIDUAL, 1] + lift_y * s[RESIDUAL, 2]) / sy
    for f in range(len(element)):
        if element[f, SIGN] == 0.0 and f != plane:
            fx = (element[f, GX] + lift_x * element[f, GZ]) / sx
            fy = (element[f, GY] + lift_y * element[f, GZ]) / sy
            forward = fx * px + fy * py > 0.0 if f != cut else along
            level = element[f, HOLD] + element[f, LOSS] if forward else -element[f, HOLD + 1] - element[f, LOSS + 1]
            mx, my = mx + level * fx, my + level * fy
    d0, d1 = px / sx, py / sy
    found = _keep_worst(body, element, s, d0, d1, lift_x * d0 + lift_y * d1, found)
    d0, d1 = -mx / sx, -my / sy
    return _keep_worst(body, element, s, d0, d1, lift_x * d0 + lift_y * d1, found)


@part
def _circle(body, element, s, plane, lift_x, lift_y, found):
    """Worst direction d = (dx, dy, lift . d), (Sx dx, Sy dy) on the unit circle, cut into arcs by the other elements.

    `plane` is the element whose kink plane this is, -1 for none. All candidates are tried with phi itself.
    """
    ex, ey = s[RESIDUAL, 1] + lift_y * s[RESIDUAL, 2], -(s[RESIDUAL, 0] + lift_x * s[RESIDUAL, 2])
    found = _arc(body, element, s, plane, lift_x, lift_y, -1, False, ey, -ex, found)
    for e in range(len(element)):
        if element[e, SIGN] == 0.0 and e != plane:
            ex = (element[e, GX] + lift_x * element[e, GZ]) / body[HOLD_X]
            ey = (element[e, GY] + lift_y * element[e, GZ]) / body[HOLD_Y]
            for side in range(4):
                flip = 1.0 if side < 2 else -1.0
                found = _arc(body, element, s, plane, lift_x, lift_y, e, side % 2 == 0, -flip * ey, flip * ex, found)
    return found


@part
def _ellipse_worst(body, element, s, rank):
    """Worst direction where the ellipse is stuck: rank 2 turns on the spot, rank 3 is at rest."""
    if rank == 2:
        return _circle(body, element, s, -1, 0.0, 0.0, 0.0)
    found = _both_ways(body, element, s, 0.0, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        if element[e, SIGN] == 0.0 and element[e, GZ] != 0.0:
            found = _circle(
                body, element, s, e, -element[e, GX] / element[e, GZ], -element[e, GY] / element[e, GZ], found
            )
    return found


@part
def worst_direction(body, element, s, rank):
    """phi of the direction in which the stuck elements hold least, in s[WORST]; 0 when they hold.

    `rank`: dimension of what they forbid; s[BASIS] is the velocity that an active set of rank 2 still allows.
    """
    if body[ELLIPSE] == 0.0:
        return _ellipse_worst(body, element, s, rank)
    return _scalar_worst(body, element, s, rank)
