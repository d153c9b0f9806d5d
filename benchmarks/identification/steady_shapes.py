"""Steady stretches on two floors, from the simulators of wrong_worlds: which shape each gets, for group_shapes."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.wrong_worlds.log import right_case, robot_of
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, World, drive
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.choice import base_name
from omnidyn.model.robot import Robot
from omnidyn.run import Run

SPEEDS, DIRECTIONS = (0.25, 0.5), 24  # [m/s]
SECONDS, RATE = 2.5, 50.0
NOISE, OFF = 0.05, 0.02  # [rad/s]; by which what is logged of a voltage is off, another share for each wheel and run
TILE, WHEELS = 0.8, (0.3, 1.0, 1.7)
LONGER = (1.2, 0.8, 1.0)  # of the levels: an ellipse is no disc
NAMES = {BOX: "box", ELLIPSE: "ellipse"}


@dataclass(frozen=True)
class Floors:
    """shapes: of friction on each floor; each: whether wheels have levels of their own, too."""

    name: str
    shapes: tuple[str, str]
    each: bool = False

    @property
    def right(self) -> bool:
        """Whether one shape is true of both floors."""
        return len({*self.shapes}) == 1 and not self.each

    @property
    def true(self) -> list[str]:
        """The name of the shape of each floor."""
        return [NAMES[shape] + ("+wheels" if self.each else "") for shape in self.shapes]


KINDS = (
    Floors("steady: a box on gray, an ellipse on green", (BOX, ELLIPSE)),
    Floors("steady: an ellipse and unequal wheels on both", (ELLIPSE, ELLIPSE), each=True),
    Floors("steady, right: a box on both", (BOX, BOX)),
    Floors("steady, right: an ellipse on both", (ELLIPSE, ELLIPSE)),
)


@dataclass
class Seen:
    """Of the logs of one seed. named: every floor ends with the shape that it has; other: in a right world, a floor has
    a shape for itself, or all have a richer one; held: intervals of Coulomb friction that hold the truth."""

    named: bool = False
    other: bool = False
    held: list[bool] = field(default_factory=list)
    seconds: float = 0.0
    words: str = ""


def driven(kind: Floors, seed: int, names: tuple[str, str]) -> tuple[list[Run], list[str], Robot, dict[str, World]]:
    """(the runs of both floors, the floor of each, the robot as its file has it, the world of each floor)."""
    rng, case = np.random.default_rng([seed, 6]), right_case(seed)
    each = tuple(rng.permutation(WHEELS).tolist()) if kind.each else ()
    runs, groups, worlds = list[Run](), list[str](), dict[str, World]()
    for k, (name, shape) in enumerate(zip(names, kind.shapes, strict=True)):
        factor = TILE if k or each else 1.0
        level = tuple(factor * by * own for by, own in zip(LONGER, case.world.coulomb, strict=True))
        worlds[name] = replace(case.world, shape=shape, coulomb=level, viscous=(0.0,) * 3, each_wheel=each, frame=False)
        for speed in SPEEDS:
            for angle in np.radians(np.arange(DIRECTIONS) * 360.0 / DIRECTIONS + 4.0):
                runs.append(_logged(worlds[name], speed * np.array([np.cos(angle), np.sin(angle), 0.0]), rng))
                groups.append(name)
    return runs, groups, robot_of(case.told), worlds


def studied(kind: Floors, seed: int, names: tuple[str, str]) -> Seen:
    """Which shapes the floors get."""
    runs, groups, robot, worlds = driven(kind, seed, names)
    began = time.process_time()
    study = identify(runs, robot, SteadyState(), groups=groups).study
    chosen = [study.choice.of(name) for name in names]
    out = Seen([base_name(name) for name in chosen] == kind.true, seconds=time.process_time() - began)
    out.other, out.words = not out.named, " and ".join(chosen)
    for name, estimate in study.estimates.items():
        table = "friction.axes" if worlds[name].shape == BOX else "friction.direction"
        for axis, value in enumerate(worlds[name].coulomb[:2]):
            if (key := f"{table}.coulomb[{axis}]") in estimate.ci95:
                low, high = estimate.ci95[key]
                out.held.append(low <= value <= high)
    return out


def _logged(world: World, twist: np.ndarray, rng: np.random.Generator) -> Run:
    """A drive from rest at voltages that hold a twist, once it has settled."""
    forces = np.linalg.pinv(world.G) @ _friction(world, twist) + _at_rims(world, twist)
    ohm, rims = np.array(world.resistance), world.G.T @ twist
    volts = forces * ohm / world.ke + world.ke * rims
    t = np.arange(round(SECONDS * RATE)) / RATE
    motion = drive(world, np.zeros(1), volts[None], t)
    told = volts * (1.0 + OFF * rng.standard_normal(volts.size))
    speed = motion.wheel_speed + NOISE * rng.standard_normal(motion.wheel_speed.shape)
    return Run(t, voltage=np.tile(told, (len(t), 1)), wheel_speed=speed)


def _friction(world: World, twist: np.ndarray) -> np.ndarray:
    """What acts against a body that travels [N, N, N m]."""
    level = np.array(world.coulomb[:2])
    way = level * np.sign(twist[:2]) if world.shape == BOX else level**2 * twist[:2] / np.hypot(*(level * twist[:2]))
    return np.append(way, 0.0)


def _at_rims(world: World, twist: np.ndarray) -> np.ndarray:
    """What acts against the wheels [N]."""
    return np.sign(world.G.T @ twist) * (np.array(world.each_wheel) if world.each_wheel else 0.0)
