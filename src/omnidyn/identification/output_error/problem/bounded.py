"""How much of the logs is looked at: as many rows as leave all that is shown in them at once small enough to hold."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.output_error.problem.problem import Problem

NUMBERS = 25_000_000  # rows x columns x what is shown in each, that are held at once: 200 MB
ROWS, EFFECTS = 30_000, 600  # that are looked at, of `growing` those of a piece


def bounded(
    problem: Problem, extra_columns: int = 0, growing_columns: Sequence[int] = (), row_limit: int = ROWS
) -> Problem:
    """The problem on the beginnings of its pieces, so that at most NUMBERS numbers are shown in at most `row_limit`
    rows.

    extra_columns: columns that are shown beside residuals and their slopes. growing_columns: of each piece, columns
    beside these, of which fewer rows have fewer.
    """
    total_rows, fixed_numbers, growing_numbers = 0, 0.0, 0.0
    for piece, piece_columns in zip(problem.pieces, growing_columns or [0] * len(problem.pieces), strict=True):
        rows = piece.last - piece.first + 1
        numbers = rows * len(piece.record.columns)
        total_rows += rows
        fixed_numbers += numbers * (1 + len(problem.parameters) + len(piece.free) + extra_columns)
        growing_numbers += numbers * piece_columns
    # even s + more s^2 = NUMBERS for the share s, in the form that no small term spoils
    share = 2.0 * NUMBERS / (fixed_numbers + (fixed_numbers**2 + 4.0 * growing_numbers * NUMBERS) ** 0.5)
    share = min(share, EFFECTS / max([1, *growing_columns]))
    return problem.shortened(min(row_limit, int(share * total_rows)))
