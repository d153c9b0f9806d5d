"""c-controller: a controller of one robot as C99 for a microcontroller: two files, float32, no heap, only math.h.

    int omnidyn_control_step(omnidyn_control *self, float elapsed, const float pose[3], const float twist[3],
                             const omnidyn_motion path[3], float output[]);

What it works out is traced from the controllers of Python (compiled/trace.py): there is one formula.
"""

from __future__ import annotations

import os
from typing import Any

from omnidyn.control.controller import MOST_BRIDGED
from omnidyn.control.controllers import controller_spec
from omnidyn.control.feedforward import DT, check_dt
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.swing import CHANGES
from omnidyn.export.code.control_code import LOOP_MEMORY, control_code, is_commanded
from omnidyn.export.code.late_pose_code import LATE_STRUCT, is_late, late_pose_code, late_rows
from omnidyn.export.code.mpc_code import mpc_code, mpc_input, mpc_memory, mpc_switches
from omnidyn.export.code.swing_code import SWING_MEMORY, SWING_STRUCT, can_swing, swing_code
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse, refuse_controller
from omnidyn.export.spelling import c_comment, c_number, filled
from omnidyn.model.robot import Robot

KIND = "c-controller"
NOTES = (
    "compile with -std=c99 and without -ffast-math, which would take away the tests for numbers that are none",
    "one omnidyn_control for each robot, reset once; nothing else is remembered, no memory is taken",
)
FILTERED = "a filter of the speeds ([sensors] twist_filter_s): give it means over a step, by the turns of wheels"
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
    law, omissions = spec.make(robot, dt=dt), left_out(KIND, robot)
    if robot.sensor_model.in_steps(dt).twist_filter > 0.0:
        omissions = (*omissions, FILTERED)
    notes = (*NOTES, *map(str, robot.pose_lag_of_log))
    predicts = isinstance(law, Mpc)
    code = mpc_code(law) if predicts else control_code(law)  # pyright: ignore[reportArgumentType]  none is refused
    about = [f"{law.name} of {robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in omissions)]
    head = c_comment(about)
    swing = swing_code(law) if can_swing(law) else ""
    swing = f"#if OMNIDYN_SWING\n{swing}\n#endif" if predicts else swing
    code = "\n\n".join(part for part in (f"{head}\n{_INCLUDES.rstrip()}", late_pose_code(law), swing, code) if part)
    texts = {"omnidyn_control.h": _header(law, head), "omnidyn_control.c": f"{code}\n"}
    return Export(KIND, robot.name, texts, omissions, notes, folder=True)


def _header(law: Any, about: str) -> str:
    predicts = isinstance(law, Mpc)
    late = law.steps_late * law.dt if predicts else law.late
    numbers = {
        "WHEELS": str(law.robot.wheels.count),
        "DT": c_number(law.dt, True),
        "LATE": c_number(late, True),
    } | ({"HORIZON": str(law.horizon)} if predicts else {})
    defines = "\n".join(f"#define OMNIDYN_{name} {text}" for name, text in numbers.items())
    if predicts:
        defines = f"{defines}\n{mpc_switches()}"
    return filled(
        _HEADER,
        ABOUT=about,
        DEFINES=defines,
        UNITS=_UNITS[law.output],
        MEMORY=(mpc_memory(law) if predicts else _MEMORY + LOOP_MEMORY * is_commanded(law))
        + ("\n    omnidyn_late late;" if is_late(law) else "")
        + (SWING_MEMORY if predicts else "\n    omnidyn_swing swing;" if can_swing(law) else ""),
        INPUT=(f"{mpc_input(law)}\n\n" if predicts else "")
        + (f"{filled(LATE_STRUCT, ROWS=str(late_rows(law))).strip()}\n\n" if is_late(law) else "")
        + (f"{filled(SWING_STRUCT, CHANGES=str(CHANGES)).strip()}\n\n" if can_swing(law) else ""),
        AHEAD=_AHEAD if predicts else _NOW_AND_AHEAD,
        ROWS="OMNIDYN_HORIZON + 1" if predicts else "3",
        BRIDGED=str(MOST_BRIDGED),
    ).lstrip()


_INCLUDES = '#include "omnidyn_control.h"\n\n#include <math.h>\n'

_MEMORY = """    float sum[3];
    float last[OMNIDYN_WHEELS];
    int begun, missing;"""

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

/* What a step says of itself. Up to OMNIDYN_SWINGS the output is as wanted; from OMNIDYN_BACKWARDS on it is zeros, but
   that @BRIDGED@ measurements missing in a row are bridged. */
enum {
    OMNIDYN_OK,
    OMNIDYN_LIMITED,   /* a motor is at a limit of voltage or current */
    OMNIDYN_STILL,     /* no time has gone by: the last output again */
    OMNIDYN_SWINGS,    /* the loop swings: correct latency_s of [drive], or lower the gains */
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
