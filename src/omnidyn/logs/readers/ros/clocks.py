"""Which times of a bag can be trusted: the stamps in headers, where there are any, else when a message was received.

A recorder's clock may be set while it records; a sensor may count from its own start; both show in the difference
between the two times of a message. What was found is said, and mended where one way is right.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import BoolArray, IntArray
from omnidyn.errors import shortened

SECOND = 10**9
SET_BACK, SET_FORWARD = SECOND // 20, 86_400 * SECOND  # a step of the recorder's clock beyond is no recording
MOST_RESETS = 20  # times: so often no clock is set back
SEAM = SECOND  # what is put where the true time is not known: enough for a gap
OTHER_CLOCK = SECOND  # two times of one message differ by less, where they are of one clock
JUMP = SECOND // 2  # of a header against the time of reception
USUAL_SHARE = 0.9  # of the steps of a topic are usual ones
AT_ONCE = 3.0  # times faster than usual: what was held back comes so
PACE_ROWS = 20  # in a stretch that shows how fast a clock runs
OMNIDYN_TOPICS = "/omnidyn/"  # topics that are written with the time of the row as the time of reception
YEAR_NS = 365 * 86_400 * SECOND


@dataclass(frozen=True)
class Clocked:
    """The two times of the messages of a topic [ns], shape (n,). order: place in the file. header: 0 where unset."""

    topic: str
    receive: IntArray
    order: IntArray
    header: IntArray

    @property
    def stamped(self) -> BoolArray:
        return self.header != 0

    @property
    def offset(self) -> int:
        """How much the stamps lie behind the times of reception, as a median; 0 without stamps."""
        rows = self.stamped
        return int(np.median((self.header - self.receive)[rows])) if rows.any() else 0


def trusted(topics: Sequence[Clocked]) -> tuple[dict[str, IntArray], list[str]]:
    """Stamps [ns] for each topic, and what was found, in words."""
    notes: list[str] = []
    if not topics:
        return {}, notes
    topics = [_smoothed(topic, notes) for topic in _sewn(topics, notes)]
    stamped = [topic for topic in topics if topic.stamped.any()]
    bare = [topic.topic for topic in topics if not topic.stamped.any() and OMNIDYN_TOPICS not in topic.topic]
    if bare and stamped:
        topic_words = shortened(", ".join(bare), 200)
        notes.append(
            f"{topic_words}: no stamps, so the times of reception are taken, which lag behind by the way to it"
        )
    if not stamped and bare:
        notes.append("no message has a stamp of its own: the times of reception are taken")
    if not stamped:
        return {topic.topic: _from_1970(topic.receive, notes) for topic in topics}, list(dict.fromkeys(notes))
    reference = _reference(stamped)
    stamps_of = {}
    for topic in topics:
        if not topic.stamped.any():
            stamps_of[topic.topic] = _as_reference(topic.receive, reference)
            continue
        behind = (topic.header - topic.receive)[topic.stamped]
        there = _offsets(topic.receive[topic.stamped], reference)
        apart, shift = int(np.median(behind - there)), 0
        if abs(apart) > OTHER_CLOCK:
            shift = int((behind - (there if abs(reference.offset) > OTHER_CLOCK else 0)).max())
            notes.append(
                f"{topic.topic} is stamped by another clock, {apart / 1e9:.6g} s from that of {reference.topic}: moved "
                "by as much as its fastest message shows; what all of them take is not known"
            )
        late = topic.receive + _offsets(topic.receive, topic)
        stamps_of[topic.topic] = np.where(topic.stamped, topic.header, late) - shift
        bare = ~topic.stamped & (topic.receive != 0)
        if bare.any():
            notes.append(f"{topic.topic}: {int(bare.sum())} messages have no stamp: when received is taken")
    if abs(reference.offset) > OTHER_CLOCK:
        notes.append(
            f"stamps lie {reference.offset / 1e9:.6g} s from the times of reception: another clock, or a recording "
            "that was played again; topics without stamps were moved by as much"
        )
    _from_1970(reference.header, notes)
    return stamps_of, list(dict.fromkeys(notes))


def _reference(stamped: Sequence[Clocked]) -> Clocked:
    """The topic whose clock counts: one that agrees with the recorder's, else the busiest."""
    synchronous = [topic for topic in stamped if abs(topic.offset) <= OTHER_CLOCK]
    return max(synchronous or stamped, key=lambda topic: len(topic.receive))


