"""The exact engine against 50 digits over 10,000 steps: Table 3 with three breakaway levels, and 50 random robots.

Nothing is cached: the truth is computed anew, in two processes. Draws whose outcome hangs on a difference below 1e-12
(a drive at the very edge of breakaway, or a nearly stopped axis between coulomb and breakaway) are rejected, counted
and replaced: there a double may fall either way.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.simulation.simulate import simulate
from tests.reference.reference import Physical, reference
from tests.support.robots import (
    TABLE_3,
    random_program,
    random_robot,
    random_steps,
    robot_of,
    table_3_voltages,
    with_breakaway,
)

STEPS, ROBOTS = 10_000, scaled(50)
BOUNDS = {"m/s": 1e-13, "rad/s": 1e-12, "heading rad": 1e-12, "position m": 1e-9}
GROUPS = ("random, steps of 1 ms", "random, steps of 1e-5 to 0.1 s")


def errors(p: Physical, voltage: np.ndarray, dt: np.ndarray) -> dict[str, float] | None:
    """The largest error of each kind, and how many samples rest in one but not in the other; None: rejected."""
    truth = reference(p, voltage, dt.tolist())
    if truth.edges:
        return None
    run = simulate(robot_of(p), voltage, dt)
    twist, pose = np.abs(run.twist - truth.twist).max(axis=0), np.abs(run.pose - truth.pose).max(axis=0)
    kinds = (twist[:2].max(), twist[2], pose[2], pose[:2].max())
    rest = int(((run.twist == 0.0) != (truth.twist == 0.0)).sum())
    return {**{name: float(error) for name, error in zip(BOUNDS, kinds, strict=True)}, "rest differs": rest}


def table_3(ratio: float) -> dict[str, float] | None:
    """Table 3's robot with breakaway = ratio * coulomb."""
    return errors(with_breakaway(TABLE_3, ratio), table_3_voltages(), np.full(STEPS, 1e-3))


def random(seed: int) -> tuple[dict[str, float] | None, int]:
    """A random robot and how many draws were rejected before it; the parity of the seed chooses the steps."""
    for rejected in range(100):
        p = random_robot(seed + 1000 * rejected)
        draw = seed + 1000 * rejected
        found = errors(p, random_program(draw, STEPS, len(p.azimuth_deg)), random_steps(draw, STEPS))
        if found:
            return found, rejected
    raise RuntimeError("a hundred draws in a row lie on an edge: the rule of rejection is wrong")


def measure() -> Table:
    """One row for each level of breakaway, one for each kind of random robot: the worst of its robots."""
    table = Table(
        f"accuracy: exact engine against 50 digits, {STEPS} steps a robot",
        ["robots", "count", "rejected", *BOUNDS, "rest differs"],
    )
    table.notes.append(machine())
    start = time.perf_counter()
    with ProcessPoolExecutor(os.cpu_count() or 1, mp_context=get_context("spawn")) as pool:
        fixed = {ratio: pool.submit(table_3, ratio) for ratio in (1.0, 1.25, 1.5)}
        drawn = list(pool.map(random, range(ROBOTS)))
        for ratio, future in fixed.items():
            row(table, f"Table 3, breakaway {ratio:g} x coulomb", [future.result()], 0)
    for parity, name in enumerate(GROUPS):
        group = drawn[parity::2]
        row(table, name, [found for found, _ in group], sum(rejected for _, rejected in group))
    table.notes.append(
        f"random robots: every number of Table 3 changed by up to 50 %, 3 to 6 wheels, seeds 0 to {ROBOTS - 1}"
    )
    table.notes.append(f"computed in {time.perf_counter() - start:.0f} s")
    return table


def row(table: Table, name: str, found: list[dict[str, float] | None], rejected: int) -> None:
    """The largest errors of a group beside their bounds."""
    kept = [errors for errors in found if errors]
    worst = {kind: max(errors[kind] for errors in kept) for kind in [*BOUNDS, "rest differs"]} if kept else {}
    met = bool(kept) and worst["rest differs"] == 0 and all(worst[kind] <= bound for kind, bound in BOUNDS.items())
    goal = ", ".join(f"{bound:.0e}" for bound in BOUNDS.values()) + ", 0"
    table.add(
        **{"robots": name, "count": len(kept), "rejected": rejected + len(found) - len(kept)} | worst,
        goal=goal,
        met=met,
    )
