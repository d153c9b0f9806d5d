"""The friction of an estimate against speed, or of the groups of one identification."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.identification.estimate import Estimate
from omnidyn.identification.friction_curve import FrictionCurve, friction_curve
from omnidyn.model.sliding import top_speeds
from omnidyn.report.figures.friction_speed import draw_friction_speed, speeds_up_to
from omnidyn.report.style import Picture

WHOLE = "all"  # the name of the one group where there are no groups


def estimate_curves(estimate: Estimate) -> list[FrictionCurve]:
    """The curves of an estimate along x, along y and about yaw, up to the speeds that its robot can reach."""
    tops = top_speeds(estimate.robot)
    return [friction_curve(estimate, axis, speeds_up_to(float(top))) for axis, top in enumerate(tops)]


def draw_estimates(estimates: Mapping[str, Estimate], **how: Any) -> Picture:
    """Friction against speed of one estimate, or of the groups of one identification."""
    names = {name: estimate.robot.name if name == WHOLE else name for name, estimate in estimates.items()}
    return draw_friction_speed({names[name]: estimate_curves(each) for name, each in estimates.items()}, **how)
