"""Closed loops whose robot, sensors or latency are other than controllers know, on the plant of `control_real`.

Each robot drives the clover once per condition. A cell is lost where one of ours has more than 1.1 times the error of
a hand-made PID with friction in front, and more than a difference that counts. Sensors differ from robot to robot: the
axebot measures speeds and a pose, the X-drive counts encoders alone, the mecanum robot has encoders and a pose.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.control_real import ALLOWED, COUNTS, OURS, POSE_NOISE, Instruments, errors, makers
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, Numbers
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray

MORE, LATE, JUMP, MISSING = 1.5, 0.03, 0.05, 0.2  # [1], [s], [m], [1]
JUMP_EVERY, SLIP_EVERY, SLIP_FROM = 50, 3.0, 2.6  # [steps], [s], [s]
SLIPPING, SLIPPED = 1.3, np.array([0.1, -0.05, 0.5])  # of the first wheel; [m/s, m/s, rad/s] where speeds are measured
FRICTION = ("coulomb", "breakaway", "disc", "disc_breakaway")
CONDITIONS = ("nominal", "friction", "payload", "slip", "jumps", "missing held", "missing", "latency")
SENSORS = {"axebot": "instantaneous", "xdrive": "encoder", "mecanum": "localised"}
RIVAL = "PID + kS"
SEED = 0


def changed(numbers: Numbers, condition: str) -> Numbers:
    """The numbers of the plant in a condition."""
    if condition == "friction":
        return numbers | {key: tuple(MORE * level for level in numbers[key]) for key in FRICTION if key in numbers}
    if condition == "payload":
        return numbers | {key: MORE * numbers[key] for key in ("mass", "inertia")}
    return numbers | {"latency": numbers.get("latency", 0.0) + LATE} if condition == "latency" else numbers


class Faulty(Instruments):
    """Instruments that a condition makes wrong."""

    def __init__(self, kind: str, plant: Plant, seed: int, condition: str) -> None:
        super().__init__(kind, plant, seed)
        self._condition, self._faults = condition, np.random.default_rng(seed + 2)
        self._calls, self._jump = 0, np.zeros(3)
        self._held = (plant.pose, np.zeros(3))

    @property
    def _slips(self) -> bool:
        return self._condition == "slip" and self.plant.t % SLIP_EVERY > SLIP_FROM

    def moved_wheels(self) -> FloatArray:
        """What the wheels rolled since the last call; the first rolls farther where it slips [m]."""
        moved = super().moved_wheels()
        return moved * np.append(SLIPPING, np.ones(len(moved) - 1)) if self._slips else moved

    def seen(self) -> tuple[FloatArray, FloatArray]:
        """(pose, twist) as measured now. Shapes (3,)."""
        pose, twist = super().seen()
        if self.kind == "localised":
            pose = self.plant.pose + POSE_NOISE * self._random.standard_normal(3)
        if self._slips and self.kind == "instantaneous":
            twist = twist + SLIPPED
        if self._condition == "jumps" and self._calls % JUMP_EVERY == 0:
            angle = self._faults.uniform(0.0, 2.0 * math.pi)
            self._jump = JUMP * np.array([math.cos(angle), math.sin(angle), 0.0])
        self._calls += 1
        if self._condition.startswith("missing") and self._calls > 6 and self._faults.random() < MISSING:
            return self._held if self._condition.endswith("held") else (np.full(3, np.nan), np.full(3, np.nan))
        self._held = (pose + self._jump, twist)
        return self._held


def cells_of(robot: str, numbers: Numbers, condition: str, kind: str, seed: int) -> dict[str, tuple[float, ...]]:
    """Controller -> (mm, mrad, us) on the clover."""
    plant, known, path = Plant(changed(numbers, condition)), Plant(numbers), paths()["clover"]

    def equip(sensors: str, driven: Plant, number: int) -> Faulty:
        return Faulty(sensors, driven, number, condition)

    return {
        name: errors(plant, make(known), path, kind, seed, equip) for name, make in makers(robot, numbers, kind).items()
    }


def table_of(robots: dict[str, tuple[Numbers, str]], seed: int) -> Table:
    """A row per robot and condition."""
    columns = ["robot", "sensors", "condition", *makers("axebot", NUMBERS["axebot"], ""), *OURS_RATIOS, "lost"]
    title = "control_mismatch: rms of position mm / heading mrad on the clover, models wrong or sensors bad"
    table = Table(title, columns, notes=[f"ratios: to {RIVAL}", machine()])
    count = dict.fromkeys(OURS, 0)
    for robot, (numbers, kind) in robots.items():
        for condition in CONDITIONS:
            cells = cells_of(robot, numbers, condition, kind, seed)
            words: dict[str, Any] = {name: f"{cell[0]:.2f}/{cell[1]:.2f}" for name, cell in cells.items()}
            beaten, best = [], cells[RIVAL]
            for name in OURS:
                words[f"{name} ratio"] = "/".join(f"{cells[name][k] / best[k]:.2f}" for k in range(2))
                lost = [
                    unit
                    for k, unit in enumerate(("mm", "mrad"))
                    if not cells[name][k] <= max(ALLOWED * best[k], best[k] + COUNTS[k])
                ]
                beaten += [f"{name} {unit}" for unit in lost]
                count[name] += len(lost)
            table.add(robot=robot, sensors=kind, condition=condition, lost=", ".join(beaten), **words)
    total = 2 * len(table.rows)
    for name in OURS:
        table.add("0 cells", count[name] == 0, robot="all", sensors=name, lost=f"{count[name]} of {total}")
    return table


OURS_RATIOS = tuple(f"{name} ratio" for name in OURS)


def measure() -> Table:
    """The three robots."""
    return table_of({robot: (numbers, SENSORS[robot]) for robot, numbers in NUMBERS.items()}, SEED)
