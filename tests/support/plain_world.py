"""A robot of a few lines, to make logs with: plain arrays, and nothing of omnidyn in it.

Friction is a list of elements, each a direction d in (x, y, yaw) with the most force it holds against d . twist > 0 and
< 0, and a cone for what acts against the direction of travel. Semi-implicit Euler steps, all elements by a projected
Gauss-Seidel iteration:

    M (v+ - v)/h = G f(u, v+) - B v+ - sum d s,     s in [-back, front],     s at its bound where d . v+ is not 0
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

STEP, SWEEPS, SETTLED = 2e-3, 60, 1e-9  # [s], of the iteration, [N]


@dataclass
class World:
    """azimuth [degree], roller [degree] of each wheel. elements: (d, back, front). cone: level along (x, y), [N].

    gain [N/V], brake [N s/m]: push of a wheel is gain u - brake (its rim speed). per_ampere [N/A].
    """

    azimuth: tuple = (180.0, -60.0, 60.0)
    roller: tuple = (0.0, 0.0, 0.0)
    arm: float = 0.1
    radius: float = 0.035
    mass: float = 1.5
    inertia: float = 0.025
    per_ampere: float = 0.0059 * 19.0 / 0.035
    ohm: float = 1.69
    emf: float = 0.0059 * 19.0 / 0.035  # [V s/m] at the rim
    elements: list = field(default_factory=list)
    cone: tuple = (0.0, 0.0)
    viscous: tuple = (0.0, 0.0, 0.0)

    @property
    def push(self) -> np.ndarray:
        """A column (F_x, F_y, T) per wheel that pushes with 1 N."""
        phi, gamma = np.radians(self.azimuth), np.tan(np.radians(self.roller))
        x, y = -np.sin(phi) - gamma * np.cos(phi), np.cos(phi) - gamma * np.sin(phi)
        return np.stack([x, y, np.full(len(phi), self.arm)])

    def friction(self, twist) -> np.ndarray:
        """What drives at a steady twist; elements at rest hold nothing."""
        force = np.array(self.viscous) * twist
        for d, back, front in self.elements:
            speed = np.dot(d, twist)
            force = force + np.array(d) * (front if speed > 1e-9 else -back if speed < -1e-9 else 0.0)
        c, way = np.array(self.cone), np.array(twist[:2])
        size = np.hypot(*(c * way))
        force[:2] += c**2 * way / size if size > 0.0 else 0.0
        return force

    def voltage(self, twist) -> np.ndarray:
        """Under which the twist is steady, and the wheels do not work against each other."""
        force = np.linalg.pinv(self.push) @ self.friction(twist)
        return self.ohm / self.per_ampere * force + self.emf * (self.push.T @ twist)

    def drive(self, voltage, seconds: float, row: float = 0.01):
        """From rest under held voltages: (t, twist (n, 3), current (n, wheels), wheel speed (n, wheels))."""
        g, steps = self.push, round(seconds / STEP)
        table = np.array([[*d, back, front] for d, back, front in self.elements], dtype=float).reshape(-1, 5)
        twist = _march(
            np.array([self.mass, self.mass, self.inertia]),
            g,
            np.asarray(voltage, dtype=float),
            self.per_ampere / self.ohm,
            self.emf,
            table,
            np.array(self.cone),
            np.array(self.viscous),
            steps,
        )[:: round(row / STEP)]
        rim = twist @ g
        return np.arange(len(twist)) * row, twist, (voltage - self.emf * rim) / self.ohm, rim / self.radius


@numba.njit(cache=True)
def _march(mass, g, voltage, per_volt, emf, table, cone, viscous, steps):
    """The twist after each step, shape (steps + 1, 3)."""
    found, v = np.zeros((steps + 1, 3)), np.zeros(3)
    held, pull = np.zeros(len(table)), np.zeros(2)
    stiff = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            for w in range(len(voltage)):
                stiff[a, b] += per_volt * emf * g[a, w] * g[b, w]
        stiff[a, a] += viscous[a] + mass[a] / STEP
    give, drive, rhs = np.linalg.inv(stiff), np.zeros(3), np.zeros(3)
    for a in range(3):
        for w in range(len(voltage)):
            drive[a] += per_volt * g[a, w] * voltage[w]
    toward, own = np.zeros((len(table), 3)), np.zeros(len(table))
    for e in range(len(table)):
        for a in range(3):
            for b in range(3):
                toward[e, a] += give[a, b] * table[e, b]
        for a in range(3):
            own[e] += table[e, a] * toward[e, a]
    for k in range(steps):
        for a in range(3):
            rhs[a] = mass[a] / STEP * v[a] + drive[a]
            for e in range(len(table)):
                rhs[a] -= table[e, a] * held[e]
            if a < 2:
                rhs[a] -= pull[a]
        for a in range(3):
            v[a] = give[a, 0] * rhs[0] + give[a, 1] * rhs[1] + give[a, 2] * rhs[2]
        for _ in range(SWEEPS):
            moved = 0.0
            for e in range(len(table)):
                speed = table[e, 0] * v[0] + table[e, 1] * v[1] + table[e, 2] * v[2]
                new = min(max(held[e] + speed / own[e], -table[e, 3]), table[e, 4])
                change = new - held[e]
                for a in range(3):
                    v[a] -= toward[e, a] * change
                held[e] = new
                moved = max(moved, abs(change))
            if cone[0] > 0.0:
                rate = max(give[0, 0], give[1, 1]) + abs(give[0, 1])
                try_x, try_y = pull[0] + v[0] / rate, pull[1] + v[1] / rate
                new_x, new_y = _into_ellipse(try_x, try_y, cone[0], cone[1])
                for a in range(3):
                    v[a] -= give[a, 0] * (new_x - pull[0]) + give[a, 1] * (new_y - pull[1])
                moved = max(moved, abs(new_x - pull[0]) + abs(new_y - pull[1]))
                pull[0], pull[1] = new_x, new_y
            if moved < SETTLED:
                break
        found[k + 1] = v
    return found


@numba.njit(cache=True)
def _into_ellipse(x, y, a, b):
    """The point of the ellipse with half axes a, b next to (x, y); the point itself inside."""
    if (x / a) ** 2 + (y / b) ** 2 <= 1.0:
        return x, y
    low, high = 0.0, a * abs(x) + b * abs(y)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (a * x / (a * a + middle)) ** 2 + (b * y / (b * b + middle)) ** 2 > 1.0:
            low = middle
        else:
            high = middle
    return a * a * x / (a * a + low), b * b * y / (b * b + low)


def turned_box(degrees, one, other, yaw=0.0):
    """Elements of a box whose axes are turned against those of the body."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return [((c, s, 0.0), one, one), ((-s, c, 0.0), other, other), ((0.0, 0.0, 1.0), yaw, yaw)]


