"""Comparison: the answer of `compare`: numbers per robot, component and segment, and the runs behind them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.metrics import Metrics
from omnidyn.comparison.nearer_model import ModelDifference
from omnidyn.comparison.traces import Trace, trace_of, unit
from omnidyn.comparison.verdict import compared, followed, nothing_followed
from omnidyn.document import Document, Part, Table, Words, cell, chance_cell, plain
from omnidyn.logs.channels import place
from omnidyn.model.first_guess import guess_line
from omnidyn.run import Run
from omnidyn.shown import FIGURE, FRAME, Displayable, make
from omnidyn.simulation.band import Band
from omnidyn.statement import Statement, as_verdict, by_severity

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Segment:
    """A stretch of a log that was one free run: log counts from 0, rows from `start` to before `stop`, times [s]."""

    log: int
    start: int
    stop: int
    begin: float
    end: float

    @property
    def rows(self) -> slice:
        """The rows in the Run of its log."""
        return slice(self.start, self.stop)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Displayable):
    """How near one or two models come to the logs of a robot.

    robots: their names, the first one being what `rmse`, `fit_percent` and `vaf` are about. measured: the logs.
    simulated: robot -> what it does under the same inputs, one Run per log. applied: robot -> what drove it.
    channels: the components compared ("vx", "w1", "heading", ...). segments: the free runs.
    overall: robot -> component -> Metrics over all samples. by_segment: robot -> component -> Metrics of each segment,
    None where it has no sample. difference: component -> which of two robots is better; empty for one robot.
    current_unsigned: whether currents were compared by size. rests_on: robot -> what of it is a guess.
    warnings: what a reader must know. bands: robot -> log -> Band of its run, where that was asked for and
    its file has a std.
    """

    robots: tuple[str, ...]
    measured: tuple[Run, ...]
    simulated: Mapping[str, tuple[Run, ...]]
    applied: Mapping[str, tuple[Statement, ...]]
    channels: tuple[str, ...]
    segments: tuple[Segment, ...]
    overall: Mapping[str, Mapping[str, Metrics]]
    by_segment: Mapping[str, Mapping[str, tuple[Metrics | None, ...]]]
    difference: Mapping[str, ModelDifference] = field(default_factory=dict)
    current_unsigned: bool = False
    rests_on: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    warnings: tuple[Statement, ...] = ()
    bands: Mapping[str, Mapping[int, Band]] = field(default_factory=dict)
    guesses: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {value:.3g} {unit(name)}" for name, value in self.rmse.items())
        return f"<Comparison of {' and '.join(self.robots)} with {len(self.measured)} logs: rmse {errors}>"

    def plot(self, log: int = 0, channels: Sequence[str] = ()) -> Figure:
        """Measured and model over time, model minus measured below it, as a matplotlib Figure.

        log: which of the logs, from 0. channels: components to show, such as "vx" or "w1", at most six; the first
        three by default. Raises InputError for one that was not compared.
        """
        return make(FIGURE, self, log=log, channels=channels)

    def to_dataframe(self, library: str = "pandas") -> Any:
        """A DataFrame with a row for each robot and component: rmse, fit, vaf and so on, with their unit.

        library: "pandas" or "polars". Raises MissingExtraError where it is not installed.
        """
        return make(FRAME, self, library=library)

    @property
    def rmse(self) -> dict[str, float]:
        """Component -> rmse of the first robot, in SI units."""
        return {name: metrics.rmse for name, metrics in self.overall[self.robots[0]].items()}

    def rmse_of_log(self, log: int, robot: str = "") -> dict[str, float]:
        """Component -> rmse over one log, in SI units; of the first robot by default. log: which one, from 0.

        sqrt(sum of n rmse^2 / sum of n) over its segments of n samples; what was not measured in it is left out.
        """
        of_log = {}
        for name, scores in self.by_segment[robot or self.robots[0]].items():
            pairs = zip(self.segments, scores, strict=True)
            kept = [metrics for at, metrics in pairs if at.log == log and metrics is not None and metrics.samples]
            if kept:
                squares = sum(metrics.samples * metrics.rmse**2 for metrics in kept)
                of_log[name] = float(np.sqrt(squares / sum(metrics.samples for metrics in kept)))
        return of_log

    @property
    def fit_percent(self) -> dict[str, float | None]:
        """Component -> fit of the first robot [%], None where the measured signal never changes."""
        return {name: metrics.fit_percent for name, metrics in self.overall[self.robots[0]].items()}

    @property
    def vaf(self) -> dict[str, float | None]:
        """Component -> variance accounted for by the first robot [%], None where the measured signal never changes."""
        return {name: metrics.vaf for name, metrics in self.overall[self.robots[0]].items()}

    def better(self, component: str) -> str | None:
        """Name of the robot that is surely nearer in a component; None where chance could have done it."""
        index = self.difference[component].better
        return None if index is None else self.robots[index]

    @property
    def verdict(self) -> Statement:
        """How well the model follows the logs; of two models also which is nearer."""
        better = {name: self.better(name) for name in self.difference}
        return compared(self.robots, [self.overall[robot] for robot in self.robots], better)

    @property
    def failed(self) -> bool:
        """Whether no robot follows the logs: something changes, and nothing of it is followed even roughly."""
        return all(nothing_followed(followed(self.overall[robot])) for robot in self.robots)

    def trace(self, robot: str, component: str, segment: Segment) -> Trace:
        """Measured and model of one component over one segment."""
        real, ours = self.measured[segment.log], self.simulated[robot][segment.log]
        return trace_of(component, real, ours, segment.rows, self.current_unsigned)

    def band(self, robot: str, component: str, segment: Segment) -> tuple[FloatArray, FloatArray] | None:
        """(low, high) end of the band of one component over one segment, None where there is none."""
        run_band, channel = self.bands.get(robot, {}).get(segment.log), (place(component) or ("",))[0]
        if run_band is None or getattr(run_band.low, channel, None) is None:
            return None
        real = self.measured[segment.log]
        low, high = (trace_of(component, real, end, segment.rows).model for end in (run_band.low, run_band.high))
        if self.current_unsigned and channel == "current":
            inside = (low < 0.0) & (high > 0.0)
            low, high = np.where(inside, 0.0, np.minimum(abs(low), abs(high))), np.maximum(abs(low), abs(high))
        return low, high

    def half_widths(self, robot: str) -> dict[str, float]:
        """Component -> mean half width of its band, in SI units; nothing where there is no band."""
        widths = {}
        for name in self.channels:
            ends = [ends for segment in self.segments if (ends := self.band(robot, name, segment)) is not None]
            width = np.concatenate([0.5 * (high - low) for low, high in ends]) if ends else np.zeros(0)
            if np.isfinite(width).any():
                widths[name] = float(np.nanmean(width))
        return widths

    def summary(self, segments: bool = False) -> str:
        """The comparison as plain tables, for reading; with `segments`, each segment too. ASCII only."""
        return self.document(segments).to_text() + "\n"

    def document(self, segments: bool = False) -> Document:
        """What the comparison says; with `segments`, of each segment too."""
        parts: list[Part] = []
        for robot in self.robots:
            parts += [*self._title(robot), "", metrics_table(self.channels, self.overall[robot]), ""]
            for k in range(len(self.segments) if segments else 0):
                of_segment = {name: scores[k] for name, scores in self.by_segment[robot].items()}
                parts += [self._name(k), metrics_table(self.channels, of_segment, head=()), ""]
        for robot in self.bands:
            caption = f"95 % band of {robot}, from the std of its file: mean half width beside the error"
            parts += [caption, "", band_table(self.half_widths(robot), self.overall[robot]), ""]
        if self.difference:
            first, second = self.robots
            parts += [
                f"rmse of {first} minus rmse of {second}, with its standard error (block bootstrap)",
                "",
                difference_table(self.robots, self.difference),
                "",
            ]
        if any(gap.each_s for gap in self.difference.values()):
            parts.append(
                "angles of wheels: nearer is the model that knows better how far they turn in each tenth of a second."
            )
        parts += legend([metrics for scores in self.overall.values() for metrics in scores.values()])
        parts += ["currents are compared by size, without sign."] if self.current_unsigned else []
        parts.append(by_severity(self.warnings))
        return Document(parts, self.to_dict(), self.warnings, ascii=True, verdict=self.verdict)

    def brief_table(self) -> Table:
        """How near one model comes, or which of two is nearer: a row per component, without what is for experts."""
        first, *rivals = self.robots
        scores = self.overall[first]
        if self.difference:
            second = rivals[0]
            rows = [
                (
                    name,
                    unit(name),
                    f"{scores[name].rmse:.4g}",
                    f"{self.overall[second][name].rmse:.4g}",
                    self.better(name) or ("the same" if gap.std_error == 0.0 else "cannot tell"),
                )
                for name, gap in self.difference.items()
            ]
            return Table(("", "unit", f"rmse of {first}", f"rmse of {second}", "nearer"), rows, "<<>><", (8, 6))
        widths = self.half_widths(first) if self.bands else {}
        bands = [(f"{widths[name]:.4g}" if name in widths else "",) * bool(self.bands) for name in self.channels]
        rows = [(*_row(name, scores[name]), *extra) for name, extra in zip(self.channels, bands, strict=True)]
        return Table((*HEAD, *(("band +-",) * bool(self.bands))), rows, "<<>", WIDTHS)

    def brief_head(self) -> list[Words]:
        """Which robots met which logs, and what drove them."""
        if len({self.applied_text(robot) for robot in self.robots}) > 1:
            return [words for robot in self.robots for words in self._title(robot)]
        title, applied, *_ = self._title(" and ".join(self.robots), self.robots[0])
        return [title, applied, *(words for robot in self.robots for words in self._title(robot)[2:])]

    def _title(self, names: str, robot: str = "") -> tuple[Words, ...]:
        """Which robots met which logs, what drove one of them (by default the one named), what of it is a guess."""
        robot = robot or names
        seconds = sum(segment.end - segment.begin for segment in self.segments)
        logs, count = len(self.measured), len(self.segments)
        source = self.measured[0].source or "one run"
        source = source if logs == 1 else f"{logs} logs, first {source}"
        title = f"{names} against {source}: {count} free run{'s' * (count > 1)}, {seconds:.4g} s"
        guess_words = [Words(line)] if (line := guess_line(self.rests_on.get(robot, ()))) else []
        return Words(title), Words(f"applied: {self.applied_text(robot)}"), *guess_words

    def applied_text(self, robot: str) -> str:
        """What drove a robot, in words."""
        return "; or ".join(map(str, self.applied[robot]))

    def _name(self, k: int) -> str:
        at = self.segments[k]
        log = f"log {at.log + 1}, " if len(self.measured) > 1 else ""
        return f"segment {k + 1}: {log}rows {at.start} to {at.stop - 1}, {at.begin:.4g} to {at.end:.4g} s"

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON can hold it, without the runs."""
        robots = {
            name: {
                "applied": plain(self.applied[name]),
                "rests_on_guesses": list(self.rests_on.get(name, ())),
                "overall": {key: asdict(metrics) for key, metrics in self.overall[name].items()},
                "by_segment": {
                    key: [None if metrics is None else asdict(metrics) for metrics in row]
                    for key, row in self.by_segment[name].items()
                },
            }
            for name in self.robots
        }
        return {
            **as_verdict(self.verdict),
            "ok": not self.failed,
            "logs": [run.source for run in self.measured],
            "segments": [asdict(segment) for segment in self.segments],
            "units": {name: unit(name) for name in self.channels},
            "robots": robots,
            "difference": {key: {**asdict(gap), "better": self.better(key)} for key, gap in self.difference.items()},
            "bands": {
                name: {"half_width": self.half_widths(name), "guesses": list(self.guesses.get(name, ()))}
                for name in self.bands
            },
            "current_unsigned": self.current_unsigned,
            "warnings": plain(self.warnings),
        }


