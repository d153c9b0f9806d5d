"""Answer: what a fit to whole logs says, in values, intervals and words; one OutputErrorEstimate a group."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from omnidyn.document import Part, Points, interval_cell, plain, sentence
from omnidyn.identification.estimate import NOT_DETERMINED, UNKNOWN, Estimate, HeldOut
from omnidyn.identification.lack_of_fit import LackOfFit
from omnidyn.identification.ladder import Ladder
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.cures import Blind
from omnidyn.identification.stability import Stability
from omnidyn.identification.steady.group_numbers import Difference
from omnidyn.model.log_effects import log_mark
from omnidyn.run import Run
from omnidyn.statement import ERROR, NOTE, Statement


@dataclass(frozen=True)
class Nuisance:
    """A number of the log, not of the robot: value, std, 95 % interval, in `unit`."""

    value: float
    std: float
    ci95: tuple[float, float]
    unit: str = ""


@dataclass(frozen=True)
class Combination:
    """A number that the logs determine where they do not determine those behind it: name, value, std, 95 % interval.

    axis: along which it acts. correlation: of those behind it, where the sum is known because they trade; else None.
    """

    name: str
    value: float
    std: float
    ci95: tuple[float, float]
    unit: str
    axis: str
    correlation: float | None = None

    def statement(self) -> Statement:
        """What it is."""
        kind = self.name.partition(".")[0]
        return Statement(f"combined_{kind}", NOTE, self.axis, {"correlation": self.correlation})

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {**asdict(self), "words": str(self.statement())}


def _nothing() -> None:
    """None."""


@dataclass(frozen=True, eq=False, repr=False)
class OutputErrorEstimate(Estimate):
    """An Estimate from whole logs. `correlation` covers the nuisances too.

    nuisances: name -> Nuisance. noise: output -> std of what the model leaves, in the unit of the output; after
    Student's t without its outliers, of counts before the encoder rounds.
    unidentifiable: names of what the data do not determine. Where the std of the robot file is a prior, the value is
    the one that goes best with all others, std and interval are those of the posterior, hardly more than what the file
    said; elsewhere both are infinite. Neither is ever shown. combinations: what the data determine of these numbers
    together. directions: of these numbers, that the data do not show, with what would show them. covariance: "white",
    "autoregressive" or "sandwich". unused: what the logs hold and the fit does not use, and why. iterations,
    converged: of the minimisation. not_followed: outputs that the model does not follow. robust: whether the loss is
    Student's t. ladder: what was switched on step by step, where that was asked for. reference: makes `held_out`.
    """

    nuisances: Mapping[str, Nuisance] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    combinations: tuple[Combination, ...] = ()
    directions: tuple[Blind, ...] = ()
    covariance: str = ""
    unused: tuple[Statement, ...] = ()
    iterations: int = 0
    converged: bool = True
    not_followed: tuple[str, ...] = ()
    robust: bool = False
    ladder: Ladder | None = None
    reference: Callable[[], HeldOut | None] = _nothing

    @property
    def held_out(self) -> HeldOut | None:
        """How well free runs predict blocks of the logs: of this robot, of a plain fit and of the robot as it was
        given. None of a speed loop, of a fit by Student's t, of several groups, and after an interrupt."""
        return self.reference()

    @property
    def lack_of_fit(self) -> LackOfFit | None:
        """Whether the residuals hold more than noise, what would explain it, and what free runs miss."""
        lack = super().lack_of_fit
        if lack is None or not lack.found or self.held_out is None:
            return lack
        return replace(lack, missed=self.held_out.written)

    @property
    def blind(self) -> tuple[Statement, ...]:
        """What the data do not show, and what would."""
        return tuple(direction.statement() for direction in self.directions)

    def beside(self, runs: Sequence[Run]) -> OutputErrorEstimate:
        """The same, where these logs are of the same series as those that were fitted, such as those held out: the file
        of the robot knows them, and they get what the logs did beside the robot."""
        log = self.robot.log
        if log is None or not runs:
            return self
        log_marks = dict.fromkeys((*log.of, *map(log_mark, runs)))
        return replace(self, robot=self.robot.replace(log=log.replace(of=tuple(log_marks))))

    @property
    def stability(self) -> Stability | None:
        """Which numbers differ between parts of the logs, before and after a moment or from log to log."""
        return self.diagnosis.stability if self.diagnosis else None

    @property
    def verdict(self) -> str:
        """How well its numbers are known, in a sentence; they mean nothing where the model does not follow."""
        if self.not_followed:
            return sentence(str(Statement("not_followed_at_all", ERROR, numbers={"outputs": self.not_followed})))
        return super().verdict

    def _parts(self) -> list[Part]:
        """The numbers of the log, the noise and what the data do not show, after the rest."""
        sums = [
            f"{combination.statement()}: {combination.value:.4g} {interval_cell(combination.ci95)} {combination.unit}"
            for combination in self.combinations
        ]
        logs = [
            f"{name}: {NOT_DETERMINED if name in self.unidentifiable else self._of_log(nuisance)}"
            for name, nuisance in self.nuisances.items()
        ]
        noise = [f"noise of {name}: {std:.3g}" for name, std in self.noise.items()]
        point_lists = [Points(self.blind, "not shown by the data:"), Points(self.unused, "not used:")]
        return [*super()._parts(), *sums, *logs, *noise, *point_lists]

    def _whole(self, name: str) -> tuple[float, float] | None:
        """The interval of a number of the robot or of the log."""
        return self.nuisances[name].ci95 if name in self.nuisances else super()._whole(name)

    @staticmethod
    def _of_log(nuisance: Nuisance) -> str:
        return f"{nuisance.value:.4g} {interval_cell(nuisance.ci95)} {nuisance.unit}".rstrip()

    def to_dict(self) -> dict[str, Any]:
        """The estimate as JSON can hold it."""
        nuisances = {
            name: asdict(nuisance) | (UNKNOWN if name in self.unidentifiable else {})
            for name, nuisance in self.nuisances.items()
        }
        return super().to_dict() | plain(
            {
                "nuisances": nuisances,
                "noise": self.noise,
                "unidentifiable": self.unidentifiable,
                "combinations": self.combinations,
                "blind": self.blind,
                "covariance": self.covariance,
                "unused": self.unused,
                "held_out_blocks": asdict(self.held_out) if self.held_out else None,
                "converged": self.converged,
                **({"ladder": self.ladder.to_dict()} if self.ladder else {}),
                "directions": [asdict(direction) for direction in self.directions],
            }
        )


@dataclass(frozen=True, eq=False)
class Answer:
    """What a fit says. estimates: group -> Estimate; one where there are no groups. Shared numbers are the same in all.

    own: names that each group has for itself; shared: the others. differences: every pair of groups (second minus
    first) and every own number that both determine.
    """

    estimates: Mapping[str, OutputErrorEstimate]
    own: tuple[str, ...]
    shared: tuple[str, ...]
    differences: tuple[Difference, ...]
    solutions: tuple[Solution, ...] = ()

    @property
    def estimate(self) -> OutputErrorEstimate:
        """The estimate of the first group; the only one where there are no groups."""
        return next(iter(self.estimates.values()))
