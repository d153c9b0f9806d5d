"""Fits of one robot beside each other: every number with its 95 % intervals, those that changed in colour."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from omnidyn.comparison.drift import Drift, Drifting
from omnidyn.model.keys import in_words, unit
from omnidyn.report.style import BLUE, GREY, VERMILLION, WIDTH, Picture, look, new_figure, picture

PANELS_IN_ROW, MOST_NUMBERS = 3, 15
LONGEST_NAME = 18  # letters of a name under a panel


def draw_drift(result: Drift) -> Picture:
    """One panel per number, its fits from left to right in the order given."""
    panels_shown = sorted(result.numbers, key=lambda number: number.p)[:MOST_NUMBERS]
    rows = math.ceil(len(panels_shown) / PANELS_IN_ROW)
    with look():
        figure = new_figure(WIDTH, 2.5 * rows + 0.2)
        figure.subplots_adjust(
            left=0.09, right=0.98, top=1.0 - 0.35 / (2.5 * rows), bottom=0.75 / (2.5 * rows), wspace=0.35, hspace=0.75
        )
        for k, number in enumerate(panels_shown):
            _panel(figure.add_subplot(rows, PANELS_IN_ROW, k + 1), number, result.fits)
        remark = (
            "" if len(panels_shown) == len(result.numbers) else f" The first {MOST_NUMBERS} of {len(result.numbers)}."
        )
        return picture(
            "drift",
            "Which numbers changed",
            "Fitted numbers with their 95 % intervals, fit by fit. In red: they differ by more than their errors "
            f"allow, all numbers counted. The line is the mean that fits them best.{remark}",
            figure,
        )


def _panel(axes: Axes, number: Drifting, fits: tuple[str, ...]) -> None:
    at = np.array([fits.index(name) for name in number.fits])
    colour = VERMILLION if number.changed else BLUE
    ends = np.array(number.ci95)
    error = np.maximum(np.stack([number.value - ends[:, 0], ends[:, 1] - number.value]), 0.0)
    weight = number.std**-2.0
    axes.axhline(float(weight @ number.value / weight.sum()), color=GREY, linewidth=1.0)
    axes.errorbar(at, number.value, yerr=error, fmt="o", color=colour, capsize=4, markersize=6)
    axes.set_xticks(range(len(fits)), [_short(name) for name in fits], rotation=30, ha="right", fontsize=8.0)
    axes.set_xlim(-0.5, len(fits) - 0.5)
    words = f"{in_words(number.key)}, {unit(number.key)}".rstrip(", ")
    axes.set_title(words, fontsize=9.0)
    axes.tick_params(axis="y", labelsize=8.0)


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"...{name[-LONGEST_NAME + 3 :]}"
