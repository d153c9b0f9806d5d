"""Which topic gives a component, where several could: the one with the first claim, or none, and then that is said."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.logs.columns.doubts import NO_NUMBER
from omnidyn.logs.readers.recording import Track
from omnidyn.logs.table.table import Declaration
from omnidyn.statement import Statement

USUAL_NAMES = ("odom", "cmd_vel", "joint_states", "battery_state", "data", "pose", "tf")


class TopicColumn(NamedTuple):
    """A column made of a topic. component: what it is; "" for nothing by itself; None where its name says it."""

    name: str
    values: FloatArray
    unit: str = ""
    component: str | None = None


class TopicClaim(NamedTuple):
    """The columns of a topic, and its stamps [ns]. rank: of what gives the same component, the least is taken."""

    topic: str
    stamps: IntArray
    columns: Sequence[TopicColumn]
    rank: int = 0


def tracks_of(claims: Sequence[TopicClaim], notes: list[str]) -> Iterator[Track]:
    """The tracks, each component given to one topic; what was passed over goes to `notes`."""
    claims_of: dict[str, list[TopicClaim]] = {}
    for claim in claims:
        for out in claim.columns:
            if out.component and not np.isnan(out.values).all():
                claims_of.setdefault(out.component, []).append(claim)
    owners = {component: _owner(claim) for component, claim in claims_of.items()}
    _say(claims_of, owners, notes)
    for claim in claims:
        says = {
            out.name: _said(out, out.component, claim, claims_of, owners)
            for out in claim.columns
            if out.component is not None
        }
        units = {out.name: out.unit for out in claim.columns if out.unit}
        yield Track(claim.topic, claim.stamps, {out.name: out.values for out in claim.columns}, units, says)


def _said(
    out: TopicColumn,
    component: str,
    claim: TopicClaim,
    claims_of: dict[str, list[TopicClaim]],
    owners: dict[str, str | None],
) -> Declaration:
    """What a column is; why it is not taken."""
    if component and component not in claims_of:
        return Declaration(component, Statement("no_heading_number" if component == "heading" else NO_NUMBER))
    if np.isnan(out.values).all():
        return Declaration("")
    owner = owners.get(component)
    if component and owner is None:
        topics = sorted(rival.topic for rival in claims_of[component])[:4]
        return Declaration(component, Statement("several_topics", numbers={"topics": topics}))
    return Declaration(component if owner == claim.topic else "")


def _owner(claims: Sequence[TopicClaim]) -> str | None:
    """The topic that gives a component: of the least rank, and of those the one with a usual name; None where two."""
    least_rank = min(claim.rank for claim in claims)
    topics = [claim.topic for claim in claims if claim.rank == least_rank]
    if len(topics) > 1:
        topics = [topic for topic in topics if topic.rpartition("/")[2] in USUAL_NAMES] or topics
    return topics[0] if len(topics) == 1 else None


def _say(claims_of: dict[str, list[TopicClaim]], owners: dict[str, str | None], notes: list[str]) -> None:
    """Which topics give the same as another, and are not taken."""
    yielded: dict[tuple[str, str], list[str]] = {}
    for component, claims in claims_of.items():
        owner = owners[component]
        for claim in claims:
            if owner is not None and claim.topic != owner:
                yielded.setdefault((claim.topic, owner), []).append(component)
    notes += [
        f"{', '.join(components)} of {topic} are not taken: {owner} gives them (`column` takes others)"
        for (topic, owner), components in yielded.items()
    ]
