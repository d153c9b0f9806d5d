"""Whether the loop of a controller swings, in C: swing.c and its numbers."""

from __future__ import annotations

from importlib.resources import files
from typing import Any, TypeGuard

from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid
from omnidyn.control.swing import CHANGES, WINDOW
from omnidyn.export.code.control_code import c_literal, c_literals


def can_swing(law: Any) -> TypeGuard[Pid | Mpc]:
    """Whether it says that its loop swings."""
    return isinstance(law, Pid | Mpc)


def swing_code(law: Pid | Mpc) -> str:
    """The function that finds out whether its loop swings."""
    defines = f"#define SWING_CHANGES {CHANGES}\n#define SWING_WINDOW {c_literal(WINDOW)}"
    least = f"static const float SWING_LEAST[3] = {{{c_literals(law.swing.least)}}};"
    text = files("omnidyn.export.code").joinpath("swing.c").read_text("utf-8")
    return f"{defines}\n{least}\n\n{text.strip()}"


SWING_MEMORY = """
#if OMNIDYN_SWING
    omnidyn_swing swing;
#endif"""
SWING_STRUCT = """
/* Of each axis: the side of the error of its speed, and for how long [s] its last changes count. */
typedef struct {
    float side[3], left[3][@CHANGES@];
} omnidyn_swing;
"""
