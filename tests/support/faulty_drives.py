"""Drives of simulated robots: healthy ones, and ones that misbehave at random. A simulated clock: nothing waits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import omnidyn
from omnidyn.driving.clock import SimulatedClock
from omnidyn.driving.drive import drive
from omnidyn.driving.guard import Limits
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.record import DriveRecord
from omnidyn.driving.simulated import (
    CLOCK,
    FAULTS,
    LATE,
    PUSHED,
    SUPPLY,
    Fault,
    SimulatedRobot,
)

DT, AREA, SUPPLY_V = 0.02, (3.0, 3.0), 12.0
SENSORS = (  # of which a robot has one set
    {"twist": np.array([0.02, 0.02, 0.1])},
    {"wheel_speed": np.full(3, 0.1)},
    {"wheel_angle": np.full(3, 2.0 * np.pi / 2048.0)},
    {"pose": np.array([0.002, 0.002, 0.01])},
    {"wheel_angle": np.full(3, 2.0 * np.pi / 2048.0), "pose": np.array([0.002, 0.002, 0.01])},
    {"wheel_speed": np.full(3, 0.1), "twist": np.array([0.02, 0.02, 0.1])},
)
SIZES = {LATE: (0.0, 1.0), CLOCK: (-5.0, 5.0), SUPPLY: (4.0, SUPPLY_V), PUSHED: (-15.0, 15.0)}


class Driven(NamedTuple):
    """kind: of the fault, or "". after: how long a motor got anything after the last command was sent [s]."""

    kind: str
    record: DriveRecord
    after: float


def axebot_program() -> DriveProgram:
    """Six seconds of the paper's robot: forward, left and turn, there and back, with ramps and reversals."""
    pattern = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])
    rows = [np.zeros((10, 3))]
    for axis, level, count in ((0, 5.0, 30), (2, 3.0, 25), (1, 4.0, 30), (2, 6.0, 20), (0, 2.0, 40)):
        shape = np.ones(count) if axis != 2 else np.where(np.arange(count) < count // 2, 1.0, -1.0)
        leg = np.concatenate([level * shape[:, None] * pattern[axis], np.zeros((8, 3))])
        rows += [leg, -leg]
    return DriveProgram(omnidyn.load_robot("axebot"), DT, np.concatenate(rows), AREA)


def with_battery(robot: omnidyn.Robot) -> omnidyn.Robot:
    """The same robot with a battery that it measures."""
    return robot.replace(drive=robot.drive.replace(supply=SUPPLY_V))


def random_fault(rng: np.random.Generator, seconds: float) -> Fault:
    """One of FAULTS, at any moment of a drive."""
    kind = FAULTS[rng.integers(len(FAULTS))]
    size = float(rng.uniform(*SIZES.get(kind, (0.0, 0.0))))
    return Fault(kind, float(rng.uniform(0.0, seconds)), size, int(rng.integers(3)))


def driven(program: DriveProgram, robot: omnidyn.Robot, rng: np.random.Generator, fault: Fault | None = None) -> Driven:
    """One drive; in half of those with a fault, the key is released within half a second of it."""
    clock = SimulatedClock()
    noise = SENSORS[rng.integers(len(SENSORS))]
    seed, delay = int(rng.integers(1 << 30)), float(rng.uniform(0.0, 0.03))
    faults = [fault] if fault is not None else []
    simulated = SimulatedRobot(
        with_battery(robot), noise, clock=clock, rate=1.0 / DT, delay=delay, faults=faults, seed=seed
    )
    released = fault.at + rng.uniform(-0.1, 0.5) if fault is not None and rng.random() < 0.5 else np.inf
    record = drive(program, simulated, clock=clock, limits=Limits(supply=9.0), held=lambda: clock.now() < released)
    clock.sleep_until(clock.now() + 3.0)  # what was under way arrives
    simulated.receive()
    return Driven(fault.kind if fault is not None else "", record, simulated.last_driven - record.stopped_at)
