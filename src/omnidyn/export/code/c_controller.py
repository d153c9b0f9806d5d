"""c-controller: a controller of one robot as C99 for a microcontroller: two files, float32, no heap, only math.h.

    int omnidyn_control_step(omnidyn_control *self, float elapsed, const float pose[3], const float twist[3],
                             const omnidyn_motion path[3], float output[]);

What it works out is traced from the controllers of Python (trace.py): there is one formula.
"""

from __future__ import annotations

import os
from typing import Any

from omnidyn.control.controllers import controller_spec
from omnidyn.control.feedforward import DT, check_dt
from omnidyn.control.mpc.controller import Mpc
from omnidyn.export.code.control_c import control_code
from omnidyn.export.code.mpc.code import mpc_code, mpc_input, mpc_memory
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse, refuse_controller
from omnidyn.export.spelling import c_comment, c_number, filled
from omnidyn.model.robot import Robot

KIND = "c-controller"
NOTES = (
    "compile with -std=c99 and without -ffast-math, which would take away the tests for numbers that are none",
    "one omnidyn_control for each robot, reset once; nothing else is remembered, no memory is taken",
)
_UNITS = {"voltage": "volts at the motors", "duty": "duties, -1 to 1", "wheel_speed": "speeds of the wheels [rad/s]"}


def c_controller(robot: Robot, controller: str | os.PathLike = "pid", dt: float = DT) -> Export:
    """A controller of a robot in C99, float32.

    controller: by name, or a controller file (.toml) that `tune` wrote. dt [s]: between two steps. Raises
    UnsupportedError for a controller that has no C, or gears that lose, and InputError for what cannot be read or a
    number that single precision cannot hold.
    """
    check_dt(dt)
    spec = controller_spec(controller)
    refuse_controller(KIND, spec.controller)
    refuse(KIND, robot)
    made, missing = spec.make(robot, dt=dt), left_out(KIND, robot)
    predicts = isinstance(made, Mpc)
    code = mpc_code(made) if predicts else control_code(made)  # pyright: ignore[reportArgumentType]  none is refused
    about = [f"{made.name} of {robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in missing)]
    head = c_comment(about)
    files = {"omnidyn_control.h": _header(made, head), "omnidyn_control.c": f"{head}\n{_INCLUDES}\n{code}\n"}
    return Export(KIND, robot.name, files, missing, NOTES, folder=True)


def _header(made: Any, about: str) -> str:
    predicts = isinstance(made, Mpc)
    late = made.steps_late * made.dt if predicts else made.late
    numbers = {
        "WHEELS": str(made.robot.wheels.count), "DT": c_number(made.dt, True), "LATE": c_number(late, True),
    } | ({"HORIZON": str(made.horizon)} if predicts else {})  # fmt: skip
    defines = "\n".join(f"#define OMNIDYN_{name} {text}" for name, text in numbers.items())
    return filled(
        _HEADER, ABOUT=about, DEFINES=defines, UNITS=_UNITS[made.output],
        MEMORY=mpc_memory(made) if predicts else _MEMORY, INPUT=f"{mpc_input(made)}\n\n" if predicts else "",
        AHEAD=_AHEAD if predicts else _NOW_AND_AHEAD, ROWS="OMNIDYN_HORIZON + 1" if predicts else "3",
    ).lstrip()  # fmt: skip


_INCLUDES = '#include "omnidyn_control.h"\n\n#include <math.h>\n'

_MEMORY = """    float sum[3];
    float last[OMNIDYN_WHEELS];
    int begun;"""

_NOW_AND_AHEAD = """now, OMNIDYN_LATE [s] ahead,
   when the output acts, and OMNIDYN_LATE + OMNIDYN_DT ahead"""

_AHEAD = """OMNIDYN_LATE [s] ahead, when
   the output acts, and OMNIDYN_HORIZON times OMNIDYN_DT later each"""

_HEADER = """
@ABOUT@
#ifndef OMNIDYN_CONTROL_H
#define OMNIDYN_CONTROL_H

@DEFINES@

#ifdef __cplusplus
extern "C" {
#endif

/* Of the path, in the world: pose x, y [m] and heading [rad], velocity its derivative [m/s, m/s, rad/s]. */
typedef struct {
    float pose[3];
    float velocity[3];
} omnidyn_motion;

@INPUT@/* What is remembered from step to step. */
typedef struct {
@MEMORY@
} omnidyn_control;

/* What a step says of itself. Up to OMNIDYN_STILL the output is as wanted; from OMNIDYN_BACKWARDS on it is zeros. */
enum {
    OMNIDYN_OK,
    OMNIDYN_LIMITED,   /* a motor is at a limit of voltage or current */
    OMNIDYN_STILL,     /* no time has gone by: the last output again */
    OMNIDYN_BACKWARDS, /* time went backwards: errors summed up are forgotten */
    OMNIDYN_BAD_TIME,
    OMNIDYN_BAD_POSE,
    OMNIDYN_BAD_TWIST,
    OMNIDYN_BAD_PATH,
    OMNIDYN_FAILED
};

/* Forget all steps; before the first one too. */
void omnidyn_control_reset(omnidyn_control *self);

/* What to send to the drive until the next step: @UNITS@, one a wheel; see the enum above for what it returns.
   elapsed [s]: since the step before, OMNIDYN_DT as a rule; 0 in the first. pose in the world, twist in the frame
   of the body (vx, vy [m/s], omega [rad/s]), x forward, y left, counter-clockwise. path: @AHEAD@;
   where it has ended its last pose, velocity 0. */
int omnidyn_control_step(omnidyn_control *self, float elapsed, const float pose[3], const float twist[3],
                         const omnidyn_motion path[@ROWS@], float output[OMNIDYN_WHEELS]);

#ifdef __cplusplus
}
#endif

#endif
"""
