"""The level of the noise by what a log shows without the model, and whether a fit leaves more: so that chi2 can fail.

*Repeats*: the same commands came again: half the mean square difference. *Holds*: the scatter about a parabola while a
command is held and the robot has settled. *Rest*: the same at rest, which may lack noise that comes of motion.
*Neighbours*: third differences, where these are those of white noise. Each is compared with what the fit leaves in
stretches as long, through the same projection, so that slow errors count in both or in neither:

    F = (mean square that the fit leaves)/(mean square of the noise), F(d1, d0),

repeats by the mean of a set times the root of how many it has, which without misfit is as large as their differences
(pure error, N. R. Draper, H. Smith, Applied Regression Analysis, 1998, section 2.1); holds by all other rows in
motion. Both as they are and made white by the memory of the residuals. d by F. E. Satterthwaite, Biometrics Bull. 2,
110 (1946): (tr C)^2/tr C^2 of the covariance by that memory, no more than the scatter between groups allows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import toeplitz
from scipy.special import fdtrc

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import HOLDS, NEIGHBOURS, REPEATS, REST, ROUNDING, Noise
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.rows import TINY, FitRows, Linear
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.outputs import SPEEDS
from omnidyn.identification.structure.misfit import left_beside
from omnidyn.identification.structure.residual_bins import unit_of
from omnidyn.identification.structure.windows import ResidualWindows, Shown, shown
from omnidyn.sensors import TRAVEL
from omnidyn.statistics import sensor_step, stretches

FALSE_SHARE = 0.002  # of right models in which the fit leaves more than the noise, all tests together
MARGIN = 0.1  # share of the residual, below which noise may be a little more in some rows than in others
PARABOLA, NO_TREND = 2, -1  # degree of what is taken out of a window
FEW_HOLDS, FEW_SETS, LEAST_DEGREES = 6, 3, 10.0  # groups, and degrees of freedom, without which nothing is told
FORGOTTEN_CORRELATION = 0.05  # correlation of repeats below which slow errors differ in them
SLOW_DEGREES = 50.0  # degrees of freedom of errors as they are, slow ones too, below which slow ones are left out
FOLLOWED_ROWS, LEAST_ROWS = 1000, 200  # rows by which errors have forgotten; differences without which nothing is told
COARSE_STEP = 0.5  # of a step of the sensor: less noise leaves rounding that repeats itself
PULL_RATIO = 2.0  # times the sum of squares of residuals, which a step within a straight model hardly changes
KNOWN_DEGREES = 1e9  # degrees of freedom of what is known
THIRD = np.array([1.0, -3.0, 3.0, -1.0])
WHITE = 0.1  # relative difference of the variance by second and by fourth differences up to which noise is white


@dataclass(frozen=True, eq=False)
class Levels:
    """noise: output -> its level by the best source that tells it; noise_at_rest: where the robot rests; beyond_names:
    outputs in which the fit leaves more than the noise, by a source that decides."""

    noise: dict[str, Noise]
    noise_at_rest: dict[str, Noise]
    beyond_names: tuple[str, ...]

    def channels(self, shares: Mapping[str, float]) -> dict[str, float]:
        """Shares of the variance of residuals that are no noise, by what they follow or by the level of the noise."""
        return dict(shares) | {name: max(shares[name], self.noise[name].share) for name in self.beyond_names}


def noise_levels(linear: Linear, motions: Sequence[DrivenMotion], is_pulled_in: bool = False) -> Levels:
    """What the log shows of the noise of each output, and whether the fit leaves more.

    is_pulled_in: whether residuals are as Student's t counts them (tails.py), and so no longer those of the rows.
    """
    rows = replace(linear.rows, residual=_without_pull(linear))
    tests_by_column = {
        f"{column[0]}[{column[1]}]": _of_column(rows, c, windows, linear.memory[c], is_pulled_in)
        for c, (windows, column) in enumerate(zip(shown(rows, motions), rows.problem.columns, strict=True))
    }
    p_limit = FALSE_SHARE / max(
        sum(test.decides for column_list in tests_by_column.values() for test in column_list), 1
    )
    noise, beyond_names = dict[str, Noise](), list[str]()
    for name, column_tests in tests_by_column.items():
        clear_tests = [test for test in column_tests if test.decides and test.p < p_limit and test.most >= MARGIN]
        if column_tests:
            noise[name] = min(clear_tests, key=lambda test: test.p) if clear_tests else column_tests[0]
        if clear_tests:
            beyond_names.append(name)
    noise_at_rest = {
        name: test for name, column_list in tests_by_column.items() for test in column_list if test.source == REST
    }
    return Levels(noise, noise_at_rest, tuple(beyond_names))


def _without_pull(linear: Linear) -> list[FloatArray]:
    """Residuals without what the parameters make of them in white rows: errors with a memory may have pulled them off.

    A step that makes a column PULL_RATIO larger leads beyond where the model is straight: such a one stays as it is.
    """
    rows, no_columns = linear.rows, [np.zeros((*residual.shape, 0)) for residual in linear.rows.residual]
    residuals = left_beside(rows, linear, no_columns)[0]
    is_pulled = rows.squares(residuals) > PULL_RATIO * rows.squares(rows.residual)
    is_pulled_by_piece = [is_pulled[columns][:, None] for columns in rows.column]
    return [
        np.where(is_far, raw_residual, white_residual)
        for is_far, raw_residual, white_residual in zip(is_pulled_by_piece, rows.residual, residuals, strict=True)
    ]


def _of_column(rows: FitRows, c: int, windows: Shown, memory: AutoRegression, is_pulled_in: bool) -> list[Noise]:
    """By every source that tells, best first."""
    name, i = rows.problem.columns[c]
    taken_factor, moves, unit = _taken(rows), _moves(rows, c), unit_of(name, i)
    tests = [
        (REPEATS, _repeated(windows, memory, name in TRAVEL)),
        (HOLDS, _held(windows, memory)),
        (REST, _rested(windows)),
    ]
    coarse_tests = [
        (source, test) for source, test in tests if test is not None and test.level > COARSE_STEP * _step(rows, c)
    ]
    if not is_pulled_in and not any(source != REST for source, _ in coarse_tests):
        other_tests = [(ROUNDING, _rounded(rows, c)), (NEIGHBOURS, _neighbours(rows, c, memory))]
        coarse_tests = [*[(source, test) for source, test in other_tests if test is not None][:1], *coarse_tests]
    return [test.noise(source, taken_factor, moves, windows.step, unit) for source, test in coarse_tests]


@dataclass(frozen=True, eq=False)
class _Power:
    """Squares (g,) of groups of windows, and how many windows they count as (g,); numbers, degrees: of a window."""

    squares: FloatArray
    counts: FloatArray
    numbers: int
    window_degrees: float

    @property
    def mean(self) -> float:
        """Mean square of a number."""
        return float(self.squares.sum() / (self.counts.sum() * self.numbers))

    @property
    def degrees(self) -> float:
        """Of freedom: by the memory, no more than the scatter of the groups allows: 2 mean^2/variance of the mean."""
        group_count, total = len(self.squares), float(self.counts.sum())
        deviations = self.squares - self.counts * self.squares.sum() / total
        scatter = group_count / max(group_count - 1, 1) * float((deviations**2).sum())
        return min(self.window_degrees * total, 2.0 * float(self.squares.sum()) ** 2 / max(scatter, TINY))


@dataclass(frozen=True)
class _Test:
    """level, residual: in their unit; p; degrees: of the level; share: of the residual that is no noise; rows,
    removed_degrees: of a window. new: the share in rows made white."""

    level: float
    residual: float
    p: float
    degrees: float
    share: float
    rows: int
    removed_degrees: int
    new: float = 0.0

    def noise(self, source: str, taken_factor: float, moves: float, step: float, unit: str) -> Noise:
        """As people read it. taken_factor: what a fit leaves is smaller by, for it has taken some; moves: of the
        output."""
        residual = self.residual * np.sqrt(taken_factor)
        slowest = self.removed_degrees / (2.0 * self.rows * step)
        return Noise(
            source,
            self.level,
            float(residual),
            float((residual / max(self.level, TINY)) ** 2),
            self.p,
            self.degrees,
            self.share,
            self.level / max(moves, TINY),
            slowest,
            unit,
            self.new,
        )


def _test(noise: _Power, residual_power: _Power, mean_square: float, rows: int, removed_degrees: int) -> _Test | None:
    """Of what is left beside the noise. mean_square: mean square of all residuals."""
    if noise.degrees < LEAST_DEGREES or residual_power.degrees < LEAST_DEGREES or noise.mean <= 0.0:
        return None
    p = float(fdtrc(residual_power.degrees, noise.degrees, residual_power.mean / noise.mean))
    share = max(1.0 - noise.mean / max(mean_square, TINY), 0.0)
    return _Test(
        float(np.sqrt(noise.mean)), float(np.sqrt(mean_square)), p, noise.degrees, share, rows, removed_degrees
    )


def _both_ways(plain_test: _Test | None, white: _Test | None) -> _Test | None:
    """Rows as they are, in their units, with the better chance of the two."""
    if plain_test is None or white is None:
        return plain_test
    return replace(plain_test, p=min(1.0, 2.0 * min(plain_test.p, white.p)), new=white.share)


def _held(windows: Shown, memory: AutoRegression) -> _Test | None:
    if windows.held_windows.several < FEW_HOLDS or windows.busy.several < FEW_HOLDS:
        return None
    trend = _Trend.of(windows.held_windows.values.shape[1], PARABOLA, memory)

    def test(trend: _Trend) -> _Test | None:
        """What is left in motion beside the scatter of holds, both seen this way."""
        held_power, busy = trend.power(windows.held_windows), trend.power(windows.busy)
        mean_square = (held_power.squares.sum() + busy.squares.sum()) / (
            (held_power.counts.sum() + busy.counts.sum()) * held_power.numbers
        )
        return _test(held_power, busy, float(mean_square), trend.rows, trend.removed_degrees)

    return _both_ways(test(trend), test(trend.white(memory)) if memory.remembers else None)


def _rested(windows: Shown) -> _Test | None:
    moving, resting = windows.held_windows + windows.busy, windows.resting
    if not len(resting.values) or not len(moving.values):
        return None
    trend = _Trend.of(moving.values.shape[1], PARABOLA, None)
    rest_power, motion_power = trend.power(resting), trend.power(moving)
    rest_test = _test(rest_power, motion_power, motion_power.mean, trend.rows, trend.removed_degrees)
    sensor_steps = max(sensor_step(window) for window in (*resting.values, resting.values.ravel()))
    return None if rest_test is None or sensor_steps > rest_test.level else rest_test


def _repeated(windows: Shown, memory: AutoRegression, counts_on: bool) -> _Test | None:
    """counts_on: whether what is logged counts from a start, which differs between repeats."""
    if windows.repeat_windows.several < FEW_SETS:
        return None
    lags = memory.autocovariance(min(windows.row_gap, FOLLOWED_ROWS) + 1)
    is_forgotten = abs(lags[-1]) < FORGOTTEN_CORRELATION * lags[0] and not memory.adds_up and not counts_on
    trend = _Trend.of(windows.repeat_windows.values.shape[1], NO_TREND if is_forgotten else PARABOLA, memory)
    if (
        is_forgotten
        and trend.window_degrees * (len(windows.repeat_windows.groups) - windows.repeat_windows.several) < SLOW_DEGREES
    ):  # too few to know slow errors
        trend = _Trend.of(trend.rows, PARABOLA, memory)

    def test(trend: _Trend) -> _Test | None:
        """What repeats have in common beside what they differ by, both seen this way."""
        repeat_values, groups = trend.seen(windows.repeat_windows.values), windows.repeat_windows.groups
        repeat_counts = _summed(groups, np.ones(len(groups)))
        mean = np.stack([_summed(groups, column) for column in repeat_values.T], axis=1) / repeat_counts[:, None]
        common_squares = repeat_counts * (mean**2).sum(axis=1)
        all_squares = _summed(groups, (repeat_values**2).sum(axis=1))
        apart_power, alike_power = (
            _Power(squares, count, repeat_values.shape[1], trend.window_degrees)
            for squares, count in (
                (all_squares - common_squares, repeat_counts - 1.0),
                (common_squares, np.ones_like(repeat_counts)),
            )
        )
        return _test(
            apart_power, alike_power, float(all_squares.sum() / repeat_values.size), trend.rows, trend.removed_degrees
        )

    return _both_ways(test(trend), test(trend.white(memory)) if memory.remembers else None)


def _neighbours(rows: FitRows, c: int, memory: AutoRegression) -> _Test | None:
    """Of outputs whose rows are fast: second and fourth differences are then those of white noise, as what is left."""
    if memory.remembers:
        return None
    series = [
        windows[a:b]
        for windows, (k, j) in zip(_shown(rows, c), _where(rows, c), strict=True)
        for a, b in stretches(np.append(rows.steps[k][j][1:] == 1, False)).tolist()
    ]
    second, third, fourth = (
        np.concatenate([np.diff(values, n) for values in series if len(values) > n] or [np.zeros(0)]) for n in (2, 3, 4)
    )
    if len(fourth) < LEAST_ROWS or abs(np.mean(fourth**2) / 70.0 / max(np.mean(second**2) / 6.0, TINY) - 1.0) > WHITE:
        return None
    lags = np.correlate(THIRD, THIRD, "full")[len(THIRD) - 1 :]
    noise = float(np.mean(third**2)) / lags[0]
    degrees = len(third) / (1.0 + 2.0 * float(((lags[1:] / lags[0]) ** 2).sum()))
    return _beside_all(rows, c, noise, degrees)


def _rounded(rows: FitRows, c: int) -> _Test | None:
    """Of outputs that an encoder counts, whose noise is little more than what it rounds: tick^2/12."""
    tick = float(rows.problem.tick[c])
    return _beside_all(rows, c, tick**2 / 12.0, KNOWN_DEGREES) if tick > 0.0 else None


def _beside_all(rows: FitRows, c: int, noise: float, degrees: float) -> _Test:
    """A variance of noise beside all residuals of a column."""
    residuals = np.concatenate([rows.residual[k][j][rows.masks[k][j]] for k, j in _where(rows, c)])
    mean_square = float(np.mean(residuals**2))
    p = float(fdtrc(len(residuals), degrees, mean_square / max(noise, TINY)))
    return _Test(
        noise**0.5, mean_square**0.5, p, degrees, max(1.0 - noise / max(mean_square, TINY), 0.0), len(residuals), 0
    )


def _where(rows: FitRows, c: int) -> list[tuple[int, int]]:
    """Pieces that have a column and known rows of it, and which of theirs it is."""
    piece_columns = [(k, columns.index(c)) for k, columns in enumerate(rows.column) if c in columns]
    return [(k, j) for k, j in piece_columns if rows.masks[k][j].any()]


def _shown(rows: FitRows, c: int) -> list[FloatArray]:
    """What the log shows of a column in the known rows of each of these pieces."""
    column_pieces = [(rows.pieces[k], rows.masks[k][j], j) for k, j in _where(rows, c)]
    return [piece.record.outputs[piece.first : piece.last + 1, j][mask] for piece, mask, j in column_pieces]


def _step(rows: FitRows, c: int) -> float:
    """The step in which a column was measured, 0 where none shows."""
    windows = _shown(rows, c)
    return max(float(rows.problem.tick[c]), sensor_step(np.concatenate(windows)) if windows else 0.0)


def _moves(rows: FitRows, c: int) -> float:
    """Root mean square of what an output shows; of what is no speed, about its mean."""
    values = np.concatenate([*_shown(rows, c), np.zeros(0)])
    centred_values = values if rows.problem.columns[c][0] in SPEEDS or not values.size else values - values.mean()
    return float(np.sqrt(np.mean(centred_values**2))) if centred_values.size else 0.0


def _taken(rows: FitRows) -> float:
    """Rows over those that are left once the fit has taken some for its numbers and starts."""
    total = sum(int(mask.sum()) for mask in rows.masks)
    free = len(rows.problem.parameters) + sum(int(piece.free.sum()) for piece in rows.pieces)
    return total / max(total - free, 1)


@dataclass(frozen=True, eq=False)
class _Trend:
    """How windows are looked at: along `ways` (L, d), orthonormal, with polynomials taken out, `removed_degrees` of
    them, once `memory` has made the rows white. window_degrees: degrees of freedom of a window."""

    ways: FloatArray
    removed_degrees: int
    window_degrees: float
    memory: AutoRegression | None = None

    @property
    def rows(self) -> int:
        return len(self.ways)

    @classmethod
    def of(cls, rows: int, degree: int, memory: AutoRegression | None) -> _Trend:
        """Of rows as they are, which have this memory."""
        ways = _beside(_polynomials(rows, degree))
        numbers = float(ways.shape[1])
        if memory is None or not memory.remembers:
            return cls(ways, degree + 1, numbers)
        if degree == NO_TREND:  # windows side by side are not independent
            lags = memory.autocovariance(FOLLOWED_ROWS)
            return cls(ways, 0, rows / (2.0 * float(((lags / lags[0]) ** 2).sum()) - 1.0))
        covariance = toeplitz(memory.autocovariance(rows))
        if memory.adds_up:
            covariance = np.tri(rows) @ covariance @ np.tri(rows).T
        window_covariance = ways.T @ covariance @ ways
        return cls(ways, degree + 1, float(np.trace(window_covariance) ** 2 / (window_covariance**2).sum()))

    def white(self, memory: AutoRegression) -> _Trend:
        """The same of rows made white."""
        ways = _beside(_through(memory, _polynomials(self.rows, self.removed_degrees - 1)))
        return _Trend(ways, self.removed_degrees, float(ways.shape[1]), memory)

    def seen(self, values: FloatArray) -> FloatArray:
        """Windows (m, L) along these ways, (m, d)."""
        return (values if self.memory is None else _through(self.memory, values.T).T) @ self.ways

    def power(self, windows: ResidualWindows) -> _Power:
        """By groups."""
        squares = _summed(windows.groups, (self.seen(windows.values) ** 2).sum(axis=1))
        return _Power(
            squares, _summed(windows.groups, np.ones(len(windows.groups))), self.ways.shape[1], self.window_degrees
        )


def _summed(groups: IntArray, values: FloatArray) -> FloatArray:
    """Values (m,) of each group added up."""
    return np.asarray(np.bincount(groups, values), dtype=np.float64)


def _polynomials(rows: int, degree: int) -> FloatArray:
    """Of degree 0 to `degree`, (rows, degree + 1)."""
    positions = np.linspace(-1.0, 1.0, rows)
    return np.stack([positions**k for k in range(degree + 1)], axis=1) if degree >= 0 else np.zeros((rows, 0))


def _beside(columns: FloatArray) -> FloatArray:
    """An orthonormal basis of all that some columns (L, k) do not span, (L, L - k)."""
    return np.linalg.qr(columns, mode="complete")[0][:, columns.shape[1] :] if columns.size else np.eye(len(columns))


def _through(memory: AutoRegression, columns: FloatArray) -> FloatArray:
    """Columns (L, K) made white, each by itself from its first row on."""
    steps = np.ones(len(columns), dtype=np.intp)
    steps[0] = 0
    return memory.new(np.ascontiguousarray(columns), steps, np.ones(len(columns), dtype=bool))
