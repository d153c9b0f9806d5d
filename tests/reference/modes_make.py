"""Makes modes.npz: the reference of modes.py for the robots of seeds 0 to 39 of tests/support/mixed_robots.py.

    python tests/reference/modes_make.py            # PYTHONPATH=src; two processes, some minutes
    python tests/reference/modes_make.py --check 3  # and the Moreau stepper against every third of them

Resumable: every finished robot is written at once, and one whose numbers have not changed is not run again
(delete the file when the reference itself has changed). Each is run twice, the second time with rtol 1000
times as coarse; `spread_*`: how far apart the two end [m/s, rad/s, pose, A], the energy residual [J], the
time taken [s]. A robot whose reference meets a tie is not stored: count it in mixed_robots.REDRAWN and run
again.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import sys
import time
from dataclasses import fields
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.reference.modes import RTOL, Tie, Truth, plant_of, reference
from tests.support.mixed_robots import eager, random_robot, random_voltages

FILE = Path(__file__).with_name("modes.npz")
SEEDS = range(40)
CLOSE = 1e-9  # a margin below this is a tie


def key(robot, voltage, dt) -> str:
    """What the numbers of a robot and its program hash to, to ten digits: the same on every platform."""
    plant = plant_of(robot)
    left_out = ["names"] if plant.spin.any() else ["names", "spin"]  # as before there was any
    if not np.isfinite([*plant.stribeck, plant.stribeck_ellipse]).any():
        left_out += ["stribeck", "exponent", "stribeck_ellipse", "exponent_ellipse"]
    left_out += ["shapes", "shape_ellipse"]
    others = [*plant.shapes, plant.shape_ellipse] if {*plant.shapes, plant.shape_ellipse} != {"exponential"} else []
    numbers = [getattr(plant, f.name) for f in fields(plant) if f.name not in left_out]
    flat = [*(n for n in numbers if n is not None), voltage, dt]
    words = [f"{x + 0.0:.10g}" for n in flat for x in np.where(np.abs(n) < 1e-12, 0.0, n).ravel().tolist()]
    text = " ".join([*words, *others])
    return hashlib.sha256(text.encode()).hexdigest()


def load(seed: int) -> Truth | None:
    """The stored truth of a seed; None where there is none, or its robot has changed since."""
    if not FILE.exists():
        return None
    robot = random_robot(seed)
    voltage, dt = random_voltages(robot, seed)
    with np.load(FILE) as file:
        if f"key_{seed}" not in file or str(file[f"key_{seed}"]) != key(robot, voltage, dt):
            return None
        wheels, samples = robot.wheels.count, len(dt) + 1
        bits = np.unpackbits(file[f"stuck_{seed}"], count=samples * (4 + wheels))
        events, steps, margin = file[f"count_{seed}"]
        return Truth(
            np.concatenate([[0.0], np.cumsum(dt)]),
            file[f"twist_{seed}"],
            file[f"pose_{seed}"],
            file[f"current_{seed}"],
            bits.reshape(samples, -1).astype(bool),
            int(events),
            float(margin),
            int(steps),
        )


def content(seed: int) -> tuple[int, dict | str]:
    """(seed, what the file keeps of it, or why it is not kept)."""
    robot = random_robot(seed)
    voltage, dt = random_voltages(robot, seed)
    began = time.process_time()
    try:
        truth = reference(robot, voltage, dt, energy=True)
        spent = time.process_time() - began
        coarse = reference(robot, voltage, dt, rtol=1000 * RTOL)
    except Tie as tie:
        return seed, str(tie)
    if truth.margin < CLOSE:
        return seed, f"margin {truth.margin:.1e}"
    spread = [np.abs(truth.twist - coarse.twist)[:, :2].max(), np.abs(truth.twist - coarse.twist)[:, 2].max()]
    spread += [np.abs(truth.pose - coarse.pose).max(), np.abs(truth.current - coarse.current).max()]
    return seed, {
        f"key_{seed}": np.array(key(robot, voltage, dt)),
        f"twist_{seed}": truth.twist,
        f"pose_{seed}": truth.pose,
        f"current_{seed}": truth.current,
        f"stuck_{seed}": np.packbits(truth.stuck),
        f"count_{seed}": np.array([truth.events, truth.steps, truth.margin]),
        f"spread_{seed}": np.array([*spread, np.abs(truth.energy).max(), spent]),
    }


def make() -> None:
    """Fills the file, the robots without breakaway above coulomb first."""
    every = {}
    if FILE.exists():
        with np.load(FILE) as file:
            every = dict(file)
    todo = [seed for seed in sorted(SEEDS, key=lambda seed: (eager(seed), seed)) if load(seed) is None]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        for seed, got in pool.imap_unordered(content, todo):
            if isinstance(got, str):
                print(f"seed {seed}: a tie, count it in REDRAWN: {got}", flush=True)
                continue
            every |= got
            part = FILE.with_suffix(".part.npz")
            np.savez_compressed(part, **every)
            os.replace(part, FILE)
            s = got[f"spread_{seed}"]
            s, (events, _, margin) = got[f"spread_{seed}"], got[f"count_{seed}"]
            print(f"seed {seed}: {events:.0f} events, margin {margin:.0e}, spread {s[0]:.0e} m/s", end="")
            print(f" {s[1]:.0e} rad/s {s[2]:.0e} m {s[3]:.0e} A, energy {s[4]:.0e} J, {s[5]:.1f} s", flush=True)
    print(f"{FILE}: {sum(load(seed) is not None for seed in SEEDS)} robots, {FILE.stat().st_size} bytes")


def check(every: int) -> None:
    """Prints the largest difference of the Moreau stepper at halved steps."""
    from tests.reference.modes_stepper import stepped

    for seed in SEEDS[::every]:
        truth, robot = load(seed), random_robot(seed)
        if truth is None:
            continue
        runs = [stepped(plant_of(robot), *random_voltages(robot, seed), h)[0] for h in (4e-5, 2e-5, 1e-5, 5e-6)]
        errors = " ".join(f"{np.abs(run - truth.twist[1:]).max():.1e}" for run in runs)
        rest = ((np.abs(runs[-1]) < 1e-9) != truth.stuck[1:, :3]).sum()
        print(f"seed {seed}: {errors}; {rest} of {3 * len(runs[-1])} rest flags differ", flush=True)


if __name__ == "__main__":
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"  # for the processes to come
    make()
    if "--check" in sys.argv:
        check(int(sys.argv[sys.argv.index("--check") + 1]))
