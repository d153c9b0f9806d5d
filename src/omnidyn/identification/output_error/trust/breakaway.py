"""Breakaway above coulomb: not a smooth number. What the log says of it is between which drives it lies.

An axis at rest holds a drive up to S. Between two neighbouring drives of the log, S changes nothing; where it passes
one, a release appears or vanishes, and the likelihood jumps. So S is profiled over these plateaus: the other numbers
fitted anew at each S, the interval is where 2 (F - least F) stays below 7.35. That is the 95 % quantile for a number at
which a model jumps (Hansen, Econometrica 68, 575 (2000), on thresholds); the 3.84 of chi^2 holds for smooth ones only.
Where residuals are not white the likelihood is too steep, and the limit higher, as for coulomb (`Trust.rise`).

The exact engine looks at every plateau between the drives of the log. In a robot whose axes couple, what an axis at
rest balances changes while it rests, and moves with the other numbers: there a grid of levels is made ever finer, each
fitted by the implicit engine from the nearest that is known (likely_levels.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.problem.falling import falls
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.progress import Progress
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.likely_levels import likely_levels
from omnidyn.identification.output_error.trust.uncertainty import RISE, SANDWICH, Trust
from omnidyn.model.frames import AXES
from omnidyn.model.keys import Key
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot

KEY = "friction.axes.breakaway"
LIMIT = 7.35 / 2.0
COARSE, NARROWER = 24, 0.2  # levels tried in a round, and the share of the range that the next one looks at
HIGHEST = 3.0  # S/C is 1.1 to 1.6 in the literature
REFIT = 8  # iterations at each level
FAR = 12  # plateaus without a likely one after which the interval ends
GRID, ANEW = 20, 7  # levels that the implicit engine begins with, and once more
WIDER = 1.07  # how far that reaches beyond the first ends
FEW, NEAR, TOL = 4, 0.1, 1e-3  # iterations of it at each; squared standard errors to its best point; [m/s]
LEVEL = 1.0  # of F above the least, within which the middle of the likely levels is as good as the best


@dataclass(frozen=True)
class Breakaway:
    """One axis: level S and its 95 % interval [N, N m]; it is at least coulomb. tied: S = coulomb is as likely.

    moves (P, K): what S being known only so far moves the others by, in the numbers that the solver sees: their
    covariance is moves moves^T; None where that is not looked for.
    """

    axis: int
    value: float
    low: float
    high: float
    tied: bool
    moves: FloatArray | None = None


def asked_axes(robot: Robot, free: Sequence[str], fixed: Sequence[str] = ()) -> list[int]:
    """The axes whose breakaway is to be profiled: among the free keys and not among the fixed ones."""
    names = [f"{KEY}[{axis}]" for axis in range(3)]
    return [k for k, name in enumerate(names) if name in free and name not in fixed and is_profiled(name, robot)]


def is_profiled(name: str, robot: Robot) -> bool:
    """Whether this is a breakaway of the body axes that no slope tells of."""
    return Key.parse(name).name == KEY and not falls(name, robot)


class _Profile:
    """Least F at levels of S of one axis, remembered; each from `point`, or `nearest` from the nearest known level."""

    def __init__(
        self, solver: Solver, levels: FloatArray, axis: int, point: Point, limit: int = REFIT, nearest: bool = False,
        progress: Progress | None = None,
    ):  # fmt: skip
        self.solver, self.levels, self.axis, self.point, self.limit = solver, levels, axis, point, limit
        self.nearest, self.progress = nearest, progress or Progress()
        self.known: dict[float, Solution] = {}

    def at(self, level: float) -> Solution:
        if level not in self.known:
            self.progress.doing(f"how much {AXES[self.axis]} holds, fit {len(self.known) + 1}")
            start = self.point
            if self.nearest and self.known:
                start = self.known[min(self.known, key=lambda own: abs(own - level))].state.point
            self.known[level] = with_breakaway(self.solver, self._with(level)).minimise(start, self.limit)
        return self.known[level]

    def cost(self, level: float) -> float:
        return self.at(level).state.objective

    def moves(self, at: FloatArray, steep: float) -> FloatArray:
        """Distances of the numbers from `at` at the K levels, by the root of how likely each is. Shape (P, K)."""
        levels = np.array(sorted(level for level in self.known if level > 0.0))
        if len(levels) < 2:
            return np.zeros((len(at), 0))
        cost = np.array([self.cost(level) for level in levels])
        share = np.exp(-(cost - cost.min()) / steep) * np.gradient(np.log(levels))
        values = [self.solver.inner(self.known[level].state.point.values) for level in levels]
        return np.sqrt(share / share.sum()) * (np.array(values) - self.solver.inner(at)).T

    def _with(self, level: float) -> FloatArray:
        levels = self.levels.copy()
        levels[self.axis] = level
        return levels


def with_breakaway(solver: Solver, levels: FloatArray) -> Solver:
    """The solver at fixed levels of breakaway, shape (3,), NaN where S follows coulomb."""
    assert isinstance(solver.engine, (ExactEngine, ImplicitEngine))
    return Solver(solver.problem, solver.engine.with_breakaway(levels), solver.nu, solver.close)


def levels_of(solution: Solution) -> list[float] | None:
    """The levels of breakaway of a solution [N, N, N m]; None where all follow coulomb."""
    problem, engine = solution.solver.problem, solution.solver.engine
    axes = problem.robot_at(solution.state.point.values).friction.axes
    found = getattr(engine, "breakaway", None)
    if found is None:
        return None if axes.breakaway is None else list(axes.breakaway)
    if np.isnan(found).all():
        return None
    return np.where(np.isnan(found), axes.coulomb, found).tolist()


def find_breakaway(
    solution: Solution, axes: list[int], known: Trust, progress: Progress | None = None
) -> tuple[Solution, list[Breakaway]]:
    """Profile S of the axes, one after the other, twice where there are several: (solution, levels) there.

    known: how far the solution can be trusted.
    """
    solver, found = solution.solver, []
    exact = solver.engine if isinstance(solver.engine, ExactEngine) else None
    levels = exact.breakaway.copy() if exact else np.array(levels_of(solution) or [np.nan] * N_AXES)
    for _ in range(1 if len(axes) == 1 else 2):
        before, found = {one.axis: one for one in found}, []
        for axis in axes:
            limit = LIMIT * _steeper(solver, known, axis)
            if exact:
                one = _one_axis(solver, solution, levels, axis, limit)
            else:
                one = _by_a_grid(solution, levels, axis, limit, before.get(axis), progress)
            levels[axis] = np.nan if one.tied and one.value <= one.low else one.value
            solution = with_breakaway(solver, levels).minimise(solution.state.point)
            found.append(one)
    return solution, found


def _steeper(solver: Solver, known: Trust, axis: int) -> float:
    """What the likelihood is too steep by where residuals are not white, as for coulomb; 1 where they are."""
    key = f"friction.axes.coulomb[{axis}]"
    if key in solver.problem.names and not known.blind[j := solver.problem.names.index(key)]:
        return known.rise(np.eye(len(known.std))[j]) / RISE
    return known.widening**2 if known.kind == SANDWICH else 1.0


def _one_axis(solver: Solver, solution: Solution, levels: FloatArray, axis: int, limit: float) -> Breakaway:
    """The plateau of the least F, and the likely ones around it."""
    point = solution.state.point
    coulomb = _coulomb(solver, point, axis)
    edges = _edges(solver, point, axis, 0.5 * coulomb)
    profile = _Profile(solver, levels, axis, point)
    if len(edges) < 2:
        return Breakaway(axis, coulomb, coulomb, np.inf, True)
    middles = 0.5 * (edges[1:] + edges[:-1])
    best, reach = _search(profile, middles)
    profile.point = profile.at(middles[best]).state.point
    profile.known.clear()
    best = _descend(profile, middles, best, reach)
    least = min(profile.cost(middles[best]), profile.cost(0.0))
    low, high = (_walk(profile, middles, best, way, least + limit) for way in (-1, 1))
    own = _coulomb(solver, profile.at(middles[best]).state.point, axis)
    tied = profile.cost(0.0) <= least + limit
    floor = _coulomb(solver, profile.at(0.0).state.point, axis)
    if profile.cost(0.0) <= profile.cost(middles[best]):
        return Breakaway(axis, floor, 0.0, max(float(edges[high + 1]), floor), True)
    return Breakaway(
        axis, max(float(middles[best]), own), 0.0 if tied else max(float(edges[low]), 0.0), float(edges[high + 1]), tied
    )


def _by_a_grid(
    solution: Solution, levels: FloatArray, axis: int, limit: float, before: Breakaway | None,
    progress: Progress | None,
) -> Breakaway:  # fmt: skip
    """The likely levels by the implicit engine. before: what was found with other levels of the other axes."""
    own, engine, point = solution.solver, solution.solver.engine, solution.state.point
    assert isinstance(engine, ImplicitEngine)
    solver = Solver(own.problem, type(engine)(own.problem, TOL), own.nu, NEAR)
    profile = _Profile(solver, levels, axis, point, FEW, True, progress)
    coulomb = _coulomb(own, point, axis)
    if coulomb <= 0.0:  # friction acts elsewhere
        return Breakaway(axis, 0.0, 0.0, np.inf, True)
    least, most, count = coulomb, HIGHEST * coulomb, GRID
    if before is not None and np.isfinite(before.high):
        least, most, count = max(before.low / WIDER, coulomb), WIDER * before.high, ANEW
    grid = np.geomspace(least, max(most, WIDER * least), count).tolist()
    best, low, high = likely_levels(profile.cost, grid, limit)
    middle = float(np.sqrt(low * high)) if np.isfinite(high) else best
    value = middle if profile.cost(middle) <= profile.cost(best) + LEVEL else best
    slides = _coulomb(own, profile.at(value).state.point, axis)
    level = min(profile.cost(value), profile.cost(best))
    tied = profile.cost(0.0) <= level + limit
    if profile.cost(0.0) <= level or (tied and high == np.inf):
        value, slides, low = 0.0, _coulomb(own, profile.at(0.0).state.point, axis), 0.0
    moves = profile.moves(profile.at(value).state.point.values, limit / LIMIT)
    return Breakaway(axis, max(value, slides), 0.0 if tied else low, max(high, slides), tied, moves)


def _coulomb(solver: Solver, point: Point, axis: int) -> float:
    return float(solver.problem.robot_at(point.values).friction.axes.coulomb[axis])


def _edges(solver: Solver, point: Point, axis: int, lowest: float) -> FloatArray:
    """Drives of the log at which S may matter, increasing: from `lowest` to HIGHEST times twice that, and the next one,
    where the last plateau below that ends."""
    assert isinstance(solver.engine, ExactEngine)
    drives = np.concatenate([np.abs(drive[:, axis]) for drive in solver.engine.drives(point)])
    every = np.unique(np.round(drives[drives >= lowest], 12)).astype(float)
    return every[: np.searchsorted(every, 2.0 * HIGHEST * lowest, side="right") + 1]


def _search(profile: _Profile, middles: FloatArray) -> tuple[int, int]:
    """Index of the best plateau, by ever finer rounds; and half the width of the last round."""
    low, high = 0, len(middles) - 1
    while True:
        tried = np.unique(np.linspace(low, high, COARSE).round().astype(int))
        costs = [profile.cost(float(middles[k])) for k in tried]
        best = int(tried[int(np.argmin(costs))])
        if len(tried) == high - low + 1:
            return best, max(high - low, 1)
        half = max(int(NARROWER * (high - low) / 2.0), COARSE // 2 - 1)
        low, high = max(best - half, 0), min(best + half, len(middles) - 1)
        if high - low >= len(tried) * 4 and half == 0:
            return best, 1


def _descend(profile: _Profile, middles: FloatArray, best: int, reach: int) -> int:
    """The best plateau near `best`, the other numbers now fitted from there."""
    near = range(max(best - min(reach, FAR), 0), min(best + min(reach, FAR), len(middles) - 1) + 1)
    return min(near, key=lambda k: profile.cost(float(middles[k])))


def _walk(profile: _Profile, middles: FloatArray, best: int, way: int, limit: float) -> int:
    """Index of the last likely plateau from `best` in one direction."""
    last, k, unlikely = best, best, 0
    while 0 <= k + way < len(middles) and unlikely < FAR:
        k += way
        if profile.cost(float(middles[k])) <= limit:
            last, unlikely = k, 0
        else:
            unlikely += 1
    return last
