"""c-model: the exact step as C99, for an observer on a microcontroller: two files, no library but math.h, no heap.

    void omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]);

With winding inductance the step takes one more argument, what the currents do to each axis.
"""

from __future__ import annotations

from typing import Literal

from omnidyn.errors import InputError
from omnidyn.export.code.step_c import StepCode, step_code
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import line_comment
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
    code, missing = step_code(robot, precision == SINGLE), left_out("c-model", robot)
    about = line_comment([f"{robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in missing)], "//")
    files = {"omnidyn_step.h": _header(code, about, precision), "omnidyn_step.c": _source(code, about)}
    return Export("c-model", robot.name, files, missing, NOTES, folder=True)


def _header(code: StepCode, about: str, precision: str) -> str:
    real = "float" if precision == SINGLE else "double"
    return (
        (_HEADER_WITH_INDUCTANCE if code.inductance else _HEADER)
        .format(
            about=_block(about), real=real, wheels=code.wheels, head=_HEAD.format(real=real, wheels=code.wheels).strip()
        )
        .lstrip()
    )


def _source(code: StepCode, about: str) -> str:
    return _SOURCE.format(
        about=_block(about), text=code.text,
        more=", omnidyn_real force[3]" if code.inductance else "", force="force, " if code.inductance else "",
    ).lstrip()  # fmt: skip


def _block(about: str) -> str:
    """Lines that begin with // as one comment of C."""
    lines = [line[2:].strip().replace("*/", "* /").replace("/*", "/ *") for line in about.splitlines()]
    return "/* " + "\n   ".join(lines) + " */"


_HEAD = """
#ifndef OMNIDYN_STEP_H
#define OMNIDYN_STEP_H

typedef {real} omnidyn_real;

#define OMNIDYN_WHEELS {wheels}

#ifdef __cplusplus
extern "C" {{
#endif
"""

_HEADER = """
{about}
{head}

/* Move the robot by h > 0 [s] under volts u, one a wheel, held all the while and kept within the limits.
   twist: vx, vy [m/s] and omega [rad/s] in the frame of the body, x forward, y left, counter-clockwise.
   pose: x, y [m] and heading [rad]. At rest within its dead zone the twist stays exactly 0. */
void omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]);

#ifdef __cplusplus
}}
#endif

#endif
"""

_HEADER_WITH_INDUCTANCE = """
{about}
{head}

/* Move the robot by h > 0 [s] under volts u, one a wheel, held all the while and kept within the limits.
   twist: vx, vy [m/s] and omega [rad/s] in the frame of the body, x forward, y left, counter-clockwise.
   pose: x, y [m] and heading [rad]. force: what the currents do to each axis, over mass or inertia [m/s^2, rad/s^2];
   0 where no current flows. At rest within its dead zone the twist stays exactly 0. */
void omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3],
                  omnidyn_real force[3]);

#ifdef __cplusplus
}}
#endif

#endif
"""

_SOURCE = """
{about}
#include "omnidyn_step.h"

#include <math.h>

{text}

void omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]{more})
{{
    omnidyn_real lost = 0;
    omnidyn_advance(u, h, twist, pose, {force}&lost);
}}
"""
