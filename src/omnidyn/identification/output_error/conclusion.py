"""From the minimum to the answer: values, intervals, and what a reader must know."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np
from scipy.special import ndtri

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.comparison.verdict import is_missed
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.estimate import Correlation, identified, printable
from omnidyn.identification.force_scale import scale_of_motion
from omnidyn.identification.output_error.answer import Nuisance, OutputErrorEstimate
from omnidyn.identification.output_error.combinations import combinations
from omnidyn.identification.output_error.numbers_of_logs import key_of, latencies_like_zero, with_nuisances
from omnidyn.identification.output_error.problem.friction_laws import coulomb_below, falls
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT, implausible
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import Column, FitProblem, Problem, per_column
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.solve.steps import Order
from omnidyn.identification.output_error.traded_numbers import trades
from omnidyn.identification.output_error.trust.breakaway import Breakaway
from omnidyn.identification.output_error.trust.cures import Blind, blind_directions
from omnidyn.identification.output_error.trust.search_ends import at_the_end
from omnidyn.identification.output_error.trust.support import too_early
from omnidyn.identification.output_error.trust.uncertainty import Trust, from_the_log_alone, given
from omnidyn.model.keys import ROTOR, VISCOUS, WHEEL, Key, unit, with_priors
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import JOINT, WITH_THE_FIT, Prior, Robot
from omnidyn.sensors import TRAVEL
from omnidyn.statement import ERROR, NOTE, WARNING, Statement
from omnidyn.statistics import difference_noise

IN_METRES = (("twist", 0), ("twist", 1), ("position", 0), ("position", 1))  # outputs that know of no wheel radius
LARGEST_STD = 1e9  # what a robot file takes
SCALE_OF_T = 0.8310  # scale of Student's t with four degrees of freedom, fitted to Gaussian noise of std 1


def conclude(
    solver: Solver,
    solution: Solution,
    uncertainty: Trust,
    records: Sequence[Record],
    loss: str,
    more_statements: Sequence[Statement],
    lower_bound: Mapping[str, float],
    moving_axes: BoolArray,
    levels: Sequence[Breakaway] = (),
    better_intervals: Mapping[str, tuple[float | None, tuple[float, float]]] | None = None,
    exact: Trust | None = None,
) -> OutputErrorEstimate:
    """The Estimate of a solution. loss: of the fit, in words; more_statements: warnings to join; lower_bound: for the
    Estimate; moving_axes (3,): which axes did; levels: of breakaway that were asked for; better_intervals: name ->
    (std, interval) that replace those of the covariance; exact: the trust were all that was taken as it stands exact,
    where `uncertainty` has more.

    Raises InsufficientDataError where the logs say nothing about any of the robot's numbers, or of two together.
    """
    problem, values = solver.problem, solution.state.point.values.copy()
    blind_names = tuple(p.name for p, b in zip(problem.parameters, uncertainty.blind_parameters, strict=True) if b)
    names_at_bound = tuple(p.name for p in at_the_end(problem, values))
    open_names = tuple(
        p.name for p, b in zip(problem.parameters, uncertainty.open, strict=True) if b or p.name in names_at_bound
    )
    robot_count, missed_outputs = problem.robot_count, unexplained(solver, solution)
    directions = () if missed_outputs else blind_directions(problem, values, uncertainty.ways, moving_axes)
    joint = combinations(problem, values, uncertainty, moving_axes)
    if uncertainty.open[:robot_count].all() and (missed_outputs or not joint):
        _refuse_blind(
            problem.names[:robot_count], missed_outputs, records[0].source, uncertainty.unseen[:robot_count], directions
        )
    as_they_were = [p.value if p.prior is None else p.prior[0] for p in problem.parameters]
    values = np.where(uncertainty.unseen, as_they_were, values)
    std, ci95 = intervals(problem, values, uncertainty)
    for name, (spread, interval) in (better_intervals or {}).items():
        std[name], ci95[name] = std[name] if spread is None else spread, interval
    data, names, own_levels = _data(records), list(problem.names), _levels(problem.robot, levels, ci95)
    endless = [name for name, (_, (_, high)) in own_levels.items() if high == math.inf]
    fitted, correlation = problem.parameters[:robot_count], _correlation(names, uncertainty)
    robot = _with_levels(_robot(problem, values, std, open_names, data, bool(joint)), own_levels)
    none_told = latencies_like_zero(problem, values, uncertainty)
    on_time = np.where([p.name in none_told for p in problem.parameters], 0.0, values)
    noise = noise_of(solver, solution)
    robot = with_nuisances(robot, problem, on_time, std, open_names, records, data, noise)
    late_notes = [Statement("latency_like_zero", NOTE, numbers={"latencies": none_told})] if none_told else []
    return OutputErrorEstimate(
        robot=_together(robot, problem.parameters, std, uncertainty, correlation.matrix),
        value={p.name: float(v) for p, v in zip(fitted, values, strict=False)}
        | {k: v for k, (v, _) in own_levels.items()},
        std={name: std[name] for name in names[:robot_count]} | {k: _spread(i) for k, (_, i) in own_levels.items()},
        ci95={name: ci95[name] for name in names[:robot_count]} | {k: i for k, (_, i) in own_levels.items()},
        correlation=correlation,
        degrees_of_freedom={name: uncertainty.degrees for name in (*names[:robot_count], *own_levels)},
        at_bound=tuple(
            name for name, is_held in zip(names[:robot_count], uncertainty.held_parameters, strict=False) if is_held
        ),
        warnings=(
            *_warnings(solver, solution, uncertainty, records, blind_names),
            *_not_followed(missed_outputs),
            *late_notes,
            *more_statements,
        ),
        method=f"output error, maximum likelihood, {loss}, {uncertainty.kind} covariance",
        lower_bound={**lower_bound, **{name: own_levels[name][1][0] for name in endless}},
        data=data,
        scale=_scale(problem),
        nuisances={
            name: Nuisance(float(values[robot_count + j]), std[name], ci95[name], _unit(name))
            for j, name in enumerate(names[robot_count:])
        },
        noise=noise,
        unidentifiable=(*open_names, *endless),
        combinations=(*joint, *trades(problem, values, uncertainty, moving_axes)),
        log_alone=_log_alone(problem, values, exact or uncertainty, open_names, exact not in (None, uncertainty)),
        directions=directions,
        covariance=uncertainty.kind,
        unused=_unused(records),
        iterations=solution.iterations,
        converged=solution.converged,
        not_followed=tuple(missed_outputs),
        robust=bool(solver.nu),
    )


def _log_alone(
    problem: Problem, values: FloatArray, uncertainty: Trust, open_names: Sequence[str], is_held: bool
) -> dict[str, tuple[float, float]]:
    """Name -> 95 % interval were what the robot file knows with a std exact; empty where it knows nothing so.

    is_held: whether it knows so what was not fitted.
    """
    log_uncertainty = from_the_log_alone(problem, uncertainty) or (uncertainty if is_held else None)
    if log_uncertainty is None:
        return {}
    log_intervals, of_file = intervals(problem, values, log_uncertainty)[1], given(problem)
    return {
        p.name: log_intervals[p.name]
        for p, yes in zip(problem.parameters, of_file, strict=True)
        if not yes and p.name not in open_names
    }


def _scale(problem: Problem) -> str:
    """What all forces scale with, in words."""
    names = [p.name for p in problem.robot_parameters]
    amps = any(name == "current" for name, _ in problem.columns)
    return scale_of_motion(problem.robot, names, amps, any(column in IN_METRES for column in problem.columns))


def unexplained(solver: Solver, solution: Solution) -> dict[str, float]:
    """Output -> share of its spread that the model leaves, where the model misses it (`is_missed`).

    It has a wrong sign or unit. Left out: what is counted. What never changes, as of a dead sensor, has the largest
    spread of its channel; the share is then infinite.
    """
    unexplained_shares, problem, noise = {}, solver.problem, noise_of(solver, solution)
    measured = [_measured(problem, column) for column in problem.columns]
    measured_values = [np.concatenate(parts) if parts else np.zeros(1) for parts in measured]
    spreads = [float(values.std()) if np.ptp(values) else 0.0 for values in measured_values]
    largest = {
        name: max(s for s, column in zip(spreads, problem.columns, strict=True) if column[0] == name)
        for name, _ in problem.columns
    }
    for c, (column, parts) in enumerate(zip(problem.columns, measured, strict=True)):
        noise_std, spread = noise.get(_column(column), 0.0), spreads[c] or largest[column[0]]
        if solver.tick[c] or not spread or not parts:
            continue
        share = noise_std / spread
        if is_missed(share, noise_std) and is_missed(
            share, noise_std, difference_noise(*parts)
        ):  # the noise takes time to find
            unexplained_shares[_column(column)] = share if spreads[c] else math.inf
    return unexplained_shares


def _measured(problem: FitProblem, column: Column) -> list[FloatArray]:
    """What was measured of a column, piece by piece; of what adds up, from its mean."""
    pieces = [piece for piece in problem.pieces if column in piece.record.columns]
    parts = [piece.record.outputs[piece.first : piece.last + 1, piece.record.columns.index(column)] for piece in pieces]
    parts = [part[np.isfinite(part)] for part in parts]
    return [part - part.mean() if column[0] in TRAVEL else part for part in parts if part.size]


def _not_followed(missed_outputs: Mapping[str, float]) -> list[Statement]:
    if not missed_outputs:
        return []
    shares = tuple(share if math.isfinite(share) else None for share in missed_outputs.values())
    return [Statement("not_followed", ERROR, numbers={"outputs": tuple(missed_outputs), "shares": shares})]


def _refuse_blind(
    free: Sequence[str], missed_outputs: Mapping[str, float], place: str, unseen: BoolArray, directions: Sequence[Blind]
) -> NoReturn:
    """Raises InsufficientDataError: nothing moved, or all that is free can be traded, or the model does other things.

    unseen: for each of `free`, whether the outputs do not change with it at all. directions: that they do not show.
    """
    if missed_outputs:
        raise InsufficientDataError(
            "the robot moved, but with no value of what is free does the model move like it",
            got=f"{', '.join(missed_outputs)} that the voltages do not explain",
            expected="a model that follows the log",
            where=place,
            remedy="check signs, units and the order of the wheels, and the voltages (omnidyn check)",
        )
    if not unseen.all():
        sentences = [str(replace(direction, cures=()).statement()) for direction in directions]
        ways = "; ".join(str(direction.how_to_show()) for direction in directions if direction.cures)
        raise InsufficientDataError(
            "; ".join(
                ["of what is free each number can be made up for by others, so that none can be told", *sentences]
            ),
            got=", ".join(free),
            expected="fewer numbers",
            where=place,
            remedy=": ".join(["leave out one that is known", *([ways] if ways else [])]),
        )
    raise InsufficientDataError(
        "the logs say nothing about what is free",
        got=", ".join(free),
        expected="motion",
        remedy="drive the robot faster than its dead zone",
        where=place,
    )


def noise_of(solver: Solver, solution: Solution) -> dict[str, float]:
    """Output -> standard deviation of its noise; outputs without a measurement are left out.

    After a fit by Student's t: of the Gaussian noise that has this scale, so that outliers have no part in it. Of
    counts: before the encoder rounds; at least LEAST_SHARE of a tick.
    """
    columns = solver.problem.columns
    number = per_column(solution.state.sums, len(columns), "number")
    robust = bool(solver.nu) & (solver.tick == 0.0)
    std = np.sqrt(solution.state.variance) / np.where(robust, SCALE_OF_T, 1.0)
    return {_column(c): float(s) for c, s, rows in zip(columns, std, number, strict=True) if rows}


def intervals(
    problem: FitProblem, values: FloatArray, uncertainty: Trust
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Standard errors and 95 % intervals, on the scale on which the solver works; at a bound as for a friction line.

    At a bound: from the bound to what the free fit would reach, or to what it would reach from the bound.
    """
    std: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for j, p in enumerate(problem.parameters):
        value, std_here = float(values[j]), float(uncertainty.std[j])
        std[p.name] = std_here * p.slope(value)
        half, inner_value = uncertainty.quantile * std_here, p.inner(value) if value > 0.0 or not p.log else -math.inf
        if not math.isfinite(std_here):
            ci95[p.name] = (p.low, math.inf)
            continue
        low, high = inner_value - half, inner_value + half
        if uncertainty.held_parameters[j]:
            free_step = float(uncertainty.free_step[j])
            is_below_middle = 2.0 * value <= p.low + p.high  # or at Coulomb friction, which breakaway never is below
            low = inner_value if is_below_middle else inner_value + min(-half, free_step - half)
            high = inner_value + max(half, free_step + half) if is_below_middle else inner_value
        low, high = (max(low, p.low), min(high, max(p.high, inner_value))) if not p.log else (low, high)
        ci95[p.name] = (p.outer(low), p.outer(high))
    for s, c in Order(problem).pairs:
        name, least_level = problem.parameters[s].name, ci95[problem.parameters[c].name][0]
        ci95[name] = max(ci95[name][0], least_level), ci95[name][1]  # breakaway is never below Coulomb friction
    return std, ci95


