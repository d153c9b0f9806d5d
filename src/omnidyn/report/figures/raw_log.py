"""A raw log: its channels over time, gaps shaded, and what `check` found above them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import FATAL, NOTE, WARN, Finding, Verdict
from omnidyn.logs.channels import components
from omnidyn.logs.log import Log
from omnidyn.logs.segments import segments
from omnidyn.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
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

UNITS = {"voltage": "V", "duty": "1", "current": "A", "wheel_angle": "rad", "wheel_speed": "rad/s",
         "wheel_speed_command": "rad/s", "twist": "m/s, rad/s", "twist_command": "m/s, rad/s", "pose": "m, rad",
         "supply": "V"}  # fmt: skip
ORDER = tuple(UNITS)
COLOURS, LINES = (BLUE, VERMILLION, GREEN, PURPLE, SKY, BLACK), ("-", "--", "-.", ":", "-", "--")
LEVELS = {FATAL: VERMILLION, WARN: ORANGE, NOTE: GREY}
MAX_POINTS, MAX_LANES = 3000, 9
LANE, PANEL, EDGES = 0.26, 1.25, 1.05  # [inch] high


def draw_raw_log(log: Log, verdict: Verdict) -> Picture:
    """The channels of a log as recorded, with the findings that have rows as bars above them."""
    channels = [name for name in ORDER if name in log.channels and np.isfinite(log.channels[name]).any()]
    lanes = [finding for finding in verdict.findings if finding.rows or finding.level != NOTE][:MAX_LANES]
    heights = ([LANE * len(lanes) + 0.1] if lanes else []) + [PANEL] * max(1, len(channels))
    total = sum(heights) + 0.32 * len(heights) + EDGES
    with look():
        figure = new_figure(WIDTH, total)
        panels = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights}, squeeze=False)[
            :, 0
        ]
        figure.subplots_adjust(left=0.185, right=0.985, top=1.0 - 0.42 / total, bottom=0.6 / total, hspace=0.42)
        if lanes:
            _lanes(panels[0], log, lanes)
        for axes, name in zip(panels[bool(lanes) :], channels, strict=False):
            _channel(axes, log, name)
        for axes in panels:
            _gaps(axes, log)
        good = log.t[np.isfinite(log.t)]
        if good.size > 1 and np.ptp(good) > 0.0:
            panels[-1].set_xlim(float(good.min()), float(good.max()))
        panels[-1].set_xlabel("time, s")
        return picture("raw_log", "The log as recorded", _caption(verdict), figure)


def _lanes(axes: Axes, log: Log, findings: Sequence[Finding]) -> None:
    """A line per finding: where its rows are; what is about the log as a whole is dotted."""
    shortest = 0.004 * float(np.nanmax(log.t) - np.nanmin(log.t)) if len(log) else 0.0
    for lane, finding in enumerate(findings):
        bars = []
        for first, last in finding.rows:
            a, b = np.searchsorted(log.lines, [first, last])
            times = log.t[a : min(b, len(log) - 1) + 1]
            times = times[np.isfinite(times)]
            if times.size:
                length = max(float(times.max() - times.min()), shortest)
                bars.append((float(times.min()), length))
        colour = LEVELS[finding.level]
        if finding.rows:
            axes.broken_barh(bars, (lane - 0.36, 0.72), facecolors=colour, edgecolors=colour)
        elif len(log):  # of the log as a whole
            axes.broken_barh([(float(np.nanmin(log.t)), float(np.ptp(log.t[np.isfinite(log.t)])))], (lane - 0.36, 0.72),
                             facecolors="none", edgecolors=colour, hatch="....")  # fmt: skip
    words = [_short(f"{finding.code} {finding.where}") for finding in findings]
    axes.set_yticks(range(len(findings)), words, fontsize=9.0)
    axes.set_ylim(len(findings) - 0.4, -0.6)
    axes.grid(visible=False)
    axes.set_title("found: red fatal, orange to heed, grey to know; dotted: the log as a whole")


def _short(text: str, limit: int = 17) -> str:
    return text if len(text) <= limit else text[: limit - 2] + ".."


def _channel(axes: Axes, log: Log, name: str) -> None:
    values = log.channels[name].reshape(len(log), -1)
    names = components(name, values.shape[1])
    few = slice(None, None, max(1, len(log) // MAX_POINTS))
    for k, column in enumerate(values.T):
        if np.isfinite(column).any():
            t, shown = _cut(*_thin(log.t, column, few), log)
            axes.plot(t, shown, LINES[k % len(LINES)], color=COLOURS[k % len(COLOURS)], linewidth=1.1, label=names[k])
    axes.set_title(f"{name.replace('_', ' ')}, {UNITS[name]}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.94), ncols=len(names), fontsize=9.5, handlelength=1.6,
                borderaxespad=0.0, columnspacing=1.0)  # fmt: skip
    thin_out(axes, y=4)


def _thin(t: FloatArray, values: FloatArray, few: slice) -> tuple[FloatArray, FloatArray]:
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


def _cut(t: FloatArray, values: FloatArray, log: Log) -> tuple[FloatArray, FloatArray]:
    """The same, with a break in each gap, so that no line is drawn across."""
    good = log.t[np.isfinite(log.t)]
    if (np.diff(good) < 0.0).any():
        return t, values
    starts = np.array([good[piece.start] for piece in segments(good)[1:]])
    places = np.searchsorted(t, starts)
    return np.insert(t, places, starts), np.insert(values, places, np.nan)


def _gaps(axes: Axes, log: Log) -> None:
    """Stretches in which nothing was recorded."""
    t = np.sort(log.t[np.isfinite(log.t)])
    for piece in segments(t)[1:]:
        axes.axvspan(float(t[piece.start - 1]), float(t[piece.start]), facecolor=PALE, edgecolor=INK, linewidth=0.0,
                     hatch="//", zorder=0)  # fmt: skip


def _caption(verdict: Verdict) -> str:
    words = "; ".join(
        f"{each.level}: {each.code} {each.where}".rstrip() for each in verdict.findings if each.level != NOTE
    )
    return f"{verdict.headline()}. {words or 'nothing to heed'}. Hatched: gaps."
