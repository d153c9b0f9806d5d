"""All claims of the paper with our numbers and verdicts, by subject."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace

from omnidyn.document import Document, Points, Words
from omnidyn.model.frames import AXES
from omnidyn.model.robot_file import load_robot
from omnidyn.paper.claim import RULE, Claim, ClaimVerdict
from omnidyn.paper.friction import friction_claims
from omnidyn.paper.geometry import geometry_claims
from omnidyn.paper.mismatch import mismatch_claims
from omnidyn.paper.motion import motion_claims
from omnidyn.paper.motors import motor_claims
from omnidyn.paper.speeds import speed_claims
from omnidyn.paper.validation import validation_claims

__all__ = ["PRESET", "RULE", "Claim", "ClaimVerdict", "all_claims", "claims_document", "headlines", "verdict_counts"]

PRESET = "axebot"
INDENT = " " * 8
SUBJECTS = {
    "Frames and wheels": geometry_claims,
    "Motion of the body": motion_claims,
    "Motors": motor_claims,
    "Friction, Table 2": friction_claims,
    "Steady speeds, Table 1": speed_claims,
    "Validation, section 4": validation_claims,
    "How the tables fit together": mismatch_claims,
}


def all_claims() -> tuple[Claim, ...]:
    """Every equation, table, figure and checkable sentence of the paper, computed anew from the preset of Table 3."""
    robot = load_robot(PRESET)
    return tuple(replace(claim, subject=subject) for subject, part in SUBJECTS.items() for claim in part(robot))


def headlines(claims: Sequence[Claim]) -> list[str]:
    """What came out, in five lines."""
    by_key, counts = {claim.key: claim for claim in claims}, verdict_counts(claims)
    places = (claim.place.split(", ")[0] for claim in claims if claim.verdict is ClaimVerdict.CORRECTED)
    corrected = [place for place in dict.fromkeys(places) if place.startswith("eq")]
    table_2 = [claim for claim in claims if claim.place == "Table 2"]
    right = [claim for claim in table_2 if claim.verdict is ClaimVerdict.REPRODUCED]
    mismatches = [f"{c.statement.split()[0]}: {c.ours}, printed {c.printed}" for c in table_2 if c not in right]
    zones = [by_key[f"dead-zone-{axis}"] for axis in AXES]
    rows = by_key["one-robot"].numbers
    yes, mended, no = (counts[verdict] for verdict in ClaimVerdict if verdict.judged)
    judged = yes + mended + no
    return [
        f"{yes} of {judged} claims are reproduced as printed, {mended} after a correction, {no} cannot be; "
        f"{len(claims) - judged} more are not in the text we have, or about another paper.",
        f"The equations hold, but for misprints and signs: corrected are {'; '.join(corrected)}.",
        f"{len(right)} of {len(table_2)} numbers of Table 2 come out of Table 1 by least squares"
        + (f"; not {'; '.join(mismatches)}." if mismatches else "."),
        f"Tables 1 and 3 are not of one robot: {rows['agreeing']:g} of {rows['rows']:g} steady speeds agree, and no "
        f"single change of a parameter, nor any pair, explains more than {rows['most_agreeing']:g}.",
        f"The dead zones of v, v_n and w come out as {', '.join(zone.ours for zone in zones)}; the text says "
        f"{', '.join(zone.printed for zone in zones)}.",
    ]


def verdict_counts(claims: Sequence[Claim]) -> dict[ClaimVerdict, int]:
    """How many claims have each verdict."""
    return {verdict: sum(claim.verdict == verdict for claim in claims) for verdict in ClaimVerdict}


def claims_document(claims: Sequence[Claim]) -> Document:
    """Every claim with its verdict in front, its place and the two numbers, and the counts at the end."""
    parts, counts = [], verdict_counts(claims)
    for claim in claims:
        parts.append(_judged(claim.verdict, f"{claim.place}: {claim.statement}"))
        parts.append(Words(f"printed {claim.printed}; ours {claim.ours}", INDENT, INDENT))
    total = [_judged(verdict, f"{number} {verdict.value}") for verdict, number in counts.items()]
    lines = headlines(claims)
    data = {
        "headlines": lines,
        "rule": RULE,
        "verdicts": {verdict.value: number for verdict, number in counts.items()},
        "claims": [*map(asdict, claims)],
    }
    return Document([*parts, "", *total, "", Words(RULE), "", Points(lines, name="headlines")], data)


def _judged(verdict: ClaimVerdict, words: str) -> Words:
    return Words(words, f"{verdict.short:{len(INDENT)}}", INDENT, tone=verdict.short if verdict.judged else "")
