"""The table of `python -m benchmarks batch`: ratios of one run, one thread and double precision unless said."""

from __future__ import annotations

import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.batch import peers
from benchmarks.table import Table, machine
from omnidyn.compiled.kernel import plain
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.batch import Batch
from omnidyn.simulation.batch.exact import exact_law
from omnidyn.simulation.batch.sample import Sample, sample
from omnidyn.simulation.environments.environments import Environments, Setting
from omnidyn.simulation.exact.step import exact_step
from omnidyn.simulation.simulate import simulate
from tests.support.robots import TABLE_3, robot_of, table_3_voltages

DT, ROBOTS, ROWS, SEED = 1e-3, 1024, 2000, 7
REPEATS = 25  # calls of which the least counts
SPREAD = (0.8, 1.2)
DRAWN = ("body.mass_kg", "body.inertia_kg_m2", "friction", "motor.resistance_ohm", "motor.torque_constant_Nm_A")
MILLION, LONG_ROWS = 1_000_000, 10_000
FIRST_CALL = """
import omnidyn, numpy
robot = omnidyn.load_robot("axebot")
omnidyn.simulate_batch([robot] * 10, numpy.full((100, 3), [0.0, 3.0, -3.0]), 1e-3, pose={pose!r})
"""


def work() -> tuple[Sample, np.ndarray]:
    """(the robots, around Table 3 with breakaway of 1.2 times Coulomb; the volts, 2 s with many stops)."""
    robot = robot_of(TABLE_3)
    axes = robot.friction.axes
    held = axes.replace(breakaway=tuple(1.2 * level for level in axes.coulomb))
    robot = robot.replace(friction=robot.friction.replace(axes=held))
    return sample(robot, ROBOTS, SEED, factors=dict.fromkeys(DRAWN, SPREAD)), table_3_voltages()[3000 : 3000 + ROWS]


def along(robot: Robot) -> Robot:
    """The robot under an ellipse of friction in a turning frame."""
    way = DirectionFriction(coulomb=(1.2, 0.8), viscous=0.5, yaw_coulomb=0.04, yaw_viscous=0.005)
    return robot.replace(body=robot.body.replace(rotating_frame=True), friction=Friction(direction=way))


def least(call: Callable[[], Any], repeats: int = REPEATS, clock: Callable[[], float] = time.process_time) -> float:
    """The least time of a call [s], after one to warm up."""
    call()
    times = []
    for _ in range(repeats):
        start = clock()
        call()
        times.append(clock() - start)
    return min(times)


def per_step(call: Callable[[], Any], robots: int, rows: int, repeats: int = REPEATS) -> float:
    """ns a robot-step."""
    return least(call, repeats) * 1e9 / (robots * rows)


def measure() -> Table:
    """The table."""
    table = Table("batch: robots around Table 3, 1024 x 2 s at 1 kHz", ["what", "value", "unit", "ratio"])
    table.notes.append(machine())
    robots, volts = work()
    laws = exact_law(robots.parameters, DT)  # pyright: ignore[reportArgumentType]
    ours = _ours(table, robots, volts)
    with tempfile.TemporaryDirectory() as folder:
        _cpp(table, [peers.cpp(Path(folder), fused) for fused in (True, False)], laws, volts, ours, robots)
    _others(table, laws, volts, ours, robots)
    _poses(table, robots, volts, ours)
    _implicit(table, robots.center, volts)
    _kinds(table, along(robots.center), volts[::10])
    _late(table, {"the paper's law": robots.center, "ellipse": along(robots.center)}, volts[::10])
    _python_loop(table, robots.center)
    _million(table, robots.center)
    _first_calls(table)
    table.notes += [
        f"robots drawn by factors {SPREAD} of {', '.join(DRAWN)}, seed {SEED}; volts shared",
        "ns: of a robot-step, the least processor time of several calls; ours: whole calls of Batch.run, twist alone",
        f"C++: g++ {peers.FLAGS}; ours never fuses, so that it is bit-equal to Python",
    ]
    return table


def batch_of(robots: Any, **options: Any) -> Callable[..., Any]:
    """A call that puts all to rest and runs rows of volts."""
    batch = Batch(robots, DT, **{"threads": 1, "pose": None} | options)

    def run(volts: np.ndarray, **kept: Any) -> Any:
        batch.reset()
        return batch.run(volts, **kept)

    return run


