"""Many draws: coverage, efficiency and bias; impaired logs; starts far off; breakaway."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.identification.identify_log import COUNTING, Draws, cramer_rao
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.keys import BOX
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, RATE, excitation, noisy_draw, truth, with_friction

LOGS, IMPAIRED, STARTS, BREAKAWAYS = (scaled(n, 10) for n in (10_000, 1000, 1000, 200))
LATE, GAIN, DEAD = 0.013, 0.97, 0.15
WILD, WILD_SIZE = 0.02, 1.0
NUISANCES = ("latency", "gain", "dead_band")


def coverage(table: Table, robot: Robot, clean: Run) -> None:
    """(a) Many draws of noise: intervals, efficiency, bias. The Cramer-Rao bound is that of the log without noise."""
    least = cramer_rao(robot, clean)
    draws = Draws(truth(robot))
    for seed in range(LOGS):
        draws.add(identify(noisy_draw(clean, seed), robot, OutputError(nuisances=(), start="rest")).estimate)
    slack = 0.0 if WHOLE else COUNTING * np.sqrt(0.95 * 0.05 / LOGS)
    shared = {"draws": LOGS}
    low, high = draws.coverage.min(), draws.coverage.max()
    met = bool(low >= 0.942 - slack and high <= 0.958 + slack)
    table.add("0.942 to 0.958", met, what="coverage of six 95 % intervals, least", value=low, **shared)
    table.add("", None, what="... greatest", value=high, **shared)
    ratio = draws.spread / least
    table.add(
        "<= 1.06", ratio.max() <= 1.06 + slack * 10, what="std / Cramer-Rao, greatest", value=ratio.max(), **shared
    )
    worst = np.abs(draws.bias).max()
    table.add(
        "< 0.1", worst < 0.1 + (0 if not slack else 3 / np.sqrt(LOGS)), what="bias", value=worst, unit="std", **shared
    )


def starts(table: Table, robot: Robot, clean: Run) -> None:
    """(d) All six numbers wrong by factors of up to 100 either way."""
    log, rng = noisy_draw(clean, 0), np.random.default_rng(7)
    best = identify(log, robot, OutputError(nuisances=(), start="rest")).estimate
    good, true = 0, np.array(list(truth(robot).values()))
    for _ in range(STARTS):
        factor = np.exp(rng.uniform(-np.log(100.0), np.log(100.0), 6))
        fit = identify(log, with_friction(robot, true * factor), OutputError(nuisances=(), start="rest")).estimate
        good += all(abs(fit.value[key] - best.value[key]) < 0.1 * best.std[key] for key in BOX)
    share = good / STARTS
    table.add(
        ">= 0.999", share >= 0.999, what="starts up to 100x wrong that end at the best", draws=STARTS, value=share
    )


def impaired(table: Table, robot: Robot, clean: Run) -> None:
    """(c) Latency, gain and dead band unknown; 2 % wild samples; steps as large as the noise."""
    assert clean.voltage is not None
    applied = GAIN * np.sign(clean.voltage[:-1]) * np.maximum(np.abs(clean.voltage[:-1]) - DEAD, 0.0)
    fine = simulate(robot, np.repeat(applied, 10, axis=0), 1e-3)
    seen = np.arange(len(clean)) * 10 - round(LATE * 1e3)
    twist = np.where((seen >= 0)[:, None], fine.twist[np.maximum(seen, 0)], 0.0)
    draws, started = Draws(truth(robot) | {"latency.twist": LATE, "gain": GAIN, "dead_band": DEAD}), time.process_time()
    for seed in range(IMPAIRED):
        rng = np.random.default_rng(5000 + seed)
        noise = rng.normal(size=twist.shape) * NOISE
        noise += WILD_SIZE * rng.normal(size=twist.shape) * (rng.random(twist.shape) < WILD)
        log = Run(t=clean.t, voltage=clean.voltage, twist=np.round((twist + noise) / NOISE) * NOISE, source="impaired")
        draws.add(identify(log, robot, OutputError(nuisances=NUISANCES, start="rest", loss="student-t")).estimate)
    spent = (time.process_time() - started) / IMPAIRED * 1e3
    least = draws.coverage.min()
    table.add(
        ">= 0.92", least >= 0.92, what="coverage of nine intervals, least: impaired logs", draws=IMPAIRED, value=least
    )
    table.add(what="... bias, greatest", draws=IMPAIRED, value=np.abs(draws.bias).max(), unit="std")
    table.add(what="... one fit", draws=IMPAIRED, value=spent, unit="ms")


def breakaway(table: Table, robot: Robot, clean: Run) -> None:
    """(e) Breakaway of x at 1.0, 1.2 and 1.5 times coulomb in turn, a new programme for every draw."""
    key, held, widths = "friction.axes.breakaway[0]", 0, []
    coulomb = np.array(robot.friction.axes.coulomb)
    for seed in range(BREAKAWAYS):
        level = (1.0, 1.2, 1.5)[seed % 3] * coulomb[0]
        axes = robot.friction.axes.replace(breakaway=(float(level), *coulomb[1:].tolist()))
        true = robot.replace(friction=robot.friction.replace(axes=axes))
        log = noisy_draw(simulate(true, excitation(seed=100 + seed), 1.0 / RATE), seed)
        low, high = identify(log, robot, OutputError(nuisances=(), free=[*BOX, key], start="rest")).ci95[key]
        held += low <= level <= high
        widths.append((high - low) / coulomb[0])
    share = held / BREAKAWAYS
    table.add(">= 0.95", share >= 0.95, what="breakaway's interval holds the truth", draws=BREAKAWAYS, value=share)
    table.add(what="... its width, median", draws=BREAKAWAYS, value=float(np.median(widths)), unit="of coulomb")
