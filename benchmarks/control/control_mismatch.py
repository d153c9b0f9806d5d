"""Closed loops whose robot, sensors or latency are other than controllers know, on the plant of `control_real`.

Each robot drives the clover once per condition. A cell is lost where one of ours has more than 1.1 times the error of
a hand-made PID with friction in front (a PI of the pose where the drive has a speed loop), and more than a difference
that counts. Sensors differ from robot to robot: the axebot measures speeds and a pose, the X-drive counts encoders
alone, the mecanum robot has encoders and a pose, LeKiwi encoders; axebot and LeKiwi come again with a late camera.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.control_real import ALLOWED, COLUMNS, COUNTS, MOST_LOST, OURS, POSE_NOISE, Instruments, errors, makers
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, SLOWER, Numbers
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.control.controller import SWINGS

MORE, LATE, JUMP, MISSING = 1.5, 0.03, 0.05, 0.2  # [1], [s], [m], [1]
JUMP_EVERY, SLIP_EVERY, SLIP_FROM = 50, 3.0, 2.6  # [steps], [s], [s]
SLIPPING, SLIPPED = 1.3, np.array([0.1, -0.05, 0.5])  # of the first wheel; [m/s, m/s, rad/s] where speeds are measured
FRICTION = ("coulomb", "breakaway", "disc", "disc_breakaway")
CONDITIONS = ("nominal", "friction", "payload", "slip", "jumps", "missing held", "missing", "latency")
CASES = (
    ("axebot", "instantaneous"),
    ("xdrive", "encoder"),
    ("mecanum", "localised"),
    ("lekiwi", "encoder"),
    ("axebot", "camera 1 mm"),
    ("lekiwi", "camera 1 mm"),
)
RIVALS = ("PID + kS", "PI + FF")  # the first that drives a robot
SEED, FAR, WIDE = 0, 5e-3, 5.0  # [1], [m], [mm]


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


class Watched:
    """A controller in a loop: when it first said that the loop swings, and when the robot was first FAR off [s]."""

    def __init__(self, control: Any, plant: Plant) -> None:
        self._control, self._plant = control, plant
        self.said = self.far = math.inf

    def step(self, t: float, pose: FloatArray, twist: FloatArray, path: Any) -> FloatArray:
        """As the controller."""
        output = self._control.step(t, pose, twist, path)
        info = getattr(self._control, "info", None)
        if info is not None and info.status == SWINGS:
            self.said = min(self.said, t)
        if math.dist(self._plant.pose[:2], path.at(t).pose[:2]) > FAR:
            self.far = min(self.far, t)
        return output


def cells_of(robot: str, numbers: Numbers, condition: str, kind: str, seed: int) -> dict[str, tuple[float, ...]]:
    """Controller -> (mm, mrad, us, when it said that it swings, when it was far off) on the clover."""
    plant, known = Plant(changed(numbers, condition)), Plant(numbers)
    path = paths(SLOWER.get(robot, 1.0))["clover"]

    def equip(sensors: str, driven: Plant, number: int) -> Faulty:
        return Faulty(sensors, driven, number, condition)

    cells = {}
    for name, make in makers(robot, numbers, kind).items():
        control = Watched(make(known), plant)
        cells[name] = (*errors(plant, control, path, kind, seed, equip), control.said, control.far)
    return cells


def says_so(cells: dict[str, dict[str, tuple[float, ...]]]) -> tuple[int, int, int, int]:
    """Of one robot, by condition: cells with LATE that are WIDE off and say nothing within a second, all of them.

    Then nominal cells that say it, and cells of wrong models, less than twice as far off as the nominal one, that do.
    """
    silent = nominal = wrong = 0
    for name in OURS:
        _, _, _, said, far = cells["latency"][name]
        silent += cells["latency"][name][0] > WIDE and said > far + 1.0
        nominal += math.isfinite(cells["nominal"][name][3])
        wrong += sum(
            math.isfinite(cell[name][3]) and cell[name][0] < 2.0 * cells["nominal"][name][0]
            for condition, cell in cells.items()
            if condition not in ("nominal", "latency")
        )
    return silent, len(OURS), nominal, wrong


def table_of(cases: tuple[tuple[str, str], ...], seed: int) -> Table:
    """A row per case, a robot and its sensors, and condition."""
    columns = ["robot", "sensors", "condition", *COLUMNS, *OURS_RATIOS, "swings", "lost"]
    title = "control_mismatch: rms of position mm / heading mrad on the clover, models wrong or sensors bad"
    table = Table(title, columns, notes=[f"ratios: to {' or '.join(RIVALS)}", machine()])
    count = dict.fromkeys(OURS, 0)
    swings = np.zeros(4, int)
    for robot, kind in cases:
        by_condition = dict[str, dict[str, tuple[float, ...]]]()
        for condition in CONDITIONS:
            cells = by_condition[condition] = cells_of(robot, NUMBERS[robot], condition, kind, seed)
            words: dict[str, Any] = {name: f"{cell[0]:.2f}/{cell[1]:.2f}" for name, cell in cells.items()}
            beaten, best = [], next(cells[name] for name in RIVALS if name in cells)
            for name in OURS:
                words[f"{name} ratio"] = "/".join(f"{cells[name][k] / best[k]:.2f}" for k in range(2))
                lost = [
                    unit
                    for k, unit in enumerate(("mm", "mrad"))
                    if not cells[name][k] <= max(ALLOWED * best[k], best[k] + COUNTS[k])
                ]
                beaten += [f"{name} {unit}" for unit in lost]
                count[name] += len(lost)
            words["swings"] = ", ".join(f"{name} {cells[name][3]:.1f} s" for name in OURS if cells[name][3] < math.inf)
            table.add(robot=robot, sensors=kind, condition=condition, lost=", ".join(beaten), **words)
        swings += says_so(by_condition)
    total = 2 * len(table.rows)
    for name in OURS:
        most = MOST_LOST[name]
        share = f"{count[name]} of {total}"
        table.add(f"{100.0 * most:.0f} %", count[name] <= most * total, robot="all", sensors=name, lost=share)
    silent, late, nominal, wrong = swings.tolist()
    cells = len(cases) * len(OURS)
    share = f"{silent} of {late}"
    table.add("0 cells", silent == 0, robot="all", sensors="late, 5 mm off, silent for a second", lost=share)
    table.add("0 cells", nominal == 0, robot="all", sensors="nominal and said to swing", lost=f"{nominal} of {cells}")
    share = f"{wrong} of {cells * (len(CONDITIONS) - 2)}"
    table.add("1 cell", wrong <= 1, robot="all", sensors="wrong model, little off, said to swing", lost=share)
    return table


OURS_RATIOS = tuple(f"{name} ratio" for name in OURS)


def measure() -> Table:
    """All cases."""
    return table_of(CASES, SEED)
