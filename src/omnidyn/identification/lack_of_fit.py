"""LackOfFit: whether a fit leaves more than noise, and what would explain it; Diagnosis: and what it rests on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from omnidyn.arrays import FloatArray
from omnidyn.document import Part, Table, all_of, plain, short
from omnidyn.identification.stability import Stability
from omnidyn.model.keys import find_key, in_words, unit

LOSS = "loss"  # the key of a remedy for wild samples, which is no cause of a misfit
MOST = 0.7  # of all that residuals hold beside noise, that a remedy must explain to be the one
# What robots do that no law holds yet: key -> words.
UNOFFERED = {
    "friction one way": "friction that is another one backward than forward",
    "drag": "drag that grows with the square of the speed",
    "turns of the wheels": "something that comes back with the turns of the wheels",
    "sag": "a supply that sags under load",
    "heat": "motors that weaken as they warm up",
    "filter": "speeds that went through a filter",
}
REPEATS, HOLDS, NEIGHBOURS, REST, ROUNDING = "repeats", "holds", "neighbours", "rest", "rounding"  # sources of a level
WHERE = {  # how a log shows its noise, and what is said of more than that
    REPEATS: ("repeats within", "no noise"), HOLDS: ("scatters, while commands are held, by", "no noise"),
    NEIGHBOURS: ("scatters from row to row by", "misfit, or noise that is slower"),
    ROUNDING: ("is rounded within", "misfit, or noise beside what the encoder rounds"),
    REST: ("scatters at rest by", "misfit, or noise that comes of motion"),
}  # fmt: skip
NOTHING = "hold nothing but noise"
DRIFTS = "the errors last so long that no test in these logs tells them from what the model leaves out; log for longer"
UNTOLD = "this log cannot tell its noise from misfit: repeat a command, or let the robot rest for a second"
FAR = 0.001, 0.1  # chance, and share, from which on it is said that a robot in motion leaves more than one at rest
WORTH = 0.01  # share of the variance of a residual that is worth a line
CHANGED, SEEN = 2, 0.02  # numbers that a remedy would change that are named; relative change that is worth it
LARGE = 100.0  # chi2 of which nobody needs decimals
NONE = 1e-3  # of what a number was, below which nothing is left of it
MOVES, MOST_NAMED = 0.001, 5  # relative change by a percent of what a number rests on; so many are named


@dataclass(frozen=True)
class Found:
    """A theme that residuals follow. f: mean square per direction over that of the noise; p: chance of as much."""

    theme: str
    f: float
    p: float
    directions: int


@dataclass(frozen=True)
class Wild:
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

    def words(self, output: str) -> str:
        """ "the residual of twist[0] is 0.31 m/s where the log repeats within 0.12 m/s (3 % of what moves): ..."."""
        where, more = WHERE[self.source]
        new = f", {100.0 * self.new:.0f} % of what is new from row to row," if self.new > self.share else ""
        return (
            f"the residual of {output} is {self.residual:.2g} {self.unit} where the log {where} {self.level:.2g} "
            f"{self.unit} ({short(100.0 * self.of_moves)} % of what moves): {100.0 * self.share:.0f} % of its "
            f"variance{new} is {more}"
        )


@dataclass(frozen=True)
class Remedy:
    """key: of the robot file, a nuisance or "change". words: what it is, with its value. gain: share of the squared
    held-out error that it takes away, with its standard error. same_as: keys that the log cannot tell from it.
    share: of all that residuals hold beside noise, that it explains. offered: whether a robot file or a fit holds such.
    chi2: by how much it lowers the sum of squares, in those of the noise; numbers: how many it fits. size, at: its
    fitted change and where it was tried, both of a first step. changes: number -> (what it is, what it would be with
    it, to first order)."""

    key: str
    words: str
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

    @property
    def confident(self) -> bool:
        """Whether it explains most of what is to be explained, and nothing that nobody offers explains the same."""
        return self.offered and self.share >= MOST and not self.rivals

    def would_change(self, most: int = CHANGED) -> str:
        """The numbers that it would change most, in words; "" where it changes none that anybody would see."""
        shares = {name: abs(after - now) / abs(now) if now else math.inf for name, (now, after) in self.changes.items()}
        worst = sorted((name for name in shares if shares[name] >= SEEN), key=lambda name: -shares[name])[:most]
        return all_of([
            f"{in_words(name)} {now:.3g} -> {after if abs(after) > NONE * abs(now) else 0.0:.3g} {unit(name)}".rstrip()
            for name in worst for now, after in [self.changes[name]]
        ])  # fmt: skip

    @property
    def rivals(self) -> tuple[str, ...]:
        """Those of `same_as` that no robot file holds."""
        return tuple(key for key in self.same_as if key in UNOFFERED)


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
    with wild samples, which is no lack of fit, but widens intervals and pulls at numbers, unless the loss is Student's;
    then the last remedy, key "loss", is that, whether or not there is a misfit.
    noise: of outputs whose noise the log shows without the model, by the best source; None where that was not asked.
    beyond: those whose residuals are larger, by a source that decides. at_rest: the same where the robot rests.
    rounded: output -> share of the variance of its residuals that is of inputs that were rounded, or changed while rows
    are missing, which is no lack of fit, but hides one that is smaller. drifts: whether errors last so long that no
    test tells them from a misfit.
    """

    found: bool
    channels: Mapping[str, float]
    sizes: Mapping[str, float]
    follows: tuple[Found, ...]
    remedies: tuple[Remedy, ...]
    tested: Mapping[str, float]
    pictures: tuple[Binned, ...] = ()
    wild: Mapping[str, Wild] = field(default_factory=dict)
    noise: Mapping[str, Noise] | None = None
    beyond: tuple[str, ...] = ()
    at_rest: Mapping[str, Noise] = field(default_factory=dict)
    rounded: Mapping[str, float] = field(default_factory=dict)
    drifts: bool = False

    @property
    def causes(self) -> tuple[Remedy, ...]:
        """The remedies of a misfit."""
        return tuple(each for each in self.remedies if each.key != LOSS)

    def words(self) -> str:
        """In a sentence, "" for a model that fits."""
        if not self.found:
            return DRIFTS if self.drifts else ""
        worst = max(self.channels, key=lambda name: self.channels[name], default="")
        share = f" ({100.0 * self.channels[worst]:.0f} % of the residual of {worst} is no noise)" if worst else ""
        what = all_of([each.theme for each in self.follows[:2]])
        beyond = "" if what or self.causes else self._beyond_noise()
        words = "the model leaves something out" + (f": what it misses follows {what}{share}" if what else beyond)
        if not self.causes:
            return f"{words}; no cause that is known here explains it"
        if not self.causes[0].confident:
            near = self.causes[0]
            if not near.offered:
                return f"{words}; it looks like {near.words}, which no law that is known here holds"
            if near.rivals:
                return f"{words}; it may be {near.words}, or {' or '.join(UNOFFERED[key] for key in near.rivals)}"
            return (
                f"{words}; no cause that is known here explains it: the nearest, {near.words}, explains "
                f"{100.0 * near.share:.0f} % of it"
            )
        best = self.causes[0]
        same = f", or what this log cannot tell from it ({self.alike(best)})" if best.same_as else ""
        return f"{words}; most likely {best.words}{same}"

    def _beyond_noise(self) -> str:
        """The output whose residual is most surely beyond its noise, in words; "" where none is."""
        noise = {name: (self.noise or {})[name] for name in self.beyond}
        worst = min(noise, key=lambda name: noise[name].p, default="")
        return f": {noise[worst].words(worst)}" if worst else ""

    def alike(self, remedy: Remedy) -> str:
        """What the log cannot tell from a remedy, with their values: "gain 0.94, torque constant -6 %"."""
        words = {each.key: each.words for each in self.remedies}
        keys = sorted(remedy.same_as, key=lambda key: key not in words)
        more = [f"{len(keys) - MOST_NAMED} more"] if len(keys) > MOST_NAMED else []
        return ", ".join([*(words.get(key, named(key)) for key in keys[:MOST_NAMED]), *more])

    def table(self) -> Table:
        """The remedies, a row each."""
        rows = [
            (r.words, r.key, f"{short(100.0 * r.gain)} +- {short(100.0 * r.gain_std)} %", r.would_change(1),
             all_of([*map(named, r.same_as)]))
            for r in self.remedies
        ]  # fmt: skip
        head = ("what may be missing", "key", "held-out error less by", "would change", "the same to this log")
        return Table(head, rows, "<<><<")

    def statements(self) -> list[str]:
        """What was found, a sentence each."""
        if not self.found:
            calm = "follow nothing that a model should know" if self._beyond_rest() else NOTHING
            return [self.words() or f"the residuals {calm}, as far as these logs tell", *self._levels(), *self._tails()]
        shares = [
            f"{name}: {self.sizes[name]:.2g} of its residual is no noise, {100.0 * share:.0f} % of the variance"
            for name, share in self.channels.items() if share >= WORTH
        ]  # fmt: skip
        return [self.words(), *shares, *self._levels(), *self._tails()]

    def _levels(self) -> list[str]:
        """What rounded inputs explain, the noise by each source, and where the robot in motion leaves more than at
        rest."""
        if self.noise is None:
            return self._rounded()
        told = [] if self.noise else [UNTOLD]
        for source, (where, _) in WHERE.items():
            own = {name: each for name, each in self.noise.items() if each.source == source}
            if own:
                levels = ", ".join(f"{name} {each.level:.2g} {each.unit}" for name, each in own.items())
                moves = max(each.of_moves for each in own.values())
                far = [pick(each.chi2 for each in own.values()) for pick in (min, max)]
                chi2 = " to ".join(dict.fromkeys(f"{x:.2f}" if x < LARGE else short(x, ".3g") for x in far))
                told.append(
                    f"noise: the log {where} {levels}, at most {short(100.0 * moves)} % of what moves; chi2 of the "
                    f"residuals by that: {chi2}"
                )
        return [*self._rounded(), *told, *self._beyond_rest()]

    def _rounded(self) -> list[str]:
        """Of the output that shows most of what the log does not tell of its inputs, in words; none where none does."""
        worst = max(self.rounded, key=lambda name: self.rounded[name], default="")
        share = self.rounded.get(worst, 0.0)
        said = "rounding of the inputs, or rows that are missing where they change, may explain"
        much = f"{100.0 * share:.0f} % of the variance of the residual of {worst}, and hide a misfit"
        return [f"{said} {much}: log every row, with more digits"] if share >= WORTH else []

    def _beyond_rest(self) -> list[str]:
        """Of the output that most surely leaves more in motion than at rest, in words; nothing where none does."""
        beyond = {
            name: each for name, each in self.at_rest.items()
            if each.p * len(self.at_rest) < FAR[0] and each.share > FAR[1]
        }  # fmt: skip
        worst = min(beyond, key=lambda name: beyond[name].p, default="")
        return [beyond[worst].words(worst)] if worst else []

    def _tails(self) -> list[str]:
        """What is to be said of wild samples: nothing, or a sentence."""
        if not self.wild:
            return []
        worst = max(self.wild, key=lambda name: self.wild[name].held)
        one, others = self.wild[worst], len(self.wild) - 1
        more = f", and of {others} more" if others else ""
        return [
            f"heavy tails: {100.0 * one.share:.2g} % of the samples of {worst}{more} are wild, far beyond its noise, "
            f"and hold {100.0 * one.held:.0f} % of its squared error; `loss` student-t counts them little"
        ]

    def parts(self) -> list[Part]:
        """As lines and a table."""
        return [*self.statements(), *([self.table()] if self.remedies else [])]

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return plain({
            "found": self.found, "channels": self.channels, "sizes": self.sizes,
            "follows": [asdict(each) for each in self.follows],
            "remedies": [asdict(each) for each in self.remedies], "tested": self.tested,
            "wild": {name: asdict(each) for name, each in self.wild.items()},
            "noise": {name: asdict(each) for name, each in (self.noise or {}).items()},
            "beyond_noise": self.beyond,
            "at_rest": {name: asdict(each) for name, each in self.at_rest.items()}, "rounded_inputs": self.rounded,
            "drifts": self.drifts,
        })  # fmt: skip


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """lack_of_fit; rests_on: number -> fixed key -> relative change of the number per percent of the key; stability."""

    lack_of_fit: LackOfFit
    rests_on: Mapping[str, Mapping[str, float]]
    stability: Stability

    def table(self) -> Table | None:
        """What each number rests on, a row each; None where nothing moves any."""
        rows = []
        for name, by in self.rests_on.items():
            told = [
                f"{named(key)} {short(100.0 * share, '+.2g')} %" for key, share in by.items() if abs(share) >= MOVES
            ]
            if told:
                rows.append((named(name), name, ", ".join(told[:MOST_NAMED])))
        return Table(("number", "key", "moves, for +1 % of"), rows, "<<<") if rows else None


def named(key: str) -> str:
    """A remedy's key as people call it."""
    return in_words(key) if find_key(key) else UNOFFERED.get(key, key)
