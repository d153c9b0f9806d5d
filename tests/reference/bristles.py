"""Robots with bristles (Dahl, LuGre, elasto-plastic) as an ordinary differential equation, for scipy's DOP853.

    M nu' = sum g_i K i + m omega (v_y, -v_x, 0) - B nu - sum_e d_e (s0 z + s1(s) z' )_e - (plane: s0 z + s1 z')
    z_e' = s - s0 |s| z / g(s)      LuGre;      z_e' = s |w|^a sgn w, w = 1 - s0 z sgn(s)/C      Dahl
    z_e' = s (1 - alpha(w) w), w = s0 z sgn(s)/g(s)                                          elasto-plastic
    plane, Z_a = s0 z_a / C_a(v), V_a = C_a v_a:
        C_a z_a' = V_a - |V| Z_a                                LuGre
        C_a z_a' = |V| |V/|V| - Z|^(a-1) (V/|V| - Z)_a          Dahl
        z_a' = v_a - l Z_a / C_a, l = alpha(|Z|) |Z| l*         elasto-plastic; l* >= 0 is what keeps |Z| as it is

Written from the papers, with the wrench matrix and the numbers of a Robot only. Settled currents without drop, limit or
gear loss; or dynamic ones. State: twist, pose, currents, bends of axes, of wheels, of the plane.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853

from tests.reference.modes_plant import FALLS, plant_of, to_centre

BENDS = ("dahl", "lugre", "elastoplastic")


def alpha(w, b):
    """Of the paper of 2002: what share of a motion slips."""
    if w <= b:
        return 0.0
    return 1.0 if w >= 1.0 else 0.5 * math.sin(math.pi * (w - 0.5 * (1.0 + b)) / (1.0 - b)) + 0.5


def rate_of(s, bent, power=1.0, elastic=None):
    """z' of a bristle at a speed; bent: s0 z/g. power: Dahl's exponent; elastic: b of elasto-plastic ones, or None."""
    w = bent * math.copysign(1.0, s)
    if elastic is not None:
        return s * (1.0 - alpha(w, elastic) * w)
    return s - abs(s) * bent if power == 1.0 else s * math.copysign(abs(1.0 - w) ** power, 1.0 - w)


def plane_rate(law, v, z, c):
    """z' of a bristle along the direction of travel, the levels c (2,) being those of now."""
    Z, V = law.stiffness * z / c, c * v
    size = math.hypot(*V)
    if size == 0.0:
        return np.zeros(2)
    if law.law == "elastoplastic":
        normal = Z / c
        keeps = max(normal @ v, 0.0) / max(normal @ normal, 1e-300)
        far = math.hypot(*Z)
        return v - alpha(far, law.elastic_share) * far * keeps * normal
    left = V / size - Z
    power = law.dahl_exponent - 1.0 if law.law == "dahl" else 0.0
    return size * math.hypot(*left) ** power * left / c if power else size * left / c


class Bristles:
    """The right-hand side of one robot."""

    def __init__(self, robot):
        rigid = robot.replace(friction=robot.friction.rigid)
        self.p, n = plant_of(rigid), robot.wheels.count
        self.kind, self.rows = [], []
        axes, way, rim = robot.friction.axes, robot.friction.direction, robot.friction.wheels
        m, along = self.p.mass, np.linalg.inv(to_centre(robot))  # axes of the wheels, seen from the centre of mass
        if axes.law in BENDS:
            for k in range(3):
                self._add(axes, along[k], k, m[k], axes.viscous[k], lambda v, k=k: None if v is None else v[k])
        if way.law in BENDS and way.yaw_coulomb > 0.0:
            turning = way.model_copy(
                update={
                    name: getattr(way, f"yaw_{name}")
                    for name in ("coulomb", "breakaway", "stribeck_speed", "stiffness", "damping", "damping_speed")
                }
            )
            self._add(turning, np.eye(3)[2], 2, m[2], way.yaw_viscous, lambda v: v)
        if rim.law in BENDS:
            for k in range(n):
                g = robot.wheels.wrench_matrix[:, k]
                mass = m[0] / (g[0] ** 2 + g[1] ** 2 + g[2] ** 2 * m[0] / m[2])

                def pick(v, k=k):
                    return v[k] if isinstance(v, tuple) else v

                self._add(rim, self.p.G[:, k], k, mass, pick(rim.viscous), pick)
        self.way = way if way.law in BENDS and any(way.coulomb) else None
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
            damping = max(2 * math.sqrt(stiff * mass) - viscous, 0.0) if law.law != "dahl" else 0.0
        fades, falls = pick(law.damping_speed) or math.inf, pick(law.stribeck_speed) or math.inf
        power = law.dahl_exponent if law.law == "dahl" else 1.0
        elastic = law.elastic_share if law.law == "elastoplastic" else None
        fall = (falls, law.stribeck_exponent, law.stribeck_shape)
        self.rows.append((d, slide, hold, back, hold_back, stiff, damping, fades, fall, power, elastic))

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
            fallen = FALLS[w.stribeck_shape](slow, w.stribeck_exponent)
            c = np.array(w.coulomb) + (np.array(w.breakaway or w.coulomb) - w.coulomb) * fallen
            rate = plane_rate(w, v[:2], z[at : at + 2], c)
            damping = w.damping
            if damping is None:
                damping = max(2 * math.sqrt(w.stiffness * p.mass[0]) - w.viscous, 0.0) if w.law != "dahl" else 0.0
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
        d, slide, hold, back, hold_back, stiff, damping, fades, fall, power, elastic = row
        s = float(d @ v)
        low, high = (slide, hold) if s >= 0 else (back, hold_back)
        g = low + (high - low) * FALLS[fall[2]](abs(s) / fall[0], fall[1])
        rate = rate_of(s, stiff * z / g, power, elastic)
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
