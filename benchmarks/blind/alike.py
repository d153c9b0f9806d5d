"""Wrong worlds in which several causes are the same to the log by construction, friction along the axes being free.

    M v' = G (l K_t/(r R)) u - (G G' l^2 K_t K_v/(r^2 R) + B) v - C sgn v

Braking goes into B, which is free on each axis; what is left of gain, 1/R, K_t and 1/r is one factor of u, whatever of
v or w = G' v/r is logged. A robot that only goes along one axis shows that factor over its mass (about yaw: its
inertia), and so no more of the mass, of the rotors, or about yaw of the radius of the robot. That holds as long as no
cause needs a B below 0, which no fit gives: these robots have a larger one than `needed` asks for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.blind.log import driven, noisy, robot_of, world_of
from benchmarks.blind.setups import (
    ARM,
    FORWARD,
    INERTIA,
    MASS,
    OHM,
    RADIUS,
    RICH,
    SIDEWAYS,
    TORQUE,
    TURNS,
    TWIST,
    WHEELS,
    Setup,
)
from benchmarks.wrong_worlds.world import World
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError

GAIN = "gain"
OF_MOTORS = (GAIN, OHM, TORQUE, RADIUS)
POWER = {GAIN: 1, OHM: -1, TORQUE: 1, RADIUS: -1, MASS: -1, INERTIA: -1, ARM: 1}  # of each cause in the factor of u
ROUGH = (7.0, 7.0, 14.0)  # times the viscous friction of the other set-ups
AXES = {RICH: (0, 1, 2), FORWARD: (0,), SIDEWAYS: (1,), TURNS: (2,)}


@dataclass(frozen=True)
class Alike:
    """cause: what stands wrong in the file, times `factor`. same: causes that are the same to the log."""

    cause: str
    factor: float
    drive: str
    logged: str
    same: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.cause} x {self.factor:g}, {self.drive}, {self.logged}"

    def world(self, world: World) -> World:
        """The truth of a file that says `world`."""
        f = self.factor
        return replace(
            world,
            **{
                GAIN: {"gain": f},
                OHM: {"resistance": (world.resistance[0] * f,) * 3},
                TORQUE: {"torque_constant": (world.torque_constant[0] * f,) * 3},
                RADIUS: {"wheel_radius": (world.wheel_radius[0] * f,) * 3},
                MASS: {"mass": world.mass * f},
                INERTIA: {"inertia": world.inertia * f},
                ARM: {"robot_radius": world.robot_radius * f},
            }[self.cause],
        )  # type: ignore[arg-type]


ALIKE = (
    *(
        Alike(cause, factor, RICH, logged, OF_MOTORS)
        for logged in (TWIST, WHEELS)
        for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (TORQUE, 0.9), (RADIUS, 1.06))
    ),
    *(
        Alike(cause, factor, FORWARD, TWIST, (*OF_MOTORS, MASS))
        for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (TORQUE, 1.1), (RADIUS, 0.94), (MASS, 1.2))
    ),
    *(
        Alike(cause, factor, SIDEWAYS, WHEELS, (*OF_MOTORS, MASS))
        for cause, factor in ((GAIN, 1.1), (OHM, 0.87), (MASS, 0.8))
    ),
    *(
        Alike(cause, factor, TURNS, TWIST, (*OF_MOTORS, INERTIA, ARM))
        for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (INERTIA, 1.2), (ARM, 1.06))
    ),
)


def world_told(case: Alike, seed: int) -> World:
    """What the robot file says, all of it right but for the cause."""
    world = world_of(_setup(case), seed)
    return replace(world, viscous=tuple(by * b for by, b in zip(ROUGH, world.viscous, strict=True)))  # type: ignore[arg-type]


def needed(case: Alike, told: World, key: str) -> list[float]:
    """The viscous friction of each driven axis with which another cause is the same to the log as the true one.

    By the equation above: the factor of u tells how large that cause is, B is what is left of the friction.
    """
    true = case.world(told)
    power = POWER[key] * (2 if key == RADIUS and case.logged == WHEELS else 1)
    axes = AXES[case.drive]
    own = replace(case, cause=key, factor=(_drive(case, true, axes[0]) / _drive(case, told, axes[0])) ** (1.0 / power))
    found = []
    for axis in axes:
        by = _mass(own.world(told), axis) / _mass(true, axis)
        found.append(by * (_braking(true, axis) + told.viscous[axis]) - _braking(own.world(told), axis))
    return found


def _mass(world: World, axis: int) -> float:
    return (world.mass, world.mass, world.inertia)[axis]


def _braking(world: World, axis: int) -> float:
    return float(world.ke[0] ** 2 / world.resistance[0] * (world.G @ world.G.T)[axis, axis])


def _drive(case: Alike, world: World, axis: int) -> float:
    """The factor of u in the speed that is logged."""
    rim = world.wheel_radius[0] if case.logged == WHEELS else 1.0
    force = world.gain * world.ke[0] / world.resistance[0] * float(np.abs(world.G[axis]).max())
    return force / _mass(world, axis) / rim


def _setup(case: Alike) -> Setup:
    own = tuple(f"friction.axes.{level}[{k}]" for level in ("viscous", "coulomb") for k in AXES[case.drive])
    return Setup(case.name, own, case.drive, (case.logged,))


def grouped(case: Alike, seed: int) -> tuple[bool, str]:
    """(whether the first remedy stands in one group with all that is the same, what the fit says)."""
    setup, told = _setup(case), world_told(case, seed)
    assert min(min(needed(case, told, key)) for key in case.same) > 0.0, (
        f"{case.name}: no fit holds all that is the same"
    )
    run = noisy(setup, driven(case.world(told), setup, seed), seed)
    lack = identify(run, robot_of(told), OutputError(free=setup.free, nuisances=())).lack_of_fit
    if lack is None or not lack.remedies:
        return False, "nothing found"
    first = lack.remedies[0]
    group = {first.key, *first.same_as}
    return set(case.same) <= group, str(lack.statement())
