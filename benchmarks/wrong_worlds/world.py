"""World: a robot as it is, with all that may be wrong with it off by default; `drive` runs it. Plain numbers, SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.wrong_worlds.kernel import HEAT, Physics, march
from benchmarks.wrong_worlds.sums import STEP as SHORT
from benchmarks.wrong_worlds.sums import Sum, march_sum

BOX, ELLIPSE, WHEELS = "axes", "direction", "wheels"  # tables of a robot file
STEP = 2e-3  # [s]; of what turns with the wheels a quarter
NEVER = 1e9  # [s], [A], [N]


@dataclass(frozen=True)
class World:
    """The truth. Wheels in tuples; coulomb, viscous (3,) along x, y and about yaw, rim (c, b) at the wheels.

    Below `rim` everything is neutral. after_*: factors from `change` [s] on. load [A]: at which windings have grown by
    `heating`. pull: constant force in the world [N]. cogging [N] at the rim, `teeth` a turn. gap: play of a gear,
    either way [m at the rim]. traction: most force of a wheel [N]. each_wheel: Coulomb friction at the rims [N] beside
    what the shape says; with it, of all that may be wrong only what stands above `rotor_inertia`.
    """

    azimuth: tuple[float, ...] = (60.0, 180.0, 300.0)
    wheel_radius: tuple[float, ...] = (0.03, 0.03, 0.03)
    robot_radius: float = 0.11
    mass: float = 2.4
    inertia: float = 0.016
    resistance: tuple[float, ...] = (2.2, 2.2, 2.2)
    torque_constant: tuple[float, ...] = (0.0105, 0.0105, 0.0105)
    gear_ratio: float = 24.0
    voltage_limit: float = 12.0
    frame: bool = False
    shape: str = BOX
    coulomb: tuple[float, float, float] = (3.9, 3.9, 0.2)
    viscous: tuple[float, float, float] = (1.2, 1.2, 0.012)
    rim: tuple[float, float] = (2.0, 0.75)
    # What may be wrong.
    rotor_inertia: float = 0.0
    centre: float = 0.0
    breakaway: float = 1.0
    aside: float = 0.0
    stribeck: float = 0.0
    drag: float = 0.0  # share of the viscous force at 1 m/s and 10 rad/s
    cooling: float = 0.0
    pull: tuple[float, float] = (0.0, 0.0)
    gain: float = 1.0
    fade: float = 0.0
    battery: float = 0.0
    drop: float = 0.0
    dead: float = 0.0
    limit: float = NEVER
    efficiency: float = 1.0
    heating: float = 0.0
    load: float = 1.0
    eccentric: float = 0.0
    bumps: float = 1.0
    cogging: float = 0.0
    ripple: float = 0.0
    teeth: float = 20.0
    traction: float = NEVER
    gap: float = 0.0
    change: float = NEVER
    after_mass: float = 1.0
    after_friction: float = 1.0
    after_gain: float = 1.0
    each_wheel: tuple[float, ...] = ()

    @property
    def G(self) -> np.ndarray:
        """Wrench per force at the rims. Shape (3, wheels)."""
        phi = np.radians(self.azimuth)
        return np.stack([-np.sin(phi), np.cos(phi), np.full(phi.size, self.robot_radius)])

    @property
    def ke(self) -> np.ndarray:
        """[V s/m] at the rims, and [N/A]: K_v = K_t."""
        return self.gear_ratio * np.array(self.torque_constant) / np.array(self.wheel_radius)

    def physics(self, duration: float) -> Physics:
        """The numbers that the kernels read, of a run of `duration` [s]."""
        n = len(self.azimuth)
        d, level, viscous = self._elements()
        masses = (self.mass, self.mass * self.after_mass)
        size = np.array([1.0, 1.0, 10.0]) if len(d) == 3 and self.shape == BOX else np.ones(len(d))
        ellipse = np.array(self.coulomb[:2]) if self.shape == ELLIPSE else np.zeros(2)
        after = np.array([1.0, self.after_friction])
        return Physics(
            self.G,
            np.stack([self._inertia(m) for m in masses]),
            np.array(masses) * self.frame,
            self.centre,
            self.ke,
            self.ke,
            np.array(self.resistance),
            d,
            np.outer(after, level),
            np.outer(after, viscous),
            self.drag * viscous / size,
            self.breakaway,
            self.aside,
            self.stribeck,
            0.03 * size,
            np.outer(after, ellipse),
            after * (self.viscous[0] if self.shape == ELLIPSE else 0.0),
            self.cooling,
            10.0,
            np.array(self.pull),
            self.gain * np.array([1.0, self.after_gain]),
            self.fade,
            self.battery,
            self.voltage_limit,
            self.drop,
            self.dead,
            self.limit,
            self.efficiency,
            self.heating,
            self.load,
            np.full(n, self.eccentric),
            self.bumps,
            np.array(self.wheel_radius),
            self.cogging,
            self.ripple,
            self.teeth,
            self.traction,
            self.gap,
            self.change,
            duration,
        )

    def sum(self) -> Sum:
        """The numbers that march_sum reads."""
        d, level, viscous = self._elements()
        round_ = self.shape == ELLIPSE
        damping = (d.T * viscous) @ d + np.diag([1.0, 1.0, 0.0]) * (self.viscous[0] if round_ else 0.0)
        return Sum(
            self.G,
            self._inertia(self.mass),
            self.mass * self.frame,
            self.ke,
            np.array(self.resistance),
            np.ascontiguousarray(np.vstack([d, self.G.T])),
            np.concatenate([level, self.each_wheel]),
            damping,
            np.array(self.coulomb[:2]) if round_ else np.zeros(2),
        )

    def _elements(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(directions (k, 3), levels, viscous) of the line elements."""
        if self.shape == WHEELS:
            n = len(self.azimuth)
            return np.ascontiguousarray(self.G.T), np.full(n, self.rim[0]), np.full(n, self.rim[1])
        first = 2 if self.shape == ELLIPSE else 0
        return np.eye(3)[first:].copy(), np.array(self.coulomb[first:]), np.array(self.viscous[first:])

    def _inertia(self, mass: float) -> np.ndarray:
        """Of body and rotors, about the centre of the wheels. Shape (3, 3)."""
        body = np.diag([mass, mass, self.inertia + mass * self.centre**2])
        body[1, 2] = body[2, 1] = mass * self.centre
        own = self.rotor_inertia * self.gear_ratio**2 / np.array(self.wheel_radius) ** 2
        return body + (self.G * own) @ self.G.T


@dataclass(frozen=True)
class Motion:
    """twist (rows, 3), path (rows, 3) its integral, wheel_speed (rows, wheels) [rad/s], at the times asked for."""

    twist: np.ndarray
    path: np.ndarray
    wheel_speed: np.ndarray


def drive(world: World, since: np.ndarray, voltage: np.ndarray, wanted: np.ndarray, step: float = STEP) -> Motion:
    """From rest at 0 under voltages (rows, wheels) that hold from the times `since` on; at the times `wanted` [s]."""
    n = voltage.shape[1]
    states, seen = np.zeros((len(wanted), HEAT + n)), np.zeros((len(wanted), n))
    asked = np.ascontiguousarray(np.clip(voltage, -world.voltage_limit, world.voltage_limit))
    if world.each_wheel:
        states = np.zeros((len(wanted), 6))
        march_sum(world.sum(), since, asked, wanted, min(step, SHORT), states)
        return Motion(states[:, :3], states[:, 3:], states[:, :3] @ world.G / np.array(world.wheel_radius))
    march(world.physics(float(wanted[-1])), since, asked, wanted, step, states, seen)
    return Motion(states[:, :3], states[:, 3:6], seen / np.array(world.wheel_radius))
