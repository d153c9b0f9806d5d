"""A change inside a run at constant speeds, of floor, load or supply, by commands that come again.

    y_k = a_c + d x_k + noise,   y: force of piece k along the mean force of its command c, over that mean; a held
                                 command is cut in pieces of half a second
    x: 0 before the change, 1 after it, and a line between: wheels cross the edge of a floor one by one

A command is compared with itself, so that no shape of friction has a part in it. The change lies where it explains
most; Student's t of d, without the pieces of the crossing, counts the memory of what is left. A motor that warms up
may explain as much: a line in time, or an exponential. Then it is no change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.steady.lack_of_fit import LinearShape, all_moving, unoffered_columns
from omnidyn.identification.steady.operating_points import ForcePoints, HeldForces, held_forces
from omnidyn.identification.steady.shapes import HUBER, RAYLEIGH, ShapeFit, is_turning
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import Statement
from omnidyn.statistics import autocorrelation_time, huber_weight, t_quantile

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


# A change inside a run where no command comes again: the fitted shape of friction is the yardstick
#
# F_k = (1 + d [t_k > T]) f(nu_k) + noise,   f: the shape at the motion of window k, its levels free
#
# The levels are fitted anew beside every d, so that directions which were driven on one side only say nothing. T is
# the cut that explains most; Student's t of d counts the free numbers of the shape, and all cuts of all runs. What a
# wrong shape leaves over follows the direction; a robot that drives round slowly makes a step in time of that. So the
# standard error is that of errors with the memory that is left beside the step, and a step that a part which is not
# offered takes away (lack_of_fit.py) is none.

SPARE_NUMBERS = 6  # numbers beyond those that are fitted
ROUNDS = 10  # of robust weights
MOST_CONDITION = 1e4  # condition of what determines levels
RIVAL_CHANCE = 0.05  # the chance of as much beside another part, above which that may be it


@dataclass(frozen=True, eq=False)
class _Run:
    """One run as a linear problem, in the order of time. span (n, 2) [s]."""

    source: str
    shape: str
    span: FloatArray
    problem: LinearShape
    rivals: Sequence[FloatArray]

    @property
    def cuts(self) -> range:
        return range(LEAST_PIECES, len(self.span) - LEAST_PIECES + 1)


@dataclass(frozen=True)
class _Step:
    """d of a cut, its standard error and degrees of freedom."""

    value: float
    std: float
    degrees: int

    @property
    def size(self) -> float:
        return abs(self.value / self.std)

    def chance(self, tests: int) -> float:
        """Of as much by noise alone, in so many tests."""
        return min(1.0, tests * 2.0 * float(stdtr(self.degrees, -self.size)))


def moments_by_shape(
    robot: Robot,
    points: ForcePoints,
    fit_of: Callable[[str], ShapeFit],
    sources: Mapping[int, str],
    known_moments: Sequence[Moment] = (),
) -> tuple[tuple[Moment, ...], set[str]]:
    """(the changes inside runs, one a run at the most; names of the runs that could be tested). fit_of: group -> its
    fit; sources: of the runs, by number.

    known_moments: what commands that come again have told; of those runs nothing more is said.
    """
    known_sources = {known_moment.source for known_moment in known_moments}
    runs = [
        _run(robot, points, fit_of, number, source) for number, source in sources.items() if source not in known_sources
    ]
    runs_found = [run for run in runs if run is not None]
    tests = sum(len(run.cuts) for run in runs_found)
    moments = tuple(moment for run in runs_found if (moment := _change_by_shape(run, tests)) is not None)
    return moments, {run.source for run in runs_found}


def _run(robot: Robot, points: ForcePoints, fit_of: Callable[[str], ShapeFit], number: int, source: str) -> _Run | None:
    """None where there are too few windows."""
    run_points = points.chosen(points.run == number)
    if not len(run_points):
        return None
    fit = fit_of(run_points.group[0])
    run_points = all_moving(robot, run_points, fit)
    run_points = run_points.chosen(np.argsort(run_points.span[:, 0], kind="stable"))
    if len(run_points) < 2 * LEAST_PIECES:
        return None
    has_yaw = is_turning(robot, run_points)
    problem = LinearShape(robot, run_points, fit, has_yaw)
    if problem.seen.sum() < problem.sizes.sum() + 1 + SPARE_NUMBERS:
        return None
    base = problem.base[:, :, problem.sizes]
    rivals = [
        extra_columns
        for extra_columns in unoffered_columns(robot, run_points, problem, has_yaw)
        if _determined(np.concatenate([base, extra_columns], axis=2), int(problem.seen.sum()))
    ]
    return _Run(source, fit.shape.name, run_points.span, problem, rivals)


def _determined(design: FloatArray, count: int) -> bool:
    """Whether `count` numbers tell the levels of these columns, and what is left over."""
    norm = np.linalg.norm(design, axis=(0, 1))
    if (norm == 0.0).any() or count - len(norm) < SPARE_NUMBERS:
        return False
    return bool(np.linalg.cond((design / norm).reshape(-1, len(norm))) <= MOST_CONDITION)


def _change_by_shape(run: _Run, tests: int) -> Moment | None:
    step_by_cut = {cut: step for cut in run.cuts if (step := _step(run, cut)) is not None}
    if not step_by_cut:
        return None
    best = max(step_by_cut, key=lambda cut: step_by_cut[cut].size)
    step = step_by_cut[best]
    p = step.chance(tests)
    if p > FALSE_BY_SHAPE or abs(step.value) < FORCE_SHARE:
        return None
    if any(
        (rival_step := _step(run, best, extra_columns)) is None or rival_step.chance(1) > RIVAL_CHANCE
        for extra_columns in run.rivals
    ):
        return None
    near_cuts = [cut for cut in step_by_cut if step_by_cut[cut].size ** 2 > step.size**2 - RIVAL_MARGIN]
    level_before, level_after = _levels(run, best)
    # The shape was fitted to both sides: d is a share of what it has on average.
    share = float(np.linalg.norm(run.problem.force[:, :, 0], axis=1).mean()) / level_before[0]
    spread = t_quantile(step.degrees)
    low = share * min(
        step_by_cut[cut].value - spread * step_by_cut[cut].std for cut in near_cuts
    )  # T is not known any better
    high = share * max(step_by_cut[cut].value + spread * step_by_cut[cut].std for cut in near_cuts)
    return Moment(
        run.source,
        0.5 * float(run.span[best - 1, 1] + run.span[best, 0]),
        (
            float(run.span[min(near_cuts) - 1, 0]),
            float(run.span[max(near_cuts), 1] if max(near_cuts) < len(run.span) else np.inf),
        ),
        *level_before,
        *level_after,
        share * step.value,
        (low, high),
        p,
        run.shape,
    )


def _step(run: _Run, cut: int, extra_columns: FloatArray | None = None) -> _Step | None:
    """The step at a cut, levels fitted anew beside it; extra_columns: columns of a part that is not offered."""
    is_after = (np.arange(len(run.span)) >= cut).astype(float)
    step_fit = _solved(run, run.problem.force * is_after[:, None, None], extra_columns)
    if step_fit is None:
        return None
    level, covariance, degrees = step_fit
    return _Step(float(level[-1]), float(np.sqrt(covariance[-1, -1])), degrees)


def _levels(run: _Run, cut: int) -> list[tuple[float, tuple[float, float]]]:
    """(mean force over the windows [N], its 95 % interval) with the levels before the cut, and after it."""
    problem, levels = run.problem, []
    for side in (np.arange(len(run.span)) < cut, np.arange(len(run.span)) >= cut):
        # The same model with the step on the other side: the levels are then those of this side.
        level_fit = _solved(run, problem.force * (~side)[:, None, None], None)
        assert level_fit is not None
        level, covariance, degrees = level_fit
        base = problem.base[:, :, problem.sizes]
        direction = problem.force[:, :, 0] / np.maximum(np.linalg.norm(problem.force[:, :, 0], axis=1), 1e-300)[:, None]
        row = np.append(np.einsum("nc,nck->k", direction, base) / len(base), 0.0)
        middle = float(row @ level)
        half = t_quantile(degrees) * float(np.sqrt(row @ covariance @ row))
        levels.append((middle, (middle - half, middle + half)))
    return levels


def _solved(run: _Run, step: FloatArray, extra_columns: FloatArray | None) -> tuple[FloatArray, FloatArray, int] | None:
    """(levels, the step's the last, covariance, degrees of freedom) by robust least squares; None: not determined."""
    problem = run.problem
    parts = [problem.base[:, :, problem.sizes], *([] if extra_columns is None else [extra_columns]), step]
    design = np.concatenate(parts, axis=2)
    count = int(problem.seen.sum())
    if not _determined(design, count):
        return None
    norm = np.linalg.norm(design, axis=(0, 1))
    design, degrees = design / norm, count - len(norm)
    weight = np.ones(len(design))
    normal = level = np.zeros(0)
    for _ in range(ROUNDS):
        normal = np.einsum("n,nca,ncb->ab", weight, design, design)
        level = np.linalg.solve(normal, np.einsum("n,nca,nc->a", weight, design, problem.target))
        length = np.linalg.norm(problem.target - design @ level, axis=1)
        scale = float(np.median(length)) / RAYLEIGH
        if scale == 0.0:
            break
        weight = huber_weight(length, HUBER * scale)
    residual = problem.target - design @ level
    variance = float((weight[:, None] * residual**2).sum()) / degrees
    memory = max(autocorrelation_time(residual[:, c]) for c in range(residual.shape[1]))
    covariance = np.linalg.inv(normal) * max(variance, 1e-300) * memory
    return level / norm, covariance / np.outer(norm, norm), degrees
