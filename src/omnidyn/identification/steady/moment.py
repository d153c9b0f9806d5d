"""A change inside a run at constant speeds, of floor, load or supply, by commands that come again.

    y_k = a_c + d [t_k > T] + noise,   y: force of window k along the mean force of its command c, over that mean

A command is compared with itself, so that no shape of friction has a part in it. T is the cut between two windows that
explains most; Student's t of d counts all cuts of all runs (C. E. Bonferroni, 1936).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.steady.operating_points import ForcePoints, HeldForces, held_forces
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import Statement
from omnidyn.statistics import t_quantile

FALSE = 0.01  # of right logs for which a change is told
SPARE = 4  # windows beyond the commands that a test needs
AS_GOOD = 6.0  # of t squared, by which a cut must be worse than the best to be ruled out
MATTERS = 0.02  # of the force: a smaller change does not matter


@dataclass(frozen=True)
class Moment:
    """A change inside a run. at: its time [s], and from where to where it may be. before, after: force of the motors
    that friction balances [N], mean of the commands that were given on both sides, with 95 % intervals. change: the
    second over the first, less 1; ci95: of it. p: the chance of as much. shape: of friction, that this rests on where
    no command came again."""

    source: str
    at: float
    between: tuple[float, float]
    before: float
    before_ci95: tuple[float, float]
    after: float
    after_ci95: tuple[float, float]
    change: float
    ci95: tuple[float, float]
    p: float
    shape: str = ""

    @property
    def vanished(self) -> tuple[bool, bool]:
        """Whether no force is left that is told from none, before and after: then nothing scales with it."""
        return self.before_ci95[0] <= 0.0, self.after_ci95[0] <= 0.0

    def statement(self) -> Statement:
        """The change, with its numbers."""
        numbers = {name: value for name, value in asdict(self).items() if name != "source"}
        before, after = self.vanished
        gone = {"vanished": "before" if before else "after" if after else ""}
        return Statement("changes_within_run", subject=self.source, numbers=numbers | gone)

    def short(self) -> Statement:
        """When and by how much."""
        return Statement("change_in_run", subject=self.source, numbers={"change": self.change, "at": self.at})


def levelled(points: ForcePoints, found: Sequence[Moment], sources: Mapping[int, str]) -> ForcePoints:
    """The points as they would be had nothing changed: forces after each change over 1 + change; what it falls into,
    and the side on which no force is left, go. sources: of the runs, by number."""
    wrench, kept = points.wrench.copy(), np.ones(len(points), bool)
    for each in found:
        own = np.array([sources[number] == each.source for number in points.run.tolist()])
        before, after = own & (points.span[:, 1] <= each.at), own & (points.span[:, 0] >= each.at)
        if any(each.vanished):
            kept &= ~own | (after if each.vanished[0] else before)
            continue
        wrench[after] /= 1.0 + each.change
        kept &= ~own | before | after
    return replace(points, wrench=wrench).chosen(kept)


def moments(
    runs: Sequence[Run], robot: Robot, speed: str, origin: str, window: tuple[float, float] | None = None
) -> tuple[Moment, ...]:
    """The changes inside runs, one a run at the most; what commands given once cannot tell is not told."""
    held = [held_forces(run, robot, speed, origin, window) for run in runs]
    tests = sum(len(_cuts(each)) for each in held)
    found = (_moment(each, run.source, tests) for each, run in zip(held, runs, strict=True))
    return tuple(each for each in found if each is not None)


def _cuts(held: HeldForces) -> list[int]:
    """Windows before which there may be a change: some command must come on both sides, and windows to spare."""
    n = len(held.start)
    if n - len(set(held.command.tolist())) < SPARE:
        return []
    return [k for k in range(2, n - 1) if set(held.command[:k].tolist()) & set(held.command[k:].tolist())]


def _moment(held: HeldForces, source: str, tests: int) -> Moment | None:
    cuts = _cuts(held)
    if not cuts:
        return None
    y, size = _along(held)
    tried = {cut: _shift(y, held, cut) for cut in cuts}
    best = max(cuts, key=lambda cut: abs(tried[cut][0] / tried[cut][1]))
    shift, std, degrees = tried[best]
    p = min(1.0, tests * 2.0 * float(stdtr(degrees, -abs(shift / std))))
    if p > FALSE or abs(shift) < MATTERS:
        return None
    near = [cut for cut in cuts if (tried[cut][0] / tried[cut][1]) ** 2 > (shift / std) ** 2 - AS_GOOD]
    both = np.array([c in set(held.command[:best]) and c in set(held.command[best:]) for c in held.command])
    after = np.arange(len(y)) >= best
    force = float(size[both].mean())
    spread = t_quantile(degrees)
    scatter = std * np.sqrt(len(y)) / 2.0  # of one window, over the force

    def level(own: BoolArray) -> tuple[float, tuple[float, float]]:
        middle, half = force * float(y[own].mean()), float(spread * force * scatter / np.sqrt(own.sum()))
        return middle, (middle - half, middle + half)

    ends = (float(held.start[min(near) - 1]), float(held.end[max(near)]))
    at = 0.5 * float(held.end[best - 1] + held.start[best])
    before, after_it = level(both & ~after), level(both & after)
    base = before[0] / force
    ci95 = ((shift - spread * std) / base, (shift + spread * std) / base)
    return Moment(source, at, ends, *before, *after_it, shift / base, ci95, p)


def _along(held: HeldForces) -> tuple[FloatArray, FloatArray]:
    """(force of each window along the mean of its command, over that mean (n,); the mean [N] (n,))."""
    y, size = np.zeros(len(held.start)), np.zeros(len(held.start))
    for c in np.unique(held.command):
        own = held.command == c
        mean = held.force[own].mean(axis=0)
        size[own] = np.linalg.norm(mean)
        y[own] = held.force[own] @ mean / max(float(mean @ mean), 1e-300)
    return y, size


def _shift(y: FloatArray, held: HeldForces, cut: int) -> tuple[float, float, int]:
    """(d, its standard error, degrees of freedom) of a cut, each command with a mean of its own."""
    after = (np.arange(len(y)) >= cut).astype(float)
    x, left = after.copy(), y.copy()
    for c in np.unique(held.command):
        own = held.command == c
        x[own] -= x[own].mean()
        left[own] -= left[own].mean()
    square = float(x @ x)
    shift = float(x @ left) / square
    degrees = len(y) - len(np.unique(held.command)) - 1
    rest = left - shift * x
    return shift, float(np.sqrt(max(float(rest @ rest), 1e-300) / degrees / square)), degrees
