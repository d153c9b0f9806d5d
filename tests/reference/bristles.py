"""Robots with bristles (Dahl, LuGre) as an ordinary differential equation, for scipy's DOP853: no solver of ours.

    M nu' = sum g_i K i + m omega (v_y, -v_x, 0) - B nu - sum_e d_e (s0 z + s1(s) z' )_e - (plane: s0 z + s1 z')
    z_e' = s - s0 |s| z / g(s)      LuGre;      z_e' = s |w|^a sgn w, w = 1 - s0 z sgn(s)/C      Dahl
    plane: z_a' = v_a - s0 D(v) z_a / C_a(v)^2,  D^2 = Cx^2 vx^2 + Cy^2 vy^2

Written from the papers, with the wrench matrix and the numbers of a Robot only. Settled currents without drop, limit or
gear loss; or dynamic ones. State: twist, pose, currents, bends of axes, of wheels, of the plane.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853

from tests.reference.modes_plant import left_at, plant_of, to_centre


class Bristles:
    """The right-hand side of one robot."""

    def __init__(self, robot):
        rigid = robot.replace(friction=robot.friction.rigid)
        self.p, n = plant_of(rigid), robot.wheels.count
        self.kind, self.rows = [], []
        axes, way, rim = robot.friction.axes, robot.friction.direction, robot.friction.wheels
        m, along = self.p.mass, np.linalg.inv(to_centre(robot))  # axes of the wheels, seen from the centre of mass
        if axes.law in ("dahl", "lugre"):
            for k in range(3):
                self._add(axes, along[k], k, m[k], axes.viscous[k], lambda v, k=k: None if v is None else v[k])
        if way.law in ("dahl", "lugre") and way.yaw_coulomb > 0.0:
            turning = way.model_copy(
                update={
                    name: getattr(way, f"yaw_{name}")
                    for name in ("coulomb", "breakaway", "stribeck_speed", "stiffness", "damping", "damping_speed")
                }
            )
            self._add(turning, np.eye(3)[2], 2, m[2], way.yaw_viscous, lambda v: v)
        if rim.law in ("dahl", "lugre"):
            for k in range(n):
                g = robot.wheels.wrench_matrix[:, k]
                mass = m[0] / (g[0] ** 2 + g[1] ** 2 + g[2] ** 2 * m[0] / m[2])

                def pick(v, k=k):
                    return v[k] if isinstance(v, tuple) else v

                self._add(rim, self.p.G[:, k], k, mass, pick(rim.viscous), pick)
        self.way = way if way.law in ("dahl", "lugre") and any(way.coulomb) else None
        self.first = 6 + (n if self.p.dynamic else 0)
        self.inverse = np.linalg.inv(self.p.M)

    def _add(self, law, d, k, mass, viscous, pick):
        slide = pick(law.coulomb)
        if slide == 0.0:
            return
        hold = pick(law.breakaway) or slide
        back = pick(getattr(law, "coulomb_backward", None)) or slide
        hold_back = pick(getattr(law, "breakaway_backward", None)) or (hold if back == slide else back)
        stiff = pick(law.stiffness)
        damping = pick(law.damping)
        if damping is None:
            damping = max(2 * math.sqrt(stiff * mass) - viscous, 0.0) if law.law == "lugre" else 0.0
        fades, falls = pick(law.damping_speed) or math.inf, pick(law.stribeck_speed) or math.inf
        power = law.dahl_exponent if law.law == "dahl" and hasattr(law, "dahl_exponent") else 1.0
        fall = (falls, law.stribeck_exponent, law.stribeck_shape == "lorentzian")
        self.rows.append((d, slide, hold, back, hold_back, stiff, damping, fades, fall, power))

    def rates(self, z, u):
        p, n = self.p, self.p.wheels
        v = z[:3]
        current = z[6 : 6 + n] if p.dynamic else (u - p.E * (p.G.T @ v)) / p.R
        force = p.G @ (p.K * current) - p.viscous @ v
        if p.turning:
            force = force + p.mass[0] * v[2] * np.array([v[1], -v[0], 0.0])
        out = np.zeros(len(z))
        at = self.first
        for row in self.rows:
            force, out[at] = self._one(row, v, z[at], force)
            at += 1
        if self.way is not None:
            w = self.way
            slow = math.hypot(v[0], v[1]) / (w.stribeck_speed or math.inf)
            fallen = left_at(slow, w.stribeck_exponent, w.stribeck_shape == "lorentzian")
            c = np.array(w.coulomb) + (np.array(w.breakaway or w.coulomb) - w.coulomb) * fallen
            work = math.hypot(c[0] * v[0], c[1] * v[1])
            rate = v[:2] - w.stiffness * work * z[at : at + 2] / c**2
            damping = w.damping
            if damping is None:
                damping = max(2 * math.sqrt(w.stiffness * p.mass[0]) - w.viscous, 0.0) if w.law == "lugre" else 0.0
            damping *= math.exp(-(((v[0] ** 2 + v[1] ** 2) ** 0.5 / (w.damping_speed or math.inf)) ** 2))
            force = force - np.append(w.stiffness * z[at : at + 2] + damping * rate, 0.0)
            out[at : at + 2] = rate
        out[:3] = self.inverse @ force
        cos, sin = math.cos(z[5]), math.sin(z[5])
        out[3], out[4], out[5] = cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]
        if p.dynamic:
            out[6 : 6 + n] = (u - p.E * (p.G.T @ v) - p.R * z[6 : 6 + n]) / p.L
        return out

    def _one(self, row, v, z, force):
        d, slide, hold, back, hold_back, stiff, damping, fades, fall, power = row
        s = float(d @ v)
        low, high = (slide, hold) if s >= 0 else (back, hold_back)
        g = low + (high - low) * left_at(abs(s) / fall[0], *fall[1:])
        if power == 1.0:
            rate = s - stiff * abs(s) * z / g
        else:
            w = 1 - stiff * z * math.copysign(1.0, s) / g
            rate = s * math.copysign(abs(w) ** power, w)
        damped = damping * math.exp(-((s / fades) ** 2)) * rate
        return force - d * (stiff * z + damped), rate


def reference(robot, voltage, dt, rtol=1e-11, atol=1e-13):
    """(twist, pose), shape (rows + 1, 3), from rest with bristles unbent."""
    model, (x, y) = Bristles(robot), robot.body.centre
    z = np.zeros(model.first + len(model.rows) + (2 if model.way is not None else 0))
    z[3:5] = x, y
    out = [z.copy()]
    for u, h in zip(np.asarray(voltage, dtype=float), np.broadcast_to(dt, len(voltage)), strict=True):
        solver = DOP853(lambda t, y, u=u: model.rates(y, u), 0.0, z, h, rtol=rtol, atol=atol)
        while solver.status == "running":
            message = solver.step()
            assert solver.status != "failed", message
        z = solver.y.copy()
        out.append(z.copy())
    found = np.array(out)
    cos, sin = np.cos(found[:, 5]), np.sin(found[:, 5])
    place = found[:, 3:6] - np.stack([cos * x - sin * y, sin * x + cos * y, 0.0 * cos], axis=1)
    return found[:, :3] @ np.linalg.inv(to_centre(robot)).T, place
