"""All claims of the paper with our numbers and verdicts, by subject."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from omnidyn.document import Document, Words
from omnidyn.model.robot_file import load_robot
from omnidyn.paper.claim import Claim, Verdict
from omnidyn.paper.friction import friction_claims
from omnidyn.paper.geometry import geometry_claims
from omnidyn.paper.mismatch import mismatch_claims
from omnidyn.paper.motion import motion_claims
from omnidyn.paper.motors import motor_claims
from omnidyn.paper.speeds import speed_claims
from omnidyn.paper.validation import validation_claims

__all__ = ["PRESET", "Claim", "Verdict", "all_claims", "claims_document", "verdict_counts"]

PRESET = "axebot"
INDENT = " " * 8


def all_claims() -> tuple[Claim, ...]:
    """Every equation, table, figure and checkable sentence of the paper, computed anew from the preset of Table 3."""
    robot = load_robot(PRESET)
    parts = (geometry_claims, motion_claims, motor_claims, friction_claims, speed_claims, validation_claims)
    return tuple(claim for part in (*parts, mismatch_claims) for claim in part(robot))


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """How many claims have each verdict."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in Verdict}


def claims_document(claims: Sequence[Claim]) -> Document:
    """Every claim with its verdict in front, its place and the two numbers, and the counts at the end."""
    parts, counts = [], verdict_counts(claims)
    for claim in claims:
        parts.append(_judged(claim.verdict, f"{claim.place}: {claim.statement}"))
        parts.append(Words(f"printed {claim.printed}; ours {claim.ours}", INDENT, INDENT))
    total = [_judged(verdict, f"{number} {verdict.value}") for verdict, number in counts.items()]
    data = {"verdicts": {verdict.value: number for verdict, number in counts.items()}, "claims": [*map(asdict, claims)]}
    return Document([*parts, "", *total], data)


def _judged(verdict: Verdict, words: str) -> Words:
    return Words(words, f"{verdict.short:{len(INDENT)}}", INDENT, tone=verdict.short)
