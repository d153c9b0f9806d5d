"""Breakaway above coulomb: not a smooth number. What the log says of it is between which drives it lies.

What rests holds a drive up to S: an axis, the robot along its direction of travel, a wheel. Between two neighbouring
drives of the log, S changes nothing; where it passes one, a release appears or vanishes, and the likelihood jumps. So S
is profiled over these plateaus: the other numbers fitted anew at each S, the interval is where 2 (F - least F) stays
below 7.35. That is the 95 % quantile for a number at which a model jumps (Hansen, Econometrica 68, 575 (2000), on
thresholds); the 3.84 of chi^2 holds for smooth ones only. Where residuals are not white the likelihood is too steep,
and the limit higher, as for coulomb (`Trust.rise`).

The exact engine looks at every plateau between the drives of the log. Where axes couple, or friction acts elsewhere,
what rests balances a force that changes while it rests, and moves with the other numbers: there a grid of levels is
made ever finer, each fitted by the implicit engine from the nearest that is known (levels.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.friction_laws import coulomb_below, falls
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.level_search import likely_levels
from omnidyn.identification.output_error.trust.levels import Place, trade
from omnidyn.identification.output_error.trust.uncertainty import RISE, SANDWICH, Trust
from omnidyn.model.friction.kinds import KINDS
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, Key, in_words
from omnidyn.model.known.breakaway_levels import slides, slides_least
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent

LIMIT = 7.35 / 2.0
ROUND_LEVELS, ROUND_SHARE = 24, 0.2  # levels tried in a round, and the share of the range that the next one looks at
HIGHEST = 3.0  # S/C is 1.1 to 1.6 in the literature
REFIT = 8  # iterations at each level
UNLIKELY_PLATEAUS = 12  # plateaus without a likely one after which the interval ends
GRID, NEW_LEVELS = 20, 7  # levels that the implicit engine begins with, and once more
RANGE_FACTOR = 1.07  # how far that reaches beyond the first ends
FEW_ITERATIONS, NEAR_PRECISION, TOL = (
    4,
    0.1,
    1e-3,
)  # iterations of it at each; squared standard errors to its best point; [m/s]
LEVEL = 1.0  # of F above the least, within which the middle of the likely levels is as good as the best


@dataclass(frozen=True)
class Breakaway:
    """A level S by its key, and its 95 % interval [N, N m]; it is at least coulomb. is_tied: S = coulomb is as likely.

    moves (P, K): what S being known only so far moves the others by, in the numbers that the solver sees: their
    covariance is moves moves^T; None where that is not looked for.
    """

    name: str
    value: float
    low: float
    high: float
    is_tied: bool
    moves: FloatArray | None = None


def asked_levels(robot: Robot, free: Sequence[str], fixed: Sequence[str] = ()) -> list[str]:
    """The keys of breakaway that are to be profiled: among the free keys and not among the fixed ones."""
    return [name for name in free if is_profiled(name, robot) and name not in fixed]


def is_profiled(name: str, robot: Robot) -> bool:
    """Whether this is a breakaway that no slope tells of."""
    return Key.parse(name).level == BREAKAWAY and not falls(name, robot)


def refuse_level(name: str, robot: Robot, free: Sequence[str]) -> None:
    """Raises InputError for a breakaway of a table whose law has none, or that has no Coulomb friction to be above."""
    key, coulomb_name = Key.parse(name), Key.parse(coulomb_below(name, robot)).name
    law = getattr(robot.friction, key.table.rpartition(".")[2]).law
    if KINDS[law].bends:
        raise InputError(
            "bristles bend before anything breaks away",
            got=f'{name} of law = "{law}"',
            expected="a law that sticks",
            remedy="give the table a stribeck_speed, where its law takes one: then breakaway is fitted",
            where="free",
        )
    if not np.any(slides(robot, key)) and not any(Key.parse(free_name).name == coulomb_name for free_name in free):
        raise InputError(
            "no Coulomb friction that it could be above",
            got=f"{name}, {coulomb_name} is 0",
            expected="a level in that table",
            remedy=f"give {coulomb_name} a first value in the robot file, "
            "or free the breakaway of the table that has one",
            where="free",
        )


class _Profile:
    """Least F at levels of one S, remembered; each from `point`, or `starts_nearest` from the nearest known level.

    ways: the levels, by their keys, that a level of it may stand for: the likeliest of them counts. A place of several
    levels is as good as a level.
    """

    def __init__(
        self,
        solver: Solver,
        ways: Callable[[Any], list[dict[str, float]]],
        point: Point,
        limit: int = REFIT,
        starts_nearest: bool = False,
        progress: Progress = silent,
    ):
        self.solver, self.ways, self.point, self.limit = solver, ways, point, limit
        self.nearest, self.progress = starts_nearest, progress
        self.fits: dict[float | Place, Solution] = {}

    def at(self, level: float | Place) -> Solution:
        """The fit at a level, made once."""
        if level not in self.fits:
            self.progress(Report(f"fit {len(self.fits) + 1}"))
            start = self.point
            if self.nearest and self.fits:
                start = self.fits[min(self.fits, key=lambda known_level: _apart(known_level, level))].state.point
            self.fits[level] = min(
                (self._fit(levels, start) for levels in self.ways(level)), key=lambda fit: fit.state.objective
            )
        return self.fits[level]

    def _fit(self, levels: dict[str, float], start: Point) -> Solution:
        return with_levels(self.solver, levels).minimise(start, self.limit)

    def cost(self, level: float | Place) -> float:
        return self.at(level).state.objective

    def beside(self, levels: dict[str, float], level: float | Place) -> float:
        """F at any other levels, from the fit at one."""
        return self._fit(levels, self.at(level).state.point).state.objective

    def moves(self, values_at_best: FloatArray, steepness: float) -> FloatArray:
        """Distances of the numbers from `values_at_best` at the K levels, by the root of how likely each is. Shape (P,
        K)."""
        levels = np.array(sorted(level for level in self.fits if isinstance(level, float) and level > 0.0))
        if len(levels) < 2:
            return np.zeros((len(values_at_best), 0))
        cost = np.array([self.cost(level) for level in levels])
        share = np.exp(-(cost - cost.min()) / steepness) * np.gradient(np.log(levels))
        values = [self.solver.inner(self.fits[level].state.point.values) for level in levels]
        return np.sqrt(share / share.sum()) * (np.array(values) - self.solver.inner(values_at_best)).T


def _apart(left_place: float | Place, right_place: float | Place) -> float:
    return float(np.abs(np.subtract(left_place, right_place)).sum())


def with_levels(solver: Solver, levels: dict[str, float]) -> Solver:
    """The solver at fixed levels of breakaway, by their keys; 0 follows coulomb."""
    return Solver(solver.problem, solver.engine.with_levels(levels), solver.nu, solver.close)


def levels_of(solution: Solution) -> dict[str, float]:
    """Key -> level of breakaway that was found beside the numbers of a solution [N], about yaw [N m]; none where all
    are those of Coulomb friction."""
    problem, level_by_key = solution.solver.problem, solution.solver.engine.levels
    robot = problem.robot_at(solution.state.point.values)
    levels = {name: (level, slides_least(robot, name)) for name, level in level_by_key.items()}
    is_above = any(level > least_level for level, least_level in levels.values())
    return {name: max(level) for name, level in levels.items()} if is_above else {}


def find_breakaway(
    solution: Solution, names: Sequence[str], uncertainty: Trust, progress: FitProgress | None = None
) -> tuple[Solution, list[Breakaway]]:
    """Profile levels S by their keys, one after the other, twice where there are several: (solution, levels) there.

    Those of one table that hold together, travel along x and y or several wheels, first by what they have in common;
    and at last each with the others anywhere between their ends. uncertainty: how far the solution can be trusted.
    """
    solver, profiles = solution.solver, list[Breakaway]()
    levels = _in_common(solution, names, uncertainty, progress)
    for _ in range(1 if len(names) == 1 else 2):
        profile_by_name, profiles = {profile.name: profile for profile in profiles}, []
        for name in names:
            limit = LIMIT * _steeper(solver, uncertainty, name)
            if solver.engine.exact:
                axis_profile = _one_axis(solver, solution, levels, name, limit)
            else:
                axis_profile = _by_a_grid(solution, levels, name, limit, profile_by_name.get(name), progress)
            levels = levels | {
                name: 0.0 if axis_profile.is_tied and axis_profile.value <= axis_profile.low else axis_profile.value
            }
            solution = with_levels(solver, levels).minimise(solution.state.point)
            profiles.append(axis_profile)
    return solution, _beside_the_others(solution, levels, profiles, uncertainty, progress)


def _in_common(
    solution: Solution, names: Sequence[str], uncertainty: Trust, progress: FitProgress | None
) -> dict[str, float]:
    """Levels that are the same times Coulomb friction in each list that holds together, the likeliest one."""
    levels: dict[str, float] = {}
    for name in names:
        level_names = _together(name, names)
        if len(level_names) > 1 and name == level_names[0]:
            slide = {
                level_name: _coulomb(solution.solver, solution.state.point, level_name) for level_name in level_names
            }
            profile = _by_the_engine(solution, partial(_times, levels, slide), name, progress)
            grid = np.geomspace(1.0, HIGHEST, GRID).tolist()
            best, _, _ = likely_levels(profile.cost, grid, LIMIT * _steeper(solution.solver, uncertainty, name))
            levels = _times(levels, slide, best)[0]
    return levels


def _times(levels: dict[str, float], slide: dict[str, float], factor: float) -> list[dict[str, float]]:
    return [levels | {name: factor * level for name, level in slide.items()}]


def _together(name: str, names: Sequence[str]) -> list[str]:
    """The levels among `names` that hold together with this one: of a body axis none but itself."""
    key = Key.parse(name)
    return [
        level_name
        for level_name in names
        if level_name == name or (key.table != BODY_AXES and Key.parse(level_name).name == key.name)
    ]


def _beside_the_others(
    solution: Solution,
    levels: dict[str, float],
    profiles: Sequence[Breakaway],
    uncertainty: Trust,
    progress: FitProgress | None,
) -> list[Breakaway]:
    """The levels with the intervals that they have whatever the others are that hold together with them."""
    profile_by_name = {profile.name: profile for profile in profiles}
    for level_profile in profiles:
        group = _together(level_profile.name, list(profile_by_name))
        if len(group) > 2 or (len(group) == 2 and level_profile.name == group[0]):
            _traded(
                solution,
                levels,
                [level_profile.name, *(other_name for other_name in group if other_name != level_profile.name)],
                profile_by_name,
                uncertainty,
                progress,
            )
    return list(profile_by_name.values())


def _traded(
    solution: Solution,
    levels: dict[str, float],
    group: Sequence[str],
    profile_by_name: dict[str, Breakaway],
    uncertainty: Trust,
    progress: FitProgress | None,
) -> None:
    """Widen the intervals of a group by how far its first level goes with the others against it, and they with it."""
    coulomb = {name: _coulomb(solution.solver, solution.state.point, name) for name in group}
    if min(coulomb.values()) <= 0.0:  # friction acts elsewhere
        return
    least_levels = {name: max(profile_by_name[name].value, coulomb[name]) for name in group}

    def at(place: Place) -> dict[str, float]:
        return {name: place.s * least_levels[name] * (place.q if name == group[0] else 1.0 / place.q) for name in group}

    def inside(place: Place) -> bool:
        return all(coulomb[name] < level < 2.0 * HIGHEST * coulomb[name] for name, level in at(place).items())

    profile = _by_the_engine(solution, lambda place: [levels | at(place)], group[0], progress)
    limit = LIMIT * max(_steeper(solution.solver, uncertainty, name) for name in group)
    walk = trade(profile.cost, limit, inside)
    lowest = min(map(profile.cost, profile.fits))
    for name in group:
        edge_levels, first_profile = [at(place)[name] for place in walk.edges], profile_by_name[name]
        falls = [place for place in walk.lost_places if at(place)[name] < least_levels[name]]
        slides = any(profile.beside(levels | at(place) | {name: 0.0}, place) <= lowest + limit for place in falls)
        is_tied, low, high = first_profile.is_tied or slides, max(min(edge_levels), coulomb[name]), max(edge_levels)
        high = high if high < HIGHEST * coulomb[name] else np.inf
        profile_by_name[name] = replace(
            first_profile,
            low=0.0 if is_tied else min(low, first_profile.low),
            high=max(high, first_profile.high),
            is_tied=is_tied,
        )


def _by_the_engine(
    solution: Solution, ways: Callable[[Any], list[dict[str, float]]], name: str, progress: FitProgress | None
) -> _Profile:
    """A profile by the implicit engine, at a tolerance that is enough to tell levels apart."""
    engine_solver, listener = solution.solver, progress or silent
    solver = Solver(
        engine_solver.problem, engine_solver.engine.of(engine_solver.problem, TOL), engine_solver.nu, NEAR_PRECISION
    )

    def listen(report: Report) -> None:
        listener(report._replace(phase=f"{in_words(name)}, {report.phase}"))

    return _Profile(solver, ways, solution.state.point, FEW_ITERATIONS, True, listen)


def _steeper(solver: Solver, uncertainty: Trust, name: str) -> float:
    """What the likelihood is too steep by where residuals are not white, as for coulomb; 1 where they are."""
    key = coulomb_below(name, solver.problem.robot)
    if key in solver.problem.names and not uncertainty.blind_parameters[j := solver.problem.names.index(key)]:
        return uncertainty.rise(np.eye(len(uncertainty.std))[j]) / RISE
    return uncertainty.widening**2 if uncertainty.kind == SANDWICH else 1.0


def _one_axis(solver: Solver, solution: Solution, levels: dict[str, float], name: str, limit: float) -> Breakaway:
    """The plateau of the least F, and the likely ones around it."""
    point = solution.state.point
    coulomb = _coulomb(solver, point, name)
    edges = _edges(solver, point, Key.parse(name).axis or 0, 0.5 * coulomb)
    profile = _Profile(solver, lambda level: [levels | {name: level}], point)
    if len(edges) < 2:
        return Breakaway(name, coulomb, coulomb, np.inf, True)
    middles = 0.5 * (edges[1:] + edges[:-1])
    best, reach = _search(profile, middles)
    profile.point = profile.at(middles[best]).state.point
    profile.fits.clear()
    best = _descend(profile, middles, best, reach)
    least_cost = min(profile.cost(middles[best]), profile.cost(0.0))
    low, high = (_walk(profile, middles, best, side, least_cost + limit) for side in (-1, 1))
    coulomb_level = _coulomb(solver, profile.at(middles[best]).state.point, name)
    is_tied = profile.cost(0.0) <= least_cost + limit
    floor = _coulomb(solver, profile.at(0.0).state.point, name)
    if profile.cost(0.0) <= profile.cost(middles[best]):
        return Breakaway(name, floor, 0.0, max(float(edges[high + 1]), floor), True)
    return Breakaway(
        name,
        max(float(middles[best]), coulomb_level),
        0.0 if is_tied else max(float(edges[low]), 0.0),
        float(edges[high + 1]),
        is_tied,
    )


def _by_a_grid(
    solution: Solution,
    levels: dict[str, float],
    name: str,
    limit: float,
    profile_before: Breakaway | None,
    progress: FitProgress | None,
) -> Breakaway:
    """The likely levels by the implicit engine. profile_before: what was found with other levels of the others."""
    solver, point = solution.solver, solution.state.point
    profile = _by_the_engine(solution, lambda level: [levels | {name: level}], name, progress)
    coulomb = _coulomb(solver, point, name)
    if coulomb <= 0.0:  # friction acts elsewhere
        return Breakaway(name, 0.0, 0.0, np.inf, True)
    lowest_level, highest_level, count = coulomb, HIGHEST * coulomb, GRID
    if profile_before is not None and np.isfinite(profile_before.high):
        lowest_level, highest_level, count = (
            max(profile_before.low / RANGE_FACTOR, coulomb),
            RANGE_FACTOR * profile_before.high,
            NEW_LEVELS,
        )
    grid = np.geomspace(lowest_level, max(highest_level, RANGE_FACTOR * lowest_level), count).tolist()
    best, low, high = likely_levels(profile.cost, grid, limit)
    middle = float(np.sqrt(low * high)) if np.isfinite(high) else best
    value = middle if profile.cost(middle) <= profile.cost(best) + LEVEL else best
    coulomb_here = _coulomb(solver, profile.at(value).state.point, name)
    level = min(profile.cost(value), profile.cost(best))
    is_tied = profile.cost(0.0) <= level + limit
    if profile.cost(0.0) <= level or (is_tied and high == np.inf):
        value, coulomb_here, low = 0.0, _coulomb(solver, profile.at(0.0).state.point, name), 0.0
    moves = profile.moves(profile.at(value).state.point.values, limit / LIMIT)
    return Breakaway(name, max(value, coulomb_here), 0.0 if is_tied else low, max(high, coulomb_here), is_tied, moves)


def _coulomb(solver: Solver, point: Point, name: str) -> float:
    return slides_least(solver.problem.robot_at(point.values), name)


def _edges(solver: Solver, point: Point, axis: int, lowest: float) -> FloatArray:
    """Drives of the log at which S may matter, increasing: from `lowest` to HIGHEST times twice that, and the next one,
    where the last plateau below that ends."""
    drives = np.concatenate([np.abs(drive[:, axis]) for drive in solver.engine.drives(point)])
    all_drives = np.unique(np.round(drives[drives >= lowest], 12)).astype(float)
    return all_drives[: np.searchsorted(all_drives, 2.0 * HIGHEST * lowest, side="right") + 1]


def _search(profile: _Profile, middles: FloatArray) -> tuple[int, int]:
    """Index of the best plateau, by ever finer rounds; and half the width of the last round."""
    low, high = 0, len(middles) - 1
    while True:
        trial_indices = np.unique(np.linspace(low, high, ROUND_LEVELS).round().astype(int))
        costs = [profile.cost(float(middles[k])) for k in trial_indices]
        best = int(trial_indices[int(np.argmin(costs))])
        if len(trial_indices) == high - low + 1:
            return best, max(high - low, 1)
        half = max(int(ROUND_SHARE * (high - low) / 2.0), ROUND_LEVELS // 2 - 1)
        low, high = max(best - half, 0), min(best + half, len(middles) - 1)
        if high - low >= len(trial_indices) * 4 and half == 0:
            return best, 1


def _descend(profile: _Profile, middles: FloatArray, best: int, reach: int) -> int:
    """The best plateau near `best`, the other numbers now fitted from there."""
    near_indices = range(
        max(best - min(reach, UNLIKELY_PLATEAUS), 0), min(best + min(reach, UNLIKELY_PLATEAUS), len(middles) - 1) + 1
    )
    return min(near_indices, key=lambda k: profile.cost(float(middles[k])))


def _walk(profile: _Profile, middles: FloatArray, best: int, side: int, limit: float) -> int:
    """Index of the last likely plateau from `best` in one direction."""
    last, k, unlikely_count = best, best, 0
    while 0 <= k + side < len(middles) and unlikely_count < UNLIKELY_PLATEAUS:
        k += side
        if profile.cost(float(middles[k])) <= limit:
            last, unlikely_count = k, 0
        else:
            unlikely_count += 1
    return last