def _ours(table: Table, robots: Sample, volts: np.ndarray) -> dict[str, float]:
    """Our own times [ns a robot-step], by what was run."""
    full, half = batch_of(robots), batch_of(robots, dtype=np.float32)
    times = {
        "f64": per_step(lambda: full(volts), ROBOTS, ROWS),
        "f32": per_step(lambda: half(volts), ROBOTS, ROWS),
        "statistics": per_step(lambda: full(volts, statistics=True), ROBOTS, ROWS),
    }
    own = np.ascontiguousarray(np.broadcast_to(volts, (ROBOTS, *volts.shape)))
    times["own"] = per_step(lambda: full(own), ROBOTS, ROWS, 3)
    table.add(what="omnidyn, f64", value=times["f64"], unit="ns")
    gain = times["f64"] / times["f32"]
    table.add("f32 >= 1.8 x f64", gain >= 1.8, what="omnidyn, f32", value=times["f32"], unit="ns", ratio=gain)
    wide = batch_of(robots, threads=2)
    long = np.tile(volts, (5, 1))
    one, two = (least(lambda run=run: run(long), 15, time.perf_counter) for run in (full, wide))
    quiet = one / two <= 2.1  # more than two cores can give: other programs took the time of one thread
    table.add(
        ">= 1.7 x one thread",
        one / two >= 1.7 if quiet else None,
        what=f"omnidyn, f64, two threads, time on the wall{'' if quiet else ' (machine too busy to tell)'}",
        value=two * 1e9 / (ROBOTS * len(long)),
        unit="ns",
        ratio=one / two,
    )
    for name, words in (("statistics", "with statistics"), ("own", "volts of their own")):
        table.add(what=f"omnidyn, f64, {words}", value=times[name], unit="ns", ratio=times[name] / times["f64"])
    return times


def _cpp(
    table: Table, libraries: list[Any], laws: np.ndarray, volts: np.ndarray, ours: dict[str, float], robots: Sample
) -> None:
    """The plain loop, and what the machine can."""
    library, unfused = libraries
    if library is None:
        table.notes.append("C++ loop skipped: no g++")
        return
    for name, dtype, loop, words in (
        ("f64", np.float64, library, "fused multiply-adds"),
        ("f64", np.float64, unfused, "rounded as ours"),
        ("f32", np.float32, library, "fused multiply-adds"),
    ):
        call, own = peers.cpp_run(loop, laws, volts, dtype), batch_of(robots, dtype=dtype)
        other, again = per_step(call, ROBOTS, ROWS), per_step(lambda own=own: own(volts), ROBOTS, ROWS)
        ratio = other / min(ours[name], again)  # ours before and after: the machine is not always as fast
        goal = (">= 1 x omnidyn", ratio >= 1.0) if name == "f64" else ("", None)
        table.add(*goal, what=f"C++ loop, {name}, the same law, {words}", value=other, unit="ns", ratio=ratio)
    adds, divisions = 20_000_000, 10_000_000
    rates = (
        ("multiply-adds", adds * 128 / least(lambda: library.multiply_adds(adds), 3)),
        ("divisions", divisions * 64 / least(lambda: library.divisions(divisions), 3)),
    )
    for name, rate in rates:
        table.add(what=f"the machine: {name}, f64", value=rate * 1e-9, unit="1e9/s")
    a, b = np.zeros(2**24), np.ones(2**24)
    copied = 2 * a.nbytes / least(lambda: np.copyto(a, b), 5)
    table.add(what="the machine: copy, read and written", value=copied * 1e-9, unit="GB/s")
    bound = 3e9 / rates[1][1]
    table.add(what="three divisions of a robot-step alone", value=bound, unit="ns", ratio=ours["f64"] / bound)


def _others(table: Table, laws: np.ndarray, volts: np.ndarray, ours: dict[str, float], robots: Sample) -> None:
    run = batch_of(robots)
    few, fewer = laws[:, :128].copy(), laws[:, :16].copy()
    rivals: list[tuple[str, float, int, int, Callable[[], Any] | None]] = [
        ("NumPy, the same law", 15.0, ROBOTS, 500, peers.numpy_run(laws, volts[:500])),
        ("JAX, scan, the same law", 0.0, ROBOTS, ROWS, peers.jax_run(laws, volts)),
        ("MuJoCo rollout, 128 models", 1500.0, 128, 500, peers.mujoco_run(few, volts[:500], DT)),
        ("MJX, vmap, 16 robots", 0.0, 16, 100, peers.mjx_run(fewer, volts[:100], DT)),
    ]
    for name, goal, count, rows, call in rivals:
        if call is None:
            table.add(what=f"{name}: not installed")
            continue
        ns, own = per_step(call, count, rows, 3), per_step(lambda: run(volts), ROBOTS, ROWS)
        ratio = ns / min(own, ours["f64"])  # ours before and after: the machine is not always as fast
        met = (f">= {goal:g} x omnidyn", ratio >= goal) if goal else ("", None)
        table.add(*met, what=name, value=ns, unit="ns", ratio=ratio)


