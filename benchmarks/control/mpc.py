"""The model predictive controller: what a step costs, whether it is the optimum, and how near to a path it stays.

The references, their conditions and the goals are those of ../shared/peers/mpc, where other solvers and controllers
were measured; where that folder is found they run here too, else IPOPT's errors there are quoted. ONE setting of the
controller, its default, in every row.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import omnidyn
from benchmarks.control.araujo import Araujo
from benchmarks.control.mpc_c import c_rows
from benchmarks.control.mpc_peers import ipopt_errors, peer_rows
from benchmarks.size import scaled
from benchmarks.table import Table, machine, one_core
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.mpc.settings import Settings
from omnidyn.control.paths.path import path
from omnidyn.control.pid import Pid
from omnidyn.simulation.live import LiveRobot
from tests.support.mpc_programs import Solver, dense, random_program, residual, reweighed

ROBOT = omnidyn.load_robot("axebot")
PATHS = {
    "eight": "eight:size_m=0.6,period_s=6",
    "slow8": "eight:size_m=0.25,period_s=12",
    "square": "square:side_m=0.8,speed_m_s=0.5",
    "spin": "circle:radius_m=0.5,speed_m_s=0.5,turn_rad_s=2",
    "zigzag": "zigzag:speed_m_s=0.15,period_s=4,lag_s=0.3,turn_rad_s=1",
    "fast8": "eight:size_m=0.6,period_s=3.2",
    "fsquare": "square:side_m=0.8,speed_m_s=1.2",
    "fspin": "circle:radius_m=0.5,speed_m_s=1.1,turn_rad_s=4",
}
CONDITIONS = {  # friction of the plant, noise [m/s], push [m/s^2, m/s^2, rad/s^2], goal of the geometric mean [mm]
    "exact plant": (1.0, 0.0, (0.0, 0.0, 0.0), 0.65),
    "friction 30 % lower": (0.7, 0.0, (0.0, 0.0, 0.0), 0.8),
    "friction 30 % higher": (1.3, 0.0, (0.0, 0.0, 0.0), 1.2),
    "noise": (1.0, 0.01, (0.0, 0.0, 0.0), 2.7),
    "noise, friction 20 % higher, push": (1.2, 0.01, (0.3, -0.2, 0.5), 3.3),
}
IPOPT = {"fast8": 11.21, "fsquare": 7.73, "fspin": 10.84}  # mm over the first 3.2 s, tanh 0.02
NOISE = np.array([0.2, 0.2, 0.4, 1.0, 1.0, 4.0])
REPEATS, DT = 3, 0.02
COLD = scaled(100_000, 100)
EDGES = scaled(20_000, 100)
COLUMNS = ["what", "value", "unit", "more"]


def plant_of(share: float, hold: float | None = None) -> Any:
    """The robot with so much of its Coulomb friction; hold: its breakaway, over that."""
    axes = ROBOT.friction.axes
    levels = tuple(share * each for each in axes.coulomb)
    axes = axes.replace(coulomb=levels, breakaway=None if hold is None else tuple(hold * each for each in levels))
    return ROBOT.replace(friction=ROBOT.friction.replace(axes=axes))


def closed_loop(
    controller: Any,
    name: str,
    seconds: float,
    *,
    share: float = 1.0,
    noise: float = 0.0,
    push: Any = (0.0, 0.0, 0.0),
    delay: int = 0,
    seed: int = 0,
    pose: Any = None,
    dt: float = DT,
    hold: float | None = None,
    early: int = 0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States (n + 1, 6), errors of the pose (n + 1, 3) and times of the steps [us], from rest on the path.

    early: steps for which the loop runs before the path begins.
    """
    along = path(PATHS.get(name, name))
    wrench = tuple(np.array(push) * [ROBOT.body.mass, ROBOT.body.mass, ROBOT.body.inertia])
    live = LiveRobot(
        plant_of(share, hold), dt, pose=along.at(0.0).pose if pose is None else pose, delay=delay, push=wrench
    )
    count, rng = round(seconds / dt), np.random.default_rng(seed)
    for k in range(-early, 0):
        live.step(controller.step(k * dt, live.pose.copy(), live.twist.copy(), along))
    states, took = [np.concatenate([live.pose, live.twist])], []
    for k in range(count):
        seen = states[-1] + noise * NOISE * rng.standard_normal(6)
        one, two = seen[:3].copy(), seen[3:].copy()
        begun = time.perf_counter()
        sent = controller.step(k * dt, one, two, along)
        took.append(time.perf_counter() - begun)
        live.step(sent)
        states.append(np.concatenate([live.pose, live.twist]))
    every = np.array(states)
    return every, every[:, :3] - along.at(np.arange(count + 1) * dt).pose, np.array(took) * 1e6


