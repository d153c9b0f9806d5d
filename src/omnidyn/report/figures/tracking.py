"""Pictures of closed loops: the path seen from above, errors over time, voltages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.control.tracking import Tracking
from omnidyn.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
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

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
LINES = ("-", "--", "-.", ":")
MOST_POINTS = 4000
MOST_PANELS = 4


def draw_tracking(trackings: Iterable[Tracking]) -> Picture:
    """Where they went, and how far off they were over time."""
    tracking_list = list(trackings)
    with look():
        figure = new_figure(WIDTH, 4.6)
        plane = figure.add_axes((0.08, 0.12, 0.4, 0.72))
        distance_axes = figure.add_axes((0.59, 0.57, 0.4, 0.27))
        turned = figure.add_axes((0.59, 0.12, 0.4, 0.27))
        _plane(plane, tracking_list)
        _errors(distance_axes, tracking_list, lambda tracking: 1e3 * tracking.distance, "off the path, mm")
        _errors(turned, tracking_list, lambda tracking: 1e3 * tracking.error[:, 2], "heading off, mrad")
        turned.set_xlabel("time, s")
        handles, labels = plane.get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper left", ncols=4, bbox_to_anchor=(0.06, 1.0))
        first = tracking_list[0]
        caption = (
            f"Left: the path {first.path} and where {first.plant} went, from above; a ring is the start. Right: "
            f"distance from the path and error of the heading; what is before {first.skip:g} s (grey) does not count."
        )
        return picture("tracking", f"{first.plant} along {first.path}", caption, figure)


def _plane(axes: Axes, trackings: Sequence[Tracking]) -> None:
    """The path and the ways of the robots."""
    path_points = trackings[0].wanted[_kept(len(trackings[0].wanted))]
    axes.plot(path_points[:, 0], path_points[:, 1], color=GREY, linewidth=4.0, alpha=0.45, label="path")
    for k, tracking in enumerate(trackings):
        assert tracking.run.pose is not None
        pose = tracking.run.pose[_kept(len(tracking.run))]
        axes.plot(pose[:, 0], pose[:, 1], linewidth=1.4, **_style(k), label=tracking.controller)
    axes.plot(*path_points[0, :2], marker="o", markersize=8, markerfacecolor="none", color=INK)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    thin_out(axes, 5, 5)


def _errors(axes: Axes, trackings: Sequence[Tracking], of: Callable[[Tracking], FloatArray], words: str) -> None:
    """One error of all of them over time."""
    for k, tracking in enumerate(trackings):
        rows = _kept(len(tracking.run))
        axes.plot(tracking.run.t[rows], of(tracking)[rows], linewidth=1.3, **_style(k))
    axes.axvspan(0.0, trackings[0].skip, color=GREY, alpha=0.2, linewidth=0.0)
    axes.set_xlim(0.0, float(trackings[0].run.t[-1]))
    axes.set_title(words)
    thin_out(axes, 5, 4)


def draw_voltages(trackings: Sequence[Tracking], limit: FloatArray) -> Picture:
    """The voltages of each controller over time. limit [V]: of each motor, shape (wheels,)."""
    panels_shown = trackings[:MOST_PANELS]
    with look():
        figure = new_figure(WIDTH, 0.9 + 1.6 * len(panels_shown))
        panels = figure.subplots(len(panels_shown), 1, sharex=True, squeeze=False)[:, 0]
        bottom, top = 0.55 / (0.9 + 1.6 * len(panels_shown)), 1.0 - 0.35 / (0.9 + 1.6 * len(panels_shown))
        figure.subplots_adjust(left=0.07, right=0.985, bottom=bottom, top=top, hspace=0.35)
        for axes, tracking in zip(panels, panels_shown, strict=True):
            assert tracking.run.voltage is not None
            for wheel, volts in enumerate(tracking.run.voltage.T):
                axes.step(
                    tracking.run.t, volts, where="post", linewidth=1.1, **_style(wheel), label=f"motor {wheel + 1}"
                )
            for size in sorted(set(np.abs(limit).tolist())):
                axes.axhline(size, color=GREY, linewidth=0.9, linestyle=":")
                axes.axhline(-size, color=GREY, linewidth=0.9, linestyle=":")
            axes.set_title(f"{tracking.controller}: voltage, V")
            thin_out(axes, 8, 4)
        panels[0].legend(loc="lower right", ncols=6, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)
        panels[-1].set_xlabel("time, s")
        panels[-1].set_xlim(0.0, float(panels_shown[0].run.t[-1]))
        remark = f" The first {MOST_PANELS} of {len(trackings)} controllers." if len(trackings) > MOST_PANELS else ""
        words = f"What the controllers asked of the motors; dotted: the limit of the voltage.{remark}"
        return picture("voltages", "Voltages", words, figure)


def _style(k: int) -> dict[str, Any]:
    """A colour of its own for each, and another line where the colours begin anew."""
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": LINES[(k // len(COLOURS)) % len(LINES)]}


def _kept(count: int) -> slice:
    """Every so many of the samples: no picture shows more points than this."""
    return slice(None, None, max(1, count // MOST_POINTS))
