"""The picture of a campaign: a metric over two variables, or log by log; its histogram, shares of its variance."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.campaigns.fits import ENDS
from omnidyn.campaigns.results import Campaign, Share
from omnidyn.errors import InsufficientDataError
from omnidyn.report.style import BLUE, GREY, VERMILLION, WIDTH, Picture, look, new_figure, picture, thin_out

IN_CELL, MOST_CELLS = 9, 40  # samples in a cell of the surface, on the average; cells along a side
MOST_POINTS, MOST_SHARES, MOST_LINES = 5000, 8, 30
LONGEST = 26  # letters of a name beside its bar


def draw_campaign(campaign: Campaign, metric: str = "", limit: float | None = None) -> Picture:
    """Response surface, histogram, shares of the variance. Raises InsufficientDataError without numbers."""
    name = campaign.metric(metric)
    values = campaign.column(name).astype(float) if name else np.empty(0)
    there = np.isfinite(values)
    if not there.any():
        raise InsufficientDataError("nothing to draw", got=f"no number of {name}", where=str(campaign.folder.path))
    shares = campaign.shares(name)
    order = [share.variable for share in shares] or list(campaign.variables)
    columns = {key: campaign.column(key) for key in order}
    numeric = [key for key, column in columns.items() if column.dtype != object and np.ptp(column) > 0.0]
    words = campaign.variables[0] if campaign.folder.spec.identify is not None else ""
    with look():
        figure = new_figure(WIDTH, 4.2)
        surface = figure.add_axes((0.22 if words else 0.09, 0.14, 0.27 if words else 0.4, 0.76))
        if words:
            _by_word(surface, campaign, words, name)
        elif len(numeric) > 1:
            x, y = (columns[key][there] for key in numeric[:2])
            colours = _surface(surface, x, y, values[there], limit)
            figure.colorbar(colours, cax=figure.add_axes((0.5, 0.14, 0.015, 0.76)))
            surface.set_ylabel(numeric[1])
        elif numeric:
            step = slice(None, None, max(1, int(there.sum()) // MOST_POINTS))
            surface.plot(columns[numeric[0]][there][step], values[there][step], ".", color=BLUE, markersize=3)
        surface.set_xlabel("" if words or not numeric else numeric[0])
        surface.set_title(name)
        if not words:
            thin_out(surface, 4, 5)
        _histogram(figure.add_axes((0.66, 0.64, 0.32, 0.26)), values[there], name, limit)
        _shares(figure.add_axes((0.8, 0.14, 0.18, 0.26)), shares[:MOST_SHARES])
        line = f"; the line is where it is {limit:g}" if limit is not None and len(numeric) > 1 else ""
        left = f"mean of {name} over the two variables that matter most{line}"
        if words:
            left = f"{name} of each fit, with its 95 % interval where it has one"
        caption = (
            f"Left: {left}. Right: how its {there.sum()} values "
            "are distributed, and which share of their variance each variable makes by itself, with 95 % intervals."
        )
        return picture("campaign", campaign.folder.spec.name or "Campaign", caption, figure)


def _by_word(axes: Axes, campaign: Campaign, key: str, name: str) -> None:
    """A metric of each sample, in the line of its word, with the interval that it has."""
    words, values = campaign.column(key), campaign.column(name)
    names = [*dict.fromkeys(words)]
    line = np.array([names.index(word) for word in words], dtype=float)
    for k in range(len(names)):  # samples of one line beside each other
        line[words == names[k]] += np.linspace(-0.2, 0.2, 2 * int(np.sum(words == names[k])) + 1)[1::2]
    ends = [campaign.column(f"{name}.{end}") for end in ENDS if f"{name}.{end}" in campaign.metrics]
    reach = np.abs(np.array(ends) - values) if len(ends) == len(ENDS) else None
    axes.errorbar(values, line, xerr=reach, fmt=".", color=BLUE, ecolor=GREY, markersize=5, elinewidth=1.0)
    shown = range(0, len(names), -(-len(names) // MOST_LINES))
    axes.set_yticks(shown, [_short(names[k]) for k in shown], fontsize=7.0)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(False, axis="y")


def _surface(axes: Axes, x: FloatArray, y: FloatArray, z: FloatArray, limit: float | None) -> Any:
    """Means of z in cells of the plane, and the line where they are at the limit."""
    cells = int(np.clip(np.sqrt(len(z) / IN_CELL), 3, MOST_CELLS))
    edges = [np.linspace(u.min(), u.max(), cells + 1) for u in (x, y)]
    count = np.histogram2d(x, y, edges)[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (np.histogram2d(x, y, edges, weights=z)[0] / count).T
    colours = axes.pcolormesh(*edges, mean, cmap="viridis", rasterized=True)
    axes.grid(False)
    inside = np.nanmin(mean) < limit < np.nanmax(mean) if limit is not None else False
    if limit is not None and inside:
        middles = [0.5 * (edge[1:] + edge[:-1]) for edge in edges]
        axes.contour(*middles, np.ma.masked_invalid(mean), [limit], colors=[VERMILLION], linewidths=2.0)
    return colours


def _histogram(axes: Axes, values: FloatArray, name: str, limit: float | None) -> None:
    """How often which value."""
    axes.hist(values, bins=min(60, max(10, round(np.sqrt(len(values))))), color=BLUE)
    if limit is not None:
        axes.axvline(limit, color=VERMILLION)
        axes.set_title(f"{100.0 * np.mean(values <= limit):.3g} % within {limit:g}")
    axes.set_xlabel(name)
    thin_out(axes, 4, 3)


def _shares(axes: Axes, shares: list[Share]) -> None:
    """Shares of the variance as bars, the largest on top."""
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("% of variance")
    if not shares:
        axes.text(0.5, 0.5, "too few samples", transform=axes.transAxes, ha="center", va="center")
        axes.set_yticks([])
        return
    at, middle = np.arange(len(shares)), np.array([100.0 * share.share for share in shares])
    ends = 100.0 * np.array([(share.low, share.high) for share in shares]).T
    axes.barh(at, middle, color=BLUE)
    axes.errorbar(
        middle, at, xerr=np.maximum([middle - ends[0], ends[1] - middle], 0.0), fmt="none", ecolor=GREY, capsize=3
    )
    axes.set_yticks(at, [_short(share.variable) for share in shares], fontsize=8.0)
    axes.invert_yaxis()
    axes.grid(False, axis="y")


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"...{name[-LONGEST + 3 :]}"
