"""What an instrument or a board says about itself above the names of the columns: model, settings, a greeting."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.logs.table import dialect

SURE_ROWS = 3  # rows of numbers, one below the other, that are surely a table


def preamble(texts: Sequence[str]) -> int:
    """Number of lines above the names that are no part of the table, 0 where it cannot be told.

    texts: first lines of a file, without comments and blank lines. The names are the words right above the first rows
    of numbers, with as many cells as those; no line above them has as many.
    """
    for separator in dialect.SEPARATORS:
        widths = [dialect.counts(text, separator)[0] for text in texts]
        rows = [width > 1 and dialect.looks_like_data(text) for width, text in zip(widths, texts, strict=True)]
        runs = (k for k in range(len(texts) - SURE_ROWS + 1) if all(rows[k : k + SURE_ROWS]))
        first = next((k for k in runs if len(set(widths[k : k + SURE_ROWS])) == 1), 0)
        names = first
        while names and widths[names - 1] == widths[first] and not rows[names - 1]:
            names -= 1
        if names < first and widths[first] not in widths[:names]:
            return names
    return 0
