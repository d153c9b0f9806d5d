"""The numbers of a predictive controller as C, and the files of this folder around them."""

from __future__ import annotations

import math
from importlib.resources import files
from typing import Any

import numpy as np

from omnidyn.control.controller import LARGEST_STATE, LATEST, MOST_BRIDGED
from omnidyn.control.mpc import interior_point, linear_motion, memory, observer, program, solve
from omnidyn.control.mpc.controller import LONGEST, Mpc
from omnidyn.control.mpc.model import (
    BY_MASS,
    BY_MASS_GX,
    DECAY,
    ELLIPSE,
    FEED,
    GX,
    PHI,
    PSI,
    SOFT_SPEED,
    SUM,
    SUM_DRIVE,
    SUM_TWIST,
    TERMS,
    TURNING,
    volts,
)
from omnidyn.control.mpc.settings import Settings
from omnidyn.errors import UnsupportedError
from omnidyn.export.spelling import c_number, filled

FOLDER = files("omnidyn.export.code") / "mpc"
PARTS = ("model.c", "solver.c", "step.c")
# What float32 asks for in place of the constants of Python, whose rounding is 1e9 times as small.
BOUND_TOLERANCE, NARROWEST = 1e-3, 1e-3  # [V]
# Of the interior point method: where its mean product stops, how fast it falls, passes, [V] from a bound. It need find
# the bounds that are met alone: the active set finds the inputs.
FLOAT_SAME_STEP = 1e-5  # of a step: what differs by less is as long
FINAL_GAP, CENTRING, MOST_PASSES, LEAST_SLACK = 1e-4, 0.1, 30, 2e-6

_INPUT = """/* An input of the horizon: its volts, and room to find them. */
typedef struct {
    float volts, wanted, next,@OWN@ hold[2], push[2];
    int active;
} omnidyn_input;"""


def mpc_code(controller: Mpc) -> str:
    """The body of its C file. Raises UnsupportedError for what float32 cannot hold, and for a part of a step."""
    late = controller.robot.drive.latency
    if controller.late_part > 0.0:
        raise UnsupportedError(
            "the model predictive controller in C counts the latency of the drive in whole steps",
            got=f"{late:.4g} s, {late / controller.dt:.3g} steps of {controller.dt:g} s",
            expected="a whole number of steps",
            where="drive.latency_s",
            remedy=f"export it with `dt` {late / math.ceil(late / controller.dt):.4g}, and call it as often",
        )
    if controller.robot_settings.speed is not None:
        raise UnsupportedError(
            "the model predictive controller in C has no limit of the speed: float32 cannot hold its weight beside the "
            "others",
            got=controller.robot_settings.speed,
            expected="none",
            where="speed",
            remedy="leave `speed` out of the controller file, and ask for slower paths",
        )
    text = "\n".join(FOLDER.joinpath(name).read_text("utf-8") for name in PARTS)
    return f"#include <string.h>\n\n{_constants(controller)}\n\n{text}"


def mpc_input(controller: Mpc) -> str:
    """The type of what is known of one input of the horizon."""
    bounds = " bound[2]," if _bounded(controller) else ""
    return filled(_INPUT, OWN=bounds)


def mpc_memory(controller: Mpc) -> str:
    """The fields of `omnidyn_control`: what it remembers, and room to work in."""
    n, wheels, settings = "OMNIDYN_HORIZON", "OMNIDYN_WHEELS", controller.robot_settings
    lines = ["float believed[4][3], base[3]; /* pose, twist, push, share of friction */"]
    lines += ["float unsure[3], spread[3][3][3], knocks[3]; /* of these */"] if controller.observer else []
    lines += [f"float sent[{controller.steps_late + 1}][3], last[{wheels}];", "int begun, known, missing;"]
    lines += [f"float slewed[{wheels}];"] if settings.slew is not None else []
    lines += [
        f"omnidyn_input input[{n} * {wheels}];",
        f"float x[{n} + 1][6], goal[{n} + 1][6], before[{n}][6], way[{n}][3];",
        f"float columns[{n}][8][6], gain[{n}][3][7];",
    ]
    held = "#if OMNIDYN_ELAPSED\n    float held[9][3], step; /* gains of a step, and its length [s] */\n#endif"
    return "\n".join([*(f"    {line}" for line in lines), held])


