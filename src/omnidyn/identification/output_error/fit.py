"""fit_output_error: whole logs in, a robot with honest intervals out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.engines.speed_loop import LoopEngine
from omnidyn.identification.output_error.problem.motion import Motion, motion
from omnidyn.identification.output_error.problem.nuisances import (
    AUTO,
    LATENCY,
    NUISANCES,
    automatic,
    nuisance_parameters,
    pieces,
)
from omnidyn.identification.output_error.problem.parameters import (
    Parameter,
    names_of,
    refuse_repeated,
    refuse_unknown,
    robot_parameters,
)
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.problem.record import Record, record
from omnidyn.identification.output_error.solve.first_point import coarse_point, first_point
from omnidyn.identification.output_error.solve.loop import (
    left_out,
    loop_keys,
    loop_pieces,
    looped,
    solve_loop,
)
from omnidyn.identification.output_error.solve.progress import Onlooker, onlooker
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.output_error.trust.breakaway import KEY, Breakaway, asked_axes, find_breakaway
from omnidyn.identification.output_error.trust.resampling import refuse_bootstrap, resampled
from omnidyn.identification.output_error.trust.support import supported, wanted
from omnidyn.identification.output_error.trust.uncertainty import trust
from omnidyn.logs.steady_table import AXES
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.keys import BOX, COULOMB, FRICTION, GAINS, VISCOUS, Key, expand, friction_keys, unit
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import IDENTIFIED, Robot
from omnidyn.run import Run
from omnidyn.simulation.exact.march import why_not_exact

FloatArray = NDArray[np.float64]

GAUSS, STUDENT = "gaussian", "student-t"
NU = 4.0  # degrees of freedom of Student's t: 2 % of wild samples hardly count, 95 % efficient without them
NOTHING = 1e-9  # [N, N m] a drive that is only rounding
CLOSE = 1e-4  # squared distance to the best point, in standard errors, at which a fit by the implicit engine ends
FINE = 1e-5  # [m/s] tolerance of the implicit engine at the end of a fit; it begins with a step a row
BEYOND = 10.0  # times what drives the robot: a greater level of Coulomb friction says no more than rest does
LEAST = 1e-6  # of its start, that a level stays above where 0 would switch it off


@dataclass(frozen=True)
class Options:
    """How to fit; see fit_output_error."""

    free: tuple[str, ...] | None = None
    fixed: tuple[str, ...] = ()
    nuisances: tuple[str, ...] | None = ()  # None: those that the logs support
    start: str = AUTO
    use_priors: bool = False
    outputs: tuple[str, ...] | None = None
    loss: str = GAUSS
    covariance: str = AUTO
    tick_rad: float | None = None  # None: found in the logs


def fit_output_error(
    runs: Run | Sequence[Run],
    robot: Robot,
    *,
    free: Sequence[str] | None = None,
    fixed: Sequence[str] = (),
    nuisances: str | Sequence[str] = AUTO,
    start: str = AUTO,
    use_priors: bool = False,
    outputs: Sequence[str] | None = None,
    loss: str = GAUSS,
    covariance: str = AUTO,
    tick_rad: float | None = None,
    profile: Sequence[str] = (),
    bootstrap: int = 0,
    watch: Callable[[State], None] | None = None,
) -> OutputErrorEstimate:
    """Fit numbers of a robot to whole logs by maximum likelihood of the model's free run.

    runs: one or many, of any length and rate; they are split at gaps. Inputs: voltage, or duty times the supply.
    free: keys of the robot file, such as "body.mass_kg"; "friction", the default, is what the robot has of it, a list
    stands for its entries. fixed: taken out. The EMF constant follows the torque constant, wheel by wheel, unless both
    are free. Breakaway follows coulomb, or stays as the robot has it; "friction.axes.breakaway[0]" among the free keys
    asks for its interval.
    nuisances: what the log does to the model: "latency" (or "latency.twist"), "gain", "dead_band", "fade", "tilt"
    (or "tilt.x", "tilt.y", "tilt.yaw"). By default latency and dead band, and the gain where the supply is only
    nominal, as far as the logs determine them; a warning says what else would fit the logs better. () for none.
    start: "rest", "free", or "auto": at rest where that shows.
    use_priors: a std in the robot file counts as a Gaussian prior of what is free, and what has one is free too. Off by
    default: a std that an earlier fit wrote from the same log would count the log twice; such ones (origin
    "identified") are never used.
    outputs: of "twist", "wheel_speed", "current", "pose" (or of "heading", "position"), "wheel_angle"; by default all
    that the log has, but for what is computed from another one: that would count the same data twice.
    tick_rad: of the encoders behind wheel angles [rad]; by default found in the log. Their likelihood is that of
    counts; 0 takes them like any other output.
    loss: "gaussian", or "student-t" for logs with outliers. covariance: "white", "sandwich", or "auto".
    profile: names whose interval comes from the profile of the likelihood instead, scaled by the sandwich where that is
    used. bootstrap: draws of whole runs from
    which the std and intervals of all come instead; deterministic.
    watch: is called with every better state on the way; an Onlooker is told in words what is done, too.

    Returns an Estimate with nuisances, noise and what is not identifiable. Raises InputError for options and logs that
    cannot be used, InsufficientDataError where nothing can be learnt, UnsupportedError for what an engine does not
    know. Of the nuisances, robots that need the implicit engine have latencies by default; they know the others, but
    no position and no wheel angle as outputs.
    """
    refuse_repeated(names_of(free or ()))
    given = Options(
        None if free is None else expand_keys(free, robot), expand_keys(fixed, robot), nuisance_names(nuisances),
        start, use_priors,
        None if outputs is None else names_of(outputs), loss, covariance, tick_rad,
    )  # fmt: skip
    records = read_records([runs] if isinstance(runs, Run) else list(runs), robot, given)
    return _fitted(records, robot, given, expand_keys(profile, robot), bootstrap, onlooker(watch))


def _fitted(
    records: Sequence[Record], robot: Robot, given: Options, profile: Sequence[str], bootstrap: int, watch: Onlooker
) -> OutputErrorEstimate:  # fmt: skip
    """The fit of records."""
    if bootstrap:
        refuse_bootstrap(bootstrap, {"": len(records)})
    refuse_unknown(given.fixed, robot)
    asked = asked_axes(given.free or (), given.fixed)
    watch.doing("looking for what moved")
    motion_of = motion(records, robot)
    robot, given, still = of_what_moved(motion_of, records, robot, given)
    solver, solution = _solve(records, robot, given, watch)
    solver, solution, given, hints = _settled(records, robot, given, watch, solver, solution)
    axes = [axis for axis in asked if motion_of.moved[axis]]
    solver, solution, levels = _levels_of(solver, solution, axes, given.covariance)
    watch.doing("finding how sure the numbers are")
    known = trust(solver, solution, given.covariance)
    more = [*(words for _, _, words in still), *hints]
    bounds = {key: bound for key, bound, _ in still if bound > NOTHING}
    better = resampled(solver, solution, known, profile, bootstrap, watch=watch).intervals
    return conclude(solver, solution, known, records, loss_words(given.loss), more, bounds, levels, better)


def _levels_of(
    solver: Solver, solution: Solution, axes: list[int], covariance: str
) -> tuple[Solver, Solution, list[Breakaway]]:
    """Breakaway of the axes that were asked for, and the fit with it."""
    if not axes:
        return solver, solution, []
    if not isinstance(solver.engine, ExactEngine):
        raise UnsupportedError(
            "breakaway is profiled with the exact engine only", got=solver.problem.robot.name,
            expected="friction on the body axes", where="free",
        )  # fmt: skip
    return find_breakaway(solver, solution, axes, trust(solver, solution, covariance))


def nuisance_names(nuisances: str | Sequence[str]) -> tuple[str, ...] | None:
    """The nuisances asked for; None where those are meant that the logs support."""
    if nuisances == AUTO:
        return None
    return (nuisances,) if isinstance(nuisances, str) else tuple(nuisances)


def of_what_moved(
    found: Motion, records: Sequence[Record], robot: Robot, given: Options
) -> tuple[Robot, Options, list[tuple[str, float, str]]]:
    """The robot and the options that a fit of these records has; see `without_still_axes`."""
    if looped(records):
        return robot, loop_options(given, found, records, robot), []
    return without_still_axes(found, records[0].source, robot, given)


def _solve(
    records: Sequence[Record], robot: Robot, given: Options, watch: Onlooker
) -> tuple[Solver, Solution]:  # fmt: skip
    problem, nu = make_problem(records, robot, given), degrees(given.loss)
    if looped(records):
        return solve_loop(problem, nu, watch)
    if is_exact(robot):
        watch.doing("looking for a start")
        solver = Solver(problem, ExactEngine(problem), nu)
        return solver, solver.minimise(first_point(solver, records), watch=watch)
    fine = Solver(problem, ImplicitEngine(problem, FINE), nu, CLOSE)
    return fine, fine.minimise(coarse_point(problem, nu, watch), watch=watch)


def degrees(loss: str) -> float:
    """Degrees of freedom of a loss; 0 for Gaussian noise."""
    return NU if loss == STUDENT else 0.0


def loss_words(loss: str) -> str:
    """A loss as an answer names it."""
    return "Gaussian noise" if loss == GAUSS else f"Student's t with {NU:g} degrees of freedom"


def make_engine(problem: Problem, tol: float | None = FINE) -> ExactEngine | ImplicitEngine | LoopEngine:
    """The engine of the robot and its logs; tol [m/s]: of the implicit one, None for a step a row."""
    if looped([piece.record for piece in problem.pieces]):
        return LoopEngine(problem, tol)
    return ExactEngine(problem) if is_exact(problem.robot) else ImplicitEngine(problem, tol)


def loop_options(given: Options, found: Motion, records: Sequence[Record], robot: Robot) -> Options:
    """By default friction of what moved, and the gains. Raises InsufficientDataError where nothing moved."""
    more = known_priors(robot) if given.use_priors else ()
    keys = dict.fromkeys((*loop_keys(robot, found.moved, records[0].source), *more))
    free = tuple(key for key in keys if key not in given.fixed)
    return given if given.free is not None else replace(given, free=free, fixed=())


def fits_exactly(problem: Problem) -> bool:
    """Whether the exact engine fits this problem."""
    return is_exact(problem.robot) and not looped([piece.record for piece in problem.pieces])


def is_exact(robot: Robot) -> bool:
    """Whether the exact engine fits this robot."""
    return not why_not_exact(robot) and robot.motor.electrical != DYNAMIC


def _settled(
    records: Sequence[Record], robot: Robot, given: Options, watch: Onlooker, solver: Solver, solution: Solution,
) -> tuple[Solver, Solution, Options, list[str]]:  # fmt: skip
    """Where the nuisances are automatic: without those that the logs do not support; and what they ask for beside."""
    if looped(records):
        return _settled_loop(records, robot, given, watch, solver, solution)
    if given.nuisances is not None or not isinstance(solver.engine, ExactEngine):
        return solver, solution, given, []
    watch.doing("which nuisances the logs support")
    kept = supported(solver, solution, automatic(records))
    given = replace(given, nuisances=kept)
    if set(kept) != set(automatic(records)):
        solver, solution = _solve(records, robot, given, watch)
    wider = make_problem(records, robot, replace(given, nuisances=tuple(dict.fromkeys((*kept, *NUISANCES)))))
    return solver, solution, given, wanted(solver, solution, Solver(wider, ExactEngine(wider), solver.nu))


def _settled_loop(
    records: Sequence[Record], robot: Robot, given: Options, watch: Onlooker, solver: Solver, solution: Solution,
) -> tuple[Solver, Solution, Options, list[str]]:  # fmt: skip
    """Without the latencies that the logs do not determine, where they are automatic; and what is not used."""
    if given.nuisances is None:
        kept = supported(solver, solution, (LATENCY,))
        given = replace(given, nuisances=kept)
        lost = [name for name in solver.problem.names[solver.problem.robot_count :] if name not in kept]
        if lost:  # from its start on: until it is done, the fit with all of them is the best so far
            solver, solution = _solve(records, robot, given, watch.aside(f"once more without {', '.join(lost)}"))
    return solver, solution, given, left_out(records, solver.problem.pieces)


def read_records(runs: Sequence[Run], robot: Robot, given: Options) -> list[Record]:
    """The runs as a fit sees them. Raises InputError for unknown words among the options, and where there is no run."""
    for value, known, where in (
        (given.loss, (GAUSS, STUDENT), "loss"),
        (given.covariance, (AUTO, "white", "sandwich"), "covariance"),
    ):
        if value not in known:
            raise InputError(f"unknown {where}", got=value, expected=" or ".join(known), where=where)
    if not runs:
        raise InputError("nothing to fit to", got="no runs", expected="one or more", where="runs")
    gains = any(Key.parse(key).name in GAINS for key in given.free or ())
    found = [record(run, robot, given.outputs, gains, given.tick_rad) for run in runs]
    if len({each.set_point is None for each in found}) > 1:
        raise InputError(
            "some logs have voltages, others set speeds only", got=", ".join(each.source for each in found[:2]),
            expected="logs of one kind", remedy="free a gain of the loop, or fit them apart", where="runs",
        )  # fmt: skip
    return found


def without_still_axes(
    found: Motion, source: str, robot: Robot, given: Options
) -> tuple[Robot, Options, list[tuple[str, float, str]]]:
    """Take the friction of axes that never visibly moved out of the fit: (robot, options, (key, bound, words) each).

    Such an axis has held what drove it: the robot gets at least that level there. Raises InsufficientDataError where
    no axis moved.
    """
    still: list[tuple[str, float, str]] = []
    fixed, asked = set(given.fixed), given.free if given.free is not None else free_by_default(robot)
    for axis in np.flatnonzero(~found.moved):
        own = {key for key in (*asked, *BOX) if Key.parse(key).axis == axis}
        fixed |= own
        if not is_exact(robot) and not own & set(asked):
            continue  # friction along the direction of travel: no axis has its own
        held, key = float(found.held[axis]), f"friction.axes.breakaway[{axis}]"
        what = f"; it held {held:.4g} {unit(key)}" if held > NOTHING else "; nothing drove it"
        still.append((key, held, found.words(int(axis)) + (what if found.seen[axis] else "")))
        if is_exact(robot) and robot.friction.axes.levels[2][axis] < held:
            robot = Key.parse(f"friction.axes.coulomb[{axis}]").set(robot, held)
    if not found.moved.any():
        raise InsufficientDataError(
            "the robot never visibly moved: its friction is only bounded from below",
            got="; ".join(
                f"{AXES[axis]} held {held:.3g}" if seen else f"{AXES[axis]} was not measured"
                for axis, (held, seen) in enumerate(zip(found.held, found.seen, strict=True))
            ),
            expected="motion", remedy="drive it beyond its dead zone", where=source,
        )  # fmt: skip
    if not still:
        return robot, given, still
    free = [key for key in asked if key not in fixed]
    if given.free is None and given.use_priors:
        return robot, replace(given, fixed=tuple(fixed)), still
    return robot, replace(given, free=tuple(free), fixed=()), still


def make_problem(records: Sequence[Record], robot: Robot, given: Options) -> Problem:
    """What is free, and how the pieces start. Raises InputError for unknown keys, or where nothing is left free."""
    priors = known_priors(robot) if given.use_priors else {}
    usual = free_by_default(robot)
    keys = list(given.free) if given.free is not None else [*usual, *(key for key in priors if key not in usual)]
    unknown = [key for key in given.fixed if key not in keys]
    if unknown and given.free is not None:
        raise InputError("fixed, but not free", got=unknown[0], expected=", ".join(keys), where="fixed")
    keys = [key for key in keys if key not in given.fixed and Key.parse(key).name != KEY]
    if not keys:
        got = ", ".join(given.free or ()) or "no key"
        raise InputError("nothing is free", got=got, expected="at least one beside breakaway", where="free")
    own = robot_parameters(robot, keys, priors)
    exact = is_exact(robot) and not looped(records)
    if not exact:
        own = [_within_reach(p, _drive(records, robot)) for p in own]
    auto = automatic(records) if exact else (LATENCY,)
    more = nuisance_parameters(auto if given.nuisances is None else given.nuisances, records, robot)
    late = any(p.name.startswith(LATENCY) for p in more)
    start = given.start
    parts = loop_pieces(records, robot, start) if looped(records) else pieces(records, robot, start, late)
    rows = sum(int(np.isfinite(p.record.outputs[p.first : p.last + 1]).sum()) for p in parts)
    if rows <= len(own) + len(more):
        raise InsufficientDataError(
            "too few measurements", got=f"{rows}", expected=f"more than {len(own) + len(more)}, one for each number"
        )
    return Problem(robot, (*own, *more), len(own), tuple(parts))


def _drive(records: Sequence[Record], robot: Robot) -> float:
    """The greatest wrench that the voltages of the logs give at rest [N, N, N m]; a loop may give its limit."""
    limit = robot.motor.voltage_limit or robot.drive.supply or 0.0
    levels = [r.voltage if r.set_point is None else np.eye(robot.wheels.count) * limit for r in records]
    return max(float(np.nanmax(np.abs(drive_wrench(robot, np.zeros(3), volts)), initial=0.0)) for volts in levels)


def _within_reach(p: Parameter, drive: float) -> Parameter:
    """Bounds within which a number shows: above 0, where it is off, and no level far beyond what drives the robot."""
    low = LEAST * p.value if p.low == 0.0 else p.low
    if Key.parse(p.name).level != COULOMB or drive == 0.0:
        return replace(p, low=low)
    return replace(p, low=low, high=min(p.high, max(BEYOND * drive, 2.0 * p.value)))


def free_by_default(robot: Robot) -> tuple[str, ...]:
    """B and C of the axes; of a robot with friction elsewhere the levels that it has: one that is off has no slope."""
    if is_exact(robot):
        return BOX
    has = {key: Key.parse(key) for key in friction_keys(robot)}
    return tuple(name for name, key in has.items() if key.level == VISCOUS or key.get(robot) > 0.0)


def expand_keys(names: str | Sequence[str], robot: Robot) -> tuple[str, ...]:
    """The keys that names stand for: "friction" for what is free by default, a list for its entries; others as is."""
    each = (free_by_default(robot) if name == FRICTION else expand(name, robot) for name in names_of(names))
    return tuple(dict.fromkeys(key for keys in each for key in keys))


def known_priors(robot: Robot) -> dict[str, tuple[float, float]]:
    """Priors of the robot file that are independent of any log: key -> (mean, std); that of a list for each entry."""
    found = {}
    for name, prior in robot.priors.items():
        if prior.std is not None and prior.origin != IDENTIFIED:
            found |= {key: (float(Key.parse(key).get(robot)), prior.std) for key in expand(name, robot)}
    return found
