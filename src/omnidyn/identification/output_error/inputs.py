"""Whether logs have the inputs and outputs that a fit of whole logs needs."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.output_error.problem.record import LOOP_REMEDY
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.run import Run

OUTPUTS = ("twist", "wheel_speed", "wheel_angle", "current", "pose")


def why_no_inputs(runs: Sequence[Run], robot: Robot) -> str:
    """Which log has no input that the robot follows, or no output, in words; "" where all have both."""
    for run in runs:
        none = run.voltage is None and run.duty is None
        if none and (run.wheel_speed_command is not None or run.twist_command is not None):
            if robot.drive.kind != SPEED:
                return f"{run.source or 'a log'} holds set speeds only; to fit it whole, {LOOP_REMEDY}"
        elif none:
            return f"{run.source or 'a log'} holds no voltage and no duty"
        if not any(getattr(run, name) is not None for name in OUTPUTS):
            return f"{run.source or 'a log'} holds no speed, angle, current or pose"
    return ""