def mpc_switches() -> str:
    """Of its header: parts that may be left out, and how."""
    return filled(_SWITCHES.strip(), BRIDGED=str(MOST_BRIDGED))


_SWITCHES = """
/* -DOMNIDYN_MOST_BRIDGED=0: a missing measurement gives zeros. -DOMNIDYN_ELAPSED=0: a step takes OMNIDYN_DT, not the
   time that passed. -DOMNIDYN_FEW_KNOCKS=0: a loop that swings under pushes may go on. -DOMNIDYN_SWING=0: a loop that
   swings does not say so. Less code each. */
#ifndef OMNIDYN_MOST_BRIDGED
#define OMNIDYN_MOST_BRIDGED @BRIDGED@
#endif
#ifndef OMNIDYN_ELAPSED
#define OMNIDYN_ELAPSED 1
#endif
#ifndef OMNIDYN_FEW_KNOCKS
#define OMNIDYN_FEW_KNOCKS 1
#endif
#ifndef OMNIDYN_SWING
#define OMNIDYN_SWING 1
#endif"""


def _bounded(controller: Mpc) -> bool:
    """Whether the bounds of the volts are others in each step."""
    limit = volts(controller.driven)
    return controller.robot_settings.slew is not None or _current(controller) or bool(np.any(limit != limit[0]))


def _current(controller: Mpc) -> bool:
    return controller.robot_settings.current is not None or controller.robot.motor.current_limit is not None


def _constants(controller: Mpc) -> str:
    """Numbers and tables, those alone that this controller needs."""
    settings, linear, robot = controller.robot_settings, controller._numbers.linear[0], controller.robot
    turning, ellipse = bool(linear[TURNING] != 0.0), bool(linear[ELLIPSE] > 0.0)
    whether = {
        "LEVELS": len(controller._numbers.levels),
        "ELLIPSE": ellipse,
        "TURNING": turning,
        "OFF_CENTRE": any(robot.body.centre),
        "LEARN": controller.observer,
        "AVERAGED": robot.sensor_model.averaged,
        "BOUNDED": _bounded(controller),
        "CURRENT": _current(controller),
        "SLEW": settings.slew is not None,
        "SUM": linear[SUM] != 0.0,
        "LATE_STEPS": controller.steps_late,
        "PASSES": observer.PASSES,
        "TERMS": TERMS,
        "SOON": linear_motion.COMPARED_STEPS,
        "AGAIN": settings.again,
        "FIRST_PASSES": solve.FIRST,
        "LAST_PASSES": solve.LAST,
        "MOST": MOST_PASSES,
    }
    numbers = {
        "FARTHEST": LARGEST_STATE,
        "SAME_STEP": FLOAT_SAME_STEP,
        "EXACT": observer.STICKING_SHARE,
        "LAST_WEIGHT": settings.last,
        "VOLTS_WEIGHT": settings.volts,
        "BEYOND": BOUND_TOLERANCE,
        "BACK_OFF": interior_point.BACK_OFF,
        "CENTRE": CENTRING,
        "TIGHT": FINAL_GAP,
        "LEAST": LEAST_SLACK,
        "NARROWEST": NARROWEST,
        "TURNED": linear_motion.HEADING_CHANGE,
        "MOVED": linear_motion.FRICTION_CHANGE,
        "PULLED": linear_motion.VOLTAGE_CHANGE,
        "FARTHEST_OFF": observer.OUTLIER_SQUARE,
        "KNOCK": observer.KNOCK_SQUARE,
        "MOST_KNOCKS": observer.MOST_KNOCKS,
        "KNOCK_MEMORY": observer.KNOCK_MEMORY,
        "MOST_SCALE": observer.LARGEST_SCALE,
        "START_PUSH": memory.START_PUSH,
        "START_SCALE": memory.START_SCALE,
        "SHARP": settings.volts,
    }
    if ellipse:
        numbers |= dict(
            zip(("ELLIPSE_X", "ELLIPSE_Y", "ELLIPSE_WIDTH"), linear[ELLIPSE : ELLIPSE + 3] ** (2, 2, 1), strict=True)
        )
    if settings.slew is not None:
        numbers["SLEW_STEP"] = settings.slew * controller.dt
    lines = [
        f"#define LATEST {c_number(LATEST, True)}",
        f"#define LONGEST (OMNIDYN_ELAPSED ? {c_number(LONGEST, True)} : LATEST)",
        "#if OMNIDYN_MOST_BRIDGED",
        "#define MISSING (c->missing)",
        "#else",
        "#define MISSING 0",
        "#endif",
    ]
    lines += [f"#define {name} {int(value)}" for name, value in whether.items()]
    lines += [f"#define {name} {c_number(float(value), True)}" for name, value in numbers.items()]
    matrices = _matrices(controller, linear) | ({"FRAME": _square(linear, TURNING)} if turning else {})
    matrices |= {"BY_MASS": _square(linear, BY_MASS)} if ellipse else {}
    matrices |= (
        {"SUM_DRIVE": _square(linear, SUM_DRIVE), "SUM_TWIST": _square(linear, SUM_TWIST)} if linear[SUM] else {}
    )
    if _current(controller):
        limit, emf = controller.robot_settings.tables(controller.driven, controller.dt, True)[2:4]
        matrices |= {"CURRENT_VOLTS": limit[1], "EMF": emf}
    tables = [_table(name, np.asarray(matrix, float)) for name, matrix in matrices.items()]
    tables += [_by_wheel(name, column) for name, column in _wheels(controller).items()]
    return "\n".join([*lines, "", *tables])


