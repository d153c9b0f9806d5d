"""The numbers of a robot that the reference of modes.py needs, and nothing else of omnidyn.

A centre of mass beside that of the wheels needs no other equations: the twist is that of the centre of mass, where a
body is diag(m, m, I) again, and the wheels and the axes of friction stand beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

FALLS = {"exponential": lambda u, d: np.exp(-(u**d)), "lorentzian": lambda u, d: 1.0 / (1.0 + u**d)}
"""What is left of a fall at u Stribeck speeds with an exponent d, by the word of its shape. All references ask here."""


@dataclass(frozen=True)
class Plant:
    """The numbers of a robot, SI units. Scalar elements in rows: direction, levels, wheel (whose gear
    adds)."""

    mass: np.ndarray  # of the body: (M, M, I)
    spin: np.ndarray  # (wheels,) [kg] of what spins: (J l^2 + J_w)/r^2
    turning: bool
    dynamic: bool
    G: np.ndarray
    K: np.ndarray
    E: np.ndarray
    R: np.ndarray
    L: np.ndarray
    drop: np.ndarray
    limit: np.ndarray
    volts: np.ndarray
    eta: np.ndarray
    viscous: np.ndarray  # (3, 3)
    direction: np.ndarray  # (elements, 3)
    slide: np.ndarray  # (elements, 2): forward, backward
    hold: np.ndarray  # (elements, 2)
    wheel: np.ndarray  # (elements,), -1 where the element is no wheel
    names: tuple[str, ...]
    slide_ellipse: np.ndarray | None
    hold_ellipse: np.ndarray | None
    stribeck: np.ndarray  # (elements,) speed [m/s, rad/s] over which hold falls to slide, inf: at once, from rest
    exponent: np.ndarray  # (elements,)
    stribeck_ellipse: float = math.inf
    exponent_ellipse: float = 2.0
    shapes: tuple[str, ...] = ()  # (elements,), of FALLS
    shape_ellipse: str = "exponential"

    @property
    def slide_at_rest(self) -> np.ndarray:
        """Levels of what has just given way: what falls with the speed has not fallen yet."""
        return np.where(np.isfinite(self.stribeck)[:, None], self.hold, self.slide)

    @property
    def ellipse_at_rest(self) -> np.ndarray | None:
        """The same of the ellipse."""
        return self.hold_ellipse if math.isfinite(self.stribeck_ellipse) else self.slide_ellipse

    @property
    def wheels(self) -> int:
        """Number of wheels."""
        return self.G.shape[1]

    @property
    def M(self) -> np.ndarray:
        """Mass matrix: 1/2 nu M nu = 1/2 (m v^2 + I omega^2) + 1/2 sum spin (g . nu)^2."""
        return np.diag(self.mass) + sum(m * np.outer(g, g) for m, g in zip(self.spin, self.G.T, strict=True))

    @property
    def middle(self) -> np.ndarray:
        """m of the gear: the part of the traction that goes with the current."""
        return (1 / self.eta + self.eta) / 2

    @property
    def dry(self) -> np.ndarray:
        """q of the gear: the part that acts as dry friction."""
        return (1 / self.eta - self.eta) / 2


def to_centre(robot) -> np.ndarray:
    """The twist of the centre of mass per twist of that of the wheels. Shape (3, 3)."""
    x, y = robot.body.centre
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])


def plant_of(robot) -> Plant:
    """The numbers of an omnidyn Robot, of its centre of mass."""
    plant = _plant_of(robot)
    if not any(robot.body.centre):
        return plant
    assert plant.hold_ellipse is None, "an ellipse is one of the centre of the wheels"
    back = np.linalg.inv(to_centre(robot))
    return replace(plant, G=back.T @ plant.G, viscous=back.T @ plant.viscous @ back, direction=plant.direction @ back)


def _plant_of(robot) -> Plant:
    """The numbers as they are where the centre of mass is that of the wheels."""
    n = robot.wheels.count

    def each(value, absent=0.0):
        return np.broadcast_to(np.asarray(absent if value is None else value, dtype=float), (n,)).copy()

    m, axes, way, rim = robot.motor, robot.friction.axes, robot.friction.direction, robot.friction.wheels
    G, radius, gear = (
        np.array(robot.wheels.wrench_matrix),
        each(robot.wheels.wheel_radius),
        each(m.gear_ratio),
    )
    coulomb = np.array(axes.coulomb, dtype=float)
    breakaway = np.array(axes.coulomb if axes.breakaway is None else axes.breakaway, dtype=float)
    coulomb[2] += way.yaw_coulomb
    breakaway[2] += way.yaw_coulomb if way.yaw_breakaway is None else way.yaw_breakaway
    forward = each(rim.coulomb)
    backward = forward if rim.coulomb_backward is None else each(rim.coulomb_backward)
    hold_forward, hold_backward = each(rim.hold_forward), each(rim.hold_backward)
    back = np.array(coulomb if axes.coulomb_backward is None else axes.coulomb_backward, dtype=float)
    hold_back = np.array(breakaway if axes.coulomb_backward is None else back, dtype=float)
    if axes.breakaway_backward is not None:
        hold_back = np.array(axes.breakaway_backward, dtype=float)
    falls = np.broadcast_to(np.asarray(axes.stribeck_speed or math.inf, dtype=float), (3,)).copy()
    powers, tails = [axes.stribeck_exponent] * 3, [axes.stribeck_shape] * 3
    if way.yaw_stribeck_speed is not None:
        falls[2], powers[2], tails[2] = way.yaw_stribeck_speed, way.stribeck_exponent, way.stribeck_shape
    rim_falls = each(rim.stribeck_speed, math.inf)
    b, efficiency = each(rim.viscous), each(m.gear_efficiency)
    rows = [
        (np.eye(3)[k], (coulomb[k], back[k]), (breakaway[k], hold_back[k]), -1, "xyw"[k], falls[k], powers[k], tails[k])
        for k in range(3)
        if breakaway[k] > 0
    ]
    rows += [
        (
            *(G[:, k], (forward[k], backward[k]), (hold_forward[k], hold_backward[k]), k, f"wheel {k + 1}"),
            *(rim_falls[k], rim.stribeck_exponent, rim.stribeck_shape),
        )
        for k in range(n)
        if hold_forward[k] > 0 or hold_backward[k] > 0 or efficiency[k] < 1
    ]
    holds = way.coulomb if way.breakaway is None else way.breakaway
    return Plant(
        mass=np.array([robot.body.mass, robot.body.mass, robot.body.inertia]),
        spin=(each(m.rotor_inertia) * gear**2 + each(robot.wheels.wheel_inertia)) / radius**2,
        turning=robot.body.rotating_frame,
        dynamic=m.electrical == "dynamic",
        G=G,
        K=gear * each(m.torque_constant) / radius,
        E=gear * each(m.emf_constant) / radius,
        R=each(m.resistance),
        L=each(m.inductance),
        drop=each(m.voltage_drop),
        limit=each(m.current_limit, math.inf),
        volts=each(m.voltage_limit),
        eta=efficiency,
        viscous=np.diag(np.add(axes.viscous, (way.viscous, way.viscous, way.yaw_viscous))) + (G * b) @ G.T,
        direction=np.array([row[0] for row in rows]).reshape(-1, 3),
        slide=np.array([row[1] for row in rows]).reshape(-1, 2),
        hold=np.array([row[2] for row in rows]).reshape(-1, 2),
        wheel=np.array([row[3] for row in rows], dtype=int),
        names=tuple(row[4] for row in rows),
        slide_ellipse=np.array(way.coulomb) if max(holds) > 0 else None,
        hold_ellipse=np.array(holds) if max(holds) > 0 else None,
        stribeck=np.array([row[5] for row in rows], dtype=float),
        exponent=np.array([row[6] for row in rows], dtype=float),
        stribeck_ellipse=math.inf if way.stribeck_speed is None else way.stribeck_speed,
        exponent_ellipse=way.stribeck_exponent,
        shapes=tuple(row[7] for row in rows),
        shape_ellipse=way.stribeck_shape,
    )