def _as_reference(receive: IntArray, reference: Clocked) -> IntArray:
    """Times of reception on the clock of the stamps: as they are where the two agree, else as those of `reference`."""
    return receive if abs(reference.offset) <= OTHER_CLOCK else receive + _offsets(receive, reference)


def _offsets(receive: IntArray, topic: Clocked) -> IntArray:
    """How much the stamps of a topic lie behind the times of reception, when others were received.

    What is received later is stamped later: single messages that were late, or stamped wrong, do not count.
    """
    receptions, stamps = topic.receive[topic.stamped], topic.header[topic.stamped]
    order = np.argsort(receptions, kind="stable")
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(stamps[order], 2, mode="edge"), 5)
    receptions, stamps = receptions[order], np.maximum.accumulate(np.sort(windows, axis=1)[:, 2])
    offsets = stamps - receptions
    first, least = receptions[0], offsets.min()  # taken off: a float has no place for all digits since 1970
    between = np.interp(
        (receive - first).astype(float), (receptions - first).astype(float), (offsets - least).astype(float)
    )
    return least + np.rint(between).astype(np.int64)


def _sewn(topics: Sequence[Clocked], notes: list[str]) -> list[Clocked]:
    """The topics with a second in place of each step by which the recorder's clock was set."""
    if not any(_has_step(topic.receive) for topic in topics):
        return list(topics)
    if _are_shuffled(topics):
        notes.append("the messages stand out of the order of time in the file: they were sorted")
        return list(topics)
    order = np.concatenate([topic.order for topic in topics])
    receive = np.concatenate([topic.receive for topic in topics])[np.argsort(order)]
    order = np.sort(order)
    steps = np.diff(receive)
    cuts = [k for k in np.flatnonzero((steps < -SET_BACK) | (steps > SET_FORWARD)).tolist() if _is_set(receive, k)]
    for k in reversed(cuts):
        step = int(receive[k + 1] - receive[k])
        direction = "back" if step < 0 else "forward"
        notes.append(
            f"the clock of the recorder was set {direction} by {abs(step) / 1e9:.6g} s: what follows is taken to begin "
            f"{SEAM / 1e9:g} s later, behind a gap"
        )
        topics = [_moved(topic, int(order[k]), int(receive[k]), step) for topic in topics]
    return list(topics)


def _has_step(receive: IntArray) -> bool:
    steps = np.diff(receive)
    return bool(len(steps)) and bool(steps.min() < -SET_BACK or steps.max() > SET_FORWARD)


def _are_shuffled(topics: Sequence[Clocked]) -> bool:
    """Whether times go back because messages were written out of order, not because a clock was set: what stands
    between jumps of the busiest topic does not overlap, or they are too many."""
    busiest = max(topics, key=lambda topic: len(topic.receive)).receive
    if any((np.diff(topic.receive) > SET_FORWARD).any() for topic in topics):
        return False
    return int((np.diff(busiest) < -SET_BACK).sum()) > MOST_RESETS or not _overlap(busiest)


def _overlap(receive: IntArray) -> bool:
    """Whether stretches of times between jumps, back or forth, overlap by more than a moment."""
    steps = np.abs(np.diff(receive))
    jump = max(SET_BACK, 5.0 * float(np.median(steps)) if len(steps) else 0.0)
    stretches = np.split(receive, np.flatnonzero(steps > jump) + 1)
    spans = sorted((int(stretch.min()), int(stretch.max())) for stretch in stretches if len(stretch))
    return any(before[1] > after[0] + SET_BACK for before, after in itertools.pairwise(spans))


def _is_set(receive: IntArray, k: int) -> bool:
    """Whether the messages about a step agree in it, and not only one of them lies apart."""
    before, after = np.median(receive[max(0, k - 4) : k + 1]), np.median(receive[k + 1 : k + 6])
    step = float(after - before)
    return step < -SET_BACK or step > SET_FORWARD