def rmse(errors: np.ndarray, skip: float = 0.5, dt: float = DT) -> float:
    """Error of the position after `skip` [mm]."""
    return float(1e3 * np.sqrt((errors[round(skip / dt) + 1 :, :2] ** 2).sum(axis=1).mean()))


def mean(values: list[float]) -> float:
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def step_times(make: Callable[[], Any], name: str, seconds: float = 3.0, dt: float = 0.01) -> tuple[float, float]:
    """(median, p99) of the least time of each step over repeated runs [us]."""
    runs = [closed_loop(make(), name, seconds, dt=dt)[2] for _ in range(REPEATS + 1)]
    least = np.min(runs[1:], axis=0)
    return float(np.median(least)), float(np.percentile(least, 99))


def time_rows(table: Table) -> None:
    """Time of a step, Python call included."""
    for n, goal, late in ((20, 14.0, 30.0), (50, 25.0, None)):
        median, p99 = step_times(lambda n=n: Mpc(ROBOT, dt=0.01, horizon=n), "eight")
        table.add(f"<= {goal:g}", median <= goal, what=f"step, {n} ahead, median", value=median, unit="us")
        words = f"<= {late:g}" if late else ""
        table.add(words, p99 <= late if late else None, what=f"step, {n} ahead, p99", value=p99, unit="us")
    base = step_times(lambda: Mpc(ROBOT, dt=0.01), "eight")[0]
    peer_rows(table, base)
    for name, settings in (
        ("current 3 A", Settings(current=3.0)),
        ("slew 200 V/s", Settings(slew=200.0)),
        ("speed 0.5 m/s", Settings(speed=(0.5, 0.5, 5.0))),
    ):
        median, p99 = step_times(lambda settings=settings: Mpc(ROBOT, dt=0.01, settings=settings), "eight")
        table.add(what=f"limit of {name} more", value=median - base, unit="us", more=f"p99 {p99:.0f}")


def peers() -> dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]:
    """Solvers of dense programs that are installed: (H, f) -> inputs within 6 V."""
    found: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {}
    if importlib.util.find_spec("daqp"):
        import daqp

        def by_daqp(hessian: np.ndarray, slope: np.ndarray) -> np.ndarray:
            n = len(slope)
            high, none = np.full(n, 6.0), np.zeros((0, n))
            return daqp.solve(hessian, slope, none, high, -high, np.zeros(n, dtype=np.intc))[0]

        found["DAQP"] = by_daqp
    if importlib.util.find_spec("osqp"):
        import osqp
        from scipy import sparse

        def by_osqp(hessian: np.ndarray, slope: np.ndarray) -> np.ndarray:
            n = len(slope)
            solver = osqp.OSQP()
            solver.setup(
                sparse.csc_matrix(np.triu(hessian)),
                slope,
                sparse.eye(n, format="csc"),
                np.full(n, -6.0),
                np.full(n, 6.0),
                verbose=False,
                eps_abs=1e-4,
                eps_rel=1e-4,
            )
            return solver.solve().x

        found["OSQP, set-up included"] = by_osqp
    return found


def least(call: Callable[[], Any]) -> tuple[float, Any]:
    """(least time of three calls [us], what the last returned)."""
    best, result = np.inf, None
    for _ in range(3):
        begun = time.perf_counter()
        result = call()
        best = min(best, time.perf_counter() - begun)
    return best * 1e6, result


def solver_rows(table: Table, count: int = 300) -> None:
    """The solver alone, on programs near the path, cold: for others the dense matrices are made beforehand."""
    rng, solver = np.random.default_rng(20), Solver(20, 3)
    programs = [random_program(rng, 0.2) for _ in range(count)]
    matrices = [dense(each) for each in programs]
    solver.solve(programs[0])
    own = float(np.median([least(lambda each=each: solver.solve(each))[0] for each in programs]))
    table.add(what="solver alone, cold, 20 ahead", value=own, unit="us")
    for name, solve in peers().items():
        other = float(np.median([least(lambda each=each, solve=solve: solve(*each))[0] for each in matrices]))
        table.add(what=f"{name} alone, condensed for it", value=other, unit="us", more=f"{other / own:.1f} times")


