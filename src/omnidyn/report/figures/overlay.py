"""Measured and models over time, one panel per component, with the error below: what `omnidyn compare` draws."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.clocks import has_own_clock, samples
from omnidyn.comparison.result import Comparison, Segment
from omnidyn.comparison.traces import unit
from omnidyn.errors import InputError
from omnidyn.report.style import BLUE, GREY, INK, MEASURED, PALE, VERMILLION, WIDTH, Picture, look, new_figure, picture

MOST_PANELS = 6
USUAL_PANELS = 3
DOTS = 150  # fewer samples than this are dots as well
COLOURS, LINES = (BLUE, VERMILLION), ("-", "--")
HEIGHT, EXTRA = 2.0, 1.0  # inch: of a panel with its errors; of title, legend and time axis


def draw_overlay(comparison: Comparison, log: int = 0, channels: Sequence[str] = ()) -> Picture:
    """One log of a comparison: measured (black) and each model in time, model minus measured below it.

    log: which of the logs, from 0. channels: components to show, at most six; by default the first three compared.
    Lines break where nothing was integrated; such gaps are grey. Raises InputError for unknown or too many components.
    """
    drawn_names = tuple(channels) or _usual(comparison, log)
    unknown = [name for name in drawn_names if name not in comparison.channels]
    if unknown or not 1 <= len(drawn_names) <= MOST_PANELS:
        raise InputError(
            "cannot draw these components",
            got=", ".join(unknown or drawn_names) or "none",
            expected=f"up to {MOST_PANELS} of {', '.join(comparison.channels)}",
            where="channels",
        )
    segments = [segment for segment in comparison.segments if segment.log == log]
    height = HEIGHT * len(drawn_names) + EXTRA
    with look():
        figure = new_figure(WIDTH, height)
        grid = figure.add_gridspec(
            3 * len(drawn_names) - 1,
            1,
            height_ratios=([2.0, 1.0, 0.14] * len(drawn_names))[:-1],
            hspace=0.12,
            left=0.13,
            right=0.965,
            top=1.0 - 0.45 / height,
            bottom=0.55 / height,
        )
        first = None
        for k, name in enumerate(drawn_names):
            above = figure.add_subplot(grid[3 * k], sharex=first)
            below = figure.add_subplot(grid[3 * k + 1], sharex=above)
            first = first or above
            _values(above, comparison, segments, name)
            _errors(below, comparison, segments, name, last=k == len(drawn_names) - 1)
            for axes in (above, below):
                _gaps(axes, segments)
        assert first is not None
        first.set_xlim(segments[0].begin, segments[-1].end)
        handles, names = first.get_legend_handles_labels()
        place = {"loc": "upper left", "bbox_to_anchor": (0.12, 0.995), "borderaxespad": 0.0}
        figure.legend(handles, names, ncols=len(names), **place)
        title = f"Measured and {' and '.join(comparison.robots)}"
        return picture("overlay", title, _caption(comparison, log, len(segments)), figure)


def _usual(comparison: Comparison, log: int) -> tuple[str, ...]:
    """The first components that this log holds."""
    indices = [k for k, segment in enumerate(comparison.segments) if segment.log == log]
    scores = comparison.by_segment[comparison.robots[0]]
    present = [name for name in comparison.channels if any(scores[name][k] is not None for k in indices)]
    return tuple(present[:USUAL_PANELS])


def _values(axes: Axes, comparison: Comparison, segments: Sequence[Segment], name: str) -> None:
    traces = [comparison.trace(comparison.robots[0], name, segment) for segment in segments]
    t, measured = _broken([_sampled(trace.t, trace.measured) for trace in traces])
    dots = {"marker": ".", "markersize": 4.0} if len(t) <= DOTS else {}
    axes.plot(t, measured, color=MEASURED, linewidth=0.9, label="measured", zorder=4, **dots)
    for robot, colour, line in zip(comparison.robots, COLOURS, LINES, strict=False):
        traces = [comparison.trace(robot, name, segment) for segment in segments]
        t, model = _broken([(trace.t, trace.model) for trace in traces])
        axes.plot(t, model, line, color=colour, linewidth=4.0, alpha=0.55, label=robot)
        _band(axes, comparison, segments, robot, name, colour)
    axes.set_ylabel(f"{name}, {unit(name)}")
    axes.yaxis.set_label_coords(-0.115, 0.5)  # where the widest labels of ticks leave it whole, and all in one line
    axes.tick_params(labelbottom=False)
    axes.locator_params(axis="y", nbins=5)


def _band(axes: Axes, comparison: Comparison, segments: Sequence[Segment], robot: str, name: str, colour: str) -> None:
    """Behind the lines, how far the model may be off by the std of its robot file."""
    label = "95 %"
    for segment in segments:
        ends = comparison.band(robot, name, segment)
        if ends is not None:
            t = comparison.trace(robot, name, segment).t
            axes.fill_between(t, *ends, color=colour, alpha=0.25, linewidth=0.0, zorder=1, label=label)
            label = ""


def _errors(axes: Axes, comparison: Comparison, segments: Sequence[Segment], name: str, last: bool) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    for robot, colour, line in zip(comparison.robots, COLOURS, LINES, strict=False):
        traces = [comparison.trace(robot, name, segment) for segment in segments]
        t, error = _broken([_sampled(trace.t, trace.error) for trace in traces])
        axes.plot(t, error, line, color=colour, linewidth=1.0)
        for segment, trace in zip(segments, traces, strict=True):
            ends = comparison.band(robot, name, segment)
            if ends is not None:  # where the error of a right model may lie, its numbers being off
                low, high = trace.model - ends[1], trace.model - ends[0]
                axes.fill_between(trace.t, low, high, color=colour, alpha=0.25, linewidth=0.0, zorder=1)
    axes.set_ylabel("error", color=INK)
    axes.yaxis.set_label_coords(-0.115, 0.5)
    axes.locator_params(axis="y", nbins=3)
    axes.tick_params(labelbottom=last)
    if last:
        axes.set_xlabel("time, s")


def _sampled(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and values of a piece; of a sensor with a clock of its own, at its own rows alone."""
    return samples(t, values) if has_own_clock(t, values) else (t, values)


