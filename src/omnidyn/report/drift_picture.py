"""Fits of one robot beside each other: every number with its 95 % intervals, those that changed in colour."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from omnidyn.comparison.drift import Drift, Drifting
from omnidyn.model.keys import in_words, unit
from omnidyn.report.style import BLUE, GREY, VERMILLION, WIDTH, Picture, look, new_figure, picture

ACROSS, MOST = 3, 15
LONGEST = 18  # letters of a name under a panel


def draw_drift(found: Drift) -> Picture:
    """One panel per number, its fits from left to right in the order given."""
    shown = sorted(found.numbers, key=lambda each: each.p)[:MOST]
    rows = math.ceil(len(shown) / ACROSS)
    with look():
        figure = new_figure(WIDTH, 2.5 * rows + 0.2)
        figure.subplots_adjust(
            left=0.09, right=0.98, top=1.0 - 0.35 / (2.5 * rows), bottom=0.75 / (2.5 * rows), wspace=0.35, hspace=0.75
        )
        for k, each in enumerate(shown):
            _panel(figure.add_subplot(rows, ACROSS, k + 1), each, found.fits)
        more = "" if len(shown) == len(found.numbers) else f" The first {MOST} of {len(found.numbers)}."
        return picture(
            "drift",
            "Which numbers changed",
            "Fitted numbers with their 95 % intervals, fit by fit. In red: they differ by more than their errors "
            f"allow, all numbers counted. The line is the mean that fits them best.{more}",
            figure,
        )


def _panel(axes: Axes, each: Drifting, fits: tuple[str, ...]) -> None:
    at = np.array([fits.index(name) for name in each.fits])
    colour = VERMILLION if each.changed else BLUE
    ends = np.array(each.ci95)
    error = np.maximum(np.stack([each.value - ends[:, 0], ends[:, 1] - each.value]), 0.0)
    weight = each.std**-2.0
    axes.axhline(float(weight @ each.value / weight.sum()), color=GREY, linewidth=1.0)
    axes.errorbar(at, each.value, yerr=error, fmt="o", color=colour, capsize=4, markersize=6)
    axes.set_xticks(range(len(fits)), [_short(name) for name in fits], rotation=30, ha="right", fontsize=8.0)
    axes.set_xlim(-0.5, len(fits) - 0.5)
    words = f"{in_words(each.key)}, {unit(each.key)}".rstrip(", ")
    axes.set_title(words, fontsize=9.0)
    axes.tick_params(axis="y", labelsize=8.0)


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"...{name[-LONGEST + 3 :]}"
