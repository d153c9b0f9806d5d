"""Which moves: of those that end inside the room, the ones that tell most for their time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.planning.moves import PlannedMove
from omnidyn.identification.planning.recorded import driven
from omnidyn.model.robot import Robot

LONGEST_REST, SPARE_REST = 2.0, 0.1  # [s] a robot that still moves then is asked for less; more than the slowest needs
STANDS = np.array([2e-3, 2e-3, 1e-2])  # [m/s, m/s, rad/s] what is slower stands
UNKNOWN = 3.0  # std of a number that nothing is known of, as a share of it


class TriedMove(NamedTuple):
    """A move with the rest that it needs; reach [m]: how far it goes with any of some robots; moved: whether it does
    at all with the first of them."""

    move: PlannedMove
    reach: float
    moved: bool


def tried(move: PlannedMove, robots: Sequence[Robot], dt: float) -> TriedMove | None:
    """What a move does with some robots, the first of them that of the file; None where one still moves LONGEST_REST
    after it."""
    rest = reach = 0.0
    moved = False
    for k, robot in enumerate(robots):
        run = driven(robot, replace(move, rest=LONGEST_REST).input(robot, dt), dt)
        twist, pose = np.asarray(run.twist), np.asarray(run.pose)
        is_fast = np.asarray((np.abs(twist) > STANDS).any(axis=1))
        if is_fast[-1]:
            return None
        last = int(np.flatnonzero(is_fast)[-1]) if is_fast.any() else 0
        rest = max(rest, last * dt - move.seconds)
        reach = max(reach, float(np.hypot(*pose[:, :2].T).max()))
        moved |= not k and bool(is_fast.any())
    return TriedMove(replace(move, rest=round(max(rest, 0.0) + SPARE_REST, 2)), reach, moved)


Score = Callable[[FloatArray], float]  # of the covariance of relative changes: less is better


def geometric_mean(covariance: FloatArray) -> float:
    """The mean logarithm of the standard errors that stand alone for the volume of them all."""
    return 0.5 * float(np.linalg.slogdet(covariance)[1]) / len(covariance)


def of_number(k: int) -> Score:
    """The logarithm of the standard error of one number."""
    return lambda covariance: 0.5 * float(np.log(covariance[k, k]))


def chosen(
    moves: Sequence[PlannedMove], information: FloatArray, seconds: float, score: Score, begun: FloatArray
) -> list[int]:
    """Which moves in which order, as often as they pay, within a time [s]: each the best for its time after those
    before it. information (moves, P, P); begun (P, P): of what is driven anyway."""
    total = begun + np.eye(information.shape[-1]) / UNKNOWN**2
    order: list[int] = []
    durations = np.array([move.duration for move in moves])
    remaining = seconds
    while True:
        fitting = np.flatnonzero(durations <= remaining)
        if not fitting.size:
            return order
        now = score(_inverse(total))
        gains = [(now - score(_inverse(total + information[k]))) / durations[k] for k in fitting]
        best = int(fitting[int(np.argmax(gains))])
        order.append(best)
        total = total + information[best]
        remaining -= durations[best]


def _inverse(information: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(information), dtype=np.float64)