def cold_rows(table: Table, count: int = COLD) -> None:
    """Random states up to five metres off, each from nothing, beside DAQP."""
    solver, rng = Solver(20, 3), np.random.default_rng(21)
    by_daqp, times = peers().get("DAQP"), np.zeros(count)
    solver.solve(random_program(rng, 1.0))
    worst = other_worse = wrong = 0.0
    for k in range(count):
        program = random_program(rng, float(rng.choice([0.2, 1.0, 5.0])))
        times[k], (u, _) = least(lambda program=program: solver.solve(program))
        if by_daqp is None:
            continue
        hessian, slope = dense(program)
        theirs = by_daqp(hessian, slope)
        off = np.abs(theirs - u.ravel()).max()
        if off < 1e-6:
            worst = max(worst, off)
        elif residual(program, hessian, slope, u) < residual(program, hessian, slope, theirs):
            other_worse += 1
        else:
            wrong += 1
    table.add(
        "0",
        wrong == 0,
        what=f"wrong of {count}, up to 5 m off",
        value=wrong,
        unit="",
        more=f"{other_worse:.0f} times DAQP is off; else within {worst:.0e} V",
    )
    p99, most = float(np.percentile(times, 99)), float(times.max())
    table.add(
        "<= 200", p99 <= 200.0, what="cold solve, p99", value=p99, unit="us", more=f"median {np.median(times):.0f}"
    )
    table.add("<= 400", most <= 400.0, what="cold solve, worst", value=most, unit="us")


def edge_rows(table: Table, count: int = EDGES) -> None:
    """Far from the path, up to 1000 km, and with weights apart by up to 1e18: who is off says so."""
    rng, wheels = np.random.default_rng(22), {"axebot": 3, "four-wheel": 4, "mecanum": 4}
    solvers = {name: Solver(20, number) for name, number in wheels.items()}
    off, told, worst = 0, 0, 0.0
    for k in range(count):
        robot, kind = [*wheels][k % 3], k // 3 % 4
        scale = 10.0 ** rng.uniform(*((0.0, 0.0), (-1.0, 2.0), (2.0, 6.0), (-1.0, 1.0))[kind])
        program = random_program(rng, scale, robot=robot)
        if kind == 3:
            program = reweighed(program, 10.0 ** rng.uniform(-6.0, 6.0, 3))
        u, passes = solvers[robot].solve(program)
        if not np.isfinite(u).all() or solvers[robot].is_inaccurate(program, passes):
            told += 1
            continue
        error = residual(program, *dense(program), u)
        off, worst = off + (error > 1e-6), max(worst, error)
    more = f"{told} say that they are inaccurate; the others within {worst:.0e} V"
    table.add("0", off == 0, what=f"wrong with status ok, of {count} at the edge", value=off, unit="", more=more)


def tracking_rows(table: Table) -> None:
    """Errors over the eight references, and of those that saturate beside IPOPT's."""
    for words, (share, noise, push, goal) in CONDITIONS.items():
        found = [rmse(closed_loop(Mpc(ROBOT), name, 8.0, share=share, noise=noise, push=push)[1]) for name in PATHS]
        value = mean(found)
        each = " ".join(f"{one:.2f}" for one in found)
        table.add(f"<= {goal:g}", value <= goal, what=f"tracking, {words}", value=value, unit="mm", more=each)
    others: dict[str, Callable[[], Any]] = {
        "mpc_no_friction": lambda: Mpc(ROBOT, friction=False),
        "mpc_no_observer": lambda: Mpc(ROBOT, observer=False),
        "pid": lambda: Pid(ROBOT, dt=DT),
    }
    for name, make in others.items():
        value = mean([rmse(closed_loop(make(), way, 8.0)[1]) for way in PATHS])
        table.add(what=f"tracking, exact plant, {name}", value=value, unit="mm")
    here = ipopt_errors()
    for name, quoted in IPOPT.items():
        value = rmse(closed_loop(Mpc(ROBOT), name, 3.2)[1])
        own = step_times(lambda: Mpc(ROBOT), name, 3.2, DT)[0]
        ipopt, theirs = here.get(name, (quoted, float("nan")))
        table.add(
            f"<= {1.05 * ipopt:.2f}",
            value <= 1.05 * ipopt,
            what=f"saturating: {name}, 3.2 s",
            value=value,
            unit="mm",
            more=f"IPOPT {ipopt:.2f}{'' if name in here else ', quoted'}, {value / ipopt - 1.0:+.1%}",
        )
        table.add("<= 33", own <= 33.0, what=f"a step there: {name}", value=own, unit="us")
        if name in here:
            table.add(">= 100", theirs >= 100.0 * own, what=f"IPOPT over it: {name}", value=theirs / own, unit="times")


