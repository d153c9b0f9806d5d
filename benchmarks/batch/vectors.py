"""The table of docs/how-to/batches.md, "Beside others": the same work with and without AVX-512, in one run.

    python -m benchmarks.batch.vectors

Each column is a process of its own, told not to use what the other may: numba by NUMBA_CPU_NAME, g++ by -march, NumPy
by NPY_DISABLE_CPU_FEATURES, XLA (JAX, gymnax) by --xla_cpu_max_isa. Least processor time of several calls; one thread
where a library can be told so: XLA is held to one processor.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.batch import peers
from benchmarks.batch.rows import DT, ROBOTS, ROWS, batch_of, least, per_step, work
from benchmarks.table import machine
from omnidyn.simulation.batch.exact import exact_law

SHORTER = {  # of a process that has no AVX-512
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+avx,+avx2,+fma,+bmi,+bmi2,+lzcnt,+popcnt,+sse4.1,+sse4.2",
    "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4",
    "XLA_FLAGS": "--xla_cpu_max_isa=AVX2",
    "OMNIDYN_BENCH_MARCH": "haswell",
}
COLUMNS = {"AVX-512": {}, "without": SHORTER}
ENVIRONMENTS = 4096


def gymnax_run() -> tuple[Callable[[], Any], int] | None:
    """(100 random steps of 4096 pendulums of gymnax, by vmap and scan; their number); None where it is not there."""
    if find_spec("gymnax") is None:
        return None
    import gymnax  # pyright: ignore[reportMissingImports]
    import jax  # pyright: ignore[reportMissingImports]

    environment, parameters = gymnax.make("Pendulum-v1")
    keys = jax.random.split(jax.random.PRNGKey(0), ENVIRONMENTS)
    _, start = jax.vmap(environment.reset, in_axes=(0, None))(keys, parameters)
    actions = jax.random.uniform(jax.random.PRNGKey(1), (100, ENVIRONMENTS, 1), minval=-1.0)

    def one(state: Any, action: Any) -> Any:
        step = jax.vmap(environment.step, in_axes=(0, 0, 0, None))(keys, state, action, parameters)
        return step[1], step[2]

    run = jax.jit(lambda: jax.lax.scan(one, start, actions)[1])
    return lambda: np.asarray(run()), 100


def ours_of_environments() -> float:
    """ns of a step of a velocity environment of ours, float32, one thread."""
    from omnidyn.simulation.environments.environments import Environments, Setting

    envs = Environments(work()[0].center, ENVIRONMENTS, Setting())
    envs.reset(seed=1)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, ENVIRONMENTS)).astype(np.float32).T

    def run() -> None:
        for _ in range(100):
            envs.step(actions)

    return per_step(run, ENVIRONMENTS, 100)


def column() -> dict[str, float]:
    """What -> ns of a robot-step, measured in this process."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    robots, volts = work()
    laws = exact_law(robots.parameters, DT)  # pyright: ignore[reportArgumentType]
    times = {}
    for name, dtype in (("f64", float), ("f32", np.float32)):
        run = batch_of(robots, dtype=dtype)
        times[f"omnidyn, {name}"] = per_step(lambda run=run: run(volts), ROBOTS, ROWS)
    with tempfile.TemporaryDirectory() as folder:
        for fused in (True, False):
            library = peers.cpp(Path(folder), fused, os.environ.get("OMNIDYN_BENCH_MARCH", "native"))
            if library is not None:
                words = "multiply-adds fused" if fused else "rounded as ours"
                call = peers.cpp_run(library, laws, volts, np.float64)
                times[f"C++ loop, f64, {words}"] = per_step(call, ROBOTS, ROWS)
    times["NumPy, f64"] = per_step(peers.numpy_run(laws, volts[:300]), ROBOTS, 300, 3)
    if (jax := peers.jax_run(laws, volts)) is not None:
        times["JAX, scan, f64"] = per_step(jax, ROBOTS, ROWS, 5)
    few = laws[:, :64].copy()
    if (mujoco := peers.mujoco_run(few, volts[:300], DT)) is not None:
        times["MuJoCo rollout"] = per_step(mujoco, 64, 300, 2)
    times["a step of a velocity environment of omnidyn, f32"] = ours_of_environments()
    if (pendulums := gymnax_run()) is not None:
        call, steps = pendulums
        times["a step of gymnax Pendulum-v1, f32"] = least(call, 5) * 1e9 / (ENVIRONMENTS * steps)
    return times


def main() -> None:
    """Measure the columns by turns, twice; print the least of each."""
    found: dict[str, dict[str, float]] = {name: {} for name in COLUMNS}
    for _ in range(2):
        for name, told in COLUMNS.items():
            said = subprocess.run(
                [sys.executable, "-m", "benchmarks.batch.vectors", "--column"],
                env=os.environ | told,
                stdout=subprocess.PIPE,
                check=True,
            ).stdout
            for what, ns in json.loads(said.splitlines()[-1]).items():
                found[name][what] = min(ns, found[name].get(what, np.inf))
    print(f"{machine()}; {time.strftime('%Y-%m-%d')}; ns of a robot-step, and as a ratio to omnidyn, f64\n")
    print("| what | " + " | ".join(f"{name} | ratio" for name in COLUMNS) + " |")
    print("|---|" + "---:|" * (2 * len(COLUMNS)))
    for what in found["without"]:
        cells = []
        for times in found.values():
            base = "a step of a velocity environment of omnidyn, f32" if what.startswith("a step") else "omnidyn, f64"
            cells += [f"{times[what]:.3g}", f"{times[what] / times[base]:.2f}"]
        print(f"| {what} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    if sys.argv[1:] == ["--column"]:
        print(json.dumps(column()))
    else:
        main()
