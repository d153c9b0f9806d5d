"""What is left of a program after a stop: what is recorded counts, and the rest is planned anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.program_file import PlanFile
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.planning.plan import plan_rest
from omnidyn.progress import Progress, silent
from omnidyn.run import Run

SHORTEST = 3.0  # [s] that are worth a drive


def rest_of(
    program: DriveProgram, runs: Sequence[Run], plan: PlanFile | None = None, progress: Progress = silent
) -> DriveProgram:
    """What is to be driven after a drive of a program was stopped.

    Args:
        program: That was begun.
        runs: The logs of what was driven of it.
        plan: What `omnidyn plan` wrote beside it: then the time that is left is planned anew, for what the logs do not
            tell yet. Without it the legs that are left are driven, the one that was stopped from its beginning.
        progress: Hears what is done.

    Raises InputError for logs without the inputs of this robot, InsufficientDataError where next to nothing is left.
    """
    driven = np.concatenate([driven_rows(program, run) for run in runs]) if runs else program.inputs[:0]
    left = program.seconds - len(driven) * program.dt
    if left < SHORTEST:
        raise InsufficientDataError(
            "nothing is left to drive",
            got=f"{max(left, 0.0):.1f} s of {program.seconds:.1f} s",
            expected=f"at least {SHORTEST:g} s",
            remedy="fit what is recorded with identify",
            where="resume",
        )
    if not len(driven):
        return program
    if plan is None:
        return program.from_leg(next(k for k, leg in enumerate(program.legs) if leg.end > len(driven)))
    limit = np.asarray(plan.limit)
    made = plan_rest(
        plan.robot,
        driven / limit,
        left,
        program.area,
        promised=plan.promised,
        noise=plan.noise,
        rate=1.0 / program.dt,
        progress=progress,
    )
    return replace(program, inputs=made.share * limit, source=f"the rest of {program.source}")


def driven_rows(program: DriveProgram, run: Run) -> FloatArray:
    """The inputs of a log in rows of the program. Shape (rows, wheels)."""
    inputs = getattr(run, program.channel)
    if inputs is None or inputs.shape[1] != program.robot.wheels.count:
        raise InputError(
            "not a log of this program",
            got=", ".join(run.channels),
            expected=f"{program.channel} of {program.robot.wheels.count} wheels",
            where="resume",
        )
    complete = np.flatnonzero(np.isfinite(inputs).all(axis=1))
    if not complete.size:
        raise InputError(
            "a log without inputs",
            got=f"no row with {program.channel} of all wheels",
            expected=f"{program.channel} of {program.robot.wheels.count} wheels",
            where="resume",
        )
    t, inputs = run.t[complete] - run.t[complete[0]], inputs[complete]
    rows = np.arange(round(t[-1] / program.dt)) * program.dt
    return inputs[np.searchsorted(t, rows + 1e-6, side="right") - 1]
