"""Environments for learning: steps a second of a whole VectorEnv, and 1e6 steps bit by bit beside a plain Python loop.

Actions are made beforehand, by columns; observations are views (`copy=False`) but where said.
OMNIDYN_BENCH_SHARE=0.1 takes that share of the robots and steps.
"""

from __future__ import annotations

import os
import time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import omnidyn
from benchmarks.table import Table, machine
from omnidyn.interop.gymnasium import TASKS, RobotVectorEnv, check_vector_env
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.environments.pool import Range
from tests.support.plain_environment import PlainVelocity

ROBOTS, REPEATS, CALLS = 65_536, 40, 8
OFF = Range(0.8, 1.2, when="startup")
VARIED = {"body.mass_kg": OFF, "friction.axes.coulomb": OFF}
GOALS = {1: 1e8, 20: 4e7}  # by substeps, velocity, two threads, float32
COLUMNS = ["what", "dtype", "substeps", "threads", "steps/s", "steps/s of cpu", "ns cpu", "ms a call"]
PLAIN_ROBOTS, PLAIN_STEPS = 1000, 1000
SHARE = float(os.environ.get("OMNIDYN_BENCH_SHARE", "1"))


def measure() -> Table:
    """The table. steps/s: by the wall, the fastest of many short measurements."""
    table = Table("environments: 65,536 robots, numbers of each its own, steps of 20 ms", COLUMNS)
    table.notes.append(machine())
    count = max(64, int(ROBOTS * SHARE))
    for dtype in ("float32", "float64"):
        for substeps in (1, 20):
            for threads in (1, 2):
                goal = GOALS[substeps] if (dtype, threads, count) == ("float32", 2, ROBOTS) else None
                _row(table, count, "velocity", dtype, substeps, threads, goal)
    _row(table, count, "velocity", "float32", 1, 2, None, "velocity, copies", copy=True)
    _row(table, count, "velocity", "float32", 1, 2, None, "velocity, same step", autoreset_mode="SameStep")
    for task in ("pose", "path"):
        for substeps in (1, 20):
            _row(table, count, task, "float32", substeps, 2)
    _row(table, count, "path", "float32", 1, 2, None, "path, pushes, latency 30 ms", push=(1, 1, 0.1), latency=0.03)
    _checkers(table)
    _plain(table)
    table.notes.append("steps/s of cpu: threads x steps of one second of the processor; goals are held to it")
    table.notes.append(
        "memory is the limit of one substep: others who use it slow that down; gymnax CartPole on an A100: 2e7"
    )
    return table


def _row(
    table: Table,
    count: int,
    task: str,
    dtype: str,
    substeps: int,
    threads: int,
    goal: float | None = None,
    what: str = "",
    **options: Any,
) -> None:
    """A line of speeds."""
    settings = {"randomise": VARIED, "copy": False} | options
    envs = RobotVectorEnv(count, task=task, dtype=dtype, substeps=substeps, threads=threads, **settings)
    random = np.random.default_rng(5)
    actions = [random.uniform(-1.0, 1.0, (3, count)).astype(dtype).T for _ in range(CALLS)]
    envs.reset(seed=1)
    envs.environments.steps_done = np.arange(count) % envs.environments.setting.steps  # ends come one by one
    wall = cpu = np.inf
    for _ in range(REPEATS):
        start, spent = time.perf_counter(), time.process_time()
        for action in actions:
            envs.step(action)
        wall = min(wall, (time.perf_counter() - start) / CALLS)
        cpu = min(cpu, (time.process_time() - spent) / CALLS)
    envs.close()
    rate = threads * count / cpu
    words, met = ("", None) if goal is None else (f">= {goal:.0e}", rate >= goal)
    cells = {"steps/s": count / wall, "steps/s of cpu": rate, "ns cpu": 1e9 * cpu / count, "ms a call": 1e3 * wall}
    table.add(words, met, what=what or task, dtype=dtype, substeps=substeps, threads=threads, **cells)


def _checkers(table: Table) -> None:
    """What checkers say of all tasks and modes: nothing."""
    for name in TASKS:
        check_env(gymnasium.make(name).unwrapped)
        for mode in AutoresetMode:
            envs: Any = gymnasium.make_vec(name, num_envs=130, duration=0.4, autoreset_mode=mode, threads=2)
            check_vector_env(envs)
            envs.close()
    table.add("clean", True, what="Gymnasium's checker, and that of vector environments: 3 tasks, 3 modes")


def _plain(table: Table) -> None:
    """Random steps and partial resets, with new seeds at times, beside a plain Python loop."""
    robots, steps = max(70, int(PLAIN_ROBOTS * SHARE)), max(30, int(PLAIN_STEPS * SHARE))
    setting = Setting(duration=0.6, substeps=1, randomise=VARIED)
    envs = Environments(omnidyn.load_robot("axebot"), robots, setting, threads=2)
    rows, spread = envs.numbers.pool, envs.numbers.spread
    plain = [PlainVelocity(rows[k % len(rows)], 3, k, setting.steps, spread) for k in range(robots)]
    random, resets, wrong = np.random.default_rng(9), 0, 0
    envs.reset(seed=1)
    for one in plain:
        one.reset(seed=1)
    for k in range(steps):
        if random.random() < 0.1:
            mask, seed = random.random(robots) < 0.2, None if random.random() < 0.5 else k
            seen = envs.reset(mask, seed)
            for robot in np.flatnonzero(mask):
                resets += 1
                wrong += not np.array_equal(seen[robot], plain[robot].reset(seed=seed))
        action = random.uniform(-1.1, 1.1, (robots, 3)).astype(np.float32)
        step = envs.step(action)
        for robot, one in enumerate(plain):
            observation, reward, over, _ = one.step(action[robot])
            same = np.array_equal(step.observation[robot], observation) and step.reward[robot] == reward
            wrong += not (same and step.truncated[robot] == over)
    envs.close()
    what = f"{robots * steps} steps, {resets} partial resets: other than a plain Python loop in {wrong}"
    table.add("the same bits", wrong == 0, what=what, dtype="float32", substeps=1, threads=2)
