"""drift: several fits of one robot beside each other, of floors or weeks: which numbers changed by more than they may.

    m = (sum W_k)^-1 sum W_k x_k,   chi2 = sum (x_k - m)' W_k (x_k - m),   W_k = C_k^-1

x_k: the numbers of fit k, C_k: their covariance, as its file tells it. A number alone: chi squared with K - 1 degrees
of freedom, W. G. Cochran, Suppl. J. R. Stat. Soc. 4, 102 (1937). All numbers are tested, so each chance is multiplied
by how many there are (Bonferroni); all of them together are one more test: two that trade may change, and neither does.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import chdtrc, ndtri

from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Part, Table, chance_cell, interval_cell, plain
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.keys import CENTRE, Key, expand, in_words, unit
from omnidyn.model.known.told import Told, uncertainty_of
from omnidyn.model.robot import IDENTIFIED, Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict, by_severity
from omnidyn.statistics import homogeneity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.05  # chance of any change in fits of one and the same robot
UPPER = float(ndtri(0.975))
SAME_EIGENVALUE = 1e-9  # of the largest eigenvalue of a matrix whose diagonal is 1: below it two numbers are one
ASSUMED_KEYS = (
    "body.mass_kg",
    "body.inertia_kg_m2",
    CENTRE,
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
    "motor.resistance_ohm",
    "motor.torque_constant_Nm_A",
    "motor.emf_constant_Vs_rad",
    "motor.gear_ratio",
)


@dataclass(frozen=True, eq=False)
class Drifting:
    """A number in the fits that tell it. fits: their names; value, std (K,); ci95: of each.

    chi2, degrees: of whether all are one. p: the chance of as much, all numbers counted. share: from the first to the
    last, over the first.
    """

    key: str
    fits: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    ci95: tuple[tuple[float, float], ...]
    chi2: float
    degrees: int
    p: float

    @property
    def changed(self) -> bool:
        """Whether it changed by more than its errors allow."""
        return self.p <= LEVEL

    @property
    def share(self) -> float:
        """From the first to the last, over the first; infinite where that is 0."""
        first, last = float(self.value[0]), float(self.value[-1])
        return (last - first) / abs(first) if first else float("inf")

    def statement(self) -> Statement:
        """Between which two values it changed, in the order of the fits."""
        first, last = sorted((int(np.argmin(self.value)), int(np.argmax(self.value))))
        numbers = {"values": self.value[[first, last]], "fits": [self.fits[first], self.fits[last]]}
        return Statement("number_changed", WARNING, self.key, numbers)


@dataclass(frozen=True, eq=False, repr=False)
class Drift(Displayable):
    """Fits beside each other. fits: their names, in the order given; numbers: each that two or more tell.

    together: (chi squared, degrees of freedom, chance) of all numbers that all fits tell. warnings: what makes the
    comparison doubtful.
    """

    robot: str
    fits: tuple[str, ...]
    numbers: tuple[Drifting, ...]
    together: tuple[float, int, float]
    warnings: tuple[Statement, ...] = ()

    def __repr__(self) -> str:
        return f"<Drift of {self.robot}: {', '.join(self.fits)}; changed: {', '.join(self.changed) or 'nothing'}>"

    def plot(self) -> Figure:
        """Every number with its 95 % intervals, fit by fit, as a matplotlib Figure."""
        return make(FIGURE, self)

    @property
    def changed(self) -> tuple[str, ...]:
        """Keys of the numbers that changed by more than their errors allow."""
        return tuple(number.key for number in self.numbers if number.changed)

    @property
    def verdict(self) -> Statement:
        """What changed, the surest first."""
        changes = sorted((number for number in self.numbers if number.changed), key=lambda number: number.p)
        if not changes and self.together[2] <= LEVEL:
            return Statement("fits_differ_together", WARNING, numbers={"fits": len(self.fits)})
        if not changes:
            return Statement("no_number_changed", NOTE, numbers={"count": len(self.numbers)})
        numbers = {"count": len(self.numbers), "changed": [number.statement() for number in changes]}
        return Statement("numbers_changed", WARNING, numbers=numbers)

    def document(self) -> Document:
        """All of it, as text, page and machines have it."""
        chi2, degrees, p = self.together
        summary = (
            f"all numbers together: chi squared {chi2:.3g} with {degrees} degrees of freedom, chance {chance_cell(p)}"
        )
        parts: list[Part] = [self.table(), "", summary, by_severity(self.warnings)]
        return Document(parts, self.to_dict(), self.warnings, ascii=True, verdict=self.verdict)

    def table(self) -> Table:
        """A row for every number of every fit."""
        rows = []
        for number in self.numbers:
            for k, name in enumerate(number.fits):
                first = k == 0
                rows.append(
                    (
                        in_words(number.key) if first else "",
                        number.key if first else "",
                        name,
                        f"{number.value[k]:.4g}",
                        interval_cell(number.ci95[k]),
                        unit(number.key),
                        chance_cell(min(number.p, 1.0)) if first else "",
                        ("changed" if number.changed else "no change seen") if first else "",
                    )
                )
        head = ("number", "key", "fit", "value", "95 % interval", "unit", "chance", "")
        return Table(head, rows, "<<<>><><")

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        chi2, degrees, p = self.together
        numbers = {
            number.key: {
                "words": in_words(number.key),
                "unit": unit(number.key),
                "chi2": number.chi2,
                "degrees": number.degrees,
                "p": number.p,
                "changed": number.changed,
                "fits": {
                    name: {"value": number.value[k], "std": number.std[k], "ci95": number.ci95[k]}
                    for k, name in enumerate(number.fits)
                },
            }
            for number in self.numbers
        }
        return plain(
            {
                **as_verdict(self.verdict),
                "fits": self.fits,
                "changed": self.changed,
                "numbers": numbers,
                "together": {"chi2": chi2, "degrees": degrees, "p": p},
                "warnings": self.warnings,
            }
        )


def drift(fits: Sequence[Robot | str | os.PathLike], names: Sequence[str] = ()) -> Drift:
    """Compare fits of one robot, such as of several floors or weeks: robots or robot files that `identify` wrote.

    names: of the fits; files are called by their paths, robots by their names where these differ.

    The covariances are those that `identify` writes, fits count as independent, and intervals are those of a normal
    number. Raises InputError for fewer than two fits and for a file without fitted numbers, InsufficientDataError
    where no number is in two of them.

    >>> import numpy as np, omnidyn
    >>> def fit(robot, seed):
    ...     rng = np.random.default_rng(seed)
    ...     run = omnidyn.simulate(robot, np.repeat(rng.uniform(-5.0, 5.0, (20, 3)), 40, axis=0), dt=0.01)
    ...     log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + 0.005 * rng.normal(size=run.twist.shape))
    ...     return omnidyn.identify(log, robot, quick=True).robot
    >>> robot = omnidyn.load_robot("axebot")
    >>> print(omnidyn.drift([fit(robot, 1), fit(robot, 2)], ["Monday", "Tuesday"]).verdict)
    no number of 6 changed by more than its errors allow
    """
    if len(fits) < 2 or isinstance(fits, str | os.PathLike | Robot):
        got = "one" if isinstance(fits, str | os.PathLike | Robot) else str(len(fits))
        raise InputError("drift compares fits", got=got, expected="two robots or more", where="fits")
    robots = [fit if isinstance(fit, Robot) else load_robot(fit) for fit in fits]
    labels = _names(fits, robots, names)
    fits_numbers = [_fitted(robot, name) for robot, name in zip(robots, labels, strict=True)]
    keys = list(dict.fromkeys(key for numbers in fits_numbers for key in numbers))
    shared = [key for key in keys if sum(key in numbers for numbers in fits_numbers) > 1]
    if not shared:
        raise InsufficientDataError(
            "no number is in two of the fits",
            got="; ".join(f"{n}: {', '.join(k)}" for n, k in zip(labels, fits_numbers, strict=True)),
            expected="fits of the same numbers",
            where="fits",
        )
    numbers = [_number(key, labels, fits_numbers, len(shared)) for key in shared]
    everywhere = [key for key in shared if all(key in numbers for numbers in fits_numbers)]
    return Drift(
        robots[0].name,
        tuple(labels),
        tuple(numbers),
        _together(robots, fits_numbers, everywhere),
        tuple(_doubts(robots, labels, set(shared))),
    )


Fitted = Mapping[str, tuple[float, float, bool]]  # key -> value, std, whether its scale is logarithmic


def _fitted(robot: Robot, name: str) -> Fitted:
    """The numbers of a robot that a fit found, each once: of a list that was one number, its first entry."""
    uncertain = uncertainty_of(robot)
    numbers = {}
    for k, key in enumerate(uncertain.keys):
        prior = robot.priors.get(key) or robot.priors.get(Key.parse(key).name)
        of_list = key not in robot.priors and Key.parse(key).index not in (None, 0)
        if prior is not None and prior.origin == IDENTIFIED and uncertain.std[k] > 0.0 and not of_list:
            numbers[key] = (float(uncertain.value[k]), float(uncertain.std[k]), bool(uncertain.log[k]))
    if not numbers:
        raise InputError(
            "no number of this file was fitted",
            got=", ".join(robot.priors) or "no std of any number",
            expected="a robot file that identify wrote, with the std of its numbers",
            where=name,
        )
    return numbers


def _names(fits: Sequence[Any], robots: Sequence[Robot], names: Sequence[str]) -> list[str]:
    if names and (len(names) != len(fits) or len(set(names)) < len(names)):
        got = f"{len(names)} names, {len(set(names))} of them different, for {len(fits)} fits"
        raise InputError("every fit needs a name of its own", got=got, where="names")
    labels = list(names) or [
        r.name if isinstance(f, Robot) else os.fspath(f) for f, r in zip(fits, robots, strict=True)
    ]
    if len(set(labels)) < len(labels):
        labels = [f"{name} ({k + 1})" for k, name in enumerate(labels)]
    return labels


def _number(key: str, labels: Sequence[str], fitted: Sequence[Fitted], tests: int) -> Drifting:
    at = [k for k, numbers in enumerate(fitted) if key in numbers]
    value, std = (np.array([fitted[k][key][i] for k in at]) for i in (0, 1))
    log = all(fitted[k][key][2] for k in at)
    # A logarithm where all have one: what is far from 0 is as far off as a share of itself.
    x, spread = (np.log(value), std / value) if log else (value, std)
    chi2, degrees = homogeneity(x, np.diag(spread**2))
    ends = [(v - UPPER * s, v + UPPER * s) for v, s in zip(x.tolist(), spread.tolist(), strict=True)]
    ci95 = tuple((float(np.exp(a)), float(np.exp(b))) if log else (a, b) for a, b in ends)
    p = min(1.0, tests * float(chdtrc(degrees, chi2)))
    return Drifting(key, tuple(labels[k] for k in at), value, std, ci95, chi2, degrees, p)


def _together(robots: Sequence[Robot], fitted: Sequence[Fitted], keys: Sequence[str]) -> tuple[float, int, float]:
    """(chi squared, its degrees of freedom, the chance of as much) of the numbers that all fits tell."""
    if not keys:
        return 0.0, 0, 1.0
    first = np.array([fitted[0][key][0] for key in keys])
    unit_ = np.array([max(numbers[key][1] for numbers in fitted) for key in keys])
    total, pulled, chi2, degrees = np.zeros((len(keys), len(keys))), np.zeros(len(keys)), 0.0, 0
    for robot, numbers in zip(robots, fitted, strict=True):
        std = np.array([numbers[key][1] for key in keys])
        weight, rank = _inverse(_correlation(uncertainty_of(robot), keys) * np.outer(std / unit_, std / unit_))
        off = (np.array([numbers[key][0] for key in keys]) - first) / unit_
        total, pulled = total + weight, pulled + weight @ off
        chi2, degrees = chi2 + float(off @ weight @ off), degrees + rank
    common, rank = _inverse(total)
    chi2, degrees = max(chi2 - float(pulled @ common @ pulled), 0.0), degrees - rank
    return chi2, degrees, float(chdtrc(degrees, chi2)) if degrees else 1.0


def _correlation(uncertain: Told, keys: Sequence[str]) -> FloatArray:
    at = [uncertain.keys.index(key) for key in keys]
    return uncertain.correlation[np.ix_(at, at)]


def _inverse(matrix: FloatArray) -> tuple[FloatArray, int]:
    """(inverse without the directions in which it is 0, how many others there are)."""
    size = np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    regular = values > SAME_EIGENVALUE * values[-1]
    root = vectors[:, regular] / np.sqrt(values[regular]) / size[:, None]
    return root @ root.T, int(regular.sum())


def _doubts(robots: Sequence[Robot], labels: Sequence[str], compared: set[str]) -> list[Statement]:
    """What makes the comparison doubtful: one log behind two fits, and numbers that were taken as they stand."""
    doubts = []
    owners: dict[str, str] = {}
    for robot, name in zip(robots, labels, strict=True):
        sources = {p.source for k, p in robot.priors.items() if p.origin == IDENTIFIED and p.source and k in compared}
        for source in sorted(sources):
            if (owner := owners.setdefault(source, name)) != name:
                doubts.append(Statement("fits_of_one_log", subject=source, numbers={"fits": [owner, name]}))
    for name in ASSUMED_KEYS:
        if any(Key.parse(key).name == name for key in compared):
            continue
        values = [_taken(robot, name) for robot in robots]
        if len(set(values)) > 1:
            doubts.append(Statement("taken_differently", subject=name, numbers={"values": values, "fits": labels}))
    return doubts


def _taken(robot: Robot, name: str) -> tuple[float, ...]:
    """A number as it stands in the file, to four digits; of a list, all that differ."""
    values = (float(f"{Key.parse(key).get(robot):.4g}") for key in expand(name, robot))
    return tuple(dict.fromkeys(values))
