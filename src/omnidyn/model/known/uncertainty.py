"""Uncertainty: how far the numbers of a robot may be off, together, and what follows from that for anything else.

    z = ln p or p,   z_drawn = z + D S w,   S S' = R,   w independent, each standard normal

p are the numbers of a robot file that have a std, D their std, R their correlation ([correlation] of the file, 0 where
it says nothing). What follows from them is computed once per drawn robot, and its interval is that of the results:
propagation of distributions, JCGM 101:2008, sections 5 and 7. To first order it is the propagation of variances g' C g
of JCGM 100:2008, 5.2 (`first_order_std`); but a robot that sticks, or is about to, has no first order.

The draws of w are a Latin hypercube (McKay, Beckman, Conover, Technometrics 21 (1979)): each share of each normal is
hit once, which makes a hundred draws do for a 95 % interval. One seed gives the same robots, always.

Scales: what must be positive has a logarithmic one, where 2 and 1/2 are equally far, as in a fit. So has a friction
that is far from 0 (NEAR_ZERO): what a fit can tell is often a product of friction and motor constants, and products
stay what they are on that scale alone. A friction that may be 0 is normal, next to 0 below that. An angle is normal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import one_by_one
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.keys import Key
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.known.told import SIGNED, Told, is_log, numbers_told, uncertainty_of
from omnidyn.model.robot import Robot

DRAWS = 100
NOISE = 1e-13  # of an eigenvalue of a correlation: less is rounding, and numbers that are one stay one
SMALL = 1e-5  # of a number: the most that it is off by where a slope is taken
FURTHEST = math.log(1e4)  # of a logarithm: the span of a fit
TAIL_SHARE = 0.025  # share of the results below a 95 % interval, and above it
LEAST_SHARE = 1e-6  # of value or std, that a friction stays above: 0 would switch a part of it off
PULLS = 60  # halvings that bring a draw out of range back to the value itself
FEWEST_DRAWS, MOST_DRAWS = 20, 1_000_000  # of fewer draws even the outermost two are less than 95 % apart


class Interval(NamedTuple):
    """Ends of a 95 % interval, each of the shape of what it is about."""

    low: FloatArray
    high: FloatArray


def plausible(robot: Robot, count: int = DRAWS, seed: int = 0) -> list[Robot]:
    """Robots that may be meant: draws of all numbers that have a std, guesses included, with their correlations.

    Raises InsufficientDataError where no number of the robot has a std, InputError for a strange count.
    """
    check_order("plausible(robot, count)", (robot, Robot), (count, object))
    draws = Draws(robot, count, seed)
    return [draws.robot(k) for k in range(count)]


class Draws:
    """The draws of `plausible`, a robot made only where it is asked for."""

    def __init__(self, robot: Robot, count: int, seed: int) -> None:
        self._origin, (self.keys, self._uncertain) = robot, _known(robot)
        if not 1 <= count <= MOST_DRAWS:
            raise InputError("strange number of draws", got=count, expected=f"1 to {MOST_DRAWS}", where="draws")
        self._off = _errors(self._uncertain, count, seed)

    @cached_property
    def values(self) -> FloatArray:
        """The numbers drawn, not yet brought back into any range. Shape (count, keys)."""
        columns = zip(self.keys, self._uncertain.value.tolist(), self._off.T, self._uncertain.log, strict=True)
        return np.stack([_off(key, value, off, bool(log)) for key, value, off, log in columns], axis=1)

    @property
    def log(self) -> tuple[bool, ...]:
        """Which numbers have a logarithmic scale: their median is the value, their mean is above it."""
        return tuple(map(bool, self._uncertain.log))

    def robot(self, k: int) -> Robot:
        """Robot k."""
        return _drawn(self._origin, self.keys, self._uncertain, self._off[k], self.values[k])


def _known(robot: Robot) -> tuple[list[Key], Told]:
    """The numbers that have a std. Raises InsufficientDataError where there are none."""
    uncertain = uncertainty_of(robot)
    if not uncertain.keys:
        raise InsufficientDataError(
            "nothing says how far the numbers of this robot may be off",
            got=f"{robot.name} without any std",
            expected="{ value = .., std = .. } at the numbers of its file",
            remedy="let identify write it, or add std",
        )
    return [Key.parse(key) for key in uncertain.keys], uncertain


def interval_of(robot: Robot, function: Callable[[Robot], ArrayLike], count: int = DRAWS, seed: int = 0) -> Interval:
    """The 95 % interval of a function of the robot, each element for itself; raises what `plausible` raises."""
    ends = QuantileTails(count)
    for candidate in plausible(robot, count, seed):
        ends.add(np.asarray(function(candidate), dtype=float))
    return ends.interval


def first_order_std(robot: Robot, function: Callable[[Robot], FloatArray]) -> FloatArray:
    """The std of a function of the robot, each element for itself, from its slopes along all that may be off.

    Numbers that a log tells only together, such as two inertias of which it sees the sum, have stds beyond all measure,
    and the sum has not: slopes keep to it, draws on the scales of the numbers do not. Raises what `plausible` raises.
    """
    keys, uncertain = _known(robot)
    size = np.where(uncertain.value == 0.0, uncertain.std, abs(uncertain.value))
    ways = (_root(uncertain.correlation) * uncertain.std[:, None]).T
    ways = ways[ways.any(axis=1)]
    shares = [SMALL / max(float((abs(step[size > 0.0]) / size[size > 0.0]).max()), SMALL) for step in ways]
    pairs = [_aside(robot, keys, uncertain, share * step) for share, step in zip(shares, ways, strict=True)]
    ends, total = one_by_one(function, [candidate for pair in pairs for candidate in pair]), 0.0
    for share in shares:
        total = total + ((next(ends) - next(ends)) / share) ** 2
    return np.sqrt(total)


class QuantileTails:
    """The 95 % interval of so many results (20 or more), added one by one: what lies far inside of it is not kept.

    Result k of n, in order, stands for the share (k - 1/2)/n (Hazen), as each draw of a Latin hypercube does. Infinity
    is a result like others; an element that is once NaN is NaN.
    """

    def __init__(self, count: int) -> None:
        if count < FEWEST_DRAWS:
            raise InputError(
                "too few draws for a 95 % interval", got=count, expected=f"{FEWEST_DRAWS} or more", where="draws"
            )
        self._below, self._share = divmod(max(TAIL_SHARE * count - 0.5, 0.0), 1.0)
        self._kept = min(int(self._below) + 2, count)
        self._lowest: list[FloatArray] = []

    def add(self, result: FloatArray) -> None:
        """One more result; all have one shape."""
        new = np.stack([result, -result])
        if not self._lowest:
            self._none = np.isnan(new)
        self._none |= np.isnan(new)
        self._lowest.append(new)
        if len(self._lowest) >= 2 * self._kept:
            self._sort()

    def _sort(self) -> None:
        self._lowest = list(np.sort(np.stack(self._lowest), axis=0)[: self._kept])

    @property
    def interval(self) -> Interval:
        """The ends, of all that was added."""
        self._sort()
        first, then = (self._lowest[min(int(self._below) + k, len(self._lowest) - 1)] for k in (0, 1))
        with np.errstate(invalid="ignore"):
            between = first + self._share * (then - first)
        ends = np.where(np.isinf(first) | np.isinf(then), then if self._share > 0.5 else first, between)
        low, high = np.where(self._none, np.nan, ends)
        return Interval(low + 0.0, 0.0 - high)


def _errors(uncertain: Told, count: int, seed: int) -> FloatArray:
    """Errors of the numbers on their scales. Shape (count, keys)."""
    scale = uncertain.std / np.where(uncertain.log, uncertain.value, 1.0)
    root = _root(uncertain.correlation)
    random = np.random.default_rng(seed)
    place = np.stack([random.permutation(count) for _ in uncertain.keys], axis=1)
    normal = ndtri((place + 0.5) / count)
    return normal @ root.T * scale


def _root(correlation: FloatArray) -> FloatArray:
    """S of S S' = R. Shape (keys, keys)."""
    values, vectors = np.linalg.eigh(correlation)
    return vectors * np.sqrt(np.where(values > NOISE, values, 0.0))


