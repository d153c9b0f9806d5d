"""The log under check: each family of checks gets it, says what it found, and hands on what is left to trust.

The contract of a family, a function `family(work) -> tuple[list[Finding], LogUnderCheck]`:

1. It says only what the log itself shows; thresholds come from the noise found in the log.
2. It never raises for what a log may hold: no channel, no row, NaN anywhere.
3. It returns the log with the fault mended (columns put right, a scale taken out) or masked (NaN), so that a later
   family does not report the consequences of a fault as faults of their own.
4. It does not change arrays in place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.findings.finding import Span, spans_of
from omnidyn.findings.signal.robust import clusters
from omnidyn.logs.channels import components
from omnidyn.logs.log import Log
from omnidyn.model.robot import Robot
from omnidyn.run import CHANNELS, WHEEL

INPUTS = ("voltage", "duty", "wheel_speed_command", "twist_command")
SENSORS = ("current", "wheel_speed", "twist")
MIN_ROWS = 40  # below that nothing is said from statistics


class SensorClock(NamedTuple):
    """Rows of a log in which a sensor has its samples, and the components that were sampled then."""

    rows: IntArray
    components: frozenset[str]


class Merged(NamedTuple):
    """A log in order of time with the samples of all its clocks, the leading one first; rows: index into the log."""

    log: Log
    rows: IntArray
    clocks: tuple[SensorClock, ...]


@dataclass(frozen=True, eq=False)
class LogUnderCheck:
    """A log in order of time, in the rows of one clock: of the wheels, where their speed was recorded.

    log: as recorded. robot: or None. rows: index into the log of each row kept, increasing in time. t [s], step: the
    usual one [s]. segments: the rows between two gaps. channels: as in Log, what is not to be trusted is NaN; commands
    of another clock are held, measurements on the line between two of them. facts: that families pass on, such
    as "ground_ratio". merged: the samples of all clocks. sampled: components of this clock; None where there is one.
    """

    log: Log
    robot: Robot | None
    rows: IntArray
    t: FloatArray
    step: float
    segments: tuple[slice, ...]
    channels: Mapping[str, FloatArray]
    facts: Mapping[str, Any] = field(default_factory=dict)
    merged: Merged | None = None
    sampled: frozenset[str] | None = None

    def __len__(self) -> int:
        return len(self.t)

    @property
    def wheels(self) -> int:
        """Number of wheels in the log, else of the robot, else 0."""
        counts = [values.shape[1] for name, values in self.channels.items() if CHANNELS[name] == WHEEL]
        return counts[0] if counts else (self.robot.wheels.count if self.robot else 0)

    @property
    def geometry(self) -> Robot | None:
        """The robot, where it has as many wheels as the log."""
        return self.robot if self.robot is not None and self.robot.wheels.count == self.wheels else None

    def get(self, channel: str) -> FloatArray | None:
        """A channel with any number in it, else None."""
        values = self.channels.get(channel)
        return values if values is not None and np.isfinite(values).any() else None

    def full(self, channel: str) -> FloatArray | None:
        """A channel of which every component was recorded, else None."""
        values = self.channels.get(channel)
        if values is None or not np.isfinite(values).any(axis=0).all():
            return None
        return values

    def columns(self, channel: str) -> list[tuple[str, FloatArray]]:
        """(component, values) of a channel's components that hold any number."""
        values = self.get(channel)
        if values is None:
            return []
        names = components(channel, values.shape[1] if values.ndim == 2 else 0)
        table = values.reshape(len(values), -1)
        return [(name, table[:, k]) for k, name in enumerate(names) if np.isfinite(table[:, k]).any()]

    @property
    def derived_speed(self) -> bool:
        """Whether a speed of the wheels was not logged; one that is there is made of their angles."""
        logged = self.log.channels.get("wheel_speed")
        return logged is None or not bool(np.isfinite(logged).any())

    def sampled_columns(self, channel: str) -> list[tuple[str, FloatArray]]:
        """As `columns`, of the components that were sampled in these rows, and so can be judged one by one.

        The speed that stands in for a dead wheel was not: it is what other channels say.
        """
        derived = channel == "wheel_speed" and self.derived_speed
        dead = self.facts.get("dead_wheel") if channel == "wheel_speed" else None
        return [
            (name, values)
            for name, values in self.columns(channel)
            if dead is None or name != components(channel, self.wheels)[dead]
            if self.sampled is None or (name.replace("w", "a") if derived else name) in self.sampled
        ]

    def lines(self, mask: BoolArray) -> tuple[Span, ...]:
        """Lines of the file where `mask`, shape (rows kept,), holds."""
        return spans_of(mask, self.log.lines[self.rows])

    def windows(self, seconds: float = 0.2) -> tuple[IntArray, int]:
        """(window of each row, number of windows)."""
        return clusters(len(self), self.step, seconds)

    def width(self, seconds: float) -> int:
        """Rows of a mean over so many seconds: odd, three at least."""
        return max(3, round(seconds / self.step) | 1) if self.step > 0.0 else 3

    @property
    def everywhere(self) -> BoolArray:
        """True in every row."""
        return np.ones(len(self), dtype=bool)

    def recorded(self, channel: str, k: int) -> IntArray:
        """Rows in which component k was recorded; those between are no measurements where it has times of its own."""
        logged = self.log.channels.get(channel)
        if logged is None:
            return np.arange(len(self))
        values = logged.reshape(len(self.log), -1)[self.rows, k]
        in_order = replace(self.log, t=self.t, channels={})
        return np.flatnonzero(np.isfinite(values)) if in_order.now_and_then(values) else np.arange(len(self))

    def replace(self, **channels: FloatArray | None) -> LogUnderCheck:
        """The log with some channels changed, or taken out where None."""
        merged_channels = {**self.channels, **channels}
        return replace(self, channels={name: values for name, values in merged_channels.items() if values is not None})

    def knowing(self, **facts: Any) -> LogUnderCheck:
        """The log with more facts known."""
        return replace(self, facts={**self.facts, **facts})

    def masked(self, channel: str, column: int, mask: BoolArray) -> LogUnderCheck:
        """The log without the values of one component where `mask` holds."""
        if not mask.any():
            return self
        values = self.channels[channel].copy()
        (values if values.ndim == 1 else values[:, column])[mask] = np.nan
        return self.replace(**{channel: values})
