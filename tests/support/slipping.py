"""Wheels that slip, event by event: modes of grip and stick, DOP853 between events. Shares no code with the engine.

M v' = G f + h,  m s' = K (u - E s)/R - f;   grip: s' = g . v', |f| <= mu N;   an axis at rest: v' = 0, |h| <= C

The first line is that of the centre of mass: M = diag(m, m, I) moves with the twist T v, and wrenches of the centre of
the wheels act there as T^-T w.
"""

import numpy as np
from scipy.integrate import solve_ivp

from omnidyn.model.wheels import per_wheel

EDGE = 1e-9  # [N] by which what holds and what drives must differ, for a draw to count
TINY = 1e-13  # [m/s] at which what was let go begins to move


class Slip:
    """A robot with friction on the axes alone; load (n,) of the wheels [N]."""

    def __init__(self, robot, load, shift=None):
        n, motor = robot.wheels.count, robot.motor
        at_rim = motor.gear_ratio / robot.wheels.radii
        self.G, self.n = robot.wheels.wrench_matrix, n
        self.M = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
        spins = motor.rotor_inertia * motor.gear_ratio**2 + per_wheel(robot.wheels.wheel_inertia, n)
        self.m = spins / robot.wheels.radii**2
        self.kt, self.ke, self.R = at_rim * motor.torque_constant, at_rim * motor.emf_constant, motor.resistance
        self.B, self.C = np.array(robot.friction.axes.viscous), np.array(robot.friction.axes.coulomb)
        self.limit = robot.wheels.traction_mu * load
        self.shift = robot.wheels.traction_mu * (np.zeros((n, 2)) if shift is None else shift)
        self.turning = robot.body.mass * robot.body.rotating_frame
        x, y = robot.body.centre
        self.T = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
        self.there = np.linalg.inv(self.T).T
        self.least = np.inf  # how near to an edge any decision was

    def forces(self, y, u, axis, contact):
        """(v', s', friction of the axes, traction) in a mode: axis (3,), contact (n,), 0 where held."""
        v, s, n = y[:3], y[3 : 3 + self.n], self.n
        driven = self.kt / self.R * (u - self.ke * s)
        c = self.T @ v
        free = self.there @ (-self.B * v) + self.turning * c[2] * np.array([c[1], -c[0], 0.0])
        # unknowns: v' (3), s' (n), h (3), f (n)
        a, b = np.zeros((6 + 2 * n, 6 + 2 * n)), np.zeros(6 + 2 * n)
        a[:3, :3], a[:3, 3 + n : 6 + n] = self.M[:, None] * self.T, -self.there
        a[:3, 6 + n :], b[:3] = -self.there @ self.G, free
        for k in range(3):
            row = 3 + n + k
            if axis[k] == 0:
                a[row, k] = 1.0
            else:
                a[row, row], b[row] = 1.0, -axis[k] * self.C[k]
        for w in range(n):
            a[3 + w, 3 + w], a[3 + w, 6 + n + w], b[3 + w] = self.m[w], 1.0, driven[w]
            row = 6 + n + w
            if contact[w] == 0:
                a[row, 3 + w], a[row, :3] = 1.0, -self.G[:, w]
            else:
                a[row, row] += 1.0
                b[row] = contact[w] * (self.limit[w] - self.shift[w] @ (self.B * v)[:2])
                a[row, 3 + n : 5 + n] -= contact[w] * self.shift[w]
                a[row, 6 + n :] -= contact[w] * self.shift[w] @ self.G[:2]
        x = np.linalg.solve(a, b)
        return x[:3], x[3 : 3 + n], x[3 + n : 6 + n], x[6 + n :]

    def limits(self, y, h, f):
        """What the floor takes of each wheel, by the forces it exerts itself."""
        return self.limit + self.shift @ (self.G[:2] @ f + h[:2] - (self.B * y[:3])[:2])

    def settled(self, y, u, axis, contact):
        """The mode after what cannot hold was let go, the worst first."""
        axis, contact = axis.copy(), contact.copy()
        for _ in range(3 + self.n):
            _, _, h, f = self.forces(y, u, axis, contact)
            over = np.concatenate([np.abs(h) / self.C, np.abs(f) / self.limits(y, h, f)]) - 1.0
            over[np.concatenate([axis, contact]) != 0] = -np.inf
            held = over[np.isfinite(over)]
            self.least = min([self.least, *np.abs(held)])
            worst = int(np.argmax(over))
            if over[worst] <= 0.0:
                break
            if worst < 3:
                axis[worst] = -np.sign(h[worst])
            else:
                contact[worst - 3] = np.sign(f[worst - 3])
        return axis, contact

    def run(self, voltage, dt, twist=(0.0, 0.0, 0.0)):
        """Twist, rim speeds and contacts after each row, shapes (rows + 1, 3), (rows + 1, n), (rows + 1, n); `pose`
        then has the places (x, y, heading), shape (rows + 1, 3)."""
        y = np.concatenate([twist, self.G.T @ twist, np.zeros(3)])
        axis, contact = np.sign(y[:3]), np.zeros(self.n)
        found, marks = [y.copy()], [contact.copy()]
        for u in voltage:
            left = dt
            axis, contact = self.settled(y, u, axis, contact)
            while left > 1e-13:
                y, axis, contact, took = self._to_event(y, u, axis, contact, left)
                left -= took
            found.append(y.copy())
            marks.append(contact.copy())
        found = np.array(found)
        self.pose = found[:, 3 + self.n :]
        return found[:, :3], found[:, 3 : 3 + self.n], np.array(marks)

    def _to_event(self, y, u, axis, contact, left):
        def rate(_, z):
            a, b, _, _ = self.forces(z, u, axis, contact)
            cos, sin = np.cos(z[-1]), np.sin(z[-1])
            return np.concatenate([a, b, [cos * z[0] - sin * z[1], sin * z[0] + cos * z[1], z[2]]])

        def watch(k):
            def value(t, z):
                _, _, h, f = self.forces(z, u, axis, contact)
                if k < 3:
                    return z[k] * axis[k] + TINY if axis[k] else self.C[k] - abs(h[k])
                w = k - 3
                slips = (z[3 + w] - self.G[:, w] @ z[:3]) * contact[w]
                return slips + TINY if contact[w] else self.limits(z, h, f)[w] - abs(f[w])

            value.terminal, value.direction = True, -1.0
            return value

        events = [watch(k) for k in range(3 + self.n)]
        out = solve_ivp(rate, (0.0, left), y, method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.02, events=events)
        z, took = out.y[:, -1].copy(), out.t[-1]
        if out.status == 1:
            for k in range(3 + self.n):
                if len(out.t_events[k]):
                    if k < 3 and axis[k]:
                        z[k], axis = 0.0, np.where(np.arange(3) == k, 0.0, axis)
                    elif k >= 3 and contact[k - 3]:
                        z[k] = self.G[:, k - 3] @ z[:3]
                        contact = np.where(np.arange(self.n) == k - 3, 0.0, contact)
                    elif k < 3:
                        axis = np.where(np.arange(3) == k, -np.sign(self.forces(z, u, axis, contact)[2][k]), axis)
                    else:
                        pushed = np.sign(self.forces(z, u, axis, contact)[3][k - 3])
                        contact = np.where(np.arange(self.n) == k - 3, pushed, contact)
            axis, contact = self.settled(z, u, axis, contact)
        for w in range(self.n):
            if contact[w] == 0:
                z[3 + w] = self.G[:, w] @ z[:3]
        return z, axis, contact, took
