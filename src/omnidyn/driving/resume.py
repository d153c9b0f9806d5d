"""What is left of a program after a stop: what is recorded counts, and the rest is driven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.driving.program import DriveProgram
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.run import Run

SHORTEST = 3.0  # [s] that are worth a drive
SAME, SAME_SHARE = 1e-3, 0.8  # of the largest input; of the rows: a row may be late
REMEDY = "give the logs of this program in the order in which they were driven"


def rest_of(program: DriveProgram, runs: Sequence[Run]) -> DriveProgram:
    """What is to be driven after a drive of a program was stopped: from the beginning of the leg that was not ended.

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
        leg = next((k for k, leg in enumerate(program.legs) if leg.end > rows), len(program.legs))
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
    at = np.arange(min(round(t[-1] / program.dt), len(program.inputs))) * program.dt
    driven, asked = inputs[np.searchsorted(t, at + 1e-6, side="right") - 1], program.inputs[: len(at)]
    same = (np.abs(driven - asked) <= SAME * np.abs(program.inputs).max()).all(axis=1)
    if len(at) and same.mean() < SAME_SHARE:
        raise InputError(
            "not a log of this program",
            got=f"{same.mean():.0%} of its rows are those of the program",
            expected=f"{SAME_SHARE:.0%} or more",
            remedy=REMEDY,
            where="resume",
        )
    return len(at)
