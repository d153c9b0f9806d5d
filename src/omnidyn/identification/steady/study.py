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
from omnidyn.errors import InsufficientDataError, OmnidynError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.force_scale import scale_of_traction
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.stability import Stability
from omnidyn.identification.steady.choice import ShapeChoice, base_name, choose_shape, speeds_differ
from omnidyn.identification.steady.lack_of_fit import lack_of_fit
from omnidyn.identification.steady.levels import estimate_of
from omnidyn.identification.steady.moment import Moment, levelled, moments, moments_by_shape
from omnidyn.identification.steady.operating_points import CURRENT, VOLTAGE, ForcePoints, SteadyWindows, steady_windows
from omnidyn.identification.steady.shapes import SHAPES, VISCOUS, ShapeFit, fit_shape, friction_of, is_turning
from omnidyn.identification.steady.study_table import (
    Difference,
    SteadyStudy,
    Travel,
    Viscous,
    advice,
    fit_statements,
    lack_statements,
    point_statements,
    result_statements,
)
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.friction import Friction
from omnidyn.model.keys import BODY_AXES, DIRECTION, EMF, TORQUE, WHEELS, Key, expand, find_key
from omnidyn.model.keys import VISCOUS as VISCOUS_LEVEL
from omnidyn.model.known.told import known_priors
from omnidyn.model.layout import YAW
from omnidyn.model.robot import GUESSES, Robot
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement, statements
from omnidyn.statistics import t_quantile

LASTING = Stability({}, ())  # whether levels last, `moments` says


@dataclass(frozen=True, eq=False)
class SteadyFit:
    """The levels of friction before their diagnosis. parts: group -> its points; anew: group -> its levels were the
    robot another one. The rest as in SteadyStudy."""

    runs: Sequence[Run]
    robot: Robot
    asked: SteadyState
    windows: SteadyWindows
    points: ForcePoints
    choice: ShapeChoice
    parts: Mapping[str, ForcePoints]
    anew: Mapping[str, Callable[[Robot], dict[str, float]]]
    estimates: Mapping[str, Estimate]


def fit_steady(runs: Sequence[Run], robot: Robot, asked: SteadyState, groups: Sequence[str] | None = None) -> SteadyFit:
    """The levels of friction of each group, from the steady windows of runs.

    groups: name of each run's group (a floor, a load); every group has its own levels of one shape, and where its
    points tell another shape from that one, a shape of its own.
    The friction of `robot` is replaced; its motor and wheels are taken as they are.
    Raises InsufficientDataError when nothing is steady, nothing moves, or no shape is determined; InputError for a run
    without the channels needed.
    """
    windows = steady_windows(
        runs, robot, groups=groups, speed=asked.speed, force_from=asked.force_from, window=asked.window
    )
    points = windows.points(robot)
    try:
        choice = choose_shape(robot, points, shape=asked.shape, robust=asked.robust)
    except InsufficientDataError as error:  # one long drive: what changes in it needs no shape
        changed, _ = moments(runs, robot, points.force_from, asked.window)
        numbers = {"changes": tuple(moment.short() for moment in changed)}
        words = f"{error.what}; {Statement('force_changes_in_run', numbers=numbers)}" if changed else error.what
        raise InsufficientDataError(
            words, got=error.got, expected=error.expected, remedy=error.remedy, where=error.where
        ) from error
    if not SHAPES[choice.chosen].in_model:
        raise InsufficientDataError(
            "a robot file cannot hold this shape: it is for comparison only",
            got=choice.chosen,
            expected=", ".join(name for name, each in SHAPES.items() if each.in_model),
            where="shape",
        )
    parts = {group: points.of(group) for group in points.groups}
    anew = {group: partial(_levels, windows, choice.of(group), group, asked.robust) for group in parts}
    estimates = {
        group: _estimate(robot, part, choice, group, asked.robust, anew[group]) for group, part in parts.items()
    }
    return SteadyFit(runs, robot, asked, windows, points, choice, parts, anew, estimates)


def undiagnosed(fit: SteadyFit) -> SteadyStudy:
    """The study of a fit of which nothing is asked beyond its numbers."""
    return _study(fit, (), {}, set())


def diagnosed(fit: SteadyFit) -> SteadyStudy:
    """The study of a fit: what its shape leaves out, what changes inside a run, and what its levels rest on."""
    points, choice, robot = fit.points, fit.choice, fit.robot
    changed, tested = moments(fit.runs, robot, points.force_from, fit.asked.window)
    sources = {number: run.source for number, run, _ in fit.windows.found}
    by_shape, tested_by_shape = moments_by_shape(robot, points, choice.fit, sources, changed)
    changed += by_shape
    untested = tuple(name for name in sources.values() if name not in tested | tested_by_shape)
    lack = {
        group: _lack(robot, part, choice, group, changed, sources, fit.asked.robust)
        for group, part in fit.parts.items()
    }
    within = {group for group, part in fit.parts.items() if _changed(part, changed, sources)}
    known = {
        group: Diagnosis(lack[group], rests_on(robot, estimate.value, fit.anew[group]), LASTING)
        for group, estimate in fit.estimates.items()
    }  # whether the levels last, `moments` says
    estimates = {
        group: replace(estimate, study=partial(known.__getitem__, group)) for group, estimate in fit.estimates.items()
    }
    return _study(replace(fit, estimates=estimates), changed, lack, within, untested)


