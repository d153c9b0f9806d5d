"""A Moreau stepper that knows no modes: it watches over modes.py by step refinement.

One step of length h: currents from the old speeds (settled, or implicit in i), smooth forces from the old
speeds, and friction implicit in the new speeds, by Gauss-Seidel on impulses. First order: the error is halved
with h. Breakaway above coulomb: what is at rest, or would reverse within the step, holds at breakaway; if it
moves all the same the step is done again with its coulomb level.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

AT_REST = 1e-11


@njit(cache=True)
def _on_ellipse(x, y, a, b):
    """The point of an ellipse with half axes a, b nearest to (x, y), or (x, y) inside it."""
    if a <= 0.0 or b <= 0.0:
        return 0.0, 0.0
    if (x / a) ** 2 + (y / b) ** 2 <= 1.0:
        return x, y
    k = 0.0
    for _ in range(100):
        fx, fy = (a * x / (a * a + k)) ** 2, (b * y / (b * b + k)) ** 2
        step = (fx + fy - 1.0) / (2.0 * (fx / (a * a + k) + fy / (b * b + k)))
        k += step
        if step <= 1e-14 * k:
            break
    return a * a * x / (a * a + k), b * b * y / (b * b + k)


@njit(cache=True)
def _solve(v, free, inverse, flat, d, size, level, ellipse, rho, push):
    """v with M (v - free) = -(impulses of friction); impulses rho in [-level_1, level_0], push in the
    ellipse."""
    for k in range(3):
        v[k] = free[k]
        for e in range(len(rho)):
            v[k] -= (inverse[k, 0] * d[e, 0] + inverse[k, 1] * d[e, 1] + inverse[k, 2] * d[e, 2]) * rho[e]
        v[k] -= inverse[k, 0] * push[0] + inverse[k, 1] * push[1]
    for _ in range(3000):
        change = 0.0
        for e in range(len(rho)):
            s = d[e, 0] * v[0] + d[e, 1] * v[1] + d[e, 2] * v[2]
            new = min(max(rho[e] + s / size[e], -level[e, 1]), level[e, 0])
            delta = new - rho[e]
            rho[e] = new
            for k in range(3):
                v[k] -= (inverse[k, 0] * d[e, 0] + inverse[k, 1] * d[e, 1] + inverse[k, 2] * d[e, 2]) * delta
            change = max(change, abs(delta) * size[e])
        if ellipse[0] > 0.0:
            x, y = _on_ellipse(push[0] + flat * v[0], push[1] + flat * v[1], ellipse[0], ellipse[1])
            change = max(change, abs(x - push[0]) / flat, abs(y - push[1]) / flat)
            for k in range(3):
                v[k] -= inverse[k, 0] * (x - push[0]) + inverse[k, 1] * (y - push[1])
            push[0], push[1] = x, y
        if change < 1e-15:
            break


@njit(cache=True)
def _run(
    rows,
    steps,
    h,
    coast,
    v,
    pose,
    i,
    dynamic,
    turning,
    mass,
    inverse,
    flat,
    G,
    K,
    E,
    R,
    L,
    drop,
    limit,
    mid,
    dry,
    B,
    d,
    slide,
    hold,
    wheel,
    slide_e,
    hold_e,
    out_v,
    out_pose,
    out_i,
):
    n, m = G.shape[1], len(d)
    rho, push, free, new, force = np.zeros(m), np.zeros(2), np.zeros(3), np.zeros(3), np.zeros(3)
    level, size, weak = np.zeros((m, 2)), np.zeros(m), np.zeros(m + 1)
    for e in range(m):
        for j in range(3):
            for k in range(3):
                size[e] += d[e, j] * inverse[j, k] * d[e, k]
    for row in range(len(rows)):
        for _ in range(steps[row]):
            dt = h[row]
            for k in range(3):
                force[k] = -(B[k, 0] * v[0] + B[k, 1] * v[1] + B[k, 2] * v[2])
            if turning:
                force[0] += mass[0] * v[2] * v[1]
                force[1] -= mass[0] * v[2] * v[0]
            for k in range(n):
                w = rows[row, k] - E[k] * (G[0, k] * v[0] + G[1, k] * v[1] + G[2, k] * v[2])
                if dynamic:
                    w = L[k] * i[k] + dt * w
                    fade, over = dt * drop[k], L[k] + dt * R[k]
                else:
                    fade, over = drop[k], R[k]
                w = math.copysign(max(abs(w) - fade, 0.0), w) / over
                i[k] = 0.0 if coast[row, k] else min(max(w, -limit[k]), limit[k])
                for j in range(3):
                    force[j] += G[j, k] * K[k] * mid[k] * i[k]
            for k in range(3):
                free[k] = v[k] + dt * (inverse[k, 0] * force[0] + inverse[k, 1] * force[1] + inverse[k, 2] * force[2])
            weak[:] = 0.0
            for e in range(m):
                s = d[e, 0] * v[0] + d[e, 1] * v[1] + d[e, 2] * v[2]
                weak[e] = 1.0 if s > AT_REST else (-1.0 if s < -AT_REST else 0.0)
            weak[m] = 0.0 if math.hypot(v[0], v[1]) < AT_REST else 1.0
            for _again in range(m + 2):
                for e in range(m):
                    gear = K[wheel[e]] * dry[wheel[e]] * abs(i[wheel[e]]) if wheel[e] >= 0 else 0.0
                    level[e, 0] = dt * (gear + (slide[e, 0] if weak[e] in (1.0, 2.0) else hold[e, 0]))
                    level[e, 1] = dt * (gear + (slide[e, 1] if weak[e] in (-1.0, 2.0) else hold[e, 1]))
                _solve(
                    new, free, inverse, flat, d, size, level, dt * (slide_e if weak[m] == 1.0 else hold_e), rho, push
                )
                done = True
                for e in range(m):
                    s = d[e, 0] * new[0] + d[e, 1] * new[1] + d[e, 2] * new[2]
                    if (s > AT_REST and weak[e] in (0.0, -1.0)) or (s < -AT_REST and weak[e] in (0.0, 1.0)):
                        weak[e] = 2.0
                        done = False
                if weak[m] == 0.0 and math.hypot(new[0], new[1]) > AT_REST:
                    weak[m] = 1.0
                    done = False
                if done:
                    break
            middle = pose[2] + 0.25 * dt * (v[2] + new[2])
            x, y = 0.5 * (v[0] + new[0]), 0.5 * (v[1] + new[1])
            pose[0] += dt * (math.cos(middle) * x - math.sin(middle) * y)
            pose[1] += dt * (math.sin(middle) * x + math.cos(middle) * y)
            pose[2] += 0.5 * dt * (v[2] + new[2])
            v[:] = new
        out_v[row], out_pose[row], out_i[row] = v, pose, i


def stepped(plant, voltage, dt, h, twist=(0.0, 0.0, 0.0), open_circuit=None):
    """(twist, pose, current) at the row ends, with steps of about h [s]. `plant` is a modes_plant.Plant."""
    p, rows = plant, np.asarray(voltage, dtype=float)
    dt = np.broadcast_to(np.asarray(dt, dtype=float), (len(rows),))
    steps = np.maximum(np.round(dt / h).astype(np.int64), 1)
    coast = np.zeros(rows.shape, dtype=np.bool_) if open_circuit is None else np.asarray(open_circuit, dtype=np.bool_)
    none, inverse = np.zeros(2), np.linalg.inv(p.M)
    out = np.zeros((len(rows), 3)), np.zeros((len(rows), 3)), np.zeros(rows.shape)
    _run(
        rows,
        steps,
        dt / steps,
        coast,
        np.array(twist, dtype=float),
        np.zeros(3),
        np.zeros(p.wheels),
        p.dynamic,
        p.turning,
        p.mass,
        inverse,
        1.0 / np.linalg.eigvalsh(inverse[:2, :2])[-1],
        np.ascontiguousarray(p.G),
        p.K,
        p.E,
        p.R,
        p.L,
        p.drop,
        p.limit,
        p.middle,
        p.dry,
        p.viscous,
        p.direction,
        p.slide,
        p.hold,
        p.wheel,
        none if p.slide_ellipse is None else p.slide_ellipse,
        none if p.hold_ellipse is None else p.hold_ellipse,
        *out,
    )
    return out
