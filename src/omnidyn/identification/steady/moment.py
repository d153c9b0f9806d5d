"""A change inside a run at constant speeds, of floor, load or supply, by commands that come again.

    y_k = a_c + d x_k + noise,   y: force of piece k along the mean force of its command c, over that mean; a held
                                 command is cut in pieces of half a second
    x: 0 before the change, 1 after it, and a line between: wheels cross the edge of a floor one by one

A command is compared with itself, so that no shape of friction has a part in it. The change lies where it explains
most; Student's t of d, without the pieces of the crossing, counts the memory of what is left. A motor that warms up
may explain as much: a line in time, or an exponential. Then it is no change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.steady.operating_points import ForcePoints, HeldForces, held_forces
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import Statement
from omnidyn.statistics import autocorrelation_time, t_quantile

CHANCE = 0.0002  # of as much at the likeliest cut: 2 of 100 runs over one floor are said to change (bench floors)
FALSE_BY_SHAPE = 0.01  # of right logs for which a change is told by the shape
MOST_CROSSING, CROSSING_SHARE = 6, 5  # pieces of a crossing at most, and of the run one part in so many
MOST_CUTS = 200  # of a long run
DRIFT_MARGIN = 5.0  # of the log-likelihood ratio, by which a drift must be worse
SETTLING = (0.1, 0.2, 0.35, 0.6)  # of the run: time constants of a drift
SPARE_DEGREES = 4  # degrees of freedom that a test needs
LEAST_PIECES = 3  # pieces, or windows, on either side of a cut
RIVAL_MARGIN = 6.0  # of t squared, by which another cut must be worse than the best to be ruled out
FORCE_SHARE = 0.02  # of the force: a smaller change does not matter


@dataclass(frozen=True)
class Moment:
    """A change inside a run. at: its time [s], and from where to where it may be. before, after: force of the motors
    that friction balances [N], mean of the commands that were given on both sides, with 95 % intervals. change: the
    second over the first, less 1; ci95: of it. p: the chance of as much. shape: of friction, that this rests on where
    no command came again."""

    source: str
    at: float
    between: tuple[float, float]
    before: float
    before_ci95: tuple[float, float]
    after: float
    after_ci95: tuple[float, float]
    change: float
    ci95: tuple[float, float]
    p: float
    shape: str = ""

    @property
    def vanished(self) -> tuple[bool, bool]:
        """Whether no force is left that is told from none, before and after: then nothing scales with it."""
        return self.before_ci95[0] <= 0.0, self.after_ci95[0] <= 0.0

    def statement(self) -> Statement:
        """The change, with its numbers."""
        numbers = {name: value for name, value in asdict(self).items() if name != "source"}
        is_before, is_after = self.vanished
        vanished_side = {"vanished": "before" if is_before else "after" if is_after else ""}
        return Statement("changes_within_run", subject=self.source, numbers=numbers | vanished_side)

    def short(self) -> Statement:
        """When, by how much, and both levels."""
        names = ("change", "at", "before", "after")
        return Statement("change_in_run", subject=self.source, numbers={name: getattr(self, name) for name in names})


def levelled(points: ForcePoints, changes: Sequence[Moment], sources: Mapping[int, str]) -> ForcePoints:
    """The points as they would be had nothing changed: forces after each change over 1 + change; what it falls into,
    and the side on which no force is left, go. sources: of the runs, by number."""
    wrench, kept_points = points.wrench.copy(), np.ones(len(points), bool)
    for change in changes:
        run_points = np.array([sources[number] == change.source for number in points.run.tolist()])
        points_before, points_after = (
            run_points & (points.span[:, 1] <= change.at),
            run_points & (points.span[:, 0] >= change.at),
        )
        if any(change.vanished):
            kept_points &= ~run_points | (points_after if change.vanished[0] else points_before)
            continue
        wrench[points_after] /= 1.0 + change.change
        kept_points &= ~run_points | points_before | points_after
    return replace(points, wrench=wrench).chosen(kept_points)


def moments(
    runs: Sequence[Run], robot: Robot, origin: str, window: tuple[float, float] | None = None
) -> tuple[tuple[Moment, ...], set[str]]:
    """(the changes inside runs, one a run at the most; names of the runs that could be tested)."""
    forces_by_run = {number: held_forces(run, robot, origin, window) for number, run in enumerate(runs)}
    cuts = {number: _cuts(run_forces) for number, run_forces in forces_by_run.items()}
    changes = [
        _moment(forces_by_run[number], cuts[number], run.source) for number, run in enumerate(runs) if cuts[number]
    ]
    return tuple(moment for moment in changes if moment), {
        runs[number].source for number in forces_by_run if cuts[number]
    }


def _cuts(held_pieces: HeldForces) -> list[int]:
    """Pieces before which there may be a change: some command must come on both sides, and pieces to spare."""
    n, command = len(held_pieces.command), held_pieces.command.tolist()
    if n - len(set(command)) - 1 < SPARE_DEGREES:
        return []
    return [cut for cut in range(LEAST_PIECES, n - LEAST_PIECES + 1) if set(command[:cut]) & set(command[cut:])]


@dataclass(frozen=True, eq=False)
class _Shift:
    """d, its standard error and degrees of freedom with the memory of what is left, in pieces. is_before, is_after
    (n,): the pieces on either side of the crossing."""

    value: float
    std: float
    degrees: float
    memory: float
    is_before: BoolArray
    is_after: BoolArray

    @property
    def chance(self) -> float:
        """Of as much by noise alone."""
        return 2.0 * float(stdtr(self.degrees, -abs(self.value) / self.std))


def _moment(held_pieces: HeldForces, cuts: Sequence[int], source: str) -> Moment | None:
    y, size = _along(held_pieces)
    n, command = len(y), held_pieces.command
    widths = range(min(MOST_CROSSING, n // CROSSING_SHARE) + 1)
    kept_cuts = cuts[:: -(-len(cuts) // MOST_CUTS)]
    crossings = np.array(
        [(cut, cut + width) for width in widths for cut in kept_cuts if cut + width <= n - LEAST_PIECES]
    )
    squares = _squares(y, command, crossings)
    best = int(np.argmin(squares))
    first, last = crossings[best].tolist()
    shift = _shift(y, command, first, last)
    if shift is None or shift.chance > CHANCE or abs(shift.value) < FORCE_SHARE:
        return None
    independent_pieces = n / shift.memory
    if independent_pieces * np.log(_drift_squares(y, held_pieces) / squares[best]) < DRIFT_MARGIN:
        return None
    near_cuts = crossings[independent_pieces * np.log(squares / squares[best]) < RIVAL_MARGIN]
    common_commands = np.isin(command, np.intersect1d(command[shift.is_before], command[shift.is_after]))
    force = float(size[common_commands].mean())
    spread = t_quantile(shift.degrees)
    scatter = shift.std * np.sqrt(
        shift.is_before.sum() * shift.is_after.sum() / (shift.is_before | shift.is_after).sum()
    )

    def level(rows: BoolArray) -> tuple[float, tuple[float, float]]:
        middle, half = force * float(y[rows].mean()), float(spread * force * scatter / np.sqrt(rows.sum()))
        return middle, (middle - half, middle + half)

    ends = (float(held_pieces.span[near_cuts[:, 0].min() - 1, 0]), float(held_pieces.span[near_cuts[:, 1].max(), 1]))
    time = 0.5 * float(held_pieces.span[first - 1, 1] + held_pieces.span[last, 0])
    level_before, level_after = (level(common_commands & side) for side in (shift.is_before, shift.is_after))
    base = level_before[0] / force
    ci95 = ((shift.value - spread * shift.std) / base, (shift.value + spread * shift.std) / base)
    p = min(1.0, len(cuts) * shift.chance)
    return Moment(source, time, ends, *level_before, *level_after, shift.value / base, ci95, p)


def _along(held_pieces: HeldForces) -> tuple[FloatArray, FloatArray]:
    """(force of each piece along the mean of its command, over that mean (n,); the mean [N] (n,))."""
    y, size = np.zeros(len(held_pieces.force)), np.zeros(len(held_pieces.force))
    for c in np.unique(held_pieces.command):
        rows = held_pieces.command == c
        mean = held_pieces.force[rows].mean(axis=0)
        size[rows] = np.linalg.norm(mean)
        y[rows] = held_pieces.force[rows] @ mean / max(float(mean @ mean), 1e-300)
    return y, size


def _without_commands(values: FloatArray, command: IntArray) -> FloatArray:
    """Columns less their mean at each command."""
    remaining = values.copy()
    for c in np.unique(command):
        remaining[command == c] -= remaining[command == c].mean(axis=0)
    return remaining


def _squares(y: FloatArray, command: IntArray, crossings: IntArray) -> FloatArray:
    """What each crossing (m, 2), from its first piece to the one after its last, leaves of the squares. Shape (m,)."""
    first, last = crossings.T
    ramps = np.clip((np.arange(len(y))[:, None] - first + 1.0) / (last - first + 1.0), 0.0, 1.0)
    return _left_by(y, _without_commands(ramps, command), command)


def _drift_squares(y: FloatArray, held_pieces: HeldForces) -> float:
    """What the likeliest drift of a motor that warms up leaves of the squares."""
    t = held_pieces.span.mean(axis=1) - held_pieces.span[0, 0]
    courses = np.stack([t / t[-1], *(np.exp(-t / (share * t[-1])) for share in SETTLING)], axis=1)
    return float(_left_by(y, _without_commands(courses, held_pieces.command), held_pieces.command).min())


def _left_by(y: FloatArray, columns: FloatArray, command: IntArray) -> FloatArray:
    """The squares that are left beside each column (n, m) by itself, each command with a mean of its own: (m,)."""
    remaining = _without_commands(y, command)
    size = np.maximum((columns**2).sum(axis=0), 1e-300)
    return np.maximum(float(remaining @ remaining) - (columns.T @ remaining) ** 2 / size, 1e-300)


def _shift(y: FloatArray, command: IntArray, first: int, last: int) -> _Shift | None:
    """The step from before piece `first` to piece `last` and after; None where too few pieces tell."""
    piece = np.arange(len(y))
    is_before, is_after = piece < first, piece >= last
    sides = is_before | is_after
    x = _without_commands(is_after[sides].astype(float), command[sides])
    remaining = _without_commands(y[sides], command[sides])
    square = float(x @ x)
    degrees = len(x) - len(np.unique(command[sides])) - 1
    if square < 1e-9 or degrees < SPARE_DEGREES:
        return None
    value = float(x @ remaining) / square
    residual = remaining - x * value
    memory = autocorrelation_time(residual)
    memory *= 1.0 + (2.0 * memory + 1.0) / len(x)  # a step that is fitted hides a part of it
    if degrees / memory < SPARE_DEGREES:
        return None
    std = float(np.sqrt(max(float(residual @ residual), 1e-300) / degrees / square * memory))
    return _Shift(value, std, degrees / memory, memory, is_before, is_after)
