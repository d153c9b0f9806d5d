"""Logs of the axebot to identify friction from, with noise of 0.02 m/s, 0.02 m/s and 0.10 rad/s."""

from __future__ import annotations

import numpy as np

from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot import Robot
from omnidyn.run import Run

NOISE = np.array([0.02, 0.02, 0.10])
SECONDS, RATE = 60.0, 100.0
MEMORY = 0.9  # correlation of neighbours of coloured noise
TRUTH = dict(zip(BOX, (0.94, 0.96, 0.01, 2.2, 1.5, 0.099), strict=True))
# The voltages that drive one axis, and how large they may be [V].
PATTERN, SIZE = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]]), np.array([4.5, 4.5, 2.5])


def excitation(seconds: float = SECONDS, rate: float = RATE, seed: int = 1) -> np.ndarray:
    """Voltages [V], shape (n, 3): levels held 0.3 to 1.2 s on one axis after the other and mixed, each third a ramp."""
    rng = np.random.default_rng(seed)
    n = round(seconds * rate)
    voltage, row, count = np.zeros((n, 3)), 0, 0
    while row < n:
        end = min(n, row + int(rng.uniform(0.3, 1.2) * rate))
        level = np.zeros(3)
        if count % 4 == 3:
            level = rng.uniform(-0.5, 0.5, 3) * SIZE
        else:
            level[count % 3] = rng.uniform(-1.0, 1.0) * SIZE[count % 3]
        shape = np.linspace(-1.0, 1.0, end - row) if count % 3 == 2 else np.ones(end - row)
        voltage[row:end] = shape[:, None] * (level @ PATTERN)
        row, count = end, count + 1
    return np.clip(voltage, -6.0, 6.0)


def voltages(rng: np.random.Generator, seconds: float = 30.0, rate: float = 100.0) -> np.ndarray:
    """The same drawn from a generator, and a level is a ramp by chance, with 0.3."""
    rows: list[np.ndarray] = []
    while sum(map(len, rows)) < seconds * rate:
        n, kind = int(rng.uniform(0.3, 1.2) * rate), len(rows) % 4
        level = np.zeros(3)
        if kind == 3:
            level = rng.uniform(-0.5, 0.5, 3) * SIZE
        else:
            level[kind] = rng.uniform(-1.0, 1.0) * SIZE[kind]
        shape = np.linspace(-1.0, 1.0, n) if rng.random() < 0.3 else np.ones(n)
        rows.append(shape[:, None] * (level @ PATTERN))
    return np.clip(np.concatenate(rows)[: round(seconds * rate)], -6.0, 6.0)


def noisy(run: Run, seed: int) -> Run:
    """Its voltage and twist as instruments with noise record them."""
    assert run.twist is not None
    twist = run.twist + np.random.default_rng(seed).normal(size=run.twist.shape) * NOISE
    return Run(t=run.t, voltage=run.voltage, twist=twist, source="simulated")


def noisy_draw(run: Run, number: int) -> Run:
    """The run with the noise of one of many draws, as benchmarks number them from 0."""
    return noisy(run, 1000 + number)


def coloured(run: Run, seed: int) -> Run:
    """The run with noise of the same size that remembers: each row takes MEMORY of the last one."""
    assert run.twist is not None
    fresh = np.random.default_rng(5000 + seed).normal(size=run.twist.shape) * NOISE
    errors = np.empty_like(fresh)
    errors[0] = fresh[0]
    for k in range(1, len(fresh)):
        errors[k] = MEMORY * errors[k - 1] + np.sqrt(1.0 - MEMORY**2) * fresh[k]
    return Run(t=run.t, voltage=run.voltage, twist=run.twist + errors, source="simulated")


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