def _aside(robot: Robot, keys: Sequence[Key], uncertain: Told, off: FloatArray) -> list[Robot]:
    """Two robots, one as far off as that from the other: on one side, for at 0, or at the end of a range, another
    engine may run. It is the side on which a robot file may be."""
    for side in (1.0, -1.0):
        robots = []
        for factor in (side, 2.0 * side):
            moved_robot = robot
            for key, value in zip(keys, (uncertain.value + factor * off).tolist(), strict=True):
                moved_robot = key.set(moved_robot, value, checked=False)
            robots.append(holding(moved_robot))
        if not _out_of_range(robots[1], robot):
            break
    return robots


def _drawn(robot: Robot, keys: Sequence[Key], uncertain: Told, off: FloatArray, values: FloatArray) -> Robot:
    """One robot. What no robot file may hold comes half-way back to the value, as often as that takes.

    values: what these errors make of the numbers, taken as they are: an exponential of another array has other bits.
    """
    for _ in range(PULLS):
        draw = robot
        for key, number in zip(keys, values.tolist(), strict=True):
            draw = key.set(draw, number, checked=False)
        draw = holding(draw)
        bad_parts = _out_of_range(draw, robot)
        if not bad_parts:
            return draw
        off = np.where([key.part in bad_parts for key in keys], 0.5 * off, off)
        columns = zip(keys, uncertain.value.tolist(), off.tolist(), uncertain.log, strict=True)
        values = np.array([_off(key, value, error, bool(log)) for key, value, error, log in columns])
    return robot


