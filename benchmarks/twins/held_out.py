"""The written robot beside plain ones, on logs that neither fit nor choice saw: of the twins, and of real robots.

error   of a free run from rest over the spread of what was measured, geometric mean over the outputs, same rows
(a)     the robot or motor that `identify` gives by default; motors by both of their methods
(b)     the plain fit: friction and what is free, white noise, no nuisances; of a motor without an offset, of a floor
        the two numbers of a plain ellipse
(c)     the robot as it was given; a motor has none
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path

import numpy as np
from scipy.stats import trim_mean

from benchmarks.real import real_nuisances, udea
from benchmarks.table import Table
from benchmarks.twins.answers import BY_DEFAULT, MOTOR_METHODS, WINDOWS, Answer, ask, driver_map, examined, motor_method
from benchmarks.twins.motor import HOLD, MEAN, TRIM, Drive, plain_fit
from benchmarks.twins.worlds import WORLDS, Array
from omnidyn.comparison.compare import compare
from omnidyn.identification.methods import OutputError
from omnidyn.logs.read_log import read_log
from omnidyn.model.dynamics import acceleration
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot, parse_robot
from omnidyn.run import Run
from tests.support import real_logs

AS_GOOD, SHARE = 1.05, 0.9
PLAIN = OutputError(nuisances=(), covariance="white")
STEADY = slice(0.40, 0.95)  # of the rows of a run at a held command, as the README of the Robotino takes them
CHIRP = 4.0  # [s] of a chirp: beyond it outruns the rows (README)
FASTEST = 1e-3  # [s], the lag of a motor whose lag came out below
WINDOW = 0.5  # [s] over which spiky speeds are averaged
Errors = dict[str, float]  # of "written", "plain" and "given", where they are there


@dataclass(frozen=True)
class Case:
    """kind: twins or a set of real logs. name: of the logs. errors: makes what each robot leaves of logs held out."""

    kind: str
    name: str
    errors: Callable[[], Errors]


def held_out(table: Table, seeds: Sequence[int]) -> None:
    """A row for each kind of log: how often the written robot is at most 1.05 times the best of the three."""
    found: dict[str, list[tuple[str, Errors]]] = {}
    for case in cases(seeds):
        errors = case.errors()
        found.setdefault(case.kind, []).append((case.name, errors))
        print(f"{case.kind}, {case.name}: {_words(errors)}", file=sys.stderr, flush=True)
    for kind, some in found.items():
        _add(table, kind, [errors for _, errors in some])
        table.notes += [f"{kind}, {name}: {_words(e)}" for name, e in some if not _ratio(e) <= AS_GOOD][:6]
    every = [errors for kind, some in found.items() if not kind.endswith(WINDOWS) for _, errors in some]
    if every:
        _add(table, "all, by default", every, goal=True)


def _add(table: Table, kind: str, some: Sequence[Errors], *, goal: bool = False) -> None:
    ratios = [_ratio(errors) for errors in some]
    share = float(np.mean([ratio <= AS_GOOD for ratio in ratios]))
    met = share >= SHARE - np.sqrt(SHARE * (1.0 - SHARE) / len(some)) if goal else None
    what = f"held out: written robot <= {AS_GOOD} of the best of written, plain, given"
    table.add(f">= {SHARE}" if goal else "", met, twin=kind, what=what, value=share, logs=len(some))
    table.add(twin=kind, what="... written over best, median", value=float(np.median(ratios)), logs=len(some))


def _ratio(errors: Errors) -> float:
    """Of the written robot over the best; infinite where none was written."""
    return errors.get("written", np.inf) / min(errors.values())


def _words(errors: Errors) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in errors.items())


def cases(seeds: Sequence[int]) -> Iterator[Case]:
    """All of them, twins first; real ones, which depend on no seed, where their logs are."""
    for seed in seeds:
        yield Case("twin wrong_radius", f"seed {seed}", partial(_radius, seed))
        yield Case("twin unequal_wheels", f"seed {seed}", partial(_wheels, seed))
        for name in ("offset_axis", "late_motor", "freewheeling_bridge"):
            for way in MOTOR_METHODS:
                yield Case(f"twin {name}, {way}", f"seed {seed}", partial(_twin_motor, name, seed, way))
    if real_logs.folder().is_dir():
        yield from _real_motors()
        yield from _real_robots()
        for group in real_logs.robotino_groups(real_logs.folder()):
            yield Case("robotino floors", group, partial(_floor, group))


# ---- robots, by free runs of whole logs


def _radius(seed: int) -> Errors:
    seen = examined("wrong_radius", seed)
    assert seen.robot is not None
    return robot_errors(seen.robot, seen.runs[:1], seen.runs[1:], answer=seen.answer)


def robot_errors(
    robot: Robot, fitted: Sequence[Run], held: Sequence[Run], window: int = 1, answer: Answer | None = None
) -> Errors:
    """Of the three robots, on runs that were not fitted. answer: of the fitted, where it is there already."""
    answers = {"written": answer or ask(fitted, robot), "plain": ask(fitted, robot, PLAIN, quick=True)}
    robots = {name: answer.found.estimate.robot for name, answer in answers.items() if answer.found} | {"given": robot}
    return {name: _free_runs(each, held, window) for name, each in robots.items()}


def _free_runs(robot: Robot, runs: Sequence[Run], window: int) -> float:
    found = compare(robot, list(runs))
    errors = []
    for name in found.channels:
        traces = [found.trace(robot.name, name, segment) for segment in found.segments]
        error = np.concatenate([_windows(trace.error, window) for trace in traces])
        spread = np.concatenate([_windows(trace.measured, window) for trace in traces])
        errors.append(np.log(np.sqrt(np.nanmean(error**2)) / np.nanstd(spread)))
    return float(np.exp(np.mean(errors)))


def _windows(values: Array, window: int) -> Array:
    """Trimmed means of each window; of one row, the rows."""
    if window == 1:
        return values
    parts = [values[k : k + window] for k in range(0, len(values) - window + 1, window)]
    parts = [part[np.isfinite(part)] for part in parts]
    return np.array([trim_mean(part, TRIM) for part in parts if len(part) > window // 2])


def _real_robots() -> Iterator[Case]:
    def drives(fitted: slice, held: slice) -> Errors:
        runs = [Run(t=r.t, duty=r.duty, wheel_speed=r.wheel_speed, source=r.source) for r in udea.drive_runs()]
        return robot_errors(real_nuisances.udea_robot(), runs[fitted], runs[held], round(WINDOW / 0.01))

    def turns(first: int) -> Errors:
        run = real_logs.udea_turning(real_logs.folder())[1]
        half = len(run) // 2
        cut = [udea.part(run, rows) for rows in (slice(0, half), slice(half, None))]
        halves = [Run(t=r.t, duty=r.duty, pose=r.pose, source=f"half {k + 1}") for k, r in enumerate(cut)]
        return robot_errors(real_nuisances.udea_robot(), [halves[first]], [halves[1 - first]])

    yield Case("udea drives", "exp4, exp5 by exp1..3", partial(drives, slice(0, 3), slice(3, 5)))
    yield Case("udea drives", "exp1..3 by exp4, exp5", partial(drives, slice(3, 5), slice(0, 3)))
    for first in (0, 1):
        yield Case("udea turning", f"by half {first + 1}", partial(turns, first))


# ---- motors, by free runs of the integrator of `motor`


def motor_errors(
    fitted: Sequence[Run], held: Sequence[Run], motor: int, answer: Answer, kind: str, **how: object
) -> Errors:
    """Of what one method says of a motor, and of the plain fit; `how` goes to `Drive`."""
    make = partial(_drive, motor=motor, kind=kind, how=how)
    return _motor_errors(motor, answer, [*map(make, fitted)], [*map(make, held)])


def _motor_errors(motor: int, answer: Answer, fitted: Sequence[Drive], held: Sequence[Drive]) -> Errors:
    record = next((m for m in answer.record.get("motors", ()) if m["motor"] == motor + 1), {})
    numbers = {name: own["value"] for name, own in record.get("parameters", {}).items() if own["value"] is not None}
    late = [value for name, value in numbers.items() if name.startswith("latency")]
    written = numbers | {"latency": late[0] if late else 0.0, "lag": max(numbers.get("lag", 0.0), FASTEST)}
    between = HOLD if record.get("between", HOLD) == HOLD else MEAN
    usable = written.get("slope", 0.0) > 0.0
    points = driver_map(answer, motor)
    driven = [drive.behind(points, written["slope"]) for drive in held] if points and usable else held
    own = {"written": _of_drives(driven, written, between)} if usable else {}
    return own | {"plain": _of_drives(held, *plain_fit(fitted))}


def _of_drives(drives: Sequence[Drive], numbers: Mapping[str, float], between: str) -> float:
    error = np.concatenate([drive.error(numbers, between) for drive in drives])
    return float(np.sqrt(np.mean(error**2)) / np.nanstd(np.concatenate([drive.measured for drive in drives])))


def _drive(run: Run, *, motor: int, kind: str, how: Mapping[str, object]) -> Drive:
    u = getattr(run, kind)[:, motor] * (100.0 if kind == "duty" else 1.0)
    speed = None if run.wheel_speed is None else run.wheel_speed[:, motor]
    angle = run.wheel_angle[:, motor] if speed is None and run.wheel_angle is not None else None
    return Drive(run.t, u, speed, angle, **how)  # type: ignore[arg-type]


def _twin_motor(name: str, seed: int, way: str) -> Errors:
    seen = examined(name, seed, way)
    how = {"window": 10} if name == "offset_axis" else {}
    kind = "duty" if seen.runs[0].duty is not None else "voltage"
    return motor_errors(seen.runs[:1], seen.runs[1:], 0, seen.answer, kind, **how)


def _real_motors() -> Iterator[Case]:
    for way in MOTOR_METHODS:
        for name, real in REAL_MOTORS.items():
            if way == BY_DEFAULT or real.kind != "current":  # of which windows are the default
                for motor in range(real.motors):
                    yield Case(f"{name}, {way}", f"motor {motor + 1}", partial(_real_motor, name, motor, way))


@dataclass(frozen=True)
class RealMotors:
    """Logs of motors. runs: makes them. fitted: the number of those to fit. kind: of the input. how: for `Drive`."""

    runs: Callable[[], Sequence[Run]]
    fitted: int
    kind: str
    motors: int = 3
    how: Mapping[str, object] = field(default_factory=dict)


def _odrive(name: str) -> list[Run]:
    runs = real_logs.odrive(real_logs.folder(), [name])
    if name == "chirp":
        runs = [udea.part(run, slice(0, int(np.searchsorted(run.t, run.t[0] + CHIRP)))) for run in runs]
    return runs


SPIKY = {"window": round(WINDOW / 0.01), "spiky": True}
REAL_MOTORS = {
    "odrive step": RealMotors(partial(_odrive, "step"), 1, "voltage", 1),
    "odrive chirp": RealMotors(partial(_odrive, "chirp"), 1, "voltage", 1),
    "udea stairs": RealMotors(lambda: real_logs.udea_stairs(real_logs.folder()), 1, "duty", how=SPIKY),
    "udea drives, motors": RealMotors(udea.drive_runs, 3, "duty", how=SPIKY),
    "robotino motors": RealMotors(lambda: real_logs.robotino_motors(real_logs.folder()), 1, "current"),
}


@cache
def _real_answer(name: str, way: str) -> tuple[list[Run], Answer]:
    """(runs with the input and the speed alone, what one method says of those that are fitted)."""
    real = REAL_MOTORS[name]
    runs = [
        Run(t=r.t, wheel_speed=r.wheel_speed, source=r.source, **{real.kind: getattr(r, real.kind)})
        for r in real.runs()
    ]
    return runs, ask(runs[: real.fitted], None, motor_method(way, runs[: real.fitted]))


def _real_motor(name: str, motor: int, way: str) -> Errors:
    real, (runs, answer) = REAL_MOTORS[name], _real_answer(name, way)
    return motor_errors(runs[: real.fitted], runs[real.fitted :], motor, answer, real.kind, **real.how)


# ---- floors, by the force at constant speed


def _wheels(seed: int) -> Errors:
    with tempfile.TemporaryDirectory() as folder:
        twin = WORLDS["unequal_wheels"](Path(folder), seed)
        robot = parse_robot(twin.robot)
        runs = [read_log(path, robot, current_unsigned=True) for path in twin.logs]
    return floor_errors(robot, runs)


def _floor(group: str) -> Errors:
    return floor_errors(load_robot("robotino"), real_logs.robotino_groups(real_logs.folder())[group])


def floor_errors(robot: Robot, runs: Sequence[Run]) -> Errors:
    """Force along x and y of pairs of directions, one pair fitted, the next predicted."""
    fitted, held = ([run for k, run in enumerate(runs) if k // 2 % 2 == side] for side in (0, 1))
    answer = ask(fitted, robot)
    robots = ({"written": answer.found.estimate.robot} if answer.found else {}) | {"given": robot}
    force, twist = _steady(robot, held)
    found = {name: force - _friction(each, twist) for name, each in robots.items()}
    own, way = (_steady(robot, fitted)[0], _direction(_steady(robot, fitted)[1]))
    ellipse = np.sum(own * way, axis=0) / np.sum(way**2, axis=0)
    found["plain"] = force - ellipse * _direction(twist)
    spread = force.std(axis=0)
    return {name: float(np.exp(np.mean(np.log(np.sqrt(np.mean(e**2, axis=0)) / spread)))) for name, e in found.items()}


def _steady(robot: Robot, runs: Sequence[Run]) -> tuple[Array, Array]:
    """(force of the motors along x and y [N], set twist) of each run, means of its steady rows."""
    motor, wheels = robot.motor, robot.wheels
    push = (
        float(np.mean(motor.torque_constant)) * float(np.mean(motor.gear_ratio)) / float(np.mean(wheels.wheel_radius))
    )
    force, twist = [], []
    for run in runs:
        assert run.current is not None
        assert run.twist_command is not None
        rows = slice(int(STEADY.start * len(run)), int(STEADY.stop * len(run)))
        current = np.nanmean(run.current[rows], axis=0)
        force.append((wheels.wrench_matrix @ current)[:2] * push)
        twist.append(np.nanmean(run.twist_command[rows], axis=0))
    return np.array(force), np.array(twist)


def _direction(twist: Array) -> Array:
    return twist[:, :2] / np.hypot(twist[:, 0], twist[:, 1])[:, None]


def _friction(robot: Robot, twist: Array) -> Array:
    """Force along x and y that friction takes at a twist [N]: the motors without current, what is left brakes."""
    emf = (
        np.asarray(robot.motor.emf_constant)
        * np.asarray(robot.motor.gear_ratio)
        / np.asarray(robot.wheels.wheel_radius)
    )
    return -robot.body.mass * acceleration(robot, twist, emf * (twist @ robot.wheels.wrench_matrix))[:, :2]
