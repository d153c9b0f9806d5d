"""c-model: a step of the simulation as C99, for an observer on a microcontroller: two files, no library but math.h.

    int omnidyn_step(const omnidyn_real u[], omnidyn_real h, omnidyn_real twist[3], omnidyn_real pose[3]);

With winding inductance the step takes one more argument, what the currents do to each axis; by the implicit engine,
a memory. It allocates nothing.
"""

from __future__ import annotations

from typing import Literal

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.code.implicit_c import implicit_code
from omnidyn.export.code.step_c import STATUS, StepCode, step_code
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import c_comment, filled
from omnidyn.model.robot import Robot
from omnidyn.simulation.engine import TOLERANCE, as_tolerance
from omnidyn.simulation.exact.exact_march import why_not_exact

DOUBLE, SINGLE = "double", "single"
NOTES = (
    "compile with -std=c99 and without -ffast-math; a compiler that fuses products and sums (-ffp-contract=fast) "
    "changes the last bits",
)


def c_model(robot: Robot, precision: Literal["double", "single"] = DOUBLE, tol: float | None = TOLERANCE) -> Export:
    """The step of a robot in C99, by the engine that `simulate` chooses.

    precision: of its numbers, double (float64) or single (float32). tol: global error of the implicit engine [m/s];
    None takes one fixed step a call, in a bounded time. Raises UnsupportedError for a robot that the table of features
    refuses, or a tolerance in single precision; InputError for a number that single precision cannot hold.
    """
    if precision not in (DOUBLE, SINGLE):
        raise InputError("no such precision", got=precision, expected=f"{DOUBLE} or {SINGLE}", where="precision")
    refuse("c-model", robot)
    code, omissions = engine_code(robot, precision, tol), left_out("c-model", robot)
    about = c_comment([f"{robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in omissions)])
    files = {"omnidyn_step.h": _header(code, about, precision), "omnidyn_step.c": _source(code, about)}
    return Export("c-model", robot.name, files, omissions, NOTES, folder=True)


def engine_code(robot: Robot, precision: str = DOUBLE, tol: float | None = TOLERANCE) -> StepCode:
    """The C of the engine that `simulate` chooses for a robot: the exact one where there is one."""
    tolerance, reasons = as_tolerance(tol), why_not_exact(robot)
    if not reasons:
        return step_code(robot, precision == SINGLE)
    if precision == SINGLE and tolerance:
        raise UnsupportedError(
            f"c-model cannot be exported in single precision to a tolerance for {robot.name}",
            got="; ".join(reasons)[:300],
            expected="one fixed step a call",
            remedy="take one step a call (tol=None), or double precision",
            where="precision",
        )
    return implicit_code(robot, tolerance, precision == SINGLE)


def _header(code: StepCode, about: str, precision: str) -> str:
    return filled(
        _HEADER,
        ABOUT=about,
        REAL="float" if precision == SINGLE else "double",
        WHEELS=str(code.wheels),
        STATUS=STATUS,
        WORDS=_WORDS[code.state],
        SIZE=f"\n#define OMNIDYN_MEMORY {code.size}" if code.state == "memory" else "",
        MORE=_more(code),
        LONG=_LONG[code.lost],
    ).lstrip()


def _more(code: StepCode) -> str:
    """The parameter that a robot takes besides."""
    return f",\n                 omnidyn_real {code.state}[{code.size}]" if code.state else ""


def _source(code: StepCode, about: str) -> str:
    passed = ", ".join([*([code.state] if code.state else []), *(["&lost"] if code.lost else [])])
    return filled(
        _SOURCE,
        ABOUT=about,
        TEXT=code.text,
        MORE=_more(code),
        LOST="    omnidyn_real lost = 0;\n" if code.lost else "",
        PASSED=passed,
    ).lstrip()


_WORDS = {
    "": "",
    "force": """
   force: what the currents do to each axis, over mass or inertia [m/s^2, rad/s^2]; 0 where no current flows.""",
    "memory": """
   memory: what sticks, currents, what bends, the next length to try; OMNIDYN_MEMORY zeros at the start. Pass on what
   the call before left. Where twist is another than that call left, what moves is told by it anew.""",
}
_LONG = {
    True: "up to 1 s a step is never too long",
    False: "it is meant for steps of up to 20 ms",
}

_HEADER = """
@ABOUT@
#ifndef OMNIDYN_STEP_H
#define OMNIDYN_STEP_H

typedef @REAL@ omnidyn_real;

#define OMNIDYN_WHEELS @WHEELS@@SIZE@

#ifdef __cplusplus
extern "C" {
#endif

@STATUS@

/* Move the robot by h > 0 [s] under volts u, one a wheel, held all the while and kept within the limits.
   twist: vx, vy [m/s] and omega [rad/s] in the frame of the body, x forward, y left, counter-clockwise.
   pose: x, y [m] and heading [rad]. At rest within its dead zone the twist stays exactly 0.@WORDS@
   Returns OMNIDYN_STEP_OK, or why nothing has moved; @LONG@. */
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
@LOST@    return omnidyn_advance(u, h, twist, pose, @PASSED@);
}
"""
