"""Closed loops on a plant that shares no code with omnidyn, with the sensors that people have, beside what they write.

Every cell is an rms error of 0.5 s and later against the true pose. A cell is lost where a controller has more than
1.1 times the best of others and more than a difference that counts. `python -m benchmarks.control_real 7 clover` draws
one more plant from seed 7, and drives the clover alone; `... lekiwi` drives that robot alone.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks.control_real.paths import FunctionPath, paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.rivals import (
    DT,
    FRICTION_SHARE,
    LQR_GAIN,
    Behind,
    HandPid,
    KinematicPi,
    LqrIntegral,
    to_body,
)
from benchmarks.control_real.robots import NUMBERS, SLOWER, Numbers, random_numbers, robot_of
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot

SENSORS = ("instantaneous", "encoder", "camera", "jitter")
POSE_NOISE, TWIST_NOISE = np.array([1e-3, 1e-3, 1e-3]), np.array([5e-3, 5e-3, 0.02])


class Camera(NamedTuple):
    """rate [Hz]; delay [s]; noise [m, m, rad] std of a pose, shape (3,)."""

    rate: float
    delay: float
    noise: FloatArray


CAMERAS = {
    "camera": Camera(60.0, 0.04, POSE_NOISE),
    "camera 1 mm": Camera(30.0, 0.06, np.array([1e-3, 1e-3, 2e-3])),
    "camera 2 mm": Camera(30.0, 0.06, np.array([2e-3, 2e-3, 4e-3])),
}
POOLED = ("camera 1 mm", "camera 2 mm")  # of three seeds; rivals stand behind a filter there
SEEDS = (0, 1, 2)
MOST_LOST = {"pid": 0.15, "mpc": 0.05}  # share of the pooled cells
JITTER, SKIP, ALLOWED = 2e-3, 0.5, 1.1  # [s], [s], times the best
GAINS, INTEGRALS, MOST_OF_BEST = 20, (0.0, 250.0), 1.3  # of a speed loop: how many; k_i [V/rad]; rms over the least
COUNTS = (0.05, 0.2)  # [mm], [mrad] a difference that counts
CONTROLLERS = {"pid": Pid, "mpc": Mpc}
OURS, RIVALS = ("pid", "mpc"), ("PID + kS", "LQR + I", "PI + FF")
COLUMNS = ("PID", "PID + kS", "LQR + I", "PI + FF", "pid", "mpc")


class Instruments:
    """What a controller is given in place of the truth. kind: one of SENSORS, or of CAMERAS."""

    def __init__(self, kind: str, plant: Plant, seed: int) -> None:
        self.kind, self.plant, self._random = kind, plant, np.random.default_rng(seed)
        self._twist_of = np.linalg.pinv(plant.directions.T)
        self._angles, self._pose, self._t = plant.encoders(), plant.pose, plant.t
        self._frames = [(-math.inf, plant.pose)]
        self._next, self._camera = 0, CAMERAS.get(kind)

    def seen(self) -> tuple[FloatArray, FloatArray]:
        """(pose, twist) as measured now. Shapes (3,)."""
        noise = self._random.standard_normal(6)
        if self.kind in ("instantaneous", "jitter"):
            return self.plant.pose + POSE_NOISE * noise[:3], self.plant.twist + TWIST_NOISE * noise[3:]
        twist = self._counted()
        if self._camera is None:
            return self._pose.copy(), twist
        while self._frames and len(self._frames) > 1 and self._frames[1][0] <= self.plant.t + 1e-9:
            self._frames.pop(0)
        return self._frames[0][1].copy(), twist

    def _counted(self) -> FloatArray:
        """Means of the speeds since the last call, added up to a pose."""
        moved, seconds = self._twist_of @ self.moved_wheels(), self.plant.t - self._t
        self._pose = self._pose + to_body(self._pose[2] + 0.5 * moved[2]).T @ moved
        self._t = self.plant.t
        return moved / seconds if seconds > 0.0 else np.zeros(3)

    def moved_wheels(self) -> FloatArray:
        """What the wheels rolled since the last call, as encoders count it [m]. Shape (wheels,)."""
        angles, before = self.plant.encoders(), self._angles
        self._angles = angles
        return (angles - before) * self.plant.radius

    def drive(self, output: FloatArray, seconds: float) -> None:
        """Let the plant go on; a camera takes its pictures meanwhile."""
        end = self.plant.t + seconds
        if self._camera is not None:
            rate, delay, noise = self._camera
            while self._next / rate < end:
                self._advance(output, self._next / rate - self.plant.t)
                pose = self.plant.pose + noise * self._random.standard_normal(3)
                self._frames.append((self.plant.t + delay, pose))
                self._next += 1
        self._advance(output, end - self.plant.t)

    def _advance(self, output: FloatArray, seconds: float) -> None:
        if seconds > 1e-9:
            self.plant.step(output, seconds)


def told(robot: Robot, kind: str) -> Robot:
    """The robot as its file says which sensors it has."""
    if kind in CAMERAS:
        camera = CAMERAS[kind]
        sensors = Sensors(twist="mean", pose_delay=camera.delay, pose_rate=camera.rate)
        if kind in POOLED:
            sensors = sensors.replace(pose_noise=float(camera.noise[0]), heading_noise=float(camera.noise[2]))
        return robot.replace(sensors=sensors)
    return robot.replace(sensors=Sensors(twist="mean") if kind in ("encoder", "localised") else None)


def makers(name: str, numbers: Numbers, kind: str) -> dict[str, Callable[[Plant], Any]]:
    """Controller -> what makes it for a plant."""
    made = _makers(name, numbers, kind)
    if kind not in POOLED:
        return made
    delay = CAMERAS[kind].delay
    return {key: make if key in OURS else partial(Behind, make, delay) for key, make in made.items() if key != "PID"}


def _makers(name: str, numbers: Numbers, kind: str) -> dict[str, Callable[[Plant], Any]]:
    robot = told(robot_of(name, numbers), kind)
    ours: dict[str, Callable[[Plant], Any]] = {"pid": lambda plant: Pid(robot), "mpc": lambda plant: Mpc(robot)}
    if "loop" in numbers:
        return {"PI + FF": KinematicPi, **ours}
    return {
        "PID": HandPid,
        "PID + kS": lambda plant: HandPid(plant, FRICTION_SHARE),
        "LQR + I": lambda plant: LqrIntegral(plant, LQR_GAIN.get(name, 10.0)),
        **ours,
    }


def wrench_at(t: float, friction: FloatArray) -> FloatArray:
    """A knock of three times what friction holds, and a long push of 0.8 times, every 6 s."""
    phase = t % 6.0
    return 3.0 * friction if 1.0 <= phase < 1.15 else -0.8 * friction if 2.5 <= phase < 4.5 else 0.0 * friction


def errors(
    plant: Plant,
    control: Any,
    path: FunctionPath,
    kind: str,
    seed: int = 0,
    equip: Callable[[str, Plant, int], Instruments] = Instruments,
) -> tuple[float, float, float]:
    """(rms of the position [mm], of the heading [mrad], median time of a step [us]). An output that is NaN is zeros."""
    plant.reset(path.at(0.0).pose)
    instruments, random = equip(kind, plant, seed), np.random.default_rng(seed + 1)
    early = round(plant.latency / DT)
    start, took, off = -early * DT, [], []
    while (t := start + plant.t) < path.end - 0.5 * DT:
        pose, twist = instruments.seen()
        plant.push = wrench_at(t, plant.friction) if path.name == "push" and t >= 0.0 else np.zeros(3)
        before = time.thread_time()
        output = np.asarray(control.step(t, pose, twist, path))
        took.append(time.thread_time() - before)
        instruments.drive(np.nan_to_num(output), DT + (JITTER * random.uniform(-1.0, 1.0) if kind == "jitter" else 0.0))
        if start + plant.t >= SKIP:
            error = plant.pose - path.at(start + plant.t).pose
            off.append((math.hypot(error[0], error[1]), math.remainder(error[2], 2.0 * math.pi)))
    rms = 1e3 * np.sqrt(np.mean(np.square(off), axis=0))
    return float(rms[0]), float(rms[1]), 1e6 * float(np.median(took))


def seeds_of(kind: str) -> tuple[int, ...]:
    """Of the noise, whose runs are pooled."""
    return SEEDS if kind in POOLED else SEEDS[:1]


def pooled(runs: list[tuple[float, float, float]]) -> tuple[float, float, float]:
    """Root of the mean squared errors of several runs, and the mean time of a step."""
    position, heading = np.sqrt(np.mean(np.square([run[:2] for run in runs]), axis=0)).tolist()
    return position, heading, float(np.mean([run[2] for run in runs]))


def lost(cells: dict[str, tuple[float, float, float]]) -> list[tuple[str, str]]:
    """(controller, "mm" or "mrad") where one of ours is beaten."""
    found = []
    for k, unit in enumerate(("mm", "mrad")):
        best = min(cells[name][k] for name in RIVALS if name in cells)
        for name in OURS:
            if cells[name][k] > max(ALLOWED * best, best + COUNTS[k]):
                found.append((name, unit))
            best = min(best, cells[name][k])
    return found


def table_of(robots: dict[str, Numbers], names: list[str]) -> Table:
    """A row per robot, path and sensors."""
    columns = ["robot", "path", "sensors", *COLUMNS, "lost"]
    table = Table("control_real: rms of position mm / heading mrad on an independent plant", columns, notes=[machine()])
    count, pooled_count = ({name: 0 for name in OURS} for _ in range(2))
    times: dict[str, list[float]] = {name: [] for name in OURS}
    for robot, numbers in robots.items():
        for name in names:
            for kind in (*SENSORS, *POOLED):
                path, plant = paths(SLOWER.get(robot, 1.0))[name], Plant(numbers)
                cells = {
                    control: pooled([errors(plant, make(plant), path, kind, seed) for seed in seeds_of(kind)])
                    for control, make in makers(robot, numbers, kind).items()
                }
                beaten = lost(cells)
                for control, _ in beaten:
                    (pooled_count if kind in POOLED else count)[control] += 1
                for control in OURS:
                    times[control].append(cells[control][2])
                words: dict[str, Any] = {name: "" for name in COLUMNS}
                words |= {control: f"{cell[0]:.2f}/{cell[1]:.2f}" for control, cell in cells.items()}
                words["lost"] = ", ".join(f"{control} {unit}" for control, unit in beaten)
                table.add(robot=robot, path=name, sensors=kind, **words)
    rows = len(table.rows)
    total = 2 * rows * len(SENSORS) // (len(SENSORS) + len(POOLED))
    pooled_total = 2 * rows - total
    for control in OURS:
        most = MOST_LOST[control]
        table.add(
            f"{100.0 * most:.0f} %",
            pooled_count[control] <= most * pooled_total,
            robot="all",
            path=control,
            sensors="cameras of 30 Hz",
            lost=f"{pooled_count[control]} of {pooled_total}",
        )
    for control in OURS:
        table.add(
            "0 cells",
            count[control] == 0,
            robot="all",
            path=control,
            sensors=f"{np.median(times[control]):.0f} us a step",
            lost=f"{count[control]} of {total}",
        )
    return table


def add_gains(table: Table) -> None:
    """LeKiwi on the clover under other gains of its firmware: rows, and each of ours beside its own best."""
    name, path = "lekiwi", paths(SLOWER["lekiwi"])["clover"]
    known = told(robot_of(name, NUMBERS[name]), "encoder")
    found: dict[str, list[float]] = {control: [] for control in OURS}
    for ki in np.linspace(*INTEGRALS, GAINS).tolist():
        proportional, _, rate = NUMBERS[name]["loop"]
        plant = Plant(NUMBERS[name] | {"loop": (proportional, ki, rate)})
        robot = known.replace(drive=known.drive.replace(ki=ki))
        cells = {control: errors(plant, CONTROLLERS[control](robot), path, "encoder") for control in OURS}
        words = {control: f"{cell[0]:.2f}/{cell[1]:.2f}" for control, cell in cells.items()}
        table.add(robot=f"{name}, ki = {ki:.0f}", path=path.name, sensors="encoder", **words)
        for control in OURS:
            found[control].append(cells[control][0])
    for control, rms in found.items():
        ratio = max(rms) / min(rms)
        goal, met = (f"{MOST_OF_BEST:g} times", ratio <= MOST_OF_BEST) if control == "mpc" else ("", None)
        table.add(goal, met, robot=f"{name}, {GAINS} gains", path=control, lost=f"{ratio:.2f} times its best")


def measure() -> Table:
    """All robots on all paths, and the gains of a speed loop."""
    table = table_of(NUMBERS, list(paths()))
    add_gains(table)
    return table


def main(arguments: list[str]) -> None:
    """A seed draws one more plant; a word is a path or a robot, all by default."""
    seeds = [int(word) for word in arguments if word.isdigit()]
    names = [word for word in arguments if word in paths()] or list(paths())
    robots = {f"seed {seed}": random_numbers(seed) for seed in seeds}
    robots |= {word: NUMBERS[word] for word in arguments if word in NUMBERS}
    print(table_of(robots or NUMBERS, names).as_text())
