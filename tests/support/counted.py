"""Counts of a wheel by kinematics alone, and a motor on a bench by small steps; no code of omnidyn."""

from __future__ import annotations

from pathlib import Path

import numpy as np

ROW = 0.01  # [s]
TURN = 2048  # counts


def bench(seconds: float = 60.0, slope: float = 0.1, level: float = 0.35, lag: float = 0.12) -> tuple:
    """(t, volts, speed): volts = level sgn(speed) + slope (speed + lag d speed/dt), held from row to row; triangles."""
    t = np.arange(round(seconds / ROW)) * ROW
    up_and_down = 6.0 * np.abs((t / 10.0) % 2.0 - 1.0) * np.sign(np.sin(np.pi * t / 20.0 + 1e-9))
    volts = np.where(t < 40.0, up_and_down, np.where(t % 4.0 < 2.0, 4.0, -2.0))
    speed, x, fine = np.zeros(len(t)), 0.0, ROW / 20.0
    for k in range(1, len(t)):
        for _ in range(20):
            new = x + fine * (volts[k - 1] - slope * x) / (slope * lag)
            x = float(np.sign(new)) * max(0.0, abs(new) - fine * level / (slope * lag))
        speed[k] = x
    return t, volts, speed


def counts_of(speed: np.ndarray) -> np.ndarray:
    """Whole counts after each row; speed [rad/s], a row each ROW."""
    return np.round(np.cumsum(speed, axis=0) * ROW * TURN / (2.0 * np.pi))


def wandering(seed: int, rows: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """(t, counts) of a sound log: steps, reversals, slips, late and missing rows, jitter of the stamps."""
    draw = np.random.default_rng(seed)
    hold = int(draw.integers(8, 150))
    set_speed = np.repeat(draw.uniform(-1.0, 1.0, rows // hold + 1), hold)[:rows] * draw.choice([1.0, 20.0, 200.0])
    if seed % 2:
        set_speed = np.abs(set_speed) * np.where((np.arange(rows) // hold) % 2, -1.0, 1.0)
    share = draw.choice([0.1, 0.5, 1.0])
    speed = np.zeros(rows)
    for k in range(1, rows):
        speed[k] = speed[k - 1] + share * (set_speed[k] - speed[k - 1])
    for first in draw.integers(0, rows, 3):
        speed[first : first + int(draw.integers(2, 30))] *= draw.uniform(1.5, 5.0)
    t, counts = np.arange(rows) * ROW, counts_of(speed)
    fault = seed % 4
    if fault == 1:
        t = t + draw.uniform(-0.45, 0.45, rows) * ROW
    if fault == 2:
        keep = draw.random(rows) > 0.1
        t, counts = t[keep], counts[keep]
    if fault == 3:
        t, counts = np.delete(t, slice(700, 760)), np.delete(counts, slice(700, 760))
    return t, counts


def write_columns(path: Path, head: str, *columns: np.ndarray) -> Path:
    """A CSV file."""
    np.savetxt(path, np.column_stack(columns), delimiter=",", fmt="%.8g", comments="", header=head)
    return path
