"""Which candidates would explain what a fit leaves, best first, and which of them the log cannot tell apart.

Each is fitted beside all parameters, to first order, in rows made white; its worth is judged on blocks of the log that
it was not fitted to, and by BIC, so that the simpler of two that explain the same comes first. Two are the same to a
log where each leaves as much as the other and both together hardly less.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.output_error.linear.blocks import Blocks
from omnidyn.identification.output_error.linear.rows import Linear, Rows
from omnidyn.identification.structure.missing.candidates import Candidate, Trial
from omnidyn.model.actuation import GAIN
from omnidyn.model.keys import BODY_AXES, DIRECTION
from omnidyn.statement import NOTE, Statement

CLEAR = 2.0  # standard errors by which a remedy may seem worse on blocks it was not fitted to
NOTHING = 1e-4  # of where a number began, below which there is none of it
RIVAL = 0.3  # of what the best explains, from which another explanation is worth a look
TOLD_APART, ROUGHLY = 6.0, 0.05  # of chi squared, or its share, by which one must be better than the other


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate at its best trial: where its columns stand, how many of them show anything, what it explains, its
    size, and how far the parameters would follow it."""

    candidate: Candidate
    trial: Trial
    at: IntArray
    shows: int
    chi2: float
    size: FloatArray
    step: FloatArray

    @property
    def numbers(self) -> int:
        """How many it fits; one of an axis that never moved is none."""
        return self.trial.fitted.numbers if self.trial.fitted else max(self.shows, 1)


def remedies(
    linear: Linear, tried: Sequence[tuple[Candidate, list[Trial]]], found: Sequence[FloatArray], most: int = 8
) -> tuple[Remedy, ...]:
    """The candidates that explain something, best first. found: of each piece (C, rows, K), what residuals follow."""
    flat = [(one, trial) for one, trials in tried for trial in trials]
    if not flat:
        return ()
    blocks = Blocks(linear, *(trial.shown for _, trial in flat), found)
    themes = np.arange(len(blocks.size) - found[0].shape[2], len(blocks.size))
    known = np.arange(1, 1 + blocks.count)
    base, first, best = blocks.left(known), 1 + blocks.count, {}
    before = blocks.held_out(known)
    penalty = np.log(max(blocks.rows, 2))
    noise = base / max(blocks.rows - blocks.count, 1)
    for one, trial in flat:
        k = trial.shown[0].shape[2]
        at = np.arange(first, first + k)
        first += k
        chi2 = (base - blocks.left(np.concatenate([known, at]))) / noise
        both = np.concatenate([known, at])
        fitted = blocks.fitted(blocks.total, both) / blocks.size[both]
        size, step = fitted[len(known) :], fitted[: len(known)]
        if size.max() < one.least:
            continue
        own = Tried(one, trial, at, int(blocks.shows[at].sum()), float(chi2), size, step)
        if one.key not in best or chi2 - penalty * own.numbers > best[one.key].chi2 - penalty * best[one.key].numbers:
            best[one.key] = own
    ranked = sorted(best.values(), key=lambda t: t.chi2 - penalty * t.numbers, reverse=True)
    worth = [t for t in ranked if t.chi2 > penalty * t.numbers + 2.0 * np.log(max(len(best), 1))][: 2 * most]
    ranking = []
    for t in worth:
        after = blocks.held_out(np.concatenate([known, t.at]))
        change = (before - after) / max(float(before.sum()), 1e-300)
        gain, std = float(change.sum()), float(change.std(ddof=1) * np.sqrt(len(change)))
        same = tuple(o.candidate.key for o in worth if o is not t and _same(blocks, known, base, noise, t, o))
        fitted = t.trial.fitted
        cause = fitted.cause if fitted else t.candidate.cause(float(t.size[0]), t.trial.at)
        every = (base - blocks.left(np.concatenate([known, t.at, themes]))) / noise
        share = (t.chi2 - t.numbers) / max(every - t.numbers - len(themes), t.chi2 - t.numbers, 1e-300)
        ranking.append(
            Remedy(
                t.candidate.key,
                cause,
                gain,
                std,
                same,
                share,
                t.candidate.offered,
                t.chi2,
                t.numbers,
                tuple(t.size.tolist()),
                t.trial.at,
                fitted.changes if fitted else _changes(linear.rows, t),
            )
        )
    kept = [r for r in ranking if r.gain > -CLEAR * r.gain_std and r.chi2 > RIVAL * worth[0].chi2]
    return tuple(_best_first(kept)[:most])