def _robot(
    problem: Problem, values: FloatArray, std: Mapping[str, float], open_names: Sequence[str], data: str, is_joint: bool
) -> Robot:
    """The robot with the fitted numbers, and where they come from.

    What the data do not determine has the value that goes with the others: the robot must move as the log does, for
    which a product is enough. Its origin and std stay: a narrower std, written and read again, would count the log
    twice. Of a number with a logarithmic scale the std is a share, and stays that share. is_joint: whether the data
    determine what motors and viscous friction do together.
    """
    robot, numbers = problem.robot, {}
    for p, value in zip(problem.parameters[: problem.robot_count], values, strict=False):
        robot = p.on(robot, float(value))
        for key, factor in ((p.name, 1.0), *p.tied_numbers):
            if p.name not in open_names:
                numbers[key] = identified(std[p.name] * factor, f"output error, {data}")
            elif (prior_before := prior_of(problem.robot, key)) and prior_before.std is not None:
                share = value / float(Key.parse(p.name).get(problem.robot)) if p.log else 1.0
                joint = is_joint and (p.part == "motor" or Key.parse(key).level == VISCOUS)
                source = printable(f"{WITH_THE_FIT}, {data}") if joint else prior_before.source
                origin = JOINT if joint and prior_before.guessed else prior_before.origin
                numbers[key] = prior_before.replace(std=float(prior_before.std * share), source=source, origin=origin)
    return with_priors(holding(robot), numbers)


