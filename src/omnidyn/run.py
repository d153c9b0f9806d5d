"""Run: one run of one robot, measured or simulated, the same type for both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import is_frame
from omnidyn.arrays import FloatArray
from omnidyn.clocks import fastest_step, has_own_clock, is_staggered, samples, usual_step
from omnidyn.document import Document, Points, Table
from omnidyn.errors import InputError
from omnidyn.sensors import AXIS, CHANNELS, SCALAR, SENSORS, UNITS, WHEEL
from omnidyn.shown import ANIMATION, DATASET, FIGURE, FRAME, RUN, Displayable, make
from omnidyn.statement import Statement, statements

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST_SIZE = 1e20  # of a number of a log: counters of 64 bits go to 2e19


@dataclass(frozen=True, eq=False)
class Run(Displayable):
    """One run. All channels have the length of `t`; one that was not measured is None, a missing value is NaN.

    t: time [s], strictly increasing, need not be regular. Shape (samples,).
    voltage: of the motors [V]. duty: -1..1 of the supply. current: signed as the voltage is [A]. wheel_angle: turned
    since the start, not wrapped [rad]. wheel_speed, wheel_speed_command: [rad/s]. All of these at the wheel, behind the
    gear; shape (samples, wheels).
    twist and twist_command: (v_x, v_y, omega) in the body frame [m/s, m/s, rad/s]. Shape (samples, 3).
    pose: (x, y, heading) in the world [m, m, rad], heading not wrapped. Shape (samples, 3).
    supply: voltage of the battery [V]. Shape (samples,). force: of the drive of a linear axis [N]. Shape (samples, 1).
    source: where it comes from. warnings: what a reader should know, as statements; text
    given for one is quoted.
    Sensors with clocks of their own keep their times: t holds the stamps of all, and a channel is NaN where its sensor
    gave nothing. Nothing is interpolated.
    Inputs (voltage, duty, commands) of row k hold over [t_k, t_k+1). All arrays are read-only.
    Raises InputError when a channel has another shape, time does not increase, or a number is beyond LARGEST_SIZE.
    """

    t: FloatArray
    voltage: FloatArray | None = None
    duty: FloatArray | None = None
    current: FloatArray | None = None
    wheel_angle: FloatArray | None = None
    wheel_speed: FloatArray | None = None
    wheel_speed_command: FloatArray | None = None
    twist: FloatArray | None = None
    twist_command: FloatArray | None = None
    pose: FloatArray | None = None
    supply: FloatArray | None = None
    force: FloatArray | None = None
    source: str = ""
    warnings: tuple[Statement, ...] = ()

    def __post_init__(self) -> None:
        time = _read_only("t", self.t, None)
        bad_steps = np.flatnonzero(~(np.diff(time) > 0.0))
        if bad_steps.size:
            raise InputError(
                "time does not increase", got=f"row {bad_steps[0] + 1}: t = {time[bad_steps[0] + 1]}", where="t"
            )
        object.__setattr__(self, "t", time)
        object.__setattr__(self, "warnings", statements(self.warnings))
        for name, kind in CHANNELS.items():
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _read_only(name, value, kind, len(time)))

    @property
    def channels(self) -> dict[str, FloatArray]:
        """The measured channels by name."""
        return {name: value for name in CHANNELS if (value := getattr(self, name)) is not None}

    @property
    def sensors(self) -> list[FloatArray]:
        """The channels of what was measured, inputs left out."""
        return [value for name in SENSORS if (value := getattr(self, name)) is not None]

    @cached_property
    def step(self) -> float:
        """Usual time between two samples of the fastest sensor [s]; between two rows where all share their stamps."""
        return fastest_step(self.t, self.sensors) if self.staggered else usual_step(self.t)

    @cached_property
    def staggered(self) -> bool:
        """Whether its sensors have clocks of their own: a blank is then the row of another one, no missing value."""
        return is_staggered(self.t, self.sensors)

    def samples(self, channel: str) -> tuple[FloatArray, FloatArray]:
        """(times [s], values) of the rows in which a channel holds any number; none for one that was not measured.

        channel: its name, such as "twist". Raises InputError for another name.
        """
        if channel not in CHANNELS:
            raise InputError("no such channel", got=channel, expected=", ".join(CHANNELS))
        values = getattr(self, channel)
        return samples(self.t, np.full(len(self.t), np.nan) if values is None else values)

    @property
    def wheels(self) -> int | None:
        """Number of wheels, None where no channel of wheels was measured."""
        counts = {len(value[0]) for name, value in self.channels.items() if CHANNELS[name] == WHEEL}
        return counts.pop() if counts else None

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        span = f"{self.t[-1] - self.t[0]:.6g} s" if len(self.t) > 1 else "one sample"
        return f"<Run {self.source or 'unnamed'}: {len(self.t)} samples, {span}, {', '.join(self.channels)}>"

    def document(self) -> Document:
        """What was measured: a row per channel and column, with its least, mean and largest value."""
        rows = [row for name, values in self.channels.items() for row in _rows(name, values, self.t)]
        span = float(self.t[-1] - self.t[0])
        rate = f" at {1.0 / self.step:.4g} Hz" if len(self.t) > 1 else ""
        head = f"{self.source or 'a run'}: {len(self.t)} samples, {span:.6g} s{rate}"
        data = {
            "source": self.source,
            "samples": len(self.t),
            "duration_s": span,
            "channels": list(self.channels),
            "warnings": [warning.to_dict() for warning in self.warnings],
        }
        table = Table(("channel", "", "unit", "least", "mean", "largest", "missing"), rows, "<<<>", name="channels")
        warnings = Points(self.warnings, "warning:", "warnings")
        return Document([head, "", table, warnings], data, self.warnings, ascii=True)

    def plot(self, channels: Sequence[str] = ()) -> Figure:
        """Its channels over time, as a matplotlib Figure.

        channels: names of those to show, such as "twist"; all that were measured by default.
        Raises InputError for one that this run does not have.
        """
        return make(FIGURE, self, channels=channels)

    def plot_path(self, robot: Any = None) -> Figure:
        """Where it went, seen from above, and how far in which direction of its body, as a matplotlib Figure.

        From the measured pose, else from its speeds. robot: tells them from the speeds of its wheels.
        Raises InputError for a run that holds none of these.
        """
        return make(FIGURE, self, path=True, robot=robot)

    def animate(self, robot: Any) -> Any:
        """The robot on its way, from above and to scale, as an Animation: `.save("run.gif")`; a notebook shows it.

        robot: that is drawn. Raises InputError for a run that holds no pose, twist or wheel speeds of this robot.
        """
        return make(ANIMATION, self, robot=robot)

    def to_dataframe(self, library: str = "pandas") -> Any:
        """A DataFrame with the columns of a run file (u1_V, w1_rad_s, vx_m_s), over time t_s.

        library: "pandas" or "polars". Raises MissingExtraError where it is not installed.
        """
        return make(FRAME, self, library=library)

    def to_xarray(self) -> Any:
        """An xarray Dataset: a variable for each channel, over time and wheel or axis, with its unit.

        Raises MissingExtraError where xarray is not installed.
        """
        return make(DATASET, self)

    def __eq__(self, other: object) -> bool:
        """Equal to the last bit in every channel and word; NaN equals NaN."""
        if not isinstance(other, Run):
            return NotImplemented
        return all(_same(a, b) for a, b in zip(_values(self), _values(other), strict=True))

    __hash__ = None  # type: ignore[assignment]

    def replace(self, **changes: Any) -> Run:
        """The same run with some fields changed, checked again."""
        return replace(self, **changes)


def as_list(runs: Run | Sequence[Run]) -> list[Run]:
    """One run, or several, as a list. Data frames and Datasets become runs."""
    return [as_run(runs)] if isinstance(runs, Run) or is_frame(runs) else [as_run(run) for run in runs]


def as_run(run: Any) -> Any:
    """The Run in a data frame or an xarray Dataset; anything else as it is."""
    return make(RUN, run) if is_frame(run) else run


def _rows(channel: str, values: FloatArray, t: FloatArray) -> Iterator[tuple[str, ...]]:
    """The columns of a channel in a table: least, mean, largest, and what share is missing at its own clock."""
    columns = values.reshape(len(values), -1)
    units = UNITS[channel].split(", ")
    for k, column in enumerate(columns.T):
        finite_values = column[np.isfinite(column)]
        numbers = (
            [f"{number:.4g}" for number in (finite_values.min(), finite_values.mean(), finite_values.max())]
            if finite_values.size
            else ["-"] * 3
        )
        absent_share = 0.0 if has_own_clock(t, column) else 1.0 - finite_values.size / len(column)
        of = {WHEEL: f"wheel {k + 1}", AXIS: ("x", "y", "yaw")[k % 3], SCALAR: ""}[CHANNELS[channel]]
        name = channel.replace("_", " ") if k == 0 else ""
        yield name, of, units[k % len(units)], *numbers, f"{absent_share:.0%}" if absent_share else ""


def _values(run: Run) -> Iterator[Any]:
    return (getattr(run, field.name) for field in fields(run))


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and bool(np.array_equal(a, b, equal_nan=True))
    return bool(a is b or a == b) if not (isinstance(a, np.ndarray) or isinstance(b, np.ndarray)) else False


def _read_only(name: str, value: ArrayLike, kind: str | None, samples: int | None = None) -> FloatArray:
    """A read-only float64 copy of the right shape; an array that nobody can write to is not copied."""
    shape = {WHEEL: "(samples, wheels)", AXIS: "(samples, 3)"}.get(kind or "", "(samples,)")
    try:
        given = np.asarray(value)
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError("not numbers", got=repr(value), expected=f"numbers, shape {shape}", where=name) from None
    if given.dtype.kind in "mM":
        remedy = "write (t - t[0]) / np.timedelta64(1, 's')"
        raise InputError("dates are no seconds", got=given.dtype, expected="seconds", remedy=remedy, where=name)
    dimensions = 2 if kind in (WHEEL, AXIS) else 1
    bad_shape = array.ndim != dimensions or array.shape[0] == 0 or (kind == AXIS and array.shape[1] != 3)
    if bad_shape or (samples is not None and array.shape[0] != samples):
        length = f" with {samples} samples" if samples is not None else ""
        raise InputError("wrong shape", got=array.shape, expected=shape + length, where=name)
    if (size := np.abs(array)).max(initial=0.0, where=~np.isnan(size)) > LARGEST_SIZE:
        place = np.unravel_index(np.nanargmax(size), array.shape)
        raise InputError(
            "no sensor gives such a number",
            got=f"{array[place]:.4g} in row {place[0]}",
            expected=f"at most {LARGEST_SIZE:g} in size, or NaN where a value is missing",
            where=name,
        )
    if array.flags.writeable or array.base is not None:
        array = array.copy()
        array.flags.writeable = False
    return array