def _poses(table: Table, robots: Sample, volts: np.ndarray, ours: dict[str, float]) -> None:
    """What a pose costs, and how far it is off after 10 s."""
    long, single, twist = table_3_voltages(), simulate(robots.center, table_3_voltages(), DT), batch_of(robots)
    assert single.pose is not None
    for pose, most, bound in (("fast", 3.5, 2e-6), ("exact", 30.0, 1e-12)):
        run = batch_of(robots, pose=pose)
        ns, own = per_step(lambda run=run: run(volts), ROBOTS, ROWS), per_step(lambda: twist(volts), ROBOTS, ROWS)
        ratio = ns / min(own, ours["f64"])
        table.add(f"<= {most:g} x twist alone", ratio <= most, what=f'pose "{pose}"', value=ns, unit="ns", ratio=ratio)
        alone = batch_of([robots.center], pose=pose)(long, every=1)
        off = np.abs(alone.poses[0] - single.pose).max(axis=0)
        words = f'pose "{pose}" over 10 s, off `simulate`'
        table.add(
            f"<= {bound:g}", off[:2].max() <= bound, what=f"{words}, position", value=float(off[:2].max()), unit="m"
        )
        table.add(f"<= {bound:g}", off[2] <= bound, what=f"{words}, heading", value=float(off[2]), unit="rad")


def _implicit(table: Table, center: Robot, volts: np.ndarray) -> None:
    """Blocks of implicit steps, and the engine of what has none."""
    ellipse = along(center)
    robots = sample(ellipse, ROBOTS, SEED, factors=dict.fromkeys(("body.mass_kg", "friction"), SPREAD))
    run = batch_of(robots)
    ns = per_step(lambda: run(volts), ROBOTS, ROWS, 5)
    table.add("<= 60 ns", ns <= 60.0, what="ellipse in a turning frame, in blocks", value=ns, unit="ns")


def _kinds(table: Table, ellipse: Robot, volts: np.ndarray) -> None:
    """What robots of each kind cost with poses, one step a row of 10 ms, and what that may be."""
    way, motor, drive = ellipse.friction.direction, ellipse.motor, ellipse.drive
    box = Friction(axes=AxesFriction(viscous=(0.9, 0.9, 0.01), coulomb=(1.2, 0.8, 0.04)))
    disc = Friction(direction=way.replace(coulomb=(1.2, 1.2)))
    falls = way.replace(breakaway=(1.5, 1.0), stribeck_speed=0.05)
    duty = drive.replace(kind="duty", supply=6.0)
    kinds = {
        "box in a turning frame": (120.0, ellipse.replace(friction=box)),
        "disc": (120.0, ellipse.replace(friction=disc)),
        "ellipse": (120.0, ellipse),
        "ellipse, duty, dead band": (120.0, ellipse.replace(drive=duty.replace(dead_band=0.3))),
        "ellipse, latency of 13 us": (120.0, ellipse.replace(drive=drive.replace(latency=13e-6))),
        "ellipse, speed loop of 100 Hz": (
            250.0,
            ellipse.replace(drive=drive.replace(kind="speed", kp=0.3, rate=100.0)),
        ),
        "ellipse, current limit that is seldom met": (250.0, ellipse.replace(motor=motor.replace(current_limit=3.0))),
        "ellipse, current limit that is often met": (3000.0, ellipse.replace(motor=motor.replace(current_limit=1.5))),
        "ellipse, duty that coasts": (250.0, ellipse.replace(drive=duty.replace(off="coast"))),
        "ellipse, breakaway": (3000.0, ellipse.replace(friction=Friction(direction=way.replace(breakaway=(1.5, 1.0))))),
        "ellipse, Stribeck": (3000.0, ellipse.replace(friction=Friction(direction=falls))),
        "friction at the wheels": (3000.0, ellipse.replace(friction=Friction(wheels=WheelFriction(coulomb=0.4)))),
        "ellipse, unequal motors": (3000.0, ellipse.replace(motor=motor.replace(resistance=(1.6, 1.7, 1.8)))),
        "ellipse, windings": (3000.0, ellipse.replace(motor=motor.replace(electrical="dynamic", inductance=1.1e-4))),
        "ellipse, wheels that slip": (
            3000.0,
            ellipse.replace(wheels=ellipse.wheels.replace(traction_mu=0.5, wheel_inertia=2e-5)),
        ),
    }
    scale = {"voltage": 1.0, "duty": 1.0 / 6.0, "speed": 5.0}
    command = {"voltage": "voltage", "duty": "duty", "speed": "wheel_speed_command"}
    for name, (most, robot) in kinds.items():
        rows = volts * scale[robot.drive.kind]
        batch = Batch([robot] * 256, 0.01, command=command[robot.drive.kind], threads=1)
        few = rows if "in blocks" in next(iter(batch.engines)) else rows[:40]
        ns = per_step(lambda batch=batch, few=few: batch.run(few), 256, len(few), 3)
        words = f"{name}, pose, rows of 10 ms: {next(iter(batch.engines))}"
        table.add(f"<= {most:g} ns", ns <= most, what=words, value=ns, unit="ns")