def prior_of(robot: Robot, key: str) -> Prior | None:
    """What the file knows of a number, by itself or as an entry of a list."""
    return robot.priors.get(key) or robot.priors.get(Key.parse(key).name)


def _levels(
    robot: Robot, profiles: Sequence[Breakaway], ci95: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, tuple[float, float]]]:
    """Key -> (level, interval) of breakaway. Where it may be coulomb itself, it is as uncertain as coulomb is."""
    levels = {}
    for profile in profiles:
        coulomb = ci95.get(coulomb_below(profile.name, robot), (profile.low, profile.low))
        low = coulomb[0] if profile.is_tied else profile.low
        high = max(profile.high, coulomb[1]) if profile.is_tied else profile.high
        levels[profile.name] = (profile.value, (low, high))
    return levels


def _spread(interval: tuple[float, float]) -> float:
    """The std that a normal number with this 95 % interval has."""
    return (interval[1] - interval[0]) / (2.0 * float(ndtri(0.975)))


def _with_levels(robot: Robot, levels: Mapping[str, tuple[float, tuple[float, float]]]) -> Robot:
    """The robot with the levels of breakaway, by key; others of their lists stay, or follow coulomb."""
    priors = {
        name: identified(_spread(interval), "output error, profile over the drives of the log")
        for name, (_, interval) in levels.items()
    }
    return (
        with_priors(holding(robot, {name: level for name, (level, _) in levels.items()}), priors) if priors else robot
    )