def _study(
    fit: SteadyFit,
    changed: Sequence[Moment],
    lack: Mapping[str, LackOfFit],
    within: Collection[str],
    untested: tuple[str, ...] = (),
) -> SteadyStudy:
    """The study.

    Args:
        fit: the levels.
        changed: changes inside a run.
        lack: group -> what its shape leaves out.
        within: groups with a change inside a run.
        untested: runs that could not be tested for one.
    """
    robot, points, choice, robust = fit.robot, fit.points, fit.choice, fit.asked.robust
    travel = {group: _travel(part) for group, part in fit.parts.items()}
    viscous = {
        group: _viscous(robot, fit.windows, choice, group, part, travel[group], robust)
        for group, part in fit.parts.items()
    }
    differences = _differences(choice)
    internal = {}
    if robot.wheels.count > 3:  # the part of the traction that pushes nowhere: G f = 0
        from scipy.linalg import null_space  # slow to import, and most robots have three wheels

        against = {group: part.traction @ null_space(robot.wheels.wrench_matrix) for group, part in fit.parts.items()}
        internal = {group: float(np.sqrt(np.mean((f**2).sum(axis=1)))) for group, f in against.items()}
    turning = any(is_turning(robot, part) for part in fit.parts.values())
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
                *result_statements(choice, viscous, differences, internal, lack, within),
                scale_of_traction(robot, points.force_from == CURRENT),
            )
        ),
        warnings=(
            *points.notes,
            *point_statements(points, choice, turning),
            *(moment.statement() for moment in changed),
            *_not_tested(untested, len({number for number, *_ in fit.windows.found})),
            *lack_statements(lack, choice, within),
        ),
        moments=tuple(changed),
        untested=untested,
        advice=tuple(advice(choice, viscous, lack, turning, points.force_from)),
    )


def _not_tested(untested: Sequence[str], runs: int) -> list[Statement]:
    """That runs are too short to be tested for a change inside, or no command comes again in them."""
    if not untested:
        return []
    return [Statement("changes_not_tested", NOTE, untested[0], {"untested": len(untested), "runs": runs})]


def _changed(points: ForcePoints, found: Sequence[Moment], sources: Mapping[int, str]) -> list[Moment]:
    """The changes inside the runs of these points; without those of runs that have one name."""
    sources_here, names = {sources[number] for number in points.run.tolist()}, [*sources.values()]
    return [moment for moment in found if moment.source in sources_here and names.count(moment.source) == 1]


def _lack(
    robot: Robot,
    points: ForcePoints,
    choice: ShapeChoice,
    group: str,
    found: Sequence[Moment],
    sources: Mapping[int, str],
    robust: bool,
) -> LackOfFit:
    """Whether the shape of a group fits: on both sides of a change inside a run, which would look like another shape
    wherever directions were driven on one side of it only."""
    fit, inside = choice.fit(group), _changed(points, found, sources)
    if inside:
        points = levelled(points, inside, sources)
        fit = fit_shape(fit.shape, robot, points, robust=robust) or fit
    return lack_of_fit(robot, points, fit)


def _levels(windows: SteadyWindows, shape: str, group: str, robust: bool, robot: Robot) -> dict[str, float]:
    """The levels of a group were the robot another one; empty where the shape has none then."""
    fit = fit_shape(SHAPES[shape], robot, windows.points(robot).of(group), robust=robust)
    return {} if fit is None else fit.by_key(fit.free)


def _travel(points: ForcePoints) -> Travel:
    along = points.along[np.isfinite(points.along)]
    n = len(along)
    spread = float(np.std(along, ddof=1)) if n > 1 else float("nan")
    mean, error = (float(np.mean(along)), spread / np.sqrt(n)) if n else (float("nan"), float("nan"))
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
    name, found = base_name(choice.of(group)) + VISCOUS, []
    fit = choice.fits[name][group] if name in choice.fits else None
    if fit is None and speeds_differ(points):  # the other groups may have one speed only
        fit = fit_shape(SHAPES[name], robot, points, robust=robust)
    if fit is None:
        return ()
    brake, guesses = _back_emf(robot, points)
    at_rim = float(np.trace(brake) / np.sum(robot.wheels.wrench_matrix**2))
    moved = moved_by_the_file(robot, fit.by_key(fit.free), partial(_levels, windows, name, group, robust))
    for k, key in enumerate(fit.keys):
        name = Key.parse(key)
        if name.level != VISCOUS_LEVEL:
            continue
        level, slow, fast = travel.mean, travel.slow, travel.fast
        if name.axis == YAW:
            turned = np.abs(points.twist[points.turns, 2])
            level, slow, fast = float(np.abs(points.wrench[points.turns, 2]).mean()), turned.min(), turned.max()
        on_body = float(brake[name.axis, name.axis] if name.axis is not None else np.mean(np.diag(brake)[:2]))
        value, std = float(fit.free[k]), float(np.linalg.norm([fit.std[k], *moved[k]]))
        half = t_quantile(fit.degrees_of_freedom) * std
        low, high = value - half, value + half
        found.append(
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
    return tuple(found)


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
    again: Callable[[Robot], Mapping[str, float]],
) -> Estimate:
    alone = choice.fit(group)
    moved = moved_by_the_file(robot, alone.by_key(alone.free), again)
    fit = replace(alone, covariance=alone.covariance + moved @ moved.T)
    name, runs = "" if group == "all" else f"{group}: ", len(set(points.run.tolist()))
    friction, kept = _friction(robot, fit, fit.by_key(fit.level), is_turning(robot, points))
    priors = {
        key: prior
        for key, prior in robot.priors.items()
        if key in kept or not ((place := find_key(key)) and place.level)
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
        warnings=tuple(fit_statements(fit, robust, kept, _back_emf(robot, points)[1])),
        method=str(Statement("steady_method", NOTE, numbers=method)),
        scale=scale_of_traction(robot, points.force_from == CURRENT),
        log_alone=alone.intervals() if moved.size else {},
    )


