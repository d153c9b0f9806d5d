"""What a robot file tells of how far its numbers may be off: their std, their correlations, which are guesses."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.model.correlation import KeyCorrelation, key_correlation
from omnidyn.model.keys import BREAKAWAY, CENTRE, COULOMB, DEAD_BAND, LATENCY, VISCOUS, Key, expand, find_key
from omnidyn.model.robot import IDENTIFIED, Prior, Robot
from omnidyn.model.value import Value

SAME_STD = 1e-9  # relative: std that differ by no more are the same
NEAR_ZERO = 0.5  # std over value, from which on a friction may be 0
SIGNED = ("wheels.azimuth_deg", "wheels.roller_angle_deg", CENTRE)  # numbers that may as well be below 0


@dataclass(frozen=True, eq=False)
class Told:
    """The numbers of a robot that have a std. keys: names. value, std: shape (keys,), in the unit of each.

    correlation: shape (keys, keys). log: which have a logarithmic scale. guessed: those that are guesses.
    """

    keys: tuple[str, ...]
    value: FloatArray
    std: FloatArray
    correlation: FloatArray
    log: BoolArray
    guessed: tuple[str, ...]


def uncertainty_of(robot: Robot) -> Told:
    """What the file of a robot says of how far its numbers may be off."""
    priors = {key: prior for key, prior in numbers_told(robot).items() if prior.std is not None}
    together = robot.correlation
    std = {key: float(prior.std or 0.0) for key, prior in priors.items()}
    if together is not None and together.std is not None:
        std |= {key: s for key, s in zip(together.keys, together.std, strict=True) if key in std and s > 0.0}
    keys, value = tuple(priors), np.array([Key.parse(key).get(robot) for key in priors])
    spread = np.array([std[key] for key in keys])
    correlation = np.eye(len(keys)) if together is None else together.of(keys)
    log = np.array([is_log(key, v, s) for key, v, s in zip(keys, value, spread, strict=True)], dtype=bool)
    return Told(keys, value, spread, correlation, log, tuple(k for k, prior in priors.items() if prior.guessed))


def numbers_told(robot: Robot) -> dict[str, Prior]:
    """Key -> Prior of every number that the robot has and that something is told of; of a list, for each entry.

    Friction of a shape that is off has no number, whatever is still told of it.
    """
    priors = {}
    for name, prior in robot.priors.items():
        if find_key(name) is not None:
            priors |= {key: prior for key in expand(name, robot) if _has(robot, key)}
    return priors


def known_priors(robot: Robot) -> dict[str, tuple[float, float]]:
    """Priors of the robot file that are independent of any log: key -> (mean, std); that of a list for each entry.

    One of a number that this robot no longer has, because a part of it was exchanged, is left out.
    """
    independent = {}
    for name, prior in robot.priors.items():
        if prior.std is not None and prior.origin != IDENTIFIED:
            with contextlib.suppress(InputError):
                independent |= {key: (float(Key.parse(key).get(robot)), prior.std) for key in expand(name, robot)}
    return independent


def guesses(robot: Robot) -> tuple[str, ...]:
    """The keys of all numbers that are guesses, with a std or without."""
    return tuple(key for key, prior in numbers_told(robot).items() if prior.guessed)


def _has(robot: Robot, name: str) -> bool:
    """Whether a robot has a number of this name, and in friction that is not off."""
    key = find_key(name)
    if key is None:
        return False
    try:
        key.get(robot)
    except InputError:
        return False
    if not key.level:
        return True
    law = getattr(robot.friction, key.table.rpartition(".")[2])
    levels = (getattr(law, field) for field in _level_fields(type(law)))
    return any(any(level) if isinstance(level, tuple) else level for level in levels)


@cache
def _level_fields(law: type[Value]) -> tuple[str, ...]:
    """The fields of a law that hold levels."""
    words = (VISCOUS, COULOMB, BREAKAWAY)
    return tuple(field for field in law.model_fields if any(word in field for word in words))


def is_log(name: str, value: float, std: float) -> bool:
    """Whether a number has a logarithmic scale: what must be positive, and what may be 0 but is far from it."""
    key = Key.parse(name)
    may_be_0 = bool(key.level) or key.name in (DEAD_BAND, LATENCY)
    return key.name not in SIGNED and value > 0.0 and (not may_be_0 or std < NEAR_ZERO * value)


def correlation_of(robot: Robot) -> KeyCorrelation | None:
    """The correlations of the numbers that the robot has; None where fewer than two are left."""
    correlation = robot.correlation
    if correlation is None:
        return None
    indices = [k for k, key in enumerate(correlation.keys) if _has(robot, key)]
    if len(indices) == len(correlation.keys):
        return correlation if indices else None
    keys = tuple(correlation.keys[k] for k in indices)
    std = None if correlation.std is None else tuple(correlation.std[k] for k in indices)
    return key_correlation(keys, correlation.of(keys), std) if len(keys) > 1 else None


def refuse_strange_keys(robot: Robot) -> None:
    """Raises InputError for a correlation of what is no number of the robot."""
    for k, key in enumerate(robot.correlation.keys if robot.correlation is not None else ()):
        try:
            Key.parse(key).get(robot)
        except InputError as error:
            raise InputError(
                error.what,
                got=error.got or key,
                expected=error.expected,
                remedy=error.remedy,
                where=f"[correlation] keys[{k}]",
            ) from None


def with_correlation(robot: Robot, keys: Sequence[str], matrix: ArrayLike, std: Sequence[float] = ()) -> Robot:
    """The robot with what is now known of how some of its numbers are off together; what was known of others stays.

    A key of a list stands for all its entries, which are one number then. matrix: shape (keys, keys). std: of each key,
    kept where it is not what stands beside the number. Raises InputError for keys that are none of the robot, and for
    what is no matrix of correlations.
    """
    tied = [(k, entry) for k, key in enumerate(keys) for entry in expand(key, robot)]
    at = [k for k, _ in tied]
    matrix = np.asarray(matrix, dtype=float).reshape(len(keys), len(keys))[np.ix_(at, at)]
    keys, std = [entry for _, entry in tied], [std[k] for k in at] if len(std) else ()
    before = correlation_of(robot)
    old = tuple(key for key in (before.keys if before is not None else ()) if key not in keys)
    all_keys = (*old, *keys)
    joint_matrix = np.eye(len(all_keys))
    if before is not None:
        joint_matrix[: len(old), : len(old)] = before.of(old)
    joint_matrix[len(old) :, len(old) :] = matrix
    priors = numbers_told(robot)
    file_std = [float(priors[key].std or 0.0) if key in priors else 0.0 for key in all_keys]
    earlier = dict(zip(before.keys, before.std, strict=True)) if before is not None and before.std is not None else {}
    joint = [*(earlier.get(key, file_std[k]) for k, key in enumerate(old)), *(std or file_std[len(old) :])]
    apart = not all(a == b or abs(a - b) <= SAME_STD * abs(b) for a, b in zip(joint, file_std, strict=True))
    joined = key_correlation(all_keys, joint_matrix, tuple(map(float, joint)) if apart else None)
    refuse_strange_keys(robot.model_copy(update={"correlation": joined}))
    return robot.model_copy(update={"correlation": joined if apart else _without_the_free(joined)})


def _without_the_free(correlation: KeyCorrelation) -> KeyCorrelation | None:
    """The correlations without numbers that are off for themselves; None where all are."""
    matrix = correlation.of(correlation.keys)
    keys = tuple(key for key, row in zip(correlation.keys, matrix, strict=True) if np.count_nonzero(row) > 1)
    if keys == tuple(correlation.keys):
        return correlation if keys else None
    return key_correlation(keys, correlation.of(keys)) if keys else None