def _correlation(names: Sequence[str], uncertainty: Trust) -> Correlation:
    finite = np.isfinite(np.diag(uncertainty.covariance))
    size = np.where(finite & (uncertainty.std > 0.0), uncertainty.std, 1.0)
    matrix = np.where(np.outer(finite, finite), uncertainty.covariance, 0.0) / np.outer(size, size)
    np.fill_diagonal(matrix, 1.0)
    return Correlation(tuple(names), matrix)


def _together(
    robot: Robot, fitted: Sequence[Parameter], std: Mapping[str, float], uncertainty: Trust, correlation: FloatArray
) -> Robot:
    """The robot with what the fit knows of how its numbers are off together; what is tied to a number goes with it.

    correlation (P, P): of `fitted`. Numbers without a std of this fit have no part in it, nor have those of the logs.
    """
    tied_numbers = [
        (j, key, std[p.name] * factor)
        for j, p in enumerate(fitted)
        if 0.0 < std[p.name] < LARGEST_STD and 0.0 < uncertainty.std[j] < math.inf
        for key, factor in ((key_of(p.name, robot), 1.0), *p.tied_numbers)
        if key
    ]
    indices = [j for j, _, _ in tied_numbers]
    matrix = correlation[np.ix_(indices, indices)]
    return with_correlation(robot, [key for _, key, _ in tied_numbers], matrix, [spread for *_, spread in tied_numbers])


