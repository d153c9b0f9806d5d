"""Identification: all that logs say about a robot, and what follows a fit when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from omnidyn.attempts import Attempts, Missing, not_made
from omnidyn.document import Document, Points, apart, sentence
from omnidyn.errors import InputError
from omnidyn.findings.finding import Verdict
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.fit_document import fit_document
from omnidyn.identification.log_verdicts import checked, unfit
from omnidyn.identification.methods import (
    LINE,
    Method,
    OutputError,
)
from omnidyn.identification.origin import Origin
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.fit import ALL_LOGS
from omnidyn.identification.steady.group_numbers import Difference
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.identification.validation import Validation
from omnidyn.identification.verdict import (
    fit_failure,
    fits_verdict,
    lines_verdict,
    of_group,
    steady_failure,
    steady_verdict,
)
from omnidyn.shown import FIGURE, FRAME, Displayable, make
from omnidyn.statement import ERROR, SEVERITIES, Statement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from omnidyn.identification.motors.study import MotorStudy
Save = Callable[[Mapping[str, Estimate]], object]


class After(NamedTuple):
    """What follows a fit. fits: by output error, with their diagnosis. verdicts: of `check` on each log."""

    fits: Mapping[str, OutputErrorEstimate]
    validations: Mapping[str, Validation]
    verdicts: tuple[Verdict, ...]
    advice: tuple[Statement, ...]
    attempts: Attempts


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Displayable):
    """All that logs say about a robot: estimates of each group, differences between groups, and what to do next.

    It has what the Estimate of its only group has, such as value, std, ci95, robot or lack_of_fit; one of motors has
    what its study has, such as motors, a MotorEstimate each.

    method: that was taken. groups: name -> Estimate; one, "all", where there are no groups; none of motors. study: by
    steady state, but for the shape "line", or of motors. interrupted: whether an interrupt cut the fit off. follow:
    makes what follows the fit, when it is first asked for. origin: what it was made from, see `provenance`.
    """

    method: Method
    groups: Mapping[str, Estimate]
    follow: Callable[[], After]
    differences: tuple[Difference, ...] = ()
    study: SteadyStudy | MotorStudy | None = None
    interrupted: bool = False
    origin: Origin | None = None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if len(self.groups) > 1 and hasattr(self._first(), name):
            first, groups = next(iter(self.groups)), ", ".join(self.groups)
            raise AttributeError(f"each group has its own {name}: say .groups[{first!r}].{name}; groups: {groups}")
        return getattr(self._first(), name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(name for name in dir(self._first()) if not name.startswith("_"))})

    def __repr__(self) -> str:
        if not self.groups:
            return f"<Identification {self.study!r}>"
        return f"<Identification by {self.method.name}: {', '.join(f'{g} {e!r}' for g, e in self.groups.items())}>"

    @property
    def _motors(self) -> MotorStudy | None:
        """The study of motors."""
        return None if self.groups else self.study  # type: ignore[return-value]

    @property
    def _steady(self) -> SteadyStudy | None:
        """The study of steady states."""
        return self.study if self.groups else None  # type: ignore[return-value]

    def _first(self) -> Any:
        """The estimate of the first group; the study of motors."""
        return next(iter(self.groups.values()), self.study)

    @property
    def estimate(self) -> Estimate:
        """The estimate of the only group. Raises InputError where there are several, or none."""
        if len(self.groups) != 1:
            names = ", ".join(self.groups) or "a study of motors"
            raise InputError("no single estimate", got=names, expected="one group", remedy='say .groups["NAME"]')
        return self._first()

    @cached_property
    def after(self) -> After:
        """What follows the fit, made when it is first asked for."""
        return self.follow()

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """What it was made from: the version, which holds the seeds of all draws too, the call, the inputs and hashes.

        That of a robot is of its file, that of a log the mark by which a robot file knows it again (`[log] of`), that
        of a table of the file it was read from.
        """
        return self.origin.to_dict() if self.origin else {}

    @property
    def validations(self) -> Mapping[str, Validation]:
        """Group -> its robot as a free run beside the logs, by output error only."""
        return self.after.validations

    @property
    def validation(self) -> Validation | None:
        """The same of the only group; None where there is none. Raises InputError where there are several groups."""
        return self.validations.get(ALL_LOGS) if self.estimate else None

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Of `check` on each log."""
        return self.after.verdicts

    @property
    def advice(self) -> tuple[Statement, ...]:
        """What to mend, to measure or to ask for next, gravest first."""
        return self.after.advice

    @property
    def missing(self) -> tuple[Missing, ...]:
        """Parts that were not made, and why."""
        return tuple(self.after.attempts.missing)

    @property
    def fits(self) -> Mapping[str, OutputErrorEstimate]:
        """The estimates by output error with their diagnosis: group -> Estimate."""
        return self.after.fits

    def plot(self, what: Literal["friction", "runs"] = "friction") -> Figure:
        """A picture of it, as a matplotlib Figure.

        friction: force against speed with its 95 % band, of each group, and the points at constant speed that it was
        fitted to; of motors, input against speed. runs: what was measured and the free run of the model with the band
        that its intervals leave, of the first log held out, else of the first; by output error only.
        """
        return make(FIGURE, self, what=what)

    def to_dataframe(self, library: str = "pandas") -> Any:
        """A DataFrame with a row for each number of each group: value, std, 95 % interval, unit.

        library: "pandas" or "polars". Raises MissingExtraError where it is not installed.
        """
        return make(FRAME, self, library=library)

    @property
    def failures(self) -> tuple[Statement, ...]:
        """Why the numbers mean nothing: what of a log is not followed, forces that no shape explains, and
        errors that `check` found; empty for a fit that stands."""
        if self._motors is not None:
            return (self._motors.verdict,) if self._motors.failed else ()
        failures = [steady_failure(self._steady)] if self._steady else []
        for group, fit in self.fits.items():
            fit_statement = fit_failure(fit, self.validations.get(group))
            failures.append(of_group(group, fit_statement) if fit_statement and len(self.groups) > 1 else fit_statement)
        return (*filter(None, failures), *unfit(self.verdicts))

    @property
    def verdict(self) -> str:
        """What it came to, failures first: whether the model follows, how well its numbers are known, and which parts
        of the result were not made."""
        return _sentences([*self.outcome(), *not_made(self.missing)])

    @property
    def headline(self) -> str:
        """The verdict in few sentences: the gravest statement, how well the numbers are known, what was not made."""
        statements = self.outcome()
        gravest = min(statements, key=lambda statement: SEVERITIES.index(statement.severity))
        return _sentences(list(dict.fromkeys([gravest, statements[-1], *not_made(self.missing)])))

    def outcome(self) -> list[Statement]:
        """What it came to, as statements."""
        if self._motors is not None:
            return [self._motors.verdict]
        if self.failures and not self.interrupted:
            return [Statement("failed", ERROR, numbers={"failures": self.failures})]
        if self._steady:
            return steady_verdict(self._steady)
        if isinstance(self.method, OutputError):
            return fits_verdict(self.fits, self.validations, self.verdicts, self.interrupted)
        return lines_verdict(self.groups)

    def document(self) -> Document:
        """All of it, as text, page and machines have it."""
        document = self._told()
        return replace(document, verdict=self.verdict, data={**document.data, "missing": [*map(asdict, self.missing)]})

    def _told(self) -> Document:
        if self._motors is not None:
            return self._motors.document()
        if self.study is not None:
            document = self.study.document()
            return replace(document, data={"ok": not self.failures, **document.data, "check": checked(self.verdicts)})
        if isinstance(self.method, OutputError):
            document = fit_document(self.fits, self.validations, self.differences, self.verdicts, self.advice)
            return replace(document, data={"ok": not self.failures, **document.data})
        lines = {group: estimate.document() for group, estimate in self.groups.items()}
        data = {
            "ok": not self.failures,
            "shape": LINE,
            "groups": {group: line.data for group, line in lines.items()},
            "check": checked(self.verdicts),
        }
        mend = [Points(self.advice, "next:", "next")] if self.advice else []
        return Document(apart(*(line.parts for line in lines.values()), mend), data, ascii=True)


def _sentences(statements: Sequence[Statement]) -> str:
    """Statements as sentences."""
    return " ".join(sentence(str(statement)) for statement in statements)
