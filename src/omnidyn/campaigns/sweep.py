"""sweep: run the shards of a campaign on any executor. What is there already is not run again."""

from __future__ import annotations

import math
import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.campaigns.batches import batch_columns, batched, block_rows
from omnidyn.campaigns.design import sample_count
from omnidyn.campaigns.executors import ShardPool, opened
from omnidyn.campaigns.fits import hashes_of, with_logs
from omnidyn.campaigns.folder import SAMPLE, Folder, as_columns, as_table
from omnidyn.campaigns.manifest import Manifest
from omnidyn.campaigns.results import Campaign
from omnidyn.campaigns.spec import INPUTS, Spec, load_spec, parse_spec, spec_tables
from omnidyn.campaigns.tasks import CampaignSample, Function, LoadedSpec
from omnidyn.compiled.parallel import small_matrices
from omnidyn.compiled.stamp import stamp
from omnidyn.errors import InputError
from omnidyn.files import read_bytes, sha256
from omnidyn.model.presets import robot_path
from omnidyn.progress import Progress, Report, silent

SHARD_S, MEASURE_S = 1.0, 0.3  # [s] of work in a shard; spent on finding out how many samples that is
MOST_ROWS, ROWS_UNMEASURED = 2**20, 100
FILES = (".toml", ".csv", ".parquet", ".pq")


