"""Two floors in one run: which changes of friction are named, beside two halves by least squares.

Simulated by `wrong_worlds`, which shares no code with ours: one command of a robot, 10 to 20 s long. The force of
friction goes to another level at once or over up to 3 s, as wheels cross an edge one by one, and rolls unevenly by 3 %
for a second at a time; currents are noisy. By hand a run changes where the means of seconds before and after the true
crossing differ by more than four combined standard errors, in its odd and in its even rows. The plainest method takes
the two halves, at any second, that differ most, and names four standard errors.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.blind.log import robot_of
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table, machine
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.moment import moments
from omnidyn.run import Run

RUNS = 300  # of each kind
RATE, BEGIN = 50.0, 1.0  # [Hz]; [s] until it is steady
COLUMNS = ["floors", "runs", "named", "plain names", "s a run"]
CLEAR, DOUBTFUL = 4.0, 3.0  # standard errors
LEAST = 3  # seconds on either side


@dataclass(frozen=True, eq=False)
class Drive:
    """A run, the force along its mean of each row (n,), where it crosses to another floor [s]; NaN on one floor."""

    run: Run
    force: FloatArray
    crossing: tuple[float, float]

    def by_hand(self, rows: slice) -> float:
        """Standard errors by which both sides of the crossing differ, in some of the rows."""
        t, force = self.run.t[rows], self.force[rows]
        before, after = (
            seconds(t[side], force[side]) for side in ((t > BEGIN) & (t < self.crossing[0]), t > self.crossing[1])
        )
        return difference(before, after)

    def plainly(self) -> float:
        """That of the two halves of all seconds that differ most."""
        kept = self.run.t > BEGIN
        means = seconds(self.run.t[kept], self.force[kept])
        return max(difference(means[:cut], means[cut:]) for cut in range(LEAST, len(means) - LEAST + 1))


def seconds(t: FloatArray, force: FloatArray) -> FloatArray:
    """The mean of each second."""
    number = np.floor(t - t[0]).astype(int)
    counts = np.bincount(number)
    return (np.bincount(number, force) / counts)[counts > 0.5 * counts.max()]


def difference(before: FloatArray, after: FloatArray) -> float:
    """How far two means are apart, in combined standard errors."""
    error = np.hypot(*(part.std(ddof=1) / len(part) ** 0.5 for part in (before, after)))
    return abs(float(before.mean() - after.mean())) / float(error)


def driven(number: int, changes: bool) -> Drive:
    """A run over one floor, or over two: the second has .4 to 1.6 times the friction of the first."""
    rng = np.random.default_rng([number, changes])
    length = rng.uniform(10.0, 20.0)
    t = np.arange(0.0, length, 1.0 / RATE)
    begin, width = rng.uniform(BEGIN + LEAST, length - 2.0 * LEAST), rng.choice([0.0, 1.0, 3.0])
    factor = float(np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(np.log(1.02), np.log(1.6)))) if changes else 1.0
    world, angle = World(coulomb=(3.9, 3.9, 0.2), rim=(0.0, 0.0)), rng.uniform(0.0, 2.0 * np.pi)
    volts = np.array([np.cos(angle), np.sin(angle)]) @ np.linalg.pinv(world.G)[:, :2].T
    volts = np.tile(9.0 * volts / np.abs(volts).max(), (len(t), 1))
    on_second = np.clip((t - begin) / max(width, 1e-9), 0.0, 1.0)[:, None]
    first, second = (_logged(replace(world, coulomb=(3.9 * k, 3.9 * k, 0.2)), t, volts) for k in (1.0, factor))
    current, speed = ((1.0 - on_second) * a + on_second * b for a, b in zip(first, second, strict=True))
    rows = round(RATE)
    uneven = np.convolve(rng.normal(size=len(t) + rows - 1), np.ones(rows) / rows**0.5, "valid")
    current = current * (1.0 + 0.03 * uneven)[:, None] + 0.03 * rng.normal(size=current.shape)
    run = Run(t, voltage=volts, wheel_speed=speed + 0.1 * rng.normal(size=speed.shape), current=current, source="run")
    push = (current @ world.G.T)[:, :2]
    mean = push[t > BEGIN].mean(axis=0)
    return Drive(run, push @ mean, (begin, min(begin + width, length - LEAST)) if changes else (np.nan, np.nan))


def _logged(world: World, t: FloatArray, volts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(currents, speeds of the wheels)."""
    speed = drive(world, t, volts, t).wheel_speed
    return (volts - speed * world.gear_ratio * np.array(world.torque_constant)) / np.array(world.resistance), speed


def measure() -> Table:
    """Runs that change, by how clearly they do by hand, and runs over one floor."""
    table = Table("floors: changes of friction inside a run that are named", COLUMNS)
    table.notes += [
        machine(),
        "the simulator, what is a change by hand, and the plainest method: benchmarks/identification/floors.py",
    ]
    count = scaled(RUNS, 4)
    robot = robot_of(World(rim=(0.0, 0.0)))
    kinds: dict[str, list[tuple[bool, bool]]] = {"more": [], "between": [], "less": [], "one": []}
    began = time.process_time()
    for number in range(count):
        for changes in (True, False):
            driven_run = driven(number, changes)
            names = bool(moments([driven_run.run], robot, "current")[0]), driven_run.plainly() > CLEAR
            clear = [driven_run.by_hand(slice(k, None, 2)) for k in (0, 1)] if changes else [np.nan]
            kind = "more" if min(clear) > CLEAR else "less" if max(clear) < DOUBTFUL else "between"
            kinds[kind if changes else "one"].append(names)
    cost = (time.process_time() - began) / (2.0 * count)
    goals = {
        "more": ("two, more than 4 standard errors by hand", 1.0, None),
        "between": ("two, 3 to 4", None, None),
        "less": ("two, less than 3", None, 0.0),
        "one": ("one", None, 0.02),
    }
    for kind, (title, least, most) in goals.items():
        named = sum(ours for ours, _ in kinds[kind])
        runs = len(kinds[kind])
        granted = 0.0 if WHOLE else 2.0
        cells = {"floors": title, "runs": runs, "named": named, "plain names": sum(p for _, p in kinds[kind])}
        goal = "all" if least else "" if most is None else f"at most {100.0 * most:.0f} %"
        met = None if not goal else named >= runs - granted if least else named <= (most or 0.0) * runs + granted
        table.add(goal, met, **cells, **{"s a run": cost})
    return table
