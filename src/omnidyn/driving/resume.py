"""What is left of a program after a stop: what is recorded counts, and the rest is driven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.program import DriveProgram
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.run import Run

SHORTEST = 3.0  # [s] that are worth a drive
SAME, SAME_SHARE = 1e-3, 0.8  # of the largest input; of the rows: a row may be left out of a log
LATE = 0.5  # [s] that a row may be late beside the one before
SLOWER = 0.25  # of the time: that all of it may take longer
LEGS_OF_MOVE = 4  # at most, of a move that a plan makes: there and back, to both sides
MIDDLE = 0.1  # [m] from the middle, which is no farther than a robot is put back to
REMEDY = "give the logs of this program in the order in which they were driven"


def rest_of(program: DriveProgram, runs: Sequence[Run]) -> DriveProgram:
    """What is to be driven after a drive of a program was stopped: from the beginning of the leg that was not ended, or
    of its move, where that began in the middle of the room.

    Half a leg tells little; with the legs that are left both logs tell at least what the whole would have told.

    Args:
        program: That was begun.
        runs: The log of what was driven of it; then that of what was driven of its rest, and so on.

    Raises InputError for a log of something else, InsufficientDataError where next to nothing is left.
    """
    source = program.source
    for run in runs:
        rows = _driven_rows(program, run)
        if not rows:
            continue
        leg = _from_the_middle(
            program, next((k for k, leg in enumerate(program.legs) if leg.end > rows), len(program.legs))
        )
        left = program.seconds - program.legs[leg].first * program.dt if leg < len(program.legs) else 0.0
        if left < SHORTEST:
            raise InsufficientDataError(
                "nothing is left to drive",
                got=f"{left:.1f} s of {program.seconds:.1f} s",
                expected=f"at least {SHORTEST:g} s",
                remedy="fit what is recorded with identify",
                where="resume",
            )
        program = replace(program.from_leg(leg), source=f"the rest of {source}")
    return program


def _from_the_middle(program: DriveProgram, leg: int) -> int:
    """The last leg up to this one that begins in the middle, where the robot is put back to; this one, where no leg of
    the same move does: the way back alone would lead as far to the other side, and all that follows with it."""
    starts = [(0.0, 0.0), *(other.pose[:2] for other in program.legs)]
    legs = range(leg, max(leg - LEGS_OF_MOVE, -1), -1)
    return next((k for k in legs if np.hypot(*starts[k]) < MIDDLE), leg)


def _driven_rows(program: DriveProgram, run: Run) -> int:
    """How many rows of a program were driven. Raises InputError for a log of something else."""
    inputs, wheels = getattr(run, program.channel), program.robot.wheels.count
    expected = f"{program.channel} of {wheels} wheels"
    if inputs is None or inputs.shape[1] != wheels:
        got = ", ".join(run.channels)
        raise InputError("not a log of this program", got=got, expected=expected, remedy=REMEDY, where="resume")
    complete = np.flatnonzero(np.isfinite(inputs).all(axis=1))
    if not complete.size:
        raise InputError("a log without inputs", got="empty cells", expected=expected, remedy=REMEDY, where="resume")
    t, inputs = run.t[complete] - run.t[complete[0]], inputs[complete]
    rows, same = _matched(program, t, inputs)
    if rows and same < SAME_SHARE * rows:
        raise InputError(
            "not a log of this program",
            got=f"{same / rows:.0%} of its rows are those of the program",
            expected=f"{SAME_SHARE:.0%} or more",
            remedy=REMEDY,
            where="resume",
        )
    return rows


def _matched(program: DriveProgram, t: FloatArray, inputs: FloatArray) -> tuple[int, int]:
    """How many rows of a program a log holds, and how many of them are the same.

    A loop that was held up goes on from there, so rows come later and later: where one is not there when it is due, it
    is looked for in the LATE seconds after that.
    """
    near, dt, late, rows, same = SAME * np.abs(program.inputs).max(), program.dt, 0.0, 0, 0
    while rows < len(program.inputs) and rows * dt + late < t[-1] - 0.5 * dt:
        due, asked = rows * dt + late, program.inputs[rows]
        first = int(np.searchsorted(t, due + 1e-6, side="right")) - 1
        last = int(np.searchsorted(t, min(due + LATE, rows * dt * (1.0 + SLOWER) + LATE), side="right"))
        for row in range(first, max(last, first + 1)):
            if np.abs(inputs[row] - asked).max() <= near:
                late = max(late, float(t[row]) - rows * dt)
                same += 1
                break
        rows += 1
    return rows, same
