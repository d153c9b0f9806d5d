"""What a plan is to tell best: all numbers, the widest after a fit, one of them, or two explanations apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.nuisances import LATENCY, NUISANCES
from omnidyn.model.keys import DEAD_BAND, EMF, TORQUE, expand, name_of, with_priors
from omnidyn.model.keys import LATENCY as LATENCY_KEY
from omnidyn.model.known.told import numbers_told, uncertainty_of
from omnidyn.model.robot import IDENTIFIED, JOINT, Robot

D, A, NEXT = "D", "A", "next"  # the volume of all intervals; the sum of their squares; the widest, after a fit
EXPLANATIONS = tuple(name for name in NUISANCES if name != LATENCY)
STEEP = 4  # power of a mean that is nearly the largest: greedy choices need a slope where two are equally wide
SURE = 1e-9  # least eigenvalue of a correlation: numbers that a fit knows as one

Score = Callable[[FloatArray], float]  # of the covariance of relative changes: less is better


@dataclass(frozen=True)
class PlanAim:
    """criterion: D, A or NEXT. names: of which it counts alone, as asked for; empty: of all numbers of the robot. keys:
    of the robot file among them, expanded, of NEXT those that the fit told; nuisances: the others. Two names are
    explanations to be told apart."""

    criterion: str = D
    names: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()
    nuisances: tuple[str, ...] = ()

    def counts(self, name: str) -> bool:
        """Whether a number of a fit is one that it is about."""
        return name in self.keys or any(name == part or name.startswith(f"{part}.") for part in self.nuisances)

    def places(self, names: Sequence[str], count: int) -> list[int]:
        """Where the numbers that count stand among the names of a fit; count: how many of these the robot has.

        Raises InputError where one that was asked for is not free.
        """
        of_all = not (self.names or set(self.keys) & set(names))
        found = [k for k, name in enumerate(names) if (k < count if of_all else self.counts(name))]
        if self.names and (missing := [key for key in self.keys if key not in names[:count]]):
            raise InputError(
                "not a number that is free", got=missing[0], expected=", ".join(names[:count]), where="aim"
            )
        return found

    def score(self, places: Sequence[int]) -> Score:
        """How well a covariance of relative changes tells it."""
        if self.criterion == D and not self.names:
            return lambda covariance: 0.5 * float(np.linalg.slogdet(covariance)[1]) / len(covariance)
        return lambda covariance: self.of_std(np.sqrt(np.diag(covariance)[places]))

    def of_std(self, std: FloatArray) -> float:
        """The same of standard errors of these numbers, as shares of them."""
        if self.criterion == A:
            return 0.5 * float(np.log(np.mean(std**2)))
        if self.criterion == NEXT:
            return float(np.log(np.mean(std**STEEP))) / STEEP
        return float(np.mean(np.log(std)))


def aim_of(text: str, robot: Robot) -> PlanAim:
    """ "" or "D", "A", "next", a key of the robot file, or two explanations "ONE,OTHER": keys or nuisances of a fit.

    Raises InputError for anything else.
    """
    if text == NEXT:
        return PlanAim(NEXT, keys=fitted_keys(robot, (IDENTIFIED,)))
    if text in ("", D, A):
        return PlanAim(text or D)
    names = tuple(name.strip() for name in text.split(","))
    nuisances = tuple(name for name in names if name.partition(".")[0] in EXPLANATIONS)
    if len(names) > 2 or not all(names) or len(set(names)) < len(names) or (len(names) == 1 and nuisances):
        raise InputError(
            "not a number to learn, nor two explanations to tell apart",
            got=text,
            expected=f"A, D, a key of the robot file, or two such as dead_band,friction.axes.coulomb; beside keys "
            f"{', '.join(EXPLANATIONS)}",
            where="aim",
        )
    keys = tuple(key for name in names if name not in nuisances for key in map(str, expand(name, robot)))
    return PlanAim(D, names, keys, nuisances)


def fitted_keys(robot: Robot, origins: Sequence[str] = (IDENTIFIED, JOINT)) -> tuple[str, ...]:
    """The numbers of a robot that the fit which wrote its file told, and those that it left open beside them.

    Not what it fits beside the robot, latency and dead band, nor the EMF constant, which goes with the torque constant.
    Raises InputError where there are none.
    """
    found = {key: name_of(key) for key, prior in numbers_told(robot).items() if prior.origin in origins and prior.std}
    beside = {LATENCY_KEY, DEAD_BAND} | ({EMF} if TORQUE in found.values() else set())
    keys = tuple(key for key, name in found.items() if name not in beside)
    if not keys:
        raise InputError(
            "no fit: no number of this robot was identified",
            got=robot.name,
            expected="a robot file that identify -o wrote, fit.toml",
            remedy="plan a first drive, fit its log, and plan the next one for that file",
            where=robot.name,
        )
    return keys


def known_of(robot: Robot, names: Sequence[str]) -> FloatArray:
    """What the fit that wrote a robot file knows of some numbers: the inverse of the covariance of their relative
    changes, by the std and [correlation] of the file. Shape (names, names), 0 for what it does not tell."""
    numbers, information = uncertainty_of(robot), np.zeros((len(names), len(names)))
    pairs = [(k, names.index(key)) for k, key in enumerate(numbers.keys) if key in names and numbers.value[k]]
    if not pairs:
        return information
    rows, places = map(list, zip(*pairs, strict=True))
    share = numbers.std[rows] / np.abs(numbers.value[rows])
    values, vectors = np.linalg.eigh(numbers.correlation[np.ix_(rows, rows)])
    inverse = (vectors / np.maximum(values, SURE)) @ vectors.T
    information[np.ix_(places, places)] = inverse / np.outer(share, share)
    return information


def without_priors(robot: Robot) -> Robot:
    """The robot without the std of what a fit left open: what the fit knew of the others holds that already."""
    left_open = {key: prior for key, prior in numbers_told(robot).items() if prior.origin == JOINT}
    return with_priors(robot, {key: prior.replace(std=None) for key, prior in left_open.items()})
