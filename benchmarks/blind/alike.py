"""Wrong worlds in which several causes are the same to the log by construction, friction along the axes being free.

    M v' = G (l K_t/(r R)) u - (G G' l^2 K_t K_v/(r^2 R) + B) v - C sgn v

Braking goes into B, which is free on each axis; what is left of gain, 1/R, K_t and 1/r is one factor of u, whatever of
v or w = G' v/r is logged. A robot that only goes along one axis shows that factor over its mass (about yaw: its
inertia), and so no more of the mass, of the rotors, or about yaw of the radius of the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from benchmarks.blind.log import driven, noisy, robot_of, world_of
from benchmarks.blind.setups import (
    ARM,
    FORWARD,
    FRICTION,
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
from omnidyn.identification.whole_logs import fit_output_error

GAIN = "gain"
OF_MOTORS = (GAIN, OHM, TORQUE, RADIUS)


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
        return replace(world, **{
            GAIN: {"gain": f}, OHM: {"resistance": (world.resistance[0] * f,) * 3},
            TORQUE: {"torque_constant": (world.torque_constant[0] * f,) * 3},
            RADIUS: {"wheel_radius": (world.wheel_radius[0] * f,) * 3}, MASS: {"mass": world.mass * f},
            INERTIA: {"inertia": world.inertia * f}, ARM: {"robot_radius": world.robot_radius * f},
        }[self.cause])  # type: ignore[arg-type]  # fmt: skip


ALIKE = (
    *(Alike(cause, factor, RICH, logged, OF_MOTORS)
      for logged in (TWIST, WHEELS) for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (TORQUE, 0.9), (RADIUS, 1.06))),
    *(Alike(cause, factor, FORWARD, TWIST, (*OF_MOTORS, MASS))
      for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (TORQUE, 1.1), (RADIUS, 0.94), (MASS, 1.2))),
    *(Alike(cause, factor, SIDEWAYS, WHEELS, (*OF_MOTORS, MASS))
      for cause, factor in ((GAIN, 1.1), (OHM, 0.87), (MASS, 0.8))),
    *(Alike(cause, factor, TURNS, TWIST, (*OF_MOTORS, INERTIA, ARM))
      for cause, factor in ((GAIN, 0.9), (OHM, 1.15), (INERTIA, 1.2), (ARM, 1.06))),
)  # fmt: skip


def grouped(case: Alike, seed: int) -> tuple[bool, str]:
    """(whether the first remedy stands in one group with all that is the same, what the fit says)."""
    own = FRICTION if case.drive == RICH else _of_axis(case.drive)
    setup = Setup(case.name, own, case.drive, (case.logged,))
    told = world_of(setup, seed)
    run = noisy(setup, driven(case.world(told), setup, seed), seed)
    lack = fit_output_error(run, robot_of(told), free=own, nuisances=()).lack_of_fit
    if lack is None or not lack.remedies:
        return False, "nothing found"
    first = lack.remedies[0]
    group = {first.key, *first.same_as}
    return set(case.same) <= group, f"{lack.words()}"


def _of_axis(how: str) -> tuple[str, ...]:
    k = ("x", "y", "yaw").index(how)
    return (f"friction.axes.viscous[{k}]", f"friction.axes.coulomb[{k}]")
