"""Orders and signs of columns, and the choice among them: which one the log calls for, and whether it can tell."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.robust import windowed
from omnidyn.statement import NOTE, WARNING, Statement

BEST_SHARE = 0.35  # the right wiring leaves at most so much of what the logged one leaves
POOR = 0.02  # a wiring that leaves less than this share of the motion unexplained is not doubted
AS_GOOD_SHARE = 0.15  # a wiring so close to the best one, of the way to the logged one, is as good
MAX_TRIED = 4  # wheels up to which every order is tried; beyond, exchanges of two
WINDOWS = (0.12, 0.5)  # [s]; the long one for speeds that drown in noise


class Wiring(NamedTuple):
    """Slot i takes column order[i] times sign[i]; slots are wheels, or axes of the floor."""

    order: tuple[int, ...]
    sign: tuple[float, ...]

    @property
    def changes(self) -> int:
        """How many things are wrong in the log if this is right."""
        return sum(k != j for k, j in enumerate(self.order)) + sum(s < 0.0 for s in self.sign)

    @property
    def matrix(self) -> FloatArray:
        """slots = matrix @ columns."""
        n = len(self.order)
        matrix = np.zeros((n, n))
        matrix[np.arange(n), self.order] = self.sign
        return matrix

    def applied(self, values: FloatArray) -> FloatArray:
        """The columns put right. Shape (rows, n)."""
        return values[:, self.order] * np.array(self.sign)

    def statement(self, names: tuple[str, ...]) -> Statement:
        """What is wrong, by the names of the columns."""
        signs, columns = self.sign, [names[j] for j in self.order]
        return Statement("wiring", NOTE, "", {"slots": names, "columns": columns, "signs": signs})

    def touched(self, names: tuple[str, ...]) -> list[str]:
        """The columns that are wrong."""
        columns = {j for k, (j, s) in enumerate(zip(self.order, self.sign, strict=True)) if j != k or s < 0.0}
        return [names[j] for j in sorted(columns)]


class WiringChoice(NamedTuple):
    """best: the right wiring with fewest changes. others: as good ones. left, logged: share that best and log leave."""

    best: Wiring
    others: int
    second: Wiring | None
    left: float
    logged: float
    rival: Statement | None = None  # the same seen from the floor


def wirings(n: int) -> Iterator[Wiring]:
    """Orders and signs of n columns to try."""
    signs = list(product((1.0, -1.0), repeat=n)) if n <= 8 else [tuple([1.0] * n)]
    if n <= MAX_TRIED:
        orders: list[tuple[int, ...]] = list(permutations(range(n)))
    else:
        orders = [tuple(range(n))]
        for a in range(n):
            for b in range(a):
                swapped = list(range(n))
                swapped[a], swapped[b] = b, a
                orders.append(tuple(swapped))
    return (Wiring(order, tuple(sign)) for order in orders for sign in signs)


def choose(
    candidates: list[Wiring], costs: FloatArray, total: float, better: float = BEST_SHARE, poor: float = POOR
) -> WiringChoice | None:
    """The wiring that the costs call for; None where that of the log, the first, is not clearly wrong."""
    logged, least_cost = float(costs[0]), float(costs.min())
    if not np.isfinite(logged) or total <= 0.0 or logged < poor * total or least_cost > better * logged:
        return None
    alike = [k for k in np.flatnonzero(costs <= least_cost + AS_GOOD_SHARE * (logged - least_cost))]
    alike.sort(key=lambda k: (candidates[k].changes, costs[k]))
    # Of those with fewest changes the cheapest; a rival is one that does not need more changes.
    best = candidates[alike[0]]
    rivals = [candidates[k] for k in alike[1:] if candidates[k].changes == best.changes]
    return WiringChoice(
        best, len(rivals), rivals[0] if rivals else None, float(costs[alike[0]]) / total, logged / total
    )


def means(work: LogUnderCheck, *channels: FloatArray, seconds: float = WINDOWS[0]) -> list[FloatArray]:
    """Means over short windows, rows without all channels left out. Shapes (windows, columns)."""
    ids, count = work.windows(seconds)
    table = np.column_stack(channels)
    finite = np.asarray(np.isfinite(table).all(axis=1))
    number = windowed(ids, count, finite)
    sums = np.column_stack([windowed(ids, count, np.where(finite, column, 0.0)) for column in table.T])
    keep = number >= 3
    means = sums[keep] / number[keep, None]
    return np.split(means, np.cumsum([values.shape[1] for values in channels])[:-1], axis=1)


def code_of(wiring: Wiring) -> str:
    return "swapped" if any(k != j for k, j in enumerate(wiring.order)) else "inverted"


def rivals_of(answer: WiringChoice, names: tuple[str, ...]) -> dict[str, Statement]:
    """Another wiring that the log cannot tell from the best one."""
    rival = answer.rival if answer.second is None else answer.second.statement(names)
    return {} if rival is None else {"rival": rival}


# By which angle one velocity in the plane is turned against another

MOVING_SHARE = 0.2  # of what 90 % of the windows stay below
FEWEST_WINDOWS = 12  # windows
LEAST_ANGLE, SURE_ERRORS = np.radians(3.0), 6.0  # a marker is mounted no better than that; standard errors
FAR_ANGLE = np.radians(18.0)  # a turn that shows in the likeness, too
TURNED_LIKENESS = 0.9  # likeness of what is the same once it is turned


class Turned(NamedTuple):
    """angle, error [rad]: by which `other` is turned against `own`. alike, plain: likeness turned back and as is."""

    angle: float
    error: float
    alike: float
    plain: float


def turned(work: LogUnderCheck, reference: FloatArray, second: FloatArray, rate: FloatArray) -> Turned | None:
    """How `second` is turned against `reference`, shapes (rows, 2), in a robot that turns at `rate` [rad/s], (rows,).

    angle of other/own over short windows = angle + lag * rate + c cos(2 d) + s sin(2 d), d the direction of travel: a
    lag of one of the two and an axis with another scale are no turn. None where too little moves.
    """
    z, y, turning = (mean for mean in means(work, reference, second, np.nan_to_num(rate)[:, None]))
    z, y = z @ [1.0, 1.0j], y @ [1.0, 1.0j]
    size = np.abs(z)
    moving = size > MOVING_SHARE * np.quantile(size, 0.9) if size.size else np.zeros(0, dtype=bool)
    if moving.sum() < FEWEST_WINDOWS:
        return None
    z, y, turning, size = z[moving], y[moving], turning[moving, 0], size[moving]
    slope = (np.conj(z) * y).sum() / max(float(np.sqrt((size**2).sum() * (np.abs(y) ** 2).sum())), 1e-300)
    rest = np.angle(np.conj(z) * y * np.exp(-1j * np.angle(slope)))
    x = np.column_stack([np.ones(len(z)), turning, np.cos(2.0 * np.angle(z)), np.sin(2.0 * np.angle(z))])
    weighted = x * size[:, None]
    gram = weighted.T @ weighted
    gram += 1e-9 * np.trace(gram) * np.eye(4)
    inverse = np.linalg.inv(gram)
    solved = inverse @ (weighted.T @ (rest * size))
    residual = (rest - x @ solved) * size
    error = float(np.sqrt((residual @ residual) / (len(z) - 4) * inverse[0, 0]))
    return Turned(float(np.angle(slope) + solved[0]), error, float(abs(slope)), float(slope.real))


def is_turned(turn: Turned) -> bool:
    """Whether a turn is sure, and no matter of noise."""
    shows = turn.plain < turn.alike * np.cos(0.5 * turn.angle)
    large_turn = turn.alike > TURNED_LIKENESS and abs(turn.angle) > FAR_ANGLE and shows
    return bool(large_turn) or (
        turn.alike > TURNED_LIKENESS and abs(turn.angle) > LEAST_ANGLE and abs(turn.angle) > SURE_ERRORS * turn.error
    )


def marker_finding(turn: Turned, source: str, agrees: str = "") -> Finding:
    """The heading of a marker that is mounted at an angle.

    turn: of what `source` says, and `agrees` too, against the pose.
    """
    degrees = float(np.degrees(turn.angle))
    return Finding(
        "marker_angle",
        WARNING,
        "heading",
        {
            "angle_deg": degrees,
            "error_deg": float(np.degrees(turn.error)),
            "likeness": turn.alike,
            "likeness_as_logged": turn.plain,
            "source": source,
            "agrees": agrees,
        },
    )


def with_marker(work: LogUnderCheck, pose: FloatArray, angle: float) -> LogUnderCheck:
    """The work with the angle of the marker [rad] taken off the heading."""
    return work.replace(pose=pose - np.array([0.0, 0.0, angle]))
