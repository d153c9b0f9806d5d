"""Speeds that the recorder made of positions: differences over one row or several, centred ones, low-passed ones.

Such a speed is no measurement of its own row: it is late, or knows the row after. It is told by the noise: a speed that
was made of the positions of the same log has their noise too, tick by tick, and nothing that was measured does.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.logs.channels import components
from omnidyn.model.frames import unwrapped, world_to_body
from omnidyn.statement import NOTE
from omnidyn.statistics import moving, robust_std

MOST_ROWS = 60_000  # rows that tell a filter
NOISE_SHARE = 0.2  # of the noise of the differences: a speed that comes nearer has that very noise
FOURTH = np.sqrt(70.0)  # spread of fourth differences of white noise; a smooth motion has next to none
ALIKE_SHARE = 0.9  # of the rows must be alike
LONGEST_MEAN = 8  # rows of a mean
STRONGEST, PLAIN = 0.02, 0.95  # share of the new value in a low-pass: below it nothing is told, above it there is none
LATE_STEP = 1.5  # steps of time beyond which two rows are no neighbours


class Speed(NamedTuple):
    """A speed, shape (rows,), and what it may be made of. rates (rows, n): of the positions, over one row back, over
    one back and one on, over two back, and so on to LONGEST_MEAN. noise: of the first of these, by their positions.
    """

    component: str
    origin: str
    values: FloatArray
    back: FloatArray
    centred: FloatArray
    over: tuple[FloatArray, ...]
    noise: float


class Filter(NamedTuple):
    """How a speed was made of its positions: "centred", "backward" or "low_pass" differences; by how much it is late
    [rows]; time constant of the low-pass [s], to two digits.
    """

    kind: str
    late: float
    constant: float = 0.0


def check_filters(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Notes on speeds that are differences of positions in the same log; nothing is masked."""
    if len(work) < 3 * MIN_ROWS or work.step <= 0.0:
        return [], work
    alike: dict[Filter, list[Speed]] = {}
    for speed in _speeds(work):
        filtered = _filter_of(speed, work.step)
        if filtered is not None:
            alike.setdefault(filtered, []).append(speed)
    return [_finding(spec, speeds, work.step) for spec, speeds in alike.items()], work


def _finding(filtered: Filter, speeds: list[Speed], step: float) -> Finding:
    return Finding(
        "filtered",
        NOTE,
        " ".join(speed.component for speed in speeds),
        {
            "rows_late": filtered.late,
            "seconds_late": filtered.late * step,
            "filter": filtered.kind,
            "positions": list(dict.fromkeys(speed.origin for speed in speeds)),
            "time_constant_s": filtered.constant,
        },
        filtered.kind,
    )


def _filter_of(speed: Speed, step: float) -> Filter | None:
    """How a speed was made; None where it has no noise of the positions, as one that was measured."""
    if not speed.noise > 0.0:
        return None
    if _off(speed.values - speed.centred, speed.back) < NOISE_SHARE * 0.5 * speed.noise:
        return Filter("centred", 0.0)
    for rows, rate in enumerate(speed.over, 1):
        if _off(speed.values - rate, speed.back) < NOISE_SHARE * speed.noise / rows:
            return Filter("backward", 0.5 * rows)
    return _low_pass(speed, step)


def _low_pass(speed: Speed, step: float) -> Filter | None:
    """y_k = y_(k-1) + a (d_k - y_(k-1)), d the differences to the row before; late by about its time constant."""
    change, ahead = np.diff(speed.values), speed.back[1:] - speed.values[:-1]
    finite = np.isfinite(change) & np.isfinite(ahead)
    power = float((ahead[finite] ** 2).sum())
    share = float((change[finite] * ahead[finite]).sum()) / power if power > 0.0 else 0.0
    if not STRONGEST < share < PLAIN or not _off(change - share * ahead, ahead) < NOISE_SHARE * share * speed.noise:
        return None
    constant = (1.0 - share) / share
    return Filter("low_pass", 0.5 + round(constant, 1), float(f"{constant * step * 1e3:.2g}") * 1e-3)


def _off(errors: FloatArray, rate: FloatArray) -> float:
    """What nine errors in ten stay below where it moves; inf where that is too little.

    A speed that is made of positions is so in every row; the middle error would be that of rest.
    """
    usable = np.isfinite(errors) & np.isfinite(rate) & moving(rate)
    return float(np.quantile(np.abs(errors[usable]), ALIKE_SHARE)) if usable.sum() >= MIN_ROWS else np.inf


def _speeds(work: LogUnderCheck) -> Iterator[Speed]:
    """Speeds that were recorded beside the positions that they could be made of."""
    t = work.t[:MOST_ROWS]
    angle, pose = work.get("wheel_angle"), work.get("pose")
    if angle is not None and "wheel_speed" in work.log.channels:
        of = {
            component: angle[:MOST_ROWS, k : k + 1]
            for k, component in enumerate(components("wheel_speed", angle.shape[1]))
        }
        for component, values in work.columns("wheel_speed"):
            yield from _made(component, "a" + component[1:], values[:MOST_ROWS], of[component], t, work.step, None)
    if pose is None or work.get("twist") is None:
        return
    place, heading = pose[:MOST_ROWS, :2], unwrapped(pose[:MOST_ROWS, 2])
    for component, values in work.columns("twist"):
        first_values = values[:MOST_ROWS]
        if component == "omega":
            yield from _made(component, "heading", first_values, heading[:, None], t, work.step, None)
        else:
            row = world_to_body(heading)[:, ["vx", "vy"].index(component), :2]
            yield from _made(component, "x y", first_values, place, t, work.step, row)


def _made(
    component: str,
    origin: str,
    values: FloatArray,
    place: FloatArray,
    t: FloatArray,
    step: float,
    row: FloatArray | None,
) -> Iterator[Speed]:
    """The speed beside the rates of its positions, shape (rows, n); row (rows, n): which part of them it is."""
    part = np.ones_like(place) if row is None else row
    in_step = np.concatenate([[False], np.diff(t) < LATE_STEP * step])

    def rate(back: int, on: int) -> FloatArray:
        """From `back` rows before to `on` rows after each row."""
        rates = np.full(len(t), np.nan)
        inside = slice(back, len(t) - on)
        change = place[back + on :] - place[: len(t) - back - on]
        rates[inside] = (part[inside] * change).sum(axis=1) / (t[back + on :] - t[: len(t) - back - on])
        rates[inside][~_together(in_step, back + on)] = np.nan
        return rates

    over = tuple(rate(rows, 0) for rows in range(1, LONGEST_MEAN + 1))
    turns = np.isfinite(over[0]) & moving(over[0])
    if turns.sum() < MIN_ROWS or np.nanmin(values) == np.nanmax(values):
        return
    rough = (part[2:-2] * np.diff(place, 4, axis=0)).sum(axis=1)[turns[2:-2] & _together(in_step, 4)]
    rough = rough[np.isfinite(rough)]
    noise = float(robust_std(rough, 0.0)) / FOURTH if rough.size >= MIN_ROWS else 0.0
    yield Speed(component, origin, values, over[0], rate(1, 1), over, noise * np.sqrt(2.0) / step)


def _together(in_step: BoolArray, count: int) -> BoolArray:
    """Whether `count` + 1 rows from each row on follow one another without a gap. Shape (rows - count,)."""
    gaps = np.concatenate([[0], np.cumsum(~in_step)])
    return gaps[count + 1 :] == gaps[1 : len(in_step) - count + 1]