def _off(key: Key, value: float, error: Any, log: bool) -> Any:
    """A number that is off by an error, or by each of many, on its scale."""
    if log:
        return value * np.exp(np.clip(error, -FURTHEST, FURTHEST))
    if key.name in SIGNED:
        return value + error
    return np.maximum(LEAST_SHARE * np.maximum(value, np.abs(error)), value + error)


def _out_of_range(robot: Robot, origin: Robot) -> set[str]:
    """The parts of a robot that hold what no file may hold; those that are still the ones of its origin do not."""
    bad_parts = set()
    for part in ("body", "wheels", "motor", "drive"):
        part_value = getattr(robot, part)
        try:
            if part_value is not getattr(origin, part):
                part_value.replace()
        except InputError:
            bad_parts.add(part)
    for law in robot.friction.laws if robot.friction is not origin.friction else ():
        try:
            law.replace()  # pyright: ignore[reportAttributeAccessIssue]
        except InputError:
            bad_parts.add("friction")
    return bad_parts


def effects(robot: Robot, function: Callable[[Robot], ArrayLike], keys: Sequence[str]) -> dict[str, float]:
    """Key -> by how much the function changes, at the most, relative to itself, where that number alone is off.

    By its std, or by 1 % where it has none.
    """
    at, priors, changes = np.asarray(function(robot), dtype=float), numbers_told(robot), {}
    for name in keys:
        key = Key.parse(name)
        value = float(key.get(robot))
        std = (priors[name].std if name in priors else None) or 0.01 * abs(value)
        log = is_log(name, value, std)
        moved_robot = holding(key.set(robot, float(_off(key, value, std / value if log else std, log)), checked=False))
        moved_value = at if _out_of_range(moved_robot, robot) else np.asarray(function(moved_robot), dtype=float)
        with np.errstate(invalid="ignore", divide="ignore"):
            changes[name] = float(np.nanmax(np.abs(moved_value - at) / np.abs(at), initial=0.0))
    return changes
