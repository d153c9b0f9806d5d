"""LackOfFit: whether a fit leaves more than noise, and what would explain it; Diagnosis: and what it rests on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from omnidyn.arrays import FloatArray
from omnidyn.document import Part, Points, Table, all_of, plain, short
from omnidyn.identification.selection.blocks import BlockComparison
from omnidyn.identification.stability import Stability
from omnidyn.model.keys import in_words
from omnidyn.statement import NOTE, WARNING, Statement, statements

LOSS = "loss"  # the key of a remedy for outliers, which is no cause of a misfit
MAIN_SHARE = 0.7  # of all that residuals hold beside noise, that a remedy must explain to be the one
CHANGE = "change"  # the key of friction that is another one from some time of the log on
ONE_LOG = {subject: f"{subject} of one log" for subject in ("mass", "friction", "supply")}  # keys of what differs there
OF_LOGS = (CHANGE, *ONE_LOG.values())  # what no robot has a number for: its logs are not alike
# What robots do that no law holds yet: keys.
UNOFFERED_CAUSES = ("friction one way", "drag", "turns of the wheels", "sag", "heat", "filter")
REPEATS, HOLDS, NEIGHBOURS, REST, ROUNDING = "repeats", "holds", "neighbours", "rest", "rounding"  # sources of a level
UNREST_LIMITS = (
    0.001,
    0.1,
)  # chance, and share, from which on it is said that a robot in motion leaves more than one at rest
SMALL_MISS = 0.01  # of the spread: a free run that misses less on held-out rows leaves nothing out that has no cause
LINE_SHARE = 0.01  # share of the variance of a residual that is worth a line
CHANGED_NUMBERS, SEEN_CHANGE = (
    2,
    0.02,
)  # numbers that a remedy would change that are named; relative change that is worth it
MOVES, NAMED_KEYS = 0.001, 5  # relative change by a percent of what a number rests on; so many are named


@dataclass(frozen=True)
class Found:
    """A theme that residuals follow. f: mean square per direction over that of the noise; p: chance of as much."""

    theme: str
    f: float
    p: float
    directions: int


@dataclass(frozen=True)
class Outliers:
    """Of an output, the samples that are far beyond its noise: their share of all, and of the squares of residuals."""

    share: float
    held: float


@dataclass(frozen=True)
class Noise:
    """Of an output, how large its noise is by what the log shows without the model, and what the fit leaves there.

    source: REPEATS, HOLDS, NEIGHBOURS, REST, or ROUNDING, which is known: tick/sqrt(12). level, residual: root mean
    square of both, in the unit of the output; chi2: their ratio squared; p: chance of as much where the model is right.
    degrees: of freedom of the level. share: of the variance of the residual that is no noise; of_moves: the level over
    what the output moves by. from_hz: slower errors count in neither. new: the share in rows made white, 0 where
    these are not looked at."""

    source: str
    level: float
    residual: float
    chi2: float
    p: float
    degrees: float
    share: float
    of_moves: float
    from_hz: float
    unit: str
    new: float = 0.0

    @property
    def most(self) -> float:
        """The larger share: beside slow noise what is new tells of a misfit that is hardly seen in rows as they are."""
        return max(self.share, self.new)

    @property
    def decides(self) -> bool:
        """Whether all noise shows in it: at rest that of motion may be missing, neighbours do not see what is slow."""
        return self.source in (REPEATS, HOLDS)

    def beyond(self, output: str) -> Statement:
        """By how much the residual of an output is larger than this noise."""
        names = ("source", "residual", "level", "unit", "of_moves", "share", "new")
        return Statement("beyond_noise", WARNING, output, {name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class Force:
    """Of a remedy, in forces [N]: size: root mean square of what it adds; before, after: of the left-out error without
    and with it; gain, gain_std: what it takes away of that. p: chance of as much, all tests counted."""

    size: float
    before: float
    after: float
    gain: float
    gain_std: float
    p: float


@dataclass(frozen=True)
class Remedy:
    """key: of the robot file, a nuisance or "change". cause: what it is, with its value; text is quoted.
    gain: share of the squared held-out error that it takes away, with its standard error. same_as: keys that the
    log cannot tell from it. share: of all that residuals hold beside noise, that it explains. offered: whether a
    robot file or a fit holds such. chi2: by how much it lowers the sum of squares, in those of the noise; numbers:
    how many it fits. comparison: how held-out blocks are predicted with it. size, at: its fitted change and where it
    was tried, both of a first step. changes: number -> (what it is, what it would be with it, to first order). force:
    where it was fitted to forces at steady state."""

    key: str
    cause: Statement
    gain: float
    gain_std: float
    same_as: tuple[str, ...] = ()
    share: float = 1.0
    offered: bool = True
    chi2: float = field(default=0.0, repr=False)
    numbers: int = 1
    size: tuple[float, ...] = ()
    at: float = 0.0
    changes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    force: Force | None = None
    comparison: BlockComparison | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "cause", *statements([self.cause]))

    @property
    def confident(self) -> bool:
        """Whether it explains most of what is to be explained, and nothing that nobody offers explains the same."""
        return self.offered and self.share >= MAIN_SHARE and not self.rivals

    def largest_changes(self, name_count: int = CHANGED_NUMBERS) -> dict[str, tuple[Any, ...]]:
        """The numbers that it would change name_count: changed, before, after; empty where none would be seen to
        change."""
        shares = {
            name: abs(value_then - value_now) / abs(value_now) if value_now else math.inf
            for name, (value_now, value_then) in self.changes.items()
        }
        largest_names = sorted(
            (name for name in shares if shares[name] >= SEEN_CHANGE), key=lambda name: -shares[name]
        )[:name_count]
        values_before, values_after = (tuple(self.changes[name][k] for name in largest_names) for k in (0, 1))
        return {"changed": tuple(largest_names), "before": values_before, "after": values_after}

    @property
    def rivals(self) -> tuple[str, ...]:
        """Those of `same_as` that no robot file holds."""
        return tuple(key for key in self.same_as if key in UNOFFERED_CAUSES)

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        fields = {name: value for name, value in asdict(self).items() if name != "force"}
        return {**fields, "words": str(self.cause), "cause": self.cause}


@dataclass(frozen=True, eq=False)
class Binned:
    """Residuals of an output against something, in bins: at (n,), mean (n,) and two standard errors of it (n,).

    unit: of the output; against: what, with its unit, in words.
    """

    output: str
    unit: str
    against: str
    at: FloatArray
    mean: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False)
class LackOfFit:
    """Whether residuals hold more than noise, and what would explain it.

    found: whether they do. channels: output -> share of the variance of its residuals that is no noise. sizes: output
    -> what that is, root mean square, in the unit of the output. follows: what residuals follow, first what explains
    most. remedies: best first; those that the log cannot tell from each other name each other in `same_as`. tested:
    what they were tested for -> chance of as much by noise alone. pictures: of the output that is worst. wild: outputs
    with outliers, which is no lack of fit, but widens intervals and pulls at numbers, unless the loss is Student's;
    then the last remedy, key "loss", is that, whether or not there is a misfit.
    noise: of outputs whose noise the log shows without the model, by the best source; None where that was not asked.
    beyond: those whose residuals are larger, by a source that decides. at_rest: the same where the robot rests.
    rounded: output -> share of the variance of its residuals that is of inputs that were rounded, or changed while rows
    are missing, which is no lack of fit, but hides one that is smaller. drifts: whether errors last so long that no
    test tells them from a misfit. tried: names of what was tried, where all that was tried has one test. missed: what
    free runs miss on held-out rows, over the spread of the outputs; NaN where none were held out.
    """

    found: bool
    channels: Mapping[str, float]
    sizes: Mapping[str, float]
    follows: tuple[Found, ...]
    remedies: tuple[Remedy, ...]
    tested: Mapping[str, float]
    pictures: tuple[Binned, ...] = ()
    wild: Mapping[str, Outliers] = field(default_factory=dict)
    noise: Mapping[str, Noise] | None = None
    beyond: tuple[str, ...] = ()
    at_rest: Mapping[str, Noise] = field(default_factory=dict)
    rounded: Mapping[str, float] = field(default_factory=dict)
    drifts: bool = False
    tried: tuple[str, ...] = ()
    missed: float = math.nan

    @property
    def is_small(self) -> bool:
        """Whether free runs on held-out rows miss next to nothing, and no cause explains what is more than noise."""
        has_cause = bool(self.causes) and (self.causes[0].confident or bool(self.causes[0].rivals))
        return self.found and not has_cause and self.missed < SMALL_MISS

    @property
    def causes(self) -> tuple[Remedy, ...]:
        """The remedies of a misfit."""
        return tuple(remedy for remedy in self.remedies if remedy.key != LOSS)

    def statement(self) -> Statement | None:
        """What the model leaves out, and its likely cause; None for a model that fits."""
        if not self.found:
            return Statement("slow_errors", WARNING) if self.drifts else None
        worst_channel = max(self.channels, key=lambda name: self.channels[name], default="")
        themes = tuple(theme.theme for theme in self.follows[:2])
        beyond_channel = None if themes or self.causes else self._beyond_noise()
        if self.is_small:
            return Statement("misfit_small", NOTE, worst_channel, {"missed": self.missed})
        numbers = {"share": self.channels.get(worst_channel), "follows": themes, "beyond": beyond_channel}
        if not self.causes:
            return Statement("misfit_unexplained", WARNING, worst_channel, numbers)
        best = self.causes[0]
        code = (
            "misfit_likely_cause"
            if best.confident
            else "misfit_without_law"
            if not best.offered
            else "misfit_with_rivals"
            if best.rivals
            else "misfit_nearest_cause"
        )
        numbers |= {"cause": best.cause, "explains": best.share, "rivals": best.rivals, "alike": self.alike(best)}
        return Statement(code, WARNING, worst_channel, numbers)

    def _beyond_noise(self) -> Statement | None:
        """The output whose residual is most surely beyond its noise; None where none is."""
        noise = {name: (self.noise or {})[name] for name in self.beyond}
        worst_channel = min(noise, key=lambda name: noise[name].p, default="")
        return noise[worst_channel].beyond(worst_channel) if worst_channel else None

    def alike(self, remedy: Remedy) -> tuple[Statement, ...]:
        """What the log cannot tell from a remedy, those with values first: gain 0.94, torque constant -6 %."""
        causes = {candidate_remedy.key: candidate_remedy.cause for candidate_remedy in self.remedies}
        keys = sorted(remedy.same_as, key=lambda key: key not in causes)
        more_statements = (
            [Statement("more", NOTE, numbers={"count": len(keys) - NAMED_KEYS})] if len(keys) > NAMED_KEYS else []
        )
        return (*(causes.get(key, Statement("cause", NOTE, key)) for key in keys[:NAMED_KEYS]), *more_statements)

    def table(self) -> Table:
        """The remedies, a row each."""
        rows = [
            (
                str(r.cause),
                r.key,
                f"{short(100.0 * r.gain)} +- {short(100.0 * r.gain_std)} %",
                str(Statement("changes", NOTE, numbers=r.largest_changes(1))),
                all_of([str(Statement("cause", NOTE, key)) for key in r.same_as]),
            )
            for r in self.remedies
        ]
        head = ("what may be missing", "key", "held-out error less by", "would change")
        return Table((*head, "not distinguishable with this log"), rows, "<<><<")

    def statements(self) -> list[Statement]:
        """What was found, the gravest first."""
        summary = self.statement()
        if not self.found:
            calm_statement = Statement("unrelated_residuals" if self._beyond_rest() else "only_noise", NOTE)
            return [summary or calm_statement, *self._levels(), *self._tails()]
        shares = [
            Statement("misfit_of_output", WARNING, name, {"size": self.sizes[name], "percent": 100.0 * share})
            for name, share in self.channels.items()
            if share >= LINE_SHARE
        ]
        return [*([summary] if summary else []), *shares, *self._levels(), *self._tails()]

    def _levels(self) -> list[Statement]:
        """What rounded inputs explain, the noise by each source, and where the robot in motion leaves more than at
        rest."""
        if self.noise is None:
            return self._rounded()
        levels = [] if self.noise else [Statement("noise_unknown", NOTE)]
        for source in (REPEATS, HOLDS, NEIGHBOURS, ROUNDING, REST):
            noise_of_source = {name: noise for name, noise in self.noise.items() if noise.source == source}
            if noise_of_source:
                noises = [*noise_of_source.values()]
                numbers = {
                    "outputs": tuple(noise_of_source),
                    "levels": tuple(noise.level for noise in noises),
                    "units": tuple(noise.unit for noise in noises),
                    "of_moves": max(noise.of_moves for noise in noises),
                    "chi2": tuple(pick(noise.chi2 for noise in noises) for pick in (min, max)),
                }
                levels.append(Statement("noise_level", NOTE, source, numbers))
        return [*self._rounded(), *levels, *self._beyond_rest()]

    def _rounded(self) -> list[Statement]:
        """Of the output that shows most of what the log does not tell of its inputs; none where none does."""
        worst_channel = max(self.rounded, key=lambda name: self.rounded[name], default="")
        share = self.rounded.get(worst_channel, 0.0)
        return (
            [Statement("rounding_may_hide", NOTE, worst_channel, {"percent": 100.0 * share})]
            if share >= LINE_SHARE
            else []
        )

    def _beyond_rest(self) -> list[Statement]:
        """Of the output that most surely leaves more in motion than at rest; nothing where none does."""
        beyond_rest = {
            name: noise
            for name, noise in self.at_rest.items()
            if noise.p * len(self.at_rest) < UNREST_LIMITS[0] and noise.share > UNREST_LIMITS[1]
        }
        worst_channel = min(beyond_rest, key=lambda name: beyond_rest[name].p, default="")
        return [beyond_rest[worst_channel].beyond(worst_channel)] if worst_channel else []

    def _tails(self) -> list[Statement]:
        """What is to be said of outliers: nothing, or one statement."""
        if not self.wild:
            return []
        worst_channel = max(self.wild, key=lambda name: self.wild[name].held)
        numbers = {
            "share": self.wild[worst_channel].share,
            "held": self.wild[worst_channel].held,
            "others": len(self.wild) - 1,
        }
        return [Statement("heavy_tails", NOTE, worst_channel, numbers)]

    def parts(self) -> list[Part]:
        """As points and a table."""
        return [Points(self.statements()), *([self.table()] if self.remedies else [])]

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return plain(
            {
                "found": self.found,
                "channels": self.channels,
                "sizes": self.sizes,
                "follows": [asdict(finding) for finding in self.follows],
                "remedies": self.remedies,
                "statements": self.statements(),
                "tested": self.tested,
                "wild": {name: asdict(outlier) for name, outlier in self.wild.items()},
                "noise": {name: asdict(noise) for name, noise in (self.noise or {}).items()},
                "beyond_noise": self.beyond,
                "at_rest": {name: asdict(noise) for name, noise in self.at_rest.items()},
                "rounded_inputs": self.rounded,
                "drifts": self.drifts,
            }
        )


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """lack_of_fit; rests_on: number -> fixed key -> relative change of the number per percent of the key; stability."""

    lack_of_fit: LackOfFit
    rests_on: Mapping[str, Mapping[str, float]]
    stability: Stability

    def table(self) -> Table | None:
        """What each number rests on, a row each; None where nothing moves any."""
        rows = []
        for name, change_by_key in self.rests_on.items():
            moves = [
                f"{in_words(key)} {short(100.0 * share, '+.2g')} %"
                for key, share in change_by_key.items()
                if abs(share) >= MOVES
            ]
            if moves:
                rows.append((in_words(name), name, ", ".join(moves[:NAMED_KEYS])))
        return Table(("number", "key", "moves, for +1 % of"), rows, "<<<") if rows else None
