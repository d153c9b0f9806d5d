"""kill -9 of each worker of the studio at a random moment: whether it is said, and whether the next run is whole.

Without pages: the session that all pages show. OMNIDYN_BENCH_KILLS=5 makes fewer of them.
"""

from __future__ import annotations

import asyncio
import os
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.table import Table, machine
from omnidyn.studio.layout import Studio
from omnidyn.studio.worker import Worker
from tests.support.pages import write_log

KILLS = int(os.environ.get("OMNIDYN_BENCH_KILLS", "20"))  # of each worker
SEED, PATIENCE = 1, 120.0  # [s]
SAID, FIRST, SILENT = "said", "done before", "silent"
WHOLE = "whole when run again"


@dataclass(frozen=True)
class Job:
    """A job of a worker. said: whether a page says that it ended. whole: whether it has a result."""

    worker: str
    run: Callable[[], Awaitable[None]]
    said: Callable[[], bool]
    whole: Callable[[], bool]


def measure() -> Table:
    """How many of the kills were said, and how many runs after them were whole."""
    columns = ["worker", SAID, FIRST, SILENT, WHOLE]
    table = Table(f"studio_kills: kill -9 of each worker at a random moment, {KILLS} times", columns)
    with tempfile.TemporaryDirectory() as folder:
        counts = asyncio.run(_study(Path(folder)))
    for worker, count in counts.items():
        met = count[SILENT] == 0 and count[WHOLE] == KILLS
        table.add("none silent, all again", met, worker=worker, **{name: count[name] for name in columns[1:]})
    table.notes = [machine(), f"a moment drawn from the time that the worker is busy (seed {SEED}); a log of 10 s"]
    return table


async def _study(folder: Path) -> dict[str, Counter[str]]:
    """Worker -> what came of its kills."""
    studio, draws = Studio(), np.random.default_rng(SEED)
    studio.session.robot = "axebot"
    log = studio.session.add_log(str(write_log(folder / "log.csv", 10.0)), "log.csv")
    await _until(lambda: log.result is not None)
    counts = {}
    for job in _jobs(studio):
        await job.run()  # loads and compiles
        worker = studio.session.workers[job.worker]
        seconds = min([await _busy_seconds(job, worker), await _busy_seconds(job, worker)])
        counts[job.worker] = Counter[str]()
        for _ in range(KILLS):
            counts[job.worker].update(await _kill(job, worker, draws.uniform(0.0, seconds)))
        print(job.worker, dict(counts[job.worker]), flush=True)
    await studio.session.close()
    return counts


async def _busy_seconds(job: Job, worker: Worker) -> float:
    """How long the worker is busy with a job [s]: what the server does before and after is no moment to kill it."""
    task = asyncio.ensure_future(job.run())
    await _until(lambda: task.done() or worker.busy)
    begun = time.monotonic()
    await _until(lambda: task.done() or not worker.busy)
    seconds = time.monotonic() - begun
    await task
    return seconds


async def _kill(job: Job, worker: Worker, wait: float) -> list[str]:
    """What came of one kill, after so many seconds of the job."""
    task = asyncio.ensure_future(job.run())
    await _until(lambda: task.done() or worker.busy)
    await asyncio.sleep(wait)
    process = worker._process
    if worker.busy and process is not None and process.returncode is None:
        os.kill(process.pid, signal.SIGKILL)
    await asyncio.wait_for(task, PATIENCE)
    outcome = SAID if job.said() else FIRST if job.whole() else SILENT
    await asyncio.wait_for(job.run(), PATIENCE)
    return [outcome, *[WHOLE] * job.whole()]


def _jobs(studio: Studio) -> list[Job]:
    """A job of each worker."""
    session, (log,) = studio.session, studio.session.logs.values()
    fitting, tracks, comparing, driving = studio.fitting, studio.tracks, studio.comparing, studio.driving
    watching = studio.watching

    async def drive() -> None:
        """A drive of half a second."""
        task = asyncio.ensure_future(driving.run())
        await _until(lambda: task.done() or (driving.running and driving.robot is not None))
        await asyncio.sleep(0.5)
        driving.send({"stop": True})
        await task

    async def watch() -> None:
        """Watch the log for half a second."""
        task = asyncio.ensure_future(watching.run(log))
        await _until(lambda: task.done() or (watching.running and watching.status is not None))
        await asyncio.sleep(0.5)
        watching.stop()
        await task

    of_tasks = (("fit", fitting), ("track", tracks), ("compare", comparing))
    return [
        Job("log", lambda: session.check(log), lambda: log.ended, lambda: log.result is not None),
        *(
            Job(name, tab.run, lambda tab=tab: tab.last.stopped, lambda tab=tab: tab.last.result is not None)
            for name, tab in of_tasks
        ),
        Job("watch", watch, lambda: bool(watching.trouble), lambda: bool(watching.status) and not watching.trouble),
        Job("drive", drive, lambda: bool(driving.trouble), lambda: not driving.trouble),
    ]


async def _until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.001)
