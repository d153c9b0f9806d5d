"""All outputs of a fit by name. A new one is a line here and a line of `sensors.py`."""

from __future__ import annotations

from collections.abc import Mapping

from omnidyn.identification.output_error.problem.observation.current import Current
from omnidyn.identification.output_error.problem.observation.observation import Observation
from omnidyn.identification.output_error.problem.observation.pose import Heading, Position
from omnidyn.identification.output_error.problem.observation.twist import Twist
from omnidyn.identification.output_error.problem.observation.wheel_angle import WheelAngle
from omnidyn.identification.output_error.problem.observation.wheel_speed import WheelSpeed

OBSERVATIONS: Mapping[str, Observation] = {
    "twist": Twist(),
    "wheel_speed": WheelSpeed(),
    "wheel_angle": WheelAngle(),
    "current": Current(),
    "heading": Heading(),
    "position": Position(),
}
