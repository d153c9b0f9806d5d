"""Fig. 2: speed and current of the twelve experiments of Table 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.model.frames import AXES
from omnidyn.paper.tables import SPEED_UNIT, TABLE_1
from omnidyn.report.style import (
    INK,
    LEVEL_COLOURS,
    LEVEL_LINES,
    WIDTH,
    Picture,
    axis_title,
    look,
    new_figure,
    note,
    picture,
    thin_out,
)
from omnidyn.run import Run

TRACE_S = 1.0  # of each run; the rest is steady
TICKS = (0.0, 0.5, 1.0)
WORDS = "Lines: simulated with Table 3.   Dots: steady speed printed in Table 1 for the same voltages."


def draw_traces(runs: Mapping[str, Sequence[Run]]) -> Picture:
    """Speed above, current of the most driven wheel below; a column per axis, four voltages each."""
    with look():
        figure = new_figure(WIDTH, 6.0)
        panels = figure.subplots(2, len(AXES), sharex=True)
        figure.subplots_adjust(left=0.085, right=0.98, top=0.94, bottom=0.16, wspace=0.32, hspace=0.22)
        for column, axis in enumerate(AXES):
            _speeds(panels[0, column], axis, runs[axis])
            _currents(panels[1, column], axis, runs[axis])
        figure.text(0.085, 0.025, WORDS, fontsize=10)
        return picture("fig2_traces", "Fig. 2: speed and current of the runs of Table 1", _traces_caption(), figure)


def _traces_caption() -> str:
    return (
        "The twelve experiments of Table 1 from rest, simulated with the parameters of Table 3; each line carries "
        "its largest voltage. Above: speed, with the printed steady speed as a dot. Below: the current of the wheel "
        "that gets the largest voltage. The measured traces themselves are not in the text we work from."
    )


def _speeds(axes: Axes, axis: str, runs: Sequence[Run]) -> None:
    for k, (run, row) in enumerate(zip(runs, TABLE_1[axis], strict=True)):
        assert run.twist is not None
        rows = run.t <= TRACE_S
        speed = run.twist[rows, AXES.index(axis)]
        axes.plot(run.t[rows], speed, LEVEL_LINES[k], color=LEVEL_COLOURS[k])
        axes.plot([TRACE_S] * 2, [speed[-1], row.speed], color=LEVEL_COLOURS[k], linewidth=1.2, clip_on=False)
        axes.plot(
            [TRACE_S],
            [row.speed],
            "o",
            color=LEVEL_COLOURS[k],
            markeredgecolor=INK,
            markersize=7.5,
            clip_on=False,
            zorder=5,
        )
        words = f"{max(map(abs, row.voltage)):g} V"
        note(axes, 0.62 * TRACE_S, speed[-1], words, ha="center", va="bottom", fontsize=9.5, bbox=None)
    axes.set_title(f"{axis_title(axis)}: speed, {SPEED_UNIT[axis]}")
    axes.set_xlim(0.0, TRACE_S)
    axes.set_ylim(bottom=0.0)
    axes.set_xticks(TICKS)
    thin_out(axes, y=6)


def _currents(axes: Axes, axis: str, runs: Sequence[Run]) -> None:
    wheel = int(np.argmax(np.abs(TABLE_1[axis][-1].voltage)))
    for k, run in enumerate(runs):
        assert run.current is not None
        rows = run.t <= TRACE_S
        axes.plot(run.t[rows], run.current[rows, wheel], LEVEL_LINES[k], color=LEVEL_COLOURS[k])
    axes.set_title(f"current of wheel {wheel + 1}, A")
    axes.set_xlabel("time, s")
    thin_out(axes, y=6)
