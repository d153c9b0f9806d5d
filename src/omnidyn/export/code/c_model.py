"""c-model: the exact step as C99, for an observer on a microcontroller: two files, no library but math.h, no heap.

    int omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]);

With winding inductance the step takes one more argument, what the currents do to each axis.
"""

from __future__ import annotations

from typing import Literal

from omnidyn.errors import InputError
from omnidyn.export.code.step_c import STATUS, StepCode, step_code
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import c_comment, filled
from omnidyn.model.robot import Robot

DOUBLE, SINGLE = "double", "single"
NOTES = (
    "compile with -std=c99 and without -ffast-math; a compiler that fuses products and sums (-ffp-contract=fast) "
    "changes the last bits",
)


def c_model(robot: Robot, precision: Literal["double", "single"] = DOUBLE) -> Export:
    """The exact step of a robot in C99.

    precision: of its numbers, double (float64) or single (float32). Raises UnsupportedError for a robot that has no
    exact step, and InputError for a number that single precision cannot hold.
    """
    if precision not in (DOUBLE, SINGLE):
        raise InputError("no such precision", got=precision, expected=f"{DOUBLE} or {SINGLE}", where="precision")
    refuse("c-model", robot)
    code, omissions = step_code(robot, precision == SINGLE), left_out("c-model", robot)
    about = c_comment([f"{robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in omissions)])
    files = {"omnidyn_step.h": _header(code, about, precision), "omnidyn_step.c": _source(code, about)}
    return Export("c-model", robot.name, files, omissions, NOTES, folder=True)


def _header(code: StepCode, about: str, precision: str) -> str:
    return filled(
        _HEADER,
        ABOUT=about,
        REAL="float" if precision == SINGLE else "double",
        WHEELS=str(code.wheels),
        STATUS=STATUS,
        FORCE=_FORCE if code.inductance else "",
        MORE=",\n                 omnidyn_real force[3]" if code.inductance else "",
    ).lstrip()


def _source(code: StepCode, about: str) -> str:
    return filled(
        _SOURCE,
        ABOUT=about,
        TEXT=code.text,
        MORE=",\n                 omnidyn_real force[3]" if code.inductance else "",
        FORCE="force, " if code.inductance else "",
    ).lstrip()


_FORCE = """
   force: what the currents do to each axis, over mass or inertia [m/s^2, rad/s^2]; 0 where no current flows."""

_HEADER = """
@ABOUT@
#ifndef OMNIDYN_STEP_H
#define OMNIDYN_STEP_H

typedef @REAL@ omnidyn_real;

#define OMNIDYN_WHEELS @WHEELS@

#ifdef __cplusplus
extern "C" {
#endif

@STATUS@

/* Move the robot by h > 0 [s] under volts u, one a wheel, held all the while and kept within the limits.
   twist: vx, vy [m/s] and omega [rad/s] in the frame of the body, x forward, y left, counter-clockwise.
   pose: x, y [m] and heading [rad]. At rest within its dead zone the twist stays exactly 0.@FORCE@
   Returns OMNIDYN_STEP_OK, or why nothing has moved; up to 1 s a step is never too long. */
int omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]@MORE@);

#ifdef __cplusplus
}
#endif

#endif
"""

_SOURCE = """
@ABOUT@
#include "omnidyn_step.h"

#include <math.h>

@TEXT@

int omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]@MORE@)
{
    omnidyn_real lost = 0;
    return omnidyn_advance(u, h, twist, pose, @FORCE@&lost);
}
"""
