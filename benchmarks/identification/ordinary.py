"""Robots as people have them: an evaluation of their fit, a run, and whole fits, each beside its goal (ten minutes).

    python3 dev.py bench ordinary
    python -m benchmarks.identification.ordinary four mecanum --part evaluation --part quick    # a part

Two logs of 60 s at 100 Hz of each, by simulators of their own (ordinary_robots.py). All times are of the processor,
compiled before. Evaluations: whole simulations with derivatives, of a part of the log and at any tolerance.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from benchmarks.identification import ordinary_sysid
from benchmarks.identification.identify_peers import INSTALL, installed_sysid
from benchmarks.identification.ordinary_robots import RATE, Robot, robots, write_log
from benchmarks.size import SMALLEST
from benchmarks.table import Table, Times, machine, one_core
from omnidyn.cli import main as omnidyn
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.prepare import FINE_TOLERANCE
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.logs.read_log import read_log
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot import Robot as Model
from omnidyn.model.robot_file import load_robot, save_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

EVALUATION, RUN, QUICK, DEFAULT, PEER = "evaluation", "simulate", "quick", "default", "peer"
PARTS = (EVALUATION, RUN, QUICK, DEFAULT, PEER)
NUMBERS = 14  # free in the evaluation that is timed
GOAL_EVALUATION, GOAL_LATENCIES = 60.0, 100.0  # [ms] with one latency, with four
GOALS_RUN = {1e-5: 60.0, 1e-6: 150.0}  # [ms] at each tolerance
GOALS_FIT = {QUICK: 15.0, DEFAULT: 30.0}  # [s]
GOAL_EVALUATIONS = 120
EXCEPTION = "wheels"
COLUMNS = ["robot", "what", "cpu", "unit", "evaluations", "stops %", "note"]
PEER_ROBOT, PEER_CALLS = "four", 12  # the robot that scipy fits, and its evaluations of residuals with slopes
REPEATS = 5


def measure(names: Sequence[str] = (), parts: Sequence[str] = PARTS) -> Table:
    """The table of these robots, all by default, and of these parts."""
    table = Table("ordinary: robots as people have them, two logs of 60 s at 100 Hz", COLUMNS)
    table.notes.append(machine())
    chosen = [robot for robot in robots() if not names or robot.name in names]
    chosen, parts = (chosen[:1], [EVALUATION]) if SMALLEST else (chosen, list(parts))
    with tempfile.TemporaryDirectory() as folder, one_core():
        for robot in chosen:
            _measure_robot(table, robot, parts, Path(folder))
    table.notes += [
        "stops: rows in which a body axis, or where friction is at the wheels a wheel, comes to rest or turns round",
        f"{EVALUATION}: 12,000 rows, {NUMBERS} numbers, residuals and derivatives; one latency but with four for "
        "motion capture",
        f"{QUICK}, {DEFAULT}: `omnidyn identify` of both logs, with and without --quick, from what `init` guesses",
        f"{EXCEPTION}: friction at the wheels is outside the march of ordinary robots; its rows have no goal",
    ]
    return table


def _measure_robot(table: Table, robot: Robot, parts: Sequence[str], folder: Path) -> None:
    """The rows of one robot."""
    paths = [folder / f"{robot.name}_{seed}.csv" for seed in (1, 2)]
    share = float(np.mean([write_log(robot, seed, path) for seed, path in zip((1, 2), paths, strict=True)]))
    file = folder / f"{robot.name}.toml"
    initial(robot, file)
    has_goal = robot.name != EXCEPTION
    model, assume = load_robot(file), dict(fact.split("=", 1) for fact in robot.facts[1:])
    runs = [read_log(path, model, assume=assume) for path in paths]

    def add(what: str, cpu: float, unit: str, goal: float | None, **cells: Any) -> None:
        words = f"<= {goal:g} {unit}" if goal and has_goal else ""
        met = cpu <= goal if goal and has_goal else None
        table.add(words, met, robot=robot.name, what=what, cpu=cpu, unit=unit, **{"stops %": 100.0 * share}, **cells)

    true = true_model(robot, model)
    if EVALUATION in parts:
        goal = GOAL_LATENCIES if robot.sensors.capture else GOAL_EVALUATION
        cpu, numbers, latencies = evaluation(runs, true)
        add("one evaluation with derivatives", cpu, "ms", goal, note=f"{numbers} numbers, {latencies} latencies")
    if RUN in parts:
        voltage = np.concatenate([run.voltage[: len(run) - 1] for run in runs if run.voltage is not None])
        for tol, goal in GOALS_RUN.items():
            times = Times()
            times.measure(lambda tol=tol: simulate(true, voltage, 1.0 / RATE, tol=tol), REPEATS)
            add(f"simulate, tol {tol:g}", min(times.cpu), "ms", goal, note=f"{len(voltage)} rows")
    for part in (QUICK, DEFAULT):
        if part in parts:
            cpu, count, note = whole_fit(paths, file, robot.facts, part)
            add(f"identify, {part}", cpu, "s", GOALS_FIT[part], evaluations=count, note=note)
            if part == QUICK and has_goal:
                met = count <= GOAL_EVALUATIONS
                table.add(f"<= {GOAL_EVALUATIONS}", met, robot=robot.name, what="evaluations", evaluations=count)
    if PEER in parts and robot.name == PEER_ROBOT:
        cpu, count, note = plain_least_squares(runs, model)
        table.add(robot=robot.name, what="scipy least_squares", cpu=cpu, unit="s", evaluations=count, note=note)
        start = time.process_time()
        ours = identify(list(runs), model, OutputError()).estimate.robot
        cpu, words = time.process_time() - start, ordinary_sysid.errors(ordinary_sysid.numbers_of(ours), robot.world)
        table.add(robot=robot.name, what="omnidyn beside mujoco.sysid", cpu=cpu, unit="s", note=words)
        if installed_sysid() is None:
            table.notes.append(f"mujoco.sysid skipped: not installed here ({INSTALL})")
            return
        found, cpu = ordinary_sysid.fit(runs, ordinary_sysid.numbers_of(model), robot.world)
        words = ordinary_sysid.errors(found, robot.world)
        table.add(robot=robot.name, what="mujoco.sysid", cpu=cpu, unit="s", note=words)


def initial(robot: Robot, file: Path) -> None:
    """What `omnidyn init` makes of a ruler and a scale; with friction at the wheels where that is the exception."""
    options = [word for word in robot.init if word not in ("--friction", "wheels")]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        omnidyn(["init", f"my_{robot.name}", *options, "-o", str(file), "--force"])
    if robot.at_wheels:
        model = load_robot(file)
        weight = 9.81 * robot.world.mass / robot.world.G.shape[1]
        priors = {key: prior for key, prior in model.priors.items() if not key.startswith("friction.")}
        friction = Friction(wheels=WheelFriction(coulomb=0.1 * weight, viscous=0.1))
        save_robot(model.replace(friction=friction, priors=priors), file, force=True)


def true_model(robot: Robot, model: Model) -> Model:
    """The file with the numbers of the world, but for a thousandth of the rotors that it guesses."""
    world, motor = robot.world, model.motor
    (c_x, c_y, c_yaw), (b, _, b_yaw) = world.coulomb, world.viscous
    direction = DirectionFriction(coulomb=(c_x, c_y), viscous=b, yaw_coulomb=c_yaw, yaw_viscous=b_yaw)
    motor = motor.replace(
        resistance=world.resistance,
        torque_constant=world.torque_constant,
        emf_constant=world.torque_constant,
        gear_ratio=world.gear_ratio,
        rotor_inertia=1e-3 * float(np.mean(motor.rotor_inertia)),
    )
    return model.replace(
        body=model.body.replace(inertia=world.inertia),
        motor=motor,
        friction=model.friction if robot.at_wheels else Friction(direction=direction),
    )


def evaluation(runs: Sequence[Run], model: Model) -> tuple[float, int, int]:
    """([ms] of one evaluation as at the end of a fit, how many numbers are free, how many of them latencies)."""
    fit = Fit.of(list(runs), model, OutputError(nuisances=("latency",)))
    group = fit.groups[0]
    problem = group.problem()
    if len(problem.names) < NUMBERS:
        problem = group.problem(("latency", "push"))
    engine, start = group.engine.of(problem, FINE_TOLERANCE), problem.start()
    times = Times()
    moves = iter(np.linspace(1.0, 1.0 + 1e-6, REPEATS + 1))
    times.measure(lambda: engine.residuals(Point(start.values * next(moves), start.states)), REPEATS)
    latencies = sum(name.startswith("latency.") for name in problem.names)
    return min(times.cpu), len(problem.names), latencies


@contextlib.contextmanager
def counted() -> Iterator[list[int]]:
    """How many whole simulations with derivatives the implicit engines make meanwhile, in the only entry."""
    count, simulated = [0], ImplicitEngine._simulated

    def counting(engine: ImplicitEngine, point: Point) -> Any:
        count[0] += 1
        return simulated(engine, point)

    ImplicitEngine._simulated = counting  # type: ignore[method-assign]
    try:
        yield count
    finally:
        ImplicitEngine._simulated = simulated  # type: ignore[method-assign]


def whole_fit(paths: Sequence[Path], file: Path, facts: Sequence[str], part: str) -> tuple[float, int, str]:
    """([s] of `omnidyn identify` of these logs, its evaluations, how many numbers it knows)."""
    flags = ["--quick"] if part == QUICK else []
    arguments = ["identify", *map(str, paths), "--robot", str(file), "--json", *facts, *flags]
    out = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        omnidyn(["identify", str(paths[0]), "--robot", str(file), "--json", *facts, *flags])  # compiles
    with counted() as count, contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        start = time.process_time()
        code = omnidyn(arguments)
        cpu = time.process_time() - start
    if not out.getvalue().strip():
        return cpu, count[0], f"exit {code}"
    answer = json.loads(out.getvalue())
    known = len(answer["parameters"]) - len(answer["unidentifiable"])
    return cpu, count[0], f"knows {known} of {len(answer['parameters'])} numbers"


def plain_least_squares(runs: Sequence[Run], model: Model) -> tuple[float, int, str]:
    """([s] of scipy's least_squares from the same start, its runs of `simulate`, what is left): speeds of wheels only,
    derivatives by differences, which a stop within a row makes wrong."""
    fit = Fit.of(list(runs), model, OutputError(nuisances=()))
    problem, count = fit.groups[0].problem(), [0]

    def residuals(logs: np.ndarray) -> np.ndarray:
        robot = problem.robot_at(np.exp(logs))
        parts = []
        for run in runs:
            count[0] += 1
            assert run.wheel_speed is not None
            made = simulate(robot, run.voltage[: len(run) - 1], 1.0 / RATE)
            assert made.wheel_speed is not None
            parts.append((made.wheel_speed - run.wheel_speed)[np.isfinite(run.wheel_speed).all(axis=1)].ravel())
        return np.concatenate(parts)

    start_values = np.log([p.value for p in problem.parameters])
    start = time.process_time()
    found = least_squares(residuals, start_values, x_scale="jac", diff_step=1e-4, max_nfev=PEER_CALLS)
    cpu = time.process_time() - start
    rms = float(np.sqrt(2.0 * found.cost / len(found.fun)))
    return (
        cpu,
        count[0],
        f"residual {rms:.4g} rad/s after {found.nfev} steps ({'converged' if found.status else 'not yet'})",
    )


def _arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.identification.ordinary", description=__doc__)
    parser.add_argument("robots", nargs="*", metavar="ROBOT", choices=[*(robot.name for robot in robots()), []])
    parser.add_argument("--part", action="append", choices=PARTS, help="only these parts; repeatable")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    asked = _arguments(sys.argv[1:])
    print(measure(asked.robots, asked.part or PARTS).as_text())
