"""What would reconcile Table 3 with Table 1: one dot per number that was set free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.model.frames import AXES
from omnidyn.paper.reconcile import Reconciliation
from omnidyn.report.style import (
    BLUE,
    GREY,
    INK,
    PALE,
    WIDTH,
    Picture,
    look,
    new_figure,
    picture,
    thin_out,
)

NAMES = {
    "r": "wheel radius",
    "b": "robot radius",
    "R": "resistance",
    "drop": "driver drop",
    "friction": "all six friction numbers",
}


def draw_reconciliation(trials: Sequence[Reconciliation]) -> Picture:
    """Mean error that is left, in per cent of the largest speed of each axis, and how many rows agree."""
    sorted_trials = sorted((trial for trial in trials if trial.axes == AXES), key=lambda trial: trial.cost)
    with look():
        figure = new_figure(WIDTH, 0.6 + 0.36 * len(sorted_trials))
        axes = figure.add_axes((0.33, 0.15, 0.5, 0.76))
        place = np.arange(len(sorted_trials))[::-1]
        errors = [100.0 * trial.cost for trial in sorted_trials]
        axes.hlines(place, 0.0, errors, color=PALE, linewidth=5)
        axes.plot(errors, place, "o", color=BLUE, markersize=9)
        axes.set_yticks(place, [_name(trial) for trial in sorted_trials])
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(0.0, 1.1 * max(errors))
        thin_out(axes, x=5)
        axes.set_ylim(-0.7, len(sorted_trials) - 0.3)
        axes.grid(False, axis="y")
        axes.set_xlabel("error left (rms), % of the largest speed of the axis")
        axes.set_title("set free", color=GREY, x=-0.02, ha="right")
        for k, trial in zip(place, sorted_trials, strict=True):
            words = f"{trial.explained} of {trial.rows}"
            axes.text(1.03, k, words, transform=axes.get_yaxis_transform(), va="center", color=INK)
        axes.text(1.03, 1.02, "rows within 5 %", transform=axes.transAxes, va="bottom", color=GREY)
        return picture("fig6_reconcile", "What would reconcile Table 3 with Table 1", _reconcile_caption(), figure)


def _reconcile_caption() -> str:
    return (
        "Numbers of Table 3 set free, alone or in pairs, and fitted to all steady speeds of Table 1: the error "
        "that is left, and how many of the rows then agree."
    )


def _name(trial: Reconciliation) -> str:
    return " + ".join(NAMES[name] for name in trial.freed) or "nothing (Table 3)"
