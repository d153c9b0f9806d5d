"""The march of a World whose friction is a sum: at each wheel a level of its own, beside what acts on the body.

Implicit Euler in small steps. What friction takes is found element by element, each projected on what it may be, until
none changes (projected Gauss-Seidel; M. Jean, Comput. Methods Appl. Mech. Eng. 177, 235 (1999)): no events and no modes
as in kernel.py, for three wheels and a body at rest hold more than three ways to move. Shares no code with omnidyn.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from benchmarks.wrong_worlds.held import held_until

STEP = 1e-4  # [s]
SWEEPS, SETTLED = 200, 1e-10  # at most; [N] by which nothing changes any more


class Sum(NamedTuple):
    """Numbers that the march reads; SI. n wheels, k line elements."""

    G: np.ndarray  # (3, n) columns: wrench of 1 N at a rim
    M: np.ndarray  # (3, 3)
    turning: float  # mass in the terms of the turning frame [kg]; 0 without
    kt: np.ndarray  # (n,) [N/A] at the rim, and [V s/m]
    R: np.ndarray  # (n,) [ohm]
    d: np.ndarray  # (k, 3)
    level: np.ndarray  # (k,) [N]
    damping: np.ndarray  # (3, 3) of all that is viscous
    plane: np.ndarray  # (2,) levels of the ellipse; 0: none


@numba.njit(cache=True)
def march_sum(p, since, command, wanted, step, states):
    """Commands (rows, n) that hold from the times `since` on; states (rows, 6), the twist and its integral, at wanted.

    All times [s], increasing; the robot stands still at 0.
    """
    y, held, plane = np.zeros(6), np.zeros(len(p.d)), np.zeros(2)
    now, row, u = 0.0, 0, np.zeros(command.shape[1])
    for k in range(len(wanted)):
        while True:
            row, until = held_until(since, command, row, now, wanted[k], u)
            if until - now > 1e-12:
                steps = int(np.ceil((until - now) / step))
                _steps(p, y, u, (until - now) / steps, steps, held, plane)
                now = until
            if now >= wanted[k] - 1e-12:
                break
        states[k] = y


@numba.njit
def _steps(p, y, u, h, steps, held, plane):
    """Steps of length h; held (k,), plane (2,): what friction took before, and takes in the last of them [N]."""
    matrix, driven = p.M + h * p.damping, np.zeros(3)
    for i in range(u.size):
        for a in range(3):
            driven[a] += h * p.G[a, i] * p.kt[i] * u[i] / p.R[i]
            for b in range(3):
                matrix[a, b] += h * p.G[a, i] * p.kt[i] ** 2 / p.R[i] * p.G[b, i]
    inverse = np.linalg.inv(matrix)
    ways = p.d @ inverse  # it is symmetric
    size = h * (ways * p.d).sum(axis=1)  # what 1 N takes of the speed along its own element
    right, v = np.zeros(3), np.zeros(3)
    for _ in range(steps):
        for a in range(3):
            right[a] = driven[a] + p.M[a, 0] * y[0] + p.M[a, 1] * y[1] + p.M[a, 2] * y[2]
            for k in range(held.size):
                right[a] -= h * p.d[k, a] * held[k]
        right[0] += h * (p.turning * y[2] * y[1] - plane[0])
        right[1] -= h * (p.turning * y[2] * y[0] + plane[1])
        for a in range(3):
            v[a] = inverse[a, 0] * right[0] + inverse[a, 1] * right[1] + inverse[a, 2] * right[2]
        _settle(p, v, h, inverse, ways, size, held, plane)
        for a in range(3):
            y[3 + a] += 0.5 * h * (y[a] + v[a])
            y[a] = v[a]


@numba.njit
def _settle(p, v, h, inverse, ways, size, held, plane):
    """What friction takes in a step, element by element, until none changes; v follows."""
    for _ in range(SWEEPS):
        change = 0.0
        for k in range(held.size):
            along = p.d[k, 0] * v[0] + p.d[k, 1] * v[1] + p.d[k, 2] * v[2]
            new = min(max(held[k] + along / size[k], -p.level[k]), p.level[k])
            more = new - held[k]
            for a in range(3):
                v[a] -= h * more * ways[k, a]
            change = max(change, abs(more))
            held[k] = new
        if p.plane[0] > 0.0:
            change = max(change, _on_plane(p, v, h, inverse, plane))
        if change < SETTLED:
            break


@numba.njit
def _on_plane(p, v, h, inverse, plane):
    """One turn of the ellipse: the nearest of (x/Cx)^2 + (y/Cy)^2 <= 1 to what would stop the body. The change [N]."""
    heavy = h * max(inverse[0, 0], inverse[1, 1]) * 1.0001 + 1e-300
    x, y = plane[0] + v[0] / heavy, plane[1] + v[1] / heavy
    a, b = p.plane[0], p.plane[1]
    if (x / a) ** 2 + (y / b) ** 2 > 1.0:
        low, high = 0.0, a * abs(x) + b * abs(y) + abs(x) * a + abs(y) * b
        for _ in range(200):  # (a x/(a^2 + t))^2 + (b y/(b^2 + t))^2 = 1, by halving
            t = 0.5 * (low + high)
            if t in (low, high):  # no number between them
                break
            if (a * x / (a * a + t)) ** 2 + (b * y / (b * b + t)) ** 2 > 1.0:
                low = t
            else:
                high = t
        x, y = a * a * x / (a * a + high), b * b * y / (b * b + high)
    moved = max(abs(x - plane[0]), abs(y - plane[1]))
    for c in range(3):
        v[c] -= h * (inverse[c, 0] * (x - plane[0]) + inverse[c, 1] * (y - plane[1]))
    plane[0], plane[1] = x, y
    return moved
