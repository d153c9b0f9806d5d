"""Channels over time: of a Run, and one by one for the picture of a raw log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.clocks import has_own_clock, samples
from omnidyn.errors import InputError
from omnidyn.logs.channels import components
from omnidyn.logs.segments import segments
from omnidyn.report.style import (
    BLACK,
    BLUE,
    GREEN,
    INK,
    PALE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH,
    Picture,
    look,
    new_figure,
    picture,
    thin_out,
)
from omnidyn.run import UNITS, Run

COLOURS, LINES = (BLUE, VERMILLION, GREEN, PURPLE, SKY, BLACK), ("-", "--", "-.", ":", "-", "--")
MAX_POINTS = 3000
PANEL, EDGES, BETWEEN = 1.25, 1.05, 0.32  # [inch] high


def draw_run(run: Run, channels: Sequence[str] = ()) -> Picture:
    """A panel per channel of a run over time; gaps are hatched. channels: those to show, else all that were measured.

    Raises InputError for a channel that the run does not have.
    """
    names = [channels] if isinstance(channels, str) else list(channels) or list(run.channels)
    unknown = [name for name in names if name not in run.channels]
    if unknown or not names:
        raise InputError(
            "the run does not hold this",
            got=", ".join(unknown) or "no channel",
            expected=", ".join(run.channels) or "a run with a channel",
            where="channels",
        )
    total = PANEL * len(names) + BETWEEN * len(names) + EDGES
    with look():
        figure = new_figure(WIDTH, total)
        panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        figure.subplots_adjust(left=0.1, right=0.985, top=1.0 - 0.42 / total, bottom=0.6 / total, hspace=0.42)
        for axes, name in zip(panels, names, strict=True):
            draw_channel(axes, run.t, run.channels[name], name)
            hatch_gaps(axes, run.t)
        if len(run) > 1:
            panels[-1].set_xlim(float(run.t[0]), float(run.t[-1]))
        panels[-1].set_xlabel("time, s")
        return picture("run", run.source or "a run", "Every channel over time. Hatched: gaps.", figure)


def draw_channel(axes: Axes, t: FloatArray, values: FloatArray, name: str) -> None:
    """Every column of a channel over time, without a line across a gap; nothing of a column without any value."""
    values = values.reshape(len(t), -1)
    names = components(name, values.shape[1])
    few = slice(None, None, max(1, len(t) // MAX_POINTS))
    for k, column in enumerate(values.T):
        if np.isfinite(column).any():
            own = samples(t, column) if has_own_clock(t, column) else (t, column)
            at, column_values = _cut(*thinned(*own, few), t)
            axes.plot(
                at, column_values, LINES[k % len(LINES)], color=COLOURS[k % len(COLOURS)], linewidth=1.1, label=names[k]
            )
    unit = ", ".join(dict.fromkeys(UNITS[name].split(", ")))
    axes.set_title(f"{name.replace('_', ' ')}, {'-1 to 1' if unit == '1' else unit}")
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.94),
        ncols=len(names),
        fontsize=9.5,
        handlelength=1.6,
        borderaxespad=0.0,
        columnspacing=1.0,
    )
    thin_out(axes, y=4)


def thinned(t: FloatArray, values: FloatArray, few: slice) -> tuple[FloatArray, FloatArray]:
    """At most about MAX_POINTS points; of each stretch the lowest and the highest, so that no spike is lost."""
    stride = few.step
    if stride <= 2:
        return t, values
    n = len(values) // (2 * stride) * 2 * stride
    rows = values[:n].reshape(-1, 2 * stride)
    filled = np.where(np.isfinite(rows), rows, np.inf), np.where(np.isfinite(rows), rows, -np.inf)
    low, high = filled[0].argmin(axis=1), filled[1].argmax(axis=1)
    start = np.arange(len(rows)) * 2 * stride
    index = np.sort(np.stack([start + low, start + high], axis=1), axis=1).ravel()
    return t[index], values[index]


def _cut(t: FloatArray, values: FloatArray, all_times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same, with a break in each gap between all times `all_times`, so that no line is drawn across."""
    finite_times = all_times[np.isfinite(all_times)]
    if (np.diff(finite_times) < 0.0).any():
        return t, values
    starts = np.array([finite_times[piece.start] for piece in segments(finite_times)[1:]])
    places = np.searchsorted(t, starts)
    return np.insert(t, places, starts), np.insert(values, places, np.nan)


def hatch_gaps(axes: Axes, times: FloatArray) -> None:
    """Stretches in which nothing was recorded."""
    t = np.sort(times[np.isfinite(times)])
    for piece in segments(t)[1:]:
        axes.axvspan(
            float(t[piece.start - 1]),
            float(t[piece.start]),
            facecolor=PALE,
            edgecolor=INK,
            linewidth=0.0,
            hatch="//",
            zorder=0,
        )
