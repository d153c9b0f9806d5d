"""Tracking: how near a controller brought a robot to a path, and at what expense."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.controller import PATH_ENDED
from omnidyn.control.margins import FARTHEST_DELAY, FARTHEST_GAIN, Margins
from omnidyn.document import Document, Part, Points, Table, plain
from omnidyn.run import Run
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict, by_severity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MICRO = 1e6


@dataclass(frozen=True, eq=False, repr=False)
class Tracking(Displayable):
    """What a closed loop did: a sequence of itself and of others on the same path, in the order of the call.

    controller, plant, path: their names. run: what the robot did. wanted: poses of the path at the times of the run,
    shape (samples, 3). skip [s]: errors before it count for nothing. dt [s]: between two steps.
    saturated_share: of the steps, those with an output at its limit. step_times [s]: of the controller, shape (steps,).
    margins: by how much outputs may be later and stronger. statuses: word of `info.status` other
    than "ok" -> number of steps. sensors: with which the robot was measured.
    others: of the other controllers; numbers are those of this one, `best` is the nearest of all, and summary, document
    and plot are of all of them, side by side.
    """

    controller: str
    plant: str
    path: str
    run: Run
    wanted: FloatArray
    skip: float
    dt: float
    saturated_share: float
    step_times: FloatArray
    statuses: Mapping[str, int] = field(default_factory=dict)
    sensors: str = ""
    margins: Margins | None = None
    others: tuple[Tracking, ...] = ()

    def __repr__(self) -> str:
        if self.others:
            return f"<Tracking of {self.path} by {', '.join(tracking.controller for tracking in self)}>"
        return f"<Tracking of {self.path} by {self.controller}: rmse {self.rmse_position:.3g} m>"

    @cached_property
    def _all(self) -> tuple[Tracking, ...]:
        return (replace(self, others=()), *self.others) if self.others else (self,)

    def __iter__(self) -> Iterator[Tracking]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __getitem__(self, index: int) -> Tracking:
        return self._all[index]

    @property
    def best(self) -> Tracking:
        """The one whose position is nearest to the path."""
        return min(self, key=lambda tracking: tracking.rmse_position)

    @cached_property
    def error(self) -> FloatArray:
        """Pose of the robot minus pose of the path, in the world [m, m, rad]. Shape (samples, 3)."""
        assert self.run.pose is not None
        return self.run.pose - self.wanted

    @property
    def distance(self) -> FloatArray:
        """Distance from the path [m]. Shape (samples,)."""
        return np.hypot(*self.error[:, :2].T)

    @property
    def counted(self) -> FloatArray:
        """The errors that count: from `skip` on, the start apart; the last one where nothing is left. (rows, 3)."""
        late = self.run.t >= self.skip - 1e-9
        late[0] = False
        return self.error[late] if late.any() else self.error[-1:]

    @property
    def rmse_position(self) -> float:
        """Root of the mean squared distance from the path [m]."""
        return float(np.sqrt(np.mean(np.sum(self.counted[:, :2] ** 2, axis=1))))

    @property
    def rmse_heading(self) -> float:
        """Root of the mean squared error of the heading [rad]."""
        return float(np.sqrt(np.mean(self.counted[:, 2] ** 2)))

    @property
    def worst_position(self) -> float:
        """The largest distance from the path [m]."""
        return float(np.hypot(*self.counted[:, :2].T).max())

    @property
    def effort(self) -> float:
        """Root of the mean squared voltage of a motor [V]."""
        assert self.run.voltage is not None
        return float(np.sqrt(np.mean(self.run.voltage[:-1] ** 2)))

    @property
    def restlessness(self) -> float:
        """Mean change of a voltage from step to step [V]: what gears and ears notice."""
        assert self.run.voltage is not None
        return float(np.mean(np.abs(np.diff(self.run.voltage[:-1], axis=0)))) if len(self.run) > 2 else 0.0

    @property
    def step_us(self) -> dict[str, float]:
        """Time of a step of the controller [us]: median, and what 99 of 100 stay below."""
        median, high = np.quantile(self.step_times, [0.5, 0.99])
        return {"median": MICRO * float(median), "p99": MICRO * float(high)}

    @property
    def verdict(self) -> Statement:
        """How near it came."""
        assert self.run.pose is not None
        numbers = {
            "plant": self.plant,
            "path": self.path,
            "worst": self.worst_position,
            "rmse": self.rmse_position,
            "size": np.hypot(*np.ptp(self.wanted[:, :2], axis=0)),
            "saturated": self.saturated_share,
        }
        return Statement("tracked", NOTE, self.controller, numbers)

    def summary(self) -> str:
        """The result as text."""
        return self.document().to_text()

    def document(self) -> Document:
        """What it says; of several controllers, side by side."""
        return trackings_document([*self])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "name": self.controller,
            "rmse_position_m": self.rmse_position,
            "rmse_heading_rad": self.rmse_heading,
            "worst_position_m": self.worst_position,
            "saturated_share": self.saturated_share,
            "step_us": self.step_us,
            "effort_V": self.effort,
            "restlessness_V": self.restlessness,
            "delay_margin_s": None if self.margins is None else self.margins.delay,
            "gain_margin": None if self.margins is None else self.margins.gain,
            "statuses": dict(self.statuses),
        }

    def plot(self) -> Figure:
        """Path and robot from above, error over time, voltages, as a matplotlib Figure."""
        return make(FIGURE, self)


def _of_run(tracking: Tracking, with_name: bool) -> list[Statement]:
    """What the simulation of the robot itself has to say, such as of wheels that slip."""
    return [warning.of(tracking.controller) if with_name else warning for warning in tracking.run.warnings]


def trackings_document(trackings: Sequence[Tracking], notes: Sequence[Statement] = ()) -> Document:
    """What controllers on one path did, side by side. notes: what is said beside, such as what the path asks for."""
    first = trackings[0]
    span = float(first.run.t[-1])
    head = (
        f"{first.plant} along {first.path}: {len(first.step_times)} steps of {first.dt:g} s, {span:.6g} s; errors from "
    )
    head += f"{first.skip:g} s on; sensors {first.sensors}"
    rows = [
        (
            tracking.controller,
            f"{1e3 * tracking.rmse_position:.3f}",
            f"{1e3 * tracking.rmse_heading:.2f}",
            f"{1e3 * tracking.worst_position:.2f}",
            f"{100.0 * tracking.saturated_share:.1f}",
            f"{tracking.effort:.2f}",
            f"{tracking.restlessness:.3f}",
            *_margins(tracking),
            f"{tracking.step_us['median']:.0f}",
            f"{tracking.step_us['p99']:.0f}",
        )
        for tracking in trackings
    ]
    columns = (
        "controller",
        "position mm",
        "heading mrad",
        "worst mm",
        "at limit %",
        "effort V",
        "change V",
        "delay ms",
        "gain",
        "step us",
        "p99 us",
    )
    warnings = [
        warning for tracking in trackings for warning in (*_odd(tracking), *_of_run(tracking, len(trackings) > 1))
    ]
    verdict = _verdict(trackings)
    parts: list[Part] = [
        head,
        "",
        Table(columns, rows, "<>", name="controllers"),
        "",
        "position, heading: rmse; effort: rms of a voltage; change: its mean change from step to step.",
        "delay, gain: how much later outputs may act, and how many times as strong, before the loop no longer settles.",
    ]
    parts += [Points(notes, "-", "path")] if notes else []
    parts.append(by_severity(warnings, "warnings"))
    data = {
        **as_verdict(verdict),
        "robot": first.plant,
        "path": first.path,
        "dt_s": first.dt,
        "duration_s": span,
        "skip_s": first.skip,
        "sensors": first.sensors,
        "controllers": [tracking.to_dict() for tracking in trackings],
        "notes": plain(list(notes)),
        "warnings": plain(warnings),
    }
    return Document(parts, data, warnings, verdict=verdict)


def _margins(tracking: Tracking) -> tuple[str, str]:
    """The margins in cells of a table."""
    if tracking.margins is None:
        return "", ""
    delay, gain = tracking.margins.delay, tracking.margins.gain
    return (
        f"{'> ' * (delay >= FARTHEST_DELAY)}{1e3 * delay:.0f}",
        f"{'> ' * (gain >= FARTHEST_GAIN)}{gain:.2g}",
    )


def _verdict(trackings: Sequence[Tracking]) -> Statement:
    """The best of several first."""
    best = min(trackings, key=lambda tracking: tracking.rmse_position)
    if len(trackings) == 1:
        return best.verdict
    rivals = [tracking for tracking in trackings if tracking is not best]
    times = [tracking.rmse_position / max(best.rmse_position, 1e-12) for tracking in rivals]
    numbers = {"best": best.verdict, "others": [tracking.controller for tracking in rivals], "times": times}
    return Statement("best_tracked", NOTE, best.controller, numbers)


def _odd(tracking: Tracking) -> list[Statement]:
    """Steps that did not go as they should."""
    steps = len(tracking.step_times)
    return [
        Statement("steps_with_status", WARNING, status, {"count": count, "steps": steps}).of(tracking.controller)
        for status, count in tracking.statuses.items()
        if status != PATH_ENDED
    ]
