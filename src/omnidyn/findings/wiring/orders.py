"""Orders and signs of columns, and the choice among them: which one the log calls for, and whether it can tell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.robust import windowed
from omnidyn.statement import ERROR, NOTE, Statement

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


def wiring_finding(
    answer: WiringChoice, names: tuple[str, ...], numbers: Mapping[str, object], remedy: str, rests_on: tuple[str, ...]
) -> Finding:
    """An error: columns of these names are in another order, or of the opposite sign.

    Its numbers: how well each order explains the log, `numbers`, what is mended, and another order that the log cannot
    tell from that one.
    """
    rival = answer.rival if answer.second is None else answer.second.statement(names)
    return Finding(
        code_of(answer.best),
        ERROR,
        " ".join(answer.best.touched(names)),
        {
            "unexplained_as_logged": answer.logged,
            "unexplained_put_right": answer.left,
            "as_good": float(answer.others),
            **numbers,
            "wiring": answer.best.statement(names),
            **({} if rival is None else {"rival": rival}),
        },
        remedy,
        rests_on=rests_on,
    )
