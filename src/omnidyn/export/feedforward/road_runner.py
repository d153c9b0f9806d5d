"""road-runner: kS, kV, kA of driving forward, per inch, as Road Runner's quickstart wants them.

Road Runner has one set of gains for all wheels, in volts per inch of the robot's way forward; on a mecanum or an
omnidirectional robot going sideways and turning take others, which stand beside it.
"""

from __future__ import annotations

from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import AXES, NAMES, rows, spread
from omnidyn.export.spelling import java_comment, number
from omnidyn.model.robot import Robot

INCH = 0.0254  # [m]
NOTES = ("per inch of the robot's way: times inPerTick they are PARAMS.kV and PARAMS.kA of the quickstart",)
AXIS_NAMES = {"x": "forward", "y": "lateral", "yaw": "heading"}


def road_runner(robot: Robot) -> Export:
    """kS [V], kV [V s/in], kA [V s^2/in] of driving forward and sideways, of turning per rad."""
    refuse("road-runner", robot)
    omissions = left_out("road-runner", robot)
    lines = []
    for row in rows(robot):
        if row.place in AXES:
            inches = 1.0 if row.name == NAMES[0] or row.place == "yaw" else INCH
            row_in_inches = row._replace(
                value=row.value * inches,
                std=row.std * inches,
                unit=(row.unit.replace("/m", "/in") if inches != 1.0 else row.unit),
            )
            name = f"{AXIS_NAMES[row.place]}{row.name.upper()}" if row.place != "x" else row.name
            lines.append(f"public double {name} = {number(row_in_inches.value)}; // {spread(row_in_inches)}")
    about = java_comment(
        [
            f"{robot.name}: feed-forward gains by omnidyn, volts and inches.",
            *NOTES,
            *[f"Not in it: {words}" for words in omissions],
        ]
    )
    return Export("road-runner", robot.name, {"gains.java": about + "\n".join(lines) + "\n"}, omissions, NOTES)
