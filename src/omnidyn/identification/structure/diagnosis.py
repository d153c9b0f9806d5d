"""All that is asked of a fit beyond its numbers, once: misfit, remedies, what the numbers rest on, and whether they are
the same throughout the logs."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import small_matrices
from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit, Remedy
from omnidyn.identification.output_error.linear.motion import motions
from omnidyn.identification.output_error.linear.rows import Linear, Rows, solved
from omnidyn.identification.output_error.linear.sensitivity import effects, with_rounding
from omnidyn.identification.output_error.linear.workbench import Workbench, scaled
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.decimated import Decimated
from omnidyn.identification.output_error.problem.friction_laws import bending_keys, falls
from omnidyn.identification.output_error.problem.problem import Parts, Point, Problem, bounded
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.breakaway import levels_of
from omnidyn.identification.structure.misfit import FALSE, Misfit, chance, memory_beside, misfit, with_cause
from omnidyn.identification.structure.missing.candidates import Candidate, Trial, unoffered
from omnidyn.identification.structure.missing.laws import candidates
from omnidyn.identification.structure.missing.refits import refits
from omnidyn.identification.structure.missing.remedies import remedies, with_odometry
from omnidyn.identification.structure.noise_level import binned, noise_levels
from omnidyn.identification.structure.shifts import stability
from omnidyn.identification.structure.tails import as_counted, calmer, wild_samples
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, CENTRE, DIRECTION, EMF, TORQUE, WHEELS, Key, expand
from omnidyn.model.known.told import holding

SURE = 2.0  # degrees of freedom with which the power of the slowest errors is known within its own size
SHOWN = 400  # columns: about what themes and candidates show


@dataclass(frozen=True, eq=False)
class Examined:
    """A diagnosis, and what it was made with. memory: of each column, of what is left beside all that residuals follow;
    tried: how many causes were looked at; rows: how many numbers of the logs."""

    diagnosis: Diagnosis
    memory: Sequence[AutoRegression]
    tried: int
    rows: int


def diagnose(solution: Solution) -> Diagnosis:
    """What is wrong with a fit at its best point."""
    return examine(solution).diagnosis


@small_matrices()
def examine(solution: Solution) -> Examined:
    """The diagnosis of a fit at its best point, and what it was made with.

    A cause that is clear by itself is found where its chance, times their number, is below FALSE (Bonferroni). Sizes,
    and causes that are alike, make that no stricter: of 39 causes at 86 sizes noise passes the best as often as of 35
    to 60 that have nothing in common, by draws from their scalar products.
    """
    solver, point = solution.solver, solution.state.point
    whole = with_levels(solver.problem, point, levels_of(solution))
    few = Decimated.of(whole)
    problem = bounded(few.problem, SHOWN, effects(few.problem))
    engine = solver.engine.on(few.all_rows(problem))
    parts = few.kept(engine.residuals(point))
    moved = motions(problem, point)
    rows = with_rounding(Rows.of(problem, point, as_counted(solution, problem, parts)), moved)
    seen = misfit(rows, moved)
    stable = stability(seen.linear)
    bench = Workbench(problem, point, type(engine), moved, stable.likely)
    every = [*candidates(bench), *unoffered(bench)]
    tried = _tried(bench, [one for one in every if not one.late])
    ranked = remedies(seen.linear, tried, seen.shown)
    count = int(sum(there.sum() for there in rows.there))
    found = bool(seen.found) or any(_chance(seen.linear, tried, r) * len(tried) < FALSE for r in ranked)
    if found:
        tried += _tried(bench, [one for one in every if one.late])
        ranked = remedies(seen.linear, tried, seen.shown)
    told, cause = _fitted(solution, problem, parts, seen, tried, ranked) if found else ((), None)
    memory = memory_beside(rows, cause) if cause and not seen.found else seen.linear.memory
    seen = with_cause(seen, cause) if cause else seen
    names = [f"{name}[{i}]" for name, i in problem.columns]
    levels = noise_levels(seen.linear, moved, solver.nu > 0.0)
    found = found or bool(levels.beyond)
    channels = levels.channels(dict(zip(names, seen.shares.tolist(), strict=True)))
    wild = {} if solver.nu else wild_samples(seen, moved)
    pictures = binned(rows, moved, int(np.argmax([*channels.values()]))) if found else ()
    lack = LackOfFit(
        found,
        channels,
        _sizes(rows, channels),
        seen.found,
        (*told, *calmer(seen, wild)),
        seen.tested,
        pictures,
        wild,
        levels.noise,
        levels.beyond,
        levels.at_rest,
        dict(zip(names, seen.rounded.tolist(), strict=True)) if rows.rounding else {},
        seen.linear.degrees < SURE,
    )
    diagnosis = Diagnosis(lack, rests_on(seen.linear.plain, bench), stable)
    return Examined(diagnosis, memory, len(tried), count)


def _tried(bench: Workbench, every: Sequence[Candidate]) -> list[tuple[Candidate, list[Trial]]]:
    """Candidates that can be simulated, with their trials."""
    tried = [(one, one.tried(bench)) for one in every]
    return [each for each in tried if each[1]]


def _chance(linear: Linear, tried: Sequence[tuple[Candidate, list[Trial]]], best: Remedy) -> float:
    """The chance that noise alone lets a remedy explain as much, by how well it is known along what that shows."""
    shown = [trial.shown for one, trials in tried if one.key == best.key for trial in trials if trial.at == best.at]
    return min(chance(linear, own) for own in shown)


def _fitted(
    solution: Solution,
    problem: Problem,
    parts: Sequence[Parts],
    seen: Misfit,
    tried: Sequence[tuple[Candidate, list[Trial]]],
    ranked: Sequence[Remedy],
) -> tuple[tuple[Remedy, ...], list[FloatArray] | None]:
    """(the remedies, the best of them and other shapes as fits find them; what the first shows of each piece).

    A size stays that of the first step; so does all, where the numbers that a fit needs cost more than it explains.
    """
    near = {one.key: one for one in ranked}
    anew = refits(solution, problem, parts, ranked, [one for one, _ in tried])
    tried = [anew.get(one.key, (one, trials)) for one, trials in tried]
    again = remedies(seen.linear, tried, seen.shown) or ranked
    shown = [
        trial.shown
        for one, trials in tried
        for trial in trials
        if again and one.key == again[0].key and (trial.fitted or trial.at == again[0].at)
    ]
    told = tuple(_with_first_step(one, near[one.key], anew) if one.key in near else one for one in again)
    return with_odometry(told, problem.columns), shown[0] if shown else None


def _with_first_step(again: Remedy, near: Remedy, fitted: Container[str]) -> Remedy:
    """A remedy with what its first step says of it: its size, and what is the same, of which not both were fitted."""
    if again.key in fitted:  # a fit makes more of it, but not of its rivals, of which there are columns only
        again = replace(again, size=near.size, at=near.at, share=min(again.share, near.share))
    same = [key for key in near.same_as if not (key in fitted and again.key in fitted)]
    return replace(again, same_as=tuple(dict.fromkeys((*again.same_as, *same))))


def with_levels(problem: Problem, point: Point, levels: dict[str, float]) -> Problem:
    """The problem of a robot with the levels of breakaway that were found beside its numbers; what else stands in their
    lists is the Coulomb friction of the point, not that from which the fit began."""
    return replace(problem, robot=holding(problem.robot_at(point.values), levels)) if levels else problem


def _sizes(rows: Rows, channels: Mapping[str, float]) -> dict[str, float]:
    """How large a share of the residual of each column is, root mean square."""
    mean = rows.squares(rows.residual) / np.maximum(rows.added(lambda k, j: rows.there[k][j]), 1.0)
    return dict(zip(channels, np.sqrt(np.array([*channels.values()]) * mean).tolist(), strict=True))


# What each fitted number rests on: how far it would move if a number that was taken as it stands were another one

PERCENT = 0.01
TRIED = 0.01  # relative change of a fixed number, either way is alike
FIXED = (
    "body.mass_kg",
    "body.inertia_kg_m2",
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
    "motor.resistance_ohm",
    TORQUE,
    EMF,
    "motor.gear_ratio",
    "motor.rotor_inertia_kg_m2",
    "wheels.inertia_kg_m2",
    "motor.voltage_drop_V",
    "motor.current_limit_A",
    "wheels.traction_mu",
    f"{CENTRE}[0]",
    f"{CENTRE}[1]",
)

LEVELS = (f"{BODY_AXES}.breakaway", f"{DIRECTION}.breakaway", f"{DIRECTION}.yaw_breakaway", f"{WHEELS}.breakaway")
TRIED_FALL = 1e-3  # the same of a level at which things break away: a larger change may move that to another row


def rests_on(linear: Linear, bench: Workbench) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key, gravest first.

    To first order: what the change shows in the log, as the parameters of the fit would make up for it.
    """
    _, j = linear.whole()
    problem = bench.problem
    values = bench.point.values
    found: dict[str, dict[str, float]] = {p.name: {} for p in problem.robot_parameters}
    taken = {Key.parse(p.name).name for p in problem.robot_parameters}
    fixed = [(name, TRIED) for name in FIXED if Key.parse(name).name not in taken]
    for name, tried in [*fixed, *((name, TRIED_FALL) for name in _of_laws(bench))]:
        robot = scaled(bench.robot, name, 1.0 + tried)
        if robot is None:
            continue
        try:
            shown = bench.change(robot)
        except OmnidynError:
            continue
        if not any(own.any() for own in shown):
            continue  # of an axis that never moved
        step = solved(j, -linear.white(shown)[:, 0]) / tried * PERCENT
        for p, value, change in zip(problem.robot_parameters, values, step, strict=False):
            share = change if p.log else change / value if value else np.nan
            if np.isfinite(share):
                found[p.name][name] = float(share)
    return {name: dict(sorted(by.items(), key=lambda item: -abs(item[1]))) for name, by in found.items()}


def _of_laws(bench: Workbench) -> list[str]:
    """What a law that falls with the speed, or bends, has beside Coulomb friction, and the fit takes as it stands."""
    robot, free = bench.robot, bench.problem.names
    levels = [key for name in LEVELS for key in expand(name, robot) if falls(key, robot)]
    speeds = [key.replace(BREAKAWAY, "stribeck_speed").removesuffix("_backward") for key in levels]
    bends = [key for name in bending_keys(robot) for key in expand(name, robot)]
    return [key for key in dict.fromkeys((*levels, *speeds, *bends)) if key not in free]
