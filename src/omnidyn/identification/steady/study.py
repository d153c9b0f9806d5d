"""Steady-state identification from logs: the force over direction and speed, the shape of friction, groups compared.

points   one per run and command, at constant speed (operating_points.py)
shape    the one with the least error on directions it has not seen (choice.py)
levels   of each group, with 95 % intervals; what differs between groups, and what does not
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.force_scale import scale_of_traction
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.stability import Stability
from omnidyn.identification.steady.choice import ShapeChoice, base_name, choose_shape, speeds_differ
from omnidyn.identification.steady.group_numbers import Difference, Travel, Viscous
from omnidyn.identification.steady.lack_of_fit import lack_of_fit
from omnidyn.identification.steady.levels import estimate_of
from omnidyn.identification.steady.moment import Moment, levelled, moments
from omnidyn.identification.steady.moment_by_shape import moments_by_shape
from omnidyn.identification.steady.operating_points import CURRENT, VOLTAGE, ForcePoints, SteadyWindows, steady_windows
from omnidyn.identification.steady.paper_lines import steady_table
from omnidyn.identification.steady.sensitivity_to_fixed import moved_by_the_file, rests_on
from omnidyn.identification.steady.shapes import SHAPES, VISCOUS, ShapeFit, fit_shape, friction_of, is_turning
from omnidyn.identification.steady.study_statements import (
    advice,
    fit_statements,
    lack_statements,
    point_statements,
    result_statements,
)
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.friction import Friction
from omnidyn.model.keys import BODY_AXES, DIRECTION, EMF, TORQUE, WHEELS, Key, find_key
from omnidyn.model.keys import VISCOUS as VISCOUS_LEVEL
from omnidyn.model.layout import YAW
from omnidyn.model.robot import GUESSES, Robot
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement, statements
from omnidyn.statistics import t_quantile

LASTING = Stability({}, ())  # whether levels last, `moments` says


@dataclass(frozen=True, eq=False)
class SteadyFit:
    """The levels of friction before their diagnosis. parts: group -> its points; refit_by_group: group -> its levels
    were the robot another one. The rest as in SteadyStudy."""

    runs: Sequence[Run]
    robot: Robot
    method: SteadyState
    windows: SteadyWindows
    points: ForcePoints
    choice: ShapeChoice
    parts: Mapping[str, ForcePoints]
    refit_by_group: Mapping[str, Callable[[Robot], dict[str, float]]]
    estimates: Mapping[str, Estimate]


def fit_steady(
    runs: Sequence[Run], robot: Robot, method: SteadyState, groups: Sequence[str] | None = None
) -> SteadyFit:
    """The levels of friction of each group, from the steady windows of runs.

    groups: name of each run's group (a floor, a load); every group has its own levels of one shape, and where its
    points tell another shape from that one, a shape of its own.
    The friction of `robot` is replaced; its motor and wheels are taken as they are.
    Raises InsufficientDataError when nothing is steady, nothing moves, or no shape is determined; InputError for a run
    without the channels needed.
    """
    windows = steady_windows(
        runs, robot, groups=groups, speed=method.speed, force_from=method.force_from, window=method.window
    )
    points = windows.points(robot)
    try:
        choice = choose_shape(robot, points, shape=method.shape, robust=method.robust)
    except InsufficientDataError as error:  # one long drive: what changes in it needs no shape
        changes, _ = moments(runs, robot, points.force_from, method.window)
        numbers = {"changes": tuple(moment.short() for moment in changes)}
        words = f"{error.what}; {Statement('force_changes_in_run', numbers=numbers)}" if changes else error.what
        raise InsufficientDataError(
            words, got=error.got, expected=error.expected, remedy=error.remedy, where=error.where
        ) from error
    if not SHAPES[choice.chosen].in_model:
        raise InsufficientDataError(
            "a robot file cannot hold this shape: it is for comparison only",
            got=choice.chosen,
            expected=", ".join(name for name, shape in SHAPES.items() if shape.in_model),
            where="shape",
        )
    parts = {group: points.of(group) for group in points.groups}
    refit_by_group = {group: partial(_levels, windows, choice.of(group), group, method.robust) for group in parts}
    estimates = {
        group: _estimate(robot, part, choice, group, method.robust, refit_by_group[group])
        for group, part in parts.items()
    }
    return SteadyFit(runs, robot, method, windows, points, choice, parts, refit_by_group, estimates)


def undiagnosed(fit: SteadyFit) -> SteadyStudy:
    """The study of a fit of which nothing is asked beyond its numbers."""
    return _study(fit, (), {}, set())


def diagnosed(fit: SteadyFit) -> SteadyStudy:
    """The study of a fit: what its shape leaves out, what changes inside a run, and what its levels rest on."""
    points, choice, robot = fit.points, fit.choice, fit.robot
    changes, tested_runs = moments(fit.runs, robot, points.force_from, fit.method.window)
    sources = {number: run.source for number, run, _ in fit.windows.found}
    by_shape, tested_by_shape = moments_by_shape(robot, points, choice.fit, sources, changes)
    changes += by_shape
    untested_runs = tuple(name for name in sources.values() if name not in tested_runs | tested_by_shape)
    lack = {
        group: _lack(robot, part, choice, group, changes, sources, fit.method.robust)
        for group, part in fit.parts.items()
    }
    changed_groups = {group for group, part in fit.parts.items() if _changed(part, changes, sources)}
    diagnosis_by_group = {
        group: Diagnosis(lack[group], rests_on(robot, estimate.value, fit.refit_by_group[group]), LASTING)
        for group, estimate in fit.estimates.items()
    }  # whether the levels last, `moments` says
    estimates = {
        group: replace(estimate, study=partial(diagnosis_by_group.__getitem__, group))
        for group, estimate in fit.estimates.items()
    }
    return _study(replace(fit, estimates=estimates), changes, lack, changed_groups, untested_runs)


def _study(
    fit: SteadyFit,
    changes: Sequence[Moment],
    lack: Mapping[str, LackOfFit],
    changed_groups: Collection[str],
    untested_runs: tuple[str, ...] = (),
) -> SteadyStudy:
    """The study.

    Args:
        fit: the levels.
        changes: changes inside a run.
        lack: group -> what its shape leaves out.
        changed_groups: groups with a change inside a run.
        untested_runs: runs that could not be tested for one.
    """
    robot, points, choice, robust = fit.robot, fit.points, fit.choice, fit.method.robust
    travel = {group: _travel(part) for group, part in fit.parts.items()}
    viscous = {
        group: _viscous(robot, fit.windows, choice, group, part, travel[group], robust)
        for group, part in fit.parts.items()
    }
    differences = _differences(choice)
    internal = {}
    if robot.wheels.count > 3:  # the part of the traction that pushes nowhere: G f = 0
        from scipy.linalg import null_space  # slow to import, and most robots have three wheels

        internal_forces = {
            group: part.traction @ null_space(robot.wheels.wrench_matrix) for group, part in fit.parts.items()
        }
        internal = {group: float(np.sqrt(np.mean((f**2).sum(axis=1)))) for group, f in internal_forces.items()}
    has_yaw = any(is_turning(robot, part) for part in fit.parts.values())
    return SteadyStudy(
        robot=robot,
        points=points,
        choice=choice,
        estimates=fit.estimates,
        travel=travel,
        viscous=viscous,
        differences=differences,
        internal=internal,
        lack_of_fit=lack,
        statements=statements(
            (
                *result_statements(choice, viscous, differences, internal, lack, changed_groups),
                scale_of_traction(robot, points.force_from == CURRENT),
            )
        ),
        warnings=(
            *points.notes,
            *point_statements(points, choice, has_yaw),
            *(moment.statement() for moment in changes),
            *_not_tested(untested_runs, len({number for number, *_ in fit.windows.found})),
            *lack_statements(lack, choice, changed_groups),
        ),
        moments=tuple(changes),
        untested=untested_runs,
        advice=tuple(advice(choice, viscous, lack, has_yaw, points.force_from)),
    )


def _not_tested(untested_runs: Sequence[str], runs: int) -> list[Statement]:
    """That runs are too short to be tested for a change inside, or no command comes again in them."""
    if not untested_runs:
        return []
    return [Statement("changes_not_tested", NOTE, untested_runs[0], {"untested": len(untested_runs), "runs": runs})]


def _changed(points: ForcePoints, changes: Sequence[Moment], sources: Mapping[int, str]) -> list[Moment]:
    """The changes inside the runs of these points; without those of runs that have one name."""
    sources_here, names = {sources[number] for number in points.run.tolist()}, [*sources.values()]
    return [moment for moment in changes if moment.source in sources_here and names.count(moment.source) == 1]


def _lack(
    robot: Robot,
    points: ForcePoints,
    choice: ShapeChoice,
    group: str,
    changes: Sequence[Moment],
    sources: Mapping[int, str],
    robust: bool,
) -> LackOfFit:
    """Whether the shape of a group fits: on both sides of a change inside a run, which would look like another shape
    wherever directions were driven on one side of it only."""
    fit, inner_changes = choice.fit(group), _changed(points, changes, sources)
    if inner_changes:
        points = levelled(points, inner_changes, sources)
        fit = fit_shape(fit.shape, robot, points, robust=robust) or fit
    return lack_of_fit(robot, points, fit)


def _levels(windows: SteadyWindows, shape: str, group: str, robust: bool, robot: Robot) -> dict[str, float]:
    """The levels of a group were the robot another one; empty where the shape has none then."""
    fit = fit_shape(SHAPES[shape], robot, windows.points(robot).of(group), robust=robust)
    return {} if fit is None else fit.by_key(fit.free)


def _travel(points: ForcePoints) -> Travel:
    travel_forces = points.along[np.isfinite(points.along)]
    n = len(travel_forces)
    spread = float(np.std(travel_forces, ddof=1)) if n > 1 else float("nan")
    mean, error = (float(np.mean(travel_forces)), spread / np.sqrt(n)) if n else (float("nan"), float("nan"))
    speed = points.speed[points.travels] if points.travels.any() else points.speed
    return Travel(
        mean,
        error,
        spread,
        float(speed.min()),
        float(speed.max()),
        len(points),
        len(set(points.run.tolist())),
        int(points.rows.sum()),
    )


def _viscous(
    robot: Robot,
    windows: SteadyWindows,
    choice: ShapeChoice,
    group: str,
    points: ForcePoints,
    travel: Travel,
    robust: bool,
) -> tuple[Viscous, ...]:
    """The viscous levels of the chosen shape, fitted beside its other levels."""
    name, viscous_levels = base_name(choice.of(group)) + VISCOUS, []
    fit = choice.fits[name][group] if name in choice.fits else None
    if fit is None and speeds_differ(points):  # the other groups may have one speed only
        fit = fit_shape(SHAPES[name], robot, points, robust=robust)
    if fit is None:
        return ()
    brake, guesses = _back_emf(robot, points)
    at_rim = float(np.trace(brake) / np.sum(robot.wheels.wrench_matrix**2))
    shifts = moved_by_the_file(robot, fit.by_key(fit.free), partial(_levels, windows, name, group, robust))
    for k, key in enumerate(fit.keys):
        name = Key.parse(key)
        if name.level != VISCOUS_LEVEL:
            continue
        level, slow, fast = travel.mean, travel.slow, travel.fast
        if name.axis == YAW:
            yaw_speeds = np.abs(points.twist[points.turns, 2])
            level, slow, fast = float(np.abs(points.wrench[points.turns, 2]).mean()), yaw_speeds.min(), yaw_speeds.max()
        on_body = float(brake[name.axis, name.axis] if name.axis is not None else np.mean(np.diag(brake)[:2]))
        value, std = float(fit.free[k]), float(np.linalg.norm([fit.std[k], *shifts[k]]))
        half = t_quantile(fit.degrees_of_freedom) * std
        low, high = value - half, value + half
        viscous_levels.append(
            Viscous(
                key,
                value,
                std,
                low,
                high,
                seen=not low <= 0.0 <= high,
                effect=max(abs(low), abs(high)) * float(fast - slow),
                level=level,
                slow=float(slow),
                fast=float(fast),
                back_emf=at_rim if name.table == WHEELS else on_body,
                guesses=guesses,
                sum_std=float(fit.std[k]),
            )
        )
    return tuple(viscous_levels)


def _back_emf(robot: Robot, points: ForcePoints) -> tuple[FloatArray, tuple[str, ...]]:
    """(-d(wrench)/d(twist) by which the back-EMF brakes, shape (3, 3), the motor constants that are guesses).

    Forces from a voltage show its sum with viscous friction, and never one alone; those from currents show none of it.
    """
    if points.force_from != VOLTAGE:
        return np.zeros((3, 3)), ()
    guesses = [
        key for key, prior in robot.priors.items() if prior.origin in GUESSES and Key.parse(key).name in (TORQUE, EMF)
    ]
    return -drive_wrench(linear_part(robot), np.eye(3), np.zeros(robot.wheels.count)), tuple(guesses)


def _estimate(
    robot: Robot,
    points: ForcePoints,
    choice: ShapeChoice,
    group: str,
    robust: bool,
    refit: Callable[[Robot], Mapping[str, float]],
) -> Estimate:
    group_fit = choice.fit(group)
    shifts = moved_by_the_file(robot, group_fit.by_key(group_fit.free), refit)
    fit = replace(group_fit, covariance=group_fit.covariance + shifts @ shifts.T)
    name, runs = "" if group == "all" else f"{group}: ", len(set(points.run.tolist()))
    friction, kept_levels = _friction(robot, fit, fit.by_key(fit.level), is_turning(robot, points))
    priors = {
        key: prior
        for key, prior in robot.priors.items()
        if key in kept_levels or not ((place := find_key(key)) and place.level)
    }
    method = {
        "shape": fit.shape.name,
        "robust": robust,
        "force_from": points.force_from,
        "speed_from": points.speed_from,
        "folds": int(fit.fold.max()) + 1,
    }
    return estimate_of(
        [fit],
        robot.replace(friction=friction, priors=priors),
        f"{name}{runs} runs, {len(points)} steady points, {int(points.rows.sum())} rows",
        warnings=tuple(fit_statements(fit, robust, kept_levels, _back_emf(robot, points)[1])),
        method=str(Statement("steady_method", NOTE, numbers=method)),
        scale=scale_of_traction(robot, points.force_from == CURRENT),
        log_alone=group_fit.intervals() if shifts.size else {},
        points=steady_table(robot, points, group),
    )


def _friction(robot: Robot, fit: ShapeFit, value: dict[str, float], has_yaw: bool) -> tuple[Friction, dict[str, float]]:
    """The new friction; what the robot had about yaw is kept where the data do not turn, and named."""
    if has_yaw or fit.shape.name.startswith("wheel"):  # friction at the wheels resists turning by itself
        return friction_of(fit.shape, robot, value), {}
    old_friction = robot.friction
    coulomb = old_friction.axes.coulomb[2] + old_friction.direction.yaw_coulomb
    viscous = old_friction.axes.viscous[2] + old_friction.direction.yaw_viscous
    on_axes = fit.shape.name.startswith("box")
    names = (
        (f"{BODY_AXES}.coulomb[2]", f"{BODY_AXES}.viscous[2]")
        if on_axes
        else (f"{DIRECTION}.yaw_coulomb", f"{DIRECTION}.yaw_viscous")
    )
    kept_levels = {key: level for key, level in zip(names, (coulomb, viscous), strict=True) if level > 0.0}
    return friction_of(fit.shape, robot, value | kept_levels), kept_levels


def _differences(choice: ShapeChoice) -> tuple[Difference, ...]:
    """Every level between every two groups: independent data, so their variances add up."""
    fits, differences = {group: choice.fit(group) for group in choice.fits[choice.chosen]}, []
    for first, second in combinations(fits, 2):
        first_fit, second_fit = fits[first], fits[second]
        for k, key in enumerate(first_fit.keys):
            if key not in second_fit.keys:  # only one of the groups turns, or their shapes differ
                continue
            j = second_fit.keys.index(key)
            values = float(first_fit.free[k]), float(second_fit.free[j])
            std = float(np.hypot(first_fit.std[k], second_fit.std[j]))
            half = t_quantile(min(first_fit.degrees_of_freedom, second_fit.degrees_of_freedom)) * std
            gap = values[1] - values[0]
            differences.append(Difference(key, first, second, values, gap, std, gap - half, gap + half))
    return tuple(differences)