def _warnings(
    solver: Solver, solution: Solution, uncertainty: Trust, records: Sequence[Record], blind_names: Sequence[str]
) -> list[Statement]:
    statements = list(dict.fromkeys(note for record in records for note in record.notes))
    if not solution.converged:
        statements.append(Statement("iteration_limit", WARNING, numbers={"iterations": solution.iterations}))
    statements += [Statement("not_identifiable", WARNING, name) for name in blind_names]
    statements += [implausible(name, value) for name, value in too_early(solver, solution).items()]
    values = solution.state.point.values
    parameters_at_bound = {p.name: p for p in at_the_end(solver.problem, values)}
    values_at_bound = {name: float(values[solver.problem.where(name)]) for name in parameters_at_bound}
    statements += [
        Statement("search_end", WARNING, name, {"value": value, "unit": _unit(name) or unit(name)})
        for name, value in values_at_bound.items()
    ]
    for j, p in enumerate(solver.problem.parameters[: solver.problem.robot_count]):
        if uncertainty.held_parameters[j] and p.name not in parameters_at_bound:
            key = p.name.partition("@")[0]
            code = "bound_of_inertia" if Key.parse(key).name in (ROTOR, WHEEL) else "bound"
            code = "bound_of_breakaway" if falls(key, solver.problem.robot) else code
            statements.append(Statement(code, NOTE, p.name, {"value": values[j]}))
    if uncertainty.kind == "sandwich":
        numbers = {
            "neighbours": np.abs(uncertainty.neighbours).max(),
            "runs": uncertainty.runs,
            "widening": uncertainty.widening,
        }
        statements.append(Statement("not_white", NOTE, numbers=numbers))
    return statements


def _unused(records: Sequence[Record]) -> tuple[Statement, ...]:
    """What the logs hold and the fit does not use: each reason once, with the logs it is true of where not of all."""
    logs_by_reason: dict[Statement, list[str]] = {}
    for record in records:
        for reason in record.unused_notes:
            logs_by_reason.setdefault(reason, []).append(record.source or "a log")
    return tuple(
        reason_given
        if len(logs) == len(records)
        else Statement(
            "unused_in_some_logs",
            NOTE,
            reason_given.subject,
            {"unused": reason_given, "logs": len(logs), "of": len(records), "first": logs[0]},
        )
        for reason_given, logs in logs_by_reason.items()
    )


def _column(column: tuple[str, int]) -> str:
    return f"{column[0]}[{column[1]}]"


def _unit(name: str) -> str:
    if name.startswith((TILT, PUSH)):
        return "N m" if name.endswith("yaw") else "N"
    return {LATENCY: "s", "dead_band": "V"}.get(name.partition(".")[0], "")


def _data(records: Sequence[Record]) -> str:
    rows = sum(last - first + 1 for r in records for first, last in r.pieces)
    first = records[0].source or "unnamed"
    more = f" and {len(records) - 1} more log{'s' if len(records) > 2 else ''}" if len(records) > 1 else ""
    return f"{first}{more}, {rows} rows"