def _friction(robot: Robot, fit: ShapeFit, value: dict[str, float], turning: bool) -> tuple[Friction, dict[str, float]]:
    """The new friction; what the robot had about yaw is kept where the data do not turn, and named."""
    if turning or fit.shape.name.startswith("wheel"):  # friction at the wheels resists turning by itself
        return friction_of(fit.shape, robot, value), {}
    before = robot.friction
    coulomb = before.axes.coulomb[2] + before.direction.yaw_coulomb
    viscous = before.axes.viscous[2] + before.direction.yaw_viscous
    on_axes = fit.shape.name.startswith("box")
    names = (
        (f"{BODY_AXES}.coulomb[2]", f"{BODY_AXES}.viscous[2]")
        if on_axes
        else (f"{DIRECTION}.yaw_coulomb", f"{DIRECTION}.yaw_viscous")
    )
    kept = {key: level for key, level in zip(names, (coulomb, viscous), strict=True) if level > 0.0}
    return friction_of(fit.shape, robot, value | kept), kept


def _differences(choice: ShapeChoice) -> tuple[Difference, ...]:
    """Every level between every two groups: independent data, so their variances add up."""
    fits, found = {group: choice.fit(group) for group in choice.fits[choice.chosen]}, []
    for first, second in combinations(fits, 2):
        one, other = fits[first], fits[second]
        for k, key in enumerate(one.keys):
            if key not in other.keys:  # only one of the groups turns, or their shapes differ
                continue
            j = other.keys.index(key)
            values = float(one.free[k]), float(other.free[j])
            std = float(np.hypot(one.std[k], other.std[j]))
            half = t_quantile(min(one.degrees_of_freedom, other.degrees_of_freedom)) * std
            gap = values[1] - values[0]
            found.append(Difference(key, first, second, values, gap, std, gap - half, gap + half))
    return tuple(found)


# What the levels of a steady state rest on: the logs asked anew with each fixed number 1 % larger

STEP = 0.01
# Keys, with what follows them: those that forces and speeds are made with.
FIXED = {
    TORQUE: (EMF,),
    "motor.resistance_ohm": (),
    "motor.gear_ratio": (),
    "wheels.wheel_radius_m": (),
    "wheels.robot_radius_m": (),
    EMF: (),
}


def rests_on(
    robot: Robot, value: Mapping[str, float], again: Callable[[Robot], Mapping[str, float]]
) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key. again: the numbers of a robot."""
    found: dict[str, dict[str, float]] = {name: {} for name in value}
    for key, beside in FIXED.items():
        try:
            other = again(_larger(robot, key, *beside))
        except OmnidynError:  # no number of this robot, or none that these logs can be read with
            continue
        for name, now in value.items():
            if now > 0.0 and name in other:
                found[name][key] = other[name] / now - 1.0
    return found


def moved_by_the_file(
    robot: Robot, value: Mapping[str, float], again: Callable[[Robot], Mapping[str, float]]
) -> FloatArray:
    """What one std of each number that the file of the robot knows only so far moves the numbers by, to first order.
    Shape (numbers, K). A torque constant brings the EMF constant with it: both are one number of the magnet."""
    known = {key: std for key, (_, std) in known_priors(robot).items() if Key.parse(key).name in FIXED}
    magnet = any(Key.parse(key).name == TORQUE for key in known)
    found = []
    for key, std in known.items():
        place = Key.parse(key)
        if magnet and place.name == EMF:
            continue
        try:
            other = again(_larger(robot, key, *(str(Key(name, place.index)) for name in FIXED[place.name])))
        except OmnidynError:  # no number that these logs are read with
            continue
        size = STEP * float(place.get(robot))
        found.append([std / size * (other.get(name, now) - now) for name, now in value.items()])
    return np.array(found).reshape(-1, len(value)).T


def _larger(robot: Robot, *names: str) -> Robot:
    for name in names:
        for key in map(Key.parse, expand(name, robot)):
            robot = key.set(robot, (1.0 + STEP) * float(key.get(robot)))
    return robot
