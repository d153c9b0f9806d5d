"""Output error by the implicit engine: a robot with an ellipse of friction in a turning frame, seen late.

The log of the benchmark `identify`: 60 s at 100 Hz, noise 0.02 m/s, 0.02 m/s, 0.10 rad/s. The truth is simulated with a
row every millisecond at a tolerance of 1e-9 m/s, the instruments show it 13 ms late. Five numbers of friction and the
latency are free, and begin at factors of up to 1.5 from the truth. The seed of every draw is its number.
OMNIDYN_BENCH_SHARE=0.05 does that share of the draws.
"""

from __future__ import annotations

import time
from functools import cache

import numpy as np

from benchmarks.identification.identify_log import COUNTING, Draws
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.prepare import make_problem
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.problem.record import record
from omnidyn.identification.output_error.solve.solver import Solver
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, RATE, excitation, noisy_draw

LOGS = scaled(300, 10)
LATE, FINE_ROWS = 0.013, 10  # [s]; rows of the truth in a row of the log
WRONG = 1.5
KEYS = tuple(
    f"friction.direction.{name}" for name in ("coulomb[0]", "coulomb[1]", "viscous", "yaw_coulomb", "yaw_viscous")
)
LATENCY = "latency.twist"
TIGHT, SLOW = 1e-9, 1e-6  # [m/s] tolerances of the truth, and of the fit that the fast one is compared with


def ellipse() -> Robot:
    """The axebot with friction on the direction of travel, its frame turning with it."""
    robot = load_robot("axebot")
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    body = robot.body.replace(rotating_frame=True)
    return robot.replace(name="ellipse", body=body, friction=Friction(direction=direction))


@cache
def clean() -> Run:
    """The log without noise."""
    voltage = excitation()
    fine = simulate(ellipse(), np.repeat(voltage, FINE_ROWS, axis=0), 1.0 / RATE / FINE_ROWS, tol=TIGHT)
    assert fine.twist is not None
    seen = np.arange(len(voltage) + 1) * FINE_ROWS - round(LATE * RATE * FINE_ROWS)
    twist = np.where((seen >= 0)[:, None], fine.twist[np.maximum(seen, 0)], 0.0)
    held = np.vstack([voltage, voltage[-1:]])
    return Run(t=np.arange(len(held)) / RATE, voltage=held, twist=twist, source="simulated")


def begun(seed: int) -> Robot:
    """The robot with all free numbers wrong by up to a factor of WRONG either way."""
    robot, rng = ellipse(), np.random.default_rng(9000 + seed)
    for key, factor in zip(KEYS, np.exp(rng.uniform(-np.log(WRONG), np.log(WRONG), len(KEYS))), strict=True):
        robot = Key.parse(key).set(robot, float(Key.parse(key).get(robot)) * float(factor))
    return robot


def fitted(run: Run, start: Robot) -> OutputErrorEstimate:
    return identify(run, start, OutputError(free=KEYS, nuisances=("latency",), start="rest")).estimate


def truth() -> dict[str, float]:
    return {key: float(Key.parse(key).get(ellipse())) for key in KEYS} | {LATENCY: LATE}


def bound() -> np.ndarray:
    """Cramer-Rao: standard errors at the truth, for the noise that there is, by derivatives at tol SLOW."""
    solver = _solver(clean(), SLOW)
    values = np.array([truth()[name] for name in solver.problem.names])
    state = solver.problem.start().states
    (found,) = solver.engine.sums(Point(values, state), Weighting(np.ones(len(solver.problem.columns))))
    count = len(values)
    information = np.tensordot(1.0 / NOISE**2, found.info[:, :count, :count], 1)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def _solver(run: Run, tol: float) -> Solver:
    given = OutputError(free=KEYS, nuisances=("latency",), start="rest")
    problem = make_problem([record(run, ellipse())], ellipse(), given)
    return Solver(problem, ImplicitEngine(problem, tol))


def measure() -> Table:
    """All of it, about four minutes."""
    table = Table("identify_ellipse: output error by the implicit engine", ["what", "draws", "value", "unit"])
    table.notes += [machine(), "times: processor time of this process, everything compiled"]
    fitted(noisy_draw(clean(), 0), begun(0))  # compiles
    _draws(table)
    _slow(table)
    return table


def _draws(table: Table) -> None:
    """Time, coverage, efficiency and bias over many draws of noise and start."""
    draws, spent = Draws(truth()), []
    for seed in range(LOGS):
        log, start = noisy_draw(clean(), seed), begun(seed)
        began = time.process_time()
        fit = fitted(log, start)
        spent.append(time.process_time() - began)
        draws.add(fit)
    shared, middle = {"draws": LOGS}, float(np.median(spent))
    table.add("<= 0.5", middle <= 0.5, what="fit of one log of 60 s, median", value=middle, unit="s", **shared)
    table.add(what="... slowest of twenty", value=float(np.quantile(spent, 0.95)), unit="s", **shared)
    slack = COUNTING * np.sqrt(0.95 * 0.05 / LOGS)
    low, high = draws.coverage.min(), draws.coverage.max()
    goal = f"0.942 to 0.958, +- {slack:.3f} of counting"
    table.add(goal, low >= 0.942 - slack, what="coverage of six 95 % intervals, least", value=low, **shared)
    table.add(goal, high <= 0.958 + slack, what="... greatest", value=high, **shared)
    table.add(what="... of all six together", value=draws.coverage.mean(), **shared)
    ratio, slack = (draws.spread / bound()), COUNTING / np.sqrt(2.0 * LOGS)
    goal = f"<= 1.06, + {slack:.2f} of counting"
    table.add(goal, ratio.max() <= 1.06 + slack, what="std / Cramer-Rao, greatest", value=ratio.max(), **shared)
    table.add(what="... mean of six", value=ratio.mean(), **shared)
    worst, slack = np.abs(draws.bias).max(), COUNTING / np.sqrt(LOGS)
    goal = f"< 0.1, + {slack:.2f} of counting"
    table.add(goal, worst < 0.1 + slack, what="bias, greatest", value=worst, unit="std", **shared)


def _slow(table: Table) -> None:
    """What the tolerance of the fit leaves: on the log without noise, and beside fits at SLOW on a few logs."""
    least = bound()
    fit = fitted(clean(), ellipse())
    error = np.abs(np.array([*fit.value.values(), fit.nuisances[LATENCY].value]) - list(truth().values())) / least
    table.add("< 0.1", error.max() < 0.1, what="systematic error: log without noise", value=error.max(), unit="std")
    away = []
    for seed in range(min(LOGS, 10)):
        log = noisy_draw(clean(), seed)
        fit, solver = fitted(log, begun(seed)), _solver(log, SLOW)
        own = np.array([*fit.value.values(), fit.nuisances[LATENCY].value])
        slow = solver.minimise(Point(own, solver.problem.start().states)).state.point.values
        away.append(float((np.abs(own - slow) / least).max()))
    shared = {"draws": len(away), "unit": "std"}
    table.add(what=f"distance from a fit at {SLOW:g} m/s, median", value=float(np.median(away)), **shared)
    table.add(what="... greatest", value=max(away), **shared)
