"""Fits to counts of encoders and to positions, and on a tilted floor: coverage and efficiency on simulated logs.

The axebot and the voltages of identify.py, 60 s at 100 Hz; 20 s where its frame turns. The seed of every
draw is its number. OMNIDYN_BENCH_SHARE=0.05 does that share of the draws.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.identification.identify_log import Draws
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table, machine
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.kernel.counts import information
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.model.keys import BOX
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation, truth
from tests.support.rolled_logs import CAPTURE, captured_log, counted_log
from tests.support.rolled_logs import rolled as independent

TICKED, TILTED, CAPTURED = (scaled(n, 10) for n in (300, 200, 200))
COUNTS, JITTERS = (64, 512, 2048), (0.3, 0.0)  # counts a turn; noise before the encoder rounds, in ticks
SLOPE = np.radians(1.0)
IMPLICIT, PROGRAMS = scaled(100, 10), 8  # draws of the implicit engine, and the runs that they are of


def measure() -> Table:
    """All of it, about eight minutes."""
    table = Table("outputs: counts, positions and a tilted floor", ["what", "draws", "value", "unit"])
    table.notes += [machine(), "worst of the six friction numbers, unless said otherwise"]
    robot = load_robot("axebot")
    for counts in COUNTS:
        for jitter in JITTERS:
            _ticks(table, robot, counts, jitter)
    _pose(table, robot)
    _tilt(table, robot)
    _implicit(table, robot.replace(body=robot.body.replace(rotating_frame=True)))
    return table


def _implicit(table: Table, robot: Robot) -> None:
    """Both on a robot as `omnidyn init` makes it, which the implicit engine fits; runs by DOP853, latencies free."""
    runs = [independent(robot, excitation(20.0, seed=seed), 0.01) for seed in range(scaled(PROGRAMS))]
    for what in ("2048 counts a turn", "pose by motion capture"):
        draws = Draws(truth(robot))
        for seed in range(IMPLICIT):
            run, angle = runs[seed % len(runs)]
            log = counted_log(run, angle, seed) if "counts" in what else captured_log(run, seed)
            draws.add(identify(log, robot, OutputError(nuisances=(), start="rest")).estimate)
        z = np.asarray(draws.error) / np.asarray(draws.std)
        name = f"turning frame, {what}"
        _cover(table, name, draws, IMPLICIT)
        spread = float(np.sqrt(np.mean(z**2)))
        table.add(
            "0.9 to 1.1",
            0.9 <= spread <= 1.1 if WHOLE else None,
            what="... rms of all z-scores",
            draws=IMPLICIT,
            value=spread,
        )


def rolled(robot: Robot, voltage: np.ndarray, dt: float) -> tuple[Run, np.ndarray]:
    """A run, and the angles of its wheels [rad], shape (rows, wheels): its path, heading kept, and turn.

    Axes do not couple: with a yaw that sticks, the path of simulate is the integral of the speeds in the body frame.
    """
    run = simulate(robot, voltage, dt)
    levels = (*robot.friction.axes.coulomb[:2], 1e5)
    axes = robot.friction.axes.replace(coulomb=levels)
    straight = simulate(robot.replace(friction=robot.friction.replace(axes=axes)), voltage, dt)
    assert run.pose is not None
    assert straight.pose is not None
    path = np.column_stack([straight.pose[:, :2], run.pose[:, 2]])
    return run, wheel_speed(robot.wheels, path)


def counted(angle: np.ndarray, tick: float, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """What encoders show that start anywhere within a tick and round down."""
    noise = jitter * tick * rng.standard_normal(angle.shape)
    return np.floor((angle + noise + rng.uniform(0.0, tick, angle.shape[1])) / tick) * tick


def least_std(log: Run, robot: Robot, tick: float, deviation: float) -> np.ndarray:
    """Cramer-Rao bound of the six friction numbers: slopes at the truth, Fisher's information of a row of counts."""
    given = OutputError(nuisances=(), start="rest", tick_rad=tick)
    problem = make_problem(read_records([log], robot, given), robot, given)
    ((_, slopes),) = ExactEngine(problem).outputs(problem.start())
    of_row = information(np.full(3, deviation**2), np.full(3, tick))[0] / deviation**2
    whole = np.einsum("kcp,kcq,c->pq", slopes, slopes, of_row)
    seen = np.diag(whole) > 0.0
    return np.sqrt(np.diag(np.linalg.inv(whole[np.ix_(seen, seen)])))[:6]


