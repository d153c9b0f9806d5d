"""Encoders and sensors that stick: one value repeated to the last digit for too long, or while the robot changes."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache, partial

import numpy as np
from scipy.special import ndtr

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import INPUTS, SENSORS, LogUnderCheck
from omnidyn.findings.signal.reference import MEASUREMENTS, expected_wheel_speed
from omnidyn.findings.signal.robust import quantum, rest_level, smooth
from omnidyn.findings.values.wheel_predictor import WheelPredictor
from omnidyn.logs.channels import place
from omnidyn.statement import WARNING
from omnidyn.statistics import robust_std, stretches

LONG_ROWS = 5  # rows
FOLLOWS = 0.5  # [s] after which a wheel follows its command
IMPOSSIBLE = 1e-6  # chance, over the whole log, below which repeated values are no chance
SURE_ERRORS = 2.0  # standard errors that a chance may be larger than seen
PARTS = 4  # of a stretch, whose means are compared
MARGIN = 1.25  # by which a stretch must differ more than any other of its length
TOGETHER = 0.8  # of the rows of a stretch: so many repeats of all others say that the robot keeps its speed
RESOLVES = 0.1  # of the top speed: a reference as exact as this would have seen a change that matters


def check_stuck(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Stretches in which a sensor repeats one value to the last digit while it should not."""
    findings, predictor = [], WheelPredictor(work)
    expected = expected_wheel_speed(work, without="wheel_speed")
    for channel in SENSORS:
        # The longest repeat first: a wheel that sticks is no witness against the others.
        sampled = work.sampled_columns(channel)
        columns = [(name, values, _repeats(values), rest_level(values)) for name, values in sampled]
        for component, values, repeats, rest in sorted(columns, key=lambda column: -_longest(*column[1:])):
            k = place(component)[1]  # type: ignore[index]
            judge = _StuckJudge(work, values, repeats, rest)
            judge.steady = _Steady(work, channel, k).during
            if channel == "wheel_speed":
                judge.predict = partial(predictor.wheel_speed, k)
            if channel == "wheel_speed" and expected is not None and k < expected[1].shape[1]:
                judge.expected = _Away(values, expected[1][:, k])
                judge.measured = expected[0] in MEASUREMENTS
            mask = judge.frozen()
            if not mask.any():
                continue
            spans = stretches(mask)
            longest = max(work.t[b - 1] - work.t[a] for a, b in spans)
            findings.append(
                Finding(
                    "stuck",
                    WARNING,
                    component,
                    {"longest_s": float(longest), "share": float(mask.mean()), "times": len(spans)},
                    rows=work.lines(mask),
                    count=int(mask.sum()),
                )
            )
            work = work.masked(channel, k, mask)
            predictor = WheelPredictor(work)
    return findings, work


def _repeats(values: FloatArray) -> IntArray:
    """(start, end) of each stretch of rows with one value. Shape (stretches, 2)."""
    return stretches(np.diff(values) == 0.0) + np.array([0, 1])


def _longest(values: FloatArray, repeats: IntArray, rest: float) -> int:
    """Rows in the longest repeat of a value that is no rest."""
    return int(np.diff(repeats, axis=1)[np.abs(values[repeats[:, 0]]) > rest].max(initial=0))


