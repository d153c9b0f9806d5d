"""A raw log: its channels over time, gaps shaded, and what `check` found above them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.findings.finding import Finding, Verdict
from omnidyn.logs.log import Log
from omnidyn.report.figures.channels import draw_channel, hatch_gaps
from omnidyn.report.style import GREY, ORANGE, VERMILLION, WIDTH, Picture, look, new_figure, picture
from omnidyn.run import CHANNELS
from omnidyn.statement import ERROR, NOTE, WARNING

COLOURS = {ERROR: VERMILLION, WARNING: ORANGE, NOTE: GREY}
MAX_LANES = 9
LANE, PANEL, EDGES = 0.26, 1.25, 1.05  # [inch] high
LABEL = 22  # characters that the margin holds


def draw_raw_log(log: Log, verdict: Verdict) -> Picture:
    """The channels of a log as recorded, with the findings that have rows as bars above them."""
    channels = [name for name in CHANNELS if name in log.channels and np.isfinite(log.channels[name]).any()]
    lanes = [finding for finding in verdict.findings if finding.rows or finding.severity != NOTE][:MAX_LANES]
    heights = ([LANE * len(lanes) + 0.1] if lanes else []) + [PANEL] * max(1, len(channels))
    total = sum(heights) + 0.32 * len(heights) + EDGES
    with look():
        figure = new_figure(WIDTH, total)
        panels = figure.subplots(len(heights), 1, sharex=True, gridspec_kw={"height_ratios": heights}, squeeze=False)[
            :, 0
        ]
        figure.subplots_adjust(
            left=0.215 if lanes else 0.1, right=0.985, top=1.0 - 0.42 / total, bottom=0.6 / total, hspace=0.42
        )
        if lanes:
            _lanes(panels[0], log, lanes)
        for axes, name in zip(panels[bool(lanes) :], channels, strict=False):
            draw_channel(axes, log.t, log.channels[name], name)
        for axes in panels:
            hatch_gaps(axes, log.t)
        finite_times = log.t[np.isfinite(log.t)]
        if finite_times.size > 1 and np.ptp(finite_times) > 0.0:
            panels[-1].set_xlim(float(finite_times.min()), float(finite_times.max()))
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
        colour = COLOURS[finding.severity]
        if finding.rows:
            axes.broken_barh(bars, (lane - 0.36, 0.72), facecolors=colour, edgecolors=colour)
        elif len(log):  # of the log as a whole
            axes.broken_barh(
                [(float(np.nanmin(log.t)), float(np.ptp(log.t[np.isfinite(log.t)])))],
                (lane - 0.36, 0.72),
                facecolors="none",
                edgecolors=colour,
                hatch="....",
            )
    axes.set_yticks(range(len(findings)), [_label(finding) for finding in findings], fontsize=9.0)
    axes.set_ylim(len(findings) - 0.4, -0.6)
    axes.grid(visible=False)
    axes.set_title("findings: red errors, orange warnings, grey notes; dotted: the log as a whole")


def _label(finding: Finding) -> str:
    """What was found and where, whole: places that are too many for the margin are counted."""
    words = f"{finding.code} {finding.subject}".rstrip().replace("_", " ")
    places = len(finding.subject.split())
    return words if len(words) <= LABEL or places < 2 else f"{finding.code} ({places})".replace("_", " ")


def _caption(verdict: Verdict) -> str:
    words = "; ".join(
        f"{finding.severity}: {finding.code} {finding.subject}".rstrip()
        for finding in verdict.findings
        if finding.severity != NOTE
    )
    return f"{verdict.headline()}. {words or 'no error, no warning'}. Hatched: gaps."
