"""The log of all benchmarks of output error, the axebot's, and what is counted over many draws of its noise.

The log of EVIDENCE section 4: 60 s at 100 Hz, holds and ramps on the axes in turn, noise 0.02 m/s, 0.02 m/s,
0.10 rad/s. The seed of every draw is its number. OMNIDYN_BENCH_SHARE=0.05 does that share of the draws.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from omnidyn.identification.output_error import fit as whole
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot import Robot
from omnidyn.run import Run

fit_output_error = partial(whole.fit_output_error, nuisances=())  # but for those a row asks for

NOISE = np.array([0.02, 0.02, 0.10])
SECONDS, RATE = 60.0, 100.0
SHARE = float(os.environ.get("OMNIDYN_BENCH_SHARE", "1"))
COUNTING = 3.0  # standard errors of a counted share, granted where fewer than the full number of draws are done


def excitation(seconds: float = SECONDS, rate: float = RATE, seed: int = 1) -> np.ndarray:
    """Voltages [V], shape (n, 3): levels held 0.3 to 1.2 s on one axis after the other and mixed, each third a ramp."""
    rng = np.random.default_rng(seed)
    pattern, size = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]]), np.array([4.5, 4.5, 2.5])
    n = round(seconds * rate)
    voltage, row, count = np.zeros((n, 3)), 0, 0
    while row < n:
        end = min(n, row + int(rng.uniform(0.3, 1.2) * rate))
        level = np.zeros(3)
        if count % 4 == 3:
            level = rng.uniform(-0.5, 0.5, 3) * size
        else:
            level[count % 3] = rng.uniform(-1.0, 1.0) * size[count % 3]
        shape = np.linspace(-1.0, 1.0, end - row) if count % 3 == 2 else np.ones(end - row)
        voltage[row:end] = shape[:, None] * (level @ pattern)
        row, count = end, count + 1
    return np.clip(voltage, -6.0, 6.0)


def noisy(run: Run, seed: int) -> Run:
    """Its voltage and twist as instruments with noise record them."""
    assert run.twist is not None
    twist = run.twist + np.random.default_rng(1000 + seed).normal(size=run.twist.shape) * NOISE
    return Run(t=run.t, voltage=run.voltage, twist=twist, source="simulated")


def truth(robot: Robot) -> dict[str, float]:
    return {key: float(Key.parse(key).get(robot)) for key in BOX}


def with_friction(robot: Robot, values: np.ndarray) -> Robot:
    """The robot with these six numbers, in the order of BOX."""
    for key, value in zip(BOX, values, strict=True):
        robot = Key.parse(key).set(robot, float(value))
    return robot


def bare(run: Run) -> Run:
    """Its voltage and twist alone, without noise."""
    return Run(t=run.t, voltage=run.voltage, twist=run.twist, source="simulated")


def cramer_rao(robot: Robot, clean: Run) -> np.ndarray:
    """Least standard errors that any unbiased fit of this log has, from the log without noise. Shape (6,)."""
    fit = fit_output_error(bare(clean), robot, start="rest", covariance="white")
    noise = np.array(list(fit.noise.values()))
    return np.array([fit.std[key] for key in BOX]) / np.tile(noise / NOISE, 2)


class Draws:
    """Estimates of many draws against the truth, by name of the number."""

    def __init__(self, true: dict[str, float]):
        self.true = true
        self.error: list[list[float]] = []
        self.std: list[list[float]] = []
        self.held: list[list[bool]] = []

    def add(self, fit: OutputErrorEstimate) -> None:
        value, std, ci95 = dict(fit.value), dict(fit.std), dict(fit.ci95)
        for name, nuisance in fit.nuisances.items():
            value[name], std[name], ci95[name] = nuisance.value, nuisance.std, nuisance.ci95
        self.error.append([value[name] - true for name, true in self.true.items()])
        self.std.append([std[name] for name in self.true])
        self.held.append([ci95[name][0] <= true <= ci95[name][1] for name, true in self.true.items()])

    @property
    def coverage(self) -> np.ndarray:
        return np.mean(self.held, axis=0)

    @property
    def spread(self) -> np.ndarray:
        return np.std(self.error, axis=0)

    @property
    def bias(self) -> np.ndarray:
        return np.mean(self.error, axis=0) / self.spread


def cpu(call: Callable[[], object], repeats: int = 1) -> float:
    """Least processor time of a call [ms]."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append((time.process_time() - start) * 1e3)
    return min(times)
