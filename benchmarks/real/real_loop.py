"""Robotino's speed loop on real logs: friction per floor and the gain by output error, others run freely."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.table import Table
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support import real_logs as logs

SETS_OFF = 0.5  # [s] of each run that the fit does not see: the robot sets off within it, between two rows
SECONDS = 6.0  # [s] of each run that are used: the shortest have as many, and nothing changes after the start
FITTED, HELD = slice(0, None, 3), slice(1, None, 3)  # of the directions
OUTPUTS = ("wheel_speed", "current")
LEVELS = ("friction.direction.coulomb[0]", "friction.direction.coulomb[1]")
GAIN, WRONG = "drive.kp_V_s_rad", 3.0
README = {"gray": (39.26, (42.53, 35.99)), "green": (35.55, (36.03, 35.05))}  # [N] along travel (mean), ellipse
FORCE_BOUND, LEVEL_BOUND = 1.5, 1.5  # [N]


def floors(section: slice) -> tuple[list[Run], list[str]]:
    """(runs, floor of each): every third direction of both floors, all speeds; speeds are differences of angles."""
    runs, names = [], []
    for group, every in logs.robotino_groups(logs.folder()).items():
        chosen = every[section]
        runs += [prepared(run) for run in chosen]
        names += [group.split()[0]] * len(chosen)
    return runs, names


def prepared(run: Run, blank: float = SETS_OFF) -> Run:
    """The first SECONDS; wheel speed from the angle, which has no bias of a coarse step; blank where it sets off."""
    keep = run.t - run.t[0] <= SECONDS
    t = run.t[keep]
    assert run.wheel_angle is not None
    assert run.current is not None
    angle, current = run.wheel_angle[keep], run.current[keep].copy()
    speed = np.gradient(angle, t, axis=0)
    first = t - t[0] < blank
    rest = np.arange(len(t)) < 3  # they show that it begins at rest
    speed[rest] = 0.0
    speed[first & ~rest], current[first & ~rest] = np.nan, np.nan
    return Run(
        t=t, wheel_speed=speed, current=current, wheel_speed_command=run.wheel_speed_command[keep], source=run.source
    )


def robotino(table: Table) -> None:
    """Friction of each floor, motor and gain shared; then runs in other directions, never seen, as free runs."""
    robot = load_robot("robotino")
    (runs, names), (held, their) = floors(FITTED), floors(HELD)
    start = Key.parse(GAIN).set(robot, WRONG * robot.drive.kp)  # type: ignore[operator]
    began = time.process_time()
    fit = identify(
        runs,
        start,
        OutputError(
            free=[*LEVELS, GAIN], per_free=LEVELS, nuisances=(), outputs=OUTPUTS, start="rest", loss="student-t"
        ),
        groups=names,
    )
    spent = time.process_time() - began
    steady = identify(runs, robot, SteadyState(shape="ellipse"), groups=names).study.estimates
    for floor, estimate in fit.groups.items():
        force, levels = README[floor]
        own = np.array([estimate.value[key] for key in LEVELS])
        along, told = _along(own), _along(np.array(levels))
        _row(
            table,
            f"<= {FORCE_BOUND} N of {force} (README)",
            abs(along - force) <= FORCE_BOUND,
            floor,
            "mean force along travel",
            along,
            "N",
        )
        _row(table, "", None, floor, "... of the README's ellipse, the same mean", told, "N")
        same = _along(np.array([steady[floor].value[key] for key in LEVELS]))
        _row(table, "", None, floor, "... of a steady-state ellipse of the same rows", same, "N")
        for key, value, told_level in zip(LEVELS, own, levels, strict=True):
            met = abs(value - told_level) <= LEVEL_BOUND
            _row(table, f"<= {LEVEL_BOUND} N of {told_level} (README)", met, floor, key, value, "N", estimate.std[key])
            again = steady[floor]
            _row(table, "", None, floor, "... steady state, same rows", again.value[key], "N", again.std[key])
        mine = [run for run, own_floor in zip(held, their, strict=True) if own_floor == floor]
        for name, unit in (("wheel_speed", "rad/s"), ("current", "A")):
            error, mean = _rmse(estimate.robot, mine, name)
            _row(table, "", None, floor, f"rmse of {name}, {len(mine)} held-out free runs", error, unit)
            _row(table, "", None, floor, "... of the mean of each run", mean, unit)
    one = next(iter(fit.groups.values()))
    _row(
        table,
        "15 +- 5 (robot file)",
        None,
        "both",
        f"{GAIN}, from {WRONG:g} times 15",
        one.value[GAIN],
        "V s/rad",
        one.std[GAIN],
    )
    for change in fit.differences:
        _row(
            table,
            "",
            None,
            "both",
            f"{change.key}, {change.second} - {change.first}",
            change.difference,
            "N",
            change.std,
        )
    _row(table, "<= 60", spent <= 60.0, "both", f"the fit of {len(runs)} runs", spent, "s")
    table.notes += [
        "robotino: friction is collinear with the velocity and the speed loop at rest in every row used, so that what "
        "is fitted is the steady state once more. By Student's t, for Gaussian noise loses 1 to 2 N to wild samples; "
        "what is left to the README is in the choice of runs and rows, as the steady state of the same rows shows",
        "robotino: the mass from the start is not to be believed: the loop settles within a row, and what the first "
        "rows show is the latency of the log",
    ]
    table.notes += [f"{floor}: {words}" for floor, each in fit.groups.items() for words in each.warnings]
    _transient(table, robot)


def _transient(table: Table, robot: Robot) -> None:
    """What the first second shows: when it sets off, and what mass says."""
    gray = [run for run in logs.robotino_groups(logs.folder())["gray 0.2"][::6]]
    runs = [prepared(run, 0.0) for run in gray]
    fit = identify(
        runs,
        robot,
        OutputError(
            free=[*LEVELS, GAIN, "body.mass_kg"],
            nuisances=["latency.wheel_speed", "latency.current"],
            outputs=OUTPUTS,
            start="rest",
        ),
    ).estimate
    for name, nuisance in fit.nuisances.items():
        _row(table, "", None, "gray 0.2", f"{name}, {len(runs)} runs", nuisance.value, nuisance.unit, nuisance.std)
    _row(
        table,
        "",
        None,
        "gray 0.2",
        "body.mass_kg from the start",
        fit.value["body.mass_kg"],
        "kg",
        fit.std["body.mass_kg"],
    )


def _along(levels: np.ndarray) -> float:
    """Mean over the directions of the force along travel of an ellipse by maximum dissipation, |(Cx cos, Cy sin)|."""
    angle = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    return float(np.hypot(levels[0] * np.cos(angle), levels[1] * np.sin(angle)).mean())


def _rmse(robot: Robot, runs: list[Run], name: str) -> tuple[float, float]:
    """(of the samples, of the means of the runs), all wheels together."""
    errors, means = [], []
    for run in runs:
        model = simulate(robot, dt=np.diff(run.t), wheel_speed_command=run.wheel_speed_command[:-1], tol=None)
        error = (getattr(model, name) - getattr(run, name))[run.t - run.t[0] >= SETS_OFF]
        errors.append(np.nanmean(error**2))
        means.append(np.nanmean(np.nanmean(error, axis=0) ** 2))
    return float(np.sqrt(np.mean(errors))), float(np.sqrt(np.mean(means)))


def _row(
    table: Table,
    goal: str,
    met: bool | None,
    floor: str,
    what: str,
    value: float,
    unit: str,
    error: float | None = None,
) -> None:
    more = {} if error is None else {"+-": error}
    table.add(goal, met, data=f"robotino {floor}", what=what, value=value, unit=unit, **more)
