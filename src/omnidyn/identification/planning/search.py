"""Which moves: of those that end inside the room, the ones that tell most for their time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.planning.aims import Score
from omnidyn.identification.planning.limits import PlanLimits, Strain, strain
from omnidyn.identification.planning.moves import PlannedMove
from omnidyn.identification.planning.recorded import driven
from omnidyn.model.robot import Robot

LONGEST_REST, SPARE_REST = 2.0, 0.1  # [s] a robot that still moves then is asked for less; more than the slowest needs
STANDS = np.array([2e-3, 2e-3, 1e-2])  # [m/s, m/s, rad/s] what is slower stands
UNKNOWN = 3.0  # std of a number that nothing is known of, as a share of it
ROOM, STILL = "room", "still"  # why a move is left out, beside "rest" and the names of PlanLimits


class TriedMove(NamedTuple):
    """A move with the rest that it needs; reach [m]: how far it goes with any of some robots; moved: whether it does
    at all with the first of them, and stands again soon with all; strain: the most that it asks of any."""

    move: PlannedMove
    reach: float
    moved: bool
    stands: bool
    strain: Strain


def tried(move: PlannedMove, robots: Sequence[Robot], limits: PlanLimits, dt: float) -> TriedMove:
    """What a move does with some robots, the first of them that of the file. It rests until all stand, and until its
    heat is within the limit."""
    rest = reach = 0.0
    moved, stands, strains = False, True, []
    for k, robot in enumerate(robots):
        run = driven(robot, replace(move, rest=LONGEST_REST).input(robot, dt), dt)
        twist, pose = np.asarray(run.twist), np.asarray(run.pose)
        is_fast = np.asarray((np.abs(twist) > STANDS).any(axis=1))
        stands &= not is_fast[-1]
        last = int(np.flatnonzero(is_fast)[-1]) if is_fast.any() else 0
        strains.append(strain(robot, run, dt))
        rest = max(rest, last * dt - move.seconds, strains[-1].energy / limits.heat - move.seconds)
        reach = max(reach, float(np.hypot(*pose[:, :2].T).max()))
        moved |= not k and bool(is_fast.any())
    most = Strain(*map(max, zip(*strains, strict=True)))
    return TriedMove(replace(move, rest=round(max(rest, 0.0) + SPARE_REST, 2)), reach, moved, stands, most)


def fitting(moves: Sequence[TriedMove], border: float, limits: PlanLimits) -> tuple[list[TriedMove], Counter[str]]:
    """The moves that stay inside and within the limits, and why how many others do not."""
    kept, left_out = [], Counter[str]()
    for tried_move in moves:
        why = _why_not(tried_move, border, limits)
        if why:
            left_out[why] += 1
        else:
            kept.append(tried_move)
    return kept, left_out


def _why_not(tried_move: TriedMove, border: float, limits: PlanLimits) -> str:
    """What speaks against a move; "" for nothing."""
    checks = {
        STILL: tried_move.moved,
        "rest": tried_move.stands,
        "traction": tried_move.strain.traction <= limits.traction,
        "current": tried_move.strain.current <= limits.current,
        ROOM: tried_move.reach <= border,
    }
    return next((why for why, is_good in checks.items() if not is_good), "")


def chosen(
    moves: Sequence[PlannedMove], information: FloatArray, seconds: float, score: Score, begun: FloatArray
) -> list[int]:
    """Which moves in which order, as often as they pay, within a time [s]: each the best for its time after those
    before it. information (moves, P, P); begun (P, P): of what is driven anyway, or was before."""
    total = begun + np.eye(information.shape[-1]) / UNKNOWN**2
    order: list[int] = []
    durations = np.array([move.duration for move in moves])
    remaining = seconds
    while True:
        possible = np.flatnonzero(durations <= remaining)
        if not possible.size:
            return order
        now = score(_inverse(total))
        after = _inverse(total + information[possible])
        gains = [(now - score(covariance)) / durations[k] for k, covariance in zip(possible, after, strict=True)]
        best = int(possible[int(np.argmax(gains))])
        order.append(best)
        total = total + information[best]
        remaining -= durations[best]


def _inverse(information: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(information), dtype=np.float64)
