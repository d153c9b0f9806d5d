"""All claims of the paper with our numbers and verdicts, by subject."""

from __future__ import annotations

from omnidyn.model.robot_file import load_robot
from omnidyn.paper.claim import Claim, ClaimVerdict
from omnidyn.paper.friction import friction_claims
from omnidyn.paper.geometry import geometry_claims
from omnidyn.paper.mismatch import mismatch_claims
from omnidyn.paper.motion import motion_claims
from omnidyn.paper.motors import motor_claims
from omnidyn.paper.speeds import speed_claims
from omnidyn.paper.validation import validation_claims

__all__ = ["PRESET", "Claim", "ClaimVerdict", "all_claims"]

PRESET = "axebot"


def all_claims() -> tuple[Claim, ...]:
    """Every equation, table, figure and checkable sentence of the paper, computed anew from the preset of Table 3."""
    robot = load_robot(PRESET)
    parts = (geometry_claims, motion_claims, motor_claims, friction_claims, speed_claims, validation_claims)
    return tuple(claim for part in (*parts, mismatch_claims) for claim in part(robot))
