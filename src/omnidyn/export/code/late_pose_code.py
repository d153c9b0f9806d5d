"""Poses that arrive late, brought up to now in C: the estimator of the controller, pose_estimator.c and its numbers."""

from __future__ import annotations

import math
from importlib.resources import files
from typing import Any

from omnidyn.control.pose_estimator import (
    AGE,
    ALIKE,
    ALL_OF_IT,
    BY_DISTANCE,
    BY_TIME,
    BY_TURN,
    LONGEST,
    OUTLIER_SQUARE,
    PLACE_STD,
    TURN_BY_DISTANCE,
    TURN_BY_TIME,
    TURN_STD,
    UNSURE,
    WAIT_STD,
    rows_of,
)
from omnidyn.export.code.control_code import c_literal


def is_late(law: Any) -> bool:
    """Whether an estimator stands between the poses of its robot and itself."""
    return law._estimator is not None


def late_rows(law: Any) -> int:
    """How many steps are kept; 0 where poses are taken as they are."""
    return rows_of(float(law._estimator.numbers[AGE]), law.dt) if is_late(law) else 0


def late_pose_code(law: Any) -> str:
    """The function that brings a pose up to now, none where poses are taken as they are."""
    if not is_late(law):
        return "#define LATE_ROWS 0"
    numbers = law._estimator.numbers.tolist()
    texts = {"ROWS": str(late_rows(law)), "MEAN": str(int(law.sensors.averaged))}
    texts |= {name: c_literal(numbers[entry]) for name, entry in _LATE_NUMBERS.items()}
    texts |= {
        "OUTLIER": c_literal(OUTLIER_SQUARE),
        "FULL_TURN": c_literal(2.0 * math.pi),
        "ALL_OF_IT": c_literal(ALL_OF_IT),
    }
    texts |= {"UNSURE": str(int(numbers[UNSURE])), "LONGEST": c_literal(LONGEST * law.dt)}
    texts |= {"ALIKE": c_literal(ALIKE), "TINY": c_literal(TINY_IN_C)}
    defines = "\n".join(f"#define LATE_{name} {text}" for name, text in texts.items())
    text = files("omnidyn.export.code").joinpath("pose_estimator.c").read_text("utf-8")
    return f"#include <string.h>\n\n{defines}\n\n{text.strip()}"


TINY_IN_C = 2e-6  # [m], [rad]: what float32 makes of poses of some metres
_LATE_NUMBERS = {
    "AGE": AGE,
    "NOISE": PLACE_STD,
    "TURN_NOISE": TURN_STD,
    "BY_DISTANCE": BY_DISTANCE,
    "BY_TURN": BY_TURN,
    "TURN_BY_DISTANCE": TURN_BY_DISTANCE,
    "BY_TIME": BY_TIME,
    "TURN_BY_TIME": TURN_BY_TIME,
    "WAIT": WAIT_STD,
}
LATE_STRUCT = """
/* Places of the last steps, seen from where the robot is now, the pose that arrived last, what is believed of it. */
typedef struct {
    float age[@ROWS@], place[@ROWS@][3], seen[3], then[3], anchor[3], variance[2], drift[2], twist[3], waited;
    float last[3];
    int count, known, kind;
} omnidyn_late;
"""
