"""Campaigns: shards beside the bare batch kernel, a million closed loops, what a shard costs on each executor."""

from __future__ import annotations

import contextlib
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table import Table, machine
from omnidyn.campaigns.sweep import run_shard, sweep
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.batch.sample import sample
from tests.support.campaign_tasks import index

ROBOT, SECONDS, DT = "axebot", 2.0, 1e-3
ROBOTS, LOOPS, ROUNDS = 16_384, 1_000_000, 5
EMPTY, MANY, GOAL_MS = 200, 10_000, 10.0  # shards that do nothing; the goal of a shard of MANY
FACTORS = {"wheels.wheel_radius_m": (0.9, 1.1), "friction": (0.4, 2.0)}
VARY = {name: {"factor": list(ends)} for name, ends in FACTORS.items()}
VOLTS = [0.0, 3.0, -3.0]
LOOPED = ("axebot", "mecanum")  # robots of the exact engine, and of fixed steps


def measure() -> Table:
    """One table, of rows that have little in common."""
    table = Table("campaigns", ["what", "work", "value", "unit"])
    table.notes.append(machine())
    with tempfile.TemporaryDirectory() as folder:
        _throughput(table, Path(folder))
        _overhead(table, Path(folder))
        for robot in LOOPED:
            _million(table, Path(folder), robot)
    return table


def _throughput(table: Table, folder: Path) -> None:
    """A shard of a second beside the kernel under the same rows, in turns, one thread, processor time."""
    simulation = {"voltage_V": VOLTS, "dt_s": DT, "duration_s": SECONDS}
    few = ["final_vx_m_s", "drift_m", "turned_rad"]
    spec = {"schema": 1, "robot": ROBOT, "samples": ROUNDS * ROBOTS, "shard_rows": ROBOTS, "vary": VARY}
    robots = sample(load_robot(ROBOT), ROBOTS, factors=FACTORS)
    rows = np.tile(VOLTS, (round(SECONDS / DT), 1))
    with ThreadPoolExecutor(1) as threads:  # a part without shards: only its folder is made
        sweep(spec | {"simulate": simulation, "metrics": few}, folder / "t", executor=threads, shard=(1, 1000))
    kernel, shards = [], []
    for k in range(ROUNDS):
        kernel.append(_processor(lambda: simulate_batch(robots, rows, DT, threads=1)))
        shards.append(_processor(lambda k=k: run_shard(str(folder / "t"), k, None)))
    ratio = min(kernel) / min(shards)
    work = f"{ROBOTS} robots x {len(rows)} rows"
    table.add(what="batch kernel", work=work, value=min(kernel), unit="s")
    table.add("at least 0.9 of the kernel", ratio >= 0.9, what="a shard", work=work, value=min(shards), unit="s")
    table.add(what="kernel by shard", work=work, value=ratio, unit="")


def _processor(call: Any) -> float:
    begun = time.process_time()
    call()
    return time.process_time() - begun


def _million(table: Table, folder: Path, robot: str) -> None:
    """Which tolerance of radius and friction keeps 5 mm: a million loops of pid along an eight, two processes."""
    track = {"path": "eight", "controller": "pid", "duration_s": SECONDS}
    spec = {"schema": 1, "robot": robot, "samples": LOOPS, "vary": VARY, "track": track}
    begun = time.perf_counter()
    campaign = sweep(spec, folder / robot, workers=2)
    took = time.perf_counter() - begun
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 if sys.platform == "darwin" else 1024) / 1024
    share, low, high = campaign.within(0.005)
    work = f"{LOOPS} loops of {robot} x {SECONDS:g} s, 2 processes"
    table.add("at most 10 minutes", took < 600.0, what="tolerance", work=work, value=took / 60.0, unit="min")
    table.add(what="memory of the parent, the most", work=work, value=memory, unit="GB")
    table.notes.append(f"{robot} within 5 mm: {100 * share:.2f} % [{100 * low:.2f}, {100 * high:.2f}]")
    for variable in campaign.shares():
        table.notes.append(f"{robot}, {variable.variable}: {100 * variable.share:.1f} % of the variance")


def _overhead(table: Table, folder: Path) -> None:
    """What a shard of one sample that does nothing costs."""
    vary = {"task.a": {"range": [0.0, 1.0]}}
    spec = {"schema": 1, "robot": ROBOT, "sampling": "random", "shard_rows": 1, "vary": vary}
    for name, executor, count in (("a process", _process(), MANY), ("Dask, one worker", _dask(), EMPTY)):
        with executor as options:
            if options is None:
                table.notes.append(f"{name}: not installed")
                continue
            sweep(spec | {"samples": 1}, folder / f"{name} first", task=index, **options)
            begun = time.perf_counter()
            sweep(spec | {"samples": count}, folder / name, task=index, **options)
            value = 1e3 * (time.perf_counter() - begun) / count
            goal, met = (f"below {GOAL_MS:g} ms", value < GOAL_MS) if count == MANY else ("", None)
            work = f"{count} empty shards"
            table.add(goal, met, what=f"overhead on {name}", work=work, value=value, unit="ms a shard")


@contextlib.contextmanager
def _process() -> Iterator[dict[str, Any] | None]:
    """A pool of the user, which is warm the second time."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield {"executor": pool}


@contextlib.contextmanager
def _dask() -> Iterator[dict[str, Any] | None]:
    """A cluster of one worker on this machine; None where Dask is not installed."""
    try:
        from distributed import LocalCluster
    except ImportError:
        yield None
        return
    with LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster:
        yield {"scheduler": cluster.scheduler_address}
