"""What the model leaves: its size beside the normal curve, and how long it remembers."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.errors_from_start import errors_for_whiteness
from omnidyn.comparison.result import Comparison
from omnidyn.comparison.traces import Trace, unit
from omnidyn.comparison.whiteness import whiteness
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.report.style import (
    BLUE,
    GREY,
    INK,
    PALE,
    VERMILLION,
    WIDTH,
    Picture,
    log_scale,
    look,
    new_figure,
    picture,
    thin_out,
)
from omnidyn.sensors import COUNTED

MOST_CHANNELS, LAGS, BINS, SPAN = 4, 20, 41, 4.5
HEIGHT = 1.55  # inch, of a row


def draw_residuals(comparison: Comparison, noise: dict[str, float], name: str = "residuals", of: str = "") -> Picture:
    """A row per component: histogram of the errors over the noise of the fit, and their correlation over rows.

    noise: component -> std; without one the errors are divided by their own. of: which logs, in words.
    """
    traces = _traces(comparison)
    names = comparison.channels[:MOST_CHANNELS]
    height = HEIGHT * len(names) + 0.75
    with look():
        figure = new_figure(WIDTH, height)
        panels = figure.subplots(len(names), 2, squeeze=False)
        figure.subplots_adjust(
            left=0.13, right=0.975, top=1.0 - 0.3 / height, bottom=0.5 / height, hspace=0.32, wspace=0.24
        )
        for (left, right), key in zip(panels, names, strict=True):
            errors = errors_for_whiteness(key, traces)
            samples = _known(errors)
            std = noise.get(key) or float(np.std(samples)) or 1.0
            _histogram(left, samples / std)
            left.set_ylabel(key)
            test = whiteness(errors, LAGS)
            if test is not None:
                lags = np.arange(1, len(test.correlation) + 1)
                right.fill_between(lags, -test.bound, test.bound, color=PALE, linewidth=0.0)
                right.bar(lags, test.correlation, width=0.5, color=BLUE)
                bound = 1.2 * max(float(np.abs(test.correlation).max()), float(test.bound.max()), 0.05)
                right.set_ylim(-bound, bound)
            right.axhline(0.0, color=GREY, linewidth=0.8)
            right.set_xlim(0.2, LAGS + 0.8)
            thin_out(right, y=4)
        panels[0][0].set_title("error / noise, log scale")
        panels[0][1].set_title("correlation with later rows")
        panels[-1][0].set_xlabel("standard deviations")
        panels[-1][1].set_xlabel("rows later")
        sizes = ", ".join(f"{key} {noise[key]:.3g} {unit(key)}" for key in names if key in noise)
        caption = (
            f"Errors of the free run{of}. Left: their histogram (blue) and the normal curve that the intervals assume "
            "(dashed); wider shoulders mean outliers. Right: bars beyond the grey band mean that errors last: "
            f"noise with a memory, or what the model misses. Noise: {sizes or 'not known'}."
        )
        if any(component_channel(key) in COUNTED for key in names):
            caption += " Rounding by an encoder adds to that of an angle, and makes it flat."
        return picture(name, f"What the model leaves{of}", caption, figure)


def residuals_of(comparison: Comparison, component: str) -> FloatArray:
    """Errors of a component over all pieces, without what the start was off by. Shape (n,), in SI."""
    return _known(errors_for_whiteness(component, _traces(comparison)))


def _traces(comparison: Comparison) -> dict[str, list[Trace]]:
    robot = comparison.robots[0]
    return {key: [comparison.trace(robot, key, s) for s in comparison.segments] for key in comparison.channels}


def _known(errors: list[FloatArray]) -> FloatArray:
    return np.concatenate([error[np.isfinite(error)] for error in errors])


def _histogram(axes, scaled: FloatArray) -> None:
    edges = np.linspace(-SPAN, SPAN, BINS)
    density, _ = np.histogram(np.clip(scaled, -SPAN, SPAN), edges, density=True)
    middle = 0.5 * (edges[1:] + edges[:-1])
    axes.bar(middle, density, width=edges[1] - edges[0], color=BLUE, alpha=0.75)
    axes.plot(middle, np.exp(-0.5 * middle**2) / np.sqrt(2.0 * np.pi), "--", color=VERMILLION, linewidth=1.6)
    log_scale(axes, "y")
    axes.set_ylim(1e-4, 1.0)
    axes.set_xlim(-SPAN, SPAN)
    axes.set_yticks([1e-4, 1e-2, 1.0])
    axes.minorticks_off()
    axes.tick_params(colors=INK)