def _moved(topic: Clocked, last: int, before: int, step: int) -> Clocked:
    """What stands behind a place in the file, moved: the first of it then comes a second after what was before."""
    later = topic.order > last
    shift = np.where(later, SEAM - step, 0)
    # A stamp goes with the clock that made it: the one before it was set, or the one after.
    old, new = np.abs(topic.header - before), np.abs(topic.header - before - step)
    rows = topic.stamped & (np.minimum(old, new) < abs(step) / 2) & (new < old)
    return replace(topic, receive=topic.receive + shift, header=topic.header + np.where(rows, SEAM - step, 0))


def _smoothed(topic: Clocked, notes: list[str]) -> Clocked:
    """A topic whose own stamps jump where the times of reception do not: its clock was set.

    Stamps that are regular among themselves stay as they are, however late and at whatever pace they were received.
    What stood before a jump is moved: rows keep their order, and no stretch lies over another one.
    """
    rows = np.flatnonzero(topic.stamped)
    if len(rows) < 3:
        return topic
    header, receive = topic.header[rows], topic.receive[rows]
    # What a stamp is behind the time of reception, as fast as the clock of the stamps runs
    pace = _pace(header, receive)
    offset = header - np.rint(pace * (receive - receive[0])).astype(np.int64)
    steps, jumps = np.diff(header), np.diff(offset)
    usual = int(np.quantile(np.abs(steps), USUAL_SHARE, method="lower"))
    is_set = (steps < 0) & (jumps < -JUMP) | (steps > usual + JUMP) & (jumps > JUMP)
    cuts = [k for k in np.flatnonzero(is_set).tolist() if abs(_jump(offset, k)) > JUMP]
    at_once = steps > AT_ONCE * pace * np.diff(receive)
    cuts = [k for k in cuts if steps[k] < 0 or _rise(offset, at_once, k) > JUMP]  # else rows were lost there
    if not cuts:
        return topic
    if len(cuts) > MOST_RESETS:
        if (steps[cuts] > 0).all():
            return topic
        notes.append(f"{topic.topic}: its stamps go back too often to be a time: the times of reception are taken")
        return replace(topic, header=np.zeros_like(topic.header))
    moved = topic.header.copy()
    for k in cuts:
        shift = _jump(offset, k)
        if not 0 < steps[k] - shift <= usual + JUMP:
            shift = int(steps[k]) - max(1, usual)
        moved[rows[: k + 1]] += shift
    notes.append(
        f"{topic.topic}: its clock was set {len(cuts)} time{'s' * (len(cuts) > 1)}, by up to "
        f"{int(np.abs(jumps[cuts]).max()) / 1e9:.6g} s; what it stamped before was moved, as the times of reception say"
    )
    return replace(topic, header=moved)


def _pace(header: IntArray, receive: IntArray) -> float:
    """How fast the clock of the stamps runs by that of the recorder: 1, or the real-time factor of a simulation.

    A median over stretches: neither pauses nor a clock that was set change it.
    """
    stretch = max(1, min(PACE_ROWS, len(header) // 10))
    ahead, passed = header[stretch:] - header[:-stretch], receive[stretch:] - receive[:-stretch]
    return float(np.median(ahead[passed != 0] / passed[passed != 0])) if passed.any() else 0.0


def _rise(offset: IntArray, at_once: BoolArray, k: int) -> int:
    """How much the offsets rise over row k and all that was held back with it, and then received at once.

    Within that they tell nothing: they fall by what was held back, and rise again row by row.
    """
    first, last = k, k + 1
    while first > 0 and at_once[first - 1]:
        first -= 1
    while last < len(at_once) and at_once[last]:
        last += 1
    first -= first < k  # the row before what was held back
    return int(np.median(offset[last : last + 5]) - np.median(offset[max(0, first - 4) : max(0, first) + 1]))


def _jump(offset: IntArray, k: int) -> int:
    """How much the offsets behind row k are above those up to it, as medians of a few."""
    return int(np.median(offset[k + 1 : k + 6]) - np.median(offset[max(0, k - 4) : k + 1]))


def _from_1970(stamps: IntArray, notes: list[str]) -> IntArray:
    if len(stamps) and SECOND < stamps[0] < YEAR_NS:
        notes.append("stamps begin in 1970: simulated time, or a clock that was never set; only differences count")
    return stamps
