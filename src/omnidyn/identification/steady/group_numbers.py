"""What a steady-state study says of one group, or of two: plain numbers with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Travel:
    """Force along travel of one group [N]: mean over the points, its standard error, their standard deviation.

    slow, fast: range of the speeds [m/s]. points, runs, rows: what it was made from.
    """

    mean: float
    std: float
    deviation: float
    slow: float
    fast: float
    points: int
    runs: int
    rows: int


@dataclass(frozen=True)
class Viscous:
    """What the data say about a viscous level of one group: its key, value, standard error and 95 % interval.

    seen: the interval does not contain 0. effect [N]: the most that a viscous force inside the interval changes
    between the slowest and the fastest point. level [N]: the force along travel, to compare. slow, fast [m/s]: range of
    the speeds. About yaw [N m] and [rad/s].
    back_emf: the part of the slope of the drive that the robot file says is back-EMF, where forces are from voltages; 0
    from currents. guesses: motor constants that are guesses; where there are any, only the sum of `value` and
    `back_emf` is known, with standard error `sum_std`: `std` and the interval count the std of the guess.
    """

    key: str
    value: float
    std: float
    low: float
    high: float
    seen: bool
    effect: float
    level: float
    slow: float
    fast: float
    back_emf: float = 0.0
    guesses: tuple[str, ...] = ()
    sum_std: float = 0.0


@dataclass(frozen=True)
class Difference:
    """A level in two groups: second minus first, with standard error and 95 % interval. differs: 0 lies outside."""

    key: str
    first: str
    second: str
    values: tuple[float, float]
    difference: float
    std: float
    low: float
    high: float

    @property
    def differs(self) -> bool:
        """Whether the interval leaves 0 out."""
        return not self.low <= 0.0 <= self.high