def _broken(pieces: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Pieces one after the other, with a break between them."""
    gap = np.array([np.nan])
    times = [part for t, _ in pieces for part in (t, gap)][:-1]
    values = [part for _, value in pieces for part in (value, gap)][:-1]
    return np.concatenate(times), np.concatenate(values)


def _gaps(axes: Axes, segments: Sequence[Segment]) -> None:
    for begin, end in _between(segments):
        axes.axvspan(begin, end, color=PALE, linewidth=0.0, zorder=0)


def _between(segments: Sequence[Segment]) -> Iterator[tuple[float, float]]:
    for before, after in pairwise(segments):
        yield before.end, after.begin


def _caption(comparison: Comparison, log: int, count: int) -> str:
    source = comparison.measured[log].source or "one run"
    gaps = " Grey: gaps, after which every model starts anew from the measured state." if count > 1 else ""
    errors = "; ".join(
        f"{robot}: rmse " + ", ".join(f"{name} {metrics.rmse:.3g} {unit(name)}" for name, metrics in scores.items())
        for robot, scores in comparison.overall.items()
    )
    band = (
        " Bands: how far numbers that are off as the robot file says may bring it, 95 %; sensors add to that."
        if comparison.bands
        else ""
    )
    if any(run_band.draws == 0 for run_bands in comparison.bands.values() for run_band in run_bands.values()):
        band += " They are to first order: where a model rests they have no width."
    return (
        f"{source}: measured, and what each model does under {comparison.applied_text(comparison.robots[0])}, as a "
        f"free run that never sees the measurement. Below each: model minus measured.{gaps}{band} Over all logs, "
        f"{errors}."
    )