def at_wheels(world, level):
    """An element at the rim of every wheel."""
    return [(tuple(column), level, level) for column in world.push.T]


def on_rollers(world, level):
    """An element along the axle of every wheel, where the rollers turn."""
    return [((np.cos(a), np.sin(a), 0.0), level, level) for a in np.radians(world.azimuth)]


def spoiled(log, rng, *, noise=0.1, between=0.03, step=0.02):
    """(t, current, wheel speed) as a logger has them: noise [A], a share by which runs differ, steps, spikes."""
    t, _, current, speed = log
    current = current * (1.0 + between * rng.standard_normal()) + noise * rng.standard_normal(current.shape)
    current = np.where(rng.random(current.shape) < 0.005, 5.0, current)
    speed = speed + 0.3 * rng.standard_normal(speed.shape)
    return t, step * np.round(current / step), 0.25 * np.round(speed / 0.25)


def steady_logs(world, twists, seconds=2.0):
    """[(twist asked for, log from rest under the voltage for it)]."""
    return [(twist, world.drive(world.voltage(twist), seconds)) for twist in map(np.asarray, twists)]


def fan(speeds=(0.4,), step=15, first=0.0):
    """Twists in all directions, every `step` degrees."""
    angles = np.radians(np.arange(first, 360.0 + first, step))
    return [np.array([*np.round([s * np.cos(a), s * np.sin(a)], 12), 0.0]) for s in speeds for a in angles]