def sweep(
    spec: Spec | Mapping[str, Any] | str | os.PathLike | None,
    folder: str | os.PathLike,
    *,
    task: Function | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    scheduler: str = "",
    shard: tuple[int, int] = (1, 1),
    repair: bool = False,
    progress: Progress = silent,
) -> Campaign:
    """Run a campaign into a folder, or go on with it: what is there is not run again. Returns a Campaign.

    Args:
        spec: A file, its tables, or a Spec; None goes on with what the folder holds.
        folder: Where shards and manifest stand; made where it is not there.
        task: A function of a module, Sample -> {name: number}, in place of [track], [simulate] and [identify].
        executor: Any of `concurrent.futures`; by default a pool of processes of this machine.
        workers: Processes of that pool; by default as many as there are processors.
        scheduler: Address of a Dask cluster that runs already, in place of an executor.
        shard: (i, n): only the i-th of n parts of the shards, such as one task of an array of Slurm.
        repair: Make shards that have changed since they were written again; else they are an error.
        progress: Hears how many shards are done, and how long the others take.

    Raises InputError for a spec that cannot be used, a folder of another campaign or with a run in it, a full disk.
    """
    part, parts = shard
    if not 1 <= part <= parts:
        raise InputError("no such part", got=f"{part}/{parts}", expected="i/n, 1 <= i <= n", where="shard")
    home = Folder(Path(folder))
    with opened(executor, scheduler, workers) as pool:
        manifest = _begun(home, spec, task, pool, progress)
        start, stop = ((manifest.shards * k) // parts for k in (part - 1, part))
        if start < stop:
            with home.locked(start, stop):
                if repair and (damaged := home.remove_damaged(range(start, stop))):
                    progress(Report(f"{len(damaged)} damaged shards are made again"))
                done = {*home.done(range(start, stop))}
                shards = [k for k in range(start, stop) if k not in done]
                _run(home, shards, task, pool, progress)
    return Campaign(home)


def _begun(home: Folder, spec: Any, function: Function | None, pool: ShardPool, progress: Progress) -> Manifest:
    """The manifest of the campaign, its folder made where it is not there."""
    if spec is None:
        old = home.manifest
        inputs = old.inputs | hashes_of(home.spec)
        return home.begin(old._replace(**_made_by(function, old.task), inputs=inputs), {})
    loaded, base = _read(spec)
    absolute = _renamed(loaded, lambda text: str((base / text).resolve()))
    problem = LoadedSpec(with_logs(absolute, base), home.path, function)
    problem.check()
    copies = _copies(absolute)
    local = _renamed(absolute, lambda text: copies[text][0])
    local = with_logs(local.replace(robot=copies[absolute.robot][0]), base)
    manifest = Manifest(
        **_made_by(function, "track" if local.track else "simulate" if local.simulate else "identify"),
        spec=spec_tables(local),
        inputs={copy: sha256(content) for copy, content in copies.values()} | hashes_of(local),
        samples=sample_count(local),
        shard_rows=local.shard_rows or 1,
    )
    if local.shard_rows is None and local.identify is None and not home.exists:  # a fit is a shard
        progress(Report("timing the first samples"))
        manifest = manifest._replace(shard_rows=_rows(pool, problem))
    return home.begin(manifest, dict(copies.values()), block_rows(problem))


def _read(spec: Any) -> tuple[Spec, Path]:
    """A spec, and the folder that its file names are relative to."""
    if isinstance(spec, Spec):
        return spec, Path()
    return (parse_spec(spec), Path()) if isinstance(spec, Mapping) else load_spec(spec)


def _renamed(spec: Spec, rename: Callable[[str], str]) -> Spec:
    """The spec with another name for every file in it."""

    def new(text: Any) -> Any:
        return rename(text) if isinstance(text, str) and text.endswith(FILES) else text

    changes: dict[str, Any] = {"robot": new(spec.robot)}
    if spec.track is not None:
        changes["track"] = spec.track.replace(path=new(spec.track.path), controller=new(spec.track.controller))
    if spec.simulate is not None:
        changes["simulate"] = spec.simulate.replace(voltages=new(spec.simulate.voltages))
    if spec.identify is not None:
        changes["identify"] = spec.identify.replace(map=new(spec.identify.map))
    changes["vary"] = {
        name: variable.replace(values=tuple(map(new, variable.values))) if variable.values else variable
        for name, variable in spec.vary.items()
    }
    return spec.replace(**changes)


def _copies(spec: Spec) -> dict[str, tuple[str, bytes]]:
    """File of the spec -> name and content of its copy in the folder. The robot is a file, a preset too."""
    names: dict[str, str] = {spec.robot: robot_path(spec.robot)}
    _renamed(spec, lambda text: names.setdefault(text, text))
    copies: dict[str, tuple[str, bytes]] = {}
    for k, (name, path) in enumerate(names.items()):
        copy = INPUTS + Path(path).name
        if copy in dict(copies.values()):
            copy = f"{INPUTS}{k}-{Path(path).name}"
        copies[name] = (copy, read_bytes(path))
    return copies


def _made_by(function: Function | None, task: str) -> dict[str, str]:
    """What computes: the task, the version, and a hash of all its sources. Raises InputError for a function of none."""
    if function is None and ":" in task:
        raise InputError(
            "the task of this campaign is a function",
            got=task,
            expected="the function",
            remedy="go on in Python: omnidyn.sweep(None, folder, task=function)",
        )
    name = task
    if function is not None:
        name = f"{getattr(function, '__module__', '?')}:{getattr(function, '__qualname__', '?')}"
    try:
        if "<" in name or "?" in name:
            raise OSError
        digest = stamp(LoadedSpec.measure if function is None else function)
    except (OSError, AttributeError):
        raise InputError(
            "other processes cannot find this task",
            got=name,
            expected="a function with a name, in a file",
            remedy="write it into a module with def",
            where="task",
        ) from None
    return {"omnidyn": _version(), "task": name, "task_sha256": digest}


def _version() -> str:
    """Of the package, which stands above all its files: nothing here may import it, and it is there before them."""
    return sys.modules["omnidyn"].__version__


def _rows(pool: ShardPool, problem: LoadedSpec) -> int:
    """Samples of a shard: as many as take SHARD_S, as the first ones show; whole blocks."""
    block = block_rows(problem)
    if sample_count(problem.spec) <= block:
        return block
    seconds = pool.call(_seconds, problem)
    rows = ROWS_UNMEASURED if seconds is None else min(math.ceil(SHARD_S / seconds), MOST_ROWS)
    return -(-rows // block) * block


def _seconds(problem: LoadedSpec) -> float:
    """How long a sample takes [s], compiled; in the process that will work."""
    most = sample_count(problem.spec)
    count, seconds = min(block_rows(problem), most), 0.0
    _columns(problem, 0, count)
    while seconds < MEASURE_S:
        begun = time.perf_counter()
        _columns(problem, 0, count)
        seconds = time.perf_counter() - begun
        if seconds >= MEASURE_S or count == most:
            break
        count = min(4 * count, most)
    return max(seconds / count, 1e-9)


def _run(home: Folder, shards: list[int], function: Function | None, pool: ShardPool, progress: Progress) -> None:
    """Run shards, whatever happens to one of them. Raises what ends all: an interrupt, a full disk."""
    total, began = len(shards), math.inf
    calls = ((shard, (str(home.path), shard, function)) for shard in shards)
    progress(Report(f"{total} shards to run", 0, total))
    for done, (shard, words) in enumerate(pool.run(run_shard, calls), 1):
        if words:  # its process ended: nobody else could say so
            home.mark_failed(shard, words)
        if done == pool.workers:  # each has compiled by now, and does it once
            began = time.monotonic()
        phase = f"shard {done} of {total}"
        if done > pool.workers:
            left = (time.monotonic() - began) * (total - done) / (done - pool.workers)
            phase += f", {_time(left)} left"
        progress(Report(phase, done, total))


def _time(seconds: float) -> str:
    """A time left, in words."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"about {seconds / size:.0f} {unit}"
    return f"about {seconds:.0f} s"


def run_shard(folder: str, shard: int, function: Function | None) -> None:
    """Run one shard, where it is not there yet; one that raises is marked with its traceback.

    Raises InputError where it cannot be written.
    """
    home = Folder(Path(folder))
    if home.done([shard]):
        return
    try:
        columns = _columns(_problem(folder, home.manifest.to_json(), function), *home.manifest.rows(shard))
    except Exception:
        home.mark_failed(shard, traceback.format_exc())
        return
    home.check_inputs()  # behind the work: they were read within it
    home.write_shard(shard, columns)


@lru_cache(maxsize=1)
def _problem(folder: str, manifest: str, function: Function | None) -> LoadedSpec:
    """The problem of a folder, read once by each process. Raises InputError where this one computes otherwise."""
    home = Folder(Path(folder))
    mine = home.manifest._replace(**_made_by(function, home.manifest.task))
    if differences := home.manifest.differences(mine):
        raise InputError("this worker computes otherwise", got="; ".join(differences), expected="the same version")
    return LoadedSpec(home.spec, home.path, function, home.manifest.inputs)


def _columns(problem: LoadedSpec, start: int, stop: int) -> dict[str, Any]:
    """The columns of a shard."""
    varied = {SAMPLE: np.arange(start, stop), **problem.columns(start, stop)}
    if batched(problem):
        return varied | batch_columns(problem, start, stop)
    rows, fits = [], problem.spec.identify is not None and problem.function is None
    with small_matrices():
        for sample in problem.samples(start, stop):
            try:
                rows.append(problem.fit(sample) if fits else problem.measure(sample))
            except Exception as error:
                error.add_note(f"in sample {sample.index}: {_values(sample)}")
                raise
    return varied | (as_table(rows) if fits else as_columns(rows))


def _values(sample: CampaignSample) -> str:
    return ", ".join(f"{name} = {value}" for name, value in sample.values.items())
