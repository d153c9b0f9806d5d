"""Estimate: the answer of every identification: a robot with fitted numbers, and how far they can be trusted."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Part, Table, interval_cell, plain, sentence
from omnidyn.errors import shortened
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit
from omnidyn.identification.selection.blocks import BlockComparison
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.first_guess import rests_on as guesses_under
from omnidyn.model.first_guess import rests_on_guesses
from omnidyn.model.keys import in_words, unit
from omnidyn.model.robot import IDENTIFIED, Prior, Robot
from omnidyn.model.robot_file import robot_to_toml
from omnidyn.shown import FIGURE, FRAME, Displayable, make
from omnidyn.statement import NOTE, Statement, by_severity, statements

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOT_DETERMINED = "not determined"  # in the place of an interval: the data do not give one
UNKNOWN = {"std": None, "ci95": [None, None]}  # the same for machines
WIDENING_SHARE = 0.1  # by which an interval must be wider for that to be worth a table
SOURCE_LENGTH = 300  # a robot file takes 400 characters


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlations of the estimates: matrix[i, j] between names[i] and names[j]. Shape (names, names)."""

    names: tuple[str, ...]
    matrix: FloatArray

    def between(self, first: str, second: str) -> float:
        """The correlation of two parameters."""
        return float(self.matrix[self.names.index(first), self.names.index(second)])


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Displayable):
    """What data say about a robot. Parameters are named by their key in the robot file: "friction.axes.viscous[0]".

    robot: with the fitted numbers; its priors hold std, source and origin, so that its file tells where they come from.
    value, std, ci95: name -> estimate, standard error, 95 % interval (low, high), in the unit of the key.
    correlation: between the estimates. degrees_of_freedom: name -> rows minus parameters behind that number.
    at_bound: names of what a bound holds (a friction that came out negative). std is then that of the free fit.
    unidentifiable: names of what the data do not determine. lower_bound: name -> what the number is at least, where the
    data say no more (breakaway from rows at rest).
    warnings: what a reader must know; text is quoted. method, data: how it was made, and from what (name, SHA-256).
    scale: what all forces scale with, in words: numbers that were taken as they stand.
    log_alone: name -> 95 % interval from the log alone, were what the robot file knows with a std exact; empty where it
    knows nothing so.
    points: at constant speed, that the friction was fitted to; None for a fit to whole logs.
    study: makes the diagnosis, on first access.
    """

    robot: Robot
    value: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    correlation: Correlation
    degrees_of_freedom: Mapping[str, int]
    at_bound: tuple[str, ...] = ()
    unidentifiable: tuple[str, ...] = ()
    lower_bound: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[Statement, ...] = ()
    method: str = ""
    data: str = ""
    scale: str = ""
    log_alone: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    points: SteadyTable | None = field(default=None, repr=False)
    study: Callable[[], Diagnosis] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "warnings", statements(self.warnings))

    @cached_property
    def diagnosis(self) -> Diagnosis | None:
        """What the fit leaves out and what its numbers rest on, found when it is first asked for; None without logs."""
        return self.study() if self.study else None

    @property
    def lack_of_fit(self) -> LackOfFit | None:
        """Whether the residuals hold more than noise, and what would explain it."""
        return self.diagnosis.lack_of_fit if self.diagnosis else None

    @property
    def rests_on(self) -> Mapping[str, Mapping[str, float]]:
        """Number -> key of a number that was taken as it stands -> relative change of the first per percent of it."""
        return self.diagnosis.rests_on if self.diagnosis else {}

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name} = {value:.4g}" for name, value in self.value.items())
        return f"<{type(self).__name__} {self.robot.name}: {numbers}>"

    def plot(self) -> Figure:
        """Friction against speed along x, along y and about yaw, with its 95 % band, as a matplotlib Figure.

        Points at constant speed are marked where the friction was fitted to such: Fig. 3 of the paper, with own data.
        """
        return make(FIGURE, self)

    def to_dataframe(self, library: str = "pandas") -> Any:
        """A DataFrame with a row for each number: value, std, 95 % interval, unit.

        library: "pandas" or "polars". Raises MissingExtraError where it is not installed.
        """
        return make(FRAME, self, library=library)

    @property
    def verdict(self) -> str:
        """How well its numbers are known, in a sentence."""
        return sentence(str(self.numbers_known()))

    def numbers_known(self) -> Statement:
        """How many numbers are known, the widest of them, and what is not known."""
        share = {name: self.half_width(name) for name in self.value}
        known_shares = {name: share_of_number for name, share_of_number in share.items() if self.is_known(name)}
        widest_number = max(known_shares, key=lambda name: known_shares[name], default="")
        missing = tuple(name for name in share if name not in known_shares)
        numbers = {
            "count": len(share),
            "missing": missing,
            "widest": widest_number,
            "share": known_shares.get(widest_number),
        }
        return Statement("numbers_known", NOTE, numbers=numbers)

    def half_width(self, name: str) -> float:
        """Half the width of the 95 % interval of a number over its size; infinite for one that is not determined."""
        value, (low, high) = self.value[name], self.ci95[name]
        share = 0.5 * (high - low) / abs(value) if value and name not in self.unidentifiable else math.inf
        return share if share >= 0.0 else math.inf

    def is_known(self, name: str) -> bool:
        """Whether the 95 % interval of a number holds no 0, and is no wider to each side than the number itself."""
        low, high = self.ci95[name]
        return (low > 0.0 or high < 0.0) and self.half_width(name) <= 1.0

    def summary(self) -> str:
        """The estimate as a plain table, for reading. ASCII only."""
        return self.document().to_text() + "\n"

    def document(self) -> Document:
        """What the estimate says."""
        return Document(self._parts(), self.to_dict(), self.warnings, ascii=True, verdict=self.verdict)

    def _parts(self) -> list[Part]:
        """Its words and its table, in the order of reading."""
        bounds = [f"{name} is at least {bound:.4g} {unit(name)}" for name, bound in self.lower_bound.items()]
        head = [f"{self.robot.name}: {self.method}", f"data: {self.data}", ""]
        scale = [self.scale] if self.scale else []
        guess_lines = [words] if (words := rests_on_guesses(self.robot)) else []
        alone_tables = [table] if (table := self.alone_table()) else []
        return [*head, self._table(), *alone_tables, *bounds, *scale, *guess_lines, by_severity(self.warnings)]

    def _table(self) -> Table:
        rows = []
        for name, value in self.value.items():
            if name in self.unidentifiable:
                rows.append((name, f"{value:.4g}", "", NOT_DETERMINED, unit(name), in_words(name)))
                continue
            mark = "  at bound" if name in self.at_bound else ""
            interval = interval_cell(self.ci95[name])
            rows.append((name, f"{value:.4g}", f"{self.std[name]:.3g}", interval, unit(name) + mark, in_words(name)))
        head = ("parameter", "value", "std error", "95 % interval", "unit", "in words")
        return Table(head, rows, "<>>><", name="numbers")

    def alone_table(self) -> Table | None:
        """What the intervals owe to what the robot file gives with a std; None where that is not worth a word."""
        rows = []
        for name, (low, high) in self.log_alone.items():
            whole_interval = self._whole(name)
            if whole_interval is not None and whole_interval[1] - whole_interval[0] > (1.0 + WIDENING_SHARE) * (
                high - low
            ):
                rows.append((name, interval_cell((low, high)), interval_cell(whole_interval)))
        return (
            Table(("95 % intervals", "from the log alone", "with what is known of the robot"), rows) if rows else None
        )

    def _whole(self, name: str) -> tuple[float, float] | None:
        """The interval of a number."""
        return self.ci95.get(name)

    def to_dict(self) -> dict[str, Any]:
        """The estimate as JSON can hold it: no NaN, no infinity (null instead); the robot as the text of its file."""
        parameters = {
            name: {
                "value": value,
                "std": self.std[name],
                "ci95": self.ci95[name],
                "degrees_of_freedom": int(self.degrees_of_freedom[name]),
                "at_bound": name in self.at_bound,
                "unit": unit(name),
                "words": in_words(name),
            }
            | (UNKNOWN if name in self.unidentifiable else {})
            for name, value in self.value.items()
        }
        return plain(
            {
                "parameters": parameters,
                "lower_bound": self.lower_bound,
                "correlation": {"names": self.correlation.names, "matrix": self.correlation.matrix},
                "from_the_log_alone": self.log_alone,
                "rests_on_guesses": guesses_under(self.robot),
                "warnings": self.warnings,
                "method": self.method,
                "data": self.data,
                "scale": self.scale,
                "robot": robot_to_toml(self.robot),
            }
        )


def identified(std: float | None, source: str) -> Prior:
    """The prior of an identified number: its standard error, where it is one, and from what it was identified."""
    has_std = std is not None and 0.0 < std <= 1e9
    return Prior(std=float(std) if has_std else None, source=printable(source), origin=IDENTIFIED)  # type: ignore[arg-type]


def printable(source: str) -> str:
    """The words of a source as a robot file takes them."""
    clean = source if source.isprintable() else "".join(c if c.isprintable() else " " for c in source)
    return shortened(clean, SOURCE_LENGTH)


@dataclass(frozen=True)
class HeldOut:
    """Errors of free runs on blocks of the logs that were not fitted: root mean square of each output over its own
    spread, the geometric mean of all outputs.

    written: of what is written. plain: of the plain fit: friction and what else was free, white noise, no nuisances.
    given: of the robot as it was given; None where nothing was. comparison: of what is written with the plain fit.
    """

    written: float
    plain: float
    given: float | None = None
    comparison: BlockComparison | None = None

    def statement(self) -> Statement:
        """What they are."""
        return Statement("held_out_blocks", NOTE, numbers=asdict(self))