class _StuckJudge:
    """Which of the repeats of one channel are too long for chance, or go on while something else changes."""

    predict: Callable[[BoolArray], FloatArray] | None = None  # the channel by all others
    expected: _Away | None = None
    steady: Callable[[int, int], bool] | None = None  # whether nothing in the log changes, commands least of all
    measured = False  # expected is what the wheel did; a command it follows later, or, at rest, not at all

    def __init__(self, work: LogUnderCheck, values: FloatArray, repeats: IntArray, rest: float) -> None:
        self.values, self.repeats, self.slow = values, repeats, max(10, round(FOLLOWS / work.step))
        self.turns = np.abs(values) > rest
        self.lengths = repeats[:, 1] - repeats[:, 0]
        self.long = self.lengths >= LONG_ROWS
        self.moving = self.turns[repeats[:, 0]]

    @cached_property
    def predicted(self) -> _RowWalk | None:
        """How far what all other columns say walks away."""
        return None if self.predict is None else _RowWalk(self.values, self.predict(self.repeated), self.repeated)

    @cached_property
    def repeated(self) -> BoolArray:
        """Rows in repeats that are asked about: nothing is taken from them."""
        edges = np.zeros(len(self.values) + 1, dtype=np.int64)
        repeats = self.repeats[self.lengths >= max(LONG_ROWS, self.slow // 2)]
        np.add.at(edges, repeats[:, 0], 1)
        np.add.at(edges, repeats[:, 1], -1)
        return np.cumsum(edges[:-1]) > 0

    def frozen(self) -> BoolArray:
        """Rows that stick."""
        mask = np.zeros(len(self.values), dtype=bool)
        if not self.long.any():
            return mask
        chance, usual = _chance_of_a_repeat(self.lengths[self.moving])
        for a, b in self.repeats[self.long]:
            if self._unlikely(a, b, chance, usual) or self._walked(a, b):
                mask[a:b] = True
        return mask

    def _unlikely(self, a: int, b: int, chance: float, usual: float) -> bool:
        """Whether so many repeats of a speed are no chance: by other repeats of the log, and by the rows beside."""
        length, n = b - a, len(self.values)
        if not self.turns[a]:
            return False
        if self._rough(a, b):
            return n * self._rare ** (length - 1) < IMPOSSIBLE
        neighbours = np.r_[self.values[max(0, a - 8) : a], self.values[b : b + 8]]
        chance = max(chance, (float((neighbours == self.values[a]).sum()) + 1.0) / (len(neighbours) + 2.0))
        unlikely = n * chance ** (length - 1)
        if length <= 3 * usual or unlikely >= IMPOSSIBLE or (self.steady is not None and self.steady(a, b)):
            return False
        # Where the others say that the wheel kept its speed, the noise that the rest of the log has counts for less.
        return unlikely < IMPOSSIBLE**2 or self.predicted is None or not self.predicted.stays(a, b)

    @cached_property
    def _rare(self) -> float:
        """Chance of a repeat in a channel without steps, from all but its three longest repeats; 1 where not rare."""
        moving = int(self.turns.sum())
        repeats = float(np.sort(self.lengths[self.moving] - 1)[:-3].sum())
        chance = (repeats + 1.0) / (moving + 2.0)
        return chance if chance < 0.02 and not quantum(self.values) else 1.0

    def _rough(self, a: int, b: int) -> bool:
        """Whether a channel that hardly ever repeats a value is as noisy beside these repeats as anywhere.

        A simulated speed without noise settles until it repeats: the rows before it hardly change.
        """
        if self._rare == 1.0:
            return False
        steps, usual = self._steps
        ends = [steps[max(0, a - 4) : a], steps[b - 1 : b + 3]]
        return all(part.size > 0 and bool(np.nanmedian(part) > 0.1 * usual) for part in ends)

    @cached_property
    def _steps(self) -> tuple[FloatArray, float]:
        """(changes from row to row, the usual one)."""
        steps = np.abs(np.diff(self.values))
        return steps, float(np.nanmedian(steps[steps > 0.0])) if (steps > 0.0).any() else np.inf

    def _walked(self, a: int, b: int) -> bool:
        """Whether a reference walks away from the value that repeats."""
        turning, length = bool(self.turns[a]), b - a
        judgeable = length >= (self.slow // 2 if self.measured else self.slow) and (self.measured or turning)
        if self.expected is not None and judgeable and self.expected.during(a, b):
            return True
        if not turning or 2 * length < self.slow or self.predicted is None:
            return False
        return self.predicted.during(a, b)


class _Steady:
    """Whether commands stand still and all wheels repeat their speed together: a steady run seen in coarse steps."""

    def __init__(self, work: LogUnderCheck, channel: str, k: int) -> None:
        self.inputs = [np.nan_to_num(values) for name in INPUTS if (values := work.get(name)) is not None]
        columns = [values for name, values in work.columns(channel) if place(name)[1] != k]  # type: ignore[index]
        self.others = [np.diff(values) == 0.0 for values in columns]

    def during(self, a: int, b: int) -> bool:
        """Over rows a to b."""
        settled = a + (b - a) // 10
        still = bool(self.inputs) and all(not np.ptp(values[settled:b], axis=0).any() for values in self.inputs)
        return (
            still and bool(self.others) and all(equal_rows[a : b - 1].mean() > TOGETHER for equal_rows in self.others)
        )


class _RowWalk:
    """How far a reference walks away during repeats, beside all other stretches of that length in the log."""

    def __init__(self, values: FloatArray, reference: FloatArray, repeated: BoolArray) -> None:
        off = values - reference
        self.good = np.isfinite(off)
        self.sums = np.concatenate([[0.0], np.cumsum(np.where(self.good, off, 0.0))])
        self.gaps = np.concatenate([[0], np.cumsum(~self.good)])
        self.holes = self.gaps + np.concatenate([[0], np.cumsum(repeated)])
        self.step, self.top = quantum(values), float(np.nanmax(np.abs(values)))
        self.by_length: dict[int, tuple[float, IntArray, FloatArray, FloatArray]] = {}

    def _range(self, starts: IntArray, length: int) -> FloatArray:
        """Range of the means over parts of each stretch."""
        edges = starts[:, None] + np.round(np.linspace(0, length, PARTS + 1)).astype(np.int64)
        means = np.diff(self.sums[edges], axis=1) / np.diff(edges, axis=1)
        return means.max(axis=1) - means.min(axis=1)

    def _usual(self, a: int, b: int) -> float:
        """The largest range in other stretches of about this length; inf where too few are.

        Stretches without repeats, where there are enough of them; in a log that stands still in steps, all others.
        """
        # Lengths in classes a fifth apart; the next shorter, whose means are noisier.
        length = max(PARTS, int(1.2 ** math.floor(math.log(b - a, 1.2))))
        if length not in self.by_length:
            self.by_length[length] = self._others(length)
        clean, starts, before, behind = self.by_length[length]
        if np.isfinite(clean):
            return clean
        first, last = np.searchsorted(starts, [a - 2 * length, b + length])
        if (first + len(starts) - last) * max(1, length // 8) < 5 * length:
            return math.inf
        return max(float(before[first - 1]) if first else 0.0, float(behind[last]) if last < len(starts) else 0.0)

    def _others(self, length: int) -> tuple[float, IntArray, FloatArray, FloatArray]:
        """(largest range without repeats, starts of all stretches, largest range up to each and from each)."""
        step = max(1, length // 8)
        starts = np.arange(0, len(self.good) - length + 1, step)
        starts = starts[self.gaps[starts + length] == self.gaps[starts]]
        ranges = self._range(starts, length)
        clean = ranges[self.holes[starts + length] == self.holes[starts]]
        largest = float(clean.max()) if len(clean) * step >= 5 * length else math.inf
        return largest, starts, np.maximum.accumulate(ranges), np.maximum.accumulate(ranges[::-1])[::-1]

    def during(self, a: int, b: int) -> bool:
        """Whether the reference changes over rows a to b by more than it is off anywhere else."""
        if not self.good[a:b].all():
            return False
        walk = float(self._range(np.array([a]), b - a)[0])
        return walk > max(MARGIN * self._usual(a, b), 2.0 * self.step)

    def stays(self, a: int, b: int) -> bool:
        """Whether a reference that would see a change sees none."""
        return self._usual(a, b) < RESOLVES * self.top and bool(self.good[a:b].all()) and not self.during(a, b)


class _Away:
    """Whether a reference walks away from values that repeat, measured by how far it is from them at other times."""

    def __init__(self, values: FloatArray, reference: FloatArray) -> None:
        self.size, self.reference, self.step = np.abs(values - reference), reference, quantum(values)
        self.good = np.isfinite(self.size)
        self.least = max(float(robust_std(self.size[self.good], 0.0)), self.step) if self.good.any() else np.inf

    def during(self, a: int, b: int) -> bool:
        """Over rows a to b."""
        part = self.good[a:b]
        if part.sum() < 5:
            return False
        # A reference that is elsewhere but stays there says slip or a wrong scale, no sensor that sticks. Quantiles:
        # where a command changes, a late channel makes a reference jump for a row or two.
        low, high = np.quantile(smooth(self.reference[a:b][part], 3), [0.1, 0.9])
        if not high - low > 6.0 * self.least:
            return False
        # Where the robot speeds up the two differ more, by a lag or by means: the larger of two measures counts.
        remainder = np.concatenate([self.size[:a][self.good[:a]], self.size[b:][self.good[b:]]])
        return bool(remainder.size) and bool(high - low > 6.0 * float(np.quantile(remainder, 0.95)) / 1.6)


def _chance_of_a_repeat(lengths: IntArray) -> tuple[float, float]:
    """(chance that a value is repeated once more, length of the fourth longest stretch), the longest left out.

    Repeats after repeats tell how the noise compares with the step of the sensor, the less the fewer there are: the
    upper end of what they allow counts. The chance is that of a speed in the middle of a step, where it is largest.
    """
    rest = np.sort(lengths)[:-3] - 1  # number of repeats in each stretch
    repeats, again = float(rest.sum()), float((rest - 1).sum())
    chance = (again + 3.0) / (repeats + 6.0)
    chance = min(1.0, chance + SURE_ERRORS * math.sqrt(chance * max(0.0, 1.0 - chance) / (repeats + 6.0)))
    after, middle = _repeats_by_noise()
    return float(np.interp(chance, after[::-1], middle[::-1])), float(rest.max(initial=0) + 1)


@lru_cache(maxsize=1)
def _repeats_by_noise() -> tuple[FloatArray, FloatArray]:
    """(chance of a repeat after a repeat, chance of one in the middle of a step) for noises of 0.05 to 20 steps.

    A speed anywhere in a step, normal noise, rounding: with P_k the chance of level k, E[sum P_k^3]/E[sum P_k^2], and
    P_0 in the middle. Noise is taken 20 % smaller than it is: changes of the speed look like noise too.
    """
    noises, places = np.geomspace(0.05, 20.0, 60), np.linspace(-0.5, 0.5, 21)
    after, middle = [], []
    for noise in noises:
        edges = np.arange(-math.ceil(6 * noise) - 1, math.ceil(6 * noise) + 2) + 0.5
        chances = np.diff(ndtr((edges[:, None] - places) / noise), axis=0)
        after.append(float((chances**3).sum() / (chances**2).sum()))
        middle.append(float(2.0 * ndtr(0.5 / (0.8 * noise)) - 1.0))
    return np.array(after), np.array(middle)
