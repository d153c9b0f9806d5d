"""How much of the logs is looked at: as many rows as leave all that is shown in them at once small enough to hold."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.output_error.problem.problem import Problem

NUMBERS = 25_000_000  # rows x columns x what is shown in each, that are held at once: 200 MB
ROWS, EFFECTS = 30_000, 600  # that are looked at, of `growing` those of a piece


def bounded(problem: Problem, beside: int = 0, growing: Sequence[int] = ()) -> Problem:
    """The problem on the beginnings of its pieces, so that at most NUMBERS numbers are shown in at most ROWS rows.

    beside: columns that are shown beside residuals and their slopes. growing: of each piece, columns beside these, of
    which fewer rows have fewer.
    """
    whole, even, more = 0, 0.0, 0.0
    for piece, own in zip(problem.pieces, growing or [0] * len(problem.pieces), strict=True):
        rows = piece.last - piece.first + 1
        numbers = rows * len(piece.record.columns)
        whole += rows
        even += numbers * (1 + len(problem.parameters) + len(piece.free) + beside)
        more += numbers * own
    # even s + more s^2 = NUMBERS for the share s, in the form that no small term spoils
    share = 2.0 * NUMBERS / (even + (even**2 + 4.0 * more * NUMBERS) ** 0.5)
    share = min(share, EFFECTS / max([1, *growing]))
    return problem.shortened(min(ROWS, int(share * whole)))