def rest_rows(table: Table) -> None:
    """Coming to rest inside the dead zone; a delay that is known."""
    states, errors, _ = closed_loop(Mpc(ROBOT), "goal:x_m=0,y_m=0,heading_rad=0", 3.0, pose=(0.03, -0.02, 0.1))
    off, turned = 1e3 * float(np.hypot(*errors[-1, :2])), 1e3 * abs(float(errors[-1, 2]))
    table.add("< 0.1", off < 0.1, what="rest inside the dead zone", value=off, unit="mm")
    table.add("< 0.5", turned < 0.5, what="its heading", value=turned, unit="mrad")
    still = bool(np.all(states[-50:, 3:] == 0.0))
    table.add(
        "0", still, what="greatest speed in its last second", value=float(np.abs(states[-50:, 3:]).max()), unit=""
    )
    states = closed_loop(Mpc(ROBOT), "goal:x_m=0,y_m=0,heading_rad=0", 6.0, pose=(0.03, -0.02, 0.1), hold=1.4)[0]
    swing = 1e3 * float(np.hypot(*np.ptp(states[-100:, :2], axis=0)))
    table.add(what="rest, breakaway 1.4 x Coulomb: peak to peak, last 2 s", value=swing, unit="mm")


def delay_rows(table: Table) -> None:
    """What a delay that is known costs: of a loop that runs while the robot waits, and of one that starts too late."""
    base = mean([rmse(closed_loop(Mpc(ROBOT), name, 8.0)[1]) for name in PATHS])
    for delay in (1, 2):
        for early, words in ((delay, "the loop begins before the path"), (0, "the loop begins with the path")):
            runs = [closed_loop(Mpc(ROBOT, delay=delay), name, 8.0, delay=delay, early=early)[1] for name in PATHS]
            cost = 100.0 * (mean([rmse(each) for each in runs]) / base - 1.0)
            table.add("<= 10", cost <= 10.0, what=f"delay of {delay} steps, {words}", value=cost, unit="%")


def araujo_rows(table: Table) -> None:
    """The MPC of Araujo et al. at the same time between steps, on each reference."""
    if importlib.util.find_spec("clarabel") is None:
        table.notes.append("no clarabel: nothing of Araujo et al.")
        return
    theirs, took = {}, []
    for name in PATHS:
        _, errors, times = closed_loop(Araujo(ROBOT), name, 8.0)
        theirs[name] = rmse(errors)
        took.append(float(np.median(times)))
    own = {name: rmse(closed_loop(Mpc(ROBOT), name, 8.0)[1]) for name in PATHS}
    worst = max(own[name] / theirs[name] for name in PATHS)
    each = " ".join(f"{one:.1f}" for one in theirs.values())
    table.add(
        "< 1",
        worst < 1.0,
        what="our error over Araujo's, the worst of eight",
        value=worst,
        unit="",
        more=f"theirs {each} mm, {mean(list(theirs.values())):.1f} in the mean; {np.median(took):.0f} us a step",
    )


def measure() -> Table:
    """All figures, each with its goal."""
    table = Table("Model predictive control", COLUMNS, notes=[f"{machine()}. 20 steps of 20 ms unless said otherwise"])
    with one_core():
        for rows in (time_rows, solver_rows, tracking_rows, rest_rows, delay_rows, araujo_rows, cold_rows, edge_rows):
            rows(table)
        c_rows(table, ROBOT)
    return table