def _best_first(ranking: list[Remedy]) -> list[Remedy]:
    """By what they explain; before all of them what on held-out blocks is clearly better than the first.

    What rows do near the fit tells less of a large change than whether it holds on the next block.
    """
    if not ranking:
        return ranking
    first = ranking[0]
    ahead = [r for r in ranking if r.gain - r.gain_std > first.gain + first.gain_std]
    return [*sorted(ahead, key=lambda r: -r.gain), *(r for r in ranking if r not in ahead)]


def _changes(rows: Rows, tried: Tried) -> dict[str, tuple[float, float]]:
    """Number of the robot -> (what it is, what it would be beside a candidate), to first order; none for a candidate
    that takes the place of what these numbers belong to."""
    if tried.candidate.key in (BODY_AXES, DIRECTION):
        return {}
    found = {}
    for p, value, by in zip(rows.problem.robot_parameters, rows.point.values.tolist(), tried.step, strict=False):
        then = min(max(p.outer(p.inner(value) + float(by)), p.low), p.high)
        if max(abs(value), abs(then)) > NOTHING * abs(p.value):  # else it is 0, and stays so
            found[p.name] = value, then
    return found


def _same(blocks: Blocks, known: IntArray, base: float, noise: float, one: Tried, other: Tried) -> bool:
    """Whether the log cannot tell two apart: as good as each other, and both hardly better than one."""
    both = (base - blocks.left(np.concatenate([known, one.at, other.at]))) / noise
    least = max(TOLD_APART, ROUGHLY * max(one.chi2, other.chi2))  # to first order, for either is a larger change
    return abs(one.chi2 - other.chi2) < least and both - max(one.chi2, other.chi2) < least


# What a log of nothing but a twist hides, if the robot computed that from its wheels, with a radius that is wrong
#
# Wheels s times as large as said show v/s: exactly what motors of s^2 the resistance, or of 1/s^2 the voltage, and
# Coulomb friction over s do (M v' = G K (u - E G'v/(s r))/(R s r) - F sgn v); wheels s times as far out as said turn
# like
# a body of I/s^2. No fit to such a log can tell.

HIDDEN = {
    "motor.resistance_ohm": "wheels.wheel_radius_m",
    GAIN: "wheels.wheel_radius_m",
    "body.inertia_kg_m2": "wheels.robot_radius_m",
}


def hidden_by(key: str, columns: Iterable[tuple[str, int]]) -> list[str]:
    """The radius that looks like a change of a number, to logs of these columns: none, or one."""
    return [HIDDEN[key]] if key in HIDDEN and {name for name, _ in columns} == {"twist"} else []


def with_odometry(remedies: Sequence[Remedy], columns: Sequence[tuple[str, int]]) -> tuple[Remedy, ...]:
    """The same; those that may be a radius name it, and the radius them."""
    behind = {remedy.key: hidden_by(remedy.key, columns) for remedy in remedies}
    found = []
    for remedy in remedies:
        looks = [key for key, radii in behind.items() if remedy.key in radii]
        cause = Statement("if_odometry", NOTE, numbers={"cause": remedy.cause}) if looks else remedy.cause
        same = tuple(dict.fromkeys((*remedy.same_as, *behind[remedy.key], *looks)))
        found.append(replace(remedy, same_as=same, cause=cause))
    return tuple(found)