def _late(table: Table, robots: dict[str, Robot], volts: np.ndarray) -> None:
    """What a latency of the drive costs: the same robots with and without one."""
    for name, robot in robots.items():
        for latency in (13e-6, 4e-3):
            late = robot.replace(drive=robot.drive.replace(latency=latency))
            for what, timed in (
                ("batch, the end", lambda one: _rows_of(one, volts)),
                ("batch, every row", lambda one: _rows_of(one, volts, every=1)),
                ("simulate", lambda one: least(lambda: simulate(one, volts, 0.01), 5)),
                ("environments, poses", _environment_steps),
            ):
                ratio = timed(late) / timed(robot)
                words = f"{name}, latency of {latency * 1e3:g} ms, {what}: against none"
                table.add("<= 1.5 x", ratio <= 1.5, what=words, ratio=ratio)


def _rows_of(robot: Robot, volts: np.ndarray, **kept: Any) -> float:
    batch = Batch([robot] * 256, 0.01, threads=1)
    return least(lambda: batch.run(volts, **kept), 5)


def _environment_steps(robot: Robot) -> float:
    environments = Environments(robot, 1024, Setting("pose"))
    environments.reset(seed=1)
    action = np.random.default_rng(SEED).uniform(-1.0, 1.0, (1024, robot.wheels.count)).astype(np.float32)
    return least(lambda: [environments.step(action) for _ in range(20)], 10)


def _python_loop(table: Table, center: Robot) -> None:
    """The kernel against the formula in Python, over 10 s."""
    volts, step = table_3_voltages(), plain(exact_step)
    law = exact_law(sample(center, 1, factors={"body.mass_kg": (1.0, 1.0)}).parameters, DT)[:, 0]  # pyright: ignore[reportArgumentType]
    speed, out = [0.0, 0.0, 0.0], []
    for row in volts.tolist():
        for j in range(3):
            g = sum((volt * law[12 + 3 * j + w] for w, volt in enumerate(row)), 0.0)
            speed[j] = step(speed[j], g, law[j], law[3 + j], law[6 + j], law[9 + j], 0.0)
        out.append(list(speed))
    twists = batch_of([center])(volts, every=1).twists[0, 1:]
    differs = int((twists != np.array(out)).sum())
    table.add("0", differs == 0, what="samples of 30,000 that differ from the formula in Python", value=float(differs))


def _million(table: Table, center: Robot) -> None:
    """A million robots over 10 s, statistics alone, on two threads."""
    robots = sample(center, MILLION, SEED, factors={"body.mass_kg": SPREAD, "friction": SPREAD})
    volts = table_3_voltages()
    for pose, goal in ((None, 20.0), ("fast", 40.0)):
        run = batch_of(robots, threads=2, pose=pose)
        run(volts[:100], statistics=True)
        before, wall, cpu = peak_memory(), time.perf_counter(), time.process_time()
        run(volts[:LONG_ROWS], statistics=True)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        what = f"1e6 robots x 10 s, statistics, {'twist' if pose is None else 'fast pose'}, two threads"
        table.add(what=f"{what}: on the wall", value=wall, unit="s")
        table.add(
            f"<= {goal:g} s", cpu / 2.0 <= goal, what=f"{what}: half of its processor time", value=cpu / 2.0, unit="s"
        )
        grown = peak_memory() - before
        table.add("<= 20 MB", grown <= 20.0, what="peak memory beyond that of 100 rows", value=grown, unit="MB")


def peak_memory() -> float:
    """The most memory that this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if platform.system() == "Darwin" else 1e3)


def _first_calls(table: Table) -> None:
    """A small job in a fresh process: nothing compiled, then compiled."""
    for pose in (None, "exact"):
        with tempfile.TemporaryDirectory() as folder:
            for words, goal in (("without the cache", 3.0), ("with the cache", 1.0)):
                seconds = _fresh(FIRST_CALL.format(pose=pose), folder)
                table.add(
                    f"<= {goal:g} s",
                    seconds <= goal,
                    what=f"first call of a small job, pose={pose!r}, {words}, processor time of the process",
                    value=seconds,
                    unit="s",
                )


def _fresh(program: str, cache: str) -> float:
    """Processor time of a Python process [s], its kernels in a folder of their own."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", program], check=True, env=os.environ | {"NUMBA_CACHE_DIR": cache})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
