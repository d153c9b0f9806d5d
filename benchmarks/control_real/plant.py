"""A plant that shares no code with omnidyn: Moreau time stepping, friction as bounded impulses.

The impulses are found by projected Gauss-Seidel.

Body frame x forward, y left, yaw counter-clockwise. Ported from the plant with which causes of bad closed
loops were found on 27 November 2026.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from omnidyn.arrays import FloatArray

SUBSTEP = 4e-4  # [s]
SWEEPS, CONVERGED, AT_REST = 200, 1e-13, 1e-9
BATTERY_LAG = 0.01  # [s] of the current that lowers the voltage of a battery


def wrench_matrix(azimuth: FloatArray, lever: float, roller: FloatArray) -> FloatArray:
    """Directions in which wheels push the body: azimuth and roller angle [deg], lever [m]. Shape (3, wheels)."""
    phi, angle = np.radians(azimuth), np.radians(roller) * np.ones(len(azimuth))
    along, outward = np.stack([-np.sin(phi), np.cos(phi)]), np.stack([np.cos(phi), np.sin(phi)])
    return np.ascontiguousarray(np.vstack([along - np.tan(angle) * outward, np.full(len(phi), lever)]))


@njit(cache=True)
def advance(state, before, impulse, seconds, volts, push, motors, matrices, axes, disc, battery, flags):
    """Move `state` (pose, twist, wheel angles) on by a time; see Plant for the tables."""
    steps = math.ceil(seconds / SUBSTEP - 1e-9)
    h, wheels = seconds / steps, motors.shape[1]
    directions, inverse = matrices[:3], matrices[3:, :3]
    force, twist = np.zeros(3), state[3:6]
    new, middle = np.zeros(3), np.zeros(3)
    turning, duty, limit = flags[0], flags[1], flags[2]
    for _ in range(steps):
        level = battery[0] - battery[1] * battery[2]
        for a in range(3):
            middle[a] = twist[a] + 0.5 * (twist[a] - before[a])
            force[a] = push[a] - axes[0, a] * middle[a] - (disc[4] * middle[a] if a < 2 else 0.0)
        force[0] += turning * middle[2] * middle[1]
        force[1] -= turning * middle[2] * middle[0]
        drawn = 0.0
        for i in range(wheels):
            rim = directions[0, i] * middle[0] + directions[1, i] * middle[1] + directions[2, i] * middle[2]
            applied = volts[i] * level if duty > 0.0 else min(max(volts[i], -level), level)
            current = min(max((applied - motors[3, i] * rim) / motors[1, i], -limit), limit)
            drawn += abs(current * applied) / level
            for a in range(3):
                force[a] += directions[a, i] * motors[0, i] * current
        battery[2] += (drawn - battery[2]) * h / BATTERY_LAG
        for a in range(3):
            new[a] = twist[a]
            for k in range(3):
                new[a] += h * inverse[a, k] * (force[k] - impulse[k] - (impulse[3 + k] if k < 2 else 0.0))
        rests = abs(twist[0]) < AT_REST and abs(twist[1]) < AT_REST
        for _ in range(SWEEPS):
            largest = 0.0
            for a in range(3):
                most = axes[2, a] if abs(twist[a]) < AT_REST else axes[1, a]
                if most > 0.0:
                    change = min(max(impulse[a] + new[a] / (h * inverse[a, a]), -most), most) - impulse[a]
                    impulse[a] += change
                    for k in range(3):
                        new[k] -= h * inverse[k, a] * change
                    largest = max(largest, abs(h * change * inverse[a, a]))
            if disc[0] > 0.0:
                cx, cy = (disc[2], disc[3]) if rests else (disc[0], disc[1])
                rho = 1.0 / (h * max(inverse[0, 0], inverse[1, 1]) * max(cx, cy) ** 2)
                x, y = impulse[3] / cx + rho * cx * new[0], impulse[4] / cy + rho * cy * new[1]
                size = max(1.0, math.sqrt(x * x + y * y))
                dx, dy = x / size * cx - impulse[3], y / size * cy - impulse[4]
                impulse[3] += dx
                impulse[4] += dy
                for k in range(3):
                    new[k] -= h * (inverse[k, 0] * dx + inverse[k, 1] * dy)
                largest = max(largest, h * max(abs(dx), abs(dy)) * inverse[0, 0])
            if largest < CONVERGED:
                break
        for a in range(3):
            new[a] = 0.0 if abs(new[a]) < 1e-11 else new[a]
            middle[a] = 0.5 * (twist[a] + new[a])
        turn = h * middle[2]
        c, s = math.cos(state[2] + 0.5 * turn), math.sin(state[2] + 0.5 * turn)
        state[0] += h * (c * middle[0] - s * middle[1])
        state[1] += h * (s * middle[0] + c * middle[1])
        state[2] += turn
        for i in range(wheels):
            rim = directions[0, i] * middle[0] + directions[1, i] * middle[1] + directions[2, i] * middle[2]
            state[6 + i] += h * rim / motors[2, i]
        for a in range(3):
            before[a], twist[a] = twist[a], new[a]


class Plant:
    """A robot in SI units. All of `numbers` is what a robot file says of it, in words of this module.

    With "loop" (k_p [V s/rad], k_i [V/rad], rate [Hz]) its firmware takes speeds of the wheels:
    volts = k_p (command - speed) + k_i sum, which stops to sum where the volts are at their limit.

    twist, pose, wheel_angle: the truth now.
    """

    def __init__(self, numbers: dict[str, Any]) -> None:
        self.numbers = numbers
        azimuth = np.asarray(numbers["azimuth"], float)
        wheels = self.wheels = len(azimuth)
        one = np.ones(wheels)
        self.directions = wrench_matrix(azimuth, numbers["lever"], np.asarray(numbers.get("roller", 0.0)))
        self.radius = numbers["radius"] * one
        per_rim = numbers["gear"] / self.radius * np.asarray(numbers.get("weak", 1.0))
        constant, emf = per_rim * numbers["constant"], per_rim * numbers.get("emf", numbers["constant"])
        self.motors = np.vstack([constant, numbers["resistance"] * one, self.radius, emf])
        spin = numbers.get("rotor", 0.0) * numbers["gear"] ** 2 / self.radius**2
        body = np.diag([numbers["mass"], numbers["mass"], numbers["inertia"]])
        self.mass = body + self.directions @ np.diag(spin) @ self.directions.T
        matrices = np.zeros((6, max(3, wheels)))
        matrices[:3, :wheels], matrices[3:, :3] = self.directions, np.linalg.inv(self.mass)
        self.matrices = matrices
        dry = np.asarray(numbers.get("coulomb", (0.0, 0.0, 0.0)), float)
        hold = np.asarray(numbers.get("breakaway", dry), float)
        self.axes = np.array([numbers.get("viscous", (0.0, 0.0, 0.0)), dry, hold], float)
        disc = numbers.get("disc", (0.0, 0.0))
        self.disc = np.array([*disc, *numbers.get("disc_breakaway", disc), numbers.get("disc_viscous", 0.0)], float)
        self.duty, self.volts = numbers.get("duty", False), float(numbers["volts"])
        turning = numbers["mass"] if numbers.get("turning", True) else 0.0
        self.flags = np.array([turning, float(self.duty), numbers.get("amperes", 1e9)])
        self.loop = numbers.get("loop")
        self.latency, self.counts = numbers.get("latency", 0.0), numbers["counts"]
        self.push = np.zeros(3)
        self.reset(np.zeros(3))

    @property
    def friction(self) -> FloatArray:
        """Dry friction along each axis [N, N, N m]. Shape (3,)."""
        return self.axes[1] + np.array([self.disc[0], self.disc[1], 0.0])

    @property
    def viscous(self) -> FloatArray:
        """Viscous friction of each axis [N s/m, N s/m, N m s]. Shape (3,)."""
        return self.axes[0] + np.array([self.disc[4], self.disc[4], 0.0])

    def reset(self, pose: FloatArray) -> None:
        """At rest, at a pose."""
        self.state = np.array([*pose, *np.zeros(3 + self.wheels)])
        self._before, self._impulse, self._queue, self.t = np.zeros(3), np.zeros(5), [], 0.0
        self._sent, self._sum = np.zeros(self.wheels), np.zeros(self.wheels)
        self._battery = np.array([self.volts, self.numbers.get("sag", 0.0), 0.0])

    @property
    def pose(self) -> FloatArray:
        """Where it is. Shape (3,)."""
        return self.state[:3].copy()

    @property
    def twist(self) -> FloatArray:
        """How it moves, in the body frame. Shape (3,)."""
        return self.state[3:6].copy()

    def encoders(self) -> FloatArray:
        """Angles that encoders have counted [rad]. Shape (wheels,)."""
        tick = 2.0 * np.pi / self.counts
        return np.floor(self.state[6:] / tick) * tick

    def step(self, sent: FloatArray, seconds: float) -> None:
        """An output is given now and held; it acts `latency` later."""
        self._queue.append((self.t + self.latency, np.array(sent, float)))
        end = self.t + seconds
        while self.t < end - 1e-12:
            while self._queue and self._queue[0][0] <= self.t + 1e-9:
                self._sent = self._queue.pop(0)[1]
            until = min(end, self._queue[0][0]) if self._queue else end
            if self.loop:
                self._regulated(until - self.t)
            else:
                limit = 1.0 if self.duty else self.volts
                self._advance(np.clip(self._sent, -limit, limit), until - self.t)
            self.t = until

    def _regulated(self, seconds: float) -> None:
        """The loop of the firmware holds what was sent, a speed of each wheel."""
        proportional, integral, rate = self.loop
        ticks = max(1, round(seconds * rate))
        for _ in range(ticks):
            off = self._sent - self.directions.T @ self.twist / self.radius
            raised = self._sum + off * seconds / ticks
            volts = proportional * off + integral * raised
            self._sum = np.where(np.abs(volts) <= self.volts, raised, self._sum)
            self._advance(np.clip(volts, -self.volts, self.volts), seconds / ticks)

    def _advance(self, volts: FloatArray, seconds: float) -> None:
        tables = self.motors, self.matrices, self.axes, self.disc, self._battery, self.flags
        advance(self.state, self._before, self._impulse, seconds, volts, self.push, *tables)
