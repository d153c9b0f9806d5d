"""How pictures look: one palette that colour-blind readers can tell apart, sizes, and the two file formats.

matplotlib is used through Figure and an Agg canvas: no pyplot, no window, no setting that outlives a picture. A
picture made twice is the same file, byte by byte.
"""

from __future__ import annotations

import contextlib
import io
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import matplotlib
import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator, NullFormatter

from omnidyn.model.frames import AXES
from omnidyn.paper.tables import PAPER_AXES

# Okabe & Ito 2008.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILLION, PURPLE = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#F0E442",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
)
INK, GREY, PALE = "#222222", "#767676", "#E4E4E4"

AXIS_COLOUR = {"x": BLUE, "y": VERMILLION, "yaw": GREEN}
LEVEL_COLOURS = (SKY, ORANGE, BLUE, PURPLE)  # small to large; each line carries its own words too
LEVEL_LINES = ("-", "--", "-.", ":")
MEASURED = BLACK

WIDTH = 8.0  # inch; text of 11 points stays readable at half the width
DPI = 150

LOOK = {
    "font.family": ["DejaVu Sans"],
    "font.size": 11.0,
    "axes.titlesize": 11.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # fixed: to look for a free place costs as much as the drawing
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.8,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "legend.fontsize": 10.0,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.parse_math": False,  # a name may hold a $, and is shown as it is
    "svg.hashsalt": "omnidyn",
    "svg.fonttype": "path",  # looks the same where the font is missing
    "path.simplify": True,
}

_DRAWING = threading.RLock()


@dataclass(frozen=True)
class Picture:
    """A figure with its words: name without ending, title, caption in plain words. Files are made when asked for."""

    name: str
    title: str
    caption: str
    figure: Figure = field(compare=False, repr=False)

    @cached_property
    def png(self) -> bytes:
        """The bytes of a PNG file; the same figure gives the same bytes."""
        return _saved(self.figure, "png")

    @cached_property
    def svg(self) -> bytes:
        """The bytes of an SVG file; the same figure gives the same bytes."""
        return _saved(self.figure, "svg")


@contextlib.contextmanager
def look() -> Iterator[None]:
    """Our style while it holds, whatever the user's matplotlibrc says; afterwards all is as before.

    The settings of matplotlib belong to the whole process: one thread draws at a time.
    """
    with _DRAWING, matplotlib.style.context(["default", LOOK]):
        yield


class NotebookFigure(Figure):
    """A Figure that a notebook shows without pyplot."""

    def _repr_png_(self) -> bytes:
        return _saved(self, "png")


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inch], drawn by Agg."""
    figure = NotebookFigure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def picture(name: str, title: str, caption: str, figure: Figure) -> Picture:
    """The figure with its words."""
    return Picture(name, title, caption, figure)


def _saved(figure: Figure, form: str) -> bytes:
    metadata = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
    stream = io.BytesIO()
    with look():
        figure.savefig(stream, format=form, dpi=DPI, metadata=metadata)
    return stream.getvalue()


def axis_panels(height: float, top: float, bottom: float) -> tuple[Figure, Sequence[Axes]]:
    """A figure of our width with one panel per body axis, side by side."""
    figure = new_figure(WIDTH, height)
    panels = figure.subplots(1, len(AXES))
    figure.subplots_adjust(left=0.075, right=0.985, top=top, bottom=bottom, wspace=0.3)
    return figure, panels


def dress_panel(axes: Axes, title: str, label: str, end: float, steps: int = 6, pad: float | None = None) -> None:
    """Words, range and ticks of such a panel: `label` runs from 0 to `end`."""
    axes.set_title(title, pad=pad)
    axes.set_xlabel(label)
    axes.set_xlim(0.0, end)
    thin_out(axes, 4, steps)


def thin_out(axes: Axes, x: int | None = None, y: int | None = None) -> None:
    """At most so many steps between ticks, so that their labels stay apart at half size."""
    if x is not None:
        axes.locator_params(axis="x", nbins=x)
    if y is not None:
        axes.locator_params(axis="y", nbins=y)


def log_scale(axes: Axes, axis_name: str) -> None:
    """A logarithmic "x" or "y" with plain labels: those of matplotlib are formulas, which no text here is read as."""
    axes.set(**{f"{axis_name}scale": "log"})
    axis_object = axes.xaxis if axis_name == "x" else axes.yaxis
    axis_object.set_major_formatter(lambda value, _: f"{value:g}")
    axis_object.set_minor_formatter(NullFormatter())


def axis_title(axis: str) -> str:
    """Name of a body axis with the paper's letter and the unit of its speed."""
    letter = PAPER_AXES[axis].replace("v_n", "vₙ").replace("w", "ω")
    return f"{axis} ({letter})"


FOUR_WAYS = {0.0: "x\nforward", 90.0: "y\nleft", 180.0: "180°", 270.0: "-90°"}


def around_robot(axes: PolarAxes, top: float, ways: Mapping[float, str] = FOUR_WAYS, room: float = 1.15) -> None:
    """Directions of travel as in the picture of the robot: forward is up, left is left.

    top: of what was drawn. ways: directions that are named [degree]. room: end of the scale, in tops. The numbers of
    the scale stand between two directions, on a ground of their own.
    """
    axes.set_theta_zero_location("N")
    axes.set_thetagrids(list(ways), list(ways.values()), fontsize=10.0)
    axes.set_ylim(0.0, room * top)
    ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, room * top)
    axes.set_rgrids([tick for tick in ticks if 0.0 < tick <= room * top], angle=-112.5, fontsize=9.5, color=INK)
    for label in axes.get_yticklabels():
        label.set(bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}, ha="center", va="center")
    axes.spines["polar"].set_visible(True)
    axes.spines["polar"].set_color(GREY)
    axes.grid(color=GREY, alpha=0.35)


def note(axes: Axes, x: float, y: float, words: str, **options) -> None:
    """Words at a place in the data, on a white ground that keeps lines away from them."""
    ground = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
    axes.text(x, y, words, **{"fontsize": 10.0, "bbox": ground, **options})