def _matrices(controller: Mpc, linear: np.ndarray) -> dict[str, Any]:
    """Tables of the model, the cost and the observer."""
    settings, numbers = controller.robot_settings, controller._numbers
    matrices: dict[str, Any] = {"GAINS": np.concatenate([_square(linear, at) for at in (DECAY, PHI, PSI)])}
    matrices |= {"FEED": _square(linear, FEED), "PUSH": numbers.push.T, "PULL": numbers.pull}
    matrices |= {"WEIGHT": np.array((settings.pose, settings.twist), dtype=float).ravel()}
    matrices |= {"NEAR": linear_motion.STANDSTILL, "HOME": program.HOME, "ARRIVED": program.ARRIVED}
    if len(numbers.levels):
        assert (GX, BY_MASS_GX, SOFT_SPEED) == (0, 3, 9)  # columns that model.c counts by hand
        matrices["LEVEL"] = numbers.levels[:, : SOFT_SPEED + 1]  # what falls with the speed has no C
    if controller.observer:
        matrices |= _noise(controller.observer_settings)
    return matrices


def _noise(settings: Settings) -> dict[str, Any]:
    return {
        "NOISE": np.square(np.array(settings.noise, dtype=float)),
        "POSE_NOISE": np.square(np.array(settings.pose_noise, dtype=float)),
        "WALK": np.square(
            np.array((settings.walk, settings.push_walk, (settings.scale_walk,) * 3, settings.pose_walk), dtype=float)
        ),
    }


def _wheels(controller: Mpc) -> dict[str, np.ndarray]:
    """What each wheel has one of: limits, and how volts become what the drive takes."""
    per_volt = controller.per_volt * np.ones(controller.robot.wheels.count)
    return {"VOLTAGE_LIMIT": volts(controller.driven), "OUTPUT_LIMIT": controller.limit, "PER_VOLT": per_volt}


def _by_wheel(name: str, values: np.ndarray) -> str:
    """A macro of a wheel, or of an input: one number where all wheels are alike."""
    if np.all(values == values[0]):
        return f"#define {name}(i) {c_number(float(values[0]), True)}"
    return f"{_table(f'{name}S', values)}\n#define {name}(i) {name}S[(i) % OMNIDYN_WHEELS]"


def _square(linear: np.ndarray, at: int) -> np.ndarray:
    return linear[at : at + 9].reshape(3, 3)


def _table(name: str, values: np.ndarray) -> str:
    """A constant table."""
    shape = "".join(f"[{n}]" for n in values.shape)
    return f"static const float {name}{shape} = {_braces(values)};"


def _braces(values: np.ndarray) -> str:
    inner = (_braces(value) if values.ndim > 1 else c_number(float(value), True) for value in values)
    return f"{{{', '.join(inner)}}}"