def _ticks(table: Table, robot: Robot, counts: int, jitter: float) -> None:
    """Logs of ticks alone: the likelihood of counts, and Gauss's on the same logs."""
    run, angle = rolled(robot, excitation(), 0.01)
    tick, ways = 2.0 * np.pi / counts, {"counts": None, "Gauss": 0.0}
    draws = {way: Draws(truth(robot)) for way in ways}
    log = Run(t=run.t, voltage=run.voltage, wheel_angle=angle)
    for seed in range(TICKED):
        shown = counted(angle, tick, jitter, np.random.default_rng(seed))
        log = Run(t=run.t, voltage=run.voltage, wheel_angle=shown, source="ticks")
        for way, given in ways.items():
            draws[way].add(identify(log, robot, OutputError(nuisances=(), start="rest", tick_rad=given)).estimate)
    name = f"{counts} counts a turn, noise {jitter:g} ticks"
    for way in ways:
        least = draws[way].coverage.min()
        met = bool(least >= 0.92 - (0.0 if WHOLE else 0.2)) if way == "counts" else None
        table.add(
            ">= 0.92" if way == "counts" else "",
            met,
            what=f"{name}: coverage by {way}, least",
            draws=TICKED,
            value=least,
        )
    gain = draws["Gauss"].spread / draws["counts"].spread
    table.add(what="... std by Gauss / std by counts, median", draws=TICKED, value=float(np.median(gain)))
    if jitter:
        ratio = draws["counts"].spread / least_std(log, robot, tick, jitter * tick)
        met = bool(ratio.max() <= 1.1 + (0.0 if WHOLE else 0.5))
        table.add("<= 1.1", met, what="... std / Cramer-Rao, greatest", draws=TICKED, value=ratio.max())


def _pose(table: Table, robot: Robot) -> None:
    """Motion capture alone: white noise on the pose."""
    run, draws = simulate(robot, excitation(), 0.01), Draws(truth(robot))
    assert run.pose is not None
    for seed in range(CAPTURED):
        pose = run.pose + CAPTURE * np.random.default_rng(seed).standard_normal(run.pose.shape)
        draws.add(
            identify(
                Run(t=run.t, voltage=run.voltage, pose=pose), robot, OutputError(nuisances=(), start="rest")
            ).estimate
        )
    _cover(table, "pose by motion capture alone", draws, CAPTURED)


def _tilt(table: Table, robot: Robot) -> None:
    """A floor of 1 degree under a robot that turns: friction and force, and what becomes of friction without."""
    force = (float(robot.body.mass * 9.81 * np.sin(SLOPE)), 0.0)
    voltage = excitation()
    run = simulate(robot, voltage, 0.01, log=LogEffects(tilt=force))
    assert run.twist is not None
    true = truth(robot) | {f"tilt.{axis}": float(f) for axis, f in zip("xy", force, strict=True)}
    known, ignored = Draws(true), Draws(truth(robot))
    held = np.vstack([voltage, voltage[-1:]])
    for seed in range(TILTED):
        twist = run.twist + NOISE * np.random.default_rng(seed).standard_normal(run.twist.shape)
        log = Run(t=run.t, voltage=held, twist=twist, source="tilted")
        known.add(identify(log, robot, OutputError(nuisances=("tilt",), start="rest")).estimate)
        ignored.add(identify(log, robot, OutputError(nuisances=(), start="rest")).estimate)
    _cover(table, "floor tilted by 1 degree, six numbers and the force", known, TILTED)
    table.add(what="... force along x, std", draws=TILTED, value=known.spread[6], unit="N")
    shift = _shares(ignored, BOX[:1] + BOX[3:4])
    table.add(what="... tilt ignored: viscous x off by", draws=TILTED, value=shift[0], unit="%")
    table.add(what="... tilt ignored: coulomb x off by", draws=TILTED, value=shift[1], unit="%")
    table.add(what="... tilt ignored: coverage, least", draws=TILTED, value=ignored.coverage.min())


def _cover(table: Table, what: str, draws: Draws, number: int) -> None:
    least = draws.coverage.min()
    met = bool(least >= 0.92 - (0.0 if WHOLE else 0.2))
    table.add(">= 0.92", met, what=f"{what}: coverage, least", draws=number, value=least)
    table.add(what="... bias, greatest", draws=number, value=np.abs(draws.bias).max(), unit="std")


def _shares(draws: Draws, keys: Sequence[str]) -> list[float]:
    """Mean error of numbers in percent of the truth."""
    names = list(draws.true)
    error = np.mean(draws.error, axis=0)
    return [100.0 * float(error[names.index(key)]) / draws.true[key] for key in keys]
