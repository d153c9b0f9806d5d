"""The log of all benchmarks of output error, the axebot's, and what is counted over many draws of its noise.

The log of EVIDENCE section 4: 60 s at 100 Hz, holds and ramps on the axes in turn, noise 0.02 m/s, 0.02 m/s,
0.10 rad/s. The seed of every draw is its number. OMNIDYN_BENCH_SHARE=0.05 does that share of the draws.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.model.keys import BOX
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from tests.support.axebot_logs import NOISE, bare

COUNTING = 3.0  # standard errors of a counted share, granted where fewer than the full number of draws are done


def cramer_rao(robot: Robot, clean: Run) -> np.ndarray:
    """Least standard errors that any unbiased fit of this log has, from the log without noise. Shape (6,)."""
    fit = identify(bare(clean), robot, OutputError(nuisances=(), start="rest", covariance="white")).estimate
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
