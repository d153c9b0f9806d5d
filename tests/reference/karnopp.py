"""Robots with Karnopp's law everywhere, as a momentum that gathers: DOP853 from event to event, no solver of ours.

    M w' = F(v, i) - friction,   v = P w,   P: orthogonal in M onto {v: d_e . v = 0 for what rests}

Friction of what rests makes w' the least of 1/2 w' M w' - F . w' + sum S_e |d_e . w'| (`Problem` of modes_friction.py).
An element comes to rest where |d . v| < Dv. It is let go where |d . w| >= Dv and it then moves at Dv or more: of all
that move or want to, those too slow are put to rest until none is. Settled or dynamic currents without drop, limit or
gear loss. State: w, pose, currents.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853
from scipy.linalg import null_space

from tests.reference.modes_friction import Problem
from tests.reference.modes_plant import plant_of, to_centre

SAMPLES = np.linspace(0.0, 1.0, 13)[1:]
ELLIPSE = -1


class Karnopp:
    """One robot on its way. rests: the elements in their bands."""

    def __init__(self, robot):
        self.p = p = plant_of(robot.replace(friction=robot.friction.rigid))
        axes, way, rim = robot.friction.axes, robot.friction.direction, robot.friction.wheels
        yaw = axes.karnopp_speed[2] if axes.coulomb[2] > 0.0 else way.yaw_karnopp_speed
        along = dict(zip("xyw", (*axes.karnopp_speed[:2], yaw), strict=True))
        rims = np.broadcast_to(rim.karnopp_speed, p.wheels)
        self.band = {e: along[n] if p.wheel[e] < 0 else rims[p.wheel[e]] for e, n in enumerate(p.names)}
        if p.hold_ellipse is not None:
            self.band[ELLIPSE] = way.karnopp_speed
        self.inverse = np.linalg.inv(p.M)
        self.z = np.zeros(6 + (p.wheels if p.dynamic else 0))
        self.enter(frozenset(self.band))

    def rows(self, e):
        """Directions of an element, its speed the norm of them times v."""
        return np.eye(3)[:2] if e == ELLIPSE else self.p.direction[e : e + 1]

    def projection(self, rests):
        """P of what rests."""
        if not rests:
            return np.eye(3)
        free = null_space(np.vstack([self.rows(e) for e in sorted(rests)]), rcond=1e-10)
        return free @ np.linalg.solve(free.T @ self.p.M @ free, free.T @ self.p.M) if free.size else np.zeros((3, 3))

    def enter(self, rests):
        """A mode: what rests, and the signs of what slides."""
        self.rests, self.P = rests, self.projection(rests)
        v = self.P @ self.z[:3]
        self.sign = {e: math.copysign(1.0, self.rows(e)[0] @ v) for e in self.band if e not in rests and e != ELLIPSE}

    def ends(self, w):
        """Whether anything is to enter or to leave its band, or has passed it since the mode began."""
        v = self.P @ w
        for e in self.band:
            if e in self.sign and self.sign[e] * (self.rows(e)[0] @ v) < self.band[e] * (1 - 1e-9):
                return True
            if e not in self.rests and np.linalg.norm(self.rows(e) @ v) < self.band[e] * (1 - 1e-9):
                return True
        return self.next(w) != self.rests

    def next(self, w):
        """What rests after w."""
        moves = set(self.band) - self.rests
        wants = {e for e in self.rests if np.linalg.norm(self.rows(e) @ w) >= self.band[e]}
        moves |= wants
        while True:
            v = self.projection(frozenset(self.band) - moves) @ w
            slow = {e for e in moves if np.linalg.norm(self.rows(e) @ v) < self.band[e] * (1 - 1e-9)}
            if not slow:
                return frozenset(self.band) - moves
            moves -= slow

    def rates(self, z, u):
        p, n = self.p, self.p.wheels
        v = self.P @ z[:3]
        current = z[6 : 6 + n] if p.dynamic else (u - p.E * (p.G.T @ v)) / p.R
        force = p.G @ (p.K * current) - p.viscous @ v
        if p.turning:
            force = force + p.mass[0] * v[2] * np.array([v[1], -v[0], 0.0])
        for e, s in self.sign.items():
            force = force - p.direction[e] * (p.slide[e, 0] if s > 0 else -p.slide[e, 1])
        if ELLIPSE in self.band and ELLIPSE not in self.rests:
            c = p.slide_ellipse
            force = force - np.append(c * c * v[:2] / math.hypot(*(c * v[:2])), 0.0)
        out = np.zeros(len(z))
        out[:3] = self.accelerate(force)
        cos, sin = math.cos(z[5]), math.sin(z[5])
        out[3], out[4], out[5] = cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]
        if p.dynamic:
            out[6 : 6 + n] = (u - p.E * (p.G.T @ v) - p.R * z[6 : 6 + n]) / p.L
        return out

    def accelerate(self, force):
        """w'."""
        p, rests = self.p, [e for e in self.rests if e != ELLIPSE]
        if not self.rests:
            return self.inverse @ force
        flat = ELLIPSE in self.rests
        return Problem(p, force, rests, flat, p.hold[:, 0], p.hold[:, 1], p.hold_ellipse if flat else None).solve()[0]

    def row(self, u, h, rtol, atol):
        """One row of held voltage."""
        t = 0.0
        while h - t > 1e-15:
            if not self.p.dynamic and len(self.rests) == len(self.band) and not np.any(self.P):
                end = self.gathered(u, h - t)
            else:
                end = self.integrated(u, h - t, rtol, atol)
            t += end

    def gathered(self, u, left):
        """All rests under a held voltage: w grows in a straight line, up to the first that leaves. Returns how long."""
        z, rate = self.z.copy(), self.rates(self.z, u)
        if not np.any(rate[:3]):
            return left
        reach = [0.0, left]
        if not self.ends(z[:3] + left * rate[:3]):
            later = np.linspace(0.0, left, 400)
            late = [t for t in later if self.ends(z[:3] + t * rate[:3])]
            if not late:
                self.z[:3] += left * rate[:3]
                return left
            reach[1] = late[0]
        for _ in range(60):
            middle = 0.5 * (reach[0] + reach[1])
            reach[self.ends(z[:3] + middle * rate[:3])] = middle
        self.z[:3] = z[:3] + reach[1] * rate[:3]
        self.enter(self.next(self.z[:3]))
        return reach[1]

    def integrated(self, u, left, rtol, atol):
        """The same where anything moves."""
        solver = DOP853(lambda t, z: self.rates(z, u), 0.0, self.z, left, rtol=rtol, atol=atol, max_step=5e-3)
        while solver.status == "running":
            begun = solver.t
            message = solver.step()
            assert solver.status != "failed", message
            dense = solver.dense_output()
            for share in SAMPLES:
                end = begun + share * (solver.t - begun)
                if self.ends(dense(end)[:3]):
                    low = begun
                    for _ in range(60):
                        middle = 0.5 * (low + end)
                        low, end = (low, middle) if self.ends(dense(middle)[:3]) else (middle, end)
                    self.z = dense(end).copy()
                    self.enter(self.next(self.z[:3]))
                    return end
        self.z = solver.y.copy()
        return left


def reference(robot, voltage, dt, rtol=1e-11, atol=1e-13):
    """(twist, pose, whether x, y, yaw rest), shape (rows + 1, 3) each, from rest with nothing gathered."""
    run, (x, y), back = Karnopp(robot), robot.body.centre, np.linalg.inv(to_centre(robot))
    run.z[3:5] = x, y
    out = [(np.zeros(3), np.zeros(3), np.ones(3, bool))]
    for u, h in zip(np.asarray(voltage, dtype=float), np.broadcast_to(dt, len(voltage)), strict=True):
        run.row(u, h, rtol, atol)
        cos, sin = math.cos(run.z[5]), math.sin(run.z[5])
        place = run.z[3:6] - [cos * x - sin * y, sin * x + cos * y, 0.0]
        stuck = np.abs(back @ run.P).max(axis=1) < 1e-9
        out.append((np.where(stuck, 0.0, back @ run.P @ run.z[:3]), place, stuck))
    return tuple(np.array(part) for part in zip(*out, strict=True))