# What a comparison says in tables and words: one row per component

HEAD = ("", "unit", "samples", "rmse", "max", "bias", "fit %", "VAF %", "white p", "lag s")
WIDTHS = (8, 6, 7, 9, 9, 9, 7, 7, 7, 6)  # the same for all tables, so that they can be read below each other


def metrics_table(names: Sequence[str], scores: Mapping[str, Metrics | None], head: Sequence[str] = HEAD) -> Table:
    """How near a model comes, a row per component."""
    return Table(head, [_row(name, scores[name]) for name in names], "<<>", WIDTHS)


def _row(name: str, metrics: Metrics | None) -> tuple[str, ...]:
    if metrics is None:
        return name, unit(name), "0"
    return (
        name,
        unit(name),
        f"{metrics.samples}",
        f"{metrics.rmse:.4g}",
        f"{metrics.max:.4g}",
        f"{metrics.bias:+.3g}",
        cell(metrics.fit_percent, ".1f"),
        cell(metrics.vaf, ".1f"),
        chance_cell(metrics.whiteness),
        cell(metrics.lag, "+.3f"),
    )


def band_table(half_widths: Mapping[str, float], scores: Mapping[str, Metrics]) -> Table:
    """How wide the band of a model is, a row per component, beside how far the model is off."""
    rows = [(name, unit(name), f"{half:.4g}", f"{scores[name].rmse:.4g}") for name, half in half_widths.items()]
    return Table(("", "unit", "half width", "rmse"), rows, "<<>", (8, 6, 10, 9))


def difference_table(robots: Sequence[str], gaps: Mapping[str, ModelDifference]) -> Table:
    """Which of two robots is better, a row per component."""
    rows = []
    for name, gap in gaps.items():
        nearer = "the same" if gap.std_error == 0.0 else "cannot tell"
        nearer = nearer if gap.better is None else robots[gap.better]
        rows.append((name, f"{gap.rmse_difference:+.4g}", cell(gap.std_error, ".2g"), f"{gap.blocks}", nearer))
    return Table(("", "difference", "std error", "blocks", "better"), rows, "<>>><", (8, 12, 9, 6))


def legend(scores: Sequence[Metrics]) -> Iterator[str]:
    """What the columns mean, where it is not plain."""
    yield "error = model - measured."
    if any(metrics.lag for metrics in scores):
        yield "lag: the robot is later than the model by so much, where that explains clearly more; a hint."
    if any(metrics.fit_percent is None for metrics in scores):
        yield "no fit and no VAF where the measured signal never changes."
