"""Under what a robot is driven: the loop, its instruments, what pushes it; and the options that say so by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np

from omnidyn.arguments import seed_of, unknown_option
from omnidyn.control.feedforward import DT, check_dt
from omnidyn.control.instruments import MOST_JITTER, Instruments, instruments
from omnidyn.control.paths.motion import Path
from omnidyn.errors import InputError
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot

SKIP = 0.5  # [s] from the start that count as no error: the robot starts at rest
MOST_STEPS = 1_000_000
MOST_DELAY = 100
Push = tuple[float, float, float]


class TuneOptions(TypedDict, total=False):
    """Of the loop, as `tune` takes them; what they are stands in `Circumstances`. rng: gives the seed."""

    dt: float
    duration: float | None
    noise: float
    delay: int
    rng: int | np.random.Generator
    sensors: str | Instruments | Sensors | None


class LoopOptions(TuneOptions, total=False):
    """The same, as `track` takes them."""

    skip: float
    push: Push | Callable[[float], Push]
    supply: float | None


@dataclass(frozen=True)
class Circumstances:
    """Under what a robot is driven. dt [s]; duration [s], None: that of the path; skip [s]: no errors before it.

    noise [m/s]: std of the measured speeds; of omega 4 times as many rad/s, of x and y 0.2 s, of the heading 0.4 s
    times, where no encoder counts. delay: steps until an output acts. push: wrench on the body [N, N, N m], or what it
    is at a time [s]. seed: of the noise, and of what instruments draw. supply [V]: behind a duty. sensors: with which
    the robot is measured, None: those of its file.
    """

    dt: float = DT
    duration: float | None = None
    skip: float = SKIP
    noise: float = 0.0
    delay: int = 0
    seed: int = 0
    push: Push | Callable[[float], Push] = (0.0, 0.0, 0.0)
    supply: float | None = None
    sensors: Instruments | None = None

    def __post_init__(self) -> None:
        check_dt(self.dt)
        for name, low, high in (("noise", 0.0, 100.0), ("delay", 0, MOST_DELAY), ("skip", 0.0, 1e6)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError("out of range", got=value, expected=f"{low:g} to {high:g}", where=name)
        if self.sensors is not None and not self.sensors.jitter <= MOST_JITTER * self.dt:
            raise InputError(
                "the jitter is not a part of a step",
                got=f"{self.sensors.jitter:g} s",
                expected=f"at most {MOST_JITTER * self.dt:g} s, half of dt",
                where="sensors",
            )
        if self.duration is not None and not self.dt <= self.duration <= MOST_STEPS * self.dt:
            raise InputError(
                "cannot track for that long",
                got=self.duration,
                expected=f"one step, {self.dt:g} s, to a million of them",
                where="duration",
            )

    def steps(self, path: Path) -> int:
        """How many steps it takes. Raises InputError for a path of too many."""
        duration = path.duration if self.duration is None else self.duration
        count = max(1, round(duration / self.dt))
        if count > MOST_STEPS:
            raise InputError("too many steps", got=count, expected=f"at most {MOST_STEPS}", remedy="set a `duration`")
        return count


def circumstances(
    plant: Robot, allowed: Sequence[str] = (*LoopOptions.__annotations__,), **options: Any
) -> Circumstances:
    """Circumstances by name, as `track` takes them: `rng` gives the seed, `sensors` may be words.

    Raises InputError for a name that is not allowed, or a number out of range.
    """
    for name in options:
        if name not in allowed:
            raise unknown_option("a closed loop", name, allowed, "track")
    delay, kit = options.get("delay", 0), instruments(options.pop("sensors", None), plant)
    if not 0 <= delay <= MOST_DELAY or delay != int(delay):
        raise InputError("not a delay in steps", got=delay, expected=f"0 to {MOST_DELAY}", where="delay")
    options |= {"delay": int(delay), "seed": seed_of(options.pop("rng", 0))}
    return Circumstances(**options, sensors=kit)
